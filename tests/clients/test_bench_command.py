"""`gazetrace bench`: its rows, what effects cost, how time grows."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from clients.command_line import main
from clients.command_line.peers.mitsuba_scene import has_mitsuba
from clients.command_line.peers.povray import find_povray
from renderer.effect_choice import EFFECTS
from tests.agreement.comparison import require
from tests.clients.commands import SMALL, failing

pytestmark = pytest.mark.usefixtures("plain_environment")


def test_bench_measures_the_rows_that_are_asked_for(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ["bench", "spheres", *SMALL, "--repeats", "2", "--many", "3", "--threads", "3"]
    words += ["--only", "frame,stages,samples,paper,pixels,threads", "-o", "bench.json"]
    assert main(words) == 0
    text = capsys.readouterr().out
    record = json.loads((tmp_path / "bench.json").read_text())
    assert (record["scene"], record["threads"]) == ("spheres", 3)
    assert (record["width"], record["height"], record["samples_per_cell"]) == (96, 54, 1)
    assert record["machine"]["processor"] in text
    rows = {row["what"]: row for row in record["rows"]}
    assert rows["whole frame / bare Embree"]["unit"] == "ratio"
    assert "whole frame / bare Embree, 3 samples" in rows
    assert "trace at 270x195 / 96x54" in rows
    assert {"map / its bytes copied", "trace / its rays in packets", "encode, 20 px further"} <= set(rows)
    assert list(dict.fromkeys(row["group"] for row in record["rows"])) == [
        "frame", "stages", "samples", "paper", "pixels", "threads",
    ]  # fmt: skip
    for what, row in rows.items():
        numbers = r" +([\d,.]+|-)" * 3
        assert re.search(rf"^{re.escape(what)}{numbers}", text, re.MULTILINE)
        if row["median"] is not None:
            assert 0 < row["low"] <= row["median"] <= row["high"]


def test_peers_that_are_not_there_say_so(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.command_line.benchmark.peer_rows.has_mitsuba", lambda: False)
    monkeypatch.setattr("clients.command_line.benchmark.peer_rows.find_povray", lambda: None)
    assert main(["bench", "spheres", *SMALL, "--only", "peers", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert len(rows) == 3
    assert all(row["median"] is None and row["met"] is None for row in rows)
    assert [row["note"].partition(":")[0] for row in rows] == ["not installed"] * 3


def test_peers_trace_our_scene(capsys: pytest.CaptureFixture[str]) -> None:
    require(has_mitsuba() and find_povray() is not None, "Mitsuba and POV-Ray")
    assert main(["bench", "spheres", *SMALL, "--only", "peers", "--repeats", "1", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert "Mitsuba 3 / tracing our rays alone, 1 a pixel" in [row["what"] for row in rows]
    assert all(row["median"] > 0 for row in (rows[0], rows[1], rows[-1]))


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc, as Linux has it")
def test_the_memory_of_a_stream_is_watched(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["bench", "matte", *SMALL, "--only", "memory", "--stream-frames", "4", "--threads", "2", "--json"]
    assert main(words) == 0
    most, growth = json.loads(capsys.readouterr().out)["rows"]
    assert 50 < most["median"] < 5000
    assert 0.8 < growth["median"] < 1.5


def test_growth_is_saved_and_drawn(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("clients.command_line.benchmark.growth.SCREEN", (32, 18))
    monkeypatch.setattr("clients.command_line.benchmark.growth.SCREENS", ((32, 18), (64, 36)))
    assert main(["bench", "matte", "--growth", "grown", "--triangles", "10000", "--repeats", "1"]) == 0
    text = capsys.readouterr().out
    record = json.loads((tmp_path / "grown" / "growth.json").read_text())
    assert len(record["series"]) == 5
    for series in record["series"]:
        assert f"{series['name']}: time grows with exponent {series['time']['exponent']:.2f}" in text
    assert (tmp_path / "grown" / "growth.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "grown" / "growth.svg").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--repeats", "0"), "--repeats: expected an integer from 1 to 1000, found 0"),
        (("--many", "0"), "--many: expected an integer from 1 to 4096, found 0"),
        (("--growth", "grown", "--triangles", "9"), "--triangles: expected an integer from 10000 to 10000000, found 9"),
        (("-o", "nowhere/bench.json"), "--output: expected a file in an existing folder, found 'nowhere/bench.json'"),
    ],
)
def test_numbers_out_of_range_are_refused_at_once(
    capsys: pytest.CaptureFixture[str], words: tuple[str, ...], said: str
) -> None:
    assert said in failing(capsys, "bench", "matte", *words)


def test_bench_tells_what_each_effect_costs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "spheres", *SMALL, "--effect-costs", "--repeats", "2", "--json"]) == 0
    costs = json.loads(capsys.readouterr().out)["costs"]
    assert costs[0]["choice"] == []
    assert (costs[0]["ratio"], costs[0]["low"], costs[0]["high"]) == (1.0, 1.0, 1.0)
    assert len(costs[1]["choice"]) == len(EFFECTS)
    assert costs[1]["rays"] > costs[0]["rays"]
    without = {cost["choice"][0]: cost["rays"] for cost in costs[2:]}
    assert set(without) == {"-textures", "-specular", "-shadows", "-reflection", "-refraction"}
    assert max(without["-shadows"], without["-reflection"], without["-refraction"]) < costs[0]["rays"]
    assert all(cost["ms"] >= 0 for cost in costs)
    assert main(["bench", "matte", *SMALL, "--effect-costs", "--repeats", "1"]) == 0
    assert capsys.readouterr().out.splitlines()[2].startswith("every effect forced on")


def test_bench_needs_triangles(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "ball").mkdir()
    (tmp_path / "ball" / "scene.toml").write_text("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n")
    assert "ball: expected a scene with triangles" in failing(capsys, "bench", "ball")
