"""The dial of the page: along the settings that nothing beats in both time and error."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx
import pytest

from renderer.display import Display
from renderer.pipeline import Renderer
from service.protocol import FrameHeader
from service.settings import Settings
from service.survey import Survey
from tests.service.chromium import Page
from tests.service.conftest import serving
from tests.service.test_page import HEIGHT, QUICK, WIDTH
from tests.service.test_page_panel import FAINT_TEXTS, LAPTOP

pytestmark = pytest.mark.browser

PHONE = (390, 844)
SURVEY = Survey(display=Display(320, 180, 16.7, None, 60.0), reference_samples=16, repeats=2)


def front(table: dict[str, Any]) -> list[dict[str, Any]]:
    """The settings of a table that no other beats in both, fastest first."""

    def beaten(setting: dict[str, Any]) -> bool:
        time_ms, rms = setting["time_ms"]["median"], setting["accuracy"]["rms"]
        return any(
            other["time_ms"]["median"] <= time_ms and other["accuracy"]["rms"] <= rms and other is not setting
            for other in table["settings"]
        )

    unbeaten = [setting for setting in table["settings"] if not beaten(setting)]
    return sorted(unbeaten, key=lambda setting: float(setting["time_ms"]["median"]))


def is_final_of(quality: dict[str, Any]) -> Callable[[FrameHeader], bool]:
    """Whether a frame is the last one for a quality."""

    def is_final(header: FrameHeader) -> bool:
        kind, samples = header.cost["map"]["kind"], header.samples
        return header.phase == "final" and (kind, samples) == (quality["map"], quality["samples_per_cell"])

    return is_final


def test_the_dial_goes_from_the_fastest_frame_to_the_finest(page: Page, renderer: Renderer) -> None:
    with serving(Settings(port=0), renderer, survey=SURVEY) as address:
        page.open(address + "/#spheres", WIDTH, HEIGHT, settings=QUICK)
        page.shown(lambda header: header.phase == "final")
        page.click("#tab_quality")
        assert page.evaluate("document.getElementById('dial_place').disabled")
        page.click("#dial_measure")
        page.wait_for("!document.getElementById('dial_place').disabled")
        way = front(httpx.get(f"{address}/v1/scenes/spheres/accuracy").json())
        assert len(way) >= 3
        assert page.evaluate("document.getElementById('dial_place').max") == str(len(way) - 1)
        for place in (len(way) - 1, 0):
            page.enter("#dial_place", place)
            setting = way[place]
            wanted = setting["quality"]
            header = page.shown(is_final_of(wanted))
            assert header.config == page.said("quality")[-1]["id"]
            asked = page.said("quality")[-1]["quality"]
            assert asked["acuity"]["scale"] == pytest.approx(wanted["acuity"]["scale"], rel=1e-3)
            told = page.evaluate("document.getElementById('dial_told').value")
            time_ms, error = told.split(" ms, error ")
            assert float(time_ms) == pytest.approx(setting["time_ms"]["median"], rel=0.01)
            assert float(error) == pytest.approx(setting["accuracy"]["rms"], rel=0.1)
        page.enter("[name=samples_per_cell]", 2)
        assert page.evaluate("document.getElementById('dial_told').value") == "–" or 2 in {
            each["quality"]["samples_per_cell"] for each in way
        }
        for width, height in (LAPTOP, PHONE):
            page.resize(width, height)
            assert page.evaluate(FAINT_TEXTS) == []
            shown = "document.getElementById('settings')"
            assert page.evaluate(f"{shown}.scrollWidth <= {shown}.clientWidth")
        page.evaluate("location.hash = 'matte'")
        page.wait_for("document.getElementById('dial_place').disabled")
        assert page.complaints() == []
