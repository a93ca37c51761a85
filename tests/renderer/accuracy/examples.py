"""A report with a bit of everything."""

from __future__ import annotations

from renderer.accuracy.record import (
    DEFAULT,
    Accuracy,
    AccuracyReport,
    FrameTime,
    Machine,
    Reference,
    SettingResult,
    StandardError,
)
from renderer.acuity import Acuity
from renderer.acuity_comparison import ModelCost
from renderer.camera import Camera
from renderer.display import Display
from renderer.frame import RayCounts
from renderer.gaze import Gaze
from renderer.quality import Quality

NEAR = SettingResult(
    id="aligned-4",
    label="aligned, 4 samples",
    group="samples",
    marks=(DEFAULT,),
    quality=Quality(),
    effects=("shadows", "reflection"),
    cells=2000,
    samples_per_cell=4.0,
    rays=RayCounts(8000, 9000, 700, 0),
    time_ms=FrameTime(20.0, 18.5, 31.0, (31.0, 18.5, 20.0), 2.0, 17.0, 1.0),
    stated_error=StandardError(0.03, 0.02),
    accuracy=Accuracy(1.001, 0.004, 0.031, 41.5, 0.2, 0.019, 0.05, 0.3, 9.7, 0.1),
    frame="frames/aligned-4.png",
    error_map="frames/aligned-4-error.png",
)

FAR = SettingResult(
    id="no-shadows",
    label="no shadows",
    group="effects",
    marks=(),
    quality=Quality(map="scanline", samples_per_cell=1, effects=("-shadows",), acuity=Acuity(scale=2.0)),
    effects=(),
    cells=900,
    samples_per_cell=1.0,
    rays=RayCounts(900),
    time_ms=FrameTime(5.0, 5.0, 5.0, (5.0,), 1.0, 3.0, 1.0),
    stated_error=StandardError(None, None),
    accuracy=Accuracy(None, 0.5, 0.4, None, None, None),
    frame="frames/no-shadows.png",
    error_map="frames/no-shadows-error.png",
)

REPORT = AccuracyReport(
    version="0.1.0",
    command="gazetrace accuracy spheres -o DIR",
    made="2026-01-02T03:04:05+00:00",
    machine=Machine("a processor", 8, 2, 15.5, "Linux 6.1", "3.11.7", {"numpy": "2.4.6"}),
    scene="spheres",
    triangles=12,
    spheres=3,
    effects=("shadows", "reflection"),
    display=Display(64, 36),
    gaze=Gaze(-20.0, 18.5),
    camera=Camera(),
    reference=Reference(256, StandardError(0.002, None), 12.5, "frames/reference.png"),
    settings=(NEAR, FAR),
    acuity_models=(ModelCost("peli", "a paper", "f = 1", 60.0, (0.0, 30.0), (43.1, 4.1), 2000, 0.87, 8000),),
)
