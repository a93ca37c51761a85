"""A gallery: turned and polished metals, marble and wood on plinths, pictures on the walls.

The room is 9 m wide, 12 m long and 4.4 m high, with x across and the camera looking towards -z.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from renderer.camera import Camera
from renderer.scene import Material, Mesh, PointLight, Rgb, Scene, Sphere, Surroundings
from renderer.scenes import architecture, ornament, patterns
from renderer.scenes.patterns import textured
from renderer.shapes import Shape, ball, box, curve, join, lathe, quad, torus, tube

HALF_X, HALF_Z, HEIGHT = 4.5, 6.0, 4.4
"""Half the width and length of the room, and its height [m]."""

LAMP_X = 2.2
LAMP_Z = (-4.0, -1.35, 1.35, 4.0)
"""Where the lit panels of the ceiling are; the lights hang just below three of them [m]."""

PLINTHS: dict[str, tuple[float, float, float]] = {
    "knot": (-0.20, 0.85, 1.5),
    "mirror ball": (1.20, 0.78, 0.7),
    "urn": (-1.60, 0.92, 0.4),
    "armillary": (-1.95, 0.62, 2.0),
    "vase": (2.15, 0.72, 1.9),
    "figure": (0.35, 0.70, -1.4),
    "marble ball": (-1.62, 0.70, -2.2),
    "rings": (2.60, 0.75, -1.6),
}
"""x, height and z of each plinth [m]."""


def gallery() -> Scene:
    """The scene: eight objects, nine pictures, three lamps."""
    ball_x, ball_y, ball_z = PLINTHS["mirror ball"]
    stone_x, stone_y, stone_z = PLINTHS["marble ball"]
    marble = _polished("green marble", patterns.marble((40, 92, 74), (190, 214, 196), 66), 300.0, 0.05)
    return Scene(
        meshes=(*_room(), *_pictures(), _plinths(), *_objects()),
        spheres=(
            Sphere(
                (ball_x, ball_y + 0.40, ball_z), 0.36, _metal("turned steel", (0.88, 0.90, 0.92), 0.45, 2000.0, 14.0)
            ),
            Sphere((stone_x, stone_y + 0.36, stone_z), 0.33, marble),
        ),
        lights=(
            PointLight((-LAMP_X, 4.36, 1.35), (17.0, 16.0, 14.2)),
            PointLight((LAMP_X, 4.36, 1.35), (8.0, 7.7, 7.2)),
            PointLight((LAMP_X, 4.36, -4.0), (13.0, 12.4, 11.4)),
        ),
        surroundings=Surroundings(ambient=(0.12, 0.125, 0.13)),
        camera=Camera(position=(0.35, 1.60, 5.5), look_at=(0.02, 1.30, 0.0), vertical_fov_deg=43.0),
        exposure=1.7,
        title="Gallery: polished metal, marble and wood among pictures",
    )


def _room() -> list[Mesh]:
    """Floor, walls with panelling, ceiling with lit panels."""
    floor = _polished("oak floor", patterns.wood((178, 128, 80), (98, 60, 34), 61, planks=6), 60.0, 0.06)
    wall = textured("wall", patterns.plaster((150, 168, 166), 62, 0.05))
    white = Material("white paint", (0.78, 0.77, 0.74))
    skirting = [(0.03, 0.0), (0.03, 0.14), (0.015, 0.17), (0.0, 0.18)]
    rail = [(0.0, 0.86), (0.02, 0.88), (0.045, 0.90), (0.045, 0.93), (0.0, 0.95)]
    cornice = [(0.0, 4.06), (0.03, 4.08), (0.03, 4.14), (0.08, 4.20), (0.16, 4.30), (0.22, 4.32), (0.22, 4.4)]
    mouldings = (architecture.square_inside(outline, HALF_X, HALF_Z) for outline in (skirting, rail, cornice))
    panels = [(x, z) for x in (-LAMP_X, LAMP_X) for z in LAMP_Z]
    lit = join(*(_ceiling_panel(1.5, 0.95).moved(x, HEIGHT - 0.02, z) for x, z in panels))
    ceiling = quad((-HALF_X, HEIGHT, -HALF_Z), (2 * HALF_X, 0.0, 0.0), (0.0, 0.0, 2 * HALF_Z))
    return [
        quad((HALF_X, 0.0, HALF_Z), (0.0, 0.0, -2 * HALF_Z), (-2 * HALF_X, 0.0, 0.0)).mesh(floor, 1.2),
        architecture.square_inside([(0.0, 0.0), (0.0, HEIGHT)], HALF_X, HALF_Z).mesh(wall, 2.0),
        join(ceiling, *mouldings).mesh(white, name="ceiling and mouldings"),
        lit.mesh(Material("lit panel", (0.8, 0.8, 0.8), emission=(0.95, 0.94, 0.90)), casts_shadows=False),
    ]


def _ceiling_panel(width: float, depth: float) -> Shape:
    """A flat lamp seen from below."""
    return quad((-width / 2, 0.0, -depth / 2), (width, 0.0, 0.0), (0.0, 0.0, depth))


def _pictures() -> list[Mesh]:
    """Three pictures on each wall but the one behind the camera, in gilt frames."""
    stones = tuple(patterns.marble(ground, vein, seed) for ground, vein, seed in (
        ((230, 222, 204), (170, 150, 130), 71), ((150, 60, 46), (210, 160, 140), 72),
        ((44, 60, 86), (130, 150, 180), 73), ((214, 172, 96), (120, 84, 40), 74)))  # fmt: skip
    left, right, far = (-HALF_X, 90.0), (HALF_X, 270.0), (-HALF_Z, 0.0)
    hung = [
        (left, -3.3, 1.7, 1.25, patterns.landscape(81)),
        (left, -0.6, 1.3, 1.3, patterns.composition(82)),
        (left, 2.1, 1.7, 1.25, patterns.landscape(83)),
        (right, -3.3, 1.3, 1.3, patterns.parquet(stones)),
        (right, -0.6, 1.7, 1.25, patterns.landscape(84)),
        (right, 2.1, 1.3, 1.3, patterns.composition(85)),
        (far, -2.75, 1.2, 1.2, patterns.composition(86)),
        (far, 0.0, 2.5, 1.75, patterns.landscape(87, 768, 540)),
        (far, 2.75, 1.2, 1.2, patterns.starry((30, 40, 92), (240, 214, 140), 4, 88)),
    ]
    meshes, frames = [], []
    for (wall, turn_deg), along, width, height, pixels in hung:
        x, z = (along, wall) if turn_deg == 0.0 else (wall, along)
        frame, canvas = (part.turned("y", turn_deg).moved(x, 2.05, z) for part in ornament.picture(width, height))
        frames.append(frame)
        meshes.append(canvas.mesh(textured("picture", pixels), name=f"picture {len(frames)}"))
    gilt = Material("gilt frame", (0.40, 0.27, 0.09), specular=(0.7, 0.5, 0.2), shininess=40.0)
    return [*meshes, join(*frames).mesh(gilt)]


def _plinths() -> Mesh:
    """A plinth with chamfered edges for each object."""
    half = 0.36
    blocks = [
        architecture.square([(-0.03, 0.0), (-0.03, 0.05), (0.0, 0.05), (0.0, top - 0.012), (-0.012, top), (-half, top)],
                            half, half).moved(x, 0.0, z)
        for x, top, z in PLINTHS.values()
    ]  # fmt: skip
    granite = Material("black granite", (0.035, 0.035, 0.04), (0.3, 0.3, 0.3), 200.0, reflection=(0.07, 0.07, 0.07))
    return join(*blocks).mesh(granite)


def _objects() -> list[Mesh]:
    """What stands on the plinths, but for the two spheres."""
    glaze = _polished("painted glaze", patterns.starry((26, 60, 130), (238, 232, 214), 6, 67), 120.0, 0.05)
    walnut = textured("walnut", patterns.wood((160, 104, 62), (74, 42, 22), 68, planks=2))
    brass = _metal("turned brass", (0.90, 0.70, 0.34), 0.50, 900.0, 14.0)
    steel = _metal("brushed steel", (0.72, 0.73, 0.75), 0.30, 700.0, 10.0)
    globe, orbits = _armillary()
    stand = torus(0.17, 0.03, 48, 16)
    return [
        _on("knot", _torus_knot().moved(0.0, 0.52, 0.0)).mesh(_metal("gold", (0.95, 0.70, 0.28), 0.72, 500.0, 500.0)),
        _on("knot", lathe([(0.0, 0.0), (0.20, 0.0), (0.18, 0.03), (0.05, 0.05), (0.04, 0.16), (0.0, 0.16)], 48)).mesh(
            steel
        ),
        _on("urn", ornament.urn(0.95, 96, 16)).mesh(_metal("turned copper", (0.90, 0.48, 0.33), 0.5, 900.0, 12.0)),
        _on("armillary", orbits).mesh(brass),
        _on("armillary", globe).mesh(_metal("blue steel", (0.34, 0.48, 0.76), 0.35, 8.0, 800.0)),
        _on("vase", _vase()).mesh(glaze, 0.5),
        _on("figure", ornament.statue(1.25, 96)).mesh(_metal("bronze", (0.44, 0.29, 0.15), 0.45, 60.0, 60.0)),
        join(_on("mirror ball", stand.moved(0.0, 0.03, 0.0)), _on("marble ball", stand.moved(0.0, 0.03, 0.0))).mesh(
            brass
        ),
        _on("rings", _wooden_rings()).mesh(walnut, 0.6),
    ]


def _on(plinth: str, shape: Shape) -> Shape:
    x, top, z = PLINTHS[plinth]
    return shape.moved(x, top, z)


def _polished(name: str, pixels: patterns.Pixels, shininess: float, mirror: float) -> Material:
    """A glossy material that shows `pixels` and mirrors a little."""
    gloss = 6.0 * mirror
    return replace(
        textured(name, pixels),
        specular=(gloss, gloss, gloss),
        shininess=shininess,
        reflection=(mirror, mirror, mirror),
    )


def _metal(name: str, tint: Rgb, polish: float, exponent_u: float, exponent_v: float) -> Material:
    """A metal that mirrors `polish` of its tint sharply and scatters the rest along its grain."""
    red, green, blue = tint
    rest = 1.0 - polish
    return Material(
        name,
        diffuse=(0.25 * rest * red, 0.25 * rest * green, 0.25 * rest * blue),
        specular=(rest * red, rest * green, rest * blue),
        reflection=(polish * red, polish * green, polish * blue),
        base="ashikhmin-shirley",
        exponent_u=exponent_u,
        exponent_v=exponent_v,
    )


def _torus_knot() -> Shape:
    """A trefoil: a tube that goes twice round a ring while it winds three times about it."""
    t = 2 * np.pi * np.arange(241) / 240
    reach, lift = 0.25 + 0.115 * np.cos(3 * t), 0.115 * np.sin(3 * t)
    path = np.stack([reach * np.cos(2 * t), reach * np.sin(2 * t), lift], axis=1)
    path[-1] = path[0]
    side = np.stack([np.cos(3 * t) * np.cos(2 * t), np.cos(3 * t) * np.sin(2 * t), np.sin(3 * t)], axis=1)
    return tube(path, 0.062, 0.062, side, sides=28)


def _armillary() -> tuple[Shape, Shape]:
    """A globe, and the rings, axis and foot around it."""
    center = 0.50
    rings = [
        torus(0.34, 0.014, 96, 12).turned("x", 90.0),
        torus(0.31, 0.012, 96, 12).turned("z", 23.5),
        torus(0.28, 0.012, 96, 12).turned("x", 66.0).turned("y", 40.0),
        torus(0.25, 0.010, 96, 12).turned("z", -40.0),
    ]
    axis = tube([(0.0, -0.36, 0.0), (0.0, 0.36, 0.0)], 0.012, 0.012, (1.0, 0.0, 0.0)).turned("z", 23.5)
    foot = np.concatenate(
        [[(0.0, 0.0), (0.16, 0.0), (0.16, 0.02)], curve((0.12, 0.04), (0.04, 0.06), (0.03, 0.14), pieces=6)]
    )
    stem = lathe([*foot, (0.0, 0.14)], 48)
    return ball(0.13, 48).moved(0.0, center, 0.0), join(
        stem, *(part.moved(0.0, center, 0.0) for part in (*rings, axis))
    )


def _vase() -> Shape:
    """A tall vase, open at the top."""
    outside = curve((0.13, 0.0), (0.21, 0.12), (0.25, 0.34), (0.16, 0.60), (0.09, 0.74), (0.12, 0.86), pieces=10)
    inside = curve((0.105, 0.86), (0.07, 0.74), (0.0, 0.62), pieces=8)
    return lathe(np.concatenate([[(0.0, 0.0)], outside, inside]), 72)


def _wooden_rings() -> Shape:
    """Three rings leaning on a block."""
    upright = torus(0.24, 0.055, 72, 24).turned("x", 90.0)
    flat = torus(0.24, 0.055, 72, 24)
    return join(
        flat.moved(0.0, 0.055, 0.0),
        upright.turned("y", 35.0).moved(0.0, 0.405, 0.0),
        box((-0.07, 0.0, -0.07), (0.07, 0.12, 0.07)),
        ball(0.09, 36).moved(0.0, 0.405, 0.0),
    )
