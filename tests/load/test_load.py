"""The short form: sessions share alike, and nothing grows."""

from __future__ import annotations

from tests.load.viewers import load
from tests.service.process import service_process

SECONDS = 10.0
LEAST_SHARE = 0.5
MOST_GROWTH_MIB = 128.0
"""What the allocator's reserves may still come to in so short a time; caches are full by then."""

SMALL_CACHES = ("--map-cache-bytes", str(8 << 20), "--store-bytes", str(8 << 20))


def test_sessions_share_alike_and_nothing_grows() -> None:
    with service_process("--threads", "2", *SMALL_CACHES) as service:
        found = load(service, viewers=20, sessions=5, seconds=SECONDS)
    assert not found.lost
    assert len(found.frames) == 5
    assert found.least_share >= LEAST_SHARE, found.frames
    assert found.request_ms
    assert found.memory_growth_mib < MOST_GROWTH_MIB
    assert max(found.descriptors) - min(found.descriptors) <= 2
    assert max(found.threads) - min(found.threads) <= 2
