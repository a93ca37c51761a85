"""What a clip cost, for programs and for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from clients.command_line.render import rejected_text


def clip_record(costs: Sequence[dict[str, Any]], rendered: int) -> dict[str, Any]:
    """The cost of all frames together.

    Args:
        costs: of each frame, as `render --json` prints it.
        rendered: how many of them were rendered in this run.
    """
    first = costs[0]

    def mean(values: list[float]) -> float:
        return round(sum(values) / len(costs), 1)

    def total(part: str) -> dict[str, float]:
        return {name: round(sum(cost[part][name] for cost in costs), 3) for name in first[part]}

    return {
        "width": first["width"],
        "height": first["height"],
        "frames": len(costs),
        "frames_rendered": rendered,
        "map": first["map"]["kind"],
        "samples_per_cell": first["samples_per_cell"],
        "mean_cells": mean([cost["map"]["cells"] for cost in costs]),
        "mean_cells_traced": mean([cost["cells_traced"] for cost in costs]),
        "rays": total("rays"),
        "effects": list(dict.fromkeys(effect for cost in costs for effect in cost["effects"])),
        "timing_ms": total("timing_ms"),
        "rejected_samples": total("rejected_samples"),
    }


def clip_text(record: dict[str, Any]) -> str:
    """The same for people, a line a subject."""
    frames, pixels = record["frames"], record["width"] * record["height"]
    earlier = frames - record["frames_rendered"]
    size = "" if record["bytes"] is None else f", {record['bytes'] / 1e6:,.1f} MB"
    rays = {kind: count for kind, count in record["rays"].items() if count}
    cells, traced = record["mean_cells"], record["mean_cells_traced"]
    lines = [
        ("clip", f"{record['output']}: {frames:,} frames of {record['scene']}, {record['width']}x{record['height']}, "
                 f"{record['seconds']:g} s at {record['fps']:g} a second{size}"),
        ("cells", f"{cells:,.0f} {record['map']} on average, {100 * cells / pixels:.1f} % of the pixels, "
                  f"{record['samples_per_cell']} samples each; {100 * traced / cells:.1f} % of them new in a frame"),
        ("rays", f"{sum(rays.values()):,}: " + ", ".join(f"{count:,} {kind}" for kind, count in rays.items())),
        ("effects", ", ".join(record["effects"]) or "none: the scene calls for primary rays only"),
        ("time", f"{record['elapsed_s']:,.1f} s; a frame: "
                 + ", ".join(f"{ms / frames:,.1f} ms {stage}" for stage, ms in record["timing_ms"].items())),
    ]  # fmt: skip
    if earlier:
        lines.insert(1, ("", f"{earlier:,} of them from an earlier run"))
    lines += rejected_text(record["rejected_samples"])
    return "\n".join(f"{name:<8}{text}" for name, text in lines)
