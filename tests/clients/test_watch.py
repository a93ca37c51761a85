"""`gazetrace watch` against real services: its own, one that runs, and none."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from clients.command_line import main
from clients.latency import STAGES
from renderer.pipeline import Renderer
from service.settings import Settings
from tests.clients.commands import failing
from tests.service.conftest import serving

pytestmark = pytest.mark.usefixtures("plain_environment")

SMALL = ("--size", "64x36", "--samples", "2", "--acuity-scale", "8", "--bucket", "1")
EYE = ("--gaze-trace", "simulated", "--seconds", "1.2")
TOKEN = "a-long-secret"


def test_it_reports_every_stage_of_the_way(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["watch", "matte", "--url", address, *SMALL, *EYE, "--rate", "50", "--json"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    record = json.loads(said.out)
    assert (record["scene"], record["width"], record["height"], record["format"]) == ("matte", 64, 36, "jpeg")
    assert record["gazes_a_second"] == 50
    assert record["seconds"] == pytest.approx(1.2, abs=0.6)
    assert record["frames"] >= record["frames_for_newer_gaze"] > 0
    assert set(record["latency_ms"]) == {"total", *STAGES}
    total = record["latency_ms"]["total"]
    assert 0 < total["p50"] <= total["p95"] <= total["p99"] <= total["max"]
    assert record["latency_ms"]["map"]["max"] > 0
    assert record["latency_ms"]["decode"]["max"] > 0
    assert set(record["share_past_ms"]) == {"50", "70"}
    assert record["mean_image_bytes"] > 100
    assert record["dropped"] >= 0
    assert record["superseded"] >= 0


def test_people_get_a_table(address: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """A recording with a blink; the camera of the command line; frames that are not decoded."""
    lines = [f"{40 * i},{3 * i},{i},{int(i % 6 != 3)},saccade" for i in range(20)]
    (tmp_path / "eye.csv").write_text("\n".join(["t_ms,x,y,valid,event", *lines]))
    words = ("--gaze-trace", "eye.csv", "--no-decode", "--camera-fov", "20", "--budget-ms", "p50=60000")
    assert main(["watch", "matte", "--url", address, *SMALL, *words, "--format", "webp"]) == 0
    text = capsys.readouterr().out
    assert re.search(r"^matte, 64x36 webp, [\d,]+ kB a frame; 60 gazes a second for \d+\.\d s$", text, re.MULTILINE)
    assert re.search(r"^from gaze to frame \[ms\] +p50 +p95 +p99 +max$", text, re.MULTILINE)
    for stage in ("total", *(f"  {stage}" for stage in STAGES)):
        assert re.search(rf"^{stage} +[-\d.]+ +[-\d.]+ +[-\d.]+ +[-\d.]+$", text, re.MULTILINE), stage
    assert re.search(r"^  decode +0\.0 +0\.0 +0\.0 +0\.0$", text, re.MULTILINE)
    assert re.search(
        r"^of [\d,]+ frames for a newer gaze: [\d.]+ % past 50 ms, [\d.]+ % past 70 ms$", text, re.MULTILINE
    )


def test_a_budget_that_is_missed_fails(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("watch", "matte", "--url", address, *SMALL, *EYE, "--json")
    assert main([*words, "--budget-ms", "p95=0.001", "--budget-ms", "max=60000"]) == 1
    said = capsys.readouterr()
    assert json.loads(said.out)["frames"] > 0
    assert re.fullmatch(r"gazetrace: p95 from gaze to frame: expected at most 0\.001 ms, found [\d.]+ ms\n", said.err)


def test_without_an_address_it_starts_a_service_of_its_own(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["watch", "matte", *SMALL, *EYE, "--threads", "2", "--json"]) == 0
    said = capfd.readouterr()
    assert json.loads(said.out)["frames_for_newer_gaze"] > 0
    assert said.err == "", "and it ends without a word"


def test_the_token_comes_from_the_environment(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with serving(Settings(port=0, token=TOKEN), renderer) as address:
        words = ("watch", "matte", "--url", address, *SMALL, *EYE)
        assert "token" in failing(capsys, *words)
        monkeypatch.setenv("GAZETRACE_TOKEN", TOKEN)
        assert main(list(words)) == 0


def test_what_the_service_refuses_is_one_line(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = failing(capsys, "watch", "sphres", "--url", address, *EYE)
    assert said.startswith("gazetrace: unknown scene 'sphres': the scenes are ")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ((), "required: --gaze-trace"),
        ((*EYE, "--rate", "0"), "--rate: expected a number in (0, 2000], found 0"),
        ((*EYE, "--rate", "nan"), "--rate: expected a number in (0, 2000], found nan"),
        ((*EYE, "--budget-ms", "p95"), "--budget-ms: expected one of p50, p95, p99, max and milliseconds"),
        ((*EYE, "--budget-ms", "p90=3"), "such as p95=70, found 'p90=3'"),
        ((*EYE, "--url", "lab:8321"), "--url: expected an address such as http://127.0.0.1:8321, found"),
        ((*EYE, "--url", "http://a", "--threads", "2"), "--threads: expected no --url"),
        ((*EYE, "--samples", "0"), "--samples: expected an integer from 1"),
        ((*EYE, "--format", "gif"), "--format: invalid choice: 'gif'"),
    ],
)  # fmt: skip
def test_bad_usage_is_one_line_and_status_2(
    words: tuple[str, ...], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert complaint in failing(capsys, "watch", "matte", *words)


def test_a_service_that_does_not_start_is_one_line(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["watch", "matte", *SMALL, *EYE, "--scenes-folder", str(tmp_path / "none")]) == 1
    said = capfd.readouterr().err.splitlines()
    assert "scenes-folder" in said[0]
    assert said[1:] == ["gazetrace: the service did not start"]
