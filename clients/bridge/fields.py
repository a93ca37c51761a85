"""What a self-made device's record may hold, by name: the same names for csv, jsonl and regex."""

from __future__ import annotations

import math

from clients.bridge.codec import BadRecord, Line, number
from clients.bridge.sample import Point, Sample, seen

KNOWN_FIELDS = frozenset(("x", "y", "t", "v", "c", "xl", "yl", "xr", "yr"))
LEAST_CONFIDENCE = 0.6
"""Pupil Labs' documentation calls data below it not useful; other devices give no number."""
NO_VALUE = frozenset(("", "nan", "null", "none", "na", "."))
"""How devices write that an eye is lost, in lower case."""
FALSE = frozenset(("0", "0.0", "false"))
TRUE = frozenset(("1", "1.0", "true"))


def sample_of(line: Line, fields: dict[str, str], least_confidence: float = LEAST_CONFIDENCE) -> Sample:
    """The sample of named fields; `v` is the validity of all of them, `c` the confidence in them, 0 to 1.

    Raises:
        BadRecord: for a field that is no number.
    """
    valid = True
    if "v" in fields:
        word = fields["v"].lower()
        if word not in TRUE | FALSE:
            raise BadRecord(word)
        valid = word in TRUE
    if "c" in fields:
        valid = valid and _coordinate(fields["c"]) >= least_confidence
    ticks = number(fields["t"]) if "t" in fields else None
    both, left, right = (_point(fields, suffix, valid) for suffix in ("", "l", "r"))
    return Sample(line.first, line.size, ticks, left, right, both)


def _point(fields: dict[str, str], eye: str, valid: bool) -> Point | None:
    x, y = fields.get("x" + eye), fields.get("y" + eye)
    if x is None or y is None:
        return None
    point = seen(_coordinate(x), _coordinate(y))
    return point if valid else None


def _coordinate(word: str) -> float:
    return math.nan if word.lower() in NO_VALUE else number(word)
