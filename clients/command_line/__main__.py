"""Runs `gazetrace` as `python -m clients.command_line`."""

import sys

from clients.command_line import main

if __name__ == "__main__":
    sys.exit(main())
