"""What the service has done, counted for Prometheus. The only file that knows its client library."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_LATEST

from renderer.frame import FrameCost, RejectedSamples

MS_PER_S = 1000.0

BUCKETS_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.033, 0.05, 0.07, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Upper ends of the histograms' buckets [s]; 33 ms is a frame of 30 a second, 70 ms what an eye tolerates."""

MEDIA_TYPE = CONTENT_TYPE_LATEST


class Metrics:
    """The counters of one service; any thread may count."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self._frames = self._counter("frames", "Frames rendered, by who asked.", "via")
        self._rays = self._counter("rays", "Rays traced, by kind.", "kind")
        self._cells = self._counter("cells", "Cells of the frames, traced or taken from the sample store.", "source")
        self._maps = self._counter("maps", "Cell maps of the frames, built or taken from the cache.", "source")
        self._late = self._counter("missed_deadlines", "Frames that were not finished by their deadline.")
        self._rejected = self._counter("rejected_samples", "Samples that were no light, by why.", "reason")
        for reason in fields(RejectedSamples):
            self._rejected.labels(reason.name)
        self._sent = self._counter("image_bytes", "Bytes of images: encoded for requests, sent to viewers.", "via")
        self._superseded = self._counter("superseded_gazes", "Gazes that a newer one replaced unrendered.")
        self._dropped = self._counter("dropped_frames", "Frames that a viewer missed since it was not ready.")
        self._refused = self._counter("refusals", "Requests and clients of streams refused, by kind.", "via", "kind")
        self._stages = self._histogram("stage_seconds", "Time of each stage of a frame.", "stage")
        self._latency = self._histogram(
            "gaze_to_frame_seconds", "From the arrival of a gaze to the encoded frame that follows a move of it."
        )
        self._sessions = self._gauge("sessions", "Streaming sessions.")
        self._viewers = self._gauge("viewers", "Viewers connected.")
        self._sources = self._gauge("gaze_sources", "Gaze sources connected.")

    def frame(self, cost: FrameCost, stages_ms: Mapping[str, float]) -> None:
        """A frame was rendered.

        Args:
            cost: what it took.
            stages_ms: time of its stages but `encode` [ms].
        """
        for kind in ("primary", "shadow", "reflection", "refraction"):
            self._rays.labels(kind).inc(getattr(cost.rays, kind))
        self._cells.labels("traced").inc(cost.cells_traced)
        self._cells.labels("reused").inc(cost.cells_reused)
        self._maps.labels("cache" if cost.map_cached else "built").inc()
        for reason, count in asdict(cost.rejected_samples).items():
            self._rejected.labels(reason).inc(count)
        self._late.inc(cost.deadline_met is False)
        for stage, time_ms in stages_ms.items():
            self._stages.labels(stage).observe(time_ms / MS_PER_S)

    def encoded(self, via: str, encode_ms: float) -> None:
        """A frame was encoded, via `request` or `stream`."""
        self._frames.labels(via).inc()
        self._stages.labels("encode").observe(encode_ms / MS_PER_S)

    def sent(self, via: str, image_bytes: int) -> None:
        """An image is on its way."""
        self._sent.labels(via).inc(image_bytes)

    def moved(self, total_ms: float) -> None:
        """The first frame after a move of the gaze was finished."""
        self._latency.observe(total_ms / MS_PER_S)

    def refused(self, via: str, kind: str) -> None:
        """A request (`http`) was refused, or a client of a stream (`websocket`) sent away."""
        self._refused.labels(via, kind).inc()

    def superseded(self) -> None:
        """A gaze was replaced before it was rendered."""
        self._superseded.inc()

    def dropped(self) -> None:
        """A viewer missed a frame."""
        self._dropped.inc()

    def text(self, sessions: int, viewers: int, sources: int) -> bytes:
        """Everything, in Prometheus' text format; the arguments are as of now."""
        self._sessions.set(sessions)
        self._viewers.set(viewers)
        self._sources.set(sources)
        return generate_latest(self._registry)

    def _counter(self, name: str, text: str, *labels: str) -> Counter:
        return Counter(f"gazetrace_{name}", text, labels, registry=self._registry)

    def _gauge(self, name: str, text: str) -> Gauge:
        return Gauge(f"gazetrace_{name}", text, registry=self._registry)

    def _histogram(self, name: str, text: str, *labels: str) -> Histogram:
        return Histogram(f"gazetrace_{name}", text, labels, buckets=BUCKETS_S, registry=self._registry)
