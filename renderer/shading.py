"""What surfaces send back along rays: the light on them, and the rays they spawn (Whitted 1980).

Rays are shaded LANES at a time as far as they do the same; what they spawn is written one ray after another, in their
order, on which sums and samples depend.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.finishing import finish_off
from renderer.gather import along, entry, held, keep, lane_numbers
from renderer.group import group_of, meet
from renderer.kernel import formula, kernel, prefetch
from renderer.lanes import LANES, anywhere, whole
from renderer.light_samples import LightSamples
from renderer.lighting import light_beyond, light_up
from renderer.material_table import LIT, SPAWNS
from renderer.places import CALLS, SENT, TURN, Places
from renderer.prepared import Surfaces
from renderer.rays import Hits, Rays, ShadowRays
from renderer.scatter import add_marked
from renderer.shadow_rays import ask_area_lights, ask_point_lights
from renderer.spawning import CHILDREN, SHADOWS, send_on, write_children

AHEAD = 2 * LANES
"""How many rays ahead a triangle is fetched from memory: its latency over the time of one ray."""


@formula
def _take_turns(sample_of: NDArray[np.int32], first: int, n: int, rows: NDArray[np.float64]) -> int:
    """Write how many rays of the same sample are right before each of a group; return how many turns that makes.

    Rays of a sample add to it turn by turn: in their order, whatever else is in the group.
    """
    keep(rows, TURN, 0.0)
    alike = along(sample_of, first, n - 1) == along(sample_of, first + 1, n - 1)
    if not anywhere(alike & (lane_numbers(first) < n - 1)):
        return 1
    turns = turn = 0
    for lane in range(1, min(LANES, n - first)):
        turn = turn + 1 if sample_of[first + lane] == sample_of[first + lane - 1] else 0
        rows[TURN, lane] = turn
        turns = max(turns, turn)
    return turns + 1


@kernel
def shade(
    surfaces: Surfaces,
    rays: Rays,
    hits: Hits,
    spawn: bool,
    cutoff: float,
    draws: LightSamples,
    places: Places,
    children: Rays,
    shadows: ShadowRays,
    radiance: NDArray[np.float32],
    counters: NDArray[np.int64],
) -> None:
    """Add what rays see to their samples, and write the rays they call for, in the order of the rays.

    Args:
        surfaces: the scene.
        rays, hits: n rays and what they met.
        spawn: whether mirrors and boundaries may send further rays.
        cutoff: smallest weight worth a ray.
        draws: where on area lights the samples look.
        places: room for LANES of them, overwritten.
        children: room for 2n rays.
        shadows: room for n * (lights + area lights * draws.each) shadow rays.
        radiance: (samples, 3) float32, added to.
        counters: (COUNTERS,) int64, set.
    """
    facets, primitive_of, sample_of = surfaces.facets, hits.primitive, rays.sample
    rows, light, point_lights, area_lights = places.rows, places.light, len(surfaces.lights), len(surfaces.area_lights)
    solids, n = len(facets) + len(surfaces.spheres.radius), len(primitive_of)
    nested = len(surfaces.indices) > 1
    counters[:] = 0
    n_children = 0
    n_shadows = 0
    for first in range(0, n, LANES):
        for ray in range(first + AHEAD, min(first + AHEAD + LANES, n)):
            prefetch(facets, max(0, entry(primitive_of, ray)))
        group = group_of(rays, hits, first)
        inside = lane_numbers(first) < n
        seen = inside & (group.primitive >= 0) & (group.primitive < solids)
        lit, count = seen & False, min(LANES, n - first)
        if anywhere(seen):
            meet(surfaces, group, rows)
            s, finish = finish_off(surfaces, group, seen, rows)
            light_up(surfaces, group, seen, s, finish, places)
            lit = finish.calls & LIT != 0
            if spawn and anywhere(finish.calls & SPAWNS != 0):
                send_on(surfaces, rays, primitive_of, first, group, seen, s, finish, cutoff, places)
                n_children = write_children(places, sample_of, first, count, nested, children, n_children, counters)
        light_beyond(surfaces, group, seen, places)
        turns, sample = _take_turns(sample_of, first, n, rows), along(sample_of, first, n - 1)
        for turn in range(turns):
            marked = inside & (held(rows, TURN) == turn)
            add_marked(radiance, marked, sample, held(light, SENT), held(light, SENT + 1), held(light, SENT + 2))
            marked = marked & lit
            if anywhere(marked):
                n_shadows = ask_point_lights(light, point_lights, marked, sample, radiance, shadows, n_shadows)
                for lane in range(count if area_lights > 0 else 0):
                    if rows[TURN, lane] == turn and whole(rows[CALLS, lane]) & LIT != 0:
                        n_shadows = ask_area_lights(
                            surfaces, rays, first + lane, rows, lane, draws, radiance, shadows, n_shadows
                        )  # fmt: skip
    counters[CHILDREN] = n_children
    counters[SHADOWS] = n_shadows
