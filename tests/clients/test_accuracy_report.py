"""The report of what accuracy costs: its numbers, its plots, and its page in a real browser."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from clients.report.accuracy_data import front_of, measured, missing
from clients.report.accuracy_report import write_report
from clients.report.measures import MEASURES, jod_words
from clients.report.models_section import model_curves
from clients.report.pictures import shrink, window_around
from renderer.accuracy.record import Accuracy, report_json
from renderer.acuity import Acuity
from renderer.codec import decode_texture
from renderer.quality import Quality
from tests.clients.accuracy_record import FRONT, TIMES_AND_ERRORS, record, with_jod, write_flicker, write_measurement
from tests.service.chromium import Page

MEASURED = ["foveal_rms", "rms", "relative_mse", "foveal_max_error", "foveal_psnr_db", "luminance_ratio"]

DRAWN = "document.querySelector('.point') !== null"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A measurement with its report, in another place than where the report was written."""
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    folder = tmp_path_factory.mktemp("report") / "here"
    write_measurement(folder, record())
    write_flicker(folder)
    write_report(folder)
    return Path(shutil.move(folder, folder.with_name("there")))


# Numbers


def test_every_measure_is_one_of_the_record() -> None:
    assert [measure.key for measure in MEASURES if measure.key not in Accuracy.__dataclass_fields__] == []


def test_a_loss_is_zero_where_frame_and_reference_are_alike() -> None:
    alike = {"luminance_ratio": 1.0, "jod": 10.0, "foveal_psnr_db": None}
    for measure in MEASURES:
        value = alike.get(measure.key, 0.0)
        assert measure.loss({measure.key: value}) == (None if value is None else 0.0)
        assert measure.loss({}) is None


@given(better=st.floats(0, 1), worse=st.floats(0, 1))
def test_a_loss_grows_as_accuracy_falls(better: float, worse: float) -> None:
    loss = {measure.key: measure.loss for measure in MEASURES}
    better, worse = sorted((better, worse))
    assert loss["rms"]({"rms": better}) == better
    assert loss["jod"]({"jod": 10 - worse}) == pytest.approx(worse)
    assert loss["luminance_ratio"]({"luminance_ratio": 1 - worse}) == pytest.approx(worse)
    dark, bright = (loss["foveal_psnr_db"]({"foveal_psnr_db": 60 * value}) for value in (better, worse))
    assert bright is not None
    assert dark is not None
    assert bright <= dark
    assert loss["foveal_psnr_db"]({"foveal_psnr_db": 40.0}) == pytest.approx(0.01)


def test_metrics_that_were_not_there_are_left_out_and_named() -> None:
    values = json.loads(report_json(record()))
    assert [measure.key for measure in measured(values)] == MEASURED
    assert [sentence.partition(" ")[0] for sentence in missing(values)] == ["FLIP", "JOD"]
    values = json.loads(report_json(with_jod(record(), 9.5)))
    assert [measure.key for measure in measured(values)] == [*MEASURED, "jod", "jod_heat_foveal_p99"]
    assert [sentence.partition(" ")[0] for sentence in missing(values)] == ["FLIP"]


def test_the_front_is_of_time_and_loss() -> None:
    values = json.loads(report_json(record()))
    for measure in measured(values):
        if measure.key != "foveal_psnr_db":
            assert list(front_of(values, measure)) == FRONT
    unknown = replace(record().settings[0].accuracy, rms=0.0, foveal_rms=None)
    settings = (replace(record().settings[0], accuracy=unknown), *record().settings[1:])
    values = json.loads(report_json(replace(record(), settings=settings)))
    by_key = {measure.key: measure for measure in measured(values)}
    assert list(front_of(values, by_key["rms"])) == FRONT[:1]
    assert list(front_of(values, by_key["foveal_rms"])) == FRONT[1:]


@pytest.mark.parametrize(
    ("jod", "share", "words"),
    [
        (9.9, "52.7 %", "our own target"),
        (9.75, "56.7 %", "our own target"),
        (9.5, "63.2 %", "below one just-noticeable difference in a two-way choice (75 % rule)"),
        (9.0, "75.0 %", "below one just-noticeable difference in a two-way choice (75 % rule)"),
        (8.0, "91.1 %", "more than one just-noticeable difference"),
    ],
)
def test_a_jod_is_told_as_preference(jod: float, share: str, words: str) -> None:
    """Shares as published with the scaling method (Perez-Ortiz and Mantiuk 2017)."""
    said = jod_words(jod)
    assert share in said
    assert words in said
    assert not re.search("lossless|invisible|not noticeable", said)


def test_a_model_has_the_error_of_the_setting_that_is_the_default_but_for_it() -> None:
    report = record()
    names = ["aligned-1", "full-1"]
    changed = {
        "aligned-1": {"group": "acuity_model", "quality": Quality(acuity=Acuity("guenter"))},
        "full-1": {"group": "map", "quality": Quality(map="full", acuity=Acuity("guenter"))},
    }
    settings = tuple(replace(each, **changed.get(each.id, {})) for each in reversed(report.settings))  # type: ignore[arg-type]
    assert {each.id for each in settings} >= set(names)
    peli, guenter = model_curves(json.loads(report_json(replace(report, settings=settings))))
    assert (peli.name, peli.rms, peli.foveal_rms) == ("peli", TIMES_AND_ERRORS["aligned-4"][1], 0.02)
    assert (guenter.name, guenter.rms, guenter.camera_rays) == ("guenter", TIMES_AND_ERRORS["aligned-1"][1], 1200)
    _, unmeasured = model_curves(json.loads(report_json(report)))
    assert (unmeasured.rms, unmeasured.foveal_rms) == (None, None)


# Pictures


def linear(pixels: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Light of sRGB codes (IEC 61966-2-1)."""
    code = pixels / 255
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


@given(factor=st.integers(1, 4), data=st.data())
def test_a_smaller_picture_has_the_light_of_the_larger(factor: int, data: st.DataObject) -> None:
    random = np.random.default_rng(data.draw(st.integers(0, 999)))
    pixels = random.integers(0, 256, (6 * factor, 9 * factor, 3), dtype=np.uint8)
    small = shrink(pixels, 9)
    assert small.shape == (6, 9, 3)
    light = linear(pixels).reshape(6, factor, 9, factor, 3).mean(axis=(1, 3))
    steps = np.abs(linear(np.minimum(small.astype(int) + 1, 255).astype(np.uint8)) - linear(small))
    assert (np.abs(linear(small) - light) <= steps + 1e-6).all()
    if factor == 1:
        assert_array_equal(small, pixels)


@given(x=st.floats(-1e4, 1e4), y=st.floats(-1e4, 1e4), width=st.integers(1, 2000), height=st.integers(1, 2000))
def test_a_window_lies_on_the_screen(x: float, y: float, width: int, height: int) -> None:
    left, top, right, bottom = window_around(x, y, width, height)
    assert 0 <= left < right <= width
    assert 0 <= top < bottom <= height
    assert (right - left, bottom - top) == (min(160, width), min(160, height))
    if 80 <= x <= width - 80:
        assert_allclose((left + right) / 2, x, atol=1)


def test_every_measure_has_a_plot_as_png_and_svg(made: Path) -> None:
    stems = ["accuracy", "acuity-models", "temporal", *(f"accuracy-{key.replace('_', '-')}" for key in MEASURED)]
    for stem in stems:
        assert decode_texture((made / f"{stem}.png").read_bytes(), stem).pixels.std() > 5
        assert (made / f"{stem}.svg").read_text().count("<svg") == 1


# The page


def points(page: Page, kind: str = "") -> list[str]:
    found: list[str] = page.evaluate(f"[...document.querySelectorAll('.point{kind}')].map((point) => point.dataset.id)")
    return found


def rows(page: Page) -> list[str]:
    found: list[str] = page.evaluate(
        "[...document.querySelectorAll('#settings tbody tr')].map((row) => row.dataset.id)"
    )
    return found


@pytest.mark.browser
def test_the_page_works_from_disk_in_light_and_dark_and_on_a_phone(made: Path, page: Page) -> None:
    for width, height, scheme in ((1366, 768, "light"), (1366, 768, "dark"), (390, 844, "light")):
        page.open((made / "report.html").as_uri(), width, height)
        page.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        page.wait_for(f"document.readyState === 'complete' && {DRAWN}")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert all(page.evaluate("[...document.images].map((image) => image.naturalWidth > 0)"))
        assert page.complaints() == []
        asked = [event for event in page.events if event["method"] == "Network.requestWillBeSent"]
        assert {event["params"]["request"]["url"].partition(":")[0] for event in asked} == {"file", "data"}
        background = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (sum(map(int, re.findall(r"\d+", background))) < 150) == (scheme == "dark")


@pytest.mark.browser
def test_points_lie_by_time_and_loss_and_the_front_is_marked(made: Path, page: Page) -> None:
    page.open((made / "report.html").as_uri(), 1366, 768)
    page.wait_for(DRAWN)
    assert sorted(points(page)) == sorted(TIMES_AND_ERRORS)
    assert sorted(points(page, ".front")) == sorted(FRONT)
    assert points(page, ".default") == ["aligned-4"]
    assert points(page, ".paper") == ["paper"]
    names = page.evaluate("[...document.querySelectorAll('#plot .name')].map((name) => name.textContent)")
    assert sorted(names) == ["default", "the paper's setting"]
    centre = "[...document.querySelectorAll('.point')].map((point) => [point.dataset.id, ...['cx', 'cy'].map((name) => "
    centre += "Number(point.querySelector('.target').getAttribute(name)))])"
    places = {name: (x, y) for name, x, y in page.evaluate(centre)}
    ids = list(TIMES_AND_ERRORS)
    x = np.array([places[name][0] for name in ids])
    y = np.array([places[name][1] for name in ids])
    times = np.log([TIMES_AND_ERRORS[name][0] for name in ids])
    losses = np.log([TIMES_AND_ERRORS[name][1] for name in ids])
    slope_x, at_x = np.polyfit(times, x, 1)
    slope_y, at_y = np.polyfit(losses, y, 1)
    assert_allclose(slope_x * times + at_x, x, atol=0.1)
    assert_allclose(slope_y * losses + at_y, y, atol=0.1)
    assert slope_x > 0 > slope_y
    assert page.complaints() == []


@pytest.mark.browser
def test_a_measure_and_a_setting_can_be_chosen(made: Path, page: Page) -> None:
    page.open((made / "report.html").as_uri(), 1366, 768)
    page.wait_for(DRAWN)
    offered = page.evaluate("[...document.querySelectorAll('#measures input')].map((input) => input.value)")
    assert offered == MEASURED
    page.click("#measures input[value='rms']")
    assert "rms error of luminance over the screen" in page.evaluate("document.getElementById('plot').textContent")
    assert "no gaze" in page.evaluate("document.getElementById('sees').textContent")
    shown = "document.querySelector('.pictures.whole figure:nth-child(2)')"
    assert page.evaluate("document.getElementById('setting').value") == "aligned-4"
    before = page.evaluate(f"{shown}.querySelector('img').src")
    page.evaluate("document.querySelector('.point[data-id=full-16]').dispatchEvent(new MouseEvent('click'))")
    assert page.evaluate("document.getElementById('setting').value") == "full-16"
    assert page.evaluate(f"{shown}.textContent") == "<full-16> & more full size"
    assert page.evaluate(f"{shown}.querySelector('img').src") != before
    assert page.evaluate(f"{shown}.querySelector('a').getAttribute('href')") == "frames/full-16.png"
    assert points(page, ".chosen") == ["full-16"]
    assert page.evaluate("document.querySelectorAll('#compare img').length") == 3 + 4
    page.click("#settings tr[data-id=paper] td button")
    assert points(page, ".chosen") == ["paper"]
    assert page.complaints() == []


@pytest.mark.browser
def test_the_table_sorts_both_ways(made: Path, page: Page) -> None:
    page.open((made / "report.html").as_uri(), 1366, 768)
    page.wait_for(DRAWN)
    assert rows(page) == list(TIMES_AND_ERRORS)
    by_time = sorted(TIMES_AND_ERRORS, key=lambda name: TIMES_AND_ERRORS[name][0])
    heading = "#settings th:nth-child(3) button"
    page.click(heading)
    assert rows(page) == by_time
    page.click(heading)
    assert rows(page) == by_time[::-1]
    assert page.evaluate("document.querySelector('#settings th[aria-sort]').getAttribute('aria-sort')") == "descending"
    page.click("#settings th:nth-child(7) button")
    losses = [TIMES_AND_ERRORS[name][1] for name in rows(page)]
    assert losses == sorted(losses)
    page.click("#settings th:nth-child(1) button")
    assert rows(page) == sorted(TIMES_AND_ERRORS)
    best = page.evaluate(
        "[...document.querySelectorAll('#settings tbody tr')].filter((row) => row.cells[5].matches('.best'))"
        ".map((row) => row.dataset.id)"
    )
    assert sorted(best) == sorted(FRONT)


@pytest.mark.browser
def test_the_words_say_what_was_measured_where_and_what_is_missing(made: Path, page: Page) -> None:
    page.open((made / "report.html").as_uri(), 1366, 768)
    page.wait_for(DRAWN)
    words = page.evaluate("document.body.innerText")
    for expected in (
        "What accuracy costs: atrium", "381,000 triangles", "gazetrace accuracy atrium -o DIR", "A processor", "1.2.3",
        "numpy 2.4", "256 rays a pixel", "0.0012", "flip-evaluator", "pyfvvdp", "4,000 primary, 300 shadow",
    ):  # fmt: skip
        assert expected in words


@pytest.mark.browser
def test_models_and_flicker_are_sections_of_the_page(made: Path, page: Page) -> None:
    page.open((made / "report.html").as_uri(), 1366, 768)
    page.wait_for(DRAWN)
    headings = page.evaluate("[...document.querySelectorAll('h2')].map((heading) => heading.textContent)")
    assert headings[3:5] == ["Acuity models", "What flickers when only the gaze moves"]
    tables = "[...document.querySelectorAll('table')].slice(1).map((table) => [...table.tBodies[0].rows].map((row) => "
    models, ways = page.evaluate(tables + "[...row.cells].map((cell) => cell.innerText.split('\\n')[0])))")
    assert models == [
        ["peli", "40°", "1,200", "5.8 %", "4,800", "30.0", "0.02", "0.04"],
        ["guenter", "40°", "300", "1.4 %", "1,200", "–", "–", "–"],
    ]
    assert [way[:4] for way in ways] == [
        ["scanline", "20.000", "–", "40.000"],
        ["aligned", "10.000", "–", "20.000"],
        ["aligned with hysteresis", "6.667", "–", "13.333"],
    ]
    pictures = page.evaluate("[...document.querySelectorAll('main > figure > img')].map((image) => image.naturalWidth)")
    assert len(pictures) == 2
    assert min(pictures) > 1000
    assert "(<eye>.csv)" in page.evaluate("document.body.innerText")
    assert page.complaints() == []


def test_flicker_of_another_scene_is_no_section(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    write_measurement(tmp_path / "found", record())
    write_flicker(tmp_path / "found", "spheres")
    write_report(tmp_path / "found")
    assert "What flickers" not in (tmp_path / "found" / "report.html").read_text()
