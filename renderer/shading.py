"""What surfaces send back along rays: the light on them, and the rays they spawn (Whitted 1980).

Rays are shaded LANES at a time as far as they do the same; what they spawn is written one ray after another, in their
order, on which sums and samples depend.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.finishing import finish_off
from renderer.gather import entry, pick
from renderer.group import group_of, meet
from renderer.kernel import kernel, prefetch
from renderer.lanes import LANES, anywhere, whole
from renderer.light_samples import LightSamples
from renderer.lighting import light_beyond, light_up
from renderer.material_table import LIT, SPAWNS
from renderer.places import CALLS, SENT, Places
from renderer.prepared import Surfaces
from renderer.rays import Hits, Rays, ShadowRays
from renderer.shadow_rays import ask_area_lights, ask_point_lights
from renderer.spawning import CHILDREN, SHADOWS, send_on, write_children

AHEAD = 2 * LANES
"""How many rays ahead a triangle is fetched from memory: its latency over the time of one ray."""


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
        seen = (group.primitive >= 0) & (group.primitive < solids)
        if anywhere(seen):
            meet(surfaces, group, rows)
            s, finish = finish_off(surfaces, group, seen, rows)
            light_up(surfaces, group, seen, s, finish, places)
            if spawn and anywhere(finish.calls & SPAWNS != 0):
                send_on(surfaces, rays, primitive_of, first, group, seen, s, finish, cutoff, places)
        light_beyond(surfaces, group, seen, places)
        for ray in range(first, min(first + LANES, n)):
            # Unsigned, so that no code looks for indices that count from the end.
            lane, sample, primitive = ray - first, np.uint64(entry(sample_of, ray)), entry(primitive_of, ray)
            radiance[sample, 0] += pick(light, SENT, lane)
            radiance[sample, 1] += pick(light, SENT + 1, lane)
            radiance[sample, 2] += pick(light, SENT + 2, lane)
            if primitive < 0 or primitive >= solids:
                continue
            calls = whole(pick(rows, CALLS, lane))
            if calls & LIT != 0:
                n_shadows = ask_point_lights(light, point_lights, lane, sample, radiance, shadows, n_shadows)
                if area_lights > 0:
                    n_shadows = ask_area_lights(
                        surfaces, rays, ray, rows, lane, draws, radiance, shadows, n_shadows
                    )  # fmt: skip
            if spawn and calls & SPAWNS != 0:
                n_children = write_children(places, lane, sample, nested, children, n_children, counters)
    counters[CHILDREN] = n_children
    counters[SHADOWS] = n_shadows
