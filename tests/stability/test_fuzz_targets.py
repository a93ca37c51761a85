"""The targets of the fuzzer take what they begin with, and what comes of it by a little damage."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fuzz import NAMES
from tests.fuzz.targets import strict, targets
from tests.renderer.test_damaged_files import damaged


def test_every_target_has_a_name() -> None:
    assert len(NAMES) == len(set(NAMES))
    assert set(targets()) == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_target_takes_good_and_damaged_input(name: str) -> None:
    target, seeds = targets()[name]
    for number, seed in enumerate(seeds):
        strict(target, seed)
        for count, data in enumerate(damaged(seed, np.random.default_rng(number))):
            strict(target, data)
            if count == 20:
                break
