"""Along axes, tiny, giant, far away and grazing: what is hit, where, and that scale and place change no bit."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.embree import EmbreeTriangles
from renderer.errors import SceneError
from renderer.kernel import kernel
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.scene import Material, Mesh, PointLight, Rgb, Scene, Sphere, Surroundings, Texture
from renderer.surface import weights_at
from tests.renderer.drawing import (
    EVERYWHERE_1,
    FINE,
    WHITE_LAMBERT,
    U,
    aim,
    ball_mesh,
    box,
    floor,
    glass,
    lamp,
    light,
    mirror,
    pixel,
    shoot,
)
from tests.stability.shapes import Floats, directions, prepared_mesh, rotation, sheet, traced

TRIANGLE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
RIGHT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
FRONT = Camera((0, 0, 4), (0, 0, 0))


# along axes


@pytest.mark.parametrize("singly", [False, True], ids=["packets", "singly"])
def test_h14_axis_parallel_rays_that_touch_a_box_hit_it(singly: bool) -> None:
    """The box [0, 1]^3, along each axis from one unit away: through faces, in the plane of a face, along an edge and at
    a corner, with +0 and -0 for the other parts of the direction. Touching is a hit, at a distance of exactly 1.
    """
    mesh = box((0, 0, 0), (1, 1, 1), WHITE_LAMBERT)
    made = EmbreeTriangles(mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32), singly=singly)
    places = (0.0, 0.25, 0.5, 1.0)
    for axis, forward, (a, b), zero in itertools.product(
        range(3), (True, False), itertools.product(places, places), (0.0, -0.0)
    ):
        others = [other for other in range(3) if other != axis]
        origin, direction = np.zeros((1, 3), np.float32), np.full((1, 3), zero, np.float32)
        origin[0, others], origin[0, axis] = (a, b), -1.0 if forward else 2.0
        direction[0, axis] = 1.0 if forward else -1.0
        found, distance = made.nearest(origin, direction)
        assert found[0] >= 0, (origin, direction)
        assert distance[0] == 1.0


def test_h14_straight_down_at_every_corner_of_a_grid() -> None:
    """3,969 rays at the inner corners of 64x64 squares: none is lost."""
    vertices, faces = sheet(64, 6.4)
    prepared = prepared_mesh(vertices, faces)
    inner = traced(prepared, vertices[(np.abs(vertices[:, :2]) < 3.19).all(axis=1)])
    assert len(inner) == 63 * 63
    for zero in (0.0, -0.0):
        down = np.tile(np.float32([zero, zero, -1.0]), (len(inner), 1))
        assert (prepared.intersector.nearest(inner + np.float32([0, 0, 1]), down).primitive >= 0).all()


# tiny and giant


@kernel
def weigh(
    facets: NDArray[np.float32],
    triangle: int,
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> None:
    """Barycentric weights where rays meet a triangle."""
    for ray in range(len(weights)):
        weights[ray, 0], weights[ray, 1] = weights_at(
            facets, triangle, origin[ray, 0], origin[ray, 1], origin[ray, 2],
            direction[ray, 0], direction[ray, 1], direction[ray, 2],
        )  # fmt: skip


def weights_met(
    prepared: PreparedScene, triangle: int, origin: NDArray[np.float32], direction: NDArray[np.float32]
) -> tuple[Floats, Floats]:
    """The second and third weight of each hit as shading gets them, and in extended precision (Cramer's rule)."""
    facets = prepared.surfaces.facets
    found = np.zeros((len(origin), 2))
    weigh(facets, triangle, origin.astype(np.float64), direction.astype(np.float64), found)
    a, b, c = facets[triangle, :24].reshape(3, 8)[:, :3].astype(np.longdouble)
    o, d = origin.astype(np.longdouble) - a, direction.astype(np.longdouble)
    p = np.cross(d, c - a)
    volume = (p * (b - a)).sum(axis=1)
    truth = np.stack([(o * p).sum(axis=1), (d * np.cross(o, b - a)).sum(axis=1)], axis=1) / volume[:, None]
    return found, truth.astype(np.float64)


def inner_weights(rng: np.random.Generator, count: int) -> Floats:
    """(count, 3) weights of points at least 1e-3 inside a triangle."""
    return np.asarray(1e-3 + 0.997 * rng.dirichlet((1, 1, 1), count))


@pytest.mark.parametrize("exponent", [-60, -40, -28, -20, 0, 20, 28, 39])
def test_h15_h16_a_triangle_of_any_size_is_hit_where_it_should_be(exponent: int) -> None:
    """Edge 2^k, 5,000 rays from two edges away: all hit, weights to 1e-6, which would be 4e-7 in Embree's float32.

    Without bringing scenes to about unit size, weights would silently be 0 below an edge of 2^-28 (Embree's area
    falls under 1e-18), and nothing would be hit above 2^42.
    """
    edge = 2.0**exponent
    prepared = prepared_mesh(edge * RIGHT, [0, 1, 2])
    rng = np.random.default_rng(15)
    target = inner_weights(rng, 5000) @ (edge * RIGHT)
    away = directions(rng, 5000)
    away[:, 2] = np.copysign(np.maximum(np.abs(away[:, 2]), 0.1), away[:, 2])
    origin = traced(prepared, target + 2 * edge * away)
    direction = traced(prepared, target) - origin
    assert (prepared.intersector.nearest(origin, direction).primitive == 0).all()
    found, truth = weights_met(prepared, 0, origin, direction)
    np.testing.assert_allclose(found, truth, atol=1e-6)


@pytest.mark.parametrize("cosine", [1.0, 1e-2])
@pytest.mark.parametrize("exponent", [-10, -20, -24, -28])
def test_h15_a_tiny_triangle_in_a_scene_of_unit_size(exponent: int, cosine: float) -> None:
    """Embree finds it; the weights are not its own but float64, so they stay right where Embree's are 0."""
    edge = 2.0**exponent
    far = np.array([[-1.0, -1.0, -1.0], [-1.0, -0.9, -1.0], [-0.9, -1.0, -1.0]])
    prepared = prepared_mesh(np.concatenate([edge * RIGHT, far, -far]), np.arange(9))
    assert prepared.scale == 1.0 / 2.0
    rng = np.random.default_rng(16)
    target = inner_weights(rng, 5000) @ (edge * RIGHT)
    around = rng.uniform(0, 2 * math.pi, 5000)
    sine = math.sqrt(1.0 - cosine * cosine)
    away = np.stack([sine * np.cos(around), sine * np.sin(around), np.full(5000, cosine)], axis=1)
    origin = traced(prepared, target + 2 * edge * away)
    direction = traced(prepared, target) - origin
    assert (prepared.intersector.nearest(origin, direction).primitive == 0).all()
    found, truth = weights_met(prepared, 0, origin, direction)
    np.testing.assert_allclose(found, truth, atol=1e-6)
    np.testing.assert_allclose(found, weights_of(edge, target), atol=1e-5 / cosine)


def weights_of(edge: float, target: Floats) -> Floats:
    return np.asarray(target[:, :2] / edge)


@pytest.mark.parametrize("exponent", [40, 42, 43, 44, 60])
def test_h16_what_is_larger_than_a_scene_may_be_is_refused(exponent: int) -> None:
    with pytest.raises(SceneError, match=r"expected finite coordinates up to 1e\+12 m"):
        Mesh(2.0**exponent * RIGHT, np.array([[0, 1, 2]]), WHITE_LAMBERT)


@pytest.mark.parametrize("place", [0.0, 1e3, -1e9])
@pytest.mark.parametrize("size", [1e-9, 0.3, 1.0, 7.0, 1e11])
def test_h16_geometry_is_brought_to_about_unit_size(place: float, size: float) -> None:
    if abs(place) > 1e6 * size:
        return
    prepared = prepared_mesh(size * TRIANGLE + place, [0, 1, 2])
    extent = size * 2 * prepared.scale
    assert 1.0 <= extent < 2.0
    assert np.log2(prepared.scale) == round(np.log2(prepared.scale))
    np.testing.assert_allclose(prepared.center, (place, place, place), atol=1e-9 * (abs(place) + size))


@pytest.mark.parametrize("size", [5e-324, 1e-300, 1e-100, 1e-20])
def test_h15_an_absurdly_small_scene_is_a_finite_picture(renderer: Renderer, size: float) -> None:
    """Nothing of it can be seen from metres away; it must not turn coordinates into infinities."""
    tiny = Mesh(size * TRIANGLE, np.array([[0, 1, 2]]), WHITE_LAMBERT)
    for scene in (
        Scene(spheres=(Sphere((0, 0, 0), size, WHITE_LAMBERT),), lights=(light(1, 1, 1),), camera=FRONT),
        Scene(meshes=(tiny,), lights=(light(1, 1, 1),), camera=FRONT),
        Scene(meshes=(box((0, 0, 0), (size, size, size), mirror()),), lights=(light(1, 1, 1),), camera=FRONT),
    ):
        frame = shoot(renderer, scene, 5, 5)
        assert np.isfinite(frame.pixels).all()
        assert frame.cost.rejected_samples.total == 0


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e6, 1e11])
def test_h15_h16_any_size_looks_the_same(renderer: Renderer, size: float) -> None:
    """Not a power of two: the input is rounded anew, so to 1e-4 but for a pixel of the outline."""
    pictures = []
    for s in (1.0, size):
        mesh = dataclasses.replace(ball_mesh(WHITE_LAMBERT, 2), vertices=ball_mesh(WHITE_LAMBERT, 2).vertices * s)
        lights = (light(2 * s, 3 * s, 4 * s, 90.0 * s * s),)
        scene = Scene(meshes=(mesh,), lights=lights, camera=Camera((0, 0, 4 * s), (0, 0, 0)))
        pictures.append(shoot(renderer, scene, 64, 64).pixels[..., 0])
    different = np.abs(pictures[1] - pictures[0]) > 1e-4 * pictures[0].max()
    assert different.sum() <= 4


# larger and elsewhere


def moved(scene: Scene, factor: float, offset: Rgb) -> Scene:
    """The whole scene and its camera larger by `factor` and elsewhere; light falls as before."""

    def place(point: Rgb) -> Rgb:
        x, y, z = (factor * a + b for a, b in zip(point, offset, strict=True))
        return x, y, z

    return dataclasses.replace(
        scene,
        meshes=tuple(dataclasses.replace(m, vertices=m.vertices * factor + np.array(offset)) for m in scene.meshes),
        spheres=tuple(dataclasses.replace(s, center=place(s.center), radius=s.radius * factor) for s in scene.spheres),
        lights=tuple(
            dataclasses.replace(
                lamp,
                position=place(lamp.position),
                intensity=tuple(factor * factor * part for part in lamp.intensity),
            )
            for lamp in scene.lights
        ),
        camera=dataclasses.replace(
            scene.camera, position=place(scene.camera.position), look_at=place(scene.camera.look_at)
        ),
    )


def everything() -> Scene:
    """All effects at once; coordinates are multiples of 1/1024."""
    checks = Texture(np.uint8([[[220] * 3, [40] * 3], [[40] * 3, [220] * 3]]))
    tiles = Material("tiles", diffuse=(0.8, 0.7, 0.6), specular=(0.2, 0.2, 0.2), diffuse_texture=checks)
    brushed = Material("brushed", specular=(0.8,) * 3, base="ashikhmin-shirley", exponent_u=90.0, exponent_v=9.0)
    ground = floor(tiles, y=-0.5, half=2.0)
    ground = dataclasses.replace(ground, uvs=ground.uvs * 7 if ground.uvs is not None else None)
    ball = ball_mesh(Material("shiny", diffuse=(0.2, 0.4, 0.7), specular=(0.5,) * 3, reflection=(0.2,) * 3), 2, True)
    vertices = np.round((0.375 * ball.vertices + (0.5, 0, -0.25)) * 1024) / 1024
    return Scene(
        meshes=(
            ground,
            dataclasses.replace(ball, vertices=vertices),
            box((-1.5, -0.5, -1.5), (-1, 0.25, -1), mirror(0.9)),
        ),
        spheres=(
            Sphere((-0.375, 0, 0.25), 0.375, glass()),
            Sphere((0.125, -0.25, 0.75), 0.25, mirror(0.8)),
            Sphere((-0.75, -0.25, 0.75), 0.25, brushed),
        ),
        lights=(PointLight((1, 2, 1.5), (9e-8, 7e-8, 5e-8)), PointLight((-1.5, 1, 1), (2e-8, 3e-8, 4e-8))),
        surroundings=Surroundings((1e-9, 2e-9, 4e-9), (3e-9, 3e-9, 2e-9), (5e-10, 5e-10, 5e-10)),
        camera=Camera((0.25, 0.75, 3), (0, -0.125, 0), vertical_fov_deg=35),
        exposure=1e8,
    )


@pytest.mark.parametrize("power", [-20, -10, -1, 1, 10, 20, 38])
def test_h17_a_power_of_two_changes_no_bit(renderer: Renderer, power: int) -> None:
    """Lights stronger by the square of the scale. Any absolute epsilon anywhere fails this; 2^38 is the largest of
    these scenes that is not refused.
    """
    scene = everything()
    plain, scaled = (shoot(renderer, s, 48, 36, samples=2) for s in (scene, moved(scene, 2.0**power, (0, 0, 0))))
    np.testing.assert_array_equal(scaled.pixels, plain.pixels)
    assert scaled.cost.rays == plain.cost.rays
    assert set(plain.cost.effects) == {"shadows", "specular", "textures", "reflection", "refraction"}


@pytest.mark.parametrize("factor", [10.0, 0.3])
def test_h17_other_factors_change_only_outlines(renderer: Renderer, factor: float) -> None:
    """The input is rounded anew: to 1e-4 of the brightest, but for one pixel in a thousand at outlines and texels."""
    scene = everything()
    plain, scaled = (shoot(renderer, s, 96, 72).pixels for s in (scene, moved(scene, factor, (0, 0, 0))))
    off = (np.abs(scaled - plain) > 1e-4 * plain.max()).any(axis=2)
    assert off.sum() < 96 * 72 / 1000


@pytest.mark.parametrize("distance", [1.0, 16.0, 256.0, 1024.0, 8192.0])
def test_h18_far_away_changes_no_bit(renderer: Renderer, distance: float) -> None:
    """Coordinates are multiples of 1/1024, which moving does not round."""
    scene = everything()
    plain, far = (
        shoot(renderer, s, 48, 36, samples=2) for s in (scene, moved(scene, 1.0, (distance, -distance, distance)))
    )
    np.testing.assert_array_equal(far.pixels, plain.pixels)


def test_h18_small_triangles_seen_from_very_far() -> None:
    """Embree, verify.cpp, SmallTriangleHit: a turned 100x100 grid of side 100, rays from 1e6 away to the middles of its
    triangles: each meets the triangle it goes to, from either side.
    """
    rng = np.random.default_rng(18)
    vertices, faces = sheet(100, 100.0)
    turn = rotation(rng)
    prepared = prepared_mesh(vertices @ turn.T, faces)
    target = traced(prepared, vertices @ turn.T)[faces].astype(np.float64).mean(axis=1)
    for side in (1e6, -1e6):
        origin = target + side * prepared.scale * turn[:, 2]
        # Float32 holds such an origin to 1e-3 triangles only; the ray still goes to the middle.
        start = origin.astype(np.float32)
        way = (target - start).astype(np.float32)
        np.testing.assert_array_equal(prepared.intersector.nearest(start, way).primitive, np.arange(len(faces)))


# grazing

COSINES = (1.0, 1e-2, 1e-4, 1e-6, 1e-8)


@pytest.mark.parametrize("cosine", COSINES)
def test_h19_grazing_rays_hit_where_they_should(cosine: float) -> None:
    """2,000 rays over the triangle (0,0,0), (1,0,0), (0,1,0): all hit, weights to 5e-7."""
    prepared = prepared_mesh(RIGHT, [0, 1, 2])
    rng = np.random.default_rng(19)
    target = inner_weights(rng, 2000) @ RIGHT
    around = rng.uniform(0, 2 * math.pi, 2000)
    sine = math.sqrt(1.0 - cosine * cosine)
    direction = np.stack([sine * np.cos(around), sine * np.sin(around), np.full(2000, -cosine)], axis=1)
    direction = direction.astype(np.float32)
    origin = traced(prepared, target).astype(np.float64) - 2.0 * direction
    start = origin.astype(np.float32)
    assert (prepared.intersector.nearest(start, direction).primitive == 0).all()
    found, truth = weights_met(prepared, 0, start, direction)
    inside = (truth > 0).all(axis=1) & (truth.sum(axis=1) < 1)
    np.testing.assert_allclose(found[inside], truth[inside], atol=5e-7)


@pytest.mark.parametrize("cosine", COSINES[:4])
def test_h19_on_a_turned_plane_a_hit_is_off_by_rounding_over_the_cosine(cosine: float) -> None:
    """At most 8 roundings of the largest coordinate, over the cosine: what float32 rays can say at all."""
    rng = np.random.default_rng(20)
    turn = rotation(rng)
    prepared = prepared_mesh(4.0 * RIGHT @ turn.T, [0, 1, 2])
    corners = prepared.surfaces.facets[0, :24].reshape(3, 8)[:, :3].astype(np.float64)
    target = inner_weights(rng, 2000) @ corners
    sine = math.sqrt(1.0 - cosine * cosine)
    around = rng.uniform(0, 2 * math.pi, 2000)
    away = np.stack([sine * np.cos(around), sine * np.sin(around), np.full(2000, cosine)], axis=1) @ turn.T
    origin = (target + 2.0 * away).astype(np.float32)
    direction = (target - origin).astype(np.float32)
    hits = prepared.intersector.nearest(origin, direction)
    found, _ = weights_met(prepared, 0, origin, direction)
    place = (1 - found.sum(axis=1))[:, None] * corners[0] + found[:, :1] * corners[1] + found[:, 1:] * corners[2]
    bound = 8 * U * np.maximum(np.abs(origin).max(axis=1), np.abs(target).max(axis=1)) / cosine
    assert (np.linalg.norm(place - target, axis=1) <= bound).all()
    assert (hits.primitive[bound < 1e-3] == 0).all()


@pytest.mark.parametrize("height", [0.0, -0.0, 1e-8, 1e-4])
def test_h19_light_at_grazing_incidence_is_never_negative(renderer: Renderer, height: float) -> None:
    """A lamp in the plane of the floor sends nothing; just above, I cos / (pi d^2), which is never below 0."""
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(1.0, height, 0.0),), exposure=FINE)
    seen = pixel(renderer, scene, camera=aim((0, 3, 0), (0, 0, 0)))
    assert seen == pytest.approx(height / math.pi / (1.0 + height * height) ** 1.5, rel=8 * U)
    assert seen >= 0.0


@pytest.mark.parametrize("height", [1e-8, 1e-6, 1e-3])
def test_h19_a_grazing_mirror_ray_stays_above_the_face(renderer: Renderer, height: float) -> None:
    """The mirror shows the surroundings, never the bright floor beneath it."""
    scene = Scene(
        meshes=(floor(mirror()), floor(lamp(5.0), -0.5)), surroundings=EVERYWHERE_1, camera=Camera((0, 0, 4), (0, 0, 0))
    )
    camera = Camera((-4.0, 4.0 * height, 0.0), (0.0, 0.0, 0.0), (0, 1, 0), 1.0)
    assert pixel(renderer, scene, camera=camera) == 1.0
