"""What a surface sends back along a ray: the light on it, and the rays it spawns (Whitted 1980)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.finish import Finish
from renderer.footprint import covered_area, mirrored_spread, refracted_spread
from renderer.fresnel import fresnel, refracted_cosine
from renderer.grain import sphere_tangent, triangle_tangent
from renderer.kernel import formula, kernel, prefetch
from renderer.light_samples import LightSamples
from renderer.lighting import light_from_areas, light_from_points
from renderer.material_table import (
    BOUNDARY,
    GRAINED,
    LIT,
    MIRROR,
    MIRROR_ANYWAY,
    REFRACTS,
    REFRACTS_ANYWAY,
    SPAWNS,
)
from renderer.media import crossed, dominant
from renderer.normal_map import bumped, mirroring
from renderer.prepared import DENSITY_COLUMN, OTHER_COLUMN, Surfaces
from renderer.rays import Hits, Rays, ShadowRays
from renderer.reflectance import even_light, towards_eye
from renderer.surface import Surface, surface_met
from renderer.tangent import HANDED_COLUMN
from renderer.texture import filtered

SPHERE_DENSITY = 0.5 / math.sqrt(math.pi)
"""Texture coordinates per radius of a sphere, whose whole area one picture covers: the mean over all places."""

AHEAD = 12
"""How many rays ahead a triangle is fetched from memory: its latency over the time of one ray."""

CHILDREN = 0
SHADOWS = 1
REFLECTIONS = 2
REFRACTIONS = 3
COUNTERS = 4
"""Slots of the counters that `shade` fills: rays spawned, shadow rays, and the former by kind."""


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
    draws: LightSamples,
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
        children: room for 2n rays.
        shadows: room for n * (lights + area lights * draws.each) shadow rays.
        radiance: (samples, 3) float32, added to.
        counters: (COUNTERS,) int64, set.
    """
    # Arrays are taken out of their records once: doing it in the loop counts references for each ray.
    facets, tangents = surfaces.facets, surfaces.tangents
    radius = surfaces.spheres.radius
    materials, around = surfaces.materials, surfaces.surroundings
    lights, area_lights = surfaces.lights, surfaces.area_lights
    texels, pictures = surfaces.textures.texels, surfaces.textures.pictures
    linear, signed = surfaces.textures.linear, surfaces.textures.signed
    origin, direction, weight, sample_of = rays.origin, rays.direction, rays.weight, rays.sample
    pencil, child_pencil = rays.pencil, children.pencil
    primitive_of, distance = hits.primitive, hits.distance
    child_origin, child_direction = children.origin, children.direction
    child_weight, child_sample = children.weight, children.sample
    indices, around_of, child_around = surfaces.indices, rays.around, children.around
    nested = len(indices) > 1
    triangles = len(facets)
    solids = triangles + len(radius)
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
        if primitive >= solids:
            lamp = area_lights[primitive - solids]
            radiance[sample, 0] += wr * lamp.red
            radiance[sample, 1] += wg * lamp.green
            radiance[sample, 2] += wb * lamp.blue
            continue
        s, b1, b2 = surface_met(
            facets, surfaces.spheres, primitive,
            np.float64(origin[ray, 0]), np.float64(origin[ray, 1]), np.float64(origin[ray, 2]), dx, dy, dz,
        )  # fmt: skip
        material = materials[s.material]
        kr, kg, kb = float(material.diffuse_red), float(material.diffuse_green), float(material.diffuse_blue)
        sr, sg, sb = float(material.specular_red), float(material.specular_green), float(material.specular_blue)
        mr, mg, mb = float(material.reflection_red), float(material.reflection_green), float(material.reflection_blue)
        width = np.float64(pencil[ray, 0]) + np.float64(pencil[ray, 1]) * np.float64(distance[ray])
        hx, hy, hz = s.nx, s.ny, s.nz
        if material.picture >= 0 or material.specular_picture >= 0 or material.normal_picture >= 0:
            density = (
                np.float64(facets[primitive, DENSITY_COLUMN])
                if primitive < triangles
                else SPHERE_DENSITY / radius[primitive - triangles]
            )
            area = covered_area(s, width, density, dx, dy, dz)
            if material.picture >= 0:
                tr, tg, tb = filtered(texels, linear, pictures, material.picture, area, s.u, s.v)
                kr, kg, kb = kr * tr, kg * tg, kb * tb
            if material.specular_picture >= 0:
                tr, tg, tb = filtered(texels, linear, pictures, material.specular_picture, area, s.u, s.v)
                sr, sg, sb = sr * tr, sg * tg, sb * tb
                mr, mg, mb = mr * tr, mg * tg, mb * tb
            if material.normal_picture >= 0:
                x, y, z = filtered(texels, signed, pictures, material.normal_picture, area, s.u, s.v)
                x, y = x * material.normal_scale, y * material.normal_scale
                if x != 0.0 or y != 0.0:
                    out = 1.0 if s.entering else -1.0
                    if primitive >= triangles:
                        tx, ty, tz = sphere_tangent(s)
                        s = bumped(s, tx, ty, tz, x, out * y, z, dx, dy, dz)
                    elif tangents[primitive, HANDED_COLUMN] != 0.0:
                        tx, ty, tz = triangle_tangent(tangents, primitive, b1, b2, s)
                        handed = np.float64(tangents[primitive, HANDED_COLUMN])
                        s = bumped(s, tx, ty, tz, out * x, handed * y, z, dx, dy, dz)
        ux, uy, uz = 0.0, 0.0, 0.0
        if material.calls & GRAINED != 0:
            if primitive < triangles:
                ux, uy, uz = triangle_tangent(tangents, primitive, b1, b2, s)
            else:
                ux, uy, uz = sphere_tangent(s)
        finish = Finish(kr, kg, kb, sr, sg, sb, ux, uy, uz, hx, hy, hz)
        ar, ag, ab = even_light(s, material, finish, dx, dy, dz)
        radiance[sample, 0] += wr * (material.emission_red + ar * around[2, 0])
        radiance[sample, 1] += wg * (material.emission_green + ag * around[2, 1])
        radiance[sample, 2] += wb * (material.emission_blue + ab * around[2, 2])
        if material.calls & LIT != 0:
            vx, vy, vz = towards_eye(material, dx, dy, dz)
            n_shadows = light_from_points(
                s, material, finish, wr, wg, wb, vx, vy, vz, sample, lights, radiance, shadows, n_shadows
            )
            n_shadows = light_from_areas(
                s, material, finish, wr, wg, wb, vx, vy, vz, sample, area_lights, draws, radiance, shadows, n_shadows
            )
        if not spawn or material.calls & SPAWNS == 0:
            continue
        anyway = material.calls if max(wr, max(wg, wb)) >= cutoff else 0
        curvature = 0.0
        if primitive >= triangles:
            curvature = (1.0 if s.entering else -1.0) / radius[primitive - triangles]
        spread = np.float64(pencil[ray, 1])
        before = int(around_of[ray]) if nested else 0
        behind = before
        if material.calls & (BOUNDARY | REFRACTS_ANYWAY) != 0:
            eta = 1.0 / material.ior if s.entering else np.float64(material.ior)
            if material.medium > 0:
                other = int(facets[primitive, OTHER_COLUMN]) if primitive < triangles else 0
                before, behind = crossed(before, int(np.int64(material.medium)), other, s.entering)
                eta = indices[dominant(before)] / indices[dominant(behind)]
            cosine = -(dx * s.nx + dy * s.ny + dz * s.nz)
            refracted = refracted_cosine(cosine, eta)
            share = fresnel(cosine, refracted, eta)
            rest = 1.0 - share
            tr = wr * rest * (1.0 - mr) * material.transmission_red
            tg = wg * rest * (1.0 - mg) * material.transmission_green
            tb = wb * rest * (1.0 - mb) * material.transmission_blue
            if material.calls & BOUNDARY != 0:
                mr, mg, mb = share + rest * mr, share + rest * mg, share + rest * mb
            if (material.calls & REFRACTS != 0 and max(tr, max(tg, tb)) >= cutoff) or anyway & REFRACTS_ANYWAY != 0:
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
                child_pencil[n_children, 0] = width
                child_pencil[n_children, 1] = refracted_spread(spread, width, curvature, eta)
                if nested:
                    child_around[n_children] = behind
                n_children += 1
                counters[REFRACTIONS] += 1
        mr, mg, mb = wr * mr, wg * mg, wb * mb
        if (material.calls & MIRROR != 0 and max(mr, max(mg, mb)) >= cutoff) or anyway & MIRROR_ANYWAY != 0:
            child_origin[n_children, 0] = s.px + s.offset * s.gx
            child_origin[n_children, 1] = s.py + s.offset * s.gy
            child_origin[n_children, 2] = s.pz + s.offset * s.gz
            if material.normal_picture >= 0:
                s = mirroring(s, hx, hy, hz, dx, dy, dz)
            rx, ry, rz = _mirrored(s, dx, dy, dz)
            child_direction[n_children, 0] = rx
            child_direction[n_children, 1] = ry
            child_direction[n_children, 2] = rz
            child_weight[n_children, 0], child_weight[n_children, 1], child_weight[n_children, 2] = mr, mg, mb
            child_sample[n_children] = sample
            child_pencil[n_children, 0] = width
            child_pencil[n_children, 1] = mirrored_spread(spread, width, curvature)
            if nested:
                child_around[n_children] = before
            n_children += 1
            counters[REFLECTIONS] += 1
    counters[CHILDREN] = n_children
    counters[SHADOWS] = n_shadows
