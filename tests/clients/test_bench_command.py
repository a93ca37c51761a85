"""`gazetrace bench`: a frame against bare Embree."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from clients.command_line import main
from renderer.effect_choice import EFFECTS
from tests.clients.commands import SMALL, failing

pytestmark = pytest.mark.usefixtures("plain_environment")


def test_bench_compares_a_frame_with_bare_embree(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "matte", *SMALL, "--repeats", "2", "--threads", "3", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["threads"] == 3
    assert (record["width"], record["height"], record["samples_per_cell"]) == (96, 54, 1)
    assert record["rays"]["primary"] == record["map"]["cells"] > 0
    figures = {figure["name"]: figure for figure in record["figures"]}
    assert figures["whole frame / bare Embree"]["unit"] == "ratio"
    assert all(0 < figure["low"] <= figure["median"] <= figure["high"] for figure in figures.values())
    assert main(["bench", "matte", *SMALL, "--repeats", "2"]) == 0
    text = capsys.readouterr().out
    assert all(re.search(rf"^{re.escape(name)} +[\d.]+ +[\d.]+ +[\d.]+", text, re.MULTILINE) for name in figures)


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
