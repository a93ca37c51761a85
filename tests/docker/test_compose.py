"""compose.yaml: what it names exists, and no container may do more than it has to."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from clients.command_line import build_parser
from service.loader import AT_ONCE
from service.settings import Settings
from tests.clients.commands import ROOT

DOCKER = ROOT / "docker"
COMPOSE: dict[str, Any] = yaml.safe_load((DOCKER / "compose.yaml").read_text())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]

FRESH_BYTES = 400 << 20
"""What a service takes before it is asked for anything."""


def most_held(settings: Settings) -> int:
    """Memory that a service with these settings may come to [bytes]."""
    kept = settings.map_cache_bytes + settings.store_bytes + settings.scene_bytes
    return FRESH_BYTES + kept + settings.frame_bytes + AT_ONCE * settings.max_load_bytes


def test_the_service_runs_alone_unless_more_is_asked_for() -> None:
    profiles = {name: tuple(service.get("profiles", ())) for name, service in SERVICES.items()}
    assert [name for name, asked in profiles.items() if not asked] == ["gazetrace"]
    assert {profile for asked in profiles.values() for profile in asked} == {"bridge", "cluster", "monitoring"}
    text = (DOCKER / "README.md").read_text()
    assert all(f"--profile {profile}" in text for asked in profiles.values() for profile in asked)


@pytest.mark.parametrize("name", SERVICES)
def test_no_container_may_do_more_than_it_has_to(name: str) -> None:
    service = SERVICES[name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert service["mem_limit"]
    assert service["pids_limit"]
    assert "privileged" not in service
    assert all(port.startswith("127.0.0.1:") for port in service.get("ports", ()))


@pytest.mark.parametrize("name", ["gazetrace", "head"])
def test_what_the_service_may_hold_fits_into_its_container(name: str) -> None:
    service = SERVICES[name]
    memory = {key: value for key, value in service["environment"].items() if key.endswith("_BYTES")}
    granted = int(service["mem_limit"].removesuffix("g")) - int(service.get("shm_size", "0g").removesuffix("g"))
    assert most_held(Settings.from_environment(memory)) <= granted << 30


@pytest.mark.parametrize("name", SERVICES)
def test_everything_that_is_named_exists(name: str) -> None:
    service = SERVICES[name]
    for volume in service.get("volumes", ()):
        source = volume.split(":")[0]
        assert (DOCKER / source).exists() if source.startswith(".") else source in COMPOSE["volumes"]
    if "build" in service:
        folder = (DOCKER / service["build"]["context"]).resolve()
        assert (folder / service["build"]["dockerfile"]).is_file()
        packages = service["build"].get("args", {}).get("PACKAGES", "service")
        assert (DOCKER / "requirements" / f"{packages}.txt").is_file()
    assert set(service.get("networks", ())) <= COMPOSE.get("networks", {}).keys()
    assert set(service.get("secrets", ())) <= COMPOSE["secrets"].keys()
    assert set(service.get("depends_on", ())) <= SERVICES.keys()


@pytest.mark.parametrize("name", [name for name, service in SERVICES.items() if "gazetrace" in service["image"]])
def test_commands_of_ours_are_ones(name: str) -> None:
    service = SERVICES[name]
    words = service.get("command", ["serve"])
    if service.get("entrypoint") == ["ray"]:
        assert words[0] == "start"
        return
    if service.get("entrypoint") == ["sh", "-c"]:
        words = words[0].partition("exec gazetrace ")[2].split()
    assert build_parser().parse_args(words).run is not None


def test_images_of_others_have_a_version() -> None:
    for service in SERVICES.values():
        assert "build" in service or "gazetrace" in service["image"] or re.search(r":v?\d+\.\d+", service["image"])


def test_prometheus_and_bridge_find_the_service_where_it_is() -> None:
    """By a name that the service answers to."""
    name, port = "gazetrace", 8321
    settings = yaml.safe_load((DOCKER / "monitoring" / "prometheus.yml").read_text())
    (job,) = settings["scrape_configs"]
    assert job["static_configs"] == [{"targets": [f"{name}:{port}"]}]
    assert Path(job["authorization"]["credentials_file"]).name in SERVICES["prometheus"]["secrets"]
    assert SERVICES["bridge"]["environment"]["GAZETRACE_BRIDGE_SERVICE"] == f"http://{name}:{port}"
    assert name in SERVICES[name]["environment"]["GAZETRACE_ALLOWED_HOSTS"].split(",")
