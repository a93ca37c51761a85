"""How every plot here looks, and how it is saved. matplotlib is imported when the first one is made."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WANTED: Final = "matplotlib: pip install 'gazetrace[report]'"
"""What to say where it is not installed."""

DPI: Final = 150
"""Pixels an inch of a PNG."""

STYLE: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#5b6670",
    "axes.labelcolor": "#20262c",
    "axes.grid": True,
    "grid.color": "#dde2e6",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "xtick.color": "#5b6670",
    "ytick.color": "#5b6670",
    "xtick.labelcolor": "#20262c",
    "ytick.labelcolor": "#20262c",
    "legend.frameon": False,
    "svg.hashsalt": "gazetrace",
    "svg.fonttype": "path",
}
"""Dark text on white, quiet axes; the same input gives the same bytes."""

BLUE: Final = "#0072b2"
VERMILION: Final = "#d55e00"
GREEN: Final = "#009e73"
PURPLE: Final = "#cc79a7"
GREY: Final = "#9aa4ad"
INK: Final = "#20262c"
"""Colours that the colour-blind tell apart (Okabe and Ito 2008), and greys."""


def can_plot() -> bool:
    """Whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure in our style, laid out without overlaps [inch]."""
    import matplotlib
    from matplotlib.figure import Figure

    matplotlib.rcParams.update(STYLE)
    return Figure(figsize=(width_in, height_in), layout="constrained")


def save(figure: Figure, stem: Path, suffixes: Sequence[str] = (".png",)) -> tuple[Path, ...]:
    """Write the figure as `stem` plus each suffix (.png, .svg); the files, which name no date or program."""
    paths = tuple(stem.with_name(stem.name + suffix) for suffix in suffixes)
    for path in paths:
        metadata = {"Date": None, "Creator": None} if path.suffix == ".svg" else {"Software": None}
        figure.savefig(path, dpi=DPI, metadata=metadata, facecolor="white")
    return paths
