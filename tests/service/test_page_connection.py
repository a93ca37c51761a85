"""The page and its service: restarts, refusals, the token, an eye tracker on the same session."""

from __future__ import annotations

from collections.abc import Callable
from urllib.parse import urlsplit

import httpx
import pytest

from renderer.pipeline import Renderer
from service.protocol import Gaze, Target
from service.settings import Settings
from tests.service.chromium import Page
from tests.service.conftest import serving
from tests.service.streaming import source
from tests.service.test_page import HEIGHT, QUICK, WIDTH, is_final_at

pytestmark = pytest.mark.browser

BANNER = "!document.getElementById('banner').hidden && document.getElementById('banner').textContent"
STATE = "document.getElementById('connection').dataset.state"


def test_it_comes_back_to_its_session_when_the_service_was_restarted(page: Page, renderer: Renderer) -> None:
    with serving(Settings(port=0), renderer) as address:
        page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
        page.shown()
        page.point_at(200, 200)
        before = page.shown(is_final_at(200, 200))
    page.wait_for(f"{STATE} === 'lost'")
    assert "lost" in page.evaluate("document.getElementById('connection').textContent")
    page.point_at(300, 200)
    with serving(Settings(port=urlsplit(address).port or 0), renderer):
        page.wait_for(f"{STATE} === 'live'")
        after = page.shown(lambda header: header.config == page.said("configure")[-1]["id"] != before.config)
        assert after.session == before.session
        assert after.gaze is not None
        assert (after.gaze.x, after.gaze.y) == pytest.approx((300, 200))
        assert page.evaluate("document.getElementById('status').textContent") == ""


def test_an_unknown_scene_is_named_and_another_one_can_be_picked(page: Page, address: str) -> None:
    page.open(address + "/#nowhere", WIDTH, HEIGHT, settings=QUICK)
    assert "nowhere" in page.wait_for(BANNER)
    page.enter("[name=samples_per_cell]", "2")
    page.click("#scenes [data-scene=matte]")
    header = page.shown()
    assert header.scene == "matte"
    assert page.evaluate("document.getElementById('banner').hidden && location.hash === '#matte'")
    page.click("#scenes [data-scene=broken]")
    assert "scene.toml" in page.wait_for(BANNER)
    page.click("#banner button")
    assert page.evaluate("document.getElementById('banner').hidden")


def test_a_display_that_is_too_large_is_refused_at_its_control(
    page: Page, client_of: Callable[[Settings], httpx.Client]
) -> None:
    client = client_of(Settings(port=0, max_pixels=1_000_000))
    page.open(f"{client.base_url}/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.click("#tab_screen")
    page.enter("[name=size]", "1920x1080")
    assert "1,000,000 pixels" in page.wait_for(BANNER)
    assert page.evaluate("document.querySelector('[name=size]').ariaInvalid") == "true"
    page.enter("[name=size]", "window")
    page.wait_for("document.getElementById('banner').hidden")
    assert page.evaluate("document.querySelector('[name=size]').ariaInvalid") is None


def test_it_asks_for_the_token_and_keeps_it(page: Page, client_of: Callable[[Settings], httpx.Client]) -> None:
    client = client_of(Settings(port=0, token="correct-horse-battery"))
    page.open(f"{client.base_url}/#matte", WIDTH, HEIGHT, settings=QUICK)
    for token in ("wrong-token", "correct-horse-battery"):
        page.wait_for("document.getElementById('token').open")
        page.enter("#token input", token)
        page.click("#token button")
        page.wait_for("!document.getElementById('token').open || document.querySelector('#token input').value === ''")
    first = page.shown()
    assert page.evaluate("document.getElementById('banner').hidden")
    page.reload()
    again = page.shown()
    assert again.session == first.session
    assert not page.evaluate("document.getElementById('token').open")


def test_an_eye_tracker_takes_the_pointers_place_and_calibrates(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.press("t")
    told = len(page.said("gaze"))
    session = page.evaluate("document.getElementById('session').value")
    assert "Waiting for a tracker" in page.evaluate("document.getElementById('status').textContent")
    with source(address, session) as tracker:
        page.point_at(60, 300)
        tracker.say(Gaze(300, 200, seq=1))
        header = page.shown(is_final_at(300, 200))
        assert header.gaze is not None
        assert header.gaze.seq == 1
        page.wait_for("document.getElementById('sources').textContent === '1'")
        page.wait_for("document.getElementById('latency_note').textContent.startsWith('gaze received')")
        tracker.say(Gaze(valid=False))
        page.wait_for("document.getElementById('status').textContent.includes('gaze is lost')")

        tracker.say(Target(0.25, 0.75, "fraction", 0, 9))
        page.wait_for("!document.getElementById('target').hidden")
        box = page.evaluate(
            "(({left, right, top, bottom}) => [(left + right) / 2, (top + bottom) / 2])"
            "(document.querySelector('#target i').getBoundingClientRect())"
        )
        assert box == [0.25 * WIDTH, 0.75 * HEIGHT]
        assert "1 of 9" in page.evaluate("document.getElementById('target').innerText")
        assert not page.evaluate("document.getElementById('panel').checkVisibility({ visibilityProperty: true })")
        tracker.say(Target(None, None, "fraction", 9, 9))
        page.wait_for("document.getElementById('target').hidden")
    assert len(page.said("gaze")) == told, "the page sends no gaze of its own"
