"""Whitted's loop over a block of camera samples: hit, shade, look for the lights, follow the mirrors."""

from __future__ import annotations

import threading
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera, ViewFrame, view_frame
from renderer.cutout import cast_through, pass_holes
from renderer.display import Display
from renderer.frame import RayCounts
from renderer.light_samples import LightSamples, seed_samples
from renderer.nested import media_at, pass_hidden
from renderer.places import make_places
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.rays import Rays, first_shadow_rays, make_rays, make_shadow_rays, some_rays
from renderer.sampling import camera_rays, lattice_order, lattice_step
from renderer.shading import shade
from renderer.shadow_rays import add_unblocked
from renderer.spawning import CHILDREN, COUNTERS, REFLECTIONS, REFRACTIONS, SHADOWS
from renderer.tonemap import SMALLEST_STEP

BLOCK_RAYS = 8192
"""Rays traced together: what they carry stays in a core's second-level cache."""

MAX_BLOCK_SHADOW_RAYS = 65_536
"""Bound on the shadow rays of a block; a scene of many lights gets smaller blocks."""


class View(NamedTuple):
    """A camera on a display in the units of a scene.

    Attributes:
        frame: ray directions.
        origin: (3,) float32 camera position in scene units.
        width, height: the screen [px].
        around: the media the camera is in.
    """

    frame: ViewFrame
    origin: NDArray[np.float32]
    width: int
    height: int
    around: int


class Cells(NamedTuple):
    """Cells to be sampled.

    Attributes:
        x, y, side: (n,) int32 cell vector of the whole map.
        chosen: (c,) int32 cells to sample.
        first, until: (c,) int32 samples first .. until - 1 of each.
    """

    x: NDArray[np.int32]
    y: NDArray[np.int32]
    side: NDArray[np.int32]
    chosen: NDArray[np.int32]
    first: NDArray[np.int32]
    until: NDArray[np.int32]


class _Scratch:
    """Room for the rays of a block, level by level; one per thread, kept between blocks."""

    def __init__(self, capacity: int, shadow_rays: int, lights: int) -> None:
        self.capacity = capacity
        self.shadow_rays = shadow_rays
        self.lights = lights
        self.places = make_places(lights)
        self.levels = [make_rays(2 * capacity)]
        self.shadows = make_shadow_rays(shadow_rays)
        self.counters = np.zeros(COUNTERS, dtype=np.int64)
        self.seed = np.zeros(capacity, dtype=np.uint64)
        self.number = np.zeros(capacity, dtype=np.int32)

    def level(self, depth: int) -> Rays:
        while len(self.levels) <= depth:
            self.levels.append(make_rays(2 * self.capacity))
        return self.levels[depth]


_local = threading.local()


def view_of(prepared: PreparedScene, camera: Camera, display: Display) -> View:
    """The view of `camera` on `display` in the units of `prepared`."""
    position = (np.array(camera.position, dtype=np.float64) - prepared.center) * prepared.scale
    origin = position.astype(np.float32)
    return View(view_frame(camera, display), origin, display.width_px, display.height_px, media_at(prepared, origin))


def block_rays(prepared: PreparedScene, quality: Quality) -> int:
    """Rays traced together in this scene."""
    return max(64, min(BLOCK_RAYS, MAX_BLOCK_SHADOW_RAYS // max(1, _most_shadow_rays(prepared, quality))))


def shadow_rays_each(quality: Quality) -> int:
    """Shadow rays that each camera sample of a cell sends to each area light: its share of the cell's."""
    return max(1, -(-quality.shadow_samples // quality.samples_per_cell))


def _has_media(prepared: PreparedScene) -> bool:
    return len(prepared.surfaces.indices) > 1


def _most_shadow_rays(prepared: PreparedScene, quality: Quality) -> int:
    """Most shadow rays that one surface point sends."""
    surfaces = prepared.surfaces
    return len(surfaces.lights) + len(surfaces.area_lights) * shadow_rays_each(quality)


def trace_cells(
    prepared: PreparedScene, view: View, cells: Cells, quality: Quality
) -> tuple[NDArray[np.float32], RayCounts]:
    """Radiance of camera samples of some cells.

    Args:
        prepared: the scene.
        view: the camera.
        cells: which cells and samples; these should not exceed `block_rays` unless it is a
            single cell.
        quality: samples a cell gets in the end, antialiasing and depth.

    Returns:
        (samples, 3) float32 radiance, the samples of a cell after one another, and the rays traced.
    """
    n = int((cells.until - cells.first).sum())
    block = block_rays(prepared, quality)
    lights = len(prepared.surfaces.lights)
    scratch = _scratch(max(block, n), block * _most_shadow_rays(prepared, quality), lights)
    points = quality.samples_per_cell
    step = lattice_step(points) if quality.antialiasing == "regular" else 0
    camera_rays(
        view.frame, view.origin, view.width, view.height, cells.x, cells.y, cells.side, cells.chosen,
        cells.first, cells.until, points, step, lattice_order(points), scratch.level(0),
    )  # fmt: skip
    if _has_media(prepared):
        scratch.level(0).around[:n] = view.around
    if len(prepared.surfaces.area_lights):
        seed_samples(cells.x, cells.y, cells.side, cells.chosen, cells.first, cells.until, scratch.seed, scratch.number)
    radiance = np.zeros((n, 3), dtype=np.float32)
    counts = _follow(prepared, scratch, n, block, quality, radiance)
    return radiance, counts


def _scratch(capacity: int, shadow_rays: int, lights: int) -> _Scratch:
    """This thread's scratch, with room for `capacity` rays a level, `shadow_rays`, `lights`; it never shrinks."""
    held: _Scratch | None = getattr(_local, "scratch", None)
    if held is None:
        held = _Scratch(capacity, shadow_rays, lights)
    elif held.capacity < capacity or held.shadow_rays < shadow_rays or held.lights < lights:
        held = _Scratch(max(capacity, held.capacity), max(shadow_rays, held.shadow_rays), max(lights, held.lights))
    _local.scratch = held
    return held


def _follow(
    prepared: PreparedScene, scratch: _Scratch, n: int, block: int, quality: Quality, radiance: NDArray[np.float32]
) -> RayCounts:
    """Trace `n` camera rays of level 0 and all that they spawn, the deepest pending level first.

    A level holds the children of one batch of at most `block` rays, so memory is bounded by depth.
    Batches end between samples wherever a sample's rays fit in one: what a sample adds up to, and in
    which order, does not depend on its neighbours in the block.
    """
    cutoff = SMALLEST_STEP / (prepared.scene.exposure * max(1.0, prepared.brightest))
    pending = [[0, n]]
    shadow_rays = reflections = refractions = 0
    while pending:
        depth = len(pending) - 1
        start, end = pending[depth]
        if start == end:
            pending.pop()
            continue
        rays = scratch.level(depth)
        stop = batch_end(rays.sample, start, end, block)
        pending[depth][0] = stop
        batch = some_rays(rays, start, stop)
        draws = LightSamples(scratch.seed, scratch.number, shadow_rays_each(quality), depth)
        spawned = _shade_batch(prepared, scratch, batch, draws, depth < quality.max_depth, cutoff, radiance)
        shadow_rays += int(spawned[SHADOWS])
        reflections += int(spawned[REFLECTIONS])
        refractions += int(spawned[REFRACTIONS])
        if spawned[CHILDREN]:
            pending.append([0, int(spawned[CHILDREN])])
    return RayCounts(n, shadow_rays, reflections, refractions)


def batch_end(sample: NDArray[np.int32], start: int, end: int, block: int) -> int:
    """Where the batch that begins at `start` ends: after at most `block` rays, between two samples.

    A single sample of more than `block` rays is cut after `block` of them.

    Args:
        sample: rising sample numbers of the rays.
        start, end: rays start .. end - 1 are pending.
        block: most rays of a batch.
    """
    if end - start <= block:
        return end
    limit = start + block
    boundary = start + int(np.searchsorted(sample[start:end], sample[limit]))
    return boundary if boundary > start else limit


def _shade_batch(
    prepared: PreparedScene,
    scratch: _Scratch,
    batch: Rays,
    draws: LightSamples,
    spawn: bool,
    cutoff: float,
    radiance: NDArray[np.float32],
) -> NDArray[np.int64]:
    """Trace one batch of rays, add what they see, and leave their children on the next level."""
    hits = prepared.intersector.nearest(batch.origin, batch.direction)
    if "cutouts" in prepared.plan.names:
        pass_holes(prepared.surfaces, prepared.intersector, batch.origin, batch.direction, hits)
    if _has_media(prepared):
        pass_hidden(prepared, batch.origin, batch.direction, batch.around, hits)
    counters = scratch.counters
    children = scratch.level(draws.depth + 1)
    shade(
        prepared.surfaces, batch, hits, spawn, cutoff, draws, scratch.places, children, scratch.shadows, radiance,
        counters,
    )  # fmt: skip
    pending = int(counters[SHADOWS])
    if pending:
        shadows = first_shadow_rays(scratch.shadows, pending)
        reach = None if prepared.sieve is None else shadows.reach.copy()
        blocked = prepared.intersector.occluded(shadows.origin, shadows.direction, shadows.reach)
        if prepared.sieve is not None and reach is not None:
            cast_through(prepared.sieve, shadows, reach, blocked)
        add_unblocked(shadows, blocked, radiance)
    return counters
