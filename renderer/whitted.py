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
from renderer.intersection import Intersector, Solids, find_blocked, find_nearest
from renderer.kernel import Entry, entry_of, kernel, through
from renderer.levels import Levels, make_levels, next_batch, room_for_children, wait_for_children
from renderer.light_samples import LightSamples, seed_samples
from renderer.nested import media_at, pass_hidden
from renderer.prepared import PreparedScene, Surfaces
from renderer.quality import Quality
from renderer.rays import Hits, first_shadow_rays, some_rays
from renderer.sampling import camera_rays, lattice_order, lattice_step
from renderer.shading import shade
from renderer.shadow_rays import add_unblocked
from renderer.spawning import REFLECTIONS, REFRACTIONS, SHADOWS
from renderer.tonemap import SMALLEST_STEP

BLOCK_RAYS = 16_384
"""Rays traced together: enough of them that it does not matter what it takes to have Embree's tree, then the scene's
surfaces, then the tree once more in a core's second-level cache."""

MAX_BLOCK_SHADOW_RAYS = 65_536
"""Bound on the shadow rays of a block; a scene of many lights gets smaller blocks."""

KNOWN_SCENES = 64
"""Scenes of which it is remembered where their shading is compiled."""


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


class Limits(NamedTuple):
    """How far a block of camera samples is followed.

    Attributes:
        samples: how many there are.
        block: most rays of a batch.
        max_depth: how often a ray is sent on.
        shadow_rays_each: shadow rays of a camera sample to each area light.
        cutoff: smallest weight worth a ray.
    """

    samples: int
    block: int
    max_depth: int
    shadow_rays_each: int
    cutoff: float


_local = threading.local()
_entries: dict[object, Entry] = {}


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


@kernel
def samples_between(first: NDArray[np.int32], until: NDArray[np.int32]) -> int:
    """How many samples first .. until - 1 of each cell are, both (c,) int32."""
    samples = 0
    for cell in range(len(first)):
        samples += until[cell] - first[cell]
    return samples


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
    cutoff = SMALLEST_STEP / (prepared.scene.exposure * max(1.0, prepared.brightest))
    n = samples_between(cells.first, cells.until)
    limits = Limits(n, block_rays(prepared, quality), quality.max_depth, shadow_rays_each(quality), cutoff)
    levels = _levels_for(prepared, limits, quality)
    points = quality.samples_per_cell
    step = lattice_step(points) if quality.antialiasing == "regular" else 0
    camera_rays(
        view.frame, view.origin, view.width, view.height, cells.x, cells.y, cells.side, cells.chosen,
        cells.first, cells.until, points, step, lattice_order(points), levels.rays,
    )  # fmt: skip
    if _has_media(prepared):
        levels.rays.around[:n] = view.around
    if len(prepared.surfaces.area_lights):
        seed_samples(
            cells.x, cells.y, cells.side, cells.chosen, cells.first, cells.until, levels.seed, levels.number
        )  # fmt: skip
    radiance = np.zeros((n, 3), dtype=np.float32)
    levels.pending[0] = 0, n
    solids = _plain_solids(prepared)
    if solids is None:
        rays = _follow_past_holes(prepared, levels, limits, radiance)
    else:
        rays = _follow(
            _shading(prepared, levels, limits, radiance), solids, prepared.surfaces, levels, limits, radiance
        )
    return radiance, RayCounts(n, *rays)


def _levels_for(prepared: PreparedScene, limits: Limits, quality: Quality) -> Levels:
    """This thread's levels, with room for a block; it never shrinks."""
    shadow_rays = limits.block * _most_shadow_rays(prepared, quality)
    wanted = max(limits.block, limits.samples), limits.max_depth + 2, shadow_rays, len(prepared.surfaces.lights)
    sizes: tuple[int, ...] = getattr(_local, "sizes", (0, 0, 0, 0))
    if any(more > held for more, held in zip(wanted, sizes, strict=True)):
        _local.sizes = tuple(map(max, wanted, sizes))
        _local.levels = make_levels(*_local.sizes)
    levels: Levels = _local.levels
    return levels


def _plain_solids(prepared: PreparedScene) -> Solids | None:
    """What rays meet where each ends at the first thing in its way, so that kernels need nobody but Embree."""
    if _has_media(prepared) or "cutouts" in prepared.plan.names or prepared.sieve is not None:
        return None
    return prepared.intersector.solids() if isinstance(prepared.intersector, Intersector) else None


@kernel
def _follow(
    entry: Entry, solids: Solids, surfaces: Surfaces, levels: Levels, limits: Limits, radiance: NDArray[np.float32]
) -> tuple[int, int, int]:
    """Trace the camera rays that wait and all that they spawn, the deepest level first.

    Args:
        entry: of `shade`.
        solids: what rays meet.
        surfaces: what shading reads.
        levels: the rays.
        limits: how far they are followed.
        radiance: (samples, 3) float32, added to.

    Returns:
        Shadow rays, reflected and refracted rays.
    """
    rays, shadows, counters = levels.rays, levels.shadows, levels.counters
    asked = reflections = refractions = 0
    depth, start, stop = next_batch(levels, 0, limits.block)
    while depth >= 0:
        batch, n = some_rays(rays, start, stop), stop - start
        hits = Hits(levels.hits.primitive[:n], levels.hits.distance[:n])
        find_nearest(solids, batch.origin, batch.direction, hits)
        children = room_for_children(levels, depth)
        draws = LightSamples(levels.seed, levels.number, limits.shadow_rays_each, depth)
        spawn = depth < limits.max_depth
        through(
            entry,
            (surfaces, batch, hits, spawn, limits.cutoff, draws, levels.places, children, shadows, radiance, counters),
        )
        if counters[SHADOWS] > 0:
            some, blocked = first_shadow_rays(shadows, counters[SHADOWS]), levels.blocked[: counters[SHADOWS]]
            find_blocked(solids, some.origin, some.direction, some.reach, blocked)
            add_unblocked(some, blocked, radiance)
        asked += counters[SHADOWS]
        reflections += counters[REFLECTIONS]
        refractions += counters[REFRACTIONS]
        depth, start, stop = next_batch(levels, wait_for_children(levels, depth), limits.block)
    return asked, reflections, refractions


def _shading(prepared: PreparedScene, levels: Levels, limits: Limits, radiance: NDArray[np.float32]) -> Entry:
    """Where `shade` is compiled for a scene."""
    key = shade, prepared.identity
    if key not in _entries:
        if len(_entries) >= KNOWN_SCENES:
            _entries.clear()
        draws = LightSamples(levels.seed, levels.number, limits.shadow_rays_each, 0)
        _entries[key] = entry_of(
            shade, prepared.surfaces, levels.rays, levels.hits, True, limits.cutoff, draws, levels.places, levels.rays,
            levels.shadows, radiance, levels.counters,
        )  # fmt: skip
    return _entries[key]


def _follow_past_holes(
    prepared: PreparedScene, levels: Levels, limits: Limits, radiance: NDArray[np.float32]
) -> tuple[int, int, int]:
    """`_follow` batch by batch: where rays go on behind holes or hidden boundaries, or embreex is asked."""
    asked = reflections = refractions = 0
    depth, start, stop = next_batch(levels, 0, limits.block)
    while depth >= 0:
        _trace_batch(prepared, levels, limits, depth, start, stop, radiance)
        asked += int(levels.counters[SHADOWS])
        reflections += int(levels.counters[REFLECTIONS])
        refractions += int(levels.counters[REFRACTIONS])
        depth, start, stop = next_batch(levels, wait_for_children(levels, depth), limits.block)
    return asked, reflections, refractions


def _trace_batch(
    prepared: PreparedScene,
    levels: Levels,
    limits: Limits,
    depth: int,
    start: int,
    stop: int,
    radiance: NDArray[np.float32],
) -> None:
    """Trace rays start .. stop - 1 of a level, add what they see, and leave their children on the next one."""
    batch = some_rays(levels.rays, start, stop)
    hits = prepared.intersector.nearest(batch.origin, batch.direction)
    if "cutouts" in prepared.plan.names:
        pass_holes(prepared.surfaces, prepared.intersector, batch.origin, batch.direction, hits)
    if _has_media(prepared):
        pass_hidden(prepared, batch.origin, batch.direction, batch.around, hits)
    children = room_for_children(levels, depth)
    draws = LightSamples(levels.seed, levels.number, limits.shadow_rays_each, depth)
    shade(
        prepared.surfaces, batch, hits, depth < limits.max_depth, limits.cutoff, draws, levels.places, children,
        levels.shadows, radiance, levels.counters,
    )  # fmt: skip
    asked = int(levels.counters[SHADOWS])
    if asked:
        shadows = first_shadow_rays(levels.shadows, asked)
        reach = None if prepared.sieve is None else shadows.reach.copy()
        blocked = prepared.intersector.occluded(shadows.origin, shadows.direction, shadows.reach)
        if prepared.sieve is not None and reach is not None:
            cast_through(prepared.sieve, shadows, reach, blocked)
        add_unblocked(shadows, blocked, radiance)
