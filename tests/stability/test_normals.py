"""Normals that are smooth, missing, wrong or scaled: no black triangles, no leaks, nothing that is not a number."""

from __future__ import annotations

import dataclasses
import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera, view_frame
from renderer.display import Display
from renderer.pipeline import Renderer
from renderer.placement import placed
from renderer.prepared import prepare
from renderer.scene import Material, Mesh, Scene, Sphere
from renderer.surface import weights_at
from tests.renderer.drawing import (
    EVERYWHERE_1,
    WHITE,
    WHITE_LAMBERT,
    U,
    aim,
    ball_mesh,
    box,
    glass,
    lamp,
    light,
    mirror,
    pixel,
    quad,
    shoot,
)
from tests.renderer.model_files import (
    CUBE,
    CUBE_FACES,
    DAE_SQUARE,
    area_vector,
    chunk,
    dae,
    dae_source,
    gltf,
    load,
    three_ds,
    three_ds_cube,
    three_ds_object,
    volume,
)

TRIANGLE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
FRONT = Camera((0, 0, 4), (0, 0, 0))


def triangle(normals: NDArray[np.float64] | None = None) -> Mesh:
    return Mesh(TRIANGLE, np.array([[0, 1, 2]]), WHITE_LAMBERT, normals)


def unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vector / np.linalg.norm(vector))


# the shadow terminator


def hits_of(mesh: Mesh, camera: Camera, side_px: int) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Which pixels of a square picture show the mesh, and the unit interpolated normals there."""
    prepared = prepare(Scene(meshes=(mesh,)))
    assert prepared.intersector.triangles == len(mesh.faces)
    assert mesh.normals is not None
    view = view_frame(camera, Display(side_px, side_px))
    y, x = np.mgrid[0:side_px, 0:side_px] + 0.5
    direction = view.corner + x[..., None] * view.step_x + y[..., None] * view.step_y
    direction = (direction / np.linalg.norm(direction, axis=2, keepdims=True)).astype(np.float32).reshape(-1, 3)
    position = ((np.array(camera.position) - prepared.center) * prepared.scale).astype(np.float32)
    hits = prepared.intersector.nearest(np.tile(position, (len(direction), 1)), direction)
    weights = np.zeros((len(direction), 3))
    for ray, (x, y, z) in enumerate(direction.astype(np.float64)):
        b1, b2 = weights_at(prepared.surfaces.facets, hits.primitive[ray], *position.astype(np.float64), x, y, z)
        weights[ray] = 1.0 - b1 - b2, b1, b2
    normals = (weights[:, :, None] * mesh.normals[mesh.faces[hits.primitive]]).sum(axis=1)
    return hits.primitive >= 0, normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("level", [1, 2, 3, 4])
@pytest.mark.parametrize("view", [1.2, 2.5, -0.4])
def test_h23_a_smooth_mesh_has_no_black_triangles(renderer: Renderer, level: int, view: float) -> None:
    """The shade is the sphere's own max(0, N.L) up to the terminator, on 80 to 5,120 triangles: none of more than
    20,000 lit points is black (a rate below 1.5e-4; 5e-5 over the three views). Without lifting the origins of shadow
    rays 6.0, 2.4, 1.2 and 0.65 % of them would be (Hanika, Ray Tracing Gems II, 2021, ch. 4).
    """
    toward = np.array((1.0, 2.0, 3.0)) / math.sqrt(14)
    mesh = ball_mesh(WHITE_LAMBERT, level, smooth=True)
    camera = Camera((5 * math.sin(view), 0.5, 5 * math.cos(view)), (0, 0, 0), vertical_fov_deg=22)
    scene = Scene(meshes=(mesh,), lights=(light(*(1e6 * toward), 1e12 * math.pi),), camera=camera)
    shade = shoot(renderer, scene, 200, 200).pixels[..., 0].ravel()
    seen, normals = hits_of(mesh, camera, 200)
    truth = np.maximum(0.0, normals @ toward)
    lit = seen & (truth > 1e-5)
    assert lit.sum() > 5000
    assert (shade[lit] > 0).all()
    np.testing.assert_allclose(shade[seen], truth[seen], atol=1e-5)


@pytest.mark.parametrize("level", [1, 2, 3, 4])
def test_h23_along_a_great_circle_the_shade_only_falls(renderer: Renderer, level: int) -> None:
    """From the place that faces the lamp to the far side on three ways, 100 steps each: the sphere's own shade, and
    never up by more than 1/255.
    """
    toward = np.array((1.0, 2.0, 3.0)) / math.sqrt(14)
    mesh = ball_mesh(WHITE_LAMBERT, level, smooth=True)
    prepared = prepare(Scene(meshes=(mesh,), lights=(light(*(1e6 * toward), 1e12 * math.pi),)))
    angles = np.linspace(0.0, math.pi, 100)
    for side in ((0.3, -1.0, 0.2), (1.0, 0.0, 0.1), (0.2, 0.7, 0.6)):
        beside = unit(np.cross(toward, side))
        shades = []
        for angle in angles:
            out = math.cos(angle) * toward + math.sin(angle) * beside
            camera = Camera(tuple(3 * out), (0, 0, 0), tuple(np.cross(out, np.cross(toward, beside))), 1.0)
            shades.append(pixel(renderer, prepared, camera=camera))
        np.testing.assert_allclose(shades, np.maximum(0.0, np.cos(angles)), atol=1 / 255)
        assert np.diff(shades).max() <= 1 / 255


def test_h23_a_smooth_ball_from_inside(renderer: Renderer) -> None:
    """A light of pi W/sr in the middle: the albedo in every direction, but for the flatness of 5,120 triangles."""
    scene = Scene(meshes=(ball_mesh(WHITE_LAMBERT, 4, smooth=True),), lights=(light(0, 0, 0, math.pi),))
    seen = shoot(renderer, scene, 48, 48, camera=Camera((0.1, 0.2, 0.3), (1, 0.5, 0), vertical_fov_deg=100)).pixels
    np.testing.assert_allclose(seen, 1.0, atol=0.01)


# zero or missing

NO_NORMALS = {
    "zero": np.zeros((3, 3)),
    "NaN": np.full((3, 3), np.nan),
    "infinite": np.full((3, 3), np.inf),
    "partly NaN": np.array([[0, 0, np.nan], [np.nan, 0, 1], [0, np.inf, 0]]),
}


@pytest.mark.parametrize("normals", NO_NORMALS.values(), ids=NO_NORMALS.keys())
def test_h24_missing_vertex_normals_are_the_triangles_own(renderer: Renderer, normals: NDArray[np.float64]) -> None:
    lights = (light(1, 2, 3, 9.0),)
    pictures = [
        shoot(renderer, Scene(meshes=(mesh,), lights=lights, camera=FRONT), 32, 32).pixels
        for mesh in (triangle(), triangle(normals))
    ]
    np.testing.assert_array_equal(pictures[0], pictures[1])


@pytest.mark.parametrize("given", ["", "vn 0 0 0\n", "vn nan 0 1\n", "vn inf 0 1\n"])
def test_h24_an_obj_file_without_sound_normals_is_flat(renderer: Renderer, tmp_path: Path, given: str) -> None:
    corners = "".join(f"v {x} {y} {z}\n" for x, y, z in TRIANGLE)
    meshes = load(tmp_path, "a.obj", corners + given + ("f 1//1 2//1 3//1\n" if given else "f 1 2 3\n"))
    lights = (light(1, 2, 3, 9.0),)
    flat = Scene(meshes=(dataclasses.replace(triangle(), material=meshes[0].material),), lights=lights, camera=FRONT)
    frame = shoot(renderer, Scene(meshes=meshes, lights=lights, camera=FRONT), 32, 32)
    assert frame.cost.rejected_samples.total == 0
    np.testing.assert_array_equal(frame.pixels, shoot(renderer, flat, 32, 32).pixels)


def test_h24_opposite_normals_that_cancel_leave_the_picture_finite(renderer: Renderer) -> None:
    """Half-way between corners with (0, 0, 1) and the one with (0, 0, -1) their mean is 0; the face's own counts."""
    mesh = triangle(np.array([[0, 0, 1.0], [0, 0, -1.0], [0, 0, 1.0]]))
    scene = Scene(meshes=(mesh,), lights=(light(0, 0, 3, 9.0),), camera=FRONT)
    frame = shoot(renderer, scene, 64, 64)
    assert np.isfinite(frame.pixels).all()
    assert frame.cost.rejected_samples.total == 0
    half_way = pixel(renderer, scene, camera=aim((0.25, -0.5, 4.0), (0.25, -0.5, 0.0)))
    assert half_way == pytest.approx(9.0 / math.pi * 3.0 / 9.3125**1.5, rel=1e-5)


@pytest.mark.parametrize("length", [1e-23, 1e-20, 1e-300, 1e300])
def test_h24_normals_of_any_length_keep_their_direction(renderer: Renderer, length: float) -> None:
    """Their squares leave float32, or float64: the picture is the same to 1e-6."""
    normals = np.array([[0.3, 0, 1], [-0.3, 0, 1], [0, 0.3, 1]])
    lights = (light(1, 2, 3, 9.0),)
    pictures = [
        shoot(renderer, Scene(meshes=(triangle(scale * normals),), lights=lights, camera=FRONT), 32, 32).pixels
        for scale in (1.0, length)
    ]
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=1e-6)


# against the geometry


@pytest.mark.parametrize("smooth", [False, True])
def test_h25_winding_the_other_way_shows_the_same_picture(renderer: Renderer, smooth: bool) -> None:
    mesh = ball_mesh(WHITE_LAMBERT, 2, smooth)
    turned = dataclasses.replace(mesh, faces=mesh.faces[:, ::-1])
    lights = (light(3, 4, 5, 90.0),)
    one, two = (shoot(renderer, Scene(meshes=(m,), lights=lights, camera=FRONT), 64, 64).pixels for m in (mesh, turned))
    np.testing.assert_allclose(two, one, rtol=1e-5, atol=1e-6)


def bent_box(bend: float, seed: int) -> Mesh:
    """A closed box whose triangles have corner normals up to `bend` away from their own."""
    shape = box((-1, -1, -1), (1, 1, 1), WHITE_LAMBERT)
    corners = shape.vertices[shape.faces].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    own = np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3])
    own /= np.linalg.norm(own, axis=1)[:, None]
    normals = np.repeat(own, 3, axis=0) + np.random.default_rng(seed).uniform(-bend, bend, (len(corners), 3))
    return Mesh(corners, faces, WHITE_LAMBERT, normals)


@pytest.mark.parametrize("bend", [0.1, 0.5, 3.0])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_h25_no_light_leaks_into_a_closed_box(renderer: Renderer, bend: float, seed: int) -> None:
    """Exactly 0 inside, in 82,944 places and to three lamps outside each: a rate below 1.2e-5."""
    lights = (light(4, 5, 6, 1e3), light(-3, 0.2, 0.1, 1e3), light(0, -1.5, 0, 1e3))
    scene = Scene(meshes=(bent_box(bend, seed),), lights=lights)
    for look_at in ((1, 0.2, 0), (-1, 0, 0.3), (0.1, 1, 0), (0, -1, 0.1)):
        seen = shoot(renderer, scene, 48, 48, camera=Camera((0, 0, 0), look_at, (0, 0.3, 1), 90)).pixels
        np.testing.assert_array_equal(seen, 0.0)


def test_h25_a_mirror_ray_stays_above_the_face(renderer: Renderer) -> None:
    """View at 85 degrees, normal bent 3 degrees away from it: the plain mirror ray has z = -0.0174524 and would meet
    the lamp below the face.
    """
    bend, view = math.radians(3), math.radians(85)
    sheet = quad((-50, -50, 0), (100, 0, 0), (0, 100, 0), mirror())
    sheet = dataclasses.replace(sheet, normals=np.tile((-math.sin(bend), 0, math.cos(bend)), (4, 1)))
    below = quad((-50, -50, -1), (100, 0, 0), (0, 100, 0), lamp(5.0))
    scene = Scene(meshes=(sheet, below), surroundings=EVERYWHERE_1)
    assert pixel(renderer, scene, camera=aim((math.sin(view), 0, math.cos(view)), (0, 0, 0))) == 1.0


def test_h25_normals_that_face_away_from_the_eye_are_finite(renderer: Renderer) -> None:
    view = math.radians(85)
    for bend_deg in (-10, -5.000001, -5, -4.999999, 10):
        bend = math.radians(bend_deg)
        for material in (WHITE_LAMBERT, mirror(), glass(), Material(specular=WHITE, shininess=100.0)):
            sheet = quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), material)
            sheet = dataclasses.replace(sheet, normals=np.tile((math.sin(bend), 0, math.cos(bend)), (4, 1)))
            scene = Scene(meshes=(sheet,), lights=(light(-1, 0, 0.2),), surroundings=EVERYWHERE_1)
            frame = shoot(renderer, scene, 9, 9, camera=aim((math.sin(view), 0, math.cos(view)), (0, 0, 0)))
            assert np.isfinite(frame.pixels).all()
            assert (frame.pixels >= 0).all()
            assert frame.cost.rejected_samples.total == 0


def test_h25_the_poles_of_a_ball_are_no_special_place(renderer: Renderer) -> None:
    for up in (1.0, -1.0):
        scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, WHITE_LAMBERT),), lights=(light(0, up * 3, 0, math.pi * 4),))
        assert pixel(renderer, scene, camera=aim((0, up * 3, 0), (0, 0, 0))) == pytest.approx(1.0, rel=8 * U)


# under mirrored and unequal scales

SLANTED = np.array([0.894427190999916, 0.447213595499958, 0.0])
"""Unit normal of a face of normal (1, 1, 0) after a scale of (1, 2, 1): (2, 1, 0) over the root of 5. Multiplying the
normal by the scale, as if it were a direction in the face, is off by 36.870 degrees."""


def slanted_by(way: str, folder: Path) -> Mesh:
    """A mesh whose corner normals are (1, 1, 0), scaled by (1, 2, 1): by a scene's placement or a file's node."""
    normals = np.tile((1.0, 1.0, 0.0), (4, 1))
    if way == "placement":
        square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float64)
        return placed(Mesh(square, np.array([[0, 1, 2]]), WHITE_LAMBERT, normals), np.diag([1.0, 2.0, 1.0, 1.0]))
    if way == "glTF":
        return load(folder, "a.gltf", json.dumps(gltf(nodes=[{"mesh": 0, "scale": [1, 2, 1]}])))[0]
    matrix = "<matrix>1 0 0 0 0 2 0 0 0 0 1 0 0 0 0 1</matrix>"
    scale = {"COLLADA scale": "<scale>1 2 1</scale>", "COLLADA matrix": matrix}
    sources = (DAE_SQUARE + dae_source("n", normals.ravel().tolist(), 3)).replace(
        "</vertices>", '<input semantic="NORMAL" source="#n"/></vertices>'
    )
    node = f'<node>{scale[way]}<instance_geometry url="#g"/></node>'
    return load(folder, "a.dae", dae(sources=sources, nodes=node))[0]


@pytest.mark.parametrize("way", ["placement", "glTF", "COLLADA scale", "COLLADA matrix"])
def test_h26_normals_stay_square_to_a_face_that_is_scaled_unequally(way: str, tmp_path: Path) -> None:
    """Within 2 roundings of float32, as the tracer holds it; 3DS files hold no normals and no scaled nodes."""
    mesh = slanted_by(way, tmp_path)
    held = prepare(Scene(meshes=(mesh,))).surfaces.facets[0, 3:6]
    np.testing.assert_allclose(held, SLANTED, atol=2 * U)


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, -1, 1), (1, 1, -1), (-2, -3, -0.5), (-1, 1, 2)])
def test_h26_mirrored_nodes_of_a_collada_file_keep_faces_and_normals_outward(
    tmp_path: Path, scale: tuple[float, float, float]
) -> None:
    """A cube of 12 triangles with a normal at each corner of each face: volume above 0, normals along the faces'."""
    corners = np.array([CUBE[index] for face in CUBE_FACES for index in face], dtype=np.float64)
    own = np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3])
    sources = dae_source("p", corners.ravel().tolist(), 3)
    sources += dae_source("n", np.repeat(own, 3, axis=0).ravel().tolist(), 3)
    sources += '<vertices id="corners"><input semantic="POSITION" source="#p"/>'
    sources += '<input semantic="NORMAL" source="#n"/></vertices>'
    triangles = '<triangles count="12"><input semantic="VERTEX" source="#corners" offset="0"/><p>'
    triangles += " ".join(map(str, range(36))) + "</p></triangles>"
    node = f'<node><scale>{" ".join(map(str, scale))}</scale><instance_geometry url="#g"/></node>'
    (mesh,) = load(tmp_path, "a.dae", dae(triangles, sources=sources, nodes=node))
    assert volume(mesh) == pytest.approx(abs(math.prod(scale)))
    assert mesh.normals is not None
    for face in mesh.faces:
        a, b, c = mesh.vertices[face]
        for normal in mesh.normals[face]:
            np.testing.assert_allclose(unit(normal), unit(np.cross(b - a, c - a)), atol=1e-12)


def test_h26_a_mirrored_and_unequal_scale_at_once(tmp_path: Path) -> None:
    sources = (DAE_SQUARE + dae_source("n", (1, 0, 1) * 4, 3)).replace(
        "</vertices>", '<input semantic="NORMAL" source="#n"/></vertices>'
    )
    nodes = '<node><scale>-1 1 2</scale><instance_geometry url="#g"/></node>'
    (mesh,) = load(tmp_path, "a.dae", dae(sources=sources, nodes=nodes))
    assert mesh.normals is not None
    np.testing.assert_allclose(unit(mesh.normals[0]), np.array([-1, 0, 0.5]) / math.sqrt(1.25), atol=1e-12)
    np.testing.assert_allclose(area_vector(mesh), [0, 0, 1], atol=1e-12)


def test_h26_an_object_of_a_3ds_file_with_mirrored_axes_is_mirrored_back(tmp_path: Path) -> None:
    """The mirror stands at the object's own origin, x = 3; a matrix that only scales moves nothing."""
    mirrored = [(7 - x, y, z) for x, y, z in CUBE]
    for axes, vertices, x in ((-1, mirrored, [-1.0, 0.0] * 4), (2, CUBE, [0.0, 1.0] * 4)):
        matrix = chunk(0x4160, struct.pack("<12f", axes, 0, 0, 0, 1, 0, 0, 0, 1, 3, 0, 0))
        (mesh,) = load(tmp_path, "a.3ds", three_ds(three_ds_object("Box", three_ds_cube(matrix, vertices=vertices))))
        assert volume(mesh) == pytest.approx(1.0)
        assert mesh.vertices[:, 0].tolist() == x
