"""From surfaces to what they are made of where rays met them: materials, textures, bumps and grain."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.finish import Finish
from renderer.footprint import covered_area
from renderer.gather import entry, held, pick
from renderer.grain import sphere_tangent, triangle_tangent
from renderer.group import Group
from renderer.kernel import formula
from renderer.lanes import anywhere, choose
from renderer.material_table import GRAINED, MICROFACETS, SPAWNS, SPECULAR
from renderer.normal_map import bumped
from renderer.places import DENSITY, MIRRORED, WEIGHTS, keep_finishes, keep_surfaces, keep_three, surfaces_of
from renderer.prepared import Surfaces
from renderer.surface import Surface
from renderer.tangent import HANDED_COLUMN
from renderer.texture import filtered


@formula
def _tangents(
    surfaces: Surfaces, group: Group, rows: NDArray[np.float64], s: Surface, wanted: Any
) -> tuple[Any, Any, Any]:
    """Unit tangents of the surfaces that a group met, where wanted."""
    flat = wanted & (group.primitive < len(surfaces.facets))
    tx, ty, tz = sphere_tangent(s)
    if anywhere(flat):
        t = choose(flat, group.primitive, 0)
        x, y, z = triangle_tangent(surfaces.tangents, t, held(rows, WEIGHTS), held(rows, WEIGHTS + 1), s)
        tx, ty, tz = choose(flat, x, tx), choose(flat, y, ty), choose(flat, z, tz)
    return tx, ty, tz


@formula
def _bumped(
    surfaces: Surfaces, group: Group, rows: NDArray[np.float64], s: Surface, row: Any, normal_picture: Any, area: Any
) -> Surface:
    """The surfaces that a group met, bent by their normal maps.

    Args:
        surfaces, group: the scene and the rays.
        rows: of `Places`, with the surfaces.
        s: the same.
        row: of their materials.
        normal_picture: row of their normal maps in the atlas, -1 for none.
        area: that the rays cover, in texture coordinates.
    """
    textures = surfaces.textures
    mapped = normal_picture >= 0
    flat = mapped & (group.primitive < len(surfaces.facets))
    x, y, z = filtered(
        mapped, textures.texels, textures.signed, textures.pictures, choose(mapped, normal_picture, 0), area, s.u, s.v
    )
    scale = entry(surfaces.materials["normal_scale"], row)
    x, y = x * scale, y * scale
    handed = choose(flat, 0.0, 1.0)
    if anywhere(flat):
        handed = choose(flat, pick(surfaces.tangents, choose(flat, group.primitive, 0), HANDED_COLUMN), 1.0)
    bends = mapped & ((x != 0.0) | (y != 0.0)) & (handed != 0.0)
    tx, ty, tz = _tangents(surfaces, group, rows, s, mapped)
    out = choose(s.entering, 1.0, -1.0)
    x, y = choose(flat, out * x, x), choose(flat, handed * y, out * y)
    bent = bumped(s, tx, ty, tz, x, y, z, group.dx, group.dy, group.dz)
    nx, ny, nz = choose(bends, bent.nx, s.nx), choose(bends, bent.ny, s.ny), choose(bends, bent.nz, s.nz)
    return Surface(s.px, s.py, s.pz, s.gx, s.gy, s.gz, nx, ny, nz, s.u, s.v, s.offset, s.lift, s.material, s.entering)


@formula
def finish_off(surfaces: Surfaces, group: Group, seen: Any, rows: NDArray[np.float64]) -> tuple[Surface, Finish]:
    """The surfaces that a group met, bumps and all, and what they are made of there; both are written as well.

    Args:
        surfaces: the scene.
        group: the rays.
        seen: marks those that met a surface.
        rows: of `Places`, with the surfaces.
    """
    materials, textures = surfaces.materials, surfaces.textures
    s = surfaces_of(rows)
    row = choose(seen, s.material, 0)
    calls = choose(seen, entry(materials["calls"], row), 0)
    kr = entry(materials["diffuse_red"], row)
    kg = entry(materials["diffuse_green"], row)
    kb = entry(materials["diffuse_blue"], row)
    sr = sg = sb = mr = mg = mb = shininess = nu = nv = ux = uy = uz = choose(seen, 0.0, 0.0)
    if anywhere(calls & (SPECULAR | MICROFACETS | SPAWNS) != 0):
        sr = entry(materials["specular_red"], row)
        sg = entry(materials["specular_green"], row)
        sb = entry(materials["specular_blue"], row)
        mr = entry(materials["reflection_red"], row)
        mg = entry(materials["reflection_green"], row)
        mb = entry(materials["reflection_blue"], row)
        shininess = entry(materials["shininess"], row)
        nu, nv = entry(materials["exponent_u"], row), entry(materials["exponent_v"], row)
    hx, hy, hz = s.nx, s.ny, s.nz
    picture = choose(seen, entry(materials["picture"], row), -1)
    specular_picture = choose(seen, entry(materials["specular_picture"], row), -1)
    normal_picture = choose(seen, entry(materials["normal_picture"], row), -1)
    if anywhere((picture >= 0) | (specular_picture >= 0) | (normal_picture >= 0)):
        texels, linear, pictures = textures.texels, textures.linear, textures.pictures
        area = covered_area(s, group.width, held(rows, DENSITY), group.dx, group.dy, group.dz)
        drawn = picture >= 0
        if anywhere(drawn):
            r, g, b = filtered(drawn, texels, linear, pictures, choose(drawn, picture, 0), area, s.u, s.v)
            kr, kg, kb = choose(drawn, kr * r, kr), choose(drawn, kg * g, kg), choose(drawn, kb * b, kb)
        drawn = specular_picture >= 0
        if anywhere(drawn):
            r, g, b = filtered(drawn, texels, linear, pictures, choose(drawn, specular_picture, 0), area, s.u, s.v)
            sr, sg, sb = choose(drawn, sr * r, sr), choose(drawn, sg * g, sg), choose(drawn, sb * b, sb)
            mr, mg, mb = choose(drawn, mr * r, mr), choose(drawn, mg * g, mg), choose(drawn, mb * b, mb)
        if anywhere(normal_picture >= 0):
            s = _bumped(surfaces, group, rows, s, row, normal_picture, area)
            keep_surfaces(rows, s)
    if anywhere(calls & GRAINED != 0):
        ux, uy, uz = _tangents(surfaces, group, rows, s, calls & GRAINED != 0)
    finish = Finish(kr, kg, kb, sr, sg, sb, calls, shininess, nu, nv, ux, uy, uz, hx, hy, hz)
    keep_finishes(rows, finish)
    keep_three(rows, MIRRORED, mr, mg, mb)
    return s, finish
