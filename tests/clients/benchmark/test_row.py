"""The table of the benchmark."""

from __future__ import annotations

import pytest

from clients.command_line.bench import ROWS, row_groups
from clients.command_line.benchmark.row import measured_row, missing_row, table_text
from clients.command_line.benchmark.selection import GROUPS


def test_a_row_states_the_median_and_the_spread() -> None:
    row = measured_row("frame", "part / whole", [0.3, 0.1, 0.2], aim=0.2)
    assert (row.median, row.low, row.high) == (0.2, 0.1, 0.3)


@pytest.mark.parametrize(
    ("found", "at_least", "met"), [(0.9, False, True), (1.1, False, False), (1.1, True, True), (0.9, True, False)]
)
def test_aims_are_met_from_one_side(found: float, at_least: bool, met: bool) -> None:
    assert measured_row("frame", "a", [found], aim=1.0, at_least=at_least).met is met


def test_without_an_aim_or_a_figure_nothing_is_met() -> None:
    assert measured_row("frame", "a", [1.0]).met is None
    assert missing_row("peers", "a", "not installed").met is None


def test_the_table_lines_up_and_says_why_a_figure_is_missing() -> None:
    rows = (
        measured_row("frame", "whole frame / bare Embree", [0.61234], aim=0.6, note="9 rays"),
        measured_row("memory", "memory", [1234.56], "MiB"),
        measured_row("peers", "them / us", [12.0], aim=10.0, at_least=True),
        missing_row("peers", "others / us", "not installed"),
    )
    head, *lines = table_text(rows).splitlines()
    assert head.split() == ["median", "lowest", "highest", "aim"]
    assert lines[0].split() == ["whole", "frame", "/", "bare", "Embree", *["0.612"] * 3, "<=", "0.6", "9", "rays"]
    assert lines[1].split() == ["memory", *["1,234.6"] * 3, "MiB"]
    assert lines[2].split()[-2:] == [">=", "10"]
    assert lines[3].split() == ["others", "/", "us", "-", "-", "-", "not", "installed"]
    numbers = ("0.612", "1,234.6", "12.000")
    assert {line.index(number) + len(number) for line, number in zip(lines[:3], numbers, strict=True)} == {35}


def test_each_group_that_can_be_asked_for_is_measured() -> None:
    assert tuple(GROUPS) == ROWS
    assert row_groups("peers,frame") == ("peers", "frame")
