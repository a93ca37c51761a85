"""What is measured of a gaze that moves: the record of temporal.json."""

from __future__ import annotations

from dataclasses import dataclass

from renderer.accuracy.record import Machine
from renderer.accuracy.temporal import Flicker
from renderer.camera import Camera
from renderer.display import Display
from renderer.gaze import Gaze
from renderer.quality import Quality


@dataclass(frozen=True, slots=True)
class TemporalReport:
    """Flicker of one scene for one walk of the gaze.

    Attributes:
        version, command, made, machine, scene, display, camera: as in `AccuracyReport`.
        quality: of every frame, but for its map.
        gaze_trace: where the gaze is from.
        frames_per_second: how far apart in time the gazes are [Hz].
        gazes: that frames were rendered for.
        ways: what changed with each way of mapping.
    """

    version: str
    command: str
    made: str
    machine: Machine
    scene: str
    display: Display
    camera: Camera
    quality: Quality
    gaze_trace: str
    frames_per_second: float
    gazes: tuple[Gaze, ...]
    ways: tuple[Flicker, ...]
