"""Flicker in an accuracy report: what changes on the screen when only the gaze moves."""

from __future__ import annotations

from pathlib import Path

from clients.report.accuracy_data import Record
from clients.report.html import figure, table, text
from clients.report.plotting import BLUE, GREEN, VERMILION, new_figure, save

COLOURS = (VERMILION, BLUE, GREEN)
LINES = ("-", "-", "--")
"""One for each way of mapping, in the record's order."""

TITLE = "What flickers when only the gaze moves"


def temporal_section(temporal: Record, folder: Path) -> str:
    """Draw the flicker into `folder`; figure and table as HTML.

    Args:
        temporal: what temporal.json holds.
        folder: where the figure goes.
    """
    picture, *_ = draw_flicker(temporal, folder / "temporal")
    display = temporal["display"]
    caption = (
        "Scene and camera stand still, so nothing should change; what does is flicker, which is seen even where no "
        f"detail is. {display['width_px']}x{display['height_px']} pixels, {temporal['quality']['samples_per_cell']} "
        f"samples a cell; {len(temporal['gazes'])} gazes ({temporal['gaze_trace']}), "
        f"{temporal['frames_per_second']:g} a second. Cells of the aligned map keep their places as the gaze moves; "
        "with hysteresis, it stays as it is until the gaze has left it for good."
    )
    return figure(TITLE, picture, caption) + _table(temporal)


def draw_flicker(temporal: Record, stem: Path) -> tuple[Path, ...]:
    """Change of each step over time, and beside it the means over the screen and beyond 5 deg; the files."""
    drawing = new_figure(10.5, 4.0)
    steps, means = drawing.subplots(1, 2, width_ratios=(3, 2))
    for place, (way, colour, line) in enumerate(zip(temporal["ways"], COLOURS, LINES, strict=True)):
        seconds = [step / temporal["frames_per_second"] for step in range(1, way["steps"] + 1)]
        changes = [1e3 * change for change in way["step_changes"]]
        steps.plot(seconds, changes, line, color=colour, linewidth=1.6, label=way["way"])
        mean = 1e3 * way["change"]
        means.barh(place, mean, 0.62, color=colour)
        means.annotate(f"{mean:.3g}", (mean, place), (5, 0), textcoords="offset points", va="center")
    unit = "mean change of luminance, 1/1000 of white"
    steps.set(xlabel="time [s]", ylabel=unit, title="From frame to frame")
    steps.set_ylim(bottom=0)
    steps.legend()
    means.set_yticks(
        range(len(temporal["ways"])), [way["way"].replace(" with ", "\nwith ") for way in temporal["ways"]]
    )
    means.invert_yaxis()
    means.margins(x=0.2)
    means.set(xlabel=unit, title="Mean of all steps")
    means.grid(False, axis="y")
    return save(drawing, stem, (".png", ".svg"))


def _table(temporal: Record) -> str:
    rows = [
        [
            text(way["way"]),
            f"{1e3 * way['change']:.3f}",
            "–" if way["peripheral_change"] is None else f"{1e3 * way['peripheral_change']:.3f}",
            f"{1e3 * max(way['step_changes']):.3f}",
            f"{100 * way['changed_pixels']:.1f} %",
            f"{way['map_changes']} of {way['steps']}",
            f"{way['cells']:,.0f}",
        ]
        for way in temporal["ways"]
    ]
    heads = (
        "map", "change [1/1000 of white]", "beyond 5° from the gaze", "largest of a step", "pixels with another cell",
        "steps with another map", "cells",
    )  # fmt: skip
    return table(heads, rows)
