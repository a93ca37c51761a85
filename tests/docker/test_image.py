"""The Dockerfile, as far as it can be read: what it copies, installs and says about itself."""

from __future__ import annotations

import ast
import json
import re
import shutil
import subprocess
import tomllib

import pytest

from tests.clients.commands import PATIENCE_S, ROOT

DOCKER = ROOT / "docker"
DOCKERFILE = (DOCKER / "Dockerfile").read_text()
SETS_OF_PACKAGES: dict[str, tuple[str, ...]] = {"service": (), "cluster": ("cluster",)}
"""Files of docker/requirements, and the extras whose packages they hold."""


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def pinned(name: str) -> dict[str, str]:
    """Versions by package of a file of requirements, and of the one it includes."""
    text = (DOCKER / "requirements" / f"{name}.txt").read_text()
    rows = re.findall(r"^(\S+)==(\S+) \\\n    --hash=sha256:[0-9a-f]{64}$", text, re.MULTILINE)
    assert len(rows) == text.count("==") > 0
    included = re.findall(r"^-r (\w+)\.txt$", text, re.MULTILINE)
    return dict(rows) | {package: version for other in included for package, version in pinned(other).items()}


def test_it_is_built_from_what_the_project_has() -> None:
    """Each path that it copies from the checkout exists and is let through to the build."""
    let_through = re.findall(r"^!(\S+)", (DOCKER / "Dockerfile.dockerignore").read_text(), re.MULTILINE)
    copied = [word for line in re.findall(r"^COPY ([^-].*) \S+$", DOCKERFILE, re.MULTILINE) for word in line.split()]
    assert {"renderer", "service", "clients", "docker/requirements"} <= set(copied)
    assert all((ROOT / path).exists() for path in copied)
    assert set(copied) == set(let_through)


@pytest.mark.parametrize("name", SETS_OF_PACKAGES)
def test_it_installs_the_pinned_versions_by_their_hashes(name: str) -> None:
    lines = re.findall(r"^(\S+)==(\S+)$", (ROOT / ".ci" / "constraints.txt").read_text(), re.MULTILINE)
    constraints = {plain(package): version for package, version in lines}
    versions = pinned(name)
    assert {package: version for package, version in versions.items() if package != "setuptools"}.items() <= (
        constraints.items()
    )
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [line for extra in SETS_OF_PACKAGES[name] for line in project["optional-dependencies"][extra]]
    needed = {plain(re.split(r"[<>=\[]", line)[0]) for line in [*project["dependencies"], *extras]}
    assert needed | {"setuptools"} <= versions.keys()


def test_nobody_is_root_and_kernels_fit_where_they_are_used() -> None:
    build, run = re.split(r"^FROM \S+$", DOCKERFILE, flags=re.MULTILINE)
    assert re.search(r"^USER 10001$", run, re.MULTILINE)
    for variable in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        first, second = (re.search(rf"{variable}=(\S*)", stage) for stage in (build, run))
        assert first is not None
        assert second is not None
        assert first[1] == second[1]
    folder = re.search(r"NUMBA_CACHE_DIR=(\S+)", run)
    assert folder is not None
    assert re.search(rf"^VOLUME {folder[1]}$", run, re.MULTILINE)


def test_the_health_check_is_a_program() -> None:
    check = re.search(r"^HEALTHCHECK .*\n +CMD (\[.+\])$", DOCKERFILE, re.MULTILINE)
    assert check is not None
    python, flag, program = json.loads(check[1])
    assert (python, flag) == ("python", "-c")
    ast.parse(program)


def test_hadolint_has_no_complaint() -> None:
    if shutil.which("hadolint") is None:
        pytest.skip("there is no hadolint here")
    told = subprocess.run(["hadolint", str(DOCKER / "Dockerfile")], capture_output=True, text=True, timeout=PATIENCE_S)
    assert told.returncode == 0, told.stdout
