"""What a surface sends back along a ray: Phong's local light, and the rays it spawns (Whitted 1980)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.fresnel import fresnel, refracted_cosine
from renderer.kernel import formula, kernel, prefetch
from renderer.prepared import BOUNDARY, LIT, MIRROR, SPECULAR, Surfaces
from renderer.rays import Hits, Rays, ShadowRays
from renderer.surface import OFFSET_ULPS, Surface, sphere_surface, triangle_surface
from renderer.texture import look_up

INVERSE_PI = 1.0 / math.pi

AHEAD = 12
"""How many rays ahead a triangle is fetched from memory: its latency over the time of one ray."""

CHILDREN = 0
SHADOWS = 1
REFLECTIONS = 2
REFRACTIONS = 3
COUNTERS = 4
"""Slots of the counters that `shade` fills: rays spawned, shadow rays, and the former by kind."""


@formula
def phong_lobe(s: Surface, lx: float, ly: float, lz: float, vx: float, vy: float, vz: float, shininess: float) -> float:
    """(R.V)^shininess, R the mirror image of the direction to the light; 0 where R faces away from V.

    Args:
        s: the surface.
        lx, ly, lz: unit direction to the light.
        vx, vy, vz: direction to the eye, of unit length but for float32 rounding, which a large exponent
            would turn into a factor.
        shininess: exponent, 0 to 1e9.
    """
    twice = 2.0 * (s.nx * lx + s.ny * ly + s.nz * lz)
    cosine = (twice * s.nx - lx) * vx + (twice * s.ny - ly) * vy + (twice * s.nz - lz) * vz
    if not cosine > 0.0:
        return 0.0
    return float(min(1.0, cosine / math.sqrt(vx * vx + vy * vy + vz * vz)) ** shininess)


@formula
def _light_to_eye(
    s: Surface,
    material: Any,
    kr: float,
    kg: float,
    kb: float,
    light: Any,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float, float]:
    """Radiance that a surface of diffuse albedo (kr, kg, kb) sends towards (vx, vy, vz) of one light,
    nothing being in between, and 1 over the light's distance; 0 for a light behind the surface or in it.
    """
    tx, ty, tz = light.x - s.px, light.y - s.py, light.z - s.pz
    square = tx * tx + ty * ty + tz * tz
    if not square > 0.0:
        return 0.0, 0.0, 0.0, 0.0
    inverse = 1.0 / math.sqrt(square)
    tx, ty, tz = tx * inverse, ty * inverse, tz * inverse
    cosine = tx * s.nx + ty * s.ny + tz * s.nz
    if cosine <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    matt = cosine * INVERSE_PI
    red, green, blue = kr * matt, kg * matt, kb * matt
    if material.calls & SPECULAR != 0:
        gloss = phong_lobe(s, tx, ty, tz, vx, vy, vz, material.shininess)
        red += material.specular_red * gloss
        green += material.specular_green * gloss
        blue += material.specular_blue * gloss
    falloff = inverse * inverse
    return red * (light.red * falloff), green * (light.green * falloff), blue * (light.blue * falloff), inverse


@formula
def _mirrored(s: Surface, dx: float, dy: float, dz: float) -> tuple[float, float, float]:
    """Unit direction of the mirror ray; where a bent normal would send it into the surface, the face's own is used."""
    d = 2.0 * (dx * s.nx + dy * s.ny + dz * s.nz)
    rx, ry, rz = dx - d * s.nx, dy - d * s.ny, dz - d * s.nz
    if rx * s.gx + ry * s.gy + rz * s.gz <= 0.0:
        d = 2.0 * (dx * s.gx + dy * s.gy + dz * s.gz)
        rx, ry, rz = dx - d * s.gx, dy - d * s.gy, dz - d * s.gz
    inverse = 1.0 / math.sqrt(rx * rx + ry * ry + rz * rz)
    return rx * inverse, ry * inverse, rz * inverse


@formula
def _bent(
    s: Surface, eta: float, cosine: float, refracted: float, dx: float, dy: float, dz: float
) -> tuple[float, float, float]:
    """Unit direction of the refracted ray (Snell's law in vector form); eta = 1 goes straight on."""
    if eta == 1.0:
        return dx, dy, dz
    bend = eta * cosine - refracted
    rx, ry, rz = eta * dx + bend * s.nx, eta * dy + bend * s.ny, eta * dz + bend * s.nz
    if rx * s.gx + ry * s.gy + rz * s.gz >= 0.0:
        return dx, dy, dz
    inverse = 1.0 / math.sqrt(rx * rx + ry * ry + rz * rz)
    return rx * inverse, ry * inverse, rz * inverse


@kernel
def shade(
    surfaces: Surfaces,
    rays: Rays,
    hits: Hits,
    spawn: bool,
    cutoff: float,
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
        children: room for 2n rays.
        shadows: room for n * lights shadow rays.
        radiance: (samples, 3) float32, added to.
        counters: (COUNTERS,) int64, set.
    """
    # Arrays are taken out of their records once: doing it in the loop counts references for each ray.
    facets = surfaces.facets
    center, radius, sphere_material = surfaces.spheres.center, surfaces.spheres.radius, surfaces.spheres.material
    materials, lights, around = surfaces.materials, surfaces.lights, surfaces.surroundings
    texels, pictures, linear = surfaces.textures.texels, surfaces.textures.pictures, surfaces.textures.linear
    origin, direction, weight, sample_of = rays.origin, rays.direction, rays.weight, rays.sample
    primitive_of, hit_u, hit_v = hits.primitive, hits.u, hits.v
    child_origin, child_direction = children.origin, children.direction
    child_weight, child_sample = children.weight, children.sample
    shadow_origin, shadow_direction, shadow_reach = shadows.origin, shadows.direction, shadows.reach
    shadow_light, shadow_sample = shadows.light, shadows.sample
    triangles = len(facets)
    counters[:] = 0
    n_children = 0
    n_shadows = 0
    for ray in range(len(primitive_of)):
        if ray + AHEAD < len(primitive_of):
            prefetch(facets, max(0, primitive_of[ray + AHEAD]))
        sample = sample_of[ray]
        wr, wg, wb = np.float64(weight[ray, 0]), np.float64(weight[ray, 1]), np.float64(weight[ray, 2])
        dx, dy, dz = np.float64(direction[ray, 0]), np.float64(direction[ray, 1]), np.float64(direction[ray, 2])
        primitive = primitive_of[ray]
        if primitive < 0:
            high = min(1.0, max(0.0, dy))
            low = 1.0 - high
            radiance[sample, 0] += wr * (high * around[0, 0] + low * around[1, 0])
            radiance[sample, 1] += wg * (high * around[0, 1] + low * around[1, 1])
            radiance[sample, 2] += wb * (high * around[0, 2] + low * around[1, 2])
            continue
        if primitive < triangles:
            s = triangle_surface(facets, primitive, np.float64(hit_u[ray]), np.float64(hit_v[ray]), dx, dy, dz)
        else:
            k = primitive - triangles
            s = sphere_surface(
                center[k, 0], center[k, 1], center[k, 2], radius[k], int(np.int64(sphere_material[k])),
                np.float64(origin[ray, 0]), np.float64(origin[ray, 1]), np.float64(origin[ray, 2]),
                dx, dy, dz,
            )  # fmt: skip
        material = materials[s.material]
        kr, kg, kb = float(material.diffuse_red), float(material.diffuse_green), float(material.diffuse_blue)
        if material.picture >= 0:
            picture = pictures[material.picture]
            tr, tg, tb = look_up(texels, linear, picture.start, picture.width, picture.height, s.u, s.v)
            kr, kg, kb = kr * tr, kg * tg, kb * tb
        radiance[sample, 0] += wr * (material.emission_red + kr * around[2, 0])
        radiance[sample, 1] += wg * (material.emission_green + kg * around[2, 1])
        radiance[sample, 2] += wb * (material.emission_blue + kb * around[2, 2])
        if material.calls & LIT != 0:
            for index in range(len(lights)):
                light = lights[index]
                red, green, blue, inverse = _light_to_eye(s, material, kr, kg, kb, light, -dx, -dy, -dz)
                red, green, blue = wr * red, wg * green, wb * blue
                if not max(red, max(green, blue)) > 0.0:
                    continue
                reach = 1.0 - OFFSET_ULPS * inverse * max(abs(light.x), max(abs(light.y), abs(light.z)))
                if light.casts == 0 or not reach > 0.0:
                    radiance[sample, 0] += red
                    radiance[sample, 1] += green
                    radiance[sample, 2] += blue
                    continue
                away = s.offset + s.lift
                ox, oy, oz = s.px + away * s.gx, s.py + away * s.gy, s.pz + away * s.gz
                shadow_origin[n_shadows, 0] = ox
                shadow_origin[n_shadows, 1] = oy
                shadow_origin[n_shadows, 2] = oz
                shadow_direction[n_shadows, 0] = light.x - ox
                shadow_direction[n_shadows, 1] = light.y - oy
                shadow_direction[n_shadows, 2] = light.z - oz
                shadow_reach[n_shadows] = reach
                shadow_light[n_shadows, 0] = red
                shadow_light[n_shadows, 1] = green
                shadow_light[n_shadows, 2] = blue
                shadow_sample[n_shadows] = sample
                n_shadows += 1
        if not spawn or material.calls & (MIRROR | BOUNDARY) == 0:
            continue
        mr, mg, mb = float(material.reflection_red), float(material.reflection_green), float(material.reflection_blue)
        if material.calls & BOUNDARY != 0:
            eta = 1.0 / material.ior if s.entering else np.float64(material.ior)
            cosine = -(dx * s.nx + dy * s.ny + dz * s.nz)
            refracted = refracted_cosine(cosine, eta)
            share = fresnel(cosine, refracted, eta)
            rest = 1.0 - share
            tr = wr * rest * (1.0 - mr) * material.transmission_red
            tg = wg * rest * (1.0 - mg) * material.transmission_green
            tb = wb * rest * (1.0 - mb) * material.transmission_blue
            mr, mg, mb = share + rest * mr, share + rest * mg, share + rest * mb
            if max(tr, max(tg, tb)) >= cutoff:
                child_origin[n_children, 0] = s.px - s.offset * s.gx
                child_origin[n_children, 1] = s.py - s.offset * s.gy
                child_origin[n_children, 2] = s.pz - s.offset * s.gz
                rx, ry, rz = _bent(s, eta, cosine, refracted, dx, dy, dz)
                child_direction[n_children, 0], child_direction[n_children, 1], child_direction[n_children, 2] = (
                    rx,
                    ry,
                    rz,
                )
                child_weight[n_children, 0], child_weight[n_children, 1], child_weight[n_children, 2] = tr, tg, tb
                child_sample[n_children] = sample
                n_children += 1
                counters[REFRACTIONS] += 1
        mr, mg, mb = wr * mr, wg * mg, wb * mb
        if max(mr, max(mg, mb)) >= cutoff:
            child_origin[n_children, 0] = s.px + s.offset * s.gx
            child_origin[n_children, 1] = s.py + s.offset * s.gy
            child_origin[n_children, 2] = s.pz + s.offset * s.gz
            rx, ry, rz = _mirrored(s, dx, dy, dz)
            child_direction[n_children, 0] = rx
            child_direction[n_children, 1] = ry
            child_direction[n_children, 2] = rz
            child_weight[n_children, 0], child_weight[n_children, 1], child_weight[n_children, 2] = mr, mg, mb
            child_sample[n_children] = sample
            n_children += 1
            counters[REFLECTIONS] += 1
    counters[CHILDREN] = n_children
    counters[SHADOWS] = n_shadows


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
