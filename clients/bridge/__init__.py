"""From an eye tracker to the service: bytes of a port, samples of a protocol, gaze on a screen, messages.

`codec` and one file a protocol turn bytes into a `sample`; `port` is where bytes come from.
"""
