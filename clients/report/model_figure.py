"""The acuity models together: what each holds the eye to see, and the rays it costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from clients.report.plotting import BLUE, GREEN, INK, PURPLE, VERMILION, new_figure, save

COLOURS: Final = (VERMILION, BLUE, GREEN, PURPLE, "#b8860b", "#56b4e9", INK)
"""One for each model, in their order; line styles tell them apart too."""

LINES: Final = ("-", "--", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)), (0, (7, 2)), "-")

LARGEST_ANGLE_DEG: Final = 40.0
LOWEST_CPD: Final = 0.5
"""Where the axes end: beyond the corner of a desktop screen, and below every model there."""


@dataclass(frozen=True, slots=True)
class ModelCurve:
    """An acuity model.

    Attributes:
        name: of the model.
        angles_deg: eccentricities of its curve [deg].
        cut_off_cpd: finest detail seen there [cpd].
        cells_per_pixel: cells of the map for one gaze, as a share of the pixels.
        camera_rays: that a frame of these cells takes.
    """

    name: str
    angles_deg: Sequence[float]
    cut_off_cpd: Sequence[float]
    cells_per_pixel: float
    camera_rays: int


def draw_models(models: Sequence[ModelCurve], display_cpd: float, stem: Path) -> tuple[Path, ...]:
    """Cut-off frequency over eccentricity, and beside it the share of the pixels' rays that each model costs.

    Args:
        models: in the order in which they are drawn.
        display_cpd: highest frequency that the screen can show [cpd].
        stem: of the files.
    """
    figure = new_figure(10.5, 4.4)
    curves, bars = figure.subplots(1, 2, width_ratios=(3, 2))
    for model, colour, line in zip(models, COLOURS, LINES, strict=False):
        curves.semilogy(
            model.angles_deg, model.cut_off_cpd, color=colour, linestyle=line, linewidth=2, label=model.name
        )
    curves.axhline(display_cpd, color=INK, linewidth=1, linestyle=":")
    curves.annotate(
        f"the screen shows up to {display_cpd:.1f} cpd",
        (LARGEST_ANGLE_DEG, display_cpd),
        (-4, 4),
        textcoords="offset points",
        ha="right",
        color=INK,
    )
    ticks = (0.5, 1, 2, 5, 10, 20, 50)
    curves.set_yticks(ticks, [f"{value:g}" for value in ticks])
    curves.minorticks_off()
    curves.set(
        xlim=(0, LARGEST_ANGLE_DEG),
        ylim=(LOWEST_CPD, 90),
        xlabel="angle from the gaze [deg]",
        ylabel="cut-off frequency [cycles per degree]",
        title="Finest detail that the eye sees",
    )
    curves.legend(loc="lower left")
    places = range(len(models))
    bars.barh(places, [100 * model.cells_per_pixel for model in models], color=COLOURS[: len(models)], height=0.62)
    for place, model in zip(places, models, strict=True):
        words = f"{100 * model.cells_per_pixel:.1f} %, {model.camera_rays / 1e6:.2f} M rays"
        bars.annotate(words, (100 * model.cells_per_pixel, place), (5, 0), textcoords="offset points", va="center")
    bars.set_yticks(list(places), [model.name for model in models])
    bars.invert_yaxis()
    bars.set(
        xlim=(0, 175 * max(model.cells_per_pixel for model in models)),
        xlabel="cells, % of pixels",
        title="What it costs on this screen",
    )
    bars.grid(False, axis="y")
    return save(figure, stem, (".png", ".svg"))
