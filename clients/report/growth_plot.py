"""Time of a frame against its size, one panel for each thing that grows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from clients.report.plotting import BLUE, GREY, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS: Final = 3
"""Panels side by side."""


def draw_growth(series: Sequence[Mapping[str, Any]], stem: Path) -> tuple[Path, ...]:
    """Draw the measured times and the fitted power laws; the files.

    Args:
        series: of growth.json.
        stem: of the files.
    """
    rows = -(-len(series) // COLUMNS)
    figure = new_figure(4.1 * COLUMNS, 3.5 * rows)
    panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, one in zip(panels, series, strict=False):
        _draw(axes, one)
    for axes in panels[len(series) :]:
        axes.set_axis_off()
    return save(figure, stem, (".png", ".svg"))


def _draw(axes: Axes, one: Mapping[str, Any]) -> None:
    points, law = one["points"], one["time"]
    x = [point["x"] for point in points]
    below = [point["ms"] - point["low"] for point in points]
    above = [point["high"] - point["ms"] for point in points]
    axes.plot(x, [law["factor"] * at ** law["exponent"] for at in x], color=GREY, linewidth=1.6)
    axes.errorbar(x, [point["ms"] for point in points], (below, above), color=BLUE, fmt="o", markersize=5, capsize=2)
    axes.set(xscale="log", yscale="log", xlabel=one["x_label"], ylabel="time [ms]")
    by_rays = "" if one["time_of_rays"] is None else f", by rays {one['time_of_rays']:.2f}"
    axes.set_title(f"{one['name']}: exponent {law['exponent']:.2f}{by_rays}\n{one['note']}")
