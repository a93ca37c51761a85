"""Scenes that other renderers can show too, in our own records; everything stays between radiance 0 and 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from renderer.camera import Camera
from renderer.scene import (
    Material,
    Mesh,
    PointLight,
    RectangleLight,
    Rgb,
    Scene,
    Sphere,
    SphereLight,
    Surroundings,
    Texture,
)
from tests.renderer.drawing import BLACK, FINE, WHITE, box, floor, icosphere, quad

SKY = Surroundings(zenith=(0.25, 0.35, 0.6), horizon=(0.6, 0.55, 0.5))
LEFT = PointLight((-3.0, 6.0, 4.0), (36.0, 32.0, 26.0))
RIGHT = PointLight((4.0, 3.0, 5.0), (9.0, 12.0, 20.0))
VIEW = Camera((0.6, 2.4, 7.0), (0.0, 0.9, 0.0), vertical_fov_deg=38.0)
GREY = Material("grey", diffuse=(0.6, 0.6, 0.6))
SAND = Material("sand", diffuse=(0.7, 0.6, 0.4))
TEAL = Material("teal", diffuse=(0.1, 0.5, 0.5))
BRICK = Material("brick", diffuse=(0.6, 0.2, 0.1))


def phong(name: str, diffuse: Rgb, height: float, shininess: float) -> Material:
    """Diffuse colour and a highlight of the light's colour."""
    return Material(name, diffuse, (height,) * 3, shininess)


def mirror(share: Rgb, diffuse: Rgb = BLACK) -> Material:
    return Material("mirror", diffuse, reflection=share)


def glass(ior: float = 1.5, tint: Rgb = WHITE) -> Material:
    return Material("glass", BLACK, transmission=tint, ior=ior)


def smooth_ball(center: Rgb, radius: float, material: Material) -> Mesh:
    """320 triangles with the normals of the sphere they stand for."""
    vertices, faces = icosphere(2)
    return Mesh(vertices * radius + center, faces, material, vertices.copy(), casts_shadows=False)


def phong_scene() -> Scene:
    """Spheres, flat and smooth triangles, two coloured lights with shadows, ambient light, a sky."""
    return Scene(
        meshes=(
            floor(phong("tiles", (0.6, 0.5, 0.4), 0.02, 20.0), y=-0.4),
            box((-2.6, -0.2, -1.6), (-1.4, 1.0, -0.4), phong("box", (0.2, 0.5, 0.3), 0.02, 8.0)),
            smooth_ball((1.9, 0.5, -0.6), 0.7, phong("ball", (0.5, 0.3, 0.1), 0.05, 30.0)),
        ),
        spheres=(
            Sphere((0.0, 0.8, 0.0), 0.8, phong("dull", (0.6, 0.1, 0.1), 0.08, 5.0)),
            Sphere((-0.9, 0.2, 1.4), 0.4, phong("bright", (0.1, 0.2, 0.6), 0.2, 150.0)),
            Sphere((0.9, 0.15, 1.7), 0.35, phong("matt", (0.5, 0.5, 0.5), 0.0, 1.0)),
        ),
        lights=(LEFT, RIGHT),
        surroundings=Surroundings(SKY.zenith, SKY.horizon, ambient=(0.05, 0.06, 0.08)),
        camera=VIEW,
        exposure=FINE,
    )


def mirror_scene() -> Scene:
    """Coloured mirrors that face one another, so that the picture depends on how deep they are followed."""
    return Scene(
        meshes=(
            floor(SAND, y=-0.2),
            quad((-3.0, -0.1, -2.0), (6.0, 0.0, 0.0), (0.0, 4.0, 0.0), mirror((0.9, 0.8, 0.7))),
            quad((3.2, -0.1, 9.0), (-6.0, 0.0, 0.4), (0.0, 4.0, 0.0), mirror((0.7, 0.9, 0.8))),
            box((-2.3, 0.0, -0.7), (-1.5, 1.2, 0.1), TEAL),
        ),
        spheres=(
            Sphere((0.1, 0.8, 0.2), 0.8, mirror((0.45, 0.5, 0.5), (0.2, 0.1, 0.1))),
            Sphere((1.6, 0.5, 0.9), 0.5, mirror((0.95, 0.85, 0.5))),
            Sphere((-0.9, 0.35, 1.6), 0.35, BRICK),
        ),
        lights=(LEFT, RIGHT),
        surroundings=SKY,
        camera=VIEW,
        exposure=FINE,
    )


def glass_scene(casts_shadows: bool, *more: Sphere) -> Scene:
    """Glass balls and a tinted glass box that reflects totally inside, before matt things.

    Args:
        casts_shadows: whether glass does: renderers differ in what light does behind it.
        more: further spheres.
    """
    return Scene(
        meshes=(
            floor(SAND, y=-0.2),
            box((-2.6, 0.1, -2.6), (-1.8, 2.0, -1.8), TEAL),
            box((1.5, 0.1, -2.4), (2.5, 1.2, -1.6), BRICK),
            box((1.1, 0.0, 0.6), (2.0, 0.9, 1.5), glass(1.5, (0.8, 0.95, 0.9)), casts_shadows=casts_shadows),
        ),
        spheres=(
            Sphere((-0.5, 0.9, 0.3), 0.9, glass(1.5), casts_shadows=casts_shadows),
            Sphere((0.7, 0.3, 2.0), 0.4, glass(1.33), casts_shadows=casts_shadows),
            Sphere((0.9, 1.9, -1.8), 0.5, GREY),
            *more,
        ),
        lights=(LEFT, RIGHT),
        surroundings=SKY,
        camera=VIEW,
        exposure=FINE,
    )


def bubble() -> Sphere:
    """Of air, inside the larger ball of the glass scene."""
    return Sphere((-0.5, 0.9, 0.3), 0.45, glass(1.0 / 1.5))


def matt_scene() -> Scene:
    """Diffuse surfaces alone, with hard shadows."""
    return Scene(
        meshes=(floor(GREY), box((-1.9, 0.1, -1.2), (-0.7, 1.4, 0.0), TEAL)),
        spheres=(Sphere((0.7, 0.8, 0.4), 0.7, SAND), Sphere((-0.5, 0.4, 1.7), 0.3, BRICK)),
        lights=(LEFT, RIGHT),
        camera=VIEW,
        exposure=FINE,
    )


def textured_scene() -> Scene:
    """Pictures magnified on a floor and two walls, repeated, clamped and mirrored, and a fence of cut-out stripes
    that casts the shadow of its bars.
    """
    colours = np.random.default_rng(1).integers(0, 256, (12, 16, 3), dtype=np.uint8)
    bars = np.broadcast_to(np.where(np.arange(16) % 4 < 2, 255, 0).astype(np.uint8), (4, 16)).copy()
    ground = Material("ground", WHITE, diffuse_texture=Texture(colours))
    left, right = (
        Material(wrap, WHITE, diffuse_texture=Texture(colours[:5, :7], wrap, wrap, wrap))
        for wrap in ("clamp", "mirror")
    )
    fence = Material("fence", (0.6, 0.2, 0.1), alpha_texture=Texture(colours[:4], alpha=bars))
    return Scene(
        meshes=(
            floor(ground, y=-0.2),
            _stretched(quad((-3.0, -0.1, -2.0), (3.0, 0.0, 0.0), (0.0, 2.5, 0.0), left), 2.5, -0.7),
            _stretched(quad((0.2, -0.1, -2.0), (3.0, 0.0, 0.0), (0.0, 2.5, 0.0), right), 2.5, -0.7),
            quad((-1.5, -0.1, 0.8), (3.0, 0.0, -0.5), (0.0, 1.2, 0.0), fence),
        ),
        lights=(LEFT, RIGHT),
        camera=VIEW,
        exposure=FINE,
    )


def _stretched(mesh: Mesh, factor: float, shift: float) -> Mesh:
    """With texture coordinates that leave 0 to 1."""
    assert mesh.uvs is not None
    return replace(mesh, uvs=mesh.uvs * factor + shift)


def glowing_glass_scene() -> Scene:
    """Glass balls and a mirror among things that glow: nothing scatters, so that whoever follows every path of
    light sees what Whitted's tracer sees.
    """
    dark, lamps = BLACK, ((0.9, 0.3, 0.2), (0.2, 0.7, 0.3), (0.2, 0.3, 0.9), (0.8, 0.8, 0.6))
    tiles = tuple(
        quad(
            (-4.0 + 2 * column, -0.1, 2.0 - 2 * row), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0),
            Material("tile", dark, emission=lamps[(column + 2 * row) % 4]),
        )
        for column in range(4) for row in range(4)
    )  # fmt: skip
    return Scene(
        meshes=tiles,
        spheres=(
            Sphere((-0.7, 0.9, 0.0), 0.9, glass(1.5)),
            Sphere((1.2, 0.7, 0.2), 0.7, glass(1.33)),
            Sphere((0.3, 0.4, 1.5), 0.35, mirror((0.9, 0.8, 0.7))),
        ),
        surroundings=Surroundings((0.3, 0.4, 0.6), (0.3, 0.4, 0.6)),
        camera=VIEW,
        exposure=FINE,
    )


def lamp_scene() -> Scene:
    """A rectangle and a sphere of light over diffuse things that shade a part of them."""
    return Scene(
        meshes=(floor(GREY), box((-1.9, 0.0, -1.2), (-0.7, 1.4, 0.0), TEAL)),
        spheres=(Sphere((0.7, 0.8, 0.4), 0.7, SAND),),
        lights=(
            RectangleLight((-1.0, 3.2, -1.0), (2.0, 0.0, 0.0), (0.0, 0.0, 1.5), (2.0, 1.6, 1.2)),
            SphereLight((4.0, 3.6, 1.0), 0.4, (6.0, 8.0, 10.0)),
        ),
        camera=VIEW,
        exposure=FINE,
    )
