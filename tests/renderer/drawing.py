"""Small scenes and pictures for the tests of the tracer."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.display import Display
from renderer.frame import Frame, FrameRequest
from renderer.fresnel import fresnel
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from renderer.scene import Material, Mesh, PointLight, Rgb, Scene, Sphere, Surroundings, Texture

BLACK: Rgb = (0.0, 0.0, 0.0)
WHITE: Rgb = (1.0, 1.0, 1.0)
U = 2.0**-24
"""Half the relative spacing of float32: the error of one rounding."""

WHITE_LAMBERT = Material("white", diffuse=WHITE)
EVERYWHERE_1 = Surroundings(zenith=WHITE, horizon=WHITE)
FINE = 1e9
"""An exposure at which no ray is too faint to be followed."""


def mirror(share: float = 1.0) -> Material:
    return Material("mirror", diffuse=BLACK, reflection=(share,) * 3)


def glass(ior: float = 1.5) -> Material:
    return Material("glass", diffuse=BLACK, transmission=WHITE, ior=ior)


def lamp(radiance: float = 1.0) -> Material:
    return Material("lamp", diffuse=BLACK, emission=(radiance,) * 3)


def light(x: float, y: float, z: float, intensity: float = 1.0, casts_shadows: bool = True) -> PointLight:
    return PointLight((x, y, z), (intensity,) * 3, casts_shadows)


def quad(corner: Rgb, right: Rgb, up: Rgb, material: Material, casts_shadows: bool = True) -> Mesh:
    """A parallelogram that faces right x up."""
    a, b, c = np.array(corner), np.array(right), np.array(up)
    return Mesh(
        np.array([a, a + b, a + b + c, a + c], dtype=np.float64),
        np.array([[0, 1, 2], [0, 2, 3]]),
        material,
        uvs=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64),
        casts_shadows=casts_shadows,
    )


def floor(material: Material, y: float = 0.0, half: float = 5.0, casts_shadows: bool = True) -> Mesh:
    """A square at height y that faces up."""
    return quad((-half, y, half), (2 * half, 0.0, 0.0), (0.0, 0.0, -2 * half), material, casts_shadows)


def box(low: Rgb, high: Rgb, material: Material, casts_shadows: bool = True) -> Mesh:
    """A closed box of 12 triangles with 8 shared corners, facing out."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    vertices = np.array([(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)], dtype=np.float64)
    squares = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = [(a, b, c) for a, b, c, _ in squares] + [(a, c, d) for a, _, c, d in squares]
    return Mesh(vertices, np.array(faces), material, casts_shadows=casts_shadows)


@functools.cache
def icosphere(level: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices on the unit sphere and faces of an icosahedron divided `level` times: 20 * 4^level triangles."""
    t = (1 + math.sqrt(5)) / 2
    points: list[NDArray[np.float64]] = [
        np.array(point) / math.hypot(1, t)
        for point in (
            (-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t),
            (0, -1, -t), (0, 1, -t), (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1),
        )
    ]  # fmt: skip
    faces = [
        (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
        (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
        (8, 6, 7), (9, 8, 1),
    ]  # fmt: skip
    for _ in range(level):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                point = points[a] + points[b]
                middles[key] = len(points)
                points.append(point / np.linalg.norm(point))
            return middles[key]

        finer = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return np.array(points), np.array(faces)


def ball_mesh(material: Material, level: int = 2, smooth: bool = False, casts_shadows: bool = True) -> Mesh:
    """A unit sphere of triangles."""
    vertices, faces = icosphere(level)
    return Mesh(vertices, faces, material, vertices.copy() if smooth else None, casts_shadows=casts_shadows)


def shoot(
    renderer: Renderer,
    scene: Scene | PreparedScene,
    width: int = 1,
    height: int = 1,
    *,
    samples: int = 1,
    depth: int = 5,
    tiling: str = "full",
    linear: bool = True,
    camera: Camera | None = None,
    antialiasing: str = "stochastic",
    shadow_samples: int = 4,
) -> Frame:
    """A frame with the gaze in the middle of a 50 cm wide screen of square pixels."""
    prepared = prepare(scene) if isinstance(scene, Scene) else scene
    quality = Quality(
        map=tiling,
        samples_per_cell=samples,
        max_depth=depth,
        antialiasing=antialiasing,
        shadow_samples=shadow_samples,
    )
    return renderer.render(
        prepared, FrameRequest(Gaze(width / 2, height / 2), Display(width, height), camera, quality, linear)
    )


def pixel(renderer: Renderer, scene: Scene | PreparedScene, *, depth: int = 5, camera: Camera | None = None) -> float:
    """Red radiance along the ray to the camera's `look_at`."""
    return float(shoot(renderer, scene, depth=depth, camera=camera).pixels[0, 0, 0])


def aim(position: Rgb, look_at: Rgb) -> Camera:
    """A camera whose only interesting ray is the middle one."""
    along = np.subtract(look_at, position)
    return Camera(position, look_at, (0.0, 0.0, -1.0) if not along[0] and not along[2] else (0.0, 1.0, 0.0), 1.0)


DOWN = aim((0, 3, 0), (0, 0, 0))
"""Looks straight down at the origin from 3 m."""


def glass_and_mirror() -> Scene:
    """A ball of glass and one of mirror on a checkered floor under two lights."""
    checks = Texture(np.uint8([[[230] * 3, [30] * 3], [[30] * 3, [230] * 3]]))
    ground = floor(Material("tiles", diffuse_texture=checks), -1.0)
    return Scene(
        meshes=(dataclasses.replace(ground, uvs=ground.uvs * 5 if ground.uvs is not None else None),),
        spheres=(Sphere((-1, 0, 0), 1.0, glass()), Sphere((1, 0, -0.5), 1.0, mirror(0.8))),
        lights=(light(3, 5, 4, 90.0), light(-4, 3, 2, 40.0)),
        surroundings=Surroundings((0.3, 0.5, 0.9), (0.7, 0.7, 0.7), (0.05, 0.05, 0.05)),
        camera=Camera((0, 1, 7), (0, 0, 0)),
    )


ABOVE, BELOW = Surroundings(zenith=WHITE), Surroundings(horizon=WHITE)
HEIGHT = ABOVE
"""Radiance is the height of the ray's direction: rays that go level or down see nothing."""


def straight_share(angle_deg: float, *indices: float) -> float:
    """What a ray keeps that crosses parallel faces between media of these indices."""
    sine, share = math.sin(math.radians(angle_deg)) * indices[0], 1.0
    for before, behind in itertools.pairwise(indices):
        cosine, refracted = (math.sqrt(1 - (sine / n) ** 2) for n in (before, behind))
        share *= 1 - fresnel(cosine, refracted, before / behind)
    return share
