"""What accuracy costs, over the wire: measured while the service is idle."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from renderer.accuracy.record import AccuracyReport, read_record
from renderer.acuity import MODELS
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.library import SceneLibrary
from renderer.pipeline import Renderer
from renderer.quality import Quality
from service.metrics import Metrics
from service.rendering import Studio
from service.settings import Settings
from service.survey import SETTINGS, Progress, Survey, Surveyor
from service.watch import Watch
from tests.service.conftest import BROKEN_SCENE, PATIENCE_S, serving

SURVEY = Survey(display=Display(320, 180, 16.7, None, 60.0), reference_samples=16, repeats=2)
FRAME = {"gaze_x": 30, "gaze_y": 20, "width_px": 64, "height_px": 36}

SCENE = """
title = "one ball"
[camera]
position = [0.0, 1.0, 4.0]
look_at = [0.0, 0.5, 0.0]
[[sphere]]
center = [0.0, 0.5, 0.0]
radius = 0.5
"""


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("measured")
    (folder / "ball").mkdir()
    (folder / "ball" / "scene.toml").write_text(SCENE)
    (folder / BROKEN_SCENE).mkdir()
    (folder / BROKEN_SCENE / "scene.toml").write_text("title = 'no end\n")
    return folder


@pytest.fixture(scope="module")
def measuring(renderer: Renderer, scenes: Path) -> Iterator[httpx.Client]:
    with (
        serving(Settings(port=0, scenes=scenes), renderer, survey=SURVEY) as address,
        httpx.Client(base_url=address, timeout=PATIENCE_S) as client,
    ):
        yield client


def table_of(client: httpx.Client, scene: str) -> dict[str, Any]:
    """Ask until it is there."""
    pause, patience = threading.Event(), time.monotonic() + PATIENCE_S
    while (answer := client.get(f"/v1/scenes/{scene}/accuracy")).status_code == 202:
        assert time.monotonic() < patience, answer.json()
        pause.wait(0.1)
    assert answer.status_code == 200, answer.text
    table: dict[str, Any] = answer.json()
    return table


def test_the_first_who_asks_begins_the_measurement_and_the_table_stays(measuring: httpx.Client) -> None:
    first = measuring.get("/v1/scenes/spheres/accuracy")
    assert first.status_code == 202
    assert int(first.headers["Retry-After"]) >= 1
    assert first.json() == {"scene": "spheres", "done": 0, "of": SURVEY.steps}
    table = table_of(measuring, "spheres")
    assert table == measuring.get("/v1/scenes/spheres/accuracy").json()
    assert "frame" not in table["reference"]
    assert all("frame" not in setting and "error_map" not in setting for setting in table["settings"])
    for setting in table["settings"]:
        setting |= {"frame": "", "error_map": ""}
    table["reference"]["frame"] = ""
    report = read_record(AccuracyReport, table)
    assert (report.scene, report.display) == ("spheres", SURVEY.display)
    assert {result.id for result in report.settings} == {setting.id for setting in SETTINGS}
    assert report.settings[0].marks == ("default",)
    assert all(len(result.time_ms.repeats) == SURVEY.repeats for result in report.settings)
    assert [model.model for model in report.acuity_models] == list(MODELS)
    aligned = {result.id: result for result in report.settings}["aligned-4-100"]
    peli = report.acuity_models[0]
    assert (peli.cells, peli.camera_rays) == (aligned.cells, aligned.rays.primary)
    errors = {result.id: result.accuracy.rms for result in report.settings}
    assert errors["aligned-8-100"] < errors["aligned-1-100"]
    assert errors["full-4"] < errors["aligned-4-400"]


def test_frames_come_first_and_the_measurement_goes_on_after_them(measuring: httpx.Client) -> None:
    assert measuring.get("/v1/scenes/cornell/accuracy").status_code == 202
    for _ in range(6):
        assert measuring.get("/v1/scenes/matte/frame", params=FRAME).status_code == 200
        told = measuring.get("/v1/scenes/cornell/accuracy")
        assert told.status_code == 202
    assert told.json()["done"] < SURVEY.steps / 4
    assert table_of(measuring, "cornell")["scene"] == "cornell"


def test_while_somebody_waits_for_a_frame_the_piece_in_hand_is_the_last(renderer: Renderer) -> None:
    """Counted, not timed: a frame of a stream begins while the measurement is at work, and none of its pieces begins
    until the last such frame is done.
    """
    watch = Watch()
    studio = Studio(Settings(), renderer, SceneLibrary(watch=watch.preparing), Metrics(), watch)
    surveyor = Surveyor(studio, SURVEY, 1)
    quality = Quality(samples_per_cell=1, gaze_bucket_px=0)

    def done() -> int:
        progress = surveyor.table("matte")
        assert isinstance(progress, Progress)
        return progress.done

    pause, patience, earlier = threading.Event(), time.monotonic() + PATIENCE_S, 0
    for stretch in range(3):
        while done() <= earlier:
            assert time.monotonic() < patience
            pause.wait(0.01)
        with studio.idle.busy():
            earlier = done()
            for step in range(5):
                gaze = Gaze(10.0 * step, 5.0 * stretch)
                studio.trace("matte", studio.library.load("matte"), FrameRequest(gaze, Display(64, 36), None, quality))
            assert done() - earlier <= 1
            earlier = done()
    surveyor.close()


def test_a_scene_that_changes_is_measured_again(measuring: httpx.Client, scenes: Path) -> None:
    assert table_of(measuring, "ball")["spheres"] == 1
    more = SCENE + "[[sphere]]\ncenter = [1.0, 0.5, 0.0]\nradius = 0.5\n"
    (scenes / "ball" / "scene.toml").write_text(more)
    assert measuring.get("/v1/scenes/ball/accuracy").status_code == 202
    assert table_of(measuring, "ball")["spheres"] == 2


def test_a_scene_that_is_not_there_or_broken_is_told(measuring: httpx.Client) -> None:
    assert measuring.get("/v1/scenes/nowhere/accuracy").status_code == 404
    broken = measuring.get(f"/v1/scenes/{BROKEN_SCENE}/accuracy")
    assert broken.status_code == 422
    assert "scene.toml" in broken.json()["detail"]
    assert measuring.get("/v1/scenes/spheres/accuracy", params={"samples": 3}).status_code == 422


def test_a_service_that_grants_no_such_frame_says_so(renderer: Renderer) -> None:
    with serving(Settings(port=0, max_pixels=96 * 54 - 1), renderer, survey=SURVEY) as address:
        refused = httpx.get(f"{address}/v1/scenes/spheres/accuracy")
    assert refused.status_code == 422
    assert refused.json()["type"].endswith("over-limit")


def test_a_service_that_stops_gives_the_measurement_up(renderer: Renderer) -> None:
    long = Survey(reference_samples=2000)
    with serving(Settings(port=0, max_camera_rays=10**10, max_samples_per_cell=4096), renderer, survey=long) as address:
        assert httpx.get(f"{address}/v1/scenes/gallery/accuracy", timeout=PATIENCE_S).status_code == 202
        began = time.monotonic()
    assert time.monotonic() - began < 20
