"""The light on a surface: what each light sends to the eye by way of it, and the shadow rays that ask for it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.area_light import see_light, towards_light
from renderer.finish import Finish
from renderer.kernel import formula, kernel
from renderer.light_samples import LightSamples, light_sample, light_seed
from renderer.rays import ShadowRays
from renderer.reflectance import reflectance
from renderer.surface import OFFSET_ULPS, Surface


@formula
def _is_behind(material: Any, finish: Finish, lx: float, ly: float, lz: float) -> bool:
    """Whether a bump looks through its own surface at the light in direction (lx, ly, lz)."""
    return bool(material.normal_picture >= 0 and finish.hx * lx + finish.hy * ly + finish.hz * lz <= 0.0)


@formula
def _light_to_eye(
    s: Surface,
    material: Any,
    finish: Finish,
    light: Any,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float, float]:
    """Radiance that a surface sends towards (vx, vy, vz) of one light,
    nothing being in between, and 1 over the light's distance; 0 for a light behind the surface or in it.
    """
    tx, ty, tz = light.x - s.px, light.y - s.py, light.z - s.pz
    square = tx * tx + ty * ty + tz * tz
    if not square > 0.0:
        return 0.0, 0.0, 0.0, 0.0
    inverse = 1.0 / math.sqrt(square)
    tx, ty, tz = tx * inverse, ty * inverse, tz * inverse
    cosine = tx * s.nx + ty * s.ny + tz * s.nz
    if cosine <= 0.0 or _is_behind(material, finish, tx, ty, tz):
        return 0.0, 0.0, 0.0, 0.0
    red, green, blue = reflectance(s, material, finish, cosine, tx, ty, tz, vx, vy, vz)
    falloff = inverse * inverse
    return red * (light.red * falloff), green * (light.green * falloff), blue * (light.blue * falloff), inverse


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
def light_from_points(
    s: Surface,
    material: Any,
    finish: Finish,
    wr: float,
    wg: float,
    wb: float,
    vx: float,
    vy: float,
    vz: float,
    sample: int,
    lights: NDArray[np.void],
    radiance: NDArray[np.float32],
    shadows: ShadowRays,
    n_shadows: int,
) -> int:
    """Add the light of the point lights to a sample, or write the shadow rays that decide about it.

    Args:
        s: the surface.
        material: its row of the material table.
        finish: the material at this place.
        wr, wg, wb: share of the surface's light that reaches the eye.
        vx, vy, vz: direction `towards_eye`.
        sample: camera sample of the block.
        lights: (l,) LIGHT.
        radiance: (samples, 3) float32, added to.
        shadows: shadow rays; room for another l.
        n_shadows: how many there are.

    Returns:
        How many there are now.
    """
    for index in range(len(lights)):
        light = lights[index]
        red, green, blue, inverse = _light_to_eye(s, material, finish, light, vx, vy, vz)
        red, green, blue = wr * red, wg * green, wb * blue
        if not max(red, max(green, blue)) > 0.0:
            continue
        reach = 1.0 - OFFSET_ULPS * inverse * max(abs(light.x), max(abs(light.y), abs(light.z)))
        tx, ty, tz = light.x - s.px, light.y - s.py, light.z - s.pz
        n_shadows = _send(
            s, tx, ty, tz, reach if light.casts != 0 else 0.0, red, green, blue, sample, radiance, shadows, n_shadows
        )
    return n_shadows


@formula
def light_from_areas(
    s: Surface,
    material: Any,
    finish: Finish,
    wr: float,
    wg: float,
    wb: float,
    vx: float,
    vy: float,
    vz: float,
    sample: int,
    lights: NDArray[np.void],
    draws: LightSamples,
    radiance: NDArray[np.float32],
    shadows: ShadowRays,
    n_shadows: int,
) -> int:
    """The same as `light_from_points` for lights with a size.

    Args:
        s, material, finish, wr, wg, wb, vx, vy, vz, sample, radiance, n_shadows: as there.
        lights: (l,) AREA_LIGHT.
        draws: the camera samples of the block.
        shadows: shadow rays; room for another l * draws.each.

    Returns:
        How many shadow rays there are now.
    """
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
            if not cosine > 0.0 or _is_behind(material, finish, lx, ly, lz):
                continue
            red, green, blue = reflectance(s, material, finish, cosine, lx, ly, lz, vx, vy, vz)
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
