"""What nobody would send by mistake: requests and messages made up to break the service, and what they must not do.

`python -m tests.hostile http --cases 10000` and `python -m tests.hostile stream --messages 100000` are the long forms
of what the tests of this folder do in seconds. They start a service of their own on this machine.
"""
