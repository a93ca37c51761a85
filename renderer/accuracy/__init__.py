"""What accuracy costs in time: the same frame at many settings, each timed and held against a reference.

`grid` lists the settings; `reference` renders what they are held against; `measures` compares (`flip` and `vdp`
with the metrics of two optional packages); `timing` times them in turn; `record` is what comes out, and
`machine` says on what.
"""
