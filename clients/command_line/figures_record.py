"""The paper's numbers beside ours, as `gazetrace figures` writes them for programs and for people."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from renderer.paper import published

if TYPE_CHECKING:
    from renderer.acuity_comparison import ModelCost
    from renderer.paper.rays import RayCount
    from renderer.paper.timing import TimeComparison, TimedPicture


def rays_record(counts: Sequence[RayCount]) -> list[dict[str, Any]]:
    """The table of rays."""
    lines = []
    for count in counts:
        case = count.case
        paper = None
        if case.published is not None:
            paper = {"full_rays": case.published_full, "rays": case.published, "ratio": count.published_ratio}
        lines.append(
            {
                "name": case.name,
                "display": asdict(case.display),
                "gaze": asdict(case.gaze),
                "quality": asdict(case.quality),
                "cells": count.cells,
                "full_rays": count.full_rays,
                "rays": count.rays,
                "ratio": count.ratio,
                "paper": paper,
                "note": case.note,
            }
        )
    return lines


def models_record(models: Sequence[ModelCost]) -> list[dict[str, Any]]:
    """What each acuity model costs, without its curve."""
    return [
        {
            "model": cost.model,
            "source": cost.source,
            "valid_deg": cost.valid_deg,
            "cells": cost.cells,
            "cells_per_pixel": cost.cells_per_pixel,
            "camera_rays": cost.camera_rays,
        }
        for cost in models
    ]


def time_record(scene: str, times: TimeComparison) -> dict[str, Any]:
    """The time ratios; the full picture first."""
    return {
        "scene": scene,
        "display": asdict(times.display),
        "gaze": asdict(times.gaze),
        "samples_per_cell": times.samples_per_cell,
        "repeats": len(times.full.repeats_ms),
        "paper": {
            "samples_per_cell": published.SAMPLES_PER_CELL,
            "ray_ratio": published.RAY_RATIO,
            "time_ratio": published.TIME_RATIO,
        },
        "pictures": [_picture_record(times, picture) for picture in (times.full, *times.reduced)],
    }


def _picture_record(times: TimeComparison, picture: TimedPicture) -> dict[str, Any]:
    ratios = times.time_ratios(picture)
    return {
        "name": picture.name,
        "cells": picture.cells,
        "rays": asdict(picture.rays),
        "camera_ray_ratio": times.camera_ray_ratio(picture),
        "ray_ratio": times.ray_ratio(picture),
        "time_ms": {
            "median": picture.median_ms,
            "low": min(picture.repeats_ms),
            "high": max(picture.repeats_ms),
            "repeats": picture.repeats_ms,
            "map": picture.map_ms,
        },
        "time_ratio": {"median": statistics.median(ratios), "low": min(ratios), "high": max(ratios)},
        "stated_error": {"rms": picture.rms, "foveal_rms": picture.foveal_rms},
    }


def differences(record: dict[str, Any]) -> list[str]:
    """What differs from the paper, and why as far as it is known; one sentence or two each."""
    time = record["time"]
    paper = time["paper"]
    own = next(picture for picture in time["pictures"] if picture["name"] == "paper's map")
    off_centre, centre = record["rays"][0], record["rays"][1]
    large = next(line for line in record["rays"] if line["paper"] and line["full_rays"] > 10 * centre["rays"])
    per_ray = own["time_ratio"]["median"] / own["camera_ray_ratio"]
    sentences = [
        f"The paper does not state the gaze of its {millions(paper_rays(centre))} rays: its map takes "
        f"{millions(centre['rays'])} here with the gaze at {place(centre['gaze'])}, and "
        f"{millions(off_centre['rays'])} ({percent(off_centre['rays'] / paper_rays(off_centre) - 1)}) at "
        f"{place(off_centre['gaze'])}.",
        f"Of the large picture the paper gives rounded numbers: {millions(large['rays'])} here for its "
        f"{millions(paper_rays(large), 0)} ({percent(large['rays'] / paper_rays(large) - 1)}), with the gaze taken to "
        "be at the centre and the screen to be the same one.",
        "Pixels of the 1920x1080 screen are wider than high. Here the angle of a pixel is that of its width along the "
        "line towards the point that the eye is in front of; the paper does not say which it takes.",
        f"Time over camera rays: the paper's picture is {paper['time_ratio']:.2f} times as fast for "
        f"{paper['ray_ratio']:.2f} times fewer rays, {paper['time_ratio'] / paper['ray_ratio']:.2f} in time for each "
        f"in rays; here {own['time_ratio']['median']:.2f} for {own['camera_ray_ratio']:.2f}, {per_ray:.2f}. Times here "
        f"hold the making of the map, {own['time_ms']['map']:.0f} of {own['time_ms']['median']:.0f} ms; scene, tracer "
        "and machine are others than the paper's.",
        "Figure 1 starts from a fit of the sensitivity at the fovea (Movshon and Kiorpes 1988), since the paper does "
        "not print the one that it uses, and from k = 0.040 of its range 0.030 to 0.057.",
    ]
    if time["samples_per_cell"] != paper["samples_per_cell"]:
        sentences.append(
            f"The times are of {time['samples_per_cell']} rays a cell, the paper's of {paper['samples_per_cell']}."
        )
    if not record["complete"]:
        sentences.append("This is a quick run: fewer rays a cell and fewer repeats than the comparison calls for.")
    return sentences


def figures_text(record: dict[str, Any]) -> str:
    """The tables for people."""
    lines = [f"{'camera rays, ' + str(published.SAMPLES_PER_CELL) + ' a cell':<46}{'here':>11}{'paper':>11}"
             f"{'full/here':>12}{'paper':>8}"]  # fmt: skip
    screens: dict[str, bool] = {}
    for line in record["rays"]:
        paper = line["paper"]
        screen = size(line["display"])
        if screen not in screens and paper:
            screens[screen] = True
            lines.append(f"{screen + ', full':<46}{millions(line['full_rays']):>11}{millions(paper['full_rays']):>11}")
        name = f"{screen}, {line['name']}, gaze {place(line['gaze'])}"
        said = (millions(paper["rays"]), f"{paper['ratio']:.2f}") if paper else ("", "")
        lines.append(f"{name:<46}{millions(line['rays']):>11}{said[0]:>11}{line['ratio']:>12.2f}{said[1]:>8}")
    time = record["time"]
    lines += [
        "",
        f"{time['scene']} at {size(time['display'])}, gaze {place(time['gaze'])}, {time['samples_per_cell']} rays a "
        f"cell, median of {time['repeats']}",
        f"{'':<24}{'time':>12}{'full/here':>11}{'lowest':>9}{'highest':>9}{'camera rays':>14}{'full/here':>11}",
    ]
    for picture in time["pictures"]:
        ratio = picture["time_ratio"]
        lines.append(
            f"{picture['name']:<24}{picture['time_ms']['median']:>9,.0f} ms{ratio['median']:>11.2f}{ratio['low']:>9.2f}"
            f"{ratio['high']:>9.2f}{picture['rays']['primary']:>14,}{picture['camera_ray_ratio']:>11.2f}"
        )
    paper = time["paper"]
    lines.append(f"{'the paper':<24}{'':>12}{paper['time_ratio']:>11.2f}{'':>32}{paper['ray_ratio']:>11.2f}")
    lines += ["", "what differs", *(f"- {sentence}" for sentence in record["differences"])]
    return "\n".join(lines)


def paper_rays(line: dict[str, Any]) -> float:
    """Rays that the paper prints for a line that it prints."""
    return float(line["paper"]["rays"])


def millions(count: float, digits: int = 2) -> str:
    """As "66.36 M"."""
    return f"{count / 1e6:.{digits}f} M"


def percent(share: float) -> str:
    """With its sign, as "+1.2 %"."""
    return f"{100 * share:+.1f} %"


def place(gaze: dict[str, float]) -> str:
    """As "(300, 405)"."""
    return f"({gaze['x']:g}, {gaze['y']:g})"


def size(display: dict[str, Any]) -> str:
    """As "1920x1080"."""
    return f"{display['width_px']}x{display['height_px']}"
