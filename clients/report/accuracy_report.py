"""The report of a measurement: plots and one page, beside accuracy.json."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

from clients.report.accuracy_data import page_data
from clients.report.accuracy_page import accuracy_page
from clients.report.accuracy_plots import draw_plots
from clients.report.models_section import models_section
from clients.report.temporal_section import temporal_section

RECORD: Final = "accuracy.json"
TEMPORAL: Final = "temporal.json"
PAGE: Final = "report.html"


def write_report(folder: Path, tick: Callable[[], None] = lambda: None) -> tuple[Path, ...]:
    """Draw the plots and write the page for the measurement in a folder; the files, the page first.

    Args:
        folder: holds accuracy.json and the pictures that it names; temporal.json, if it is there and of the same scene,
            becomes a section.
        tick: called after each setting.

    Raises:
        OSError: for a file that is not there.
    """
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    plots = draw_plots(record, folder)
    sections = []
    if record["acuity_models"]:
        sections.append(models_section(record, folder))
    if (folder / TEMPORAL).is_file():
        temporal = json.loads((folder / TEMPORAL).read_text(encoding="utf-8"))
        if temporal["scene"] == record["scene"]:
            sections.append(temporal_section(temporal, folder))
    document = accuracy_page(record, page_data(record, folder, tick), folder, sections)
    partial = folder / f".{PAGE}.{os.getpid()}.part"
    partial.write_text(document, encoding="utf-8")
    partial.replace(folder / PAGE)
    return (folder / PAGE, *plots)
