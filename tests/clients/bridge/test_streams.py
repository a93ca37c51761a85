"""What holds for every codec: any chunking, damage on the line, and its own encoder."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clients.bridge.codec import LONGEST_RECORD, Codec, LineBuffer
from clients.bridge.sample import Sample
from tests.clients.bridge.streams import CODECS, decode, gazes, points, records

MOST_LOST = 2
MOST_CHANGED = 1
"""A record whose digits were hit may still have its shape: no format has a checksum."""


def whole(name: str) -> tuple[bytes, list[Sample]]:
    """The codec's stream, and the samples of it."""
    stream = b"".join(records(CODECS[name]()))
    return stream, decode(CODECS[name](), [stream])


@pytest.mark.parametrize("name", CODECS)
def test_what_a_device_sends_is_what_is_read(name: str) -> None:
    codec = CODECS[name]()
    sent = points(codec)
    stream, samples = whole(name)
    begin = 1 if codec.__class__.__dict__.get("starts_mid_line") else 0
    received = gazes(samples)
    assert [point is None for point in received] == [point is None for point in sent[begin:]]
    both = [(a, b) for a, b in zip(received, sent[begin:], strict=True) if a is not None and b is not None]
    np.testing.assert_allclose([a for a, _ in both], [b for _, b in both], atol=0.05)
    assert all(b.first - (a.first + a.size) in (0, 1) for a, b in pairwise(samples))
    assert len(stream) - (samples[-1].first + samples[-1].size) in (0, 1)


@pytest.mark.parametrize("name", CODECS)
def test_samples_do_not_depend_on_how_the_stream_is_cut(name: str) -> None:
    stream, samples = whole(name)
    assert decode(CODECS[name](), [stream[i : i + 1] for i in range(len(stream))]) == samples
    for cut in range(0, len(stream), 1 + len(stream) // 900):
        assert decode(CODECS[name](), [stream[:cut], stream[cut:]]) == samples
    for size in (2, 3, 5, 7, 16, 61):
        assert decode(CODECS[name](), [stream[i : i + size] for i in range(0, len(stream), size)]) == samples


@settings(max_examples=60)
@given(name=st.sampled_from(list(CODECS)), cuts=st.lists(st.integers(0, 5000), max_size=20))
def test_samples_do_not_depend_on_any_cuts(name: str, cuts: list[int]) -> None:
    stream, samples = whole(name)
    at = sorted({0, len(stream), *(cut % len(stream) for cut in cuts)})
    assert decode(CODECS[name](), [stream[a:b] for a, b in pairwise(at)]) == samples


@pytest.mark.parametrize("kind", ["insert", "delete", "flip"])
@pytest.mark.parametrize("name", CODECS)
def test_one_damaged_byte_costs_at_most_two_samples_and_invents_none(name: str, kind: str) -> None:
    stream, samples = whole(name)
    generator = np.random.default_rng(7)
    for position in range(0, len(stream), 1 + len(stream) // 400):
        byte = generator.integers(256)
        check_damage(name, samples, damaged(stream, kind, position, int(byte)))


@settings(max_examples=300)
@given(
    name=st.sampled_from(list(CODECS)),
    kind=st.sampled_from(["insert", "delete", "flip"]),
    where=st.floats(0, 1, exclude_max=True),
    byte=st.integers(0, 255) | st.sampled_from(list(b'\r\n D"{}<>,. 0')),
)
def test_any_damaged_byte_costs_at_most_two_samples_and_invents_none(
    name: str, kind: str, where: float, byte: int
) -> None:
    stream, samples = whole(name)
    check_damage(name, samples, damaged(stream, kind, int(where * len(stream)), byte))


def damaged(stream: bytes, kind: str, position: int, byte: int) -> bytes:
    if kind == "insert":
        return stream[:position] + bytes((byte,)) + stream[position:]
    if kind == "delete":
        return stream[:position] + stream[position + 1 :]
    return stream[:position] + bytes((stream[position] ^ (byte or 1),)) + stream[position + 1 :]


def check_damage(name: str, samples: list[Sample], stream: bytes) -> None:
    """All but two samples come out, in order, and nothing else but perhaps the damaged one, changed."""
    true = [sample[2:] for sample in samples]
    found = [sample[2:] for sample in decode(CODECS[name](), [stream])]
    kept = common(true, found)
    assert kept >= len(true) - MOST_LOST, (name, stream)
    assert len(found) - kept <= MOST_CHANGED, (name, stream, found)
    assert len(found) <= len(true), (name, stream)


def common(one: list[tuple[object, ...]], other: list[tuple[object, ...]]) -> int:
    """Length of the longest sequence that is part of both, in order."""
    lengths = [0] * (len(other) + 1)
    for item in one:
        before = 0
        for index, candidate in enumerate(other, 1):
            above = lengths[index]
            lengths[index] = before + 1 if item == candidate else max(above, lengths[index - 1])
            before = above
    return lengths[-1]


@pytest.mark.parametrize("name", CODECS)
def test_a_stream_joined_in_the_middle_gives_only_true_samples(name: str) -> None:
    stream, samples = whole(name)
    for begin in range(1, len(stream) // 3, 1 + len(stream) // 300):
        found = decode(CODECS[name](), [stream[begin:]])
        assert [sample[2:] for sample in found] == [sample[2:] for sample in samples[len(samples) - len(found) :]]
        assert all(sample.first >= 0 for sample in found)


@pytest.mark.parametrize("name", CODECS)
def test_a_reopened_port_does_not_join_two_halves(name: str) -> None:
    parts = records(CODECS[name]())
    codec = CODECS[name]()
    codec.feed(b"".join(parts[:3]) + parts[4][: len(parts[4]) // 2])
    codec.reset()
    found = decode(codec, [parts[5][len(parts[5]) // 2 :], *parts[6:9]])
    expected = decode(CODECS[name](), [parts[5], *parts[6:9]])
    assert {sample[2:] for sample in found} <= {sample[2:] for sample in expected}
    assert len(found) >= 2


@pytest.mark.parametrize("name", CODECS)
def test_noise_is_counted_or_ignored_but_never_kept(name: str) -> None:
    codec = CODECS[name]()
    noise = np.random.default_rng(3).integers(0, 256, 4 * LONGEST_RECORD, dtype=np.uint8).tobytes()
    noise = noise.replace(b"\n", b"\0")
    assert len(decode(codec, [noise[i : i + 4096] for i in range(0, len(noise), 4096)])) <= len(noise) // 1000
    assert held_bytes(codec) <= LONGEST_RECORD


def held_bytes(codec: Codec) -> int:
    holder = getattr(codec, "_lines", codec)
    return len(holder._pending)


def test_an_endless_line_is_thrown_away_up_to_its_end() -> None:
    lines = LineBuffer()
    assert list(lines.feed(b"x" * (LONGEST_RECORD + 1))) == []
    assert lines.overlong == 1
    (rest, line) = lines.feed(b"tail\nwhole\n")
    assert (rest.text, line.text, line.first) == ("tail", "whole", LONGEST_RECORD + 6)
