"""What is measured of a scene: the records of accuracy.json, and reading them back.

A value that does not exist is None, `null` in the file: foveal ones where the fovea is off the screen, a ratio to a
black reference, the PSNR of two equal frames, and what a metric that is not installed would say.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Final, TypeVar, get_args, get_origin, get_type_hints

from renderer.acuity_comparison import ModelCost
from renderer.camera import Camera
from renderer.display import Display
from renderer.frame import RayCounts
from renderer.gaze import Gaze
from renderer.quality import Quality

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

GROUPS: Final = (
    "samples", "map", "acuity_scale", "antialiasing", "reconstruction", "shadow_samples", "max_depth", "effects",
    "acuity_model",
)  # fmt: skip
"""What a setting varies."""

DEFAULT: Final = "default"
PAPER: Final = "paper"
"""Marks: the setting of a request that states none; that of Siekawa and Mantiuk (2014)."""

_Kind = TypeVar("_Kind")


@dataclass(frozen=True, slots=True)
class Machine:
    """What the times were measured on.

    Attributes:
        processor: its model.
        cores: logical processors of the machine.
        threads: that the frames were rendered on.
        memory_gib: [GiB].
        platform, python: operating system, and version of Python.
        packages: versions of those that decide speed or pictures, by name.
    """

    processor: str
    cores: int
    threads: int
    memory_gib: float
    platform: str
    python: str
    packages: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class StandardError:
    """An estimated standard error of luminance, as a share of white: over the screen, and in the fovea."""

    rms: float | None
    foveal_rms: float | None


@dataclass(frozen=True, slots=True)
class Reference:
    """What the settings are held against: the scene at full resolution.

    Attributes:
        samples: camera rays a pixel; none of them is one of a setting's.
        standard_error: its own.
        seconds: that it took [s].
        frame: its picture, a path beside the record.
    """

    samples: int
    standard_error: StandardError
    seconds: float
    frame: str


@dataclass(frozen=True, slots=True)
class FrameTime:
    """Time of a frame whose map and samples are all made anew, without encoding, over the repeats [ms].

    Attributes:
        median, low, high: of the whole frame.
        repeats: each, in the order in which they were measured.
        map, trace, reconstruct: medians of its stages.
    """

    median: float
    low: float
    high: float
    repeats: tuple[float, ...]
    map: float
    trace: float
    reconstruct: float


@dataclass(frozen=True, slots=True)
class Accuracy:
    """How far a frame is from the reference, in what the screen shows: linear light from 0 to 1, white.

    A lamp that is a thousand times as bright as white shows as white; if it did not, its edge would drown all else.
    The fovea is what lies within 2.5 deg of the gaze.

    Attributes:
        luminance_ratio: mean luminance over that of the reference.
        relative_mse: mean of the luminance's squared error over the reference's squared luminance plus 0.01.
        rms, foveal_rms: root mean square error of luminance over the screen and in the fovea; that part of it which
            is chance is what `stated_error` estimates.
        foveal_psnr_db: peak signal-to-noise ratio of the colours in the fovea [dB].
        foveal_max_error: largest difference of a colour channel in the fovea.
        flip_mean, flip_p99: FLIP, mean and 99th percentile over the screen, 0 to 1; it knows no gaze.
        jod, jod_heat_foveal_p99: FovVideoVDP with the gaze: quality, 10 for no difference; 99th percentile of
            its map of differences within 5 deg of the gaze.
    """

    luminance_ratio: float | None
    relative_mse: float
    rms: float
    foveal_psnr_db: float | None
    foveal_max_error: float | None
    foveal_rms: float | None
    flip_mean: float | None = None
    flip_p99: float | None = None
    jod: float | None = None
    jod_heat_foveal_p99: float | None = None


@dataclass(frozen=True, slots=True)
class SettingResult:
    """One setting: what it is, what it costs, how accurate it is.

    Attributes:
        id: letters, digits and `-`.
        label: for people.
        group: one of `GROUPS`.
        marks: `DEFAULT`, `PAPER`, both or neither.
        quality: the setting.
        effects: names of those that ran.
        cells: of the map.
        samples_per_cell: camera rays, mean over the cells.
        rays: traced for the frame.
        time_ms: what it took.
        stated_error: what the frame says of itself.
        accuracy: what it is.
        frame, error_map: pictures, paths beside the record.
    """

    id: str
    label: str
    group: str
    marks: tuple[str, ...]
    quality: Quality
    effects: tuple[str, ...]
    cells: int
    samples_per_cell: float
    rays: RayCounts
    time_ms: FrameTime
    stated_error: StandardError
    accuracy: Accuracy
    frame: str
    error_map: str


@dataclass(frozen=True, slots=True)
class AccuracyReport:
    """What accuracy costs for one scene, view, gaze and screen on one machine.

    Attributes:
        version: of gazetrace.
        command: that measured it.
        made: when, ISO 8601 in UTC.
        machine: where.
        scene: its name.
        triangles, spheres: its size.
        effects: that it calls for.
        display, gaze, camera: what was rendered.
        reference: what the settings are held against.
        settings: the default first.
        acuity_models: what each costs with the default quality; empty where they were not compared.
    """

    version: str
    command: str
    made: str
    machine: Machine
    scene: str
    triangles: int
    spheres: int
    effects: tuple[str, ...]
    display: Display
    gaze: Gaze
    camera: Camera
    reference: Reference
    settings: tuple[SettingResult, ...]
    acuity_models: tuple[ModelCost, ...] = ()


def report_json(report: DataclassInstance) -> str:
    """A record as accuracy.json or temporal.json holds it.

    Raises:
        ValueError: for a number that is not finite.
    """
    return json.dumps(asdict(report), indent=1, allow_nan=False) + "\n"


def read_report(text: str) -> AccuracyReport:
    """The report in an accuracy.json.

    Raises:
        ValueError: naming the field, for what is none.
        SettingsError: for a quality, screen, gaze or camera out of range.
    """
    return read_record(AccuracyReport, json.loads(text))


def read_record(kind: type[_Kind], values: object) -> _Kind:
    """A record of class `kind` as `asdict` and JSON left it; fields that it does not have are ignored.

    Raises:
        ValueError: naming the field, for one that is missing or of another type.
        SettingsError: for a value out of range.
    """
    record: _Kind = _read(kind, values, kind.__name__)
    return record


def _read(hint: Any, value: object, place: str) -> Any:
    origin = get_origin(hint)
    if is_dataclass(hint) and isinstance(value, dict):
        hints = get_type_hints(hint)
        missing = [field.name for field in fields(hint) if field.name not in value]
        if missing:
            raise ValueError(f"{place}.{missing[0]}: expected it, found nothing")
        read = {
            field.name: _read(hints[field.name], value[field.name], f"{place}.{field.name}") for field in fields(hint)
        }
        return hint(**read)  # type: ignore[operator]
    if origin is UnionType:
        (inner,) = (part for part in get_args(hint) if part is not NoneType)
        return None if value is None else _read(inner, value, place)
    if origin is tuple and isinstance(value, list):
        parts = get_args(hint)
        kinds = parts if parts[-1] is not Ellipsis else (parts[0],) * len(value)
        return tuple(_read(inner, part, place) for inner, part in zip(kinds, value, strict=True))
    if origin is Mapping and isinstance(value, dict):
        return value
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if (hint is float and number) or (isinstance(hint, type) and type(value) is hint):
        return value
    raise ValueError(f"{place}: expected {getattr(hint, '__name__', hint)}, found {value!r}")
