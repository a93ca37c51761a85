"""Shapes: closed where they say so, wound outwards, smooth where they are curved."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene import Material
from renderer.scenes import architecture, ornament
from renderer.shapes import Shape, arc, ball, box, curve, join, lathe, moulding, quad, repeat, surface, torus, tube

KNOT = np.linspace(0.0, 2 * np.pi, 49)
RING = np.stack([np.cos(KNOT), 0.2 * np.sin(3 * KNOT), np.sin(KNOT)], axis=1)
RING[-1] = RING[0]

CLOSED = {
    "box": box((-1.0, 0.0, 2.0), (0.5, 3.0, 2.25)),
    "ball": ball(0.7),
    "torus": torus(1.0, 0.25),
    "cylinder": lathe([(0.0, 0.0), (0.5, 0.0), (0.5, 2.0), (0.0, 2.0)], 24),
    "tube": tube([(0.0, 0.0, 0.0), (0.1, 1.0, 0.0), (0.6, 1.6, 0.0)], 0.1, [0.1, 0.08, 0.02], (0.0, 0.0, 1.0)),
    "ring tube": tube(RING, 0.1, 0.05, (0.0, 1.0, 0.0)),
    "arch wall": join(*architecture.arch_wall(3.0, 1.7, 1.25, 0.5)),
    "gadrooned urn": lathe(arc((0.0, 0.0), 1.0, -90.0, 90.0, 12), 16, swell=1.0 + 0.1 * np.tile([0.0, 1.0], 9)[:17]),
    "leaves": ornament.foliage(1.0, 40, 0.2),
    "pot": ornament.pot(0.8),
    "statue": ornament.statue(1.8),
}

CURVED = {
    "column": architecture.column(3.7, 0.25),
    "archivolt": architecture.archivolt(1.2, 0.2, 0.07),
    "groin vault": architecture.groin_vault(3.0),
    "balustrade": architecture.balustrade(2.4, 0.9, 0.3),
    "coffer": architecture.coffer(1.5, 0.3, 0.14),
    "fountain": ornament.fountain_stone(1.9),
    "door": join(*ornament.door(1.3, 2.7)),
    "banner": ornament.banner(1.5, 2.6),
}

ALL = {**CLOSED, **CURVED}


def volume(shape: Shape) -> float:
    """Enclosed volume [m^3], positive where the faces wind outwards."""
    a, b, c = np.moveaxis(shape.vertices[shape.faces], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def welded(shape: Shape) -> NDArray[np.int64]:
    """Faces as indices of places: vertices at one place (to a nanometre) count as one."""
    _, place = np.unique(np.round(shape.vertices, 9) + 0.0, axis=0, return_inverse=True)
    return place.reshape(-1)[shape.faces]


def face_normals(shape: Shape) -> NDArray[np.float64]:
    a, b, c = np.moveaxis(shape.vertices[shape.faces], 1, 0)
    return np.cross(b - a, c - a)


@pytest.mark.parametrize("name", CLOSED)
def test_every_edge_of_a_closed_shape_has_as_many_faces_on_one_side_as_on_the_other(name: str) -> None:
    faces = welded(CLOSED[name])
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    assert (starts != ends).all()
    count = faces.max() + 1
    there, back = np.sort(starts * count + ends), np.sort(ends * count + starts)
    np.testing.assert_array_equal(there, back)


@pytest.mark.parametrize("name", CLOSED)
def test_closed_shapes_wind_outwards(name: str) -> None:
    assert volume(CLOSED[name]) > 0.0


@pytest.mark.parametrize("name", ALL)
def test_normals_have_length_one_and_stand_on_the_outside_of_their_faces(name: str) -> None:
    shape = ALL[name]
    np.testing.assert_allclose(np.linalg.norm(shape.normals, axis=1), 1.0, atol=1e-12)
    facing = (shape.normals[shape.faces] * face_normals(shape)[:, None]).sum(axis=2)
    assert (facing > 0.0).mean() > 0.995


@pytest.mark.parametrize("name", ALL)
def test_no_face_is_without_area_and_every_number_is_finite(name: str) -> None:
    shape = ALL[name]
    assert np.linalg.norm(face_normals(shape), axis=1).min() > 1e-10
    assert np.isfinite(shape.vertices).all()
    assert np.isfinite(shape.uvs).all()
    assert shape.faces.dtype == np.int64


def test_volumes_come_close_to_the_true_solids() -> None:
    assert volume(box((0.0, 0.0, 0.0), (2.0, 3.0, 0.5))) == pytest.approx(3.0)
    assert volume(ball(0.7, 96)) == pytest.approx(4 / 3 * math.pi * 0.7**3, rel=3e-3)
    assert volume(torus(1.0, 0.25, 96, 64)) == pytest.approx(2 * math.pi**2 * 0.25**2, rel=3e-3)
    assert volume(CLOSED["arch wall"]) == pytest.approx((3.0 * 1.7 - math.pi / 2 * 1.25**2) * 0.5, rel=5e-3)


def test_a_balls_normals_are_radial_also_at_its_poles_and_along_its_seam() -> None:
    shape = ball(2.0, 64)
    np.testing.assert_allclose(shape.normals, shape.vertices / 2.0, atol=1e-3)


def test_a_rings_normals_point_away_from_its_core_also_along_both_seams() -> None:
    shape = torus(1.0, 0.25, 64, 32)
    core = shape.vertices * (1.0, 0.0, 1.0)
    core /= np.linalg.norm(core, axis=1, keepdims=True)
    np.testing.assert_allclose(shape.normals, (shape.vertices - core) / 0.25, atol=2e-3)


def test_a_cylinder_is_smooth_around_and_has_an_edge_at_its_caps() -> None:
    normals = CLOSED["cylinder"].normals
    on_caps = np.abs(normals[:, 1]) > 0.5
    np.testing.assert_allclose(np.abs(normals[on_caps]), [[0.0, 1.0, 0.0]] * int(on_caps.sum()), atol=1e-12)
    np.testing.assert_allclose(normals[~on_caps, 1], 0.0, atol=1e-12)
    side = CLOSED["cylinder"].vertices[~on_caps]
    np.testing.assert_allclose(normals[~on_caps] * 0.5, side * (1.0, 0.0, 1.0), atol=1e-12)


def test_a_grid_is_seen_from_where_its_columns_run_right_and_its_rows_up() -> None:
    shape = surface(np.array([[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [(0.0, 1.0, 0.0), (1.0, 1.0, 0.0)]]))
    np.testing.assert_array_equal(shape.normals, [(0.0, 0.0, 1.0)] * 4)
    assert (face_normals(shape)[:, 2] > 0.0).all()


def test_texture_coordinates_are_metres_until_a_tile_size_divides_them() -> None:
    shape = quad((5.0, 1.0, 0.0), (3.0, 0.0, 0.0), (0.0, 0.0, -2.0))
    np.testing.assert_allclose(shape.uvs.max(axis=0), (3.0, 2.0))
    mesh = shape.mesh(Material("stone"), 0.5, casts_shadows=False)
    assert mesh.uvs is not None
    np.testing.assert_allclose(mesh.uvs.max(axis=0), (6.0, 4.0))
    assert mesh.name == "stone"
    assert not mesh.casts_shadows


def test_four_quarter_turns_are_no_turn_to_the_last_bit() -> None:
    shape = CLOSED["arch wall"]
    for axis in "xyz":
        turned = shape
        for _ in range(4):
            turned = turned.turned(axis, 90.0)
        np.testing.assert_array_equal(turned.vertices, shape.vertices)
        np.testing.assert_array_equal(turned.normals, shape.normals)


@pytest.mark.parametrize(
    ("axis", "start", "end"), [("x", (0, 1, 0), (0, 0, 1)), ("y", (0, 0, 1), (1, 0, 0)), ("z", (1, 0, 0), (0, 1, 0))]
)
def test_a_turn_is_counter_clockwise_seen_from_the_tip_of_its_axis(
    axis: str, start: tuple[int, ...], end: tuple[int, ...]
) -> None:
    corner = quad(start, (0.1, 0.0, 0.0), (0.0, 0.1, 0.0)).turned(axis, 90.0).vertices[0]
    np.testing.assert_array_equal(corner, end)
    assert volume(CLOSED["box"].turned(axis, 33.0)) == pytest.approx(volume(CLOSED["box"]))


def test_a_stretched_ball_has_the_normals_of_an_ellipsoid() -> None:
    shape = ball(1.0, 64).stretched(2.0, 1.0, 0.5)
    true = shape.vertices / np.array([4.0, 1.0, 0.25])
    np.testing.assert_allclose(shape.normals, true / np.linalg.norm(true, axis=1, keepdims=True), atol=2e-3)


def test_repeated_shapes_stand_at_their_places_and_stay_apart() -> None:
    block = box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    row = repeat(block, [(0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (0.0, 5.0, 0.0)])
    assert len(row.faces) == 36
    assert volume(row) == pytest.approx(3.0)
    np.testing.assert_array_equal(row.vertices[row.faces[12:24]].min(axis=(0, 1)), (3.0, 0.0, 0.0))
    np.testing.assert_array_equal(row.vertices[row.faces[24:]].max(axis=(0, 1)), (1.0, 6.0, 1.0))
    assert len(repeat(block, []).faces) == 0
    assert volume(join(row, block.moved(9.0, 0.0, 0.0))) == pytest.approx(4.0)


def test_a_moulding_runs_from_mitre_to_mitre() -> None:
    profile = [(0.0, 0.0), (0.2, 0.0), (0.2, 0.1), (0.0, 0.1)]
    shape = moulding(profile, (0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (-1.0, 0.0, 1.0), (1.0, 0.0, 1.0))
    np.testing.assert_allclose(shape.vertices.min(axis=0), (-0.2, 0.0, 0.0))
    np.testing.assert_allclose(shape.vertices.max(axis=0), (2.2, 0.1, 0.2))
    front = shape.normals[np.isclose(shape.vertices[:, 2], 0.2)]
    assert (front @ np.array([0.0, 0.0, 1.0]) >= -1e-12).all()


def test_a_curve_passes_through_its_points_and_an_arc_ends_where_it_should() -> None:
    points = [(0.0, 0.0), (1.0, 2.0), (1.5, 2.0), (3.0, -1.0)]
    np.testing.assert_allclose(curve(*points, pieces=5)[::5], points)
    half = arc((0.0, 1.0), 2.0, -90.0, 90.0, 8)
    np.testing.assert_allclose(half[[0, 4, 8]], [(0.0, -1.0), (2.0, 1.0), (0.0, 3.0)])
    assert half[0, 0] == 0.0 == half[-1, 0]
    whole = arc((3.0, 0.0), 1.0, 10.0, 370.0, 8)
    np.testing.assert_array_equal(whole[0], whole[-1])
