"""What a measurement of accuracy found, for people: time against error, a line each setting."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from clients.report.pareto import pareto_front
from clients.report.plotting import WANTED, can_plot

if TYPE_CHECKING:
    from renderer.accuracy.record import Accuracy, AccuracyReport, SettingResult

BEST: Final = "*"
"""Behind an error: no setting that is as fast is as accurate."""


class Column(NamedTuple):
    """A measure: its heading, how to read it off, and whether less of it is better."""

    heading: str
    value: Callable[[Accuracy], float | None]
    form: str
    less_is_better: bool


COLUMNS: Final = (
    Column("rms", lambda found: found.rms, "{:.4f}", True),
    Column("fovea rms", lambda found: found.foveal_rms, "{:.4f}", True),
    Column("rel. MSE", lambda found: found.relative_mse, "{:.4f}", True),
    Column("fovea dB", lambda found: found.foveal_psnr_db, "{:.1f}", False),
    Column("fovea max", lambda found: found.foveal_max_error, "{:.3f}", True),
    Column("FLIP", lambda found: found.flip_mean, "{:.4f}", True),
    Column("JOD", lambda found: found.jod, "{:.3f}", False),
)


def accuracy_text(report: AccuracyReport, files: Sequence[Path]) -> str:
    """The table, fastest first, with what it is of above it, and what its words mean and the files below."""
    settings = sorted(report.settings, key=lambda setting: setting.time_ms.median)
    columns = [column for column in COLUMNS if any(column.value(setting.accuracy) is not None for setting in settings)]
    best = [pareto_best(settings, column) for column in columns]
    width = max(len(_name(setting)) for setting in settings)
    head = f"{'':<{width}}{'time [ms]':>10}{'spread':>7}{'M rays':>8}"
    lines = [_title(report), _reference_line(report), "", head + "".join(f"{c.heading:>10} " for c in columns)]
    for setting in settings:
        times = setting.time_ms
        spread = f"{100 * (times.high - times.low) / times.median:.0f} %"
        cells = [_cell(setting, column, front) for column, front in zip(columns, best, strict=True)]
        rays = f"{setting.rays.total / 1e6:.2f}"
        lines.append(f"{_name(setting):<{width}}{times.median:>10,.1f}{spread:>7}{rays:>8}{''.join(cells)}")
    return "\n".join([*lines, "", *_notes(report), *map(str, files)])


def pareto_best(settings: Sequence[SettingResult], column: Column) -> set[str]:
    """Ids of the settings that no other beats in time and `column`."""
    sign = 1.0 if column.less_is_better else -1.0
    known = [(setting, value) for setting in settings if (value := column.value(setting.accuracy)) is not None]
    front = pareto_front([setting.time_ms.median for setting, _ in known], [sign * value for _, value in known])
    return {known[index][0].id for index in front}


def _title(report: AccuracyReport) -> str:
    display, gaze, machine = report.display, report.gaze, report.machine
    repeats = len(report.settings[0].time_ms.repeats)
    view = f"{report.scene}, {display.width_px}x{display.height_px}, gaze ({gaze.x:g}, {gaze.y:g})"
    timed = f"median of {repeats} on {machine.threads} threads of {machine.processor}"
    return f"{view}: {len(report.settings)} settings, {timed}"


def _reference_line(report: AccuracyReport) -> str:
    """How good the reference is, and what that is beside the settings' errors."""
    reference = report.reference
    own = reference.standard_error.rms
    text = f"reference: {reference.samples} samples a pixel in {reference.seconds:,.1f} s"
    errors = [setting.accuracy.rms for setting in report.settings]
    if own is None or min(errors) <= 0.0:
        return text
    return f"{text}, standard error {own:.2g} rms: {own / min(errors):.2g} of the smallest error of a setting"


def _name(setting: SettingResult) -> str:
    return setting.label + "".join(f" [{mark}]" for mark in setting.marks)


def _cell(setting: SettingResult, column: Column, best: set[str]) -> str:
    value = column.value(setting.accuracy)
    text = "" if value is None else column.form.format(value)
    return f"{text:>10}{BEST if setting.id in best else ' '}"


def _notes(report: AccuracyReport) -> list[str]:
    lines = [
        f"{BEST} no setting is both faster and better by this measure. Spread: slowest less fastest, over the median.",
        "rms: error of luminance, white is 1; rel. MSE: squared, over that of the reference; fovea: within 2.5 deg.",
    ]
    accuracy = report.settings[0].accuracy
    if accuracy.flip_mean is None:
        lines.append("FLIP, which sees colour and contrast, wants the extra 'report': pip install 'gazetrace[report]'")
    if accuracy.jod is None:
        lines.append("JOD, what an eye with this gaze sees, wants the extra 'quality' (not for commercial use)")
    if not can_plot():
        lines.append(f"A page with plots and pictures {WANTED}")
    return lines
