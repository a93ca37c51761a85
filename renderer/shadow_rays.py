"""The rays that ask for a light: whether anything is in between."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.area_light import see_light, towards_light
from renderer.gather import pick
from renderer.kernel import formula, kernel
from renderer.light_samples import LightSamples, light_sample, light_seed
from renderer.lighting import in_front
from renderer.places import EYE, LIGHT_ROWS, LIGHTS, START, finish_of, surface_of
from renderer.prepared import Surfaces
from renderer.rays import Rays, ShadowRays
from renderer.reflectance import reflectance
from renderer.surface import OFFSET_ULPS, Surface


@formula
def ask_point_lights(
    light: NDArray[np.float32],
    lights: int,
    lane: int,
    sample: np.uint64,
    radiance: NDArray[np.float32],
    shadows: ShadowRays,
    n_shadows: int,
) -> int:
    """Write the shadow rays of one place to point lights, or add the light of those that cast none.

    Args:
        light: of `Places`.
        lights: how many there are.
        lane: which place.
        sample: camera sample of the block.
        radiance: (samples, 3) float32, added to.
        shadows: shadow rays; room for another `lights`.
        n_shadows: how many there are.

    Returns:
        How many there are now.
    """
    origin, direction, reach, carried, sample_of = shadows
    for row in range(LIGHTS, LIGHTS + LIGHT_ROWS * lights, LIGHT_ROWS):
        far = pick(light, row + 3, lane)
        if far > 0.0:
            to = np.uint64(n_shadows)
            origin[to, 0] = pick(light, START, lane)
            origin[to, 1] = pick(light, START + 1, lane)
            origin[to, 2] = pick(light, START + 2, lane)
            direction[to, 0] = pick(light, row, lane)
            direction[to, 1] = pick(light, row + 1, lane)
            direction[to, 2] = pick(light, row + 2, lane)
            reach[to] = far
            carried[to, 0] = pick(light, row + 4, lane)
            carried[to, 1] = pick(light, row + 5, lane)
            carried[to, 2] = pick(light, row + 6, lane)
            sample_of[to] = sample
            n_shadows += 1
        elif far == 0.0:
            radiance[sample, 0] += pick(light, row + 4, lane)
            radiance[sample, 1] += pick(light, row + 5, lane)
            radiance[sample, 2] += pick(light, row + 6, lane)
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
    shadows.origin[n_shadows, 0] = s.px + away * s.gx
    shadows.origin[n_shadows, 1] = s.py + away * s.gy
    shadows.origin[n_shadows, 2] = s.pz + away * s.gz
    shadows.direction[n_shadows, 0] = tx - away * s.gx
    shadows.direction[n_shadows, 1] = ty - away * s.gy
    shadows.direction[n_shadows, 2] = tz - away * s.gz
    shadows.reach[n_shadows] = reach
    shadows.light[n_shadows, 0] = red
    shadows.light[n_shadows, 1] = green
    shadows.light[n_shadows, 2] = blue
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
    wr, wg, wb = np.float64(weight[ray, 0]), np.float64(weight[ray, 1]), np.float64(weight[ray, 2])
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
            radiance[sample, 0] += light[ray, 0]
            radiance[sample, 1] += light[ray, 1]
            radiance[sample, 2] += light[ray, 2]
