"""What the bridge says: a line an event, for people or as JSON, and not the same thing over and over."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from typing import Any

from clients.bridge.codec import SECOND_NS

REPEAT_NS = 10 * SECOND_NS
"""The same event is said again after so long at the earliest, with how often it came in between."""


class Log:
    """Writes events.

    Args:
        write: takes a line without its end.
        as_json: whether lines are JSON objects.
    """

    def __init__(self, write: Callable[[str], None], as_json: bool = False) -> None:
        self._write = write
        self._as_json = as_json
        self._lock = threading.Lock()
        self._said: dict[tuple[str, str], tuple[int, int]] = {}

    def say(self, event: str, text: str, **values: Any) -> None:
        """Say it, in any thread."""
        with self._lock:
            if self._as_json:
                record = {"time": round(time.time(), 3), "event": event, "text": text, **values}
                self._write(json.dumps(record, allow_nan=False))
            else:
                self._write(f"{event}: {text}")

    def say_once(self, event: str, text: str) -> None:
        """Say it unless it was said within the last seconds; then only count."""
        key, now_ns = (event, text), time.monotonic_ns()
        with self._lock:
            said_ns, times = self._said.get(key, (-REPEAT_NS, 0))
            if now_ns - said_ns < REPEAT_NS:
                self._said[key] = (said_ns, times + 1)
                return
            self._said[key] = (now_ns, 0)
        self.say(event, text if times == 0 else f"{text} ({times} times more since)")
