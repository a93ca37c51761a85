"""The paper's table of rays: how many the full and the gaze-dependent picture take, counted again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from renderer.cellmap import build_cell_map
from renderer.display import Display
from renderer.gaze import Gaze, bucket_of
from renderer.paper import published
from renderer.quality import Quality
from renderer.workers import Workers

UNSTATED_GAZE: Final = "the paper does not state the gaze of this number"


@dataclass(frozen=True, slots=True)
class RayCase:
    """One line of the table, before anything is counted.

    Attributes:
        name: of the method.
        display, gaze, quality: the picture.
        published_full, published: camera rays that the paper prints for the full and for this picture; None where
            it prints none.
        note: what differs from the paper, or "".
    """

    name: str
    display: Display
    gaze: Gaze
    quality: Quality
    published_full: float
    published: float | None
    note: str


@dataclass(frozen=True, slots=True)
class RayCount:
    """A line with its numbers.

    Attributes:
        case: what was counted.
        cells: of its cell map.
        full_rays, rays: camera rays of the full picture and of this one.
    """

    case: RayCase
    cells: int
    full_rays: int
    rays: int

    @property
    def ratio(self) -> float:
        """Full over gaze-dependent."""
        return self.full_rays / self.rays

    @property
    def published_ratio(self) -> float | None:
        """The same of the paper's numbers."""
        return None if self.case.published is None else self.case.published_full / self.case.published


CASES: Final = (
    RayCase(
        "paper's map",
        published.SCREEN,
        published.OFF_CENTRE_GAZE,
        published.QUALITY,
        published.FULL_RAYS,
        published.REDUCED_RAYS,
        f"{UNSTATED_GAZE}; at this one it comes out within 2 %",
    ),
    RayCase(
        "paper's map",
        published.SCREEN,
        published.GAZE,
        published.QUALITY,
        published.FULL_RAYS,
        published.REDUCED_RAYS,
        f"{UNSTATED_GAZE}; near the centre of the screen more of it is near the gaze",
    ),
    RayCase(
        "our default",
        published.SCREEN,
        published.OFF_CENTRE_GAZE,
        published.OUR_QUALITY,
        published.FULL_RAYS,
        None,
        "cells on a grid that serve every gaze within 16 px; the eye in front of the screen's centre",
    ),
    RayCase("our default", published.SCREEN, published.GAZE, published.OUR_QUALITY, published.FULL_RAYS, None, ""),
    RayCase(
        "paper's map",
        published.LARGE_SCREEN,
        published.LARGE_CENTRE,
        published.QUALITY,
        published.LARGE_FULL_RAYS,
        published.LARGE_REDUCED_RAYS,
        "gaze taken to be at the centre",
    ),
    RayCase(
        "our default",
        published.LARGE_SCREEN,
        published.LARGE_CENTRE,
        published.OUR_QUALITY,
        published.LARGE_FULL_RAYS,
        None,
        "",
    ),
)
"""The paper's three counts on its own map, and the same pictures as this renderer makes them by default."""


def count_rays(case: RayCase, pool: Workers) -> RayCount:
    """Build the cell map and count its camera rays; nothing is traced."""
    quality = case.quality
    bucket = bucket_of(case.gaze, quality.gaze_bucket_px)
    cells = build_cell_map(quality.map, case.display, quality.acuity, bucket, pool).cells
    samples = quality.samples_per_cell
    return RayCount(case, cells, case.display.pixels * samples, cells * samples)


def count_all(pool: Workers, tick: Callable[[], None] = lambda: None) -> tuple[RayCount, ...]:
    """Every line of the table.

    Args:
        pool: threads to build the maps on.
        tick: called after each.
    """
    counts = []
    for case in CASES:
        counts.append(count_rays(case, pool))
        tick()
    return tuple(counts)
