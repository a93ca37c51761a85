"""The acuity models side by side: what each holds the eye to see, and what that costs on a display."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from renderer.acuity import ACUITY_MODELS, cut_off_cpd
from renderer.cellmap import build_cell_map
from renderer.display import Display
from renderer.gaze import Gaze, bucket_of
from renderer.quality import Quality
from renderer.workers import Workers

CURVE_END_DEG = 60.0
CURVE_STEPS = 121
"""Eccentricities of a cut-off curve: every half degree, to beyond the corner of a desktop screen."""


@dataclass(frozen=True, slots=True)
class ModelCost:
    """One acuity model on one display.

    Attributes:
        model, source, formula: which.
        valid_deg: eccentricities it holds for, 0 to this [deg].
        eccentricities_deg, cut_offs_cpd: its cut-off curve [deg], [cpd].
        cells: cells of the map for one gaze.
        cells_per_pixel: share of them among the pixels.
        camera_rays: rays from the camera that a frame of these cells costs.
    """

    model: str
    source: str
    formula: str
    valid_deg: float
    eccentricities_deg: tuple[float, ...]
    cut_offs_cpd: tuple[float, ...]
    cells: int
    cells_per_pixel: float
    camera_rays: int


def compare_models(display: Display, gaze: Gaze, quality: Quality, pool: Workers) -> tuple[ModelCost, ...]:
    """Every acuity model on `display`, in the order of `MODELS`; arguments as of `model_cost`."""
    return tuple(model_cost(name, display, gaze, quality, pool) for name in ACUITY_MODELS)


def model_cost(name: str, display: Display, gaze: Gaze, quality: Quality, pool: Workers) -> ModelCost:
    """One acuity model on `display`.

    Args:
        name: of the model.
        display: the screen.
        gaze: where the eye looks [px].
        quality: tiling, bucket, samples a cell, and the eye but for its model.
        pool: threads to build the map on.
    """
    model, angles = ACUITY_MODELS[name], np.linspace(0.0, CURVE_END_DEG, CURVE_STEPS)
    bucket = bucket_of(gaze, quality.gaze_bucket_px)
    cells = build_cell_map(quality.map, display, replace(quality.acuity, model=name), bucket, pool).cells
    return ModelCost(
        model=name,
        source=model.source,
        formula=model.formula,
        valid_deg=model.valid_deg,
        eccentricities_deg=tuple(angles.tolist()),
        cut_offs_cpd=tuple(cut_off_cpd(angles, name).tolist()),
        cells=cells,
        cells_per_pixel=cells / display.pixels,
        camera_rays=cells * quality.samples_per_cell,
    )
