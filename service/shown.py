"""A finished frame of a session: its image, and what its header says to each viewer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from service import protocol
from service.conditioning import Attention
from service.plan import Configuration, Step, gaze_px
from service.rendering import NS_PER_MS, Rendered, spent
from service.stage import Encoded


@dataclass(frozen=True, eq=False, slots=True)
class Shown:
    """A finished frame, for all viewers.

    Attributes:
        number: in the session, from 1.
        header: fields of its header, all but those that differ between viewers.
        times_ns: gaze_received, started and finished.
        image: encoded.
    """

    number: int
    header: Mapping[str, Any]
    times_ns: Mapping[str, int]
    image: bytes

    def packed(self, dropped: int, sent_ns: int) -> bytes:
        """The binary message for a viewer that has missed `dropped` frames so far."""
        header = protocol.FrameHeader(
            **self.header,
            frame=self.number,
            image_bytes=len(self.image),
            dropped=dropped,
            service_time_ns=protocol.ServiceTimes(**self.times_ns, sent=sent_ns),
        )
        return protocol.pack_frame(header, self.image)


@dataclass(frozen=True, eq=False, slots=True)
class Taken:
    """A step that was rendered.

    Attributes:
        step: the step.
        attention: of the eye when it began.
        asked_ns: when something made it necessary [monotonic ns].
        rendered: the frame.
    """

    step: Step
    attention: Attention
    asked_ns: int
    rendered: Rendered


def shown(
    number: int, session: str, configuration: Configuration, superseded: int, taken: Taken, encoded: Encoded
) -> Shown:
    """A frame for all viewers of a session."""
    step, rendered, request = taken.step, taken.rendered, taken.step.request
    height, width = rendered.frame.pixels.shape[:2]
    timing_ms = {
        "wait": (rendered.started_ns - taken.asked_ns) / NS_PER_MS,
        **rendered.stages(),
        "encode": encoded.encode_ms,
        "total": (encoded.finished_ns - taken.asked_ns) / NS_PER_MS,
    }
    cost = spent(request, rendered.frame.cost)
    header = {
        "session": session,
        "config": configuration.id,
        "scene": configuration.order.scene_id,
        "width": width,
        "height": height,
        "format": step.format,
        "phase": step.phase,
        "gaze": _frame_gaze(configuration, taken.attention),
        "gaze_state": taken.attention.state,
        "samples": cost.pop("samples"),
        "acuity_scale": cost.pop("acuity_scale"),
        "superseded": superseded,
        "timing_ms": {stage: round(time_ms, 3) for stage, time_ms in timing_ms.items()},
        "cost": cost,
    }
    times_ns = {
        "gaze_received": taken.attention.received_ns,
        "started": rendered.started_ns,
        "finished": encoded.finished_ns,
    }
    return Shown(number, header, times_ns, encoded.image)


def _frame_gaze(configuration: Configuration, attention: Attention) -> protocol.FrameGaze | None:
    sample, gaze = attention.sample, gaze_px(configuration, attention)
    if sample is None or gaze is None:
        return None
    return protocol.FrameGaze(gaze.x, gaze.y, sample.seq, sample.tracker_time_ns, sample.captured_time_ns)
