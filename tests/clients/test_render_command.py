"""`gazetrace render`: the frame it writes, and what it says of it."""

from __future__ import annotations

import json
import os
import re
import struct
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clients.command_line import main
from clients.command_line.render import write_whole
from renderer.codec import decode_texture
from tests.clients.commands import PATIENCE_S, SMALL, start
from tests.renderer.model_files import chunk, three_ds, three_ds_cube, three_ds_object

HURRIED_SCALE = 48.0
"""What is chosen for no time at all, by the rates that are assumed before any is learned: the first scale by which
tracing takes half as long as the rest of the frame."""

pytestmark = pytest.mark.usefixtures("plain_environment")

CUBE = """\
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
"""


def pixels_of(path: Path) -> np.ndarray:
    return decode_texture(path.read_bytes(), path.name).pixels


def test_render_says_what_the_frame_cost(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["render", "spheres", *SMALL, "--gaze", "20,30", "-o", "a.png"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    named = dict(line.split(maxsplit=1) for line in said.out.splitlines())
    assert named["frame"] == "a.png: 96x54 of spheres, gaze (20, 30)"
    assert re.match(r"[\d,]+ aligned, [\d.]+ % of the 5,184 pixels; 4 samples each", named["cells"])
    assert re.match(r"[\d,]+: [\d,]+ primary, [\d,]+ shadow, [\d,]+ reflection, [\d,]+ refraction$", named["rays"])
    assert {"shadows", "reflection", "refraction"} <= set(named["effects"].split(", "))
    assert re.match(r"[\d.,]+ ms map, [\d.,]+ ms trace, [\d.,]+ ms reconstruct, [\d.,]+ ms encode, ", named["time"])
    assert re.match(r"\d\.\d+ rms over the screen", named["error"])
    assert pixels_of(tmp_path / "a.png").shape == (54, 96, 3)


def test_render_prints_the_same_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "render",
        "matte",
        *SMALL,
        "--gaze",
        "-20,30.5",
        "--samples",
        "3",
        "--bucket",
        "8",
        "--json",
        "-o",
        "a.webp",
    ]
    assert main(words) == 0
    cost = json.loads(capsys.readouterr().out)
    assert (cost["scene"], cost["output"], cost["format"]) == ("matte", "a.webp", "webp")
    assert (cost["width"], cost["height"], cost["gaze"]) == (96, 54, {"x": -20.0, "y": 30.5})
    assert (cost["map"]["kind"], cost["map"]["bucket_px"], cost["map"]["cached"]) == ("aligned", 8, False)
    assert cost["cells_traced"] == cost["map"]["cells"] > 0
    assert cost["cells_reused"] == 0
    assert cost["rejected_samples"] == {"not_a_number": 0, "negative": 0, "too_bright": 0}
    assert cost["rays"] == {"primary": 3 * cost["map"]["cells"], "shadow": 0, "reflection": 0, "refraction": 0}
    assert cost["effects"] == []
    assert cost["error"]["rms"] >= 0
    assert all(ms >= 0 for ms in cost["timing_ms"].values())


def test_each_flag_reaches_the_frame(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    coarse = (*SMALL, "--screen-cm", "5", "--acuity-scale", "8", "--samples", "1", "--bucket", "0", "--gaze", "90,50")

    def cost(*flags: str) -> dict[str, Any]:
        assert main(["render", "spheres", *coarse, *flags, "--json", "-o", "a.png"]) == 0
        found = json.loads(capsys.readouterr().out)
        return {**found, "cells": found["map"]["cells"], "picture": (tmp_path / "a.png").read_bytes()}

    plain = cost()
    assert cost("--full")["cells"] == 96 * 54 > plain["cells"]
    assert cost("--map", "scanline")["map"]["kind"] == "scanline"
    assert cost("--samples", "2")["samples_per_cell"] == 2
    hurried = cost("--samples", "9", "--deadline-ms", "0.001")
    assert (hurried["deadline_met"], hurried["samples_per_cell"], hurried["acuity_scale"]) == (False, 1, HURRIED_SCALE)
    wished = cost("--samples", "9", "--max-error", "0.5")
    assert (wished["max_error"], wished["error_met"], wished["samples_per_cell"]) == (0.5, True, 2)
    assert (plain["max_error"], plain["error_met"]) == (None, None)
    assert (plain["deadline_ms"], plain["deadline_met"]) == (None, None)
    assert cost("--max-depth", "0")["rays"]["reflection"] == 0 < plain["rays"]["reflection"]
    assert cost("--effects=+textures,-reflection")["rays"]["reflection"] == 0
    assert cost("--effects=+textures,-reflection")["effect_reasons"]["textures"].startswith("2 triangles of")
    assert cost("--acuity-scale", "16")["cells"] < plain["cells"]
    assert cost("--screen-cm", "3")["cells"] < plain["cells"]
    assert cost("--screen-cm", "5x2")["picture"] != plain["picture"]
    assert cost("--distance-cm", "90")["cells"] < plain["cells"]
    assert cost("--margin-deg", "2")["cells"] > plain["cells"]
    assert cost("--bucket", "32")["cells"] != plain["cells"]
    assert cost("--gaze", "48,27")["cells"] != plain["cells"]
    assert cost("--acuity-model", "guenter")["cells"] != plain["cells"]
    far = ("--screen-cm", "5x3", "--distance-cm", "3")
    assert cost(*far, "--eccentricity", "paper")["cells"] != cost(*far)["cells"]
    assert cost("--antialiasing", "regular", "--samples", "4")["picture"] != cost("--samples", "4")["picture"]
    for flag, value in (("position", "3,2,7"), ("look-at", "1,1,0"), ("up", "1,1,0"), ("fov", "20")):
        assert cost(f"--camera-{flag}", value)["picture"] != plain["picture"], flag


def test_overlays_are_drawn_on_the_frame(tmp_path: Path) -> None:
    screen = ("--size", "320x180", "--acuity-scale", "4", "--gaze", "100,90", "--samples", "1")
    assert main(["render", "spheres", *screen, "-o", "plain.png"]) == 0
    plain = pixels_of(tmp_path / "plain.png")
    for overlay in ("cells", "rays", "roi", "gaze"):
        assert main(["render", "spheres", *screen, "--overlay", overlay, "-o", f"{overlay}.png"]) == 0
    gaze, cells, rays, rings = (pixels_of(tmp_path / f"{overlay}.png") for overlay in ("gaze", "cells", "rays", "roi"))
    assert 0 < (gaze != plain).any(axis=2).sum() < 200
    assert 0.3 < (cells != plain).any(axis=2).mean() < 1.0
    assert (rays != plain).any(axis=2).mean() > 0.9
    assert 0.005 < (rings != plain).any(axis=2).mean() < 0.2
    assert main(["render", "spheres", *screen, "--overlay", "cells", "--overlay", "gaze", "-o", "both.png"]) == 0
    both = pixels_of(tmp_path / "both.png")
    cross = (gaze != plain).any(axis=2)
    np.testing.assert_array_equal(both[cross], gaze[cross])
    np.testing.assert_array_equal(both[~cross], cells[~cross])


@pytest.mark.parametrize(
    ("suffix", "start"), [(".jpg", b"\xff\xd8\xff"), (".JPEG", b"\xff\xd8\xff"), (".webp", b"RIFF")]
)
def test_the_suffix_decides_the_format(suffix: str, start: bytes, tmp_path: Path) -> None:
    assert main(["render", "matte", *SMALL, "-o", f"a{suffix}"]) == 0
    assert (tmp_path / f"a{suffix}").read_bytes().startswith(start)
    assert [path.name for path in tmp_path.iterdir()] == [f"a{suffix}"], "nothing but the frame is left behind"


def test_a_new_frame_replaces_the_old_one_as_a_whole(tmp_path: Path) -> None:
    """Whoever has the old file keeps it: it is not written over, another takes its name."""
    (tmp_path / "a.png").write_bytes(b"old")
    os.link(tmp_path / "a.png", tmp_path / "kept")
    assert main(["render", "matte", *SMALL, "-o", "a.png"]) == 0
    assert (tmp_path / "kept").read_bytes() == b"old"
    assert pixels_of(tmp_path / "a.png").shape == (54, 96, 3)


def test_a_file_that_cannot_take_its_name_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(IsADirectoryError):
        write_whole(tmp_path / "taken", b"frame")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_shadow_samples_are_sent_to_a_light_with_a_size(capsys: pytest.CaptureFixture[str]) -> None:
    rays = []
    for number in ("2", "8"):
        assert (
            main(["render", "cornell", *SMALL, "--samples", "2", "--shadow-samples", number, "--json", "-o", "a.png"])
            == 0
        )
        rays.append(json.loads(capsys.readouterr().out)["rays"]["shadow"])
    assert 3 * rays[0] < rays[1] < 5 * rays[0]


def test_a_finished_command_leaves_no_thread_behind() -> None:
    before = set(threading.enumerate())
    assert main(["render", "matte", *SMALL, "-o", "a.png"]) == 0
    assert main(["bench", "matte", *SMALL, "--repeats", "1"]) == 0
    assert set(threading.enumerate()) <= before


def test_raw_is_float32_radiance(tmp_path: Path) -> None:
    assert main(["render", "matte", *SMALL, "-o", "a.raw"]) == 0
    radiance = np.fromfile(tmp_path / "a.raw", dtype="<f4")
    assert radiance.shape == (54 * 96 * 3,)
    assert np.isfinite(radiance).all()
    assert radiance.max() > 0


def test_a_bare_mesh_is_framed_and_lit(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "cube.obj").write_text(CUBE)
    assert main(["render", "cube.obj", *SMALL, "--full", "-o", "a.png"]) == 0
    assert "of cube.obj, gaze (48, 27)" in capsys.readouterr().out
    picture = pixels_of(tmp_path / "a.png").astype(int)
    middle = picture[27, 48]
    assert 20 < middle.mean() < 250, "lit, and not burnt out"
    assert np.abs(middle - picture[2, 2]).sum() > 20, "the cube stands out from what is around it"


def test_a_mesh_files_own_camera_and_light_are_used(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    spot = chunk(0x4600, struct.pack("<3f", 0.5, -9, 0.5), chunk(0x4610, struct.pack("<5f", 0.5, 0, 0.5, 30, 40)))
    behind = struct.pack("<8f", 0.5, 5, 0.5, 0.5, 0, 0.5, 0, 48)
    for name, camera in (("front", struct.pack("<8f", 0.5, -5, 0.5, 0.5, 0, 0.5, 0, 48)), ("back", behind)):
        content = (("Lamp", spot), ("Eye", chunk(0x4700, camera)), ("Box", three_ds_cube()))
        (tmp_path / f"{name}.3ds").write_bytes(three_ds(*(three_ds_object(*each) for each in content)))
        assert main(["render", f"{name}.3ds", *SMALL, "--full", "-o", f"{name}.png"]) == 0
        note = f"gazetrace: note: {name}.3ds: a spot light is shown as one that lights to all sides\n"
        assert capsys.readouterr().err == note
    lit, dark = (pixels_of(tmp_path / f"{name}.png")[27, 48].mean() for name in ("front", "back"))
    assert lit > 1.5 * dark, "the lamp stands on the side that the first camera sees"


def test_a_scene_folder_is_a_scene_by_path_and_by_name(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = tmp_path / "mine" / "cube"
    folder.mkdir(parents=True)
    (folder / "cube.obj").write_text(CUBE)
    (folder / "scene.toml").write_text(SCENE_TOML)
    assert main(["render", "mine/cube", *SMALL, "-o", "path.png"]) == 0
    assert main(["render", "cube", "--scenes-folder", "mine", *SMALL, "-o", "name.png"]) == 0
    assert (tmp_path / "path.png").read_bytes() == (tmp_path / "name.png").read_bytes()
    capsys.readouterr()
    assert main(["scenes", "--scenes-folder", "mine"]) == 0
    assert "cube" in capsys.readouterr().out.split()


SCENE_TOML = """\
title = "A cube"
[[mesh]]
file = "cube.obj"
"""


def test_two_processes_write_the_same_bytes_on_any_number_of_threads(tmp_path: Path) -> None:
    for name, threads in (("one.png", "1"), ("all.png", "3")):
        process = start("render", "spheres", *SMALL, "--gaze", "10,20", "--threads", threads, "-o", name)
        assert process.wait(PATIENCE_S) == 0
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "all.png").read_bytes()
