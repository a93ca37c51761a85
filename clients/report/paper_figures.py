"""The paper's figures 1, 2, 5 and 7, drawn from arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clients.report.plotting import INK, VERMILION, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RINGS_DEG: Final = (2.5, 5.0, 10.0, 15.0, 20.0, 25.0)
"""Lines of equal eccentricity in figure 2 [deg]."""

LOWEST_SENSITIVITY: Final = 0.8
HIGHEST_SENSITIVITY: Final = 200.0

ENLARGED: Final = 20
"""One part in so many of the screen's width is enlarged in figure 5."""

SHOWN_SHARE: Final = 0.08
"""Share of an enlargement from which a side of cells counts as shown in it."""


@dataclass(frozen=True, eq=False, slots=True)
class Curves:
    """Contrast sensitivity over frequency at several eccentricities.

    Attributes:
        frequency_cpd: (n,) float64 [cpd].
        sensitivity: (n,) float64 by eccentricity [deg].
        cut_off_cpd: cut-off frequency by eccentricity [deg], without the screen's limit [cpd].
        display_cpd: highest frequency that the screen can show [cpd].
    """

    frequency_cpd: NDArray[np.float64]
    sensitivity: Mapping[float, NDArray[np.float64]]
    cut_off_cpd: Mapping[float, float]
    display_cpd: float


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """A cell map.

    Attributes:
        title: what it is.
        side: (n,) int32 side of each cell [px].
        mask: (h, w) int32 cell of each pixel.
    """

    title: str
    side: NDArray[np.int32]
    mask: NDArray[np.int32]


@dataclass(frozen=True, eq=False, slots=True)
class Picture:
    """A rendered picture.

    Attributes:
        title: what it is, and what it cost.
        pixels: (h, w, 3) uint8 sRGB.
    """

    title: str
    pixels: NDArray[np.uint8]


def draw_sensitivity(curves: Curves, stem: Path) -> tuple[Path, ...]:
    """Figure 1: a curve for each eccentricity, and on it the cut-off that the cells are made from."""
    figure = new_figure(7.2, 4.6)
    axes = figure.add_subplot()
    for eccentricity, colour in zip(curves.sensitivity, _shades(len(curves.sensitivity)), strict=True):
        values = curves.sensitivity[eccentricity]
        axes.loglog(curves.frequency_cpd, values, color=colour, linewidth=2, label=f"{eccentricity:g}°")
        axes.plot(curves.cut_off_cpd[eccentricity], 1.0, "o", color=colour, markersize=7, markeredgecolor="white")
    axes.axhline(1.0, color=INK, linewidth=0.8)
    axes.axvline(curves.display_cpd, color=VERMILION, linewidth=1.4, linestyle="--")
    axes.annotate(
        f"the screen shows\nup to {curves.display_cpd:.1f} cpd",
        (curves.display_cpd, 150),
        (6, 0),
        textcoords="offset points",
        va="top",
        color=VERMILION,
    )
    axes.set(
        xlim=(curves.frequency_cpd[0], curves.frequency_cpd[-1]),
        ylim=(LOWEST_SENSITIVITY, HIGHEST_SENSITIVITY),
        xlabel="spatial frequency [cycles per degree]",
        ylabel="contrast sensitivity, 1 / threshold",
        title="Contrast sensitivity by angle from the gaze; dots: cut-off frequency (eq. 2)",
    )
    _plain_ticks(axes, (0.5, 1, 2, 5, 10, 20, 50), (1, 2, 5, 10, 20, 50, 100, 200))
    axes.legend(title="eccentricity", loc=(0.01, 0.06), ncols=2)
    return save(figure, stem, (".png", ".svg"))


def draw_region_of_interest(
    cut_off_cpd: NDArray[np.float64],
    eccentricity_deg: NDArray[np.float64],
    gaze: tuple[float, float],
    stem: Path,
) -> tuple[Path, ...]:
    """Figure 2: the finest detail that the eye sees at each place of the screen, white for the most.

    Args:
        cut_off_cpd: (h, w) float64 cut-off frequency [cpd].
        eccentricity_deg: (h, w) float64 [deg].
        gaze: (x, y) [px].
        stem: of the files.
    """
    height, width = cut_off_cpd.shape
    figure = new_figure(8.0, 6.6 * height / width + 0.75)
    axes = figure.add_subplot()
    extent = (0, width, height, 0)
    shown = axes.imshow(cut_off_cpd, cmap="gray", vmin=0, extent=extent)
    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    axes.contour(x, y, eccentricity_deg, levels=RINGS_DEG, colors=VERMILION, linewidths=1.1)
    for ring_deg, place in _ring_places(eccentricity_deg, gaze):
        backing = {"facecolor": "white", "edgecolor": "none", "boxstyle": "round,pad=0.15", "alpha": 0.85}
        axes.text(*place, f"{ring_deg:g}°", color=INK, fontsize=8.5, ha="center", va="center", bbox=backing)
    _mark_gaze(axes, gaze)
    _screen_axes(axes, "Region of interest: cut-off frequency of the eye, and angle from the gaze")
    figure.colorbar(shown, ax=axes, label="cut-off frequency [cycles per degree]", fraction=0.03, pad=0.015)
    return save(figure, stem)


def draw_cell_maps(maps: Sequence[Cells], gaze: tuple[float, float], stem: Path) -> tuple[Path, ...]:
    """Figure 5: cells coloured by their side, and each of them outlined where the map is enlarged.

    Args:
        maps: of the same screen, side by side.
        gaze: (x, y) [px].
        stem: of the files.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap

    height, width = maps[0].mask.shape
    largest = max(int(cells.side.max()) for cells in maps)
    colours = ListedColormap(["#ffffff", *_shades(largest - 1, reverse=True)] if largest > 1 else ["#ffffff"])
    norm = BoundaryNorm(np.arange(0.5, largest + 1.5), largest)
    figure = new_figure(5.6 * len(maps), 5.6 * height / width * 2 + 1.3)
    grid = figure.subplots(2, len(maps), squeeze=False)
    window = _enlarged_window([cells.side[cells.mask] for cells in maps], gaze)
    for column, cells in enumerate(maps):
        sides = cells.side[cells.mask]
        whole, near = grid[0, column], grid[1, column]
        shown = whole.imshow(sides, cmap=colours, norm=norm, extent=(0, width, height, 0), interpolation="nearest")
        _mark_gaze(whole, gaze, VERMILION)
        _frame_window(whole, window)
        _screen_axes(whole, cells.title)
        _draw_window(near, cells.mask, sides, window, colours, norm)
        _screen_axes(near, "enlarged: the marked window, each cell outlined")
    bar = figure.colorbar(
        shown, ax=grid, location="bottom", label="side of a cell [px]", shrink=0.5, aspect=40, pad=0.02
    )
    bar.set_ticks(list(range(1, largest + 1)))
    bar.ax.tick_params(length=0)
    return save(figure, stem)


def draw_comparison(
    pictures: Sequence[Picture],
    gaze: tuple[float, float],
    windows: Sequence[tuple[str, tuple[int, int, int, int]]],
    stem: Path,
) -> tuple[Path, ...]:
    """Figure 7: pictures of the same view side by side, the gaze marked, with places of them enlarged below.

    Args:
        pictures: all of the same size.
        gaze: (x, y) [px].
        windows: what to call each place, and its left, top, right and bottom [px].
        stem: of the files.
    """
    height, width = pictures[0].pixels.shape[:2]
    columns = len(pictures) * len(windows)
    figure = new_figure(13.0, 13.0 / len(pictures) * height / width + 13.0 / columns + 0.9)
    rows = (13.0 / len(pictures) * height / width, 13.0 / columns)
    layout = figure.add_gridspec(2, columns, height_ratios=rows)
    for index, picture in enumerate(pictures):
        first = index * len(windows)
        whole = figure.add_subplot(layout[0, first : first + len(windows)])
        whole.imshow(picture.pixels, extent=(0, width, height, 0), interpolation="lanczos")
        _bare(whole, picture.title)
        for part, (name, window) in enumerate(windows):
            _frame_window(whole, window)
            _mark_gaze(whole, gaze)
            left, top, right, bottom = window
            near = figure.add_subplot(layout[1, first + part])
            near.imshow(
                picture.pixels[top:bottom, left:right], extent=(left, right, bottom, top), interpolation="nearest"
            )
            _bare(near, name)
            if left <= gaze[0] <= right and top <= gaze[1] <= bottom:
                _mark_gaze(near, gaze, VERMILION)
    return save(figure, stem)


def _shades(count: int, reverse: bool = False) -> list[Any]:
    """So many colours from dark violet to yellowish green, in even steps of lightness (viridis)."""
    import matplotlib

    places = np.linspace(0.0, 0.88, count) if count > 1 else np.array([0.4])
    return [matplotlib.colormaps["viridis"](place) for place in (places[::-1] if reverse else places)]


def _ring_places(
    eccentricity_deg: NDArray[np.float64], gaze: tuple[float, float]
) -> list[tuple[float, tuple[float, float]]]:
    """Where each ring crosses the gaze's row, on the side of the gaze with more room: [deg], (x, y) [px]."""
    height, width = eccentricity_deg.shape
    row = int(np.clip(gaze[1], 0, height - 1))
    start = int(np.clip(gaze[0], 0, width - 1))
    columns = np.arange(start, width) if start < width / 2 else np.arange(start, -1, -1)
    places = []
    for ring_deg in RINGS_DEG:
        beyond = np.nonzero(eccentricity_deg[row, columns] >= ring_deg)[0]
        if len(beyond) and beyond[0] > 0:
            places.append((ring_deg, (columns[beyond[0]] + 0.5, row + 0.5)))
    return places


def _enlarged_window(sides: Sequence[NDArray[np.int32]], gaze: tuple[float, float]) -> tuple[int, int, int, int]:
    """Left, top, right, bottom [px] of a small window between the gaze and the farthest corner of the screen.

    It has the screen's shape and lies where every one of the maps, (h, w) int32 sides, changes its cells, if any does.
    """
    height, width = sides[0].shape
    half_width = max(8, width // (2 * ENLARGED))
    half_height = max(5, half_width * height // width)
    corner = (0.0 if gaze[0] > width / 2 else float(width), 0.0 if gaze[1] > height / 2 else float(height))
    best = (0, (0, 0, width, height))
    for part in np.linspace(0.35, 0.85, 41):
        x = int(np.clip(gaze[0] + part * (corner[0] - gaze[0]), half_width, max(half_width, width - half_width)))
        y = int(np.clip(gaze[1] + part * (corner[1] - gaze[1]), half_height, max(half_height, height - half_height)))
        window = (
            max(0, x - half_width),
            max(0, y - half_height),
            min(width, x + half_width),
            min(height, y + half_height),
        )
        shown = min(_sides_shown(map_sides, window) for map_sides in sides)
        if shown > best[0]:
            best = (shown, window)
    return best[1]


def _sides_shown(sides: NDArray[np.int32], window: tuple[int, int, int, int]) -> int:
    left, top, right, bottom = window
    counts = np.unique_counts(sides[top:bottom, left:right]).counts
    return int(np.count_nonzero(counts >= SHOWN_SHARE * counts.sum()))


def _draw_window(
    axes: Axes,
    mask: NDArray[np.int32],
    sides: NDArray[np.int32],
    window: tuple[int, int, int, int],
    colours: Any,
    norm: Any,
) -> None:
    left, top, right, bottom = window
    from matplotlib.collections import LineCollection

    part = mask[top:bottom, left:right]
    axes.imshow(
        sides[top:bottom, left:right],
        cmap=colours,
        norm=norm,
        extent=(left, right, bottom, top),
        interpolation="nearest",
    )
    rows, columns = np.nonzero(part[:, 1:] != part[:, :-1])
    upright = [[(left + x + 1, top + y), (left + x + 1, top + y + 1)] for y, x in zip(rows, columns, strict=True)]
    rows, columns = np.nonzero(part[1:] != part[:-1])
    level = [[(left + x, top + y + 1), (left + x + 1, top + y + 1)] for y, x in zip(rows, columns, strict=True)]
    axes.add_collection(LineCollection(upright + level, colors=INK, linewidths=0.8))


def _mark_gaze(axes: Axes, gaze: tuple[float, float], colour: str = VERMILION) -> None:
    """A cross with a white backing; nothing changes its size."""
    axes.plot(*gaze, "+", color="white", markersize=17, markeredgewidth=4.5)
    axes.plot(*gaze, "+", color=colour, markersize=15, markeredgewidth=2.2)


def _frame_window(axes: Axes, window: tuple[int, int, int, int]) -> None:
    left, top, right, bottom = window
    x, y = (left, right, right, left, left), (top, top, bottom, bottom, top)
    axes.plot(x, y, color="white", linewidth=3.2)
    axes.plot(x, y, color=VERMILION, linewidth=1.5)


def _screen_axes(axes: Axes, title: str) -> None:
    axes.set(title=title, xlabel="x [px]", ylabel="y [px]")
    axes.grid(False)


def _bare(axes: Axes, title: str) -> None:
    axes.set(title=title, xticks=(), yticks=())
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _plain_ticks(axes: Axes, x: Sequence[float], y: Sequence[float]) -> None:
    """Ticks at these places of log axes, as plain numbers."""
    axes.set_xticks(x, [f"{value:g}" for value in x])
    axes.set_yticks(y, [f"{value:g}" for value in y])
    axes.minorticks_off()
