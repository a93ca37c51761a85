"""Whether a process grows with its work: a line through its memory over the frames it has rendered."""

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
    """How memory goes with frames.

    Attributes:
        slope: [bytes/frame].
        error: its standard error [bytes/frame].
        frames: how many it was seen over.
    """

    slope: float
    error: float
    frames: int

    @property
    def flat(self) -> bool:
        """Whether the slope is not above 0 by more than chance."""
        return self.slope <= ERRORS * self.error

    @property
    def most(self) -> float:
        """The steepest growth that the series leaves possible [bytes/frame]."""
        return self.slope + ERRORS * self.error

    def __str__(self) -> str:
        verdict = "flat" if self.flat else "GROWS"
        return (
            f"{verdict}: {self.slope:+.0f} +- {self.error:.0f} bytes a frame over {self.frames:,} frames, "
            f"so at most {self.most:.0f}"
        )


def growth_of(frames: Sequence[int], memory_bytes: Sequence[float]) -> Growth:
    """The line of least squares through the means of `BLOCKS` parts of a series.

    Args:
        frames: rendered so far, not decreasing.
        memory_bytes: held then, as many, at least `BLOCKS`.

    Raises:
        ValueError: for fewer, or where no frame was rendered.
    """
    if len(frames) != len(memory_bytes) or len(frames) < BLOCKS or frames[0] == frames[-1]:
        raise ValueError(f"expected {BLOCKS} samples or more, over some frames, found {len(frames)}")
    across = np.array([part.mean() for part in np.array_split(np.asarray(frames, dtype=np.float64), BLOCKS)])
    up = np.array([part.mean() for part in np.array_split(np.asarray(memory_bytes, dtype=np.float64), BLOCKS)])
    across -= across.mean()
    spread = float(across @ across)
    slope = float(across @ up) / spread
    left = up - up.mean() - slope * across
    error = float(np.sqrt(left @ left / (BLOCKS - 2) / spread))
    return Growth(slope, error, int(frames[-1] - frames[0]))
