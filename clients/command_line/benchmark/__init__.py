"""What `gazetrace bench` measures: rows of ratios, each of things timed in turn within one run.

`row` is what comes out, `job` what is measured on; `frame_rows`, `stage_rows`, `screen_rows`, `peer_rows` and
`stream_rows` measure and `selection` says which of them; `growth` fits how time grows, `start` times what a new
process takes.
"""
