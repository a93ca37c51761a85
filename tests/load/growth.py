"""Whether a process grows with its work: a line through its memory over how much it has done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

BLOCKS = 20
"""The series is cut into so many parts of one length and the line fitted to their means: neighbours are alike, so they
count as one."""

ERRORS = 2.0
"""Standard errors on either side of the slope: 19 times in 20 the true one lies between."""


@dataclass(frozen=True, slots=True)
class Growth:
    """How memory goes with work: frames rendered, messages or requests answered.

    Attributes:
        slope: bytes for each.
        error: its standard error.
        done: how many it was seen over.
    """

    slope: float
    error: float
    done: int

    @property
    def flat(self) -> bool:
        """Whether the slope is not above 0 by more than chance."""
        return self.slope <= ERRORS * self.error

    @property
    def most(self) -> float:
        """The steepest growth that the series leaves possible, in bytes for each."""
        return self.slope + ERRORS * self.error

    def __str__(self) -> str:
        verdict = "flat" if self.flat else "GROWS"
        return (
            f"{verdict}: {self.slope:+.1f} +- {self.error:.1f} bytes for each of {self.done:,}, "
            f"so at most {self.most:.1f}"
        )


def growth_of(done: Sequence[int], memory_bytes: Sequence[float]) -> Growth:
    """The line of least squares through the means of `BLOCKS` parts of a series.

    Args:
        done: so far, not decreasing.
        memory_bytes: held then, as many, at least `BLOCKS`.

    Raises:
        ValueError: for fewer, or where nothing was done.
    """
    if len(done) != len(memory_bytes) or len(done) < BLOCKS or done[0] == done[-1]:
        raise ValueError(f"expected {BLOCKS} samples or more, over some work, found {len(done)}")
    across = np.array([part.mean() for part in np.array_split(np.asarray(done, dtype=np.float64), BLOCKS)])
    up = np.array([part.mean() for part in np.array_split(np.asarray(memory_bytes, dtype=np.float64), BLOCKS)])
    across -= across.mean()
    spread = float(across @ across)
    slope = float(across @ up) / spread
    left = up - up.mean() - slope * across
    error = float(np.sqrt(left @ left / (BLOCKS - 2) / spread))
    return Growth(slope, error, int(done[-1] - done[0]))
