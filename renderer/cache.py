"""A cache bounded in bytes that forgets what was used longest ago."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


class _Making(Generic[V]):
    """A value being made: `made` holds it once `ended` is set, or nothing if making it failed."""

    def __init__(self) -> None:
        self.ended = threading.Event()
        self.made: list[V] = []


class ByteCache(Generic[K, V]):
    """Values by key, made on demand, at most `limit_bytes` of them together.

    Any number of threads may ask at once; a value that several ask for is made once. A value larger
    than the limit is handed out but not kept.

    Attributes:
        limit_bytes: the bound.
        hits, misses: requests answered without making the value, and values asked to be made.
    """

    def __init__(self, limit_bytes: int, size_of: Callable[[V], int]) -> None:
        self.limit_bytes = limit_bytes
        self.hits = 0
        self.misses = 0
        self._size_of = size_of
        self._values: OrderedDict[K, tuple[V, int]] = OrderedDict()
        self._nbytes = 0
        self._making: dict[K, _Making[V]] = {}
        self._lock = threading.Lock()

    @property
    def entries(self) -> int:
        """Number of values kept."""
        return len(self._values)

    @property
    def nbytes(self) -> int:
        """Bytes of the values kept."""
        return self._nbytes

    def get(self, key: K, make: Callable[[], V]) -> tuple[V, bool]:
        """The value of `key`, made by `make` if it is not there: (value, whether it was there).

        An exception of `make` passes to the caller; another thread that waited then makes it itself.
        """
        while True:
            with self._lock:
                held = self._values.get(key)
                if held is not None:
                    self._values.move_to_end(key)
                    self.hits += 1
                    return held[0], True
                making = self._making.get(key)
                if making is None:
                    making = self._making[key] = _Making()
                    self.misses += 1
                    break
            making.ended.wait()
            if making.made:
                with self._lock:
                    self.hits += 1
                return making.made[0], True
        try:
            value = make()
            self._keep(key, value)
            making.made.append(value)
        finally:
            with self._lock:
                del self._making[key]
            making.ended.set()
        return value, False

    def peek(self, key: K) -> V | None:
        """The value of `key` if it is there; this counts as no request and no use."""
        with self._lock:
            held = self._values.get(key)
            return None if held is None else held[0]

    def clear(self) -> None:
        """Forget every value."""
        with self._lock:
            self._values.clear()
            self._nbytes = 0

    def _keep(self, key: K, value: V) -> None:
        size = self._size_of(value)
        with self._lock:
            if size > self.limit_bytes:
                return
            self._values[key] = (value, size)
            self._nbytes += size
            while self._nbytes > self.limit_bytes:
                _, (_, freed) = self._values.popitem(last=False)
                self._nbytes -= freed
