"""Streams over real sockets."""

from __future__ import annotations

import io
from typing import Any

import httpx
import numpy as np
from PIL import Image

from service.protocol import Ready
from tests.service.conftest import PATIENCE_S
from tests.service.streaming import TINY, configure, viewer


def pixels(image: bytes) -> Any:
    return np.asarray(Image.open(io.BytesIO(image)).convert("RGB"))


def test_a_still_gaze_ends_with_the_lossless_frame_of_a_render_request(address: str) -> None:
    """All samples come step by step; the pixels are those of the same request over HTTP."""
    with viewer(address) as eye:
        joined = eye.next(Ready)
        assert joined.config is None
        eye.say(configure(7, "spheres"))
        ready = eye.next(Ready)
        assert (ready.session, ready.config, ready.scene) == (joined.session, 7, "spheres")
        assert {effect.name for effect in ready.effects} >= {"shadows", "reflection", "refraction"}
        headers = []
        while not headers or headers[-1].phase != "final":
            frame = eye.frame()
            headers.append(frame.header)
        assert [header.phase for header in headers] == ["moving", "still", "still", "final"]
        assert [header.samples for header in headers] == [1.0, 2.0, 4.0, 4.0]
        assert [header.format for header in headers] == ["jpeg"] * 3 + ["png"]
        assert {header.config for header in headers} == {7}
        assert [header.frame for header in headers] == [1, 2, 3, 4]
        margin = headers[-1].cost["map"]["margin_deg"]
        request = {
            "scene": "spheres",
            "gaze": {"x": 32, "y": 18},
            "display": TINY,
            "quality": {"samples_per_cell": 4, "acuity": {"margin_deg": margin}},
        }
        same = httpx.post(f"{address}/v1/render", json=request, timeout=PATIENCE_S)
        assert same.status_code == 200
        assert np.array_equal(pixels(frame.image), pixels(same.content))
        assert frame.image == same.content
