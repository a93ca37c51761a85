"""The record of a measurement is JSON of the agreed shape, comes back as it was, and is a table."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from typing import Any

import pytest

from renderer.accuracy.record import read_report, report_json
from renderer.accuracy.table import csv_text
from renderer.errors import SettingsError
from tests.renderer.accuracy.examples import NEAR, REPORT


def test_a_report_comes_back_as_it_was() -> None:
    assert read_report(report_json(REPORT)) == REPORT


def test_the_file_has_the_fields_that_its_readers_rely_on() -> None:
    values = json.loads(report_json(REPORT))
    assert list(values) == [
        "version", "command", "made", "machine", "scene", "triangles", "spheres", "effects", "display", "gaze",
        "camera", "reference", "settings", "acuity_models",
    ]  # fmt: skip
    assert values["machine"]["packages"] == {"numpy": "2.4.6"}
    assert values["gaze"] == {"x": -20.0, "y": 18.5}
    assert values["display"] == {
        "width_px": 64, "height_px": 36, "width_cm": 50.0, "height_cm": None, "distance_cm": 60.0,
    }  # fmt: skip
    assert values["reference"]["standard_error"] == {"rms": 0.002, "foveal_rms": None}
    near, far = values["settings"]
    assert list(near) == [
        "id", "label", "group", "marks", "quality", "effects", "cells", "samples_per_cell", "rays", "time_ms",
        "stated_error", "accuracy", "frame", "error_map",
    ]  # fmt: skip
    assert near["rays"] == {"primary": 8000, "shadow": 9000, "reflection": 700, "refraction": 0}
    assert list(near["time_ms"]) == ["median", "low", "high", "repeats", "map", "trace", "reconstruct"]
    assert list(near["accuracy"]) == [
        "luminance_ratio", "relative_mse", "rms", "foveal_psnr_db", "foveal_max_error", "foveal_rms", "flip_mean",
        "flip_p99", "jod", "jod_heat_foveal_p99",
    ]  # fmt: skip
    assert far["accuracy"]["foveal_psnr_db"] is None
    assert far["quality"]["effects"] == ["-shadows"]
    assert far["quality"]["acuity"]["scale"] == 2.0


def test_no_number_of_the_file_is_none() -> None:
    broken = replace(REPORT, settings=(replace(NEAR, accuracy=replace(NEAR.accuracy, rms=float("nan"))),))
    with pytest.raises(ValueError, match="not JSON compliant"):
        report_json(broken)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda values: values.pop("gaze"), "AccuracyReport.gaze: expected it"),
        (lambda values: values.update(triangles="12"), "AccuracyReport.triangles: expected int, found '12'"),
        (lambda values: values.update(settings=3), "AccuracyReport.settings: expected"),
        (lambda values: values["settings"][0]["time_ms"].update(median=True), "time_ms.median: expected float"),
        (lambda values: values["settings"][1]["quality"]["acuity"].pop("model"), "quality.acuity.model: expected it"),
    ],
)
def test_what_is_no_report_is_refused_by_field(change: Any, message: str) -> None:
    values = json.loads(report_json(REPORT))
    change(values)
    with pytest.raises(ValueError, match=message):
        read_report(json.dumps(values))


def test_settings_of_a_file_are_in_range() -> None:
    values = json.loads(report_json(REPORT))
    values["settings"][0]["quality"]["samples_per_cell"] = 0
    with pytest.raises(SettingsError, match="samples_per_cell"):
        read_report(json.dumps(values))


def test_the_table_has_a_line_for_each_setting() -> None:
    near, far = csv.DictReader(io.StringIO(csv_text(REPORT.settings)))
    assert (near["id"], near["label"], near["marks"]) == ("aligned-4", "aligned, 4 samples", "default")
    assert (near["time_ms.median"], near["time_ms.repeats"]) == ("20.0", "31.0 18.5 20.0")
    assert (near["accuracy.jod"], far["accuracy.jod"]) == ("9.7", "")
    assert (far["quality.acuity.scale"], far["quality.effects"], far["effects"]) == ("2.0", "-shadows", "")
