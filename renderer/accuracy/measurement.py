"""The accuracy of one setting: its frame, held against the reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderer.accuracy.grid import Setting
from renderer.accuracy.measures import plain_measures
from renderer.accuracy.record import Accuracy, SettingResult, StandardError
from renderer.accuracy.renders import Renders
from renderer.accuracy.timing import frame_time
from renderer.eccentricity import eccentricity_deg
from renderer.frame import FrameRequest, RayCounts, StageTimes
from renderer.prepared import PreparedScene
from renderer.standard_error import FOVEA_DEG


@dataclass(frozen=True, slots=True)
class Measured:
    """What is known of a setting without timing it; attributes as in `SettingResult`."""

    effects: tuple[str, ...]
    cells: int
    samples_per_cell: float
    rays: RayCounts
    stated_error: StandardError
    accuracy: Accuracy


def measure(
    renderer: Renders,
    prepared: PreparedScene,
    view: FrameRequest,
    setting: Setting,
    reference: NDArray[np.float32],
) -> tuple[Measured, NDArray[np.float32]]:
    """Render a setting and hold it against the reference.

    Args:
        renderer: any; it counts the rays of a whole frame only if it keeps no samples.
        prepared: the scene.
        view: gaze, display and camera.
        setting: the quality.
        reference: (h, w, 3) float32 linear radiance.

    Returns:
        what was found by measures that need no other package, and the frame, (h, w, 3) float32 linear radiance.

    Raises:
        ValueError: for a frame or a reference that is not finite.
    """
    frame = renderer.render(prepared, replace(view, quality=setting.quality, linear=True))
    radiance = frame.pixels.astype(np.float32, copy=False)
    fovea = eccentricity_deg(view.display, view.gaze) <= FOVEA_DEG
    cost = frame.cost
    measured = Measured(
        effects=cost.effects,
        cells=cost.cells,
        samples_per_cell=cost.mean_samples,
        rays=cost.rays,
        stated_error=StandardError(cost.rms_error, cost.foveal_rms_error),
        accuracy=plain_measures(radiance, reference, prepared.scene.exposure, fovea),
    )
    return measured, radiance


def setting_result(
    setting: Setting, measured: Measured, runs: Sequence[StageTimes], frame: str, error_map: str
) -> SettingResult:
    """All there is to know of a setting.

    Args:
        setting, measured: what it is and how accurate.
        runs: its times, one or more.
        frame, error_map: paths of its pictures.
    """
    return SettingResult(
        id=setting.id,
        label=setting.label,
        group=setting.group,
        marks=setting.marks,
        quality=setting.quality,
        effects=measured.effects,
        cells=measured.cells,
        samples_per_cell=measured.samples_per_cell,
        rays=measured.rays,
        time_ms=frame_time(runs),
        stated_error=measured.stated_error,
        accuracy=measured.accuracy,
        frame=frame,
        error_map=error_map,
    )
