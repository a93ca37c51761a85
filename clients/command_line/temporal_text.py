"""What a gaze that moves changes on the screen, for people: a line for each way of mapping."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from renderer.accuracy.temporal import Flicker
    from renderer.accuracy.temporal_record import TemporalReport

HEAD = f"{'':<26}{'change':>9}{'beyond 5 deg':>14}{'worst step':>12}{'pixels':>9}{'maps':>7}{'cells':>10}"


def temporal_text(report: TemporalReport, files: Sequence[Path]) -> str:
    """The table, with what it is of above it, and what its words mean and the files below."""
    display, steps = report.display, report.ways[0].steps
    screen = f"{display.width_px}x{display.height_px}"
    return "\n".join(
        [
            f"{report.scene}, {screen}, {report.quality.samples_per_cell} samples a cell: "
            f"{steps} steps of gaze ({report.gaze_trace}), {report.frames_per_second:g} a second",
            "",
            HEAD,
            *(_line(way) for way in report.ways),
            "",
            "change: mean of what luminance changes by from frame to frame, 1/1000 of white; the scene stands still.",
            "beyond 5 deg: as far from the gaze and farther. pixels: share that got another cell; maps: steps with a "
            "new one.",
            *map(str, files),
        ]
    )


def _line(way: Flicker) -> str:
    far = "" if way.peripheral_change is None else f"{1e3 * way.peripheral_change:.3f}"
    return (
        f"{way.way:<26}{1e3 * way.change:>9.3f}{far:>14}{1e3 * max(way.step_changes):>12.3f}"
        f"{100 * way.changed_pixels:>7.1f} %{way.map_changes:>7}{way.cells:>10,.0f}"
    )
