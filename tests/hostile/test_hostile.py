"""The short forms of the attacks, and that they reach what they attack."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.hostile.in_use import watched_process
from tests.hostile.odd_names import ask_odd_names
from tests.hostile.requests import ask
from tests.hostile.state import FLAGS, Before
from tests.hostile.stream import attack
from tests.service.process import ServiceProcess

CASES = 200
MESSAGES = 1500


@pytest.fixture(scope="module")
def service() -> Iterator[ServiceProcess]:
    with watched_process(*FLAGS) as (service, in_use):
        yield service
        assert 10 << 20 < in_use() < service.resident_bytes


def test_every_reply_to_a_request_made_up_is_one_that_is_promised(service: ServiceProcess) -> None:
    before = Before(service)
    asked = ask(service.address, CASES)
    assert not asked.wrong
    assert asked.total >= CASES
    for operation in ("POST /v1/render", "GET /v1/scenes/{scene_id}/frame", "GET /v1/cellmap"):
        assert asked.replies[operation, 200], asked.replies
        assert asked.replies[operation, 422], asked.replies
    before.check()


def test_no_odd_name_is_a_scene(service: ServiceProcess) -> None:
    assert not ask_odd_names(service.address)


def test_mutated_messages_break_leak_and_block_nothing(service: ServiceProcess) -> None:
    before = Before(service)
    attacked = attack(service.address, MESSAGES)
    assert attacked.sent >= MESSAGES
    assert not attacked.mistakes
    assert attacked.closes[4400]
    before.check()
