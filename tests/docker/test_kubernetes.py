"""kubernetes.yaml: every field is one, and the pod may do as little as the container."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields
from typing import Any

import kubernetes_validate
import pytest
import yaml

from service.access import OPEN_PATHS
from service.settings import VARIABLE_PREFIX, Settings
from tests.clients.commands import ROOT
from tests.docker.test_compose import most_held

TEXT = (ROOT / "docker" / "kubernetes.yaml").read_text()
DEPLOYMENT, SERVICE = yaml.safe_load_all(TEXT)
POD: dict[str, Any] = DEPLOYMENT["spec"]["template"]["spec"]


@pytest.mark.parametrize("resource", [DEPLOYMENT, SERVICE], ids=lambda resource: resource["kind"])
def test_kubernetes_knows_every_field(resource: dict[str, Any]) -> None:
    kubernetes_validate.validate(resource, "1.37", strict=True)


def test_a_field_that_is_none_is_found() -> None:
    wrong, _ = yaml.safe_load_all(TEXT.replace("readOnlyRootFilesystem", "readOnlyFile"))
    with pytest.raises(kubernetes_validate.ValidationError, match="readOnlyFile"):
        kubernetes_validate.validate(wrong, "1.37", strict=True)


def test_the_pod_may_do_as_little_as_the_container() -> None:
    assert POD["securityContext"]["runAsNonRoot"] is True
    user = re.search(r"^USER (\d+)$", (ROOT / "docker" / "Dockerfile").read_text(), re.MULTILINE)
    assert user is not None
    assert POD["securityContext"]["runAsUser"] == int(user[1])
    for container in [*POD["initContainers"], *POD["containers"]]:
        assert container["securityContext"] == {
            "allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True, "capabilities": {"drop": ["ALL"]},
        }  # fmt: skip
        assert container["resources"]["limits"].keys() == {"cpu", "memory"}
        mounted = {mount["name"] for mount in container["volumeMounts"]}
        assert mounted <= {volume["name"] for volume in POD["volumes"]}


def test_what_the_service_may_hold_fits_into_its_pod() -> None:
    (container,) = POD["containers"]
    memory = {each["name"]: each["value"] for each in container["env"] if each["name"].endswith("_BYTES")}
    granted = int(container["resources"]["limits"]["memory"].removesuffix("Gi")) << 30
    assert most_held(Settings.from_environment(memory)) <= granted


def test_it_asks_and_sets_what_there_is() -> None:
    (container,) = POD["containers"]
    for probe in ("startupProbe", "livenessProbe", "readinessProbe"):
        assert container[probe]["httpGet"]["path"] in OPEN_PATHS
    settings = {VARIABLE_PREFIX + setting.name.upper() for setting in fields(Settings)}
    assert {variable["name"] for variable in container["env"]} <= settings
    assert container["ports"] == [{"name": "http", "containerPort": Settings().port}]
    assert SERVICE["spec"]["selector"] == DEPLOYMENT["spec"]["selector"]["matchLabels"]
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert set(re.findall(r"image: (\S+)", TEXT)) == {f"gazetrace:{version}"}
