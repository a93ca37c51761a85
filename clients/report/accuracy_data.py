"""What the page of an accuracy report knows: its measurements, the fronts, and the pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from clients.report.measures import MEASURES, WANTED_FOR, Measure, jod_words
from clients.report.pareto import pareto_front
from clients.report.pictures import Window, part, read_picture, whole, window_around

Record = Mapping[str, Any]


def measured(record: Record) -> tuple[Measure, ...]:
    """The measures that at least two settings have, so that there is something to compare."""
    settings = record["settings"]
    return tuple(
        measure
        for measure in MEASURES
        if sum(measure.loss(setting["accuracy"]) is not None for setting in settings) >= 2
    )


def missing(record: Record) -> tuple[str, ...]:
    """What to say of metrics that no setting has."""
    shown = {measure.key for measure in measured(record)}
    return tuple(sentence for key, sentence in WANTED_FOR.items() if key not in shown)


def front_of(record: Record, measure: Measure) -> tuple[str, ...]:
    """Ids of the settings on the Pareto front of time and a measure, the fastest first."""
    known = [(setting, loss) for setting in record["settings"]
             if (loss := measure.loss(setting["accuracy"])) is not None]  # fmt: skip
    times = [setting["time_ms"]["median"] for setting, _ in known]
    return tuple(known[index][0]["id"] for index in pareto_front(times, [loss for _, loss in known]))


def page_data(record: Record, folder: Path, tick: Callable[[], None] = lambda: None) -> dict[str, Any]:
    """What the page's script reads.

    Args:
        record: what accuracy.json holds.
        folder: where it lies, with the pictures that it names.
        tick: called after each setting.
    """
    display, gaze = record["display"], record["gaze"]
    width, height = display["width_px"], display["height_px"]
    windows = {
        "gaze": window_around(gaze["x"], gaze["y"], width, height),
        "far": window_around(width - gaze["x"], height - gaze["y"], width, height),
    }
    reference = _pictures(folder / record["reference"]["frame"], windows)
    settings = []
    for setting in record["settings"]:
        settings.append(_setting(setting, folder, windows))
        tick()
    return {
        "measures": [
            {
                "key": measure.key,
                "name": measure.name,
                "axis": measure.axis,
                "sees": measure.sees,
                "front": front_of(record, measure),
            }
            for measure in measured(record)
        ],
        "settings": settings,
        "reference": {"pictures": reference, "file": record["reference"]["frame"]},
        "places": {"gaze": "around the gaze", "far": "far from the gaze"},
    }


def _setting(setting: Record, folder: Path, windows: Mapping[str, Window]) -> dict[str, Any]:
    accuracy = setting["accuracy"]
    jod = accuracy.get("jod")
    return {
        "id": setting["id"],
        "label": setting["label"],
        "group": setting["group"],
        "marks": setting["marks"],
        "time": {name: setting["time_ms"][name] for name in ("median", "low", "high")},
        "losses": {measure.key: measure.loss(accuracy) for measure in MEASURES},
        "facts": _facts(setting),
        "jod": None if jod is None else jod_words(jod),
        "pictures": _pictures(folder / setting["frame"], windows) | {"error": _error(folder / setting["error_map"])},
        "files": {"frame": setting["frame"], "error": setting["error_map"]},
    }


def _pictures(path: Path, windows: Mapping[str, Window]) -> dict[str, str]:
    pixels = read_picture(path)
    return {"frame": whole(pixels), **{name: part(pixels, window) for name, window in windows.items()}}


def _error(path: Path) -> str:
    return whole(read_picture(path))


def _facts(setting: Record) -> Sequence[tuple[str, str]]:
    """What a setting took, for people."""
    time, rays, stated, accuracy = (setting[part] for part in ("time_ms", "rays", "stated_error", "accuracy"))
    facts = [
        ("time", f"{time['median']:,.1f} ms ({time['low']:,.1f} to {time['high']:,.1f}): {time['map']:,.1f} map, "
                 f"{time['trace']:,.1f} trace, {time['reconstruct']:,.1f} reconstruct"),
        ("rays", ", ".join(f"{count:,} {kind}" for kind, count in rays.items() if count)),
        ("cells", f"{setting['cells']:,} with {setting['samples_per_cell']:.3g} samples each"),
        ("effects", ", ".join(setting["effects"]).replace("_", " ") or "none"),
    ]  # fmt: skip
    if stated["foveal_rms"] is not None and accuracy["foveal_rms"]:
        facts.append(
            (
                "error that the frame states",
                f"{stated['foveal_rms']:.2g} where you look, for {accuracy['foveal_rms']:.2g} measured: its noise, "
                "without what wide cells lose",
            )
        )
    return facts
