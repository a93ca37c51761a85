"""The cache: its bound, what it forgets first, and threads that ask for one value at once."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.cache import ByteCache

PATIENCE_S = 30.0
"""How long another thread may take; only a failing test waits that long."""


class Key:
    """A key that tells when it is looked up: from then on the thread is inside the cache's lock."""

    def __init__(self, name: str, looked_up: threading.Event | None = None) -> None:
        self.name = name
        self.looked_up = looked_up

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Key) and other.name == self.name

    def __hash__(self) -> int:
        if self.looked_up is not None:
            self.looked_up.set()
        return hash(self.name)


class Kettle:
    """Something that makes a value when told to: `begun` is set in it, and it ends on `finish`."""

    def __init__(self, value: int | Exception) -> None:
        self.value = value
        self.begun = threading.Event()
        self.finish = threading.Event()

    def __call__(self) -> int:
        self.begun.set()
        assert self.finish.wait(PATIENCE_S)
        if isinstance(self.value, Exception):
            raise self.value
        return self.value


def never() -> int:
    raise AssertionError("this value need not be made")


def integers(limit_bytes: int) -> ByteCache[object, int]:
    """A cache of integers that count for as many bytes as their value."""
    return ByteCache(limit_bytes, lambda value: value)


def ask_meanwhile(
    pool: ThreadPoolExecutor, cache: ByteCache[object, int], name: str, make: Callable[[], int]
) -> Future[tuple[int, bool]]:
    """Ask from another thread, and return once its key has been looked up."""
    key = Key(name, threading.Event())
    asked = pool.submit(cache.get, key, make)
    assert key.looked_up is not None
    assert key.looked_up.wait(PATIENCE_S)
    return asked


def test_a_value_is_made_once() -> None:
    cache = integers(100)
    assert cache.get("a", lambda: 7) == (7, False)
    assert cache.get("a", never) == (7, True)
    assert (cache.hits, cache.misses, cache.entries, cache.nbytes) == (1, 1, 1, 7)


def test_a_falsy_value_is_a_value() -> None:
    cache: ByteCache[str, object] = ByteCache(10, lambda _: 0)
    assert cache.get("a", lambda: None) == (None, False)
    assert cache.get("a", never) == (None, True)


def test_what_was_used_longest_ago_goes_first() -> None:
    cache = integers(30)
    for name in "abc":
        cache.get(name, lambda: 10)
    cache.get("a", never)
    cache.get("d", lambda: 10)
    for name in "acd":
        assert cache.get(name, never) == (10, True)
    assert cache.get("b", lambda: 10) == (10, False)


def test_a_value_of_the_limits_size_is_kept_and_a_larger_one_drives_nothing_out() -> None:
    cache = integers(30)
    cache.get("a", lambda: 30)
    assert cache.get("b", lambda: 31) == (31, False)
    assert cache.get("a", never) == (30, True)
    assert cache.get("b", lambda: 31) == (31, False)
    assert (cache.entries, cache.nbytes) == (1, 30)


def test_no_room_keeps_nothing_but_what_has_no_size() -> None:
    cache = integers(0)
    assert cache.get("a", lambda: 1) == (1, False)
    assert (cache.entries, cache.nbytes) == (0, 0)
    cache.get("b", lambda: 0)
    assert cache.get("b", never) == (0, True)


@given(st.integers(0, 60), st.lists(st.tuples(st.integers(0, 9), st.integers(0, 25)), max_size=80))
def test_the_bound_holds_and_the_order_of_use_decides(limit: int, requests: list[tuple[int, int]]) -> None:
    cache = integers(limit)
    model: OrderedDict[int, int] = OrderedDict()
    hits = 0
    for name, size in requests:
        known = name in model
        expected = model.pop(name, size)
        if expected <= limit:
            model[name] = expected
            while sum(model.values()) > limit:
                model.popitem(last=False)
        hits += known
        assert cache.get(name, lambda size=size: size) == (expected, known)
        assert cache.nbytes == sum(model.values()) <= limit
        assert cache.entries == len(model)
    assert (cache.hits, cache.misses) == (hits, len(requests) - hits)


def test_forgetting_everything_frees_the_room() -> None:
    cache = integers(30)
    cache.get("a", lambda: 20)
    cache.clear()
    assert (cache.entries, cache.nbytes) == (0, 0)
    assert cache.get("a", lambda: 30) == (30, False)
    assert cache.nbytes == 30


def test_a_failure_passes_to_the_one_who_asked_and_leaves_nothing_behind() -> None:
    cache = integers(100)
    with pytest.raises(ZeroDivisionError):
        cache.get("a", lambda: 1 // 0)
    assert (cache.entries, cache.nbytes) == (0, 0)
    assert cache.get("a", lambda: 7) == (7, False)


@pytest.mark.parametrize("size", [7, 1000], ids=["kept", "too large to keep"])
def test_threads_that_ask_at_once_share_one_making(size: int) -> None:
    cache = integers(100)
    kettle = Kettle(size)
    with ThreadPoolExecutor(5) as pool:
        first = pool.submit(cache.get, Key("a"), kettle)
        assert kettle.begun.wait(PATIENCE_S)
        others = [ask_meanwhile(pool, cache, "a", never) for _ in range(4)]
        kettle.finish.set()
        assert first.result(PATIENCE_S) == (size, False)
        assert [other.result(PATIENCE_S) for other in others] == [(size, True)] * 4
    assert (cache.hits, cache.misses) == (4, 1)
    assert cache.entries == (1 if size <= 100 else 0)


def test_a_failure_wakes_those_who_wait_and_one_of_them_makes_the_value() -> None:
    cache = integers(100)
    failing, working = Kettle(ValueError("cold")), Kettle(7)
    working.finish.set()
    with ThreadPoolExecutor(4) as pool:
        first = pool.submit(cache.get, Key("a"), failing)
        assert failing.begun.wait(PATIENCE_S)
        others = [ask_meanwhile(pool, cache, "a", working) for _ in range(3)]
        failing.finish.set()
        with pytest.raises(ValueError, match="cold"):
            first.result(PATIENCE_S)
        assert sorted(other.result(PATIENCE_S) for other in others) == [(7, False), (7, True), (7, True)]
    assert (cache.hits, cache.misses) == (2, 2)


def test_if_all_fail_each_hears_of_it() -> None:
    cache = integers(100)
    failing = Kettle(ValueError("cold"))
    with ThreadPoolExecutor(4) as pool:
        first = pool.submit(cache.get, Key("a"), failing)
        assert failing.begun.wait(PATIENCE_S)
        others = [ask_meanwhile(pool, cache, "a", failing) for _ in range(3)]
        failing.finish.set()
        for asked in (first, *others):
            with pytest.raises(ValueError, match="cold"):
                asked.result(PATIENCE_S)
    assert cache.get(Key("a"), lambda: 7) == (7, False)


def test_other_values_are_made_and_read_meanwhile() -> None:
    cache = integers(100)
    cache.get(Key("there"), lambda: 1)
    slow, other = Kettle(2), Kettle(3)
    with ThreadPoolExecutor(2) as pool:
        made = pool.submit(cache.get, Key("slow"), slow)
        assert slow.begun.wait(PATIENCE_S)
        assert cache.get(Key("there"), never) == (1, True)
        made_meanwhile = pool.submit(cache.get, Key("other"), other)
        assert other.begun.wait(PATIENCE_S)
        other.finish.set()
        assert made_meanwhile.result(PATIENCE_S) == (3, False)
        slow.finish.set()
        assert made.result(PATIENCE_S) == (2, False)
    assert cache.nbytes == 6


def test_many_threads_leave_the_books_in_order() -> None:
    cache = integers(40)
    with ThreadPoolExecutor(8) as pool:
        results = list(pool.map(lambda turn: cache.get(turn * 7 % 13, lambda: turn * 7 % 13), range(2000)))
    assert [value for value, _ in results] == [turn * 7 % 13 for turn in range(2000)]
    assert cache.hits + cache.misses == 2000
    assert sum(held for _, held in results) == cache.hits
    kept = [name for name in range(13) if cache.get(name, lambda: 1000)[1]]
    assert cache.entries == len(kept)
    assert cache.nbytes == sum(kept) <= 40
