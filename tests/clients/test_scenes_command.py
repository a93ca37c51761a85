"""`gazetrace scenes`: what there is to render, and what each scene calls for."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from clients.command_line import main

pytestmark = pytest.mark.usefixtures("plain_environment")


def test_scenes_lists_the_built_in_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenes"]) == 0
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert names == ["spheres", "cornell", "atrium", "gallery", "matte"]


def test_a_scene_says_why_it_needs_its_effects(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenes", "spheres"]) == 0
    text = capsys.readouterr().out
    assert re.search(r"refraction: .*sphere.* of material ", text)
    assert re.search(r"[\d,]+ triangles, \d+ spheres, \d+ lights", text)
    assert main(["scenes", "matte", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["effects"] == []
    assert record["triangles"] > 0
    assert len(record["camera"]["position"]) == 3


def test_one_broken_scene_does_not_hide_the_others(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "mine" / "torn").mkdir(parents=True)
    (tmp_path / "mine" / "torn" / "scene.toml").write_text("colour = 3\n")
    assert main(["scenes", "--scenes-folder", "mine", "--effects", "--json"]) == 0
    records = {record["id"]: record for record in json.loads(capsys.readouterr().out)}
    assert "scene.toml" in records["torn"]["error"]
    assert records["atrium"]["triangles"] >= 300_000
    assert main(["scenes", "--scenes-folder", "mine", "--effects"]) == 0
    text = capsys.readouterr().out
    assert re.search(r"^torn +cannot be loaded: .*scene\.toml", text, re.MULTILINE)
    assert re.search(r"^matte +Matte.*\n +[\d,]+ triangles, \d+ spheres; no effects$", text, re.MULTILINE)
