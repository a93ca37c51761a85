"""Normal maps: bent normals shade by closed forms, face the ray, and never send light through their surface."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.normal_map import bumped, mirroring
from renderer.pipeline import Renderer
from renderer.placement import placed
from renderer.scene import Material, Mesh, Rgb, Scene, Sphere, Surroundings, Texture
from renderer.surface import Surface
from tests.renderer.drawing import BLACK, WHITE, aim, lamp, light, pixel, quad, shoot

TILTED = (200, 90, 220)
STEP = 1 / 127.5
CODES = [TILTED, (40, 128, 200), (127, 250, 180), (128, 128, 255)]
LAMP = light(2, 1.5, 4, 30.0)


def one_colour(codes: tuple[int, int, int]) -> Texture:
    return Texture(np.uint8([[codes]]), "one colour")


def decoded(codes: tuple[int, int, int]) -> NDArray[np.float64]:
    """2c - 1, but the two codes around the middle are the middle."""
    return np.array([0.0 if code in (127, 128) else 2 * code / 255 - 1 for code in codes])


def matt(texture: Texture | None, scale: float = 1.0) -> Material:
    return Material("matt", WHITE, normal_texture=texture, normal_scale=scale)


def wall(material: Material, uvs: NDArray[np.float64] | None = None) -> Mesh:
    """A square of 4 m in z = 0 that faces z, with u along x and v along y, or turned by a (2, 2) matrix."""
    square = quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), material)
    return square if uvs is None else dataclasses.replace(square, uvs=square.vertices[:, :2] @ uvs.T)


def lambert(normal: NDArray[np.float64], place: Rgb = (0.0, 0.0, 0.0)) -> float:
    """Radiance of a white matt place under `LAMP`."""
    to_light = np.subtract(LAMP.position, place)
    distance = float(np.linalg.norm(to_light))
    cosine = float(normal @ to_light) / distance / float(np.linalg.norm(normal))
    return max(0.0, cosine) * LAMP.intensity[0] / distance**2 / math.pi


@pytest.mark.parametrize("codes", CODES)
@pytest.mark.parametrize("scale", [1.0, -0.5, 2.0, 0.0])
def test_a_wall_of_one_tilt_is_lit_by_its_cosine(renderer: Renderer, codes: tuple[int, int, int], scale: float) -> None:
    scene = Scene(meshes=(wall(matt(one_colour(codes), scale)),), lights=(LAMP,))
    seen = pixel(renderer, scene, camera=aim((0, 0, 5), (0, 0, 0)))
    assert seen == pytest.approx(lambert(decoded(codes) * (scale, scale, 1)), rel=1e-5)


@pytest.mark.parametrize("turn", [0.0, 0.7, math.pi / 2])
@pytest.mark.parametrize("flip", [(1, 1), (-1, 1), (1, -1), (-1, -1)])
@pytest.mark.parametrize("behind", [False, True])
def test_red_runs_along_u_and_green_along_v_also_where_they_are_mirrored(
    renderer: Renderer, turn: float, flip: tuple[int, int], behind: bool
) -> None:
    """Seen from behind, the surface is the same and its normal the opposite one; `LAMP` then lights it mirrored."""
    cos, sin = math.cos(turn), math.sin(turn)
    uvs = np.diag(flip) @ np.array([[cos, sin], [-sin, cos]])
    mesh = wall(matt(one_colour(TILTED)), uvs)
    x, y, z = decoded(TILTED)
    normal = np.array([*(x * uvs[0] + y * uvs[1]), z])
    glow, eye = LAMP, (0.0, 0.0, 5.0)
    if behind:
        glow, eye = dataclasses.replace(LAMP, position=(2.0, 1.5, -4.0)), (0.0, 0.0, -5.0)
        normal *= (-1, -1, 1)
    seen = pixel(renderer, Scene(meshes=(mesh,), lights=(glow,)), camera=aim(eye, (0, 0, 0)))
    assert seen == pytest.approx(lambert(normal), rel=1e-5)


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize(("longitude", "latitude"), [(0.0, 0.0), (0.8, 0.5), (-2.5, -0.9)])
def test_on_a_sphere_u_runs_along_the_parallels(
    renderer: Renderer, longitude: float, latitude: float, inside: bool
) -> None:
    sin, cos, high, flat = math.sin(longitude), math.cos(longitude), math.sin(latitude), math.cos(latitude)
    frame = np.array([[cos, 0, -sin], [-high * sin, flat, -high * cos], [flat * sin, high, flat * cos]])
    outward = frame[2]
    bent = decoded(TILTED) @ frame
    # From inside the camera is at the centre and a lamp near it; from outside both are farther out.
    away = -0.2 if inside else 3.0
    position = outward * (1 + away) + 0.1 * frame[0] + 0.05 * frame[1]
    glow = light(*position, 5.0)
    camera = aim((0, 0, 0), tuple(outward)) if inside else aim(tuple(4 * outward), tuple(outward))
    scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, matt(one_colour(TILTED))),), lights=(glow,))
    to_light = position - outward
    distance = float(np.linalg.norm(to_light))
    cosine = float((-bent if inside else bent) @ to_light) / distance / float(np.linalg.norm(bent))
    assert cosine > 0.1
    assert pixel(renderer, scene, camera=camera) == pytest.approx(cosine * 5 / distance**2 / math.pi, rel=1e-4)


def test_flat_places_change_no_bit(renderer: Renderer) -> None:
    """Both codes around the middle count as flat; the one bump is out of sight."""
    pixels = np.full((64, 64, 3), (128, 127, 255), np.uint8)
    pixels[::2, ::3] = (127, 128, 250)
    pixels[0, 0] = TILTED
    glossy = Material("glossy", (0.3, 0.5, 0.7), (0.8,) * 3, 20.0, reflection=(0.2,) * 3)
    camera = Camera((0.3, 0.2, 2), (0, 0, 0), vertical_fov_deg=20)
    plain, mapped = (
        shoot(renderer, Scene(meshes=(wall(material),), lights=(LAMP,), camera=camera), 40, 30)
        for material in (glossy, dataclasses.replace(glossy, normal_texture=Texture(pixels)))
    )
    assert "normal_maps" in mapped.cost.effects
    assert "normal_maps" not in plain.cost.effects
    np.testing.assert_array_equal(mapped.pixels, plain.pixels)


def test_a_map_of_a_dome_looks_like_the_dome(renderer: Renderer) -> None:
    """A cap of a sphere under a lamp far away; 8 bits a component are off by 0.4 % of white, the wall by 20 %."""
    middle = (np.arange(256) + 0.5) / 128 - 1
    x, y = np.meshgrid(middle, -middle)
    normals = np.stack([x, y, np.sqrt(np.maximum(0.0, 4 - x * x - y * y))], axis=2) / 2
    cap = Texture(np.round(127.5 * normals + 127.5).astype(np.uint8), "cap", "clamp", "clamp")
    square = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), matt(cap))
    far = light(600, 300, 800, math.pi * (600**2 + 300**2 + 800**2))
    camera = Camera((0, 0, 100), (0, 0, 0), vertical_fov_deg=math.degrees(2 * math.atan(0.8 / 100)))
    mapped, flat, real = (
        shoot(renderer, Scene(spheres=spheres, meshes=meshes, lights=(far,), camera=camera), 48, 48).pixels
        for spheres, meshes in (
            ((), (square,)),
            ((), (dataclasses.replace(square, material=matt(None)),)),
            ((Sphere((0, 0, -math.sqrt(3)), 2.0, matt(None)),), ()),
        )
    )
    assert np.abs(mapped - real).max() < 0.015
    assert np.abs(flat - real).max() > 0.2


def test_faces_with_mirrored_coordinates_share_no_tangent(renderer: Renderer) -> None:
    """A smooth strip with u = |x|: the two halves share the vertices between them, and tilt to opposite sides."""
    vertices = np.array([[x, y, 0.0] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 1.0)])
    faces = np.array([[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]])
    uvs = np.stack([np.abs(vertices[:, 0]), vertices[:, 1]], axis=1)
    mesh = Mesh(vertices, faces, matt(one_colour(TILTED)), np.tile([0.0, 0, 1], (6, 1)), uvs)
    scene = Scene(meshes=(mesh,), lights=(LAMP,))
    for x in (-0.1, 0.1):
        seen = pixel(renderer, scene, camera=aim((x, 0.2, 3), (x, 0.2, 0)))
        normal = decoded(TILTED) * (math.copysign(1, x), 1, 1)
        assert seen == pytest.approx(lambert(normal, (x, 0.2, 0)), rel=1e-4)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_stated_tangents_count_on_smooth_meshes(renderer: Renderer, side: float) -> None:
    """Along y here, of any length, and across the normal; `side` says where v runs."""
    smooth = dataclasses.replace(
        wall(matt(one_colour(TILTED))),
        normals=np.tile([0.0, 0, 2], (4, 1)),
        tangents=np.tile([0.0, 3, 1, side], (4, 1)),
    )
    x, y, z = decoded(TILTED)
    camera = aim((0, 0, 5), (0, 0, 0))
    seen = pixel(renderer, Scene(meshes=(smooth,), lights=(LAMP,)), camera=camera)
    assert seen == pytest.approx(lambert(np.array([-side * y, x, z])), rel=1e-5)
    flat = dataclasses.replace(smooth, normals=None)
    seen = pixel(renderer, Scene(meshes=(flat,), lights=(LAMP,)), camera=camera)
    assert seen == pytest.approx(lambert(np.array([x, y, z])), rel=1e-5)


@pytest.mark.parametrize("stated", [False, True])
@pytest.mark.parametrize("mirror_axis", [0, 1, 2])
def test_a_mirrored_mesh_under_a_mirrored_lamp_looks_the_same(
    renderer: Renderer, mirror_axis: int, stated: bool
) -> None:
    material = matt(one_colour(TILTED))
    mesh = dataclasses.replace(
        wall(material),
        normals=np.tile([0.1, 0, 1], (4, 1)),
        tangents=np.tile([1.0, 1, 0, 1], (4, 1)) if stated else None,
    )
    flip = np.ones(4)
    flip[mirror_axis] = -1
    other = dataclasses.replace(LAMP, position=tuple(np.multiply(LAMP.position, flip[:3])))
    here = pixel(renderer, Scene(meshes=(mesh,), lights=(LAMP,)), camera=aim((0, 0, 5), (0, 0, 0)))
    there = pixel(
        renderer,
        Scene(meshes=(placed(mesh, np.diag(flip)),), lights=(other,)),
        camera=aim((0, 0, 5 * float(flip[2])), (0, 0, 0)),
    )
    assert here == pytest.approx(there, rel=1e-5)
    assert here > 0.1


@pytest.mark.parametrize("eye", [(0.0, 0.0, 5.0), (1.0, -2.0, 4.0)])
def test_a_tilted_mirror_reflects_by_its_bent_normal(renderer: Renderer, eye: Rgb) -> None:
    shiny = Material("mirror", BLACK, reflection=WHITE, normal_texture=one_colour(TILTED))
    normal = decoded(TILTED) / np.linalg.norm(decoded(TILTED))
    view = np.array(eye) / np.linalg.norm(eye)
    mirrored = 2 * (view @ normal) * normal - view
    for off, radiance in ((0.0, 1.0), (0.3, 0.0)):
        target = 6 * mirrored + off * np.cross(mirrored, view)
        scene = Scene(meshes=(wall(shiny),), spheres=(Sphere(tuple(target), 0.02, lamp()),))
        assert pixel(renderer, scene, camera=aim(eye, (0, 0, 0))) == radiance


def test_bumps_see_no_lamp_behind_their_surface(renderer: Renderer) -> None:
    """Nothing casts a shadow here; the bumps of the near side would face the lamp but for the wall itself."""
    steep = dataclasses.replace(wall(matt(one_colour((250, 128, 140)))), casts_shadows=False)
    camera = aim((2, 0, 5), (0, 0, 0))
    for z, lit in ((0.5, True), (-0.5, False)):
        scene = Scene(meshes=(steep,), lights=(light(6, 0, z, 50.0, casts_shadows=False),))
        assert (pixel(renderer, scene, camera=camera) > 0) == lit


def test_bumps_too_small_to_be_seen_are_flat(renderer: Renderer) -> None:
    """Columns that lean left and right in turn: their mean faces forward, of unit length again."""
    columns = np.full((64, 64, 3), (48, 128, 200), np.uint8)
    columns[:, ::2, 0] = 255 - 48
    fine = wall(matt(Texture(columns)), np.eye(2) * 40)
    seen = pixel(renderer, Scene(meshes=(fine,), lights=(LAMP,)), camera=Camera((0, 0, 5), (0, 0, 0)))
    assert seen == pytest.approx(lambert(np.array([0.0, 0, 1])), rel=3 * STEP)


components = st.floats(-1, 1)
vectors = st.tuples(components, components, components).map(np.array)


def unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    assume(np.linalg.norm(vector) > 1e-3)
    return np.asarray(vector / np.linalg.norm(vector))


@given(vectors, vectors, vectors, vectors, st.tuples(components, components, components))
def test_a_bent_normal_faces_the_ray_and_mirrors_it_off_the_surface(
    face: NDArray[np.float64],
    smooth: NDArray[np.float64],
    along: NDArray[np.float64],
    ray: NDArray[np.float64],
    bend: tuple[float, float, float],
) -> None:
    """Whatever the map says; and it is pulled back only where it must be."""
    g, n, d = unit(face), unit(smooth), unit(ray)
    g = g if g @ d <= 0 else -g
    n = n if n @ g >= 0 else -n
    t = unit(along - (along @ n) * n)
    assume(-(g @ d) > 1e-6)
    free = unit(bend[0] * t + bend[1] * np.cross(n, t) + max(0.0, bend[2]) * n)
    s = Surface(0.0, 0.0, 0.0, *g, *n, 0.0, 0.0, 0.0, 0.0, 0, True)
    lit = bumped(s, *t, *bend, *d)
    mirror = mirroring(lit, *n, *d)
    horizon = n if n @ d < 0 else g
    b, m = (np.array([found.nx, found.ny, found.nz]) for found in (lit, mirror))
    for normal in (b, m):
        assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-9)
        assert -(d @ normal) >= -1e-9
    assert (d - 2 * (d @ m) * m) @ horizon >= -1e-9
    if -(d @ free) > 1e-9:
        np.testing.assert_allclose(b, free, atol=1e-9)
    if (d - 2 * (d @ b) * b) @ horizon > 1e-9:
        np.testing.assert_allclose(m, b, atol=1e-9)


def test_noise_for_a_map_spoils_no_pixel(renderer: Renderer) -> None:
    """Mirrors and gloss under a map of random codes, deep and grazing: finite, and no ray is mirrored to the black
    below the mirror."""
    noise = Texture(np.random.default_rng(3).integers(0, 256, (32, 32, 3), dtype=np.uint8))
    mirror = Material("mirror", BLACK, reflection=WHITE, normal_texture=noise, normal_scale=1000.0)
    even = Surroundings(WHITE, WHITE, WHITE)
    ground = quad((-20, 0, 20), (40, 0, 0), (0, 0, -40), mirror)
    below = quad((-900, -1, 900), (1800, 0, 0), (0, 0, -1800), Material("black", BLACK))
    low = Camera((0, 0.5, 9), (0, 0.3, 0), vertical_fov_deg=20)
    frame = shoot(renderer, Scene(meshes=(ground, below), surroundings=even, camera=low), 64, 36)
    onto_mirror = frame.pixels[24:]
    np.testing.assert_allclose(onto_mirror, 1.0, rtol=1e-6)
    assert frame.cost.rays.reflection >= 64 * 12
    wild = Material("wild", WHITE, WHITE, 50.0, normal_texture=noise, base="ashikhmin-shirley", exponent_v=3.0)
    ball = Sphere((0, 1, 0), 1.0, dataclasses.replace(wild, transmission=(0.5,) * 3))
    scene = Scene(meshes=(dataclasses.replace(ground, material=wild),), spheres=(ball,), lights=(LAMP,))
    pixels = shoot(renderer, scene, 64, 36, camera=Camera((0, 0.5, 5), (0, 0.5, 0))).pixels
    assert np.isfinite(pixels).all()
    assert pixels.min() >= 0
