"""The command `gazetrace`: what it prints, what it writes, how it fails."""

from __future__ import annotations

import argparse
import json
import os
import pty
import re
import select
import shlex
import signal
import struct
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clients.command_line import build_parser, main
from clients.command_line.frame_flags import FLAG_OF_FIELD
from clients.command_line.render import write_whole
from clients.command_line.serve import flag_of, setting_texts, settings_of
from renderer.codec import decode_texture
from renderer.effect_choice import EFFECTS
from service.settings import Settings
from tests.clients.commands import PATIENCE_S, failing, start
from tests.renderer.model_files import chunk, three_ds, three_ds_cube, three_ds_object

pytestmark = pytest.mark.usefixtures("plain_environment")

COMMANDS = ("serve", "render", "scenes", "bench", "animate", "watch", "bridge")
SMALL = ("--size", "96x54")
RENDER = ("render", "spheres", "-o", "a.png")
CUBE = """\
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
"""


def pixels_of(path: Path) -> np.ndarray:
    return decode_texture(path.read_bytes(), path.name).pixels


def help_of(command: str) -> str:
    parser = build_parser()
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return str(commands.choices[command].format_help())


# Help


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["--help"])
    assert stopped.value.code == 0
    text = capsys.readouterr().out
    assert all(re.search(rf"^    {command} +\w", text, re.MULTILINE) for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_teaches_with_examples_that_are_right(command: str) -> None:
    text = help_of(command)
    examples = re.findall(r"^  ((?:\w+=\S+ )?gazetrace .+)$", text.split("examples:")[1], re.MULTILINE)
    assert 2 <= len(examples) <= 4
    for example in examples:
        words = shlex.split(example)
        words = words[words.index("gazetrace") + 1 :]
        assert words[0] == command
        assert parse_example(words).run is not None


def parse_example(words: list[str]) -> argparse.Namespace:
    from clients.command_line import attach_negative_values

    return build_parser().parse_args(attach_negative_values(words))


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["--version"])
    assert stopped.value.code == 0
    assert re.fullmatch(r"gazetrace \d+\.\d+\.\d+\n", capsys.readouterr().out)


def test_help_imports_nothing_slow() -> None:
    slow = {"numba", "embreex", "trimesh", "PIL", "fastapi", "uvicorn", "rich", "av", "websockets"}
    code = f"import sys, clients.command_line as c; c.build_parser().format_help(); print({slow} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"


# Bad usage and bad input


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ((), "required: COMMAND"),
        (("dance",), "invalid choice: 'dance'"),
        (("render", "spheres"), "required: -o/--output"),
        ((*RENDER, "--sampels", "4"), "unrecognized arguments: --sampels"),
        ((*RENDER, "--sample", "4"), "unrecognized arguments: --sample"),
        ((*RENDER, "--full", "--map", "full"), "not allowed with argument --full"),
        ((*RENDER, "--gaze", "12"), "--gaze: expected two numbers such as 960,540, found '12'"),
        ((*RENDER, "--gaze", "nan,4"), "--gaze: expected a number in"),
        ((*RENDER, "--gaze", "4,inf"), "found inf"),
        ((*RENDER, "--size", "0x4"), "--size: expected an integer from 1 to 32768, found 0"),
        ((*RENDER, "--size", "4"), "such as 1920x1080, found '4'"),
        ((*RENDER, "--size", "99999x9"), "--size: expected an integer from 1 to 32768"),
        (("render", "spheres", "-o", "a.webp", "--size", "20000x9"), "--size: expected sides of at most 16383 pixels"),
        ((*RENDER, "--screen-cm", "0"), "--screen-cm: expected a number in (0, 1e+09]"),
        ((*RENDER, "--screen-cm", "5x5x5"), "centimetres such as 50x35, found '5x5x5'"),
        ((*RENDER, "--distance-cm", "nan"), "--distance-cm: expected a number"),
        ((*RENDER, "--samples", "0"), "--samples: expected an integer from 1 to 4096, found 0"),
        ((*RENDER, "--samples", "many"), "--samples: invalid int value: 'many'"),
        ((*RENDER, "--max-depth", "-1"), "--max-depth: expected an integer from 0 to 64"),
        ((*RENDER, "--shadow-samples", "0"), "--shadow-samples: expected an integer from 1 to 4096, found 0"),
        ((*RENDER, "--effects", "+fog"), "--effects: expected effects out of textures, specular, shadows"),
        ((*RENDER, "--bucket", "9999"), "--bucket: expected an integer from 0 to 512"),
        ((*RENDER, "--map", "hexagonal"), "--map: expected one of aligned, scanline, full"),
        ((*RENDER, "--antialiasing", "x"), "--antialiasing: expected one of stochastic"),
        ((*RENDER, "--acuity-model", "owl"), "--acuity-model: expected one of peli"),
        ((*RENDER, "--acuity-scale", "0"), "--acuity-scale: expected a number in [0.001"),
        ((*RENDER, "--margin-deg", "-2"), "--margin-deg: expected a number in [0, 90]"),
        ((*RENDER, "--eccentricity", "x"), "--eccentricity: expected one of exact, paper"),
        ((*RENDER, "--camera-fov", "180"), "--camera-fov: expected a number in [0.001, 179]"),
        ((*RENDER, "--camera-position", "1,2"), "such as 0,1.6,5, found '1,2'"),
        ((*RENDER, "--camera-position", "1,nan,2"), "--camera-position: expected a number"),
        ((*RENDER, "--camera-up", "0,0,0"), "--camera-up: expected a direction"),
        ((*RENDER, "--threads", "0"), "--threads: expected an integer from 1 to 1024, found 0"),
        ((*RENDER, "--overlay", "stars"), "--overlay: invalid choice: 'stars'"),
        (("render", "spheres", "-o", "a.raw", "--overlay", "gaze"), "--overlay: expected a .png, .jpg or .webp output"),
        (("render", "spheres", "-o", "a.bmp"), "--output: expected a file ending in .png, .jpg, .jpeg, .webp, .raw"),
        (("render", "spheres", "-o", "no/a.png"), "--output: expected a file in an existing folder, found 'no/a.png'"),
        (("render", "sphres", "-o", "a.png"), "unknown scene 'sphres': the scenes are spheres, "),
        (("render", "no/such.obj", "-o", "a.png"), "no/such.obj: expected a scene folder or a mesh file"),
        ((*RENDER, "--scenes-folder", "no"), "--scenes-folder: expected a folder, found 'no'"),
        (("bench", "--repeats", "0"), "--repeats: expected an integer from 1 to 1000, found 0"),
        (("scenes", "sphres"), "unknown scene 'sphres'"),
        (("serve", "--port", "high"), "--port: expected an integer, found 'high'"),
        (("serve", "--port", "70000"), "--port: expected an integer from 0 to 65535, found 70000"),
        (("serve", "--host", "0.0.0.0"), "--host: expected 127.0.0.1, or a token"),
    ],
)  # fmt: skip
def test_bad_usage_is_one_line_and_status_2(
    words: tuple[str, ...], complaint: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert complaint in failing(capsys, *words)
    assert list(tmp_path.iterdir()) == []


def test_a_broken_mesh_is_one_line_naming_the_file_and_leaves_the_old_frame(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "torn.obj").write_text("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "old.png").write_bytes(b"old")
    assert "torn.obj" in failing(capsys, "render", "torn.obj", "-o", "old.png")
    assert (tmp_path / "old.png").read_bytes() == b"old"


def test_a_folder_without_a_scene_file_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert "scene.toml" in failing(capsys, "render", "./empty", "-o", "a.png")


def test_an_output_that_is_a_folder_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "a.png").mkdir()
    assert "expected a file, found the folder" in failing(capsys, "render", "spheres", "-o", "a.png")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_to_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "closed").mkdir(mode=0o500)
    assert "a folder that can be written to, found 'closed'" in failing(capsys, "render", "matte", "-o", "closed/a.png")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs a folder where even root makes no file")
def test_a_write_that_fails_is_one_line_and_status_1(capsys: pytest.CaptureFixture[str]) -> None:
    if os.geteuid() != 0:
        pytest.skip("only root gets so far as to write there")
    said = failing(capsys, "render", "matte", *SMALL, "-o", "/proc/a.png", status=1)
    assert re.fullmatch(r"gazetrace: /proc/\S+: No such file or directory\n", said)


def test_debug_shows_where_an_error_happened(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "sphres", "-o", "a.png", "--debug"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("Traceback (most recent call last):\n")
    assert said.splitlines()[-1].startswith("gazetrace: unknown scene 'sphres'")


def test_every_flag_that_an_error_may_blame_exists() -> None:
    text = help_of("render")
    assert all(re.search(rf"^  {flag}\b", text, re.MULTILINE) for flag in FLAG_OF_FIELD.values())


# Render


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
    assert cost["cells_reused"] == cost["rejected_samples"] == 0
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
    assert (hurried["deadline_met"], hurried["samples_per_cell"], hurried["acuity_scale"]) == (False, 1, 64)
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


# Scenes


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


# Bench


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


# Serve


def test_every_setting_is_a_flag_with_its_explanation() -> None:
    text = " ".join(help_of("serve").split())
    for setting in fields(Settings):
        explained = setting_texts()[setting.name]
        assert re.search(rf" {flag_of(setting.name)} ", text)
        assert explained in text


def test_a_flag_wins_over_the_environment_and_errors_name_who_said_it() -> None:
    arguments = build_parser().parse_args(["serve", "--port", "9001", "--insecure"])
    environ = {"GAZETRACE_PORT": "9000", "GAZETRACE_MAX_DEPTH": "3", "GAZETRACE_HOST": "0.0.0.0"}
    settings = settings_of(arguments, environ)
    assert (settings.port, settings.max_depth, settings.insecure, settings.host) == (9001, 3, True, "0.0.0.0")
    with pytest.raises(Exception, match=r"^GAZETRACE_MAX_DEPTH: expected an integer"):
        settings_of(arguments, {"GAZETRACE_MAX_DEPTH": "deep"})


@pytest.fixture
def service() -> Iterator[subprocess.Popen[bytes]]:
    """A running service on a free port."""
    process = start("serve", "--port", "0", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    end_of_patience = threading.Timer(PATIENCE_S, process.kill)
    end_of_patience.start()
    yield process
    end_of_patience.cancel()
    process.kill()
    process.communicate()


def test_serve_says_where_it_is_and_stops_quietly_on_ctrl_c(service: subprocess.Popen[bytes]) -> None:
    assert service.stdout is not None
    lines = []
    while not lines or not lines[-1].startswith("ready in"):
        line = service.stdout.readline().decode()
        assert line, service.stderr and service.stderr.read()
        lines.append(line)
    text = "".join(lines)
    address = re.search(r"serves on (http://127\.0\.0\.1:\d+)", text)
    assert address is not None
    assert "compil" in text, "it says what takes so long"
    question = re.search(r"^curl .*\"(http\S+)\"$", text, re.MULTILINE)
    assert question is not None, "it says how to ask for a frame"
    with urllib.request.urlopen(question[1] + "&width_px=64&height_px=36", timeout=PATIENCE_S) as reply:
        assert reply.read().startswith(b"\x89PNG")
    service.send_signal(signal.SIGINT)
    _, complaints = service.communicate(timeout=PATIENCE_S)
    assert service.returncode == 0
    assert complaints == b""


# Terminals, pipes and signals


def test_a_person_sees_what_takes_time_and_ctrl_c_is_quiet(tmp_path: Path) -> None:
    """Standard error is a terminal here: the spinner says what is going on until it is interrupted."""
    screen, terminal = pty.openpty()
    process = start("render", "spheres", "--samples", "4096", "-o", "a.png", stdout=subprocess.PIPE, stderr=terminal)
    os.close(terminal)
    seen = b""
    deadline = time.monotonic() + PATIENCE_S
    while b"rendering spheres" not in seen:
        assert select.select([screen], [], [], deadline - time.monotonic())[0], seen
        seen += os.read(screen, 4096)
    process.send_signal(signal.SIGINT)
    while True:
        try:
            seen += os.read(screen, 4096)
        except OSError:  # the other end of the terminal is closed
            break
    assert process.wait(PATIENCE_S) == 130
    os.close(screen)
    assert process.stdout is not None
    assert process.stdout.read() == b""
    process.stdout.close()
    assert b"loading kernels" in seen
    assert b"Traceback" not in seen
    assert list(tmp_path.iterdir()) == []


def test_a_reader_that_leaves_is_no_error() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    process = start("scenes", stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    _, complaints = process.communicate(timeout=PATIENCE_S)
    assert complaints == b""
    assert process.returncode == 141
