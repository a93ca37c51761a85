"""`gazetrace simulate`: what it counts, writes and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from clients.command_line import main
from clients.command_line.scaling.study import moving_work, new_cells
from renderer.acuity import Acuity
from renderer.cellmap import build_cell_map
from renderer.display import Display
from renderer.gaze import Gaze, bucket_of
from renderer.quality import Quality
from renderer.workers import WorkerPool
from tests.clients.commands import failing

pytestmark = pytest.mark.usefixtures("plain_environment")

SMALL = ("--size", "192x108", "--screen-cm", "50", "--distance-cm", "60", "--nodes", "1,2", "--viewers", "3")


def test_cells_are_those_of_the_map_and_new_ones_are_counted_one_by_one() -> None:
    display, quality = Display(320, 180, 50.0), Quality(acuity=Acuity(scale=4.0))
    pool = WorkerPool(1)
    gazes = Gaze(160, 90), Gaze(160 + 320 / 96, 90)
    maps = [build_cell_map("aligned", display, quality.acuity, bucket_of(gaze, 0), pool) for gaze in gazes]
    before, after = (set(zip(one.x, one.y, one.side, strict=True)) for one in maps)
    assert 0 < new_cells(*maps) == len(after - before) < len(after)
    exact = Quality(gaze_bucket_px=0, samples_per_cell=3, acuity=quality.acuity)
    everything, moved = moving_work(display, exact, pool)
    assert (everything.cells, moved.cells) == (len(before), len(after - before))
    assert (everything.pixels, everything.samples) == (320 * 180, 3)
    pool.close()


def test_it_writes_what_it_prints(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "rates.json").write_text('{"samples_per_s": 2e6}')
    rates = ("--rates", str(tmp_path / "rates.json"))
    assert main(["simulate", *SMALL, *rates, "-o", str(tmp_path / "out"), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "out" / "simulation.json").read_text()) == printed
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "simulation.json", "simulation.png", "simulation.svg",
    }  # fmt: skip
    assert printed["rates"]["samples_per_s"] == 2e6
    assert [point["nodes"] for point in printed["display"]["frames"][0]["points"]] == [1, 2]
    assert main(["simulate", *SMALL]) == 0
    assert "one display of 192x108, every cell" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--nodes", "4,2"), "--nodes: expected rising numbers from 1 to 10,000 such as 2,4,8, found '4,2'"),
        (("--nodes", "0"), "found '0'"),
        (("--nodes", "some"), "found 'some'"),
        (("--cores", "0"), "--cores: expected a number above 0"),
        (("--gbit", "nan"), "--gbit: expected a number above 0"),
        (("--viewers", "-1"), "--viewers: expected a number above 0"),
        (("--samples", "0"), "--samples: expected an integer from 1"),
        (("--distance-cm", "0"), "--distance-cm: expected a number"),
        (("--rates", "none.json"), "--rates: none.json: No such file or directory"),
        (("--output", "no/such"), "--output: expected a folder in an existing one"),
    ],
)
def test_bad_usage_is_one_line(words: tuple[str, ...], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert complaint in failing(capsys, "simulate", *SMALL, *words)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("{", "expected JSON"),
        ("[1]", "expected an object with some of samples_per_s, "),
        ('{"speed": 1}', "speed: expected one of samples_per_s, "),
        ('{"samples_per_s": 0}', "samples_per_s: expected a number above 0, found 0"),
        ('{"piece_s": "1"}', "piece_s: expected a number above 0, found '1'"),
        ('{"spread": Infinity}', "spread: expected a number above 0, found inf"),
    ],
)
def test_bad_rates_are_one_line(text: str, complaint: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "rates.json").write_text(text)
    assert complaint in failing(capsys, "simulate", *SMALL, "--rates", str(tmp_path / "rates.json"))
