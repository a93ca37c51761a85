"""The page in a real browser: it shows a frame, and the mouse is the gaze."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest

from service.settings import Settings
from tests.service.chromium import Page, browsing, find_chromium

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        find_chromium() is None and os.environ.get("GAZETRACE_REQUIRE_BROWSER") != "1", reason="no Chromium here"
    ),
]

WIDTH, HEIGHT = 900, 600

SHOWN = "document.getElementById('number').textContent.match(/\\d+/)?.[0]"
PICTURE = """(() => {
  const canvas = document.getElementById('frame');
  const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  return [canvas.width, canvas.height, new Set(new Uint32Array(data.buffer)).size];
})()"""
GAZE_SHOWN = "document.getElementById('gaze_shown').textContent"


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Page]:
    """A browser."""
    chromium = find_chromium()
    assert chromium is not None, "GAZETRACE_REQUIRE_BROWSER is set, and there is no Chromium"
    with browsing(chromium, tmp_path / "profile") as page:
        yield page


def test_it_shows_a_frame_and_the_mouse_is_the_gaze(page: Page, address: str) -> None:
    page.open(address + "/", WIDTH, HEIGHT)
    page.wait_for(SHOWN)
    view = page.evaluate(
        "(({width, height}) => [width, height])(document.getElementById('view').getBoundingClientRect())"
    )
    width, height, colours = page.evaluate(PICTURE)
    assert [width, height] == view
    assert colours > 100
    first = page.requests("/v1/render")[0]
    assert first["gaze"] == {"x": width / 2, "y": height / 2}
    assert first["display"]["width_cm"] == pytest.approx(width * 2.54 / 96)

    page.point_at(100, 50)
    page.wait_for(f"{GAZE_SHOWN} === '100, 50'")
    assert page.requests("/v1/render")[-1]["gaze"] == pytest.approx({"x": 100, "y": 50})
    assert page.evaluate("document.getElementById('banner').hidden")
    assert page.complaints() == []


def test_only_the_newest_gaze_waits(page: Page, address: str) -> None:
    page.open(address + "/", WIDTH, HEIGHT)
    page.wait_for(SHOWN)
    before = len(page.requests("/v1/render"))
    for x in range(10, 210, 2):
        page.point_at(x, 300)
    page.wait_for(f"{GAZE_SHOWN} === '208, 300'")
    assert len(page.requests("/v1/render")) - before < 100
    assert page.complaints() == []


def test_the_controls_change_what_is_asked(page: Page, address: str) -> None:
    page.open(address + "/", WIDTH, HEIGHT)
    page.wait_for(SHOWN)
    page.wait_for("document.querySelector('#controls option[value=cornell]').text.includes('Cornell')")
    page.evaluate(
        """(() => {
          const controls = document.getElementById('controls').elements;
          controls.scene.value = 'cornell';
          controls.samples.value = '2';
          controls.map.value = 'scanline';
          controls.format.value = 'png';
          controls.show_cells.checked = true;
          controls.scale.value = '2';
          controls.scale.dispatchEvent(new Event('input', { bubbles: true }));
        })()"""
    )
    page.wait_for("!document.getElementById('cells').hidden")
    asked = page.requests("/v1/render")[-1]
    assert asked["scene"] == "cornell"
    assert asked["format"] == "png"
    assert asked["quality"] == {"map": "scanline", "samples_per_cell": 2, "acuity": {"scale": 2}}
    assert page.evaluate("document.getElementById('cells').width === document.getElementById('frame').width")
    assert page.complaints() == []


def test_nothing_moves_when_a_frame_arrives(page: Page, address: str) -> None:
    page.open(address + "/", WIDTH, HEIGHT)
    page.wait_for(SHOWN)
    page.evaluate(
        "window.shift = 0; new PerformanceObserver((list) => { for (const entry of list.getEntries()) "
        "window.shift += entry.value; }).observe({ type: 'layout-shift', buffered: true })"
    )
    page.point_at(200, 200)
    page.wait_for(f"{GAZE_SHOWN} === '200, 200'")
    assert page.evaluate("window.shift") < 0.01


def test_it_says_what_is_wrong(page: Page, client_of: Callable[[Settings], httpx.Client]) -> None:
    client = client_of(Settings(port=0, max_pixels=1000))
    page.open(str(client.base_url), WIDTH, HEIGHT)
    page.wait_for("!document.getElementById('banner').hidden")
    assert "1,000 pixels" in page.evaluate("document.getElementById('banner').textContent")


def test_it_asks_for_the_token_and_keeps_it(page: Page, client_of: Callable[[Settings], httpx.Client]) -> None:
    client = client_of(Settings(port=0, token="correct-horse-battery"))
    page.open(str(client.base_url), WIDTH, HEIGHT)
    for token in ("wrong-token", "correct-horse-battery"):
        page.wait_for("document.getElementById('token').open")
        page.evaluate(
            f"document.querySelector('#token input').value = '{token}'; document.querySelector('#token button').click()"
        )
        page.wait_for("!document.getElementById('token').open || document.querySelector('#token input').value === ''")
    page.wait_for(SHOWN)
    page.command("Page.reload")
    page.wait_for(SHOWN)
    assert not page.evaluate("document.getElementById('token').open")
