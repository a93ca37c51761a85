"""Transparent solids in and over each other: what is there follows from their priorities, not from luck.

The truth for overlaps is that of Schmidt and Budge ("Simple Nested Dielectrics in Ray Traced Images", Journal of
Graphics Tools 7(2), 2002): of several solids around a place the one of the highest priority is what there is.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.errors import SceneError
from renderer.fresnel import fresnel, refracted_cosine
from renderer.media import BITS, MASK, MOST_AROUND, crossed, dominant, rank_media, with_medium, without_medium
from renderer.nested import media_at
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.scene import Material, Mesh, Rgb, Scene, Sphere, Surroundings, Texture
from tests.renderer.drawing import (
    BLACK,
    FINE,
    HEIGHT,
    WHITE,
    U,
    aim,
    ball_mesh,
    box,
    glass,
    lamp,
    pixel,
    shoot,
    straight_share,
)

DUSK = Surroundings(zenith=WHITE, horizon=(0.2, 0.4, 0.1))
VIEW = Camera((0, 0.5, 6), (0, 0, 0), vertical_fov_deg=25)


def solid(ior: float, priority: int, name: str = "solid") -> Material:
    return dataclasses.replace(glass(ior), priority=priority, name=name)


def sized(mesh: Mesh, factor: float) -> Mesh:
    return dataclasses.replace(mesh, vertices=mesh.vertices * factor)


def inside_out(mesh: Mesh) -> Mesh:
    normals = None if mesh.normals is None else -mesh.normals
    return dataclasses.replace(mesh, faces=mesh.faces[:, ::-1].copy(), normals=normals)


# 33 a: layers

SINE = math.sin(math.radians(45))
FROM_BELOW = aim((-3 * SINE, -3 - 3 * SINE, 0), (0, -3, 0))


def layer(low: float, high: float, material: Material) -> Mesh:
    return box((-50, low, -50), (50, high, 50), material)


@pytest.mark.parametrize(
    "layers",
    [
        pytest.param(
            (layer(-3, 0, glass()), layer(-2, -1, glass(1.33 / 1.5))), id="faces that state the ratio of their sides"
        ),
        pytest.param((layer(-3, 0, solid(1.5, 0)), layer(-2, -1, solid(1.33, 1))), id="water in glass"),
        *(
            pytest.param(
                (layer(-1, 0, solid(1.5, 1)), layer(-2 - d, -1 + d, solid(1.33, 0)), layer(-3, -2, solid(1.5, 1))),
                id=f"water that overlaps its glass by {d:g}",
            )
            for d in (1e-1, 1e-3, 1e-4, 0.0)
        ),
    ],
)
def test_h33_layers_keep_n_sine(renderer: Renderer, layers: tuple[Mesh, ...]) -> None:
    """air | 1.5 | 1.33 | 1.5 | air at 45 degrees: 28.1255057, 32.1176313, 28.1255057 and 45 again; tolerance: ten
    roundings of float32. The height at which the ray leaves tells its angle, its brightness the Fresnel shares.
    """
    for order in itertools.permutations(layers):
        scene = Scene(meshes=order, surroundings=HEIGHT, exposure=FINE)
        seen = pixel(renderer, scene, depth=4, camera=FROM_BELOW)
        assert seen == pytest.approx(SINE * straight_share(45, 1, 1.5, 1.33, 1.5, 1), abs=1e-6)


# 33 b, d: things in things


@pytest.mark.parametrize("eye", [(0, 0.5, 6), (0.1, 0.2, 0.05), (0.7, 0.1, 0.1)])
def test_h33_an_air_bubble_in_a_glass_ball(renderer: Renderer, eye: Rgb) -> None:
    """A bubble of index 1 and higher priority is a ball whose face states 1 / 1.5; seen from outside, in the bubble
    and in the glass. The stated ratio is rounded to float32, which near the critical angle is 1e-6 of the light.
    """
    camera = Camera(eye, (0, 0, 0.3))
    stated, nested = (
        Scene(spheres=(Sphere((0, 0, 0), 1.0, outer), Sphere((0, 0, 0), 0.5, inner)), surroundings=DUSK, exposure=1e3)
        for outer, inner in ((glass(), glass(1 / 1.5)), (solid(1.5, 0), solid(1.0, 1)))
    )
    frames = [shoot(renderer, scene, 48, 48, depth=10, camera=camera) for scene in (stated, nested)]
    np.testing.assert_allclose(frames[1].pixels, frames[0].pixels, atol=1e-5)
    assert frames[0].cost.rays == frames[1].cost.rays


@pytest.mark.parametrize(
    "hidden",
    [
        (Sphere((0, 0, 0), 0.5, solid(1.5, 0)),),
        (Sphere((0, 0, 0), 0.5, solid(1.5, -1, "shard")), Sphere((0.3, 0.2, 0.1), 0.6, solid(1.31, -1, "ice"))),
        (Sphere((0, 0, 0), 1.0, solid(1.2, -2, "shell")),),
    ],
)
def test_h33_a_ball_of_the_same_glass_inside_changes_no_bit(renderer: Renderer, hidden: tuple[Sphere, ...]) -> None:
    """Nor does anything else that the glass displaces; it costs no rays and no depth."""
    one = Scene(spheres=(Sphere((0, 0, 0), 1.0, solid(1.5, 0)),), surroundings=DUSK, exposure=1e3, camera=VIEW)
    plain = dataclasses.replace(one, spheres=(Sphere((0, 0, 0), 1.0, glass()),))
    truth = shoot(renderer, plain, 32, 32, depth=12)
    for spheres in (one.spheres, one.spheres + hidden, hidden + one.spheres):
        frame = shoot(renderer, dataclasses.replace(one, spheres=spheres), 32, 32, depth=12)
        np.testing.assert_array_equal(frame.pixels, truth.pixels)
        assert frame.cost.rays == truth.cost.rays


def test_h33_a_mesh_inside_a_mesh_changes_no_bit(renderer: Renderer) -> None:
    outer, inner = ball_mesh(solid(1.5, 0), 3, smooth=True), sized(ball_mesh(solid(1.4, -1), 3, smooth=True), 0.6)
    one = Scene(meshes=(outer,), surroundings=DUSK, exposure=1e3, camera=VIEW)
    alone = shoot(renderer, one, 32, 32, depth=12).pixels
    for meshes in ((outer, inner), (inner, outer)):
        seen = shoot(renderer, dataclasses.replace(one, meshes=meshes), 32, 32, depth=12).pixels
        np.testing.assert_array_equal(seen, alone)


def test_h33_a_ball_of_the_same_index_but_another_medium(renderer: Renderer) -> None:
    """Its face is seen, mirrors nothing and bends nothing; rays start anew behind it, which moves them by the offset
    of 2e-6. Unprioritised, such a ball has the index 1.
    """
    outer = Sphere((0, 0, 0), 1.0, solid(1.5, 0))
    one = Scene(spheres=(outer,), surroundings=DUSK, exposure=1e3, camera=VIEW)
    truth = shoot(renderer, one, 32, 32, depth=12)
    two = dataclasses.replace(one, spheres=(outer, Sphere((0, 0, 0), 0.5, solid(1.5, 1, "other"))))
    frame = shoot(renderer, two, 32, 32, depth=32)
    np.testing.assert_allclose(frame.pixels, shoot(renderer, one, 32, 32, depth=32).pixels, atol=1e-5)
    assert truth.cost.rays.refraction < frame.cost.rays.refraction


# 33 c: water in its glass


def glass_of_water(overlap: float) -> tuple[Mesh, ...]:
    """A glass ball with a cavity, and water that reaches beyond the cavity by `overlap`."""
    clear, water = solid(1.5, 2, "glass"), solid(1.33, 1, "water")
    return (
        ball_mesh(clear, 3, smooth=True),
        sized(inside_out(ball_mesh(clear, 3, smooth=True)), 0.7),
        sized(ball_mesh(water, 3, smooth=True), 0.7 + overlap),
    )


@pytest.mark.parametrize("overlap", [1e-2, 1e-3, 1e-5, 0.0])
def test_h33_water_that_overlaps_or_touches_its_glass(renderer: Renderer, overlap: float) -> None:
    """Whatever the overlap, the picture is that of a face which states 1.33 / 1.5, to rounding: there is no dark
    ring of air in between. Neither the order of the meshes nor that of their triangles' corners changes a bit.
    """
    stated = Scene(
        meshes=(ball_mesh(glass(), 3, smooth=True), sized(ball_mesh(glass(1.33 / 1.5), 3, smooth=True), 0.7)),
        surroundings=DUSK,
        exposure=1e3,
        camera=VIEW,
    )
    truth = shoot(renderer, stated, 48, 48, depth=8).pixels
    parts = glass_of_water(overlap)
    turned = tuple(dataclasses.replace(mesh, faces=np.roll(mesh.faces, 1, axis=1)) for mesh in parts[2:])
    pictures = [
        shoot(renderer, dataclasses.replace(stated, meshes=meshes), 48, 48, depth=8).pixels
        for meshes in (parts, parts[::-1], (*parts[:2], *turned))
    ]
    np.testing.assert_allclose(pictures[0], truth, atol=2e-6)
    np.testing.assert_array_equal(pictures[1], pictures[0])
    np.testing.assert_allclose(pictures[2], pictures[0], atol=2e-6)


@pytest.mark.parametrize("overlap", [1e-6, 1e-7, -1e-7, -1e-3])
def test_h33_water_that_misses_its_glass_or_hardly_touches_it_is_finite(renderer: Renderer, overlap: float) -> None:
    """Faces closer than the two offsets of a ray, 4e-6, are beyond what is promised: a ray passes both at once. What
    it then leaves it has been in, so that no error outlives the next face; the picture stays what light allows, and
    its mean within 0.02 of that of water which touches. A gap of 1e-3 is one, filled with air.
    """
    scene = Scene(meshes=glass_of_water(overlap), surroundings=DUSK, exposure=1e3, camera=VIEW)
    touching = dataclasses.replace(scene, meshes=glass_of_water(0.0))
    seen, truth = (shoot(renderer, made, 32, 32, depth=8) for made in (scene, touching))
    assert np.isfinite(seen.pixels).all()
    assert seen.pixels.min() >= 0.0
    assert seen.pixels.max() <= 1 + 32 * U
    assert seen.cost.rejected_samples.total == 0
    if abs(overlap) < 4e-6:
        assert seen.pixels.mean() == pytest.approx(truth.pixels.mean(), abs=0.02)


def test_h33_two_blocks_that_share_a_face_are_one(renderer: Renderer) -> None:
    blocks = (box((-1, -1, -1), (0, 1, 1), solid(1.5, 0)), box((0, -1, -1), (1, 1, 1), solid(1.5, 0)))
    one = Scene(meshes=(box((-1, -1, -1), (1, 1, 1), solid(1.5, 0)),), surroundings=DUSK, exposure=1e3, camera=VIEW)
    whole, halves = (
        shoot(renderer, dataclasses.replace(one, meshes=meshes), 33, 32, depth=10).pixels
        for meshes in (one.meshes, blocks)
    )
    different = (np.abs(whole - halves) > 1e-5).any(axis=2)
    assert different.mean() < 0.01


# any overlaps, against a slow second way


def slow_radiance(
    spheres: tuple[Sphere, ...], origin: NDArray[np.float64], direction: NDArray[np.float64], depth: int
) -> NDArray[np.float64]:
    """What a ray sees, by asking at each stretch of it which spheres are around; all in float64."""
    crossings = []
    for sphere in spheres:
        to_centre = origin - sphere.center
        half, spare = -to_centre @ direction, 0.0
        spare = sphere.radius**2 - float(((to_centre + half * direction) ** 2).sum())
        if spare > 0.0:
            crossings += [(t, sphere) for t in (half - math.sqrt(spare), half + math.sqrt(spare)) if t > 1e-9]
    crossings.sort(key=lambda crossing: crossing[0])
    ends = [0.0, *(t for t, _ in crossings), (crossings[-1][0] if crossings else 0.0) + 2.0]
    stretches = [medium_at(spheres, origin + (a + b) / 2 * direction) for a, b in itertools.pairwise(ends)]
    for (t, sphere), before, behind in zip(crossings, stretches[:-1], stretches[1:], strict=True):
        if before == behind:
            continue
        if depth == 0:
            return np.zeros(3)
        place = origin + t * direction
        normal = (place - sphere.center) / sphere.radius
        normal = normal if normal @ direction < 0.0 else -normal
        eta, cosine = before[1] / behind[1], float(-normal @ direction)
        refracted = refracted_cosine(cosine, eta)
        share = fresnel(cosine, refracted, eta)
        seen = share * slow_radiance(spheres, place, direction + 2 * cosine * normal, depth - 1)
        if share < 1.0:
            bent = eta * direction + (eta * cosine - refracted) * normal
            seen = seen + (1 - share) * slow_radiance(spheres, place, bent / np.linalg.norm(bent), depth - 1)
        return seen
    high = min(1.0, max(0.0, float(direction[1])))
    return high * np.array(DUSK.zenith) + (1 - high) * np.array(DUSK.horizon)


def medium_at(spheres: tuple[Sphere, ...], place: NDArray[np.float64]) -> tuple[int, float]:
    """Priority and index of what there is at a place."""
    around = [s.material for s in spheres if float(((place - s.center) ** 2).sum()) < s.radius**2]
    return max(((m.priority or 0, m.ior) for m in around), default=(-99, 1.0))


def random_spheres(seed: int) -> tuple[Sphere, ...]:
    rng = np.random.default_rng(seed)
    return tuple(
        Sphere(
            tuple(rng.uniform(-0.6, 0.6, 3)),
            float(rng.uniform(0.3, 0.9)),
            solid(float(rng.choice([1.0, 1.31, 1.5, 2.4])), int(rng.integers(-1, 2)), f"{index}"),
        )
        for index in range(4)
    )


@pytest.mark.parametrize("seed", range(6))
def test_h33_any_overlaps_are_what_priority_says_at_every_place(renderer: Renderer, seed: int) -> None:
    """Four spheres of random indices, priorities, places; the eye outside (even) or among them (odd); 81 rays a
    scene, depth 4. Tolerance: 1e-4, what the offset of rays makes of the bend of balls; one ray in 81 may pass an
    edge on the other side.
    """
    spheres = random_spheres(seed)
    eye = (0.1, 0.05, 4.0) if seed % 2 == 0 else (0.11, 0.07, 0.05)
    camera = Camera(eye, (0, 0, -1), vertical_fov_deg=30 if seed % 2 == 0 else 90)
    scene = Scene(spheres=spheres, surroundings=DUSK, exposure=FINE)
    seen = shoot(renderer, scene, 9, 9, depth=4, camera=camera).pixels
    half = math.tan(math.radians(camera.vertical_fov_deg / 2))
    forward = np.subtract(camera.look_at, eye) / np.linalg.norm(np.subtract(camera.look_at, eye))
    right = np.cross(forward, (0, 1, 0))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    wrong = 0
    for row, column in np.ndindex(9, 9):
        x, y = (column - 4) / 4.5 * half, (4 - row) / 4.5 * half
        ray = forward + x * right + y * up
        truth = slow_radiance(spheres, np.array(eye), ray / np.linalg.norm(ray), 4)
        wrong += bool(np.abs(seen[row, column] - truth).max() > 1e-4)
    assert wrong <= 1


# 34: what the camera is in


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.tuples(*[st.floats(-1.2, 1.2)] * 3))
def test_h34_the_camera_knows_what_it_is_in(seed: int, eye: Rgb) -> None:
    """For any place among spheres, an opaque one and a lamp too."""
    spheres = (*random_spheres(seed), Sphere((0.2, 0.8, 0.3), 0.3, Material("opaque")))
    distances = [math.dist(eye, s.center) / s.radius for s in spheres]
    if min(abs(d - 1) for d in distances) < 1e-4:
        return
    prepared = prepare(Scene(spheres=spheres))
    place = ((np.array(eye) - prepared.center) * prepared.scale).astype(np.float32)
    ranked = rank_media([s.material for s in spheres])
    inside = Counter(ranked.index(s.material) + 1 for s, d in zip(spheres, distances, strict=True) if d < 1 and
                     s.material in ranked)  # fmt: skip
    assert unpacked(media_at(prepared, place)) == inside


def test_h34_from_water_a_glass_wall_shows_what_is_outside(renderer: Renderer) -> None:
    """A diver behind glass: the eye in water, then glass, then air, at 30 degrees to the wall: the ray leaves
    upwards at asin(1.33 sin 30), whatever glass is in between.
    """
    water, wall = layer(-9, -1 + 1e-3, solid(1.33, 0, "water")), layer(-1, 0, solid(1.5, 1, "glass"))
    eye = (-math.tan(math.radians(30)), -2.0, 0.0)
    scene = Scene(meshes=(water, wall), surroundings=HEIGHT, exposure=FINE)
    seen = pixel(renderer, scene, depth=2, camera=aim(eye, (0, -1, 0)))
    leaving = math.sqrt(1 - (1.33 * math.sin(math.radians(30))) ** 2)
    assert seen == pytest.approx(leaving * straight_share(30, 1.33, 1.5, 1), abs=1e-6)


# the set of media


def unpacked(around: int) -> Counter[int]:
    numbers = [(around >> (BITS * slot)) & MASK for slot in range(MOST_AROUND)]
    return Counter(number for number in numbers if number)


@given(st.lists(st.tuples(st.integers(1, 255), st.booleans()), max_size=30))
def test_media_around_a_ray_are_a_multiset(steps: list[tuple[int, bool]]) -> None:
    around, truth = 0, Counter[int]()
    for medium, enters in steps:
        if enters and truth.total() < MOST_AROUND:
            around, truth = with_medium(around, medium), truth + Counter([medium])
        elif not enters:
            around, truth = without_medium(around, medium), truth - Counter([medium])
        assert unpacked(around) == truth
        assert dominant(around) == max(truth, default=0)


def test_whoever_leaves_a_solid_has_been_in_it() -> None:
    inside = with_medium(0, 3)
    assert crossed(0, 3, 0, False) == (inside, 0)
    assert crossed(inside, 3, 0, False) == (inside, 0)
    assert crossed(0, 3, 0, True) == (0, inside)
    before, behind = crossed(inside, 3, -2, False)
    assert (unpacked(before), unpacked(behind)) == (Counter([3]), Counter([2]))
    assert unpacked(crossed(0, 3, 2, True)[1]) == Counter([3, 2])


def test_more_solids_than_are_kept_track_of_leave_a_finite_picture(renderer: Renderer) -> None:
    balls = tuple(Sphere((0, 0, 0), 1.0 - i / 20, solid(1.1 + i / 20, i)) for i in range(12))
    seen = shoot(renderer, Scene(spheres=balls, surroundings=DUSK, camera=VIEW), 24, 24, depth=16).pixels
    assert np.isfinite(seen).all()
    assert seen.max() <= 1 + 64 * U


def test_hidden_boundaries_and_holes_mix(renderer: Renderer) -> None:
    """A lattice in a glass ball looks the same with a ball of ice around it, which the glass displaces; a material
    with holes encloses nothing and is no medium.
    """
    holes = Texture(np.uint8([[[0] * 3, [255] * 3], [[255] * 3, [0] * 3]]))
    lattice = Sphere((0, 0, 0), 0.5, dataclasses.replace(lamp(0.5), alpha_texture=holes))
    one = Scene(spheres=(Sphere((0, 0, 0), 1.0, solid(1.5, 0)), lattice), surroundings=DUSK, camera=VIEW)
    two = dataclasses.replace(one, spheres=(*one.spheres, Sphere((0, 0, 0), 0.8, solid(1.31, -1, "ice"))))
    seen = [shoot(renderer, scene, 32, 32, depth=4).pixels for scene in (one, two)]
    assert (np.abs(seen[1] - seen[0]) < 1e-5).all(axis=2).mean() > 0.99
    assert rank_media([dataclasses.replace(solid(1.5, 0), alpha_texture=holes)]) == []


def test_a_scene_names_no_more_media_than_fit() -> None:
    spheres = tuple(Sphere((2.0 * i, 0, 0), 0.5, solid(1.5, 0, f"{i}")) for i in range(256))
    with pytest.raises(SceneError, match="at most 255 transparent materials with a priority, found 256"):
        prepare(Scene(spheres=spheres))


def test_equal_priorities_do_not_depend_on_the_order_of_things(renderer: Renderer) -> None:
    """The larger index counts."""
    two = (Sphere((-0.3, 0, 0), 0.8, solid(1.3, 0)), Sphere((0.3, 0, 0), 0.7, solid(1.6, 0)))
    scene = Scene(spheres=two, surroundings=DUSK, exposure=1e3, camera=VIEW)
    one, other = (
        shoot(renderer, dataclasses.replace(scene, spheres=order), 32, 32, depth=6).pixels for order in (two, two[::-1])
    )
    np.testing.assert_array_equal(one, other)
    first = (two[0], dataclasses.replace(two[1], material=solid(1.6, 1)))
    np.testing.assert_array_equal(
        shoot(renderer, dataclasses.replace(scene, spheres=first), 32, 32, depth=6).pixels, one
    )


def test_a_matt_black_body_in_water_is_black(renderer: Renderer) -> None:
    """What has no priority takes no part: a ray in water meets it as it would in air."""
    body = Sphere((0, 0, 0), 0.5, Material("coal", diffuse=BLACK))
    water = Sphere((0, 0, 0), 1.0, solid(1.33, 0))
    seen = pixel(renderer, Scene(spheres=(body, water), surroundings=DUSK), depth=1, camera=aim((0, 0, 6), (0, 0, 0)))
    share = ((1.33 - 1) / (1.33 + 1)) ** 2
    assert seen == pytest.approx(share * DUSK.horizon[0], abs=1e-6)
