"""Time against accuracy as PNG and SVG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from clients.report.accuracy_data import Record, front_of, measured
from clients.report.measures import MEASURES, Measure
from clients.report.plotting import BLUE, GREEN, GREY, VERMILION, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OVERVIEW: Final = ("foveal_rms", "rms")
"""Measures of the plot that stands for all: where the eye looks, and over the whole screen."""

MARKS: Final = {"default": ("default", VERMILION, "D"), "paper": ("the paper's setting", GREEN, "s")}
"""Label, colour and shape of marked settings."""

LEAST_SHARE: Final = 0.3
"""Where a loss of 0 is drawn on a log axis: at this share of the smallest other one."""


def draw_plots(record: Record, folder: Path) -> tuple[Path, ...]:
    """Draw one plot a measure, and `accuracy`, which stands for all of them; the files.

    Args:
        record: what accuracy.json holds.
        folder: where they go.
    """
    files: list[Path] = []
    for measure in measured(record):
        files += _draw(record, (measure,), folder / f"accuracy-{measure.key.replace('_', '-')}")
    overview = [measure for measure in MEASURES if measure.key in OVERVIEW and measure in measured(record)]
    return (*files, *_draw(record, overview or measured(record)[:1], folder / "accuracy"))


def _draw(record: Record, measures: Sequence[Measure], stem: Path) -> tuple[Path, ...]:
    figure = new_figure(5.6 * len(measures) if len(measures) > 1 else 6.8, 4.5)
    grid = figure.subplots(1, len(measures), squeeze=False)
    for axes, measure in zip(grid[0], measures, strict=True):
        _draw_measure(axes, record, measure)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    display, gaze = record["display"], record["gaze"]
    figure.suptitle(
        f"{record['scene']}, {display['width_px']}x{display['height_px']}, gaze ({gaze['x']:g}, {gaze['y']:g})",
        fontsize=10.5,
    )
    return save(figure, stem, (".png", ".svg"))


def _draw_measure(axes: Axes, record: Record, measure: Measure) -> None:
    front = set(front_of(record, measure))
    points = [
        (setting, setting["time_ms"]["median"], loss)
        for setting in record["settings"]
        if (loss := measure.loss(setting["accuracy"])) is not None
    ]
    floor = LEAST_SHARE * min((loss for *_, loss in points if loss > 0), default=1.0)
    places = {setting["id"]: (time, max(loss, floor)) for setting, time, loss in points}
    dominated = [places[setting["id"]] for setting, *_ in points if setting["id"] not in front]
    best = sorted(place for name, place in places.items() if name in front)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.plot(*_columns(dominated), "o", color=GREY, markersize=5, label="beaten by another setting")
    axes.step(*_columns(best), where="post", color=BLUE, linewidth=1.2, alpha=0.6)
    axes.plot(*_columns(best), "o", color=BLUE, markersize=6.5, label="best for its time")
    for mark, (label, colour, shape) in MARKS.items():
        marked = [places[setting["id"]] for setting, *_ in points if mark in setting["marks"]]
        if marked:
            axes.plot(
                *_columns(marked),
                shape,
                color=colour,
                markersize=9,
                markeredgecolor="white",
                markeredgewidth=1.2,
                label=label,
            )
    axes.set(xlabel="time of a frame [ms]", ylabel=measure.axis, title=measure.name)
    _plain_numbers(axes)
    axes.grid(True, which="minor", linewidth=0.3)


def _plain_numbers(axes: Axes) -> None:
    """Ticks as plain numbers, enough of them."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    def number(value: float, _: Any) -> str:
        return f"{value:,.0f}" if value >= 1 else f"{value:.4f}".rstrip("0") if value >= 1e-4 else f"{value:.0e}"

    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
        axis.set_major_formatter(FuncFormatter(number))
        axis.set_minor_formatter(NullFormatter())


def _columns(points: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [x for x, _ in points], [y for _, y in points]
