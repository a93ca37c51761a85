"""Many viewers at once, on this machine alone: `python -m tests.load --viewers 100 --sessions 20 --minutes 10`."""
