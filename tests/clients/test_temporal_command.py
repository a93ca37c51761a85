"""`gazetrace accuracy --temporal`: what it finds of a gaze that moves, writes and says."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from clients.command_line import main
from clients.command_line.accuracy_temporal import LOG
from tests.clients.accuracy_record import record, write_measurement
from tests.clients.commands import failing

pytestmark = pytest.mark.usefixtures("plain_environment")

RECORDING = Path(__file__).parents[3] / "shared" / "data" / "gaze" / "irf_S1_500hz.csv"
SMALL = ("--temporal", "--size", "96x54")


@pytest.mark.skipif(not RECORDING.exists(), reason="the recorded gaze is not beside this checkout")
def test_a_recorded_eye_flickers_least_with_aligned_cells(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The first second of it, with saccades and a blink, on a part of the recorded screen that the gaze is off, so that
    cells are wider than pixels.
    """
    words = ("spheres", "--temporal", "--gaze-trace", str(RECORDING), "--seconds", "1", "--size", "240x136")
    assert main(["accuracy", *words, "--screen-cm", "6.66x3.79", "--distance-cm", "56.5", "-o", "found", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads((tmp_path / "found" / "temporal.json").read_text())
    assert (report["scene"], report["display"]["height_cm"], report["gaze_trace"]) == ("spheres", 3.79, str(RECORDING))
    gazes = [(gaze["x"], gaze["y"]) for gaze in report["gazes"]]
    assert len(gazes) == 25
    assert gazes[0] == pytest.approx((962.78, 836.80), abs=0.01)
    assert gazes[12] == gazes[13] == gazes[14]
    ways = {way["way"]: way for way in report["ways"]}
    scanline, aligned, steady = ways.values()
    assert list(ways) == ["scanline", "aligned", "aligned with hysteresis"]
    for way in ways.values():
        assert way["steps"] == 24 == len(way["step_changes"])
        assert way["change"] == pytest.approx(sum(way["step_changes"]) / 24)
        assert way["kept_cells_change"] == 0
    assert scanline["map_changes"] == aligned["map_changes"] > 0
    assert steady["map_changes"] <= aligned["map_changes"]
    assert 0 < aligned["change"] < scanline["change"]
    with (tmp_path / "found" / "temporal.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    assert [(row["way"], float(row["change"])) for row in rows] == [
        (way["way"], way["change"]) for way in ways.values()
    ]


def test_the_table_and_the_section_of_the_page(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """A folder that holds a measurement of the scene gets its page made again."""
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    write_measurement(tmp_path / "found", record())
    (tmp_path / "eye.csv").write_text("t_ms,x_fraction,y_fraction\n0,0.2,0.3\n40,0.7,0.6\n80,0.7,0.6\n120,0.7,0.6\n")
    words = ("matte", *SMALL, "--gaze-trace", "eye.csv", "-o", "found")
    assert main(["accuracy", *words]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "matte, 96x54, 4 samples a cell: 2 steps of gaze (eye.csv), 25 a second"
    assert [line[:26].strip() for line in lines[3:6]] == ["scanline", "aligned", "aligned with hysteresis"]
    assert [line.split()[-2] for line in lines[3:6]] == ["1", "1", "1"]
    assert lines[-3:] == ["found/report.html", "found/temporal.json", "found/temporal.csv"]
    assert main(["accuracy", *words, "--no-report", "--seconds", "0.2"]) == 0
    said = capsys.readouterr().out
    assert said.endswith("\nfound/temporal.json\nfound/temporal.csv\n")
    assert "report.html" not in said
    assert len(json.loads((tmp_path / "found" / "temporal.json").read_text())["gazes"]) == 5


def test_a_walk_that_was_stopped_goes_on(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """What is left of the first run: all steps of one way, one of the next, half a line."""
    words = ["accuracy", "matte", *SMALL, "--seconds", "0.2", "--no-report", "--json", "-o", "found"]
    assert main(words) == 0
    whole = json.loads(capsys.readouterr().out)
    log = tmp_path / "found" / LOG
    kept = log.read_bytes()
    lines = kept.splitlines(keepends=True)
    assert len(lines) == 1 + 3 * 4
    log.write_bytes(b"".join(lines[:6]) + lines[6][:30])
    assert main(words) == 0
    said = capsys.readouterr()
    assert (json.loads(said.out)["ways"], said.err) == (whole["ways"], "")
    assert log.read_bytes() == kept
    stated = json.loads(lines[1])
    stated["step"]["change"] = 0.5
    log.write_bytes(b"".join([lines[0], json.dumps(stated).encode() + b"\n", *lines[2:]]))
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["ways"][0]["step_changes"][0] == 0.5, "what is there is not measured"
    assert main([*words, "--seconds", "0.16", "--size", "97x54"]) == 0
    said = capsys.readouterr()
    assert said.err == "gazetrace: found held a walk of another request (size, screen, gazes): starting over\n"
    assert len(log.read_bytes().splitlines()) == 1 + 3 * 3


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--temporal", "--gaze", "1,2"), "--gaze: expected none with --temporal, whose gaze is that of --gaze-trace"),
        (("--gaze-trace", "simulated"), "--gaze-trace: expected --temporal with it"),
        (("--temporal", "--gaze-trace", "none.csv"), "--gaze-trace: expected a file or the word simulated, found no"),
        (("--temporal", "--seconds", "0.04"), "--seconds: expected time for 2 to 10000 gazes, found 1 in 0.04 s"),
        (("--temporal", "--seconds", "401"), "--seconds: expected time for 2 to 10000 gazes, found 10025 in 401 s"),
    ],
)
def test_bad_usage_is_one_line_and_status_2(
    words: tuple[str, ...], complaint: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert complaint in failing(capsys, "accuracy", "matte", *words, "-o", "found")
    assert list(tmp_path.iterdir()) == []
