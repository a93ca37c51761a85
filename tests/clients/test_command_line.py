"""The command `gazetrace`: its help, how it fails, and how it behaves in terminals and pipes."""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from clients.command_line import build_parser, main
from clients.command_line.frame_flags import FLAG_OF_FIELD
from tests.clients.commands import PATIENCE_S, SMALL, failing, help_of, interrupted, start

pytestmark = pytest.mark.usefixtures("plain_environment")

COMMANDS = ("serve", "render", "scenes", "accuracy", "figures", "bench", "animate", "watch", "bridge", "simulate")
RENDER = ("render", "spheres", "-o", "a.png")


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
        ((*RENDER, "--effects", "+fog"), "--effects: expected effects out of cutouts, textures, normal_maps"),
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


# Terminals, pipes and signals


def test_a_person_sees_what_takes_time_and_ctrl_c_is_quiet(tmp_path: Path) -> None:
    """Standard error is a terminal here: the spinner says what is going on until it is interrupted."""
    with tempfile.TemporaryFile() as output:
        words = ("render", "spheres", "--samples", "4096", "-o", "a.png")
        seen = interrupted(b"rendering spheres", *words, stdout=output)
        assert os.fstat(output.fileno()).st_size == 0
    assert b"loading kernels" in seen
    assert list(tmp_path.iterdir()) == []


def test_a_reader_that_leaves_is_no_error() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    process = start("scenes", stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    _, complaints = process.communicate(timeout=PATIENCE_S)
    assert complaints == b""
    assert process.returncode == 141
