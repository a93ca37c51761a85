"""The paper's figures: what the renderer says, handed to what draws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clients.command_line.figures_record import millions, place, size
from clients.command_line.render import write_whole
from clients.report.model_figure import ModelCurve, draw_models
from clients.report.paper_figures import (
    Cells,
    Curves,
    Picture,
    draw_cell_maps,
    draw_comparison,
    draw_region_of_interest,
    draw_sensitivity,
)
from clients.report.paper_page import PaperFigure

if TYPE_CHECKING:
    from renderer.acuity_comparison import ModelCost
    from renderer.paper.timing import TimeComparison

ENLARGED = 16
"""One part in so many of the screen's width is enlarged in figure 7."""


FIGURES = 5
"""How many `draw_figures` draws."""


def draw_figures(
    folder: Path, times: TimeComparison, models: Sequence[ModelCost], tick: Callable[[], None]
) -> list[PaperFigure]:
    """Draw figures 1, 2, 5 and 7, and the acuity models, into a folder.

    Args:
        folder: where they go.
        times: the pictures of figure 7, whose screen and gaze the others show.
        models: what each acuity model costs there.
        tick: called after each.
    """
    figures = []
    for draw in (_sensitivity, _region_of_interest, _cell_maps, _comparison):
        figures.append(draw(folder, times))
        tick()
    figures.append(_models(folder, times, models))
    tick()
    return figures


def _models(folder: Path, times: TimeComparison, models: Sequence[ModelCost]) -> PaperFigure:
    curves = [
        ModelCurve(cost.model, cost.eccentricities_deg, cost.cut_offs_cpd, cost.cells_per_pixel, cost.camera_rays)
        for cost in models
    ]
    files = draw_models(curves, _display_cpd(times), folder / "acuity-models")
    return PaperFigure(
        "Beyond the paper: other models of acuity",
        files[0],
        f"The paper takes Peli's model; these are in its place by one setting. On the right the cells of our default "
        f"map at gaze {_place(times)}, and the camera rays of {times.samples_per_cell} a cell. What each gains in "
        "accuracy is measured by gazetrace accuracy.",
    )


def _sensitivity(folder: Path, times: TimeComparison) -> PaperFigure:
    from renderer.acuity import cut_off_cpd
    from renderer.paper import sensitivity

    frequency = sensitivity.frequencies_cpd()
    angles = sensitivity.ECCENTRICITIES_DEG
    curves = Curves(
        frequency,
        {angle: sensitivity.sensitivity(frequency, angle) for angle in angles},
        {angle: float(cut_off_cpd(angle)) for angle in angles},
        _display_cpd(times),
    )
    files = draw_sensitivity(curves, folder / "figure-1")
    return PaperFigure(
        "Figure 1: contrast sensitivity for several eccentricities",
        files[0],
        "How much fainter than full contrast a grating may be and still be seen, by its frequency and its angle from "
        f"the gaze: the threshold of eq. 1 with k = {sensitivity.FALL_OFF:g}, at the fovea the fit of Movshon and "
        "Kiorpes (1988). A curve falls to 1 where nothing finer is seen; the dots are the cut-off of eq. 2, which the "
        "cells are made from.",
    )


def _region_of_interest(folder: Path, times: TimeComparison) -> PaperFigure:
    from renderer.acuity import cut_off_cpd
    from renderer.eccentricity import eccentricity_deg
    from renderer.paper.published import QUALITY

    angles = eccentricity_deg(times.display, times.gaze, QUALITY.acuity.eccentricity)
    cut_off = cut_off_cpd(angles, QUALITY.acuity.model, _display_cpd(times))
    (file,) = draw_region_of_interest(cut_off, angles, _point(times), folder / "figure-2")
    return PaperFigure(
        "Figure 2: region of interest",
        file,
        f"The finest detail that the eye resolves at each place of the screen while it looks at {_place(times)}; white "
        "is all that the screen can show. Rings are angles from the gaze. They are ellipses here because the screen's "
        "pixels are wider than high.",
    )


def _cell_maps(folder: Path, times: TimeComparison) -> PaperFigure:
    from renderer.cellmap import build_cell_map
    from renderer.gaze import bucket_of
    from renderer.paper.timing import OURS, PAPER, QUALITIES
    from renderer.workers import WorkerPool

    maps = []
    pool = WorkerPool(times.threads)
    for name in (PAPER, OURS):
        quality = QUALITIES[name]
        bucket = bucket_of(times.gaze, quality.gaze_bucket_px)
        cells = build_cell_map(quality.map, times.display, quality.acuity, bucket, pool)
        share = 100 * cells.cells / times.display.pixels
        maps.append(
            Cells(f"{name} ({quality.map}): {cells.cells:,} cells, {share:.1f} % of pixels", cells.side, cells.mask)
        )
    pool.close()
    (file,) = draw_cell_maps(maps, _point(times), folder / "figure-5")
    return PaperFigure(
        "Figure 5: cells coloured by their side",
        file,
        "The paper opens a square at each pixel that is not covered yet, row by row, so later squares are cut by "
        "earlier ones and all of them shift when the gaze moves. Our default takes squares from a grid that is fixed "
        "to the screen: none overlap, none is cut, and a cell stays the same cell for other gazes.",
    )


def _comparison(folder: Path, times: TimeComparison) -> PaperFigure:
    from renderer.codec import encode

    paper = times.reduced[0]
    pictures = []
    for file, picture in (("full.png", times.full), ("gaze-dependent.png", paper)):
        write_whole(folder / file, encode(picture.pixels, "png"))
        rays = f"{millions(picture.rays.primary)} camera rays, {picture.median_ms / 1e3:.2f} s"
        name = "full" if picture is times.full else f"gaze-dependent, {picture.name}"
        pictures.append(Picture(f"{name}: {rays}", picture.pixels))
    files = draw_comparison(pictures, _point(times), _windows(times), folder / "figure-7")
    return PaperFigure(
        "Figure 7: full against gaze-dependent",
        files[0],
        f"The same view at {size(_display_record(times))} with {times.samples_per_cell} rays a pixel (left) and a cell "
        f"(right). The cross marks the gaze, {_place(times)}: there both are alike. Far from it cells show once they "
        "are enlarged; by the model, the eye that looks at the cross no longer resolves them there.",
    )


def _windows(times: TimeComparison) -> list[tuple[str, tuple[int, int, int, int]]]:
    """What figure 7 enlarges: around the gaze, and around the place opposite to it on the screen."""
    display = times.display
    half = max(4, display.width_px // (2 * ENLARGED))
    opposite = (display.width_px - times.gaze.x, display.height_px - times.gaze.y)
    windows = []
    for name, (x, y) in (("at the gaze", _point(times)), ("far from the gaze", opposite)):
        left = int(np.clip(x - half, 0, max(0, display.width_px - 2 * half)))
        top = int(np.clip(y - half, 0, max(0, display.height_px - 2 * half)))
        windows.append((name, (left, top, left + 2 * half, top + 2 * half)))
    return windows


def _display_cpd(times: TimeComparison) -> float:
    """Half a cycle a pixel at the point that the eye is in front of, across its width [cpd]."""
    return 0.5 / float(np.degrees(np.arctan2(times.display.pitch_x_cm, times.display.distance_cm)))


def _point(times: TimeComparison) -> tuple[float, float]:
    return times.gaze.x, times.gaze.y


def _place(times: TimeComparison) -> str:
    return place({"x": times.gaze.x, "y": times.gaze.y})


def _display_record(times: TimeComparison) -> dict[str, int]:
    return {"width_px": times.display.width_px, "height_px": times.display.height_px}
