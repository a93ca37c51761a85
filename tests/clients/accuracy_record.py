"""A measurement made by hand, as `gazetrace accuracy` leaves it on disk."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from renderer.accuracy.record import (
    Accuracy,
    AccuracyReport,
    FrameTime,
    Machine,
    Reference,
    SettingResult,
    StandardError,
    report_json,
)
from renderer.accuracy.temporal import WAYS, Flicker
from renderer.accuracy.temporal_record import TemporalReport
from renderer.acuity_comparison import ModelCost
from renderer.camera import Camera
from renderer.codec import encode
from renderer.display import Display
from renderer.frame import RayCounts
from renderer.gaze import Gaze
from renderer.quality import Quality

WIDTH, HEIGHT = 192, 108

TIMES_AND_ERRORS = {
    "aligned-1": (10.0, 0.08),
    "aligned-4": (30.0, 0.04),
    "slow-4": (35.0, 0.045),
    "paper": (200.0, 0.03),
    "full-16": (400.0, 0.02),
    "full-1": (60.0, 0.04),
}
"""Time [ms] and error of each setting by its id."""

FRONT = ["aligned-1", "aligned-4", "paper", "full-16"]
"""Those that no other beats, the fastest first."""

MARKS = {"aligned-4": ("default",), "paper": ("paper",)}


def setting(name: str, time_ms: float, error: float) -> SettingResult:
    return SettingResult(
        id=name,
        label=f"<{name}> & more",
        group="samples",
        marks=MARKS.get(name, ()),
        quality=Quality(),
        effects=("textures", "soft_shadows"),
        cells=1000,
        samples_per_cell=4.0,
        rays=RayCounts(4000, 300),
        time_ms=FrameTime(time_ms, 0.9 * time_ms, 1.2 * time_ms, (time_ms,), 1.0, 5.0, 2.0),
        stated_error=StandardError(error / 2, error / 3),
        accuracy=Accuracy(1 + error / 10, error**2, error, 40.0, 10 * error, error / 2),
        frame=f"frames/{name}.png",
        error_map=f"frames/{name}-error.png",
    )


def record() -> AccuracyReport:
    return AccuracyReport(
        version="1.2.3",
        command="gazetrace accuracy atrium -o DIR",
        made="2026-01-02T03:04:05+00:00",
        machine=Machine("A processor", 4, 2, 15.5, "Linux", "3.11.2", {"numpy": "2.4"}),
        scene="atrium",
        triangles=381_000,
        spheres=3,
        effects=("textures", "soft_shadows"),
        display=Display(WIDTH, HEIGHT),
        gaze=Gaze(60.0, 40.0),
        camera=Camera(),
        reference=Reference(256, StandardError(0.0012, 0.0007), 12.0, "frames/reference.png"),
        settings=tuple(setting(name, *values) for name, values in TIMES_AND_ERRORS.items()),
        acuity_models=(model("peli", 1200), model("guenter", 300)),
    )


def model(name: str, cells: int) -> ModelCost:
    return ModelCost(
        name, f"{name} & others", "f", 40.0, (0.0, 20.0, 40.0), (43.1, 6.0, 3.0), cells, cells / 20_736, 4 * cells
    )


def with_jod(report: AccuracyReport, jod: float) -> AccuracyReport:
    """The same, with a JOD for every setting."""
    settings = (
        replace(setting, accuracy=replace(setting.accuracy, jod=jod, jod_heat_foveal_p99=0.1))
        for setting in report.settings
    )
    return replace(report, settings=tuple(settings))


def write_measurement(folder: Path, report: AccuracyReport) -> None:
    """accuracy.json and its pictures: noise, so that no two are alike."""
    (folder / "frames").mkdir(parents=True)
    (folder / "accuracy.json").write_text(report_json(report))
    random = np.random.default_rng(1)
    names = [report.reference.frame, *(name for part in report.settings for name in (part.frame, part.error_map))]
    for name in names:
        (folder / name).write_bytes(encode(random.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8), "png"))


def write_flicker(folder: Path, scene: str = "atrium") -> None:
    """temporal.json, of three steps."""
    ways = (
        Flicker(way, 3, 2, 1000.0, 0.3, 0.02 / place, None, 0.0, (0.0, 0.02 / place, 0.04 / place))
        for place, way in enumerate(WAYS, 1)
    )
    report = record()
    temporal = TemporalReport(
        version=report.version,
        command="gazetrace accuracy atrium --temporal -o DIR",
        made=report.made,
        machine=report.machine,
        scene=scene,
        display=report.display,
        camera=report.camera,
        quality=Quality(),
        gaze_trace="<eye>.csv",
        frames_per_second=25.0,
        gazes=(report.gaze,) * 4,
        ways=tuple(ways),
    )
    (folder / "temporal.json").write_text(report_json(temporal))
