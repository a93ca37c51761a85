"""`gazetrace accuracy`: what it finds, writes and says; a measurement that was stopped goes on."""

from __future__ import annotations

import csv
import json
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clients.command_line import main
from clients.command_line.accuracy_folder import LOG, AccuracyFolder
from clients.command_line.accuracy_text import COLUMNS, accuracy_text, pareto_best
from clients.command_line.errors import UsageError
from renderer.accuracy.record import read_report
from renderer.acuity import MODELS
from renderer.codec import decode_texture
from tests.clients.commands import failing, interrupted
from tests.renderer.accuracy.examples import FAR, NEAR, REPORT

pytestmark = pytest.mark.usefixtures("plain_environment")

TINY = ("--quick", "--size", "48x27", "--reference-samples", "6", "--repeats", "2", "--no-report")


def measured(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    """What the command prints as JSON."""
    assert main(["accuracy", *words, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def log_of(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / LOG).read_text().splitlines()]


def without_times(report: dict[str, Any]) -> list[dict[str, Any]]:
    return [{name: value for name, value in setting.items() if name != "time_ms"} for setting in report["settings"]]


def test_everything_that_was_found_is_in_the_folder(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    report = measured(capsys, "spheres", *TINY, "--gaze", "10,20", "--screen-cm", "30x20", "-o", "found")
    folder = tmp_path / "found"
    assert sorted(path.name for path in folder.iterdir()) == ["accuracy.csv", "accuracy.json", "frames", LOG]
    text = (folder / "accuracy.json").read_text()
    assert json.loads(text) == report
    assert read_report(text).settings[0].marks == ("default",)
    assert (report["scene"], report["gaze"]) == ("spheres", {"x": 10.0, "y": 20.0})
    assert (report["display"]["width_px"], report["display"]["height_cm"]) == (48, 20.0)
    assert report["command"].startswith("gazetrace accuracy spheres --quick --size 48x27 ")
    assert report["reference"]["samples"] == 6
    names = {path.name for path in (folder / "frames").iterdir()}
    assert names == {"reference.png"} | {
        f"{setting['id']}{end}" for setting in report["settings"] for end in (".png", "-error.png")
    }
    with (folder / "accuracy.csv").open() as lines:
        assert [row["id"] for row in csv.DictReader(lines)] == [setting["id"] for setting in report["settings"]]
    for setting in report["settings"]:
        assert len(setting["time_ms"]["repeats"]) == 2
        assert setting["rays"]["primary"] == pytest.approx(setting["cells"] * setting["samples_per_cell"])
        assert setting["accuracy"]["flip_mean"] is None or 0.0 <= setting["accuracy"]["flip_mean"] <= 1.0
    groups = {setting["group"] for setting in report["settings"]}
    assert groups >= {"samples", "map", "acuity_scale", "effects", "max_depth"}


def test_each_acuity_model_costs_what_its_setting_does(capsys: pytest.CaptureFixture[str]) -> None:
    """The gaze is off a screen so fine that cells are wider than pixels."""
    words = ("--screen-cm", "1.3x0.8", "--gaze=-600,20", "--repeats", "1", "-o", "found")
    report = measured(capsys, "matte", *TINY, *words)
    models = {cost["model"]: cost for cost in report["acuity_models"]}
    assert tuple(models) == MODELS
    compared = [
        setting for setting in report["settings"] if setting["group"] == "acuity_model" or "default" in setting["marks"]
    ]
    assert len(compared) == 3
    for setting in compared:
        cost = models[setting["quality"]["acuity"]["model"]]
        assert (cost["cells"], cost["camera_rays"]) == (setting["cells"], setting["rays"]["primary"])
        assert cost["cells"] < 48 * 27


def test_each_picture_is_the_frame_that_render_makes(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    measured(capsys, "matte", *TINY, "-o", "found")
    assert main(["render", "matte", "--size", "48x27", "--map", "scanline", "-o", "one.png"]) == 0
    found, one = (
        decode_texture((tmp_path / path).read_bytes(), path).pixels
        for path in ("found/frames/scanline-4.png", "one.png")
    )
    assert np.abs(found.astype(int) - one).max() <= 1, "rounded from linear radiance"
    assert (found != one).mean() < 1e-3


def test_a_measurement_that_was_stopped_goes_on(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """What is left of the first run: the reference, some settings, one without its picture, half a line."""
    words = ("matte", *TINY, "-o", "found")
    whole = measured(capsys, *words)
    log = tmp_path / "found" / LOG
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:6]) + lines[6][:30])
    (tmp_path / "found" / "frames" / "aligned-4.png").unlink()
    again = measured(capsys, *words)
    assert without_times(again) == without_times(whole)
    records = log_of(tmp_path / "found")
    assert len([record for record in records if "reference" in record]) == 2, "its radiance was gone"
    assert len([record for record in records if "times" in record]) == 2 * len(whole["settings"])
    third = measured(capsys, *words)
    assert third["settings"] == again["settings"], "nothing was left to measure"
    assert log_of(tmp_path / "found") == records


def test_more_repeats_go_on_from_fewer(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    first = measured(capsys, "matte", *TINY, "-o", "found")
    more = measured(capsys, "matte", *TINY, "--repeats", "3", "-o", "found")
    for before, after in zip(first["settings"], more["settings"], strict=True):
        assert after["time_ms"]["repeats"][:2] == before["time_ms"]["repeats"]
        assert len(after["time_ms"]["repeats"]) == 3


def test_another_request_starts_over_and_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    before = measured(capsys, "matte", *TINY, "-o", "found")
    (tmp_path / "found" / "frames" / "mine.png").write_bytes(b"mine")
    assert main(["accuracy", "matte", *TINY, "--gaze", "1,2", "--reference-samples", "7", "-o", "found"]) == 0
    said = capsys.readouterr()
    expected = "gazetrace: found held a measurement of another request (gaze, reference): starting over\n"
    assert said.err == expected
    assert len(log_of(tmp_path / "found")) == 2 + 3 * len(before["settings"])
    assert (tmp_path / "found" / "frames" / "mine.png").exists()


def test_ctrl_c_loses_the_frame_in_work_at_most(tmp_path: Path) -> None:
    """Standard error is a terminal here: the fourth setting is done when the progress says so."""
    words = ("spheres", "--quick", "--size", "160x90", "--reference-samples", "4", "--repeats", "900", "-o", "found")
    seen = interrupted(rb"timing settings in turn[^\r]*\b([4-9]|\d\d+)/", "accuracy", *words)
    stopped = re.search(rb"stopped with (\d+) of \1 settings compared and (\d+) of \d+ timed; the same command", seen)
    assert stopped is not None, seen
    records = log_of(tmp_path / "found")
    assert len([record for record in records if "times" in record]) == int(stopped[2]) >= 4
    assert len([record for record in records if "measured" in record]) == int(stopped[1])


def test_two_measurements_never_share_a_folder(tmp_path: Path) -> None:
    with (
        AccuracyFolder(tmp_path / "found", {"scene": "matte"}),
        pytest.raises(UsageError, match="found: expected no other run at work there"),
        AccuracyFolder(tmp_path / "found", {"scene": "matte"}),
    ):
        pytest.fail("a second run began")


def test_the_page_is_written_where_it_can_be_drawn(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    drawn = [word for word in TINY if word != "--no-report"]
    assert main(["accuracy", "matte", *drawn, "--repeats", "1", "-o", "found"]) == 0
    assert "found/report.html\nfound/accuracy.json\nfound/accuracy.csv\n" in capsys.readouterr().out
    assert (tmp_path / "found" / "report.html").stat().st_size > 10_000
    assert (tmp_path / "found" / "accuracy.svg").exists()


def test_the_table_is_by_time_and_marks_what_nothing_beats() -> None:
    lines = accuracy_text(REPORT, [Path("a/accuracy.json")]).splitlines()
    assert lines[0].startswith("spheres, 64x36, gaze (-20, 18.5): 2 settings, median of 3 on 2 threads of a processor")
    assert lines[1].startswith("reference: 256 samples a pixel in 12.5 s, standard error 0.002 rms: 0.065 of the small")
    heads, fast, slow = (line.split() for line in lines[3:6])
    assert heads[:2] == ["time", "[ms]"]
    assert fast == ["no", "shadows", "5.0", "0", "%", "0.00", "0.4000*", "0.5000*"]
    assert slow[:4] == ["aligned,", "4", "samples", "[default]"]
    assert slow[4:8] == ["20.0", "62", "%", "0.02"]
    assert slow[8:] == ["0.0310*", "0.0190*", "0.0040*", "41.5*", "0.200*", "0.0500*", "9.700*"]
    assert lines[-1] == "a/accuracy.json"


def test_what_is_beaten_by_something_as_fast_is_not_best() -> None:
    by_heading = {column.heading: column for column in COLUMNS}
    column, quality = by_heading["rel. MSE"], by_heading["JOD"]
    beaten = replace(NEAR, id="beaten", accuracy=replace(NEAR.accuracy, relative_mse=0.0041, jod=9.6))
    assert pareto_best([beaten, NEAR, FAR], column) == {"aligned-4", "no-shadows"}
    assert pareto_best([beaten, NEAR, FAR], quality) == {"aligned-4"}


def test_without_the_metrics_packages_it_says_what_to_install(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    monkeypatch.setitem(sys.modules, "pyfvvdp", None)
    assert main(["accuracy", "matte", *TINY, "--repeats", "1", "-o", "found"]) == 0
    said = capsys.readouterr().out
    assert "pip install 'gazetrace[report]'" in said
    assert "the extra 'quality'" in said
    assert "FLIP " not in said.splitlines()[3]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ((), "required: -o/--output"),
        (("-o", "no/found"), "--output: expected a place in an existing folder, found 'no/found'"),
        (("-o", "file"), "--output: expected a folder, found the file 'file'"),
        (("-o", "a", "--repeats", "0"), "--repeats: expected an integer from 1 to 1000, found 0"),
        (("-o", "a", "--reference-samples", "1"), "--reference-samples: expected an integer from 2 to 2048, found 1"),
        (("-o", "a", "--size", "0x9"), "--size: expected an integer from 1"),
        (("-o", "a", "--samples", "3"), "unrecognized arguments: --samples 3"),
        (("-o", "a", "--threads", "0"), "--threads: expected an integer from 1"),
    ],
)
def test_bad_usage_is_one_line_and_status_2(
    words: tuple[str, ...], complaint: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    before = sorted(tmp_path.iterdir())
    assert complaint in failing(capsys, "accuracy", "matte", *words)
    assert sorted(tmp_path.iterdir()) == before
