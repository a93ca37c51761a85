"""README.md and docker/README.md say what is so: commands run, requests are answered, settings exist."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import httpx
import numpy as np
import pytest
import trimesh

from clients.bridge.config import VARIABLE_PREFIX as BRIDGE_PREFIX
from clients.bridge.config import Config
from clients.command_line import build_parser, main
from renderer.codec import encode
from renderer.scene_file import load_scene_folder
from service.settings import VARIABLE_PREFIX, Settings

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
DOCKER_README = (ROOT / "docker" / "README.md").read_text()
COMPOSE = (ROOT / "docker" / "compose.yaml").read_text()
PATIENCE_S = 120


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def commands(text: str, program: str) -> list[list[str]]:
    """The words after `program` in each shell command that calls it, alone or behind variables."""
    found = []
    for block in blocks(text, "sh"):
        for words in shell_lines(block):
            while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
                words = words[1:]
            if words[:1] == [program]:
                found.append(words[1:])
    return found


def shell_lines(block: str) -> Iterator[list[str]]:
    """The words of each command; one may run over several lines inside quotes or after a backslash."""
    pending = ""
    for line in block.replace("\\\n", " ").splitlines():
        pending += line + "\n"
        try:
            words = shlex.split(pending)
        except ValueError:  # a quotation is still open
            continue
        pending = ""
        yield words


def table(heading: str) -> list[list[str]]:
    """Cells of the rows of the first table below a heading."""
    section = README.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row] for row in rows[2:]]


GAZETRACE = commands(README, "gazetrace")


def test_the_readme_opens_with_two_commands_that_do_all_the_set_up() -> None:
    first, second = blocks(README, "sh")[:2]
    venv = "python3 -m venv .venv && .venv/bin/pip install -q -c .ci/constraints.txt"
    assert first == f"{venv} . && .venv/bin/gazetrace serve\n"
    assert second == f"{venv} -e '.[test]' && .venv/bin/pytest\n"


def test_what_ci_installs_is_what_the_readme_says() -> None:
    script = (ROOT / ".ci" / "run").read_text()
    assert "pip install -q -c .ci/constraints.txt -e '.[test]'" in script
    for extra in ("peers", "cluster"):
        assert f"pip install -q -c .ci/constraints.txt -e '.[{extra}]'" in script
    packages = set(re.findall(r"--no-install-recommends (\S+)", script))
    assert packages == {"chromium", "assimp-testmodels", "povray", "prometheus"}
    assert {package for package in packages if f"`{package}`" in README} == packages - {"chromium"}


@pytest.mark.parametrize("words", GAZETRACE, ids=" ".join)
def test_each_command_works(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Renders run small: the last of two flags counts."""
    monkeypatch.chdir(tmp_path)
    trimesh.creation.icosphere(subdivisions=2).export(tmp_path / "model.glb")
    (tmp_path / "my-scenes").mkdir()
    if words[0] in ("serve", "bridge"):
        assert build_parser().parse_args(words).run is not None
        return
    (tmp_path / "eye.csv").write_text("t_ms,x_px,y_px\n0,960,540\n40,1200,300\n")
    shrinks = ("render", "bench", "animate", "watch", "figures")
    small = ["--size", "64x36", "--samples", "1"] if words[0] in shrinks else []
    small += ["--size", "64x36", "--nodes", "1,2"] if words[0] == "simulate" else []
    small += ["--repeats", "1"] if words[0] in ("accuracy", "figures") else []
    small += ["--size", "32x18", "--reference-samples", "2", "--no-report"] if words[0] == "accuracy" else []
    small += ["--seconds", "0.2"] if "--temporal" in words else []
    small += ["--seconds", {"animate": "0.1", "watch": "1.5"}[words[0]]] if words[0] in ("animate", "watch") else []
    assert main([*words, *small]) == 0
    if "-o" in words:
        output = tmp_path / words[words.index("-o") + 1]
        assert len(list(output.iterdir())) > 1 if output.is_dir() else output.stat().st_size > 100


def test_the_table_of_commands_is_complete() -> None:
    named = {words.split()[1].strip("`") for words, _ in table("Commands")}
    assert named == {
        "serve",
        "render",
        "scenes",
        "bench",
        "animate",
        "watch",
        "bridge",
        "figures",
        "accuracy",
        "simulate",
    }


def test_every_setting_is_in_the_table_with_its_default() -> None:
    said = {variable.strip("`"): default for variable, default, _ in table("Settings of the service")}
    true = {}
    for setting in fields(Settings):
        default = setting.default
        text = str(int(default)) if isinstance(default, bool) else str(default)
        true[VARIABLE_PREFIX + setting.name.upper()] = "none" if default in (None, ()) else text
    true["GAZETRACE_THREADS"] = "all cores"
    assert said == true


@pytest.mark.parametrize("text", [README, DOCKER_README, COMPOSE], ids=["README", "docker README", "compose"])
def test_no_file_names_a_setting_that_does_not_exist(text: str) -> None:
    named = set(re.findall(r"GAZETRACE_[A-Z_]+", text))
    assert named
    known = {VARIABLE_PREFIX + setting.name.upper() for setting in fields(Settings)}
    known |= {BRIDGE_PREFIX + setting.name.upper() for setting in fields(Config)}
    assert named <= known | {BRIDGE_PREFIX, BRIDGE_PREFIX + "CONFIG"}


@pytest.mark.parametrize(
    ("folder", "text"), [(ROOT, README), (ROOT / "docker", DOCKER_README)], ids=["README", "docker README"]
)
def test_every_link_leads_somewhere(folder: Path, text: str) -> None:
    links = [link for link in re.findall(r"\]\(([^)#]+)", text) if not link.startswith("http")]
    assert links
    assert [link for link in links if not (folder / link).exists()] == []


def test_the_scene_file_is_read_as_it_stands(tmp_path: Path) -> None:
    (example,) = blocks(README, "toml")
    (tmp_path / "scene.toml").write_text(example)
    trimesh.creation.icosphere(subdivisions=2, radius=10).export(tmp_path / "vase.obj")
    for name in ("wood.png", "worn.png", "bumps.png"):
        (tmp_path / name).write_bytes(encode(np.full((4, 4, 3), 99, dtype=np.uint8), "png"))
    scene = load_scene_folder(tmp_path)
    assert scene.title == "A vase on a table"
    assert [mesh.material.name for mesh in scene.meshes] == ["gold"]
    assert [sphere.material.name for sphere in scene.spheres] == ["glass"]
    assert len(scene.lights) == 3
    assert scene.camera_path is not None


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A service like the one the first command starts, on a free port."""
    environ = {name: value for name, value in os.environ.items() if not name.startswith(VARIABLE_PREFIX)}
    words = [sys.executable, "-m", "clients.command_line", "serve", "--port", "0"]
    with subprocess.Popen(words, cwd=ROOT, env=environ, stdout=subprocess.PIPE, text=True) as process:
        end_of_patience = threading.Timer(PATIENCE_S, process.kill)
        end_of_patience.start()
        assert process.stdout is not None
        said = ""
        while not re.search(r"^ready in", said, re.MULTILINE):
            line = process.stdout.readline()
            assert line, said
            said += line
        end_of_patience.cancel()
        found = re.search(r"http://[\d.]+:\d+", said)
        assert found is not None
        yield found[0]
        process.terminate()


@pytest.mark.parametrize("words", commands(README, "curl"), ids=lambda words: words[0].rpartition("/")[2][:20])
def test_each_request_is_answered_with_a_picture(words: list[str], address: str) -> None:
    """As curl would send it, for a smaller screen."""
    url = words[0].replace("http://127.0.0.1:8321", address)
    assert words.count("-o") == 1
    if "-d" not in words:
        reply = httpx.get(f"{url}&width_px=64&height_px=36", timeout=PATIENCE_S)
    else:
        name, _, value = words[words.index("-H") + 1].partition(": ")
        body = json.loads(words[words.index("-d") + 1])
        body["display"] |= {"width_px": 64, "height_px": 36}
        reply = httpx.post(url, headers={name: value}, content=json.dumps(body), timeout=PATIENCE_S)
    assert reply.status_code == 200, reply.text
    suffix = Path(words[words.index("-o") + 1]).suffix.lstrip(".")
    assert reply.headers["content-type"] == f"image/{suffix}"
    cost = json.loads(reply.headers["Gazetrace-Frame"])
    assert cost["map"]["cells"] > 0


def test_the_program_shows_frames(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    """As it stands, but for a smaller screen."""
    (program,) = blocks(README, "python")
    small = program.replace("http://127.0.0.1:8321", address).replace("1920", "64").replace("1080", "36")
    exec(compile(small, "README.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"moving [\d.]+ \(36, 64, 3\)", lines[0])
    assert lines[-1].startswith("final ")


def test_each_route_of_the_table_exists(address: str) -> None:
    paths = {"/", "/docs", *httpx.get(f"{address}/openapi.json", timeout=PATIENCE_S).json()["paths"]}
    named = set(re.findall(r"`(?:GET |POST )?(/[\w/{}]*)`", "".join(row[0] for row in table("Ask for a frame"))))
    assert len(named) >= 9
    assert {re.sub(r"\{\w+\}", "{}", path) for path in named} <= {re.sub(r"\{\w+\}", "{}", path) for path in paths}
