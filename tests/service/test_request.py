"""Request models: the records' own fields, defaults and bounds; the documented example; nothing else gets in."""

from __future__ import annotations

import math
from dataclasses import MISSING, fields
from typing import Any, get_args

import pytest
from pydantic import BaseModel, ValidationError

from renderer.acuity import ECCENTRICITIES, MODELS, Acuity
from renderer.camera import Camera
from renderer.codec import FORMATS
from renderer.display import Display
from renderer.errors import SettingsError
from renderer.gaze import Gaze
from renderer.quality import ANTIALIASING, ERROR_SAMPLES, MAPS, RECONSTRUCTIONS, Quality
from service.request import (
    AcuityBody,
    CameraBody,
    CellMapQuery,
    DisplayBody,
    FrameQuery,
    GazeBody,
    QualityBody,
    RenderBody,
)

DESIGN_EXAMPLE = {
    "scene": "atrium",
    "gaze": {"x": 1000, "y": 500},
    "display": {"width_px": 1920, "height_px": 1080, "width_cm": 50, "height_cm": 35, "distance_cm": 60},
    "camera": {"position": [0, 1.6, 5], "look_at": [0, 1.4, 0], "up": [0, 1, 0], "vertical_fov_deg": 40},
    "quality": {
        "map": "aligned",
        "gaze_bucket_px": 16,
        "samples_per_cell": 4,
        "antialiasing": "stochastic",
        "max_depth": 5,
        "acuity": {"model": "peli", "eccentricity": "exact", "scale": 1.0, "margin_deg": 0},
        "reconstruction": "nearest",
        "deadline_ms": None,
        "max_error": None,
    },
    "format": "png",
}

BODIES_AND_RECORDS = [
    (GazeBody, Gaze, {"unit"}),
    (DisplayBody, Display, set()),
    (CameraBody, Camera, set()),
    (AcuityBody, Acuity, set()),
    (QualityBody, Quality, set()),
]


def test_the_documented_example_is_accepted() -> None:
    order = RenderBody.model_validate(DESIGN_EXAMPLE).order()
    assert order.scene_id == "atrium"
    assert order.request.gaze == Gaze(1000, 500)
    assert order.request.display == Display(1920, 1080, 50, 35, 60)
    assert order.request.camera == Camera((0, 1.6, 5), (0, 1.4, 0), (0, 1, 0), 40)
    assert order.request.quality == Quality()
    assert not order.request.linear


def test_scene_and_gaze_are_enough() -> None:
    order = RenderBody.model_validate({"scene": "spheres", "gaze": {"x": 1.5, "y": 2}}).order()
    assert order.request.display == Display()
    assert order.request.quality == Quality()
    assert order.request.camera is None
    assert (order.format, order.image_quality) == ("png", 90)


@pytest.mark.parametrize(("body", "record", "further"), BODIES_AND_RECORDS)
def test_fields_and_defaults_are_the_records(body: type[BaseModel], record: type, further: set[str]) -> None:
    stated = {field.name: field for field in fields(record)}
    assert set(body.model_fields) == set(stated) | further
    for name, field in stated.items():
        model_field = body.model_fields[name]
        if not model_field.is_required():
            default = field.default if field.default is not MISSING else field.default_factory()
            assert _plain(model_field.default) == _plain(default), name


def test_a_camera_states_where_it_is_and_where_it_looks() -> None:
    required = {name for name, field in CameraBody.model_fields.items() if field.is_required()}
    assert required == {"position", "look_at"}


@pytest.mark.parametrize(
    ("model", "field", "choices"),
    [
        (QualityBody, "map", MAPS),
        (QualityBody, "antialiasing", ANTIALIASING),
        (QualityBody, "reconstruction", RECONSTRUCTIONS),
        (AcuityBody, "model", MODELS),
        (AcuityBody, "eccentricity", ECCENTRICITIES),
        (RenderBody, "format", FORMATS),
    ],
)
def test_choices_are_the_renderers(model: type[BaseModel], field: str, choices: tuple[str, ...]) -> None:
    assert get_args(model.model_fields[field].annotation) == choices


NUMBERS = [
    (DisplayBody, Display, "width_px", int),
    (DisplayBody, Display, "height_px", int),
    (DisplayBody, Display, "width_cm", float),
    (DisplayBody, Display, "height_cm", float),
    (DisplayBody, Display, "distance_cm", float),
    (AcuityBody, Acuity, "scale", float),
    (AcuityBody, Acuity, "margin_deg", float),
    (QualityBody, Quality, "gaze_bucket_px", int),
    (QualityBody, Quality, "samples_per_cell", int),
    (QualityBody, Quality, "shadow_samples", int),
    (QualityBody, Quality, "max_depth", int),
    (QualityBody, Quality, "deadline_ms", float),
    (QualityBody, Quality, "max_error", float),
    (CameraBody, Camera, "vertical_fov_deg", float),
]


@pytest.mark.parametrize(("body", "record", "field", "kind"), NUMBERS)
def test_bounds_are_the_records(body: type[BaseModel], record: type, field: str, kind: type) -> None:
    needed = {"position": [0, 0, 5], "look_at": [0, 0, 0]} if body is CameraBody else {}
    edges = [0, 1e-3, 1, 16, 64, 90, 179, 512, 1000, 4096, 32_768, 6e5, 1e9]
    probes: list[Any] = [-1, "1", None, True, math.nan, math.inf, -math.inf, 10**400]
    for edge in edges:
        probes += [int(edge), int(edge) + 1, int(edge) - 1]
        if kind is float:
            probes += [edge, math.nextafter(edge, math.inf), math.nextafter(edge, -math.inf)]
    accepted = 0
    for probe in probes:
        try:
            record(**{field: probe})
            right = True
        except SettingsError:
            right = False
        try:
            model = body.model_validate({**needed, field: probe})
            model.record()
            found = True
        except (ValidationError, SettingsError):
            found = False
        assert found == right, (field, probe)
        accepted += right
    assert 0 < accepted < len(probes)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("gaze.x", math.nan),
        ("gaze.y", math.inf),
        ("gaze.x", 1e31),
        ("gaze.x", "7"),
        ("gaze.unit", "cm"),
        ("gaze.z", 1),
        ("display.width_px", 1920.0),
        ("display.depth", 1),
        ("camera.position", [0, 1]),
        ("camera.position", [0, 1, math.nan]),
        ("camera.position", [0, 1, 1e16]),
        ("camera.roll_deg", 1),
        ("quality.map", "round"),
        ("quality.deadline_ms", "20"),
        ("quality.max_error", 0),
        ("quality.max_error", "0.1"),
        ("quality.acuity.model", "barten"),
        ("quality.acuity.blur", 1),
        ("format", "gif"),
        ("image_quality", 0),
        ("image_quality", 101),
        ("scene", "x" * 65),
        ("scene", 3),
        ("session", "abc"),
    ],
)
def test_everything_else_is_refused_by_name(path: str, value: object) -> None:
    stated: dict[str, Any] = {
        "scene": "spheres",
        "gaze": {"x": 1, "y": 2},
        "display": {},
        "camera": {"position": [0, 0, 5], "look_at": [0, 0, 0]},
        "quality": {"acuity": {}},
    }
    RenderBody.model_validate(stated)
    *parents, name = path.split(".")
    inner = stated
    for parent in parents:
        inner = inner[parent]
    inner[name] = value
    with pytest.raises(ValidationError) as raised:
        RenderBody.model_validate(stated)
    locations = [".".join(map(str, error["loc"])) for error in raised.value.errors()]
    assert all(location == path or location.startswith(path + ".") for location in locations), locations


def test_a_view_of_no_length_is_refused() -> None:
    stated = {**DESIGN_EXAMPLE, "camera": {"position": [0, 0, 5], "look_at": [0, 0, 5]}}
    with pytest.raises(SettingsError, match=r"camera\.look_at"):
        RenderBody.model_validate(stated).order()


def test_a_fraction_of_the_screen_is_a_gaze() -> None:
    stated = {
        "scene": "s",
        "gaze": {"x": 0.25, "y": 1.5, "unit": "fraction"},
        "display": {"width_px": 800, "height_px": 600},
    }
    assert RenderBody.model_validate(stated).order().request.gaze == Gaze(200, 900)


def test_a_body_and_a_query_say_the_same() -> None:
    body = RenderBody.model_validate(
        {
            "scene": "atrium",
            "gaze": {"x": 0.25, "y": 0.5, "unit": "fraction"},
            "display": {"width_px": 640, "height_px": 360, "width_cm": 40, "height_cm": 20, "distance_cm": 55.5},
            "quality": {
                "map": "scanline",
                "gaze_bucket_px": 4,
                "samples_per_cell": 9,
                "antialiasing": "regular",
                "shadow_samples": 16,
                "max_depth": 3,
                "deadline_ms": 12.5,
                "max_error": 0.25,
                "effects": ["+textures", "-reflection"],
                "acuity": {"model": "guenter", "eccentricity": "paper", "scale": 1.5, "margin_deg": 0.5},
            },
            "format": "raw",
        }
    )
    query = FrameQuery.model_validate(
        {
            "gaze_x": "0.25",
            "gaze_y": "0.5",
            "unit": "fraction",
            "width_px": "640",
            "height_px": "360",
            "width_cm": "40",
            "height_cm": "20",
            "distance_cm": "55.5",
            "map": "scanline",
            "gaze_bucket_px": "4",
            "samples_per_cell": "9",
            "antialiasing": "regular",
            "shadow_samples": "16",
            "max_depth": "3",
            "deadline_ms": "12.5",
            "max_error": "0.25",
            "effects": " textures,-reflection",
            "acuity_model": "guenter",
            "eccentricity": "paper",
            "acuity_scale": "1.5",
            "margin_deg": "0.5",
            "format": "raw",
        }
    )
    assert query.order("atrium") == body.order()
    assert body.order().request.linear


def test_the_defaults_of_a_query_are_those_of_a_body() -> None:
    body = RenderBody.model_validate({"scene": "s", "gaze": {"x": 1, "y": 2}})
    assert FrameQuery(gaze_x=1, gaze_y=2).order("s") == body.order()
    cells = CellMapQuery(gaze_x=1, gaze_y=2)
    assert (cells.display(), cells.gaze(), cells.quality()) == (Display(), Gaze(1, 2), Quality())


def _plain(value: object) -> object:
    """A record, a model or a tuple as what JSON has for it."""
    if isinstance(value, BaseModel):
        return value.model_dump()
    if isinstance(value, Acuity):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    return list(value) if isinstance(value, tuple) else value


def test_who_asks_for_an_error_and_not_for_samples_may_have_many() -> None:
    assert QualityBody().record().samples_per_cell == 4
    assert QualityBody(max_error=0.1).record().samples_per_cell == ERROR_SAMPLES
    assert QualityBody(max_error=0.1, samples_per_cell=4).record().samples_per_cell == 4
    query = {"gaze_x": 1, "gaze_y": 2, "max_error": 0.1}
    assert FrameQuery.model_validate(query).quality().samples_per_cell == ERROR_SAMPLES
    assert FrameQuery.model_validate({**query, "samples_per_cell": 8}).quality().samples_per_cell == 8
    again = QualityBody.model_validate({**QualityBody(max_error=0.1).model_dump(), "max_error": 0.2})
    assert again.record().samples_per_cell == ERROR_SAMPLES
