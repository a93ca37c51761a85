"""Messages of the streams, mutated: bytes, values, types, nesting, length, opcode."""

from __future__ import annotations

import json
import random
import struct
from copy import deepcopy
from typing import Any

TINY = {"width_px": 32, "height_px": 18, "width_cm": 50.0, "distance_cm": 60.0}

UP: tuple[dict[str, Any], ...] = (
    {"type": "hello", "token": "a-long-secret", "session": "lab"},
    {
        "type": "configure",
        "id": 1,
        "scene": "matte",
        "display": TINY,
        "gaze": {"x": 0.5, "y": 0.5, "unit": "fraction"},
        "camera": {"position": [0, 1, 5], "look_at": [0, 1, 0], "up": [0, 1, 0], "vertical_fov_deg": 40.0},
        "quality": {"samples_per_cell": 2, "deadline_ms": 50.0, "acuity": {"model": "peli", "scale": 2.0}},
        "format": "jpeg",
    },
    {"type": "camera", "id": 2, "camera": {"position": [0, 1, 5], "look_at": [0, 1, 0]}},
    {"type": "quality", "id": 3, "quality": {"samples_per_cell": 1, "max_depth": 2}},
    {
        "type": "gaze",
        "x": 4.0,
        "y": 5.0,
        "unit": "px",
        "valid": True,
        "seq": 7,
        "tracker_time_ns": 8,
        "phase": "saccade",
    },
    {"type": "ack", "frame": 1},
    {"type": "ping", "id": 1, "client_time_ns": 1},
    {"type": "gaze_batch", "samples": [{"x": 1.0, "y": 2.0, "valid": True}, {"x": 0.0, "y": 0.0, "valid": False}]},
    {"type": "margin", "margin_deg": 0.5},
    {"type": "target", "x": 0.1, "y": 0.9, "unit": "fraction", "index": 1, "count": 9},
)
"""Every message that a client may send."""

STRANGE: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2**31, 2**53 + 1, 2**63, 2**64, -(2**63), 10**400, 0.1, -0.0, 1e308, -1e308, 5e-324,
    "", "NaN", "0", "\0", "\ud800", "é" * 300, "../../etc/passwd", "a" * 5000, [], {}, [[]], [None] * 300, {"": {}},
    {"type": "gaze"},
)  # fmt: skip
"""Values in place of others."""

WORDS = (
    "NaN",
    "Infinity",
    "-Infinity",
    "1e999",
    "-0",
    "01",
    "0x1",
    '"\\ud800"',
    "[" * 3000,
    '{"a":' * 3000,
    "9" * 5000,
)
"""What is not JSON, or nearly, or too much of it."""

CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG = 0x0, 0x1, 0x2, 0x8, 0x9, 0xA
FINAL, MASKED = 0x80, 0x80


def mutated(chance: random.Random) -> str | bytes:
    """A message that was valid before something happened to it; bytes are sent as a binary message."""
    message = deepcopy(chance.choice(UP))
    match chance.randrange(6):
        case 0:
            return _dumped(_with_strange_value(message, chance))
        case 1:
            return _dumped(_with_other_fields(message, chance))
        case 2:
            return _damaged_text(_dumped(message), chance)
        case 3:
            return _with_word(_dumped(message), chance)
        case 4:
            text = _dumped(message)
            return text[: chance.randrange(len(text))]
        case _:
            return _dumped(message).encode() if chance.random() < 0.5 else _dumped(message)


def mutated_frame(chance: random.Random) -> bytes:
    """Bytes in place of a WebSocket frame (RFC 6455, 5.2): opcodes, lengths, masks and bits that are wrong."""
    payload = _dumped(chance.choice(UP)).encode()[: chance.choice((0, 1, 60, 125, 500))]
    opcode = chance.choice((CONTINUATION, TEXT, BINARY, 0x3, 0x7, CLOSE, PING, PONG, 0xB, 0xF))
    first = opcode | chance.choice((0, FINAL)) | chance.choice((0, 0, 0x10, 0x20, 0x40, 0x70))
    length = chance.choice((len(payload), 0, 125, 126, 127, 2**16, 2**32, 2**63 - 1, 2**63))
    mask = chance.choice((0, MASKED))
    if length < 126:
        head = struct.pack("!BB", first, mask | length)
    elif length < 2**16:
        head = struct.pack("!BBH", first, mask | 126, length)
    else:
        head = struct.pack("!BBQ", first, mask | 127, length)
    frame = head + (bytes(4) if mask else b"") + payload
    return frame[: chance.randrange(1, len(frame) + 1)] if chance.random() < 0.3 else frame


def _dumped(message: Any) -> str:
    return json.dumps(message, separators=(",", ":"))


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Every container and key of a JSON value, outside in."""
    found: list[tuple[Any, Any]] = []
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        found += [(value, key), *_places(value[key])]
    return found


def _with_strange_value(message: Any, chance: random.Random) -> Any:
    for _ in range(chance.choice((1, 1, 1, 2, 5))):
        container, key = chance.choice(_places(message) or [(message, "type")])
        container[key] = deepcopy(chance.choice(STRANGE))
    return message


def _with_other_fields(message: Any, chance: random.Random) -> Any:
    fields = list(message)
    if chance.random() < 0.4:
        del message[chance.choice(fields)]
    elif chance.random() < 0.5:
        message[chance.choice(("x", "__class__", "type", "", "scene", "id"))] = deepcopy(chance.choice(STRANGE))
    else:
        other = deepcopy(chance.choice(UP))
        message |= {name: other[name] for name in other if chance.random() < 0.5}
    return message


def _damaged_text(text: str, chance: random.Random) -> str:
    symbols = list(text)
    for _ in range(chance.randrange(1, 4)):
        symbols[chance.randrange(len(symbols))] = chance.choice('\0"\\{}[]:,-.0e9\u00e9\u2028 ')
    return "".join(symbols)


def _with_word(text: str, chance: random.Random) -> str:
    at, until = sorted(chance.randrange(len(text)) for _ in range(2))
    return text[:at] + chance.choice(WORDS) + text[until:]
