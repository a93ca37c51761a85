"""Durations are taken from clocks that nobody sets: whoever asks for the time of day does so to write it down."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

TIME_OF_DAY = {
    "time.time",
    "time.time_ns",
    "time.localtime",
    "time.gmtime",
    "time.ctime",
    "time.strftime",
    "datetime.now",
    "datetime.utcnow",
    "datetime.today",
    "date.today",
}

WRITTEN_DOWN = {
    "clients/bridge/log.py",
    "clients/bridge/recording.py",
    "clients/command_line/accuracy.py",
    "clients/command_line/accuracy_temporal.py",
    "clients/command_line/figures.py",
    "service/survey.py",
}
"""Files that say when something was made: once each."""


def asked(source: str) -> list[str]:
    """The ways in which a module asks for the time of day."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module == "time":
            found += [f"time.{name.name}" for name in node.names]
        elif isinstance(node, ast.Attribute):
            found.append(".".join(ast.unparse(node).split(".")[-2:]))
    return [name for name in found if name in TIME_OF_DAY]


@pytest.mark.parametrize(
    "source",
    ["import time\nbegan = time.time()", "from time import time", "clock = datetime.datetime.now", "time.time_ns()"],
)
def test_each_way_to_ask_is_seen(source: str) -> None:
    assert asked(source)


def test_the_time_of_day_is_only_written_down() -> None:
    files = [path for folder in ("renderer", "service", "clients") for path in sorted((ROOT / folder).rglob("*.py"))]
    assert len(files) > 200
    asking = {path.relative_to(ROOT).as_posix(): asked(path.read_text()) for path in files}
    assert {name: len(ways) for name, ways in asking.items() if ways} == dict.fromkeys(sorted(WRITTEN_DOWN), 1)
