"""How frames scale over the nodes of a cluster: one large display, and many viewers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from clients.report.plotting import BLUE, GREEN, GREY, INK, PURPLE, VERMILION, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ORANGE: Final = "#e69f00"
"""Of the same colours as the others."""

BOUNDS: Final = {
    "trace": ("all workers tracing without a break", BLUE),
    "encode": ("encoding, by one core", VERMILION),
    "picture": ("map and picture, by the service's cores", ORANGE),
    "hand": ("the service's thread: packing, taking in", PURPLE),
    "wire": ("the service's network", GREEN),
}
"""What a bound is called, and its colour."""

BELOW: Final[dict[str, Any]] = {"fontsize": 8, "loc": "upper center", "bbox_to_anchor": (0.5, -0.13)}
"""Where legends stand, clear of the lines."""

MS_PER_S: Final = 1e3


def draw_scaling(record: Mapping[str, Any], stem: Path) -> tuple[Path, ...]:
    """Draw what `gazetrace simulate` found; the files.

    Args:
        record: of simulation.json.
        stem: of the files.
    """
    figure = new_figure(11.0, 6.0)
    left, right = figure.subplots(1, 2)
    _display(left, record)
    _viewers(right, record)
    return save(figure, stem, (".png", ".svg"))


def _display(axes: Axes, record: Mapping[str, Any]) -> None:
    display = record["display"]
    everything = display["frames"][0]
    nodes = [point["nodes"] for point in everything["points"]]
    for name, (label, colour) in BOUNDS.items():
        bound = [MS_PER_S * point["bounds_s"][name] for point in everything["points"]]
        axes.plot(nodes, bound, color=colour, linewidth=1.2, linestyle="--", label=f"alone: {label}")
    for frame, style in zip(display["frames"], ("o-", "s-", "^-"), strict=True):
        times = [MS_PER_S * point["frame_s"] for point in frame["points"]]
        axes.plot(nodes, times, style, color=INK, markersize=4, linewidth=1.4, label=f"frame: {frame['name']}")
    axes.axhline(MS_PER_S / display["rate_hz"], color=GREY, linewidth=1.0)
    axes.text(nodes[0], MS_PER_S / display["rate_hz"], f"{display['rate_hz']:g} Hz", va="bottom", color=GREY)
    axes.set(xscale="log", yscale="log", xlabel="nodes that trace", ylabel="time of a frame [ms]")
    axes.set_title(f"One display of {display['width_px']}x{display['height_px']} (simulated)")
    axes.legend(**BELOW)


def _viewers(axes: Axes, record: Mapping[str, Any]) -> None:
    viewers = record["viewers"]
    for frame, style in zip(viewers["frames"], ("o-", "s--"), strict=True):
        nodes = [point["nodes"] for point in frame["points"]]
        for name, label, colour in (
            ("service_each_hz", "a service on each node", BLUE),
            ("one_service_hz", "one service, nodes trace for it", VERMILION),
        ):
            rates = [point[name] for point in frame["points"]]
            axes.plot(nodes, rates, style, color=colour, markersize=4, label=f"{label}: {frame['name']}")
    axes.axhline(viewers["rate_hz"], color=GREY, linewidth=1.0)
    axes.set(xscale="log", yscale="log", xlabel="nodes", ylabel="frames a second, each viewer")
    axes.set_title(f"{viewers['count']:,} viewers of {viewers['width_px']}x{viewers['height_px']} (simulated)")
    axes.legend(**BELOW)
