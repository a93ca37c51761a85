"""The page of the paper's figures and numbers beside ours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clients.report.html import figure, machine_facts, page, table, text


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """A figure of the paper as it came out here.

    Attributes:
        title: its number and subject.
        file: the picture.
        caption: what it shows.
    """

    title: str
    file: Path
    caption: str


def paper_page(record: dict[str, Any], figures: Sequence[PaperFigure]) -> str:
    """The page as one HTML document.

    Args:
        record: what figures.json holds.
        figures: in the paper's order.
    """
    time = record["time"]
    quick = "" if record["complete"] else '<p class="note">This is a quick run; the comparison calls for more rays.</p>'
    body = "\n".join(
        [
            "<main>",
            "<h1>The paper, made again</h1>",
            f"<p>{text(record['source'])}: its numbers beside those of gazetrace {text(record['version'])}. "
            "The full picture sends the same number of rays for each pixel that the gaze-dependent one sends for each "
            "cell, which is as wide as the eye can still resolve there.</p>",
            quick,
            "<h2>Camera rays</h2>",
            _rays_table(record["rays"]),
            "<h2>Time</h2>",
            f"<p>{text(time['scene'])} at {_size(time['display'])}, gaze {_place(time['gaze'])}, "
            f"{time['samples_per_cell']} rays a cell; whole frames, timed in turn, median of {time['repeats']}. Ratios "
            "are of the full picture over this one.</p>",
            _time_table(time),
            "<h2>What differs from the paper</h2>",
            "<ul>" + "".join(f"<li>{text(sentence)}</li>" for sentence in record["differences"]) + "</ul>",
            *(figure(shown.title, shown.file, shown.caption) for shown in figures),
            "<h2>Machine and command</h2>",
            machine_facts(record),
            "</main>",
        ]
    )
    return page("The paper, made again: gazetrace", body)


def _rays_table(lines: Sequence[dict[str, Any]]) -> str:
    rows: list[list[str]] = []
    seen = set()
    for line in lines:
        paper = line["paper"]
        screen = _size(line["display"])
        if screen not in seen:
            seen.add(screen)
            rows.append([f"{screen}, full", _millions(line["full_rays"]), _millions(paper["full_rays"]), "", "", ""])
        said = [_millions(paper["rays"]), f"{paper['ratio']:.2f}"] if paper else ["", ""]
        name = f"{screen}, {text(line['name'])}, gaze {_place(line['gaze'])}"
        ratio = f"{line['ratio']:.2f}"
        rows.append([name, _millions(line["rays"]), said[0], ratio, said[1], f"<small>{text(line['note'])}</small>"])
    heads = ("picture, 32 rays a cell", "rays here", "paper", "full over this", "paper", "")
    return table(heads, rows)


def _time_table(time: dict[str, Any]) -> str:
    rows = []
    for picture in time["pictures"]:
        ratio, spent = picture["time_ratio"], picture["time_ms"]
        spread = f" <small>{ratio['low']:.2f} to {ratio['high']:.2f}</small>" if time["repeats"] > 1 else ""
        error = picture["stated_error"]["foveal_rms"]
        rows.append(
            [
                text(picture["name"]),
                f"{spent['median']:,.0f} ms",
                f"{ratio['median']:.2f}{spread}",
                f"{picture['camera_ray_ratio']:.2f}",
                f"{picture['ray_ratio']:.2f}",
                f"{picture['rays']['primary']:,}",
                "" if error is None else f"{error:.5f}",
            ]
        )
    paper = time["paper"]
    name = f"the paper, {paper['samples_per_cell']} rays a cell"
    rows.append([name, "", f"{paper['time_ratio']:.2f}", f"{paper['ray_ratio']:.2f}", "", "", ""])
    heads = ("picture", "time", "time ratio", "ratio of camera rays", "of all rays", "camera rays", "foveal error")
    return table(heads, rows)


def _millions(count: float) -> str:
    return f"{count / 1e6:,.2f} M"


def _size(display: dict[str, Any]) -> str:
    return f"{display['width_px']}x{display['height_px']}"


def _place(gaze: dict[str, float]) -> str:
    return f"({gaze['x']:g}, {gaze['y']:g})"
