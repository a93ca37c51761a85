"""What goes wrong at the bridge."""

from __future__ import annotations


class BridgeError(Exception):
    """What the bridge cannot do; the message is one line."""


class ConfigError(BridgeError):
    """A setting that cannot be used: no retry will mend it."""

    def __init__(self, setting: str, expected: str, found: object) -> None:
        super().__init__(f"{setting}: expected {expected}, found {found!r}")
        self.setting, self.expected, self.found = setting, expected, found


class PortError(BridgeError):
    """A port that is not there, or no longer; a retry may find it."""
