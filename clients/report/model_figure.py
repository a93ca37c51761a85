"""The acuity models together: what each holds the eye to see, the rays it costs, and the error it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from clients.report.plotting import BLUE, GREEN, INK, PURPLE, VERMILION, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS: Final = (VERMILION, BLUE, GREEN, PURPLE, "#b8860b", "#56b4e9", INK)
"""One for each model, in their order; line styles tell them apart too."""

LINES: Final = ("-", "--", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)), (0, (7, 2)), "-")

LARGEST_ANGLE_DEG: Final = 40.0
LOWEST_CPD: Final = 0.5
"""Where the axes end: beyond the corner of a desktop screen, and below every model there."""


@dataclass(frozen=True, slots=True)
class ModelCurve:
    """An acuity model; errors are None where they were not measured.

    Attributes:
        name: of the model.
        angles_deg: eccentricities of its curve [deg].
        cut_off_cpd: finest detail seen there [cpd].
        cells_per_pixel: cells of the map for one gaze, as a share of the pixels.
        camera_rays: that a frame of these cells takes.
        rms, foveal_rms: error of luminance of such a frame, over the screen and where the eye looks.
    """

    name: str
    angles_deg: Sequence[float]
    cut_off_cpd: Sequence[float]
    cells_per_pixel: float
    camera_rays: int
    rms: float | None = None
    foveal_rms: float | None = None


def draw_models(models: Sequence[ModelCurve], display_cpd: float, stem: Path) -> tuple[Path, ...]:
    """Cut-off frequency over eccentricity, beside it the share of the pixels' rays that each model costs, and errors.

    Args:
        models: in the order in which they are drawn.
        display_cpd: highest frequency that the screen can show [cpd].
        stem: of the files.
    """
    with_errors = any(model.rms is not None for model in models)
    figure = new_figure(14.0 if with_errors else 10.5, 4.4)
    curves, bars, *errors = figure.subplots(1, 3 if with_errors else 2, width_ratios=(3, 2, 2)[: 2 + with_errors])
    _draw_curves(curves, models, display_cpd)
    _draw_costs(bars, models)
    if errors:
        _draw_errors(errors[0], models)
    return save(figure, stem, (".png", ".svg"))


def _draw_curves(curves: Axes, models: Sequence[ModelCurve], display_cpd: float) -> None:
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


def _draw_costs(bars: Axes, models: Sequence[ModelCurve]) -> None:
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


def _draw_errors(bars: Axes, models: Sequence[ModelCurve]) -> None:
    """Two bars a model: over the screen, and thinner where the eye looks."""
    for place, (model, colour) in enumerate(zip(models, COLOURS, strict=False)):
        for value, offset, height, pattern in ((model.rms, -0.14, 0.36, ""), (model.foveal_rms, 0.22, 0.22, "////")):
            at = place + offset
            if value is not None:
                bars.barh(
                    at, value, height, facecolor=colour if not pattern else "white", edgecolor=colour, hatch=pattern
                )
            words = "not measured" if value is None and not pattern else "" if value is None else f"{value:.4f}"
            bars.annotate(words, (value or 0.0, at), (5, 0), textcoords="offset points", va="center", fontsize=8.5)
    bars.set_yticks(range(len(models)), [model.name for model in models])
    bars.set(
        ylim=(len(models) - 0.5, -0.5),
        xlim=(0, 1.4 * max(value for model in models for value in (model.rms, model.foveal_rms) if value is not None)),
        xlabel="rms error; hatched: where you look",
        title="What error it leaves",
    )
    bars.grid(False, axis="y")
