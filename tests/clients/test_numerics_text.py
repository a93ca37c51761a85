"""What numerical care costs, as it is printed."""

from __future__ import annotations

from clients.command_line.numerics_text import numerics_record, numerics_text
from renderer.numerics import Comparison

LINES = {
    "spheres": (
        Comparison("far", "misses", "robust", "b^2 - 4ac", 0.0, 0.23, 1.25),
        Comparison("near", "misses", "robust", "b^2 - 4ac", 0.0, 0.0, None),
    )
}


def test_a_line_for_each_comparison() -> None:
    head, far, near, _, note = numerics_text(LINES).splitlines()
    assert head.split() == ["measure", "the", "renderer's", "way", "error", "another", "way", "error", "time", "ratio"]
    assert far.split("  ")[0] == "spheres: far"
    assert far.split()[-2:] == ["0.23", "1.25"]
    assert near.endswith("  0")
    assert len(far) == len(head)
    assert "time ratio" in note


def test_the_same_for_programs() -> None:
    record = numerics_record(LINES)
    assert record["spheres"][0]["other_error"] == 0.23
    assert record["spheres"][1]["time_ratio"] is None
