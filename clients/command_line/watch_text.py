"""What a watched stream was like, for programs and for people."""

from __future__ import annotations

from statistics import median
from typing import Any

from clients.command_line.errors import CommandFailed
from clients.latency import NOTICED_MS, PERCENTILES, STAGES, LatencyLog, percentiles, trailing_rates


def watch_record(log: LatencyLog) -> dict[str, Any]:
    """The measurement as `--json` prints it.

    Raises:
        CommandFailed: if there is nothing to report on.
    """
    latencies = log.latencies_ms()
    if not latencies:
        raise CommandFailed("expected frames that show a newer gaze, found none: play for longer")
    rates = trailing_rates(log.frames_ns, log.began_ns)
    return {
        "frames": len(log.frames_ns),
        "frames_for_newer_gaze": len(latencies),
        "frames_a_second": {"median": median(rates), "least": min(rates)} if rates else None,
        "mean_image_bytes": round(log.image_bytes / len(log.frames_ns)),
        "superseded": log.superseded,
        "dropped": log.dropped,
        "latency_ms": {
            "total": percentiles(latencies),
            **{stage: percentiles([stages[stage] for stages in log.stages]) for stage in STAGES},
        },
        "share_past_ms": {
            str(limit): round(sum(latency > limit for latency in latencies) / len(latencies), 4) for limit in NOTICED_MS
        },
    }


def watch_text(record: dict[str, Any]) -> str:
    """The same for people: percentiles in columns, a line a stage."""
    size = f"{record['width']}x{record['height']} {record['format']}, {record['mean_image_bytes'] / 1e3:,.0f} kB"
    past = ", ".join(f"{100 * share:.1f} % past {limit} ms" for limit, share in record["share_past_ms"].items())
    rates = record["frames_a_second"]
    seen = "" if rates is None else f"; over a trailing second {rates['median']:g}, at least {rates['least']:g}"
    lines = [
        f"{record['scene']}, {size} a frame; {record['gazes_a_second']:g} gazes a second for {record['seconds']:.1f} s",
        f"{record['frames']:,} frames{seen}",
        f"{record['superseded']:,} gazes superseded, {record['dropped']:,} frames dropped",
        "",
        f"{'from gaze to frame [ms]':<26}" + "".join(f"{name:>9}" for name in PERCENTILES),
    ]
    for stage, found in record["latency_ms"].items():
        name = "total" if stage == "total" else f"  {stage}"
        lines.append(f"{name:<26}" + "".join(f"{found[percentile]:9.1f}" for percentile in PERCENTILES))
    lines.append(f"of {record['frames_for_newer_gaze']:,} frames for a newer gaze: {past}")
    return "\n".join(lines)
