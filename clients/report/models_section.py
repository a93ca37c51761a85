"""The acuity models in an accuracy report: what each costs on its screen, beside the error that it leaves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from clients.report.accuracy_data import Record, measured
from clients.report.html import figure, table, text
from clients.report.model_figure import ModelCurve, draw_models

MEASURES = ("foveal_rms", "rms", "flip_mean", "jod")
"""Columns of the table, where they were measured."""

TITLE = "Acuity models"
CAPTION = """\
Each model says how fine detail the eye sees at which angle from the gaze, and so how wide cells may be: one that sees
more costs more rays and leaves less error. All else is the default, and the reference that of all settings."""


def models_section(record: Record, folder: Path) -> str:
    """Draw the models into `folder`; figure and table as HTML.

    Args:
        record: what accuracy.json holds.
        folder: where the figure goes.
    """
    display = record["display"]
    pitch_deg = math.degrees(math.atan2(display["width_cm"] / display["width_px"], display["distance_cm"]))
    picture, *_ = draw_models(list(model_curves(record)), 0.5 / pitch_deg, folder / "acuity-models")
    return figure(TITLE, picture, CAPTION) + _table(record)


def model_curves(record: Record) -> Iterator[ModelCurve]:
    """Each model with its cost, and with its errors where a setting measured them."""
    for cost in record["acuity_models"]:
        setting = _setting(record, cost["model"])
        accuracy = {} if setting is None else setting["accuracy"]
        yield ModelCurve(
            name=cost["model"],
            angles_deg=cost["eccentricities_deg"],
            cut_off_cpd=cost["cut_offs_cpd"],
            cells_per_pixel=cost["cells_per_pixel"],
            camera_rays=cost["camera_rays"],
            rms=accuracy.get("rms"),
            foveal_rms=accuracy.get("foveal_rms"),
        )


def _setting(record: Record, model: str) -> Record | None:
    """The setting that is the default but for its acuity model; None where none was measured."""
    for setting in record["settings"]:
        alone = setting["group"] == "acuity_model" or "default" in setting["marks"]
        if alone and setting["quality"]["acuity"]["model"] == model:
            found: Record = setting
            return found
    return None


def _table(record: Record) -> str:
    measures = [measure for measure in measured(record) if measure.key in MEASURES]
    heads = ["model", "holds up to", "cells", "of the pixels", "camera rays", "time [ms]"]
    rows = []
    for cost in record["acuity_models"]:
        setting = _setting(record, cost["model"])
        row = [
            f"{text(cost['model'])}<br><small>{text(cost['source'])}</small>",
            f"{cost['valid_deg']:g}°",
            f"{cost['cells']:,}",
            f"{100 * cost['cells_per_pixel']:.1f} %",
            f"{cost['camera_rays']:,}",
            "–" if setting is None else f"{setting['time_ms']['median']:,.1f}",
        ]
        for measure in measures:
            value = None if setting is None else setting["accuracy"].get(measure.key)
            row.append("–" if value is None else f"{value:.4g}")
        rows.append(row)
    return table([*heads, *(text(measure.name) for measure in measures)], rows)
