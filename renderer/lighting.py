"""The light on surfaces: what they shine by themselves, and what each point light sends to the eye by way of them."""

from __future__ import annotations

from typing import Any

from renderer.finish import Finish
from renderer.gather import entry, held, keep
from renderer.group import Group
from renderer.kernel import formula
from renderer.lanes import anywhere, choose, least, most, root
from renderer.material_table import LIT
from renderer.places import EYE, LIGHT_ROWS, LIGHTS, SENT, START, UNLIT, Places, keep_three
from renderer.prepared import Surfaces
from renderer.reflectance import even_light, reflectance, towards_eye
from renderer.surface import OFFSET_ULPS, Surface


@formula
def in_front(finish: Finish, lx: float, ly: float, lz: float) -> bool:
    """Whether the surface, flat as it is under its bumps, faces the light in direction (lx, ly, lz)."""
    return finish.hx * lx + finish.hy * ly + finish.hz * lz > 0.0


@formula
def point_light(
    s: Surface, finish: Finish, light: Any, vx: float, vy: float, vz: float
) -> tuple[float, float, float, float, bool, float, float, float]:
    """Radiance that a surface sends towards the eye of one point light, nothing being in between.

    Args:
        s: the surface; this, `finish` and the direction are numbers or lanes.
        finish: the material at this place.
        light: LIGHT.
        vx, vy, vz: direction `towards_eye`.

    Returns:
        The direction of the shadow ray, and how far it looks in lengths of that; whether the light lights the
        surface at all, not from behind nor from within; and if so, red, green and blue.
    """
    tx, ty, tz = light.x - s.px, light.y - s.py, light.z - s.pz
    square = tx * tx + ty * ty + tz * tz
    apart = square > 0.0
    inverse = 1.0 / root(choose(apart, square, 1.0))
    lx, ly, lz = tx * inverse, ty * inverse, tz * inverse
    cosine = lx * s.nx + ly * s.ny + lz * s.nz
    lit = apart & (cosine > 0.0) & in_front(finish, lx, ly, lz)
    red, green, blue = reflectance(s, finish, cosine, lx, ly, lz, vx, vy, vz)
    falloff = inverse * inverse
    reach = 1.0 - OFFSET_ULPS * inverse * max(abs(light.x), max(abs(light.y), abs(light.z)))
    away = s.offset + s.lift
    return (
        tx - away * s.gx, ty - away * s.gy, tz - away * s.gz, reach,
        lit, red * (light.red * falloff), green * (light.green * falloff), blue * (light.blue * falloff),
    )  # fmt: skip


@formula
def light_up(surfaces: Surfaces, group: Group, seen: Any, s: Surface, finish: Finish, places: Places) -> None:
    """Write what the surfaces that a group met send back by themselves and of each point light."""
    lights, around, materials, written = surfaces.lights, surfaces.surroundings, surfaces.materials, places.light
    row = choose(seen, s.material, 0)
    ar, ag, ab = even_light(s, finish, group.dx, group.dy, group.dz)
    keep_three(
        written, SENT,
        group.wr * (entry(materials["emission_red"], row) + ar * around[2, 0]),
        group.wg * (entry(materials["emission_green"], row) + ag * around[2, 1]),
        group.wb * (entry(materials["emission_blue"], row) + ab * around[2, 2]),
    )  # fmt: skip
    vx, vy, vz = towards_eye(finish.calls, group.dx, group.dy, group.dz)
    keep_three(places.rows, EYE, vx, vy, vz)
    lit = finish.calls & LIT != 0
    if not anywhere(lit):
        return
    away = s.offset + s.lift
    keep_three(written, START, s.px + away * s.gx, s.py + away * s.gy, s.pz + away * s.gz)
    for index in range(len(lights)):
        light = lights[index]
        dx, dy, dz, reach, shone, red, green, blue = point_light(s, finish, light, vx, vy, vz)
        red, green, blue = group.wr * red, group.wg * green, group.wb * blue
        adds = lit & shone & (most(red, most(green, blue)) > 0.0)
        first = LIGHTS + LIGHT_ROWS * index
        keep_three(written, first, dx, dy, dz)
        keep(written, first + 3, choose(adds, choose(light.casts != 0, most(0.0, reach), 0.0), UNLIT))
        keep_three(written, first + 4, red, green, blue)


@formula
def light_beyond(surfaces: Surfaces, group: Group, seen: Any, places: Places) -> None:
    """Write what the rays see that met no surface: an area light, or between horizon and zenith nothing at all."""
    around, lamps, written = surfaces.surroundings, surfaces.area_lights, places.light
    high = least(1.0, most(0.0, group.dy))
    low = 1.0 - high
    red = high * around[0, 0] + low * around[1, 0]
    green = high * around[0, 1] + low * around[1, 1]
    blue = high * around[0, 2] + low * around[1, 2]
    solids = len(surfaces.facets) + len(surfaces.spheres.radius)
    lamp = group.primitive >= solids
    if anywhere(lamp):
        k = choose(lamp, group.primitive - solids, 0)
        red = choose(lamp, entry(lamps["red"], k), red)
        green = choose(lamp, entry(lamps["green"], k), green)
        blue = choose(lamp, entry(lamps["blue"], k), blue)
    keep_three(
        written, SENT,
        choose(seen, held(written, SENT), group.wr * red),
        choose(seen, held(written, SENT + 1), group.wg * green),
        choose(seen, held(written, SENT + 2), group.wb * blue),
    )  # fmt: skip
