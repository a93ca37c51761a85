"""The checkout itself: what may lie in it and what its files may say."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TOP_LEVEL = {
    ".ci", ".gitignore", "LICENSE", "README.md", "clients", "docker", "pyproject.toml", "renderer", "service", "tests",
}  # fmt: skip


@pytest.fixture(scope="module")
def files() -> list[Path]:
    """Every file that belongs to the project: tracked by git, or new and not ignored."""
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a git checkout")
    command = ("git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard", "-z")
    listed = subprocess.run(command, capture_output=True, check=True, text=True).stdout
    return [path for name in listed.split("\0") if name and (path := ROOT / name).exists()]


def test_the_top_level_holds_nothing_else(files: list[Path]) -> None:
    assert {path.relative_to(ROOT).parts[0] for path in files} <= TOP_LEVEL


def test_no_file_names_a_place_on_someones_machine(files: list[Path]) -> None:
    home = re.compile(rb"/(?:work|root|home|Users)/[\w.-]")
    for path in files:
        found = home.search(path.read_bytes())
        assert found is None, f"{path.relative_to(ROOT)}: {found}"


def test_every_test_folder_is_a_package(files: list[Path]) -> None:
    """Without it `tests` would come before the checkout on the import path, and `renderer` would be the tests."""
    folders = {path.parent for path in files if path.suffix == ".py" and path.is_relative_to(ROOT / "tests")}
    assert folders
    assert all((folder / "__init__.py").is_file() for folder in folders)


def test_constraints_pin_every_requirement_and_name_no_host() -> None:
    lines = (ROOT / ".ci" / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+==[A-Za-z0-9.]+", pin) for pin in pins), pins
    pinned = {_plain(pin.partition("==")[0]) for pin in pins}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    asked = [*project["dependencies"], *extras["test"], *extras["peers"], *extras["cluster"]]
    names = {_plain(match[0]) for text in asked if (match := re.match(r"[\w.-]+", text))}
    assert names <= pinned


def test_the_check_script_can_be_run() -> None:
    script = ROOT / ".ci" / "run"
    assert os.access(script, os.X_OK)
    subprocess.run(["bash", "-n", str(script)], check=True)


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
