"""The page in a real browser: frames come, the pointer is the gaze, and the picture is sharp there."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.codec import decode_texture
from service.protocol import FrameHeader
from tests.service.chromium import Page

pytestmark = pytest.mark.browser

WIDTH, HEIGHT = 800, 480
QUICK = {"samples_per_cell": "1", "scale": "2", "deadline_ms": "500"}
"""Settings of the page: one sample for each cell, and cells twice as wide."""

SHIFT = 8
"""The modifier of a mouse event."""

BOX = "(({x, y, width, height}) => [x, y, width, height])(document.getElementById('frame').getBoundingClientRect())"


def is_final_at(x: float, y: float) -> Callable[[FrameHeader], bool]:
    """Whether a frame is the last one for a gaze [px]."""

    def is_final(header: FrameHeader) -> bool:
        assert header.gaze is not None
        return header.phase == "final" and math.hypot(header.gaze.x - x, header.gaze.y - y) < 0.01

    return is_final


def picture(page: Page) -> NDArray[np.uint8]:
    """What is on the canvas."""
    address = page.evaluate("document.getElementById('frame').toDataURL('image/png')")
    return decode_texture(base64.b64decode(address.partition(",")[2]), "canvas").pixels


def patch(pixels: NDArray[np.uint8], x: int, y: int, radius: int) -> NDArray[np.uint8]:
    return pixels[y - radius : y + radius, x - radius : x + radius]


def test_it_streams_the_scene_at_the_pixels_of_the_window(page: Page, address: str) -> None:
    page.open(address + "/#spheres", WIDTH, HEIGHT, settings=QUICK)
    first = page.shown()
    assert first.scene == "spheres"
    assert (first.width, first.height) == (WIDTH, HEIGHT)
    assert first.gaze is not None
    assert (first.gaze.x, first.gaze.y) == (WIDTH / 2, HEIGHT / 2)
    asked = page.said("configure")[-1]
    assert asked["display"]["width_cm"] == pytest.approx(WIDTH * 2.54 / 96)
    assert asked["quality"]["samples_per_cell"] == 1
    assert page.evaluate(BOX) == [0, 0, WIDTH, HEIGHT]
    assert page.evaluate("document.getElementById('banner').hidden")
    assert page.complaints() == []


def test_the_picture_is_sharp_where_the_pointer_is_and_coarse_elsewhere(
    page: Page, address: str, client: httpx.Client
) -> None:
    page.open(address + "/#spheres", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    asked = page.said("configure")[-1]
    full = {**asked["quality"], "map": "full"}
    body = {"scene": "spheres", "gaze": {"x": 0, "y": 0}, "display": asked["display"], "quality": full}
    everywhere_sharp = decode_texture(client.post("/v1/render", json=body).content, "reply").pixels
    page.press("p")
    places = ((60, 330), (740, 330))
    for here, there in (places, places[::-1]):
        page.point_at(*here)
        final = page.shown(is_final_at(*here))
        assert min(final.timing_ms.values()) >= 0
        shown = picture(page)
        np.testing.assert_array_equal(patch(shown, *here, 40), patch(everywhere_sharp, *here, 40))
        assert (patch(shown, *there, 40) != patch(everywhere_sharp, *there, 40)).any(axis=2).mean() > 0.05
    assert page.complaints() == []


def test_only_the_newest_pointer_of_a_picture_is_told(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.evaluate(
        """new Promise((done) => requestAnimationFrame(() => {
          const view = document.getElementById('view');
          for (let x = 100; x <= 200; x += 1) {
            view.dispatchEvent(new PointerEvent('pointermove', { clientX: x, clientY: 90, isPrimary: true }));
          }
          requestAnimationFrame(() => requestAnimationFrame(done));
        }))"""
    )
    (told,) = page.said("gaze")
    assert (told["x"], told["y"], told["unit"]) == (200 / WIDTH, 90 / HEIGHT, "fraction")
    page.shown(is_final_at(200, 90))
    assert int(page.evaluate("document.getElementById('latency_note').textContent.match(/last (\\d+)/)[1]")) == 1
    assert float(page.evaluate("document.getElementById('latency_50').textContent")) > 0


def test_a_held_gaze_leaves_the_pointer_free(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.point_at(100, 90)
    page.shown(is_final_at(100, 90))
    page.press(" ")
    page.point_at(300, 200)
    page.press(" ")
    page.point_at(310, 210)
    page.shown(is_final_at(310, 210))
    assert [300 / WIDTH, 200 / HEIGHT] not in [[gaze["x"], gaze["y"]] for gaze in page.said("gaze")]


def test_device_pixels_are_the_displays_pixels(page: Page, address: str) -> None:
    page.open(address + "/#matte", 400, 240, ratio=2.0, settings=QUICK)
    assert (page.shown().width, page.shown().height) == (800, 480)
    assert page.evaluate(BOX) == [0, 0, 400, 240]
    page.point_at(100, 90)
    page.shown(is_final_at(200, 180))
    page.resize(300, 200, 1.5)
    page.shown(lambda header: (header.width, header.height) == (450, 300))
    assert page.evaluate(BOX) == [0, 0, 300, 200]
    assert page.said("configure")[-1]["gaze"] == {"x": 0.25, "y": 0.375, "unit": "fraction"}


def test_a_display_of_another_size_stands_in_the_middle(page: Page, address: str) -> None:
    page.open(address + "/#matte", 1400, 800, settings=QUICK)
    page.shown()
    page.enter("[name=size]", "1280x720")
    page.shown(lambda header: header.width == 1280)
    assert page.evaluate(BOX) == [60, 40, 1280, 720]
    page.point_at(60 + 320, 40 + 180)
    page.shown(is_final_at(320, 180))

    page.resize(640, 480)
    page.wait_for(f"{BOX}[2] === 640")
    assert page.evaluate(BOX) == [0, 60, 640, 360]
    page.shown(lambda header: header.width == 1280)
    assert page.said("configure")[-1]["display"]["width_cm"] == pytest.approx(640 * 2.54 / 96)


def test_the_camera_is_turned_by_keys_drags_and_the_wheel(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    (home,) = (ready["camera"] for ready in page.heard("ready") if ready["config"] is not None)

    def turned(how: Callable[[], None]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The eye from what it looks at: in the scene's own view and after `how`."""
        before = len(page.said("camera"))
        how()
        page.shown(lambda header: len(page.said("camera")) > before and header.config == page.said("camera")[-1]["id"])
        camera = page.said("camera")[-1]["camera"]
        assert (camera["look_at"], camera["up"]) == (home["look_at"], home["up"])
        own, other = (np.subtract(view["position"], view["look_at"]) for view in (home, camera))
        page.press("0")
        page.shown(lambda header: header.config == page.said("camera")[-1]["id"])
        assert page.said("camera")[-1]["camera"] is None
        return own, other

    def wheel() -> None:
        page.command("Input.dispatchMouseEvent", type="mouseWheel", x=300, y=200, deltaX=0, deltaY=500)

    turns = [
        turned(lambda: page.press("ArrowRight")),
        turned(lambda: page.press("ArrowUp")),
        turned(lambda: page.drag((300, 200), (200, 200), "right")),
        turned(lambda: page.drag((300, 200), (200, 200), "left", SHIFT)),
    ]
    for own, other in turns:
        assert np.linalg.norm(other) == pytest.approx(np.linalg.norm(own)), "as far away as before"
        assert np.linalg.norm(other - own) > 0.05 * np.linalg.norm(own)
    assert turns[0][0][1] == pytest.approx(turns[0][1][1]), "to the side, not up"
    assert turns[1][1][1] > turns[1][0][1], "up"
    np.testing.assert_allclose(turns[2][1], turns[3][1])
    own, other = turned(wheel)
    np.testing.assert_allclose(other, own * math.e)
