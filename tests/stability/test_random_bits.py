"""Random bits at every entry of the renderer: a picture of finite values, or one clear error of the right kind."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from renderer.acuity import Acuity
from renderer.camera import Camera
from renderer.camera_path import CameraPath, Keyframe
from renderer.display import Display
from renderer.errors import RenderError
from renderer.frame import Frame, FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import (
    MAX_COORDINATE_M,
    MAX_INTENSITY,
    MAX_RADIANCE,
    Light,
    Material,
    Mesh,
    PointLight,
    RectangleLight,
    Scene,
    Sphere,
    SphereLight,
    Surroundings,
    Texture,
)
from tests.stability.bits import anything, around, floats

CLAY = Material()
VIEW = Camera()
RECORDS: dict[type, dict[str, Any]] = {
    Acuity: {},
    Camera: {},
    CameraPath: {"keyframes": (Keyframe(0.0, VIEW),)},
    Display: {},
    FrameRequest: {"gaze": Gaze(1.0, 1.0), "display": Display(8, 6), "camera": None, "quality": Quality()},
    Gaze: {"x": 1.0, "y": 1.0},
    Keyframe: {"time_s": 0.0, "camera": VIEW},
    Material: {},
    Mesh: {"vertices": np.eye(3), "faces": np.array([[0, 1, 2]]), "material": CLAY},
    PointLight: {"position": (0.0, 1.0, 0.0), "intensity": (1.0, 1.0, 1.0)},
    Quality: {},
    RectangleLight: {
        "corner": (0.0, 0.0, 0.0), "edge_u": (1.0, 0.0, 0.0), "edge_v": (0.0, 1.0, 0.0), "radiance": (1.0, 1.0, 1.0),
    },
    Scene: {},
    Sphere: {"center": (0.0, 0.0, 0.0), "radius": 1.0, "material": CLAY},
    SphereLight: {"center": (0.0, 0.0, 0.0), "radius": 1.0, "radiance": (1.0, 1.0, 1.0)},
    Surroundings: {},
    Texture: {"pixels": np.zeros((2, 2, 3), dtype=np.uint8)},
}  # fmt: skip
"""Every record that a user of the renderer makes, with what it needs."""


def attempt(make: Callable[..., Any], *values: Any, **fields: Any) -> Any:
    """What `make` makes of some values; None where it refuses them, in one line."""
    try:
        return make(*values, **fields)
    except RenderError as refusal:
        said = str(refusal)
    assert len(said.splitlines()) == 1
    assert len(said) < 400
    return None


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record.__name__)
def test_a_record_takes_a_value_or_refuses_it(record: type) -> None:
    """One field after the other holds what it should not; what is taken can be compared, and found again."""

    @settings(max_examples=60)
    @given(st.sampled_from([field.name for field in dataclasses.fields(record)]), anything)
    def one_field(name: str, value: Any) -> None:
        made = attempt(record, **{**RECORDS[record], name: value})
        if made is None:
            return
        assert made == made
        hash(made)

    one_field()


def some_finite(frame: Frame) -> None:
    assert np.isfinite(frame.pixels).all()
    assert (frame.pixels >= 0).all()
    for name, number in dataclasses.asdict(frame.cost).items():
        if isinstance(number, float):
            assert math.isfinite(number), name


def triples(low: float, high: float) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[around(low, high)] * 3)


def arrays(columns: int, rows: int, part: st.SearchStrategy[float]) -> st.SearchStrategy[Any]:
    return st.lists(part, min_size=columns * rows, max_size=columns * rows).map(
        lambda numbers: np.array(numbers).reshape(rows, columns)
    )


@st.composite
def made_of_bits(draw: st.DrawFn) -> tuple[Scene, Camera] | None:
    """A scene and a camera with a number of any bits in every place, as far as they are taken."""

    def rgb(high: float) -> Any:
        return draw(st.just((0.5, 0.5, 0.5)) | triples(0.0, high))

    def point(limit: float) -> Any:
        return draw(st.tuples(*[st.floats(-1, 1)] * 3) | triples(-limit, limit))

    def kept(made: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(one for one in made if one is not None)

    def material() -> Material:
        base = draw(st.sampled_from(["phong", "ashikhmin-shirley"]))
        fields: dict[str, Any] = {
            "diffuse": rgb(1.0), "specular": rgb(1.0), "emission": rgb(MAX_RADIANCE), "reflection": rgb(1.0),
            "transmission": rgb(1.0), "shininess": draw(around(0, 1e9)), "exponent_u": draw(around(0, 1e9)),
            "exponent_v": draw(around(0, 1e9)), "ior": draw(around(0.1, 10)), "alpha_cutoff": draw(around(0, 1)),
            "normal_scale": draw(around(-1000, 1000)),
        }  # fmt: skip
        made = [attempt(Material, base=base, **{name: value}) for name, value in fields.items()]
        good = {name: value for (name, value), one in zip(fields.items(), made, strict=True) if one is not None}
        return Material(base=base, **good)

    def mesh() -> Mesh | None:
        n = draw(st.integers(1, 6))
        vertices = draw(arrays(3, n, st.floats(-1, 1) | around(-MAX_COORDINATE_M, MAX_COORDINATE_M)))
        faces = np.array(draw(st.lists(st.tuples(*[st.integers(0, n - 1)] * 3), min_size=1, max_size=4)))
        normals, uvs, tangents = (
            draw(st.none() | arrays(columns, n, floats)) if draw(st.booleans()) else None for columns in (3, 2, 4)
        )
        made: Mesh | None = attempt(Mesh, vertices, faces, material(), normals, uvs, tangents=tangents)
        return made

    def light() -> Light | None:
        kind = draw(st.integers(0, 2))
        made: Light | None
        if kind == 0:
            made = attempt(PointLight, point(MAX_COORDINATE_M), rgb(MAX_INTENSITY), draw(st.booleans()))
        elif kind == 1:
            edges = point(MAX_COORDINATE_M), draw(around(-MAX_COORDINATE_M, MAX_COORDINATE_M))
            edge_u, along = edges
            across = (0.0, along, 0.0) if edge_u[1] == 0.0 else (-along * edge_u[1], along * edge_u[0], 0.0)
            made = attempt(RectangleLight, point(MAX_COORDINATE_M), edge_u, across, rgb(MAX_RADIANCE))
        else:
            radius = draw(around(0, MAX_COORDINATE_M))
            made = attempt(SphereLight, point(MAX_COORDINATE_M), radius, rgb(MAX_RADIANCE))
        return made

    def sphere() -> Sphere | None:
        radius = draw(st.floats(0.01, 1) | around(0, MAX_COORDINATE_M))
        made: Sphere | None = attempt(Sphere, point(MAX_COORDINATE_M), radius, material())
        return made

    count = st.integers(0, 2)
    around_it = [attempt(Surroundings, zenith=rgb(MAX_RADIANCE), ambient=rgb(MAX_RADIANCE)), Surroundings()]
    scene = attempt(
        Scene,
        kept([mesh() for _ in range(draw(count))]), kept([sphere() for _ in range(draw(count))]),
        kept([light() for _ in range(draw(count))]), kept(around_it)[0],
        exposure=draw(st.just(1.0) | around(1e-6, 1e6)),
    )  # fmt: skip
    camera = attempt(Camera, point(1e15), point(1e15), point(1e15), draw(st.just(40.0) | around(1e-3, 179.0)))
    return None if scene is None else (scene, camera or VIEW)


@settings(max_examples=400)
@given(made_of_bits(), st.booleans())
def test_a_scene_of_random_bits_is_a_picture_or_an_error(
    renderer: Renderer, made: tuple[Scene, Camera] | None, linear: bool
) -> None:
    if made is None:
        return
    scene, camera = made
    prepared = attempt(prepare, scene)
    if prepared is None:
        event("refused when prepared")
        return
    quality = Quality(map="full", samples_per_cell=2, max_depth=3)
    frame = renderer.render(prepared, FrameRequest(Gaze(4, 3), Display(8, 6), camera, quality, linear))
    some_finite(frame)
    # A lamp of up to 1e24 W/sr, at any distance, may be brighter than what can be summed up; nothing else happens.
    assert dataclasses.replace(frame.cost.rejected_samples, too_bright=0).total == 0


lengths = st.just(50.0) | around(1e-9, 1e9)


@settings(max_examples=150)
@given(
    st.tuples(st.integers(1, 9), st.integers(1, 9), lengths, st.none() | lengths, lengths),
    st.tuples(around(-1e30, 1e30), around(-1e30, 1e30)),
    st.tuples(around(1e-3, 1e3), around(0, 90), st.sampled_from([0, 1, 16, 512])),
    st.sampled_from(["aligned", "scanline", "full"]),
    st.sampled_from(["exact", "paper"]),
    st.sampled_from(["nearest", "smooth"]),
)
def test_a_screen_and_a_gaze_of_random_bits(
    renderer: Renderer,
    screen: tuple[int, int, float, float | None, float],
    look: tuple[float, float],
    eye: tuple[float, float, int],
    tiling: str,
    eccentricity: str,
    reconstruction: str,
) -> None:
    scale, margin_deg, bucket_px = eye
    display, gaze = attempt(Display, *screen), attempt(Gaze, *look)
    acuity = attempt(Acuity, "peli", eccentricity, scale, margin_deg)
    if None in (display, gaze, acuity):
        return
    quality = Quality(tiling, bucket_px, 2, acuity=acuity, reconstruction=reconstruction)
    lit = Scene(
        spheres=(Sphere((0.0, 0.0, 0.0), 1.0, CLAY),), lights=(PointLight((1.0, 3.0, 4.0), (30.0, 30.0, 30.0)),)
    )
    frame = renderer.render(prepare(lit), FrameRequest(gaze, display, None, quality, linear=True))
    some_finite(frame)
    assert frame.cost.rejected_samples.total == 0


@pytest.mark.parametrize("bits", [0x7FF0000000000001, 0x7FF8000000000000, 0xFFF4000000000000, 0x7FF0000000000000])
@pytest.mark.parametrize("part", ["normals", "uvs", "tangents"])
def test_a_mesh_may_hold_what_is_no_number_beside_its_vertices(renderer: Renderer, part: str, bits: int) -> None:
    """Signalling and quiet NaN and infinity, which make no warning either."""
    columns = {"normals": 3, "uvs": 2, "tangents": 4}[part]
    wild = np.full((3, columns), np.uint64(bits).view(np.float64))
    pattern = Texture(np.uint8([[[0, 128, 255], [255, 128, 128]]]))
    bumpy = Material(diffuse_texture=pattern, normal_texture=pattern)
    corners = np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 1.0, 0.0)])
    fields: dict[str, Any] = {"normals": np.array([(0.1, 0.0, 1.0)] * 3), "uvs": corners[:, :2], part: wild}
    mesh = Mesh(corners, np.array([[0, 1, 2]]), bumpy, **fields)
    lit = Scene((mesh,), lights=(PointLight((0.0, 1.0, 3.0), (9.0, 9.0, 9.0)),))
    frame = renderer.render(prepare(lit), FrameRequest(Gaze(4, 3), Display(8, 6), None, Quality(), linear=True))
    some_finite(frame)
    assert frame.cost.rejected_samples.total == 0
