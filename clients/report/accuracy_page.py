"""The page of an accuracy report: plot, settings side by side, table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from clients.report.accuracy_data import Record, front_of, measured, missing
from clients.report.html import machine_facts, page, text
from clients.report.measures import Measure

SCRIPTS = ("number.js", "plot.js", "table.js", "compare.js", "accuracy.js")

HOW_TO_READ = """\
<p>Each point is one setting: to the right it takes longer, further up it is less accurate. Both axes are logarithmic.
The line joins the settings that are <b class="front">best for their time</b>: no other setting is both faster and more
accurate. The <b class="dominated">grey</b> ones are beaten by one that is. Choose a point, or a line of the table, to
see its picture below.</p>
<p>No measure sees everything, so look at several: the error where you look says nothing of the rest of the screen, the
error over the screen counts what the eye cannot resolve far from the gaze, and none of them knows how a frame changes
when the gaze moves: <code>gazetrace accuracy --temporal</code> measures that.</p>"""


def accuracy_page(record: Record, data: dict[str, Any], folder: Path, sections: Sequence[str] = ()) -> str:
    """The page as one HTML document that works from disk.

    Args:
        record: what accuracy.json holds.
        data: of `page_data`.
        folder: where the record lies, for links to files beside the page.
        sections: HTML of what else was measured.
    """
    display, gaze, reference = record["display"], record["gaze"], record["reference"]
    error = reference["standard_error"]
    absent = "".join(f"<li>{text(sentence)}</li>" for sentence in missing(record))
    files = ("accuracy.csv", "accuracy.json", "accuracy.png", "accuracy.svg", "temporal.csv", "temporal.json")
    links = " · ".join(f'<a href="{name}">{name}</a>' for name in files if (folder / name).exists())
    screen = (
        f"{display['width_px']}x{display['height_px']} pixels, {_centimetres(display)}, "
        f"{display['distance_cm']:g} cm from the eye"
    )
    body = f"""\
<main>
<h1>What accuracy costs: {text(record["scene"])}</h1>
<p>{record["triangles"]:,} triangles and {record["spheres"]:,} spheres, with
{text(", ".join(record["effects"]).replace("_", " ") or "no effects")}. Screen: {text(screen)}; gaze at
({gaze["x"]:g}, {gaze["y"]:g}). Every setting is held against a reference at full resolution with
{reference["samples"]} rays a pixel, whose own standard error is {_error(error["rms"])} over the screen and
{_error(error["foveal_rms"])} where you look; errors near those are noise of the reference.</p>
<h2>Time against accuracy</h2>
{HOW_TO_READ}
<div id="measures" role="radiogroup" aria-label="measure of accuracy"></div>
<p id="sees"></p>
<figure id="plot"></figure>
<p id="legend"><i class="front"></i> best for its time <i class="dominated"></i> beaten by another
<i class="default"></i> default <i class="paper"></i> the paper's setting</p>
{f"<ul class='note'>{absent}</ul>" if absent else ""}
<h2>Frames side by side</h2>
<p><label>setting <select id="setting"></select></label></p>
<div id="compare"></div>
<h2>All settings</h2>
<p>A click on a heading sorts; settings on the front of a measure are marked there with a dot.</p>
{_table(record)}
{"".join(sections)}
<h2>Machine and command</h2>
{machine_facts(dict(record))}
<p>{links}</p>
</main>
<noscript><p class="note">The plot and the pictures want JavaScript.</p></noscript>"""
    return page(f"What accuracy costs: {record['scene']}", body, SCRIPTS, data)


def _table(record: Record) -> str:
    """All settings; numbers carry their value for sorting."""
    measures = measured(record)
    fronts = {measure.key: set(front_of(record, measure)) for measure in measures}
    heads = ["setting", "varies", "time [ms]", "rays", "cells", *(measure.name for measure in measures)]
    head = "".join(f'<th scope="col"><button type="button">{text(name)}</button></th>' for name in heads)
    rows = "\n".join(_row(setting, measures, fronts) for setting in record["settings"])
    return (
        f'<div class="wide"><table id="settings"><thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table></div>'
    )


def _row(setting: Record, measures: tuple[Measure, ...], fronts: dict[str, set[str]]) -> str:
    rays, time = sum(setting["rays"].values()), setting["time_ms"]["median"]
    marks = "".join(f' <span class="mark {mark}">{mark}</span>' for mark in setting["marks"])
    cells = [
        f'<td><button type="button">{text(setting["label"])}</button>{marks}</td>',
        f"<td>{text(setting['group'].replace('_', ' '))}</td>",
        f'<td data-value="{time!r}">{time:,.1f}</td>',
        f'<td data-value="{rays}">{rays:,}</td>',
        f'<td data-value="{setting["cells"]}">{setting["cells"]:,}</td>',
    ]
    for measure in measures:
        value, loss = setting["accuracy"].get(measure.key), measure.loss(setting["accuracy"])
        if value is None or loss is None:
            cells.append("<td>–</td>")
            continue
        best = ' class="best"' if setting["id"] in fronts[measure.key] else ""
        cells.append(f'<td{best} data-value="{loss!r}">{value:.4g}</td>')
    return f'<tr data-id="{text(setting["id"])}">{"".join(cells)}</tr>'


def _error(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.2g}"


def _centimetres(display: Record) -> str:
    height = display.get("height_cm")
    return f"{display['width_cm']:g} cm wide" if height is None else f"{display['width_cm']:g} x {height:g} cm"
