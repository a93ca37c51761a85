"""The rays that ask for a light: whether anything is in between."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.area_light import see_light, towards_light
from renderer.gather import held
from renderer.kernel import formula, kernel
from renderer.lanes import anywhere, how_many
from renderer.light_samples import LightSamples, light_sample, light_seed
from renderer.lighting import in_front
from renderer.places import EYE, LIGHT_ROWS, LIGHTS, START, finish_of, surface_of
from renderer.prepared import Surfaces
from renderer.rays import Rays, ShadowRays
from renderer.reflectance import reflectance
from renderer.scatter import add_marked, put_marked
from renderer.surface import OFFSET_ULPS, Surface


@formula
def ask_point_lights(
    light: NDArray[np.float32],
    lights: int,
    marked: Any,
    sample: Any,
    radiance: NDArray[np.float32],
    shadows: ShadowRays,
    n_shadows: int,
) -> int:
    """Write the shadow rays of some places to point lights, or add the light of those that cast none.

    Args:
        light: of `Places`.
        lights: how many there are.
        marked: the places, all of different samples.
        sample: camera sample of each.
        radiance: (samples, 3) float32, added to.
        shadows: shadow rays; room for another `lights` of each place.
        n_shadows: how many there are.

    Returns:
        How many there are now.
    """
    origin, direction, reach, carried, sample_of = shadows
    for row in range(LIGHTS, LIGHTS + LIGHT_ROWS * lights, LIGHT_ROWS):
        far = held(light, row + 3)
        red, green, blue = held(light, row + 4), held(light, row + 5), held(light, row + 6)
        asks, adds = marked & (far > 0.0), marked & (far == 0.0)
        if anywhere(asks):
            put_marked(origin.x, n_shadows, asks, held(light, START))
            put_marked(origin.y, n_shadows, asks, held(light, START + 1))
            put_marked(origin.z, n_shadows, asks, held(light, START + 2))
            put_marked(direction.x, n_shadows, asks, held(light, row))
            put_marked(direction.y, n_shadows, asks, held(light, row + 1))
            put_marked(direction.z, n_shadows, asks, held(light, row + 2))
            put_marked(reach, n_shadows, asks, far)
            put_marked(carried.x, n_shadows, asks, red)
            put_marked(carried.y, n_shadows, asks, green)
            put_marked(carried.z, n_shadows, asks, blue)
            put_marked(sample_of, n_shadows, asks, sample)
            n_shadows += how_many(asks)
        if anywhere(adds):
            add_marked(radiance, adds, sample, red, green, blue)
    return n_shadows


@formula
def _send(
    s: Surface,
    tx: float,
    ty: float,
    tz: float,
    reach: float,
    red: float,
    green: float,
    blue: float,
    sample: int,
    radiance: NDArray[np.float32],
    shadows: ShadowRays,
    n_shadows: int,
) -> int:
    """Write the shadow ray that decides about a light from (tx, ty, tz) off; without reach, add the light as it is.

    Args:
        s: the surface.
        tx, ty, tz: vector to the light.
        reach: how far the shadow ray looks, in lengths of that vector; 0 or less for a light that casts no shadows.
        red, green, blue: what the light adds to the sample.
        sample: camera sample of the block.
        radiance: (samples, 3) float32, added to.
        shadows: shadow rays; room for another.
        n_shadows: how many there are.

    Returns:
        How many shadow rays there are now.
    """
    if not reach > 0.0:
        radiance[sample, 0] += red
        radiance[sample, 1] += green
        radiance[sample, 2] += blue
        return n_shadows
    away = s.offset + s.lift
    shadows.origin.x[n_shadows] = s.px + away * s.gx
    shadows.origin.y[n_shadows] = s.py + away * s.gy
    shadows.origin.z[n_shadows] = s.pz + away * s.gz
    shadows.direction.x[n_shadows] = tx - away * s.gx
    shadows.direction.y[n_shadows] = ty - away * s.gy
    shadows.direction.z[n_shadows] = tz - away * s.gz
    shadows.reach[n_shadows] = reach
    shadows.light.x[n_shadows] = red
    shadows.light.y[n_shadows] = green
    shadows.light.z[n_shadows] = blue
    shadows.sample[n_shadows] = sample
    return n_shadows + 1


@formula
def ask_area_lights(
    surfaces: Surfaces,
    rays: Rays,
    ray: int,
    rows: NDArray[np.float64],
    lane: int,
    draws: LightSamples,
    radiance: NDArray[np.float32],
    shadows: ShadowRays,
    n_shadows: int,
) -> int:
    """Add the light of lights with a size to the sample of a ray, or write the shadow rays that decide about it.

    Args:
        surfaces: the scene.
        rays, ray: the rays, and which of them.
        rows, lane: of `Places`, where what it met is written.
        draws: the camera samples of the block.
        radiance: (samples, 3) float32, added to.
        shadows: shadow rays; room for another l * draws.each.
        n_shadows: how many there are.

    Returns:
        How many shadow rays there are now.
    """
    s, finish = surface_of(rows, lane), finish_of(rows, lane)
    lights, sample, weight = surfaces.area_lights, rays.sample[ray], rays.weight
    wr, wg, wb = np.float64(weight.x[ray]), np.float64(weight.y[ray]), np.float64(weight.z[ray])
    vx, vy, vz = rows[EYE, lane], rows[EYE + 1, lane], rows[EYE + 2, lane]
    each = draws.each if draws.depth == 0 else 1
    for index in range(len(lights)):
        light = lights[index]
        if light.reaches == 0:
            continue
        view = see_light(light, s.px, s.py, s.pz)
        if not view.solid_angle > 0.0:
            continue
        seed = light_seed(draws.seed[sample], index, draws.depth)
        for turn in range(each):
            u, v = light_sample(seed, draws.number[sample] * each + turn)
            tx, ty, tz, share = towards_light(light, view, s.px, s.py, s.pz, u, v)
            inverse = 1.0 / math.sqrt(tx * tx + ty * ty + tz * tz)
            lx, ly, lz = tx * inverse, ty * inverse, tz * inverse
            cosine = lx * s.nx + ly * s.ny + lz * s.nz
            if not (cosine > 0.0 and in_front(finish, lx, ly, lz)):
                continue
            red, green, blue = reflectance(s, finish, cosine, lx, ly, lz, vx, vy, vz)
            share /= each
            red, green, blue = (
                wr * red * (light.red * share),
                wg * green * (light.green * share),
                wb * blue * (light.blue * share),
            )
            if not max(red, max(green, blue)) > 0.0:
                continue
            farthest = max(abs(s.px + tx), max(abs(s.py + ty), abs(s.pz + tz)))
            reach = 1.0 - OFFSET_ULPS * inverse * farthest
            n_shadows = _send(
                s, tx, ty, tz, reach if light.casts != 0 else 0.0, red, green, blue,
                sample, radiance, shadows, n_shadows,
            )  # fmt: skip
    return n_shadows


@kernel
def add_unblocked(shadows: ShadowRays, blocked: NDArray[np.uint8], radiance: NDArray[np.float32]) -> None:
    """Add the light of the shadow rays that reach it to their samples.

    Args:
        shadows: n shadow rays.
        blocked: (n,) uint8, 1 where something is in between.
        radiance: (samples, 3) float32.
    """
    light, sample_of = shadows.light, shadows.sample
    for ray in range(len(blocked)):
        if blocked[ray] == 0:
            sample = sample_of[ray]
            radiance[sample, 0] += light.x[ray]
            radiance[sample, 1] += light.y[ray]
            radiance[sample, 2] += light.z[ray]
