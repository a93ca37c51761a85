"""What Prometheus and Grafana are told to ask for is what a service counts, and alerts fire when they should."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from renderer.pipeline import Renderer
from service.settings import Settings
from tests.clients.commands import PATIENCE_S, ROOT
from tests.service.conftest import serving
from tests.service.streaming import configure, source, viewer

MONITORING = ROOT / "docker" / "monitoring"
DASHBOARDS = MONITORING / "grafana" / "dashboards"
OWN_LABELS = {"le", "job", "instance"}
"""Labels of histograms, and those that Prometheus adds."""

FIRES = {
    "GazetraceGone": {'up{job="gazetrace"}': "0x80"},
    "GazetraceSlow": {
        'gazetrace_gaze_to_frame_seconds_bucket{le="0.07"}': "0+90x80",
        'gazetrace_gaze_to_frame_seconds_bucket{le="0.1"}': "0+100x80",
        'gazetrace_gaze_to_frame_seconds_bucket{le="+Inf"}': "0+100x80",
    },
    "GazetraceViewersStarve": {
        "gazetrace_dropped_frames_total": "0+60x80",
        'gazetrace_frames_total{via="stream"}': "0+100x80",
    },
    "GazetraceRefuses": {'gazetrace_refusals_total{via="http",kind="busy"}': "0+10x80"},
    "GazetraceQuarantine": {'gazetrace_quarantined_scenes{scene="bad"}': "1x80"},
    "GazetraceBrokenSamples": {'gazetrace_rejected_samples_total{reason="not_a_number"}': "0x23 1x40"},
}
"""Series, one value every 15 s, in which each alert should fire."""

CALM = {
    'up{job="gazetrace"}': "1x80",
    'gazetrace_gaze_to_frame_seconds_bucket{le="0.07"}': "0+99x80",
    'gazetrace_gaze_to_frame_seconds_bucket{le="+Inf"}': "0+100x80",
    "gazetrace_dropped_frames_total": "0+40x80",
    'gazetrace_frames_total{via="stream"}': "0+100x80",
    'gazetrace_refusals_total{via="http",kind="invalid-request"}': "0+10x80",
    'gazetrace_rejected_samples_total{reason="not_a_number"}': "0x80",
}
"""And some in which none should."""

LABELS = {
    "GazetraceGone": {"job": "gazetrace"},
    "GazetraceQuarantine": {"scene": "bad"},
    "GazetraceBrokenSamples": {"reason": "not_a_number"},
}
"""Labels of the series that an alert is about."""


def panels() -> list[dict[str, Any]]:
    boards = [json.loads(path.read_text()) for path in sorted(DASHBOARDS.glob("*.json"))]
    return [panel for board in boards for panel in board["panels"]]


def rules() -> list[dict[str, Any]]:
    groups = yaml.safe_load((MONITORING / "alerts.yml").read_text())["groups"]
    return [rule for group in groups for rule in group["rules"]]


def expressions() -> list[str]:
    asked = [target["expr"] for panel in panels() for target in panel["targets"]]
    return [*asked, *(rule["expr"] for rule in rules())]


@pytest.fixture(scope="module")
def counted() -> dict[str, dict[str, set[str]]]:
    """Every metric of a service that has answered, streamed and refused: the values of each of its labels."""
    renderer = Renderer()
    with serving(Settings(port=0), renderer) as address:
        with viewer(address, "seen") as eye, source(address, "seen"):
            eye.say(configure())
            eye.final()
        query = {"gaze_x": 1, "gaze_y": 1, "width_px": 32, "height_px": 18}
        assert httpx.get(f"{address}/v1/scenes/matte/frame", params=query, timeout=PATIENCE_S).status_code == 200
        assert httpx.get(f"{address}/v1/scenes/none/frame", params=query, timeout=PATIENCE_S).status_code == 404
        text = httpx.get(f"{address}/metrics", timeout=PATIENCE_S).text
    renderer.close()
    found: dict[str, dict[str, set[str]]] = {"up": {}}
    for family in text_string_to_metric_families(text):
        if family.type == "gauge":
            found.setdefault(family.name, {})  # there may be nothing to count now
        for sample in family.samples:
            labels = found.setdefault(sample.name, {})
            for label, value in sample.labels.items():
                labels.setdefault(label, set()).add(value)
    return found


@pytest.mark.parametrize("expression", expressions())
def test_every_expression_asks_for_what_is_counted(expression: str, counted: dict[str, dict[str, set[str]]]) -> None:
    """Metrics, labels, and single values of labels other than kinds of refusals, which come as they happen."""
    selectors = re.findall(r"\b(gazetrace_\w+|process_\w+|up)\b(?:\{([^}]*)\})?", expression)
    assert selectors
    for name, matchers in selectors:
        assert name in counted
        for label, operator, value in re.findall(r'(\w+)(=~?)"([^"]*)"', matchers):
            assert label in counted[name].keys() | OWN_LABELS
            if operator == "=" and label not in OWN_LABELS:
                assert value in counted[name][label]
    labels = {label for name, _ in selectors for label in counted[name]}
    for grouped in re.findall(r"by \(([^)]*)\)", expression):
        assert {label.strip() for label in grouped.split(",")} <= labels | OWN_LABELS


def test_the_dashboard_shows_everything_that_we_count(counted: dict[str, dict[str, set[str]]]) -> None:
    shown = " ".join(target["expr"] for panel in panels() for target in panel["targets"])
    names = {re.sub(r"_(bucket|count|sum|created)$", "", name) for name in counted}
    assert {name for name in names if name.startswith("gazetrace_") and name not in shown} == set()


def test_no_two_panels_overlap() -> None:
    taken: set[tuple[int, int]] = set()
    ids = [panel["id"] for panel in panels()]
    assert len(ids) == len(set(ids))
    for panel in panels():
        place = panel["gridPos"]
        own = {(place["x"] + x, place["y"] + y) for x in range(place["w"]) for y in range(place["h"])}
        assert max(x for x, _ in own) < 24
        assert not taken & own
        taken |= own


def test_panels_ask_the_provisioned_source() -> None:
    provisioned = yaml.safe_load((MONITORING / "grafana/provisioning/datasources/prometheus.yaml").read_text())
    (wanted,) = provisioned["datasources"]
    asked = [*panels(), *(target for panel in panels() for target in panel["targets"])]
    assert {part["datasource"]["uid"] for part in asked} == {wanted["uid"]}


def test_prometheus_reads_the_alerts_beside_it() -> None:
    config = yaml.safe_load((MONITORING / "prometheus.yml").read_text())
    assert [(MONITORING / name).is_file() for name in config["rule_files"]] == [True]
    (job,) = config["scrape_configs"]
    assert {f'job="{job["job_name"]}"'} == set(re.findall(r'job="\w+"', " ".join(expressions())))


def promtool(*words: str) -> subprocess.CompletedProcess[str]:
    if shutil.which("promtool") is None:
        pytest.skip("there is no promtool here (Debian's package prometheus)")
    return subprocess.run(["promtool", *words], capture_output=True, text=True, timeout=PATIENCE_S)


def test_prometheus_understands_every_expression(tmp_path: Path) -> None:
    made = [
        {"record": f"asked_{number}", "expr": expression.replace("$__rate_interval", "1m")}
        for number, expression in enumerate(expressions())
    ]
    rules_file = tmp_path / "rules.yml"
    rules_file.write_text(yaml.safe_dump({"groups": [{"name": "asked", "rules": made}]}))
    told = promtool("check", "rules", str(rules_file))
    assert told.returncode == 0, told.stdout + told.stderr


@pytest.mark.parametrize("rule", rules(), ids=lambda rule: rule["alert"])
def test_an_alert_fires_when_it_should_and_not_otherwise(rule: dict[str, Any], tmp_path: Path) -> None:
    name = rule["alert"]
    fired = {"exp_labels": LABELS.get(name, {}), "exp_annotations": rule["annotations"]}
    cases = [
        {
            "interval": "15s",
            "input_series": [{"series": one, "values": values} for one, values in series.items()],
            "alert_rule_test": [{"eval_time": "8m", "alertname": name, "exp_alerts": expected}],
        }
        for series, expected in ((FIRES[name], [fired]), (CALM, []))
    ]
    test_file = tmp_path / "test.yml"
    test_file.write_text(yaml.safe_dump({"rule_files": [str(MONITORING / "alerts.yml")], "tests": cases}))
    told = promtool("test", "rules", str(test_file))
    assert told.returncode == 0, told.stdout + told.stderr
