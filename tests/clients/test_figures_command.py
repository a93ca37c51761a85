"""`gazetrace figures`: the paper's figures and numbers, in files."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from clients.command_line import main
from clients.command_line.figures_record import figures_text
from renderer.acuity import MODELS
from renderer.codec import decode_texture
from tests.clients.commands import SMALL, failing
from tests.service.chromium import Page

pytestmark = pytest.mark.usefixtures("plain_environment")

QUICK = (*SMALL, "--samples", "2", "--repeats", "2", "--scene", "matte")
PICTURES = (
    "figure-1.png",
    "figure-2.png",
    "figure-5.png",
    "figure-7.png",
    "full.png",
    "gaze-dependent.png",
    "acuity-models.png",
)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that one run has made."""
    folder = tmp_path_factory.mktemp("figures") / "paper"
    assert main(["figures", str(folder), *QUICK]) == 0
    return folder


def test_it_writes_every_figure_and_the_tables(made: Path) -> None:
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    assert {path.name for path in made.iterdir()} == {
        *PICTURES, "figure-1.svg", "acuity-models.svg", "figures.html", "figures.json", "figures.txt",
    }  # fmt: skip
    for name in PICTURES:
        pixels = decode_texture((made / name).read_bytes(), name).pixels
        assert pixels.std() > 5, f"{name} is blank"
    assert decode_texture((made / "full.png").read_bytes(), "full").pixels.shape == (54, 96, 3)
    for name in ("figure-1.svg", "acuity-models.svg"):
        assert (made / name).read_text().count("<svg") == 1


def test_the_record_holds_the_papers_numbers_beside_ours(made: Path) -> None:
    record = json.loads((made / "figures.json").read_text())
    first = record["rays"][0]
    assert first["paper"] == {"full_rays": 66.36e6, "rays": 20.65e6, "ratio": pytest.approx(3.2136, abs=1e-4)}
    assert first["full_rays"] == 1920 * 1080 * 32
    time = record["time"]
    assert time["paper"] == {"samples_per_cell": 32, "ray_ratio": 3.21, "time_ratio": 3.25}
    full, *reduced = time["pictures"]
    assert full["rays"]["primary"] == 96 * 54 * 2
    for picture in reduced:
        ratios = [a / b for a, b in zip(full["time_ms"]["repeats"], picture["time_ms"]["repeats"], strict=True)]
        assert picture["time_ratio"]["median"] == pytest.approx(np.median(ratios))
        assert picture["camera_ray_ratio"] == full["cells"] / picture["cells"]
    models = {cost["model"]: cost for cost in record["models"]}
    ours = next(picture for picture in reduced if picture["name"] == "our default")
    assert list(models) == list(MODELS)
    assert models["peli"]["cells"] == ours["cells"]
    assert models["peli"]["camera_rays"] == ours["rays"]["primary"]
    assert record["machine"]["threads"] >= 1
    assert not record["complete"]
    assert any("2 rays a cell, the paper's of 32" in sentence for sentence in record["differences"])
    text = figures_text(record)
    assert (made / "figures.txt").read_text() == text + "\n"
    assert re.search(r"^1920x1080, paper's map, gaze \(300, 405\) +2\d\.\d\d M +20\.65 M +3\.\d\d +3\.21$", text, re.M)
    assert all(sentence in text for sentence in record["differences"])


@pytest.mark.browser
def test_the_page_works_from_disk_and_fits_a_phone(made: Path, page: Page) -> None:
    for width, height in ((1366, 768), (390, 844)):
        page.open((made / "figures.html").as_uri(), width, height)
        page.wait_for("document.readyState === 'complete'")
        assert page.evaluate("[...document.images].map((image) => image.naturalWidth > 0)") == [True] * 5
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.complaints() == []
        asked = [event for event in page.events if event["method"] == "Network.requestWillBeSent"]
        assert {event["params"]["request"]["url"].partition(":")[0] for event in asked} == {"file", "data"}
    words = page.evaluate("document.body.innerText")
    record = json.loads((made / "figures.json").read_text())
    assert all(sentence in words for sentence in record["differences"])
    assert "20.65 M" in words
    assert "quick run" in words


def test_without_matplotlib_the_tables_are_written_and_the_extra_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["figures", str(tmp_path / "paper"), *QUICK, "--repeats", "1", "--json"]) == 0
    assert {path.name for path in (tmp_path / "paper").iterdir()} == {"figures.json", "figures.txt"}
    said = capsys.readouterr()
    assert json.loads(said.out)["rays"]
    assert said.err == (
        "gazetrace: note: figures and page are left out; they want matplotlib: pip install 'gazetrace[report]'\n"
    )


def test_bad_input_is_told_before_anything_is_rendered(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    cases = {
        ("--samples", "0"): "--samples: expected an integer from 1",
        ("--repeats", "0"): "--repeats: expected an integer from 1 to 100, found 0",
        ("--size", "0x9"): "--size: expected an integer from 1",
        ("--threads", "0"): "--threads",
    }
    for flags, message in cases.items():
        assert message in failing(capsys, "figures", "paper", *flags)
    assert "DIR: expected a folder, found the file" in failing(capsys, "figures", "file")
    assert "DIR: expected a folder in an existing one" in failing(capsys, "figures", "none/paper")
    assert not Path("paper").exists()
