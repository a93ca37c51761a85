"""What stands around the picture: overlays, figures, settings, calibration, help; it can be read, and stays put."""

from __future__ import annotations

import math

import httpx
import pytest

from tests.service.chromium import Page
from tests.service.test_page import HEIGHT, QUICK, WIDTH, is_final_at

pytestmark = pytest.mark.browser

LAPTOP = (1366, 768)
CARD_CM = 8.56
"""Width of a bank card (ISO/IEC 7810 ID-1)."""

READABLE = 4.5
"""Contrast of text that WCAG 2.2 asks for at level AA."""

PAINTED = """((id, x, y) => {
  const context = new OffscreenCanvas(1, 1).getContext('2d');
  context.drawImage(document.getElementById(id), -x, -y);
  return [...context.getImageData(0, 0, 1, 1).data];
})"""

FAINT_TEXTS = """(() => {
  const light = (colour) => {
    const [r, g, b, a = 1] = colour.match(/[\\d.]+/g).map(Number);
    const linear = [r, g, b].map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
    return { luminance: 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2], opaque: a > 0.99 };
  };
  const behind = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const back = light(getComputedStyle(at).backgroundColor);
      if (back.opaque) return back.luminance;
    }
  };
  const faint = [];
  for (const element of document.querySelectorAll('body *')) {
    const text = [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.data.trim());
    if (!text || element.matches(':disabled') || !element.checkVisibility({ visibilityProperty: true })) continue;
    const pair = [light(getComputedStyle(element).color).luminance, behind(element)].sort((a, b) => b - a);
    const contrast = (pair[0] + 0.05) / (pair[1] + 0.05);
    if (contrast < LIMIT) faint.push(`${element.tagName} ${element.textContent.trim()} ${contrast.toFixed(1)}`);
  }
  return faint;
})()""".replace("LIMIT", str(READABLE))

BOXES = """Object.fromEntries([...document.querySelectorAll('.chrome')].filter((part) => part.checkVisibility())
  .map((part) => [part.id, (({left, top, right, bottom}) => [left, top, right, bottom])(part.getBoundingClientRect())])
  .filter(([, [left, top, right, bottom]]) => right > left && bottom > top))"""


def test_overlays_are_drawn_over_the_frame_they_belong_to(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.point_at(200, 200)
    page.shown(is_final_at(200, 200))
    assert page.evaluate(f"{PAINTED}('marks', 210, 200)")[:3] == [255, 74, 61], "an arm of the cross"
    page.press("g")
    assert page.evaluate(f"{PAINTED}('marks', 210, 200)")[3] == 0

    page.press("r")
    display = page.said("configure")[-1]["display"]
    pitch_cm = display["width_cm"] / WIDTH
    gaze_deg = math.degrees(math.atan((WIDTH / 2 - 200) * pitch_cm / display["distance_cm"]))
    x = WIDTH / 2 - math.tan(math.radians(gaze_deg - 5)) * display["distance_cm"] / pitch_cm
    y = HEIGHT / 2
    page.point_at(200, y)
    page.shown(is_final_at(200, y))
    assert page.evaluate(f"{PAINTED}('marks', {int(x)}, {int(y)})") == [255, 200, 60, 255], "the ring at 5 degrees"

    for key, other, side in (("c", "rays", "2"), ("d", "cells", "1/8")):
        page.press(key)
        page.wait_for(f"document.getElementById('drawn').width === {WIDTH}")
        assert page.evaluate(f"document.querySelector('[data-overlay={other}]').ariaPressed") == "false"
        assert side in page.evaluate("document.getElementById('legend').innerText").split()
        assert not page.evaluate("document.getElementById('drawn').hidden")
    (asked,) = {
        event["params"]["request"]["url"]
        for event in page.events
        if event["method"] == "Network.requestWillBeSent" and "drawing=cells" in event["params"]["request"]["url"]
    }
    counts = httpx.get(asked.replace("format=png", "format=json")).json()
    assert counts["cells"] == page.shown().cost["map"]["cells"], "the frame's own cells"
    page.click("[data-overlay=rays]")
    assert page.evaluate("document.getElementById('drawn').hidden && document.getElementById('legend').hidden")
    assert page.complaints() == []


def test_the_panel_tells_what_the_frame_cost_and_why(page: Page, address: str) -> None:
    page.open(address + "/#spheres", WIDTH, HEIGHT, settings={**QUICK, "samples_per_cell": "4"})
    final = page.shown(lambda header: header.phase == "final")

    def told(element: str) -> str:
        return str(page.evaluate(f"document.getElementById('{element}').textContent"))

    assert told("cells") == f"{final.cost['map']['cells']:,}"
    assert told("shadow") == f"{final.cost['rays']['shadow']:,}"
    assert float(told("rms")) == float(f"{final.cost['error']['rms']:.2g}")
    assert (told("samples_now"), told("samples_asked")) == ("4.0", "of 4")
    assert told("phase") == "complete"
    reasons = {effect["name"]: effect["reason"] for effect in page.heard("ready")[-1]["effects"]}
    shown = page.evaluate("[...document.querySelectorAll('#effects li')].map((effect) => effect.textContent)")
    assert shown == [f"{name.replace('_', ' ')} {reason}" for name, reason in reasons.items()]
    page.click("[data-effect=reflection]")
    without = page.shown(lambda header: header.config != final.config and header.phase == "final")
    assert without.cost["rays"]["reflection"] == 0 < final.cost["rays"]["reflection"]
    assert page.evaluate("document.querySelector('[data-effect=reflection]').ariaPressed") == "false"
    dots = """(() => {
      const plot = document.getElementById('plot');
      const context = new OffscreenCanvas(plot.width, plot.height).getContext('2d');
      context.drawImage(plot, 0, 0);
      const { data } = context.getImageData(0, 0, plot.width, plot.height);
      let count = 0;
      for (let at = 0; at < data.length; at += 4) count += [127, 242].includes(data[at]) && data[at + 3] === 255;
      return count;
    })()"""
    page.wait_for(f"{dots} >= 8")


def test_quality_is_asked_for_as_set_and_kept(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.click("#tab_quality")
    page.enter("[name=map]", "scanline")
    page.enter("[name=scale]", "4")
    page.enter("[name=model]", "guenter")
    header = page.shown(lambda header: header.cost["map"]["kind"] == "scanline" and header.acuity_scale == 4)
    assert header.config in {message["id"] for message in page.said("quality")}
    page.press("]")
    page.shown(lambda header: header.samples == 2)
    page.enter("[name=margin_deg]", "-1")
    page.reload()
    page.wait_for("document.querySelector('[name=map]').value === 'scanline'")
    asked = page.shown(lambda header: header.config == page.said("configure")[-1]["id"]) and page.said("configure")[-1]
    assert asked["quality"]["acuity"] == {"model": "guenter", "scale": 4, "margin_deg": 0}
    assert asked["quality"]["samples_per_cell"] == 2
    page.enter("[name=deadline_ms]", "100")
    page.shown(lambda header: header.config == page.said("quality")[-1]["id"])
    assert page.said("quality")[-1]["quality"]["deadline_ms"] == 100
    page.click("#defaults")
    page.shown(lambda header: header.cost["map"]["kind"] == "aligned")


def test_the_screen_is_measured_with_a_card_and_kept(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.click("#calibrate")
    page.enter("#card_size", "400")
    assert page.evaluate("document.getElementById('card').getBoundingClientRect().width") == 400
    card = page.evaluate("(({x, y}) => [x, y])(document.getElementById('card').getBoundingClientRect())")
    page.drag((card[0] + 100, card[1] + 20), (card[0] + 428, card[1] + 20), "left")
    page.click("#fitting [value=keep]")
    page.enter("[name=distance_cm]", "45")
    width_cm = pytest.approx(WIDTH * CARD_CM / 428)
    for _ in range(2):
        page.wait_for("document.getElementById('screen_told').textContent.includes('measured')")
        display = (
            page.shown(
                lambda header: (
                    header.config == page.said("configure")[-1]["id"]
                    and page.said("configure")[-1]["display"]["distance_cm"] == 45
                )
            )
            and page.said("configure")[-1]["display"]
        )
        assert display["width_cm"] == width_cm
        page.reload()
    page.shown()
    page.click("#calibrate")
    page.click("#fitting [value=forget]")
    page.wait_for("document.getElementById('screen_told').textContent.includes('assumed')")


def test_keys_are_listed_and_closed_again(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.press("?")
    listed = page.evaluate("document.getElementById('help').innerText")
    assert all(key in listed for key in ("Space", "hold the gaze", "draw the cells", "right drag"))
    page.press("c")
    page.press("Escape")
    assert page.evaluate("!document.getElementById('help').open && document.getElementById('drawn').hidden")
    page.press("s")
    page.wait_for("document.querySelectorAll('#scenes img[src^=blob]').length >= 2")
    told = page.evaluate("document.querySelector('#scenes [data-scene=matte]').innerText")
    assert "triangles" in told
    assert "no effects" in told
    page.press("Escape")
    assert not page.evaluate("document.getElementById('scenes').matches(':popover-open')")
    page.press("p")
    assert not page.evaluate("document.getElementById('panel').checkVisibility()")


def test_text_can_be_read_and_parts_do_not_overlap_on_a_laptop(page: Page, address: str) -> None:
    page.open(address + "/#spheres", *LAPTOP, settings=QUICK)
    page.shown(lambda header: header.phase == "final")
    page.press("c")
    for tab in ("cost", "quality", "screen"):
        page.click(f"#tab_{tab}")
        assert page.evaluate(FAINT_TEXTS) == []
        shown = f"document.querySelector('#{'cost' if tab == 'cost' else 'settings'}')"
        assert page.evaluate(f"{shown}.scrollWidth <= {shown}.clientWidth")
    boxes = page.evaluate(BOXES)
    assert {"bar", "tools", "panel", "legend"} <= set(boxes)
    for name, (left, top, right, bottom) in boxes.items():
        assert min(left, top) >= 0, name
        assert right <= LAPTOP[0], name
        assert bottom <= LAPTOP[1], name
        for other, (its_left, its_top, its_right, its_bottom) in boxes.items():
            apart = right <= its_left or its_right <= left or bottom <= its_top or its_bottom <= top
            assert name == other or apart, (name, other)
    for opened in ("help", "fitting", "token"):
        page.evaluate(f"document.getElementById('{opened}').showModal()")
        assert page.evaluate(FAINT_TEXTS) == []
        page.evaluate(f"document.getElementById('{opened}').close()")


def test_nothing_moves_while_frames_arrive(page: Page, address: str) -> None:
    page.open(address + "/#spheres", *LAPTOP, settings=QUICK)
    page.shown(lambda header: header.phase == "final")
    page.evaluate(
        "window.shift = 0; new PerformanceObserver((list) => { for (const entry of list.getEntries()) "
        "window.shift += entry.value; }).observe({ type: 'layout-shift' })"
    )
    places = """[...document.querySelectorAll('.chrome, #bar *, #tools *, #panel :is(dt, dd, th, td, h2, canvas, li)')]
      .map((part) => (({x, y, width, height}) => [x, y, width, height])(part.getBoundingClientRect()))"""
    before = page.evaluate(places)
    for x, y in ((200, 300), (600, 500)):
        page.point_at(x, y)
        page.shown(is_final_at(x, y))
    assert page.evaluate(places) == before
    assert page.evaluate("window.shift") < 0.01, "only figures, as wide as their digits, to the right of their column"


def test_it_moves_nothing_by_itself_for_those_who_ask_for_that(page: Page, address: str) -> None:
    page.open(address + "/#matte", WIDTH, HEIGHT, settings=QUICK)
    page.shown()
    page.evaluate("document.getElementById('connection').dataset.state = 'connecting'")
    assert page.evaluate("document.getAnimations().length") == 1
    page.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-reduced-motion", "value": "reduce"}])
    assert page.evaluate("document.getAnimations().length") == 0
