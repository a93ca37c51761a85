"""Flicker: what changes on the screen when only the gaze moves.

Scene and camera stand still, so nothing should change: the scene at full resolution stays the same, bit by bit,
wherever the eye looks. What changes nevertheless is flicker, which is seen even where no detail is. A pixel whose
cell stays the same keeps its colour exactly (with `nearest` reconstruction); one that gets another cell shows other
samples of the scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.acuity import MAX_MARGIN_DEG
from renderer.cellmap import CellMap
from renderer.eccentricity import eccentricity_deg
from renderer.frame import FrameRequest
from renderer.gaze import Gaze, GazeBucket
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.steady_gaze import slack_deg, steady_bucket, within
from renderer.store import LUMINANCE

PERIPHERY_DEG: Final = 5.0
"""Where the periphery begins: flicker that draws the eye comes from beyond [deg]."""

SCANLINE: Final = "scanline"
ALIGNED: Final = "aligned"
STEADY: Final = "aligned with hysteresis"
WAYS: Final = (SCANLINE, ALIGNED, STEADY)
"""What is compared: the two tilings, and the aligned one for a bucket that a gaze may leave a little."""


@dataclass(frozen=True, slots=True)
class FlickerStep:
    """What changes from one gaze of a walk to the next; attributes as in `Flicker`, of this step alone.

    Attributes:
        new_map: whether the map is another one.
        cells: of the later map.
    """

    new_map: bool
    cells: int
    changed_pixels: float
    change: float
    peripheral_change: float | None
    kept_cells_change: float


@dataclass(frozen=True, slots=True)
class Flicker:
    """What changes from one gaze of a walk to the next, with one way of mapping; means over all steps of the walk.

    Attributes:
        way: one of `WAYS`.
        steps: from one gaze to the next.
        map_changes: how many of them changed the map.
        cells: mean number of cells after a step.
        changed_pixels: share of the pixels that got another cell.
        change: mean absolute difference of luminance as the screen shows it, linear, 0 to 1, over all pixels.
        peripheral_change: the same over pixels 5 deg and more from the later gaze; None where there are none.
        kept_cells_change: largest difference of a pixel that kept its cell.
        step_changes: `change` of each step.
    """

    way: str
    steps: int
    map_changes: int
    cells: float
    changed_pixels: float
    change: float
    peripheral_change: float | None
    kept_cells_change: float
    step_changes: tuple[float, ...]


@dataclass(frozen=True, eq=False, slots=True)
class _Moment:
    """What is shown: cells, and luminance as (h, w) float64 from 0 to 1."""

    cells: CellMap
    light: NDArray[np.float64]


def flicker_steps(
    renderer: Renderer, prepared: PreparedScene, view: FrameRequest, walk: Sequence[Gaze], way: str, begin: int = 0
) -> Iterator[FlickerStep]:
    """Render a walk of the gaze and tell after each step what has changed.

    Args:
        renderer: keeps samples between frames, or it takes longer; what it kept changes nothing.
        prepared: the scene.
        view: display, camera and quality (of its map only the bucket); its gaze does not count.
        walk: the gazes, as far apart in time as frames are.
        way: one of `WAYS`.
        begin: the step to begin with, from 0; it and those after it are the same as with 0.
    """
    quality = _quality(view, way)
    before: _Moment | None = None
    for index, gaze in list(enumerate(_rendered_for(walk, way, quality.gaze_bucket_px)))[begin:]:
        now = _moment(renderer, prepared, replace(view, gaze=gaze, quality=quality, linear=True), before)
        if before is not None:
            yield _step(before, now, eccentricity_deg(view.display, walk[index]) >= PERIPHERY_DEG)
        before = now


def flicker(way: str, steps: Sequence[FlickerStep]) -> Flicker:
    """The steps of a walk put together.

    Raises:
        ValueError: if there are none.
    """
    if not steps:
        raise ValueError("steps: expected one or more, found none: a walk has two gazes or more")
    far = [step.peripheral_change for step in steps if step.peripheral_change is not None]
    return Flicker(
        way=way,
        steps=len(steps),
        map_changes=sum(step.new_map for step in steps),
        cells=float(np.mean([step.cells for step in steps])),
        changed_pixels=float(np.mean([step.changed_pixels for step in steps])),
        change=float(np.mean([step.change for step in steps])),
        peripheral_change=float(np.mean(far)) if far else None,
        kept_cells_change=max(step.kept_cells_change for step in steps),
        step_changes=tuple(step.change for step in steps),
    )


def _step(before: _Moment, now: _Moment, far: NDArray[np.bool_]) -> FlickerStep:
    """From one moment to the next; `far`, (h, w), are the pixels that count as peripheral."""
    other = _other_cell(before.cells, now.cells)
    difference = np.abs(now.light - before.light)
    return FlickerStep(
        new_map=now.cells.bucket != before.cells.bucket,
        cells=now.cells.cells,
        changed_pixels=float(other.mean()),
        change=float(difference.mean()),
        peripheral_change=float(difference[far].mean()) if far.any() else None,
        kept_cells_change=float(difference[~other].max(initial=0.0)),
    )


def _quality(view: FrameRequest, way: str) -> Quality:
    """What is asked for in every frame; with hysteresis, cells fine enough for a gaze that has left its bucket."""
    quality = replace(view.quality, map="scanline" if way == SCANLINE else "aligned")
    if way != STEADY:
        return quality
    display, acuity = view.display, quality.acuity
    pitch_cm = max(display.pitch_x_cm, display.pitch_y_cm)
    margin = acuity.margin_deg + slack_deg(quality.gaze_bucket_px, pitch_cm, display.distance_cm)
    return replace(quality, acuity=replace(acuity, margin_deg=min(margin, MAX_MARGIN_DEG)))


def _rendered_for(walk: Sequence[Gaze], way: str, side_px: int) -> Iterator[Gaze]:
    """The gazes that frames are rendered for; with hysteresis, within the bucket that each is taken to be in."""
    bucket: GazeBucket | None = None
    for gaze in walk:
        if way == STEADY:
            bucket = steady_bucket(bucket, gaze, side_px)
        yield gaze if bucket is None else within(bucket, gaze)


def _moment(renderer: Renderer, prepared: PreparedScene, request: FrameRequest, before: _Moment | None) -> _Moment:
    """What is shown for a gaze, which is what was shown before if the map is."""
    cells, _ = renderer.cell_map(request.display, request.quality, request.gaze)
    if before is not None and cells.bucket == before.cells.bucket:
        return before
    radiance = renderer.render(prepared, request).pixels.astype(np.float64)
    return _Moment(cells, np.clip(radiance * prepared.scene.exposure, 0.0, 1.0) @ np.array(LUMINANCE))


def _other_cell(before: CellMap, now: CellMap) -> NDArray[np.bool_]:
    """(h, w), True where a pixel's cell is another one."""
    if before is now:
        return np.zeros(now.mask.shape, dtype=np.bool_)
    pairs = ((before.x, now.x), (before.y, now.y), (before.side, now.side))
    return np.asarray(np.logical_or.reduce([old[before.mask] != new[now.mask] for old, new in pairs]))
