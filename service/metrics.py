"""What the service has done, counted for Prometheus. The only file that knows its client library."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_LATEST

from renderer.frame import FrameCost, RejectedSamples

MS_PER_S = 1000.0

BUCKETS_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.033, 0.05, 0.07, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Upper ends of the histograms' buckets [s]; 33 ms is a frame of 30 a second, 70 ms what an eye tolerates."""

MEDIA_TYPE = CONTENT_TYPE_LATEST


@dataclass(frozen=True, slots=True)
class Now:
    """A service at one moment.

    Attributes:
        connections: of clients, streams among them.
        sessions, viewers, gaze_sources: of streams.
        running_frames, waiting_frames: of requests: in work, and waiting for their turn.
        held_bytes: kept between frames or granted to them, by kind.
        quarantined: scenes that are refused since they bring the service down.
    """

    connections: int
    sessions: int
    viewers: int
    gaze_sources: int
    running_frames: int
    waiting_frames: int
    held_bytes: Mapping[str, int]
    quarantined: Sequence[str]


class Metrics:
    """The counters of one service; any thread may count.

    Args:
        crashes: how often native code brought this service down before.
    """

    def __init__(self, crashes: int = 0) -> None:
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
        self._gauge("crashes", "How often this service was started again since native code brought it down.").set(
            crashes
        )
        self._stages = self._histogram("stage_seconds", "Time of each stage of a frame.", "stage")
        self._latency = self._histogram(
            "gaze_to_frame_seconds", "From the arrival of a gaze to the encoded frame that follows a move of it."
        )
        self._connections = self._gauge("connections", "Connections of clients, streams among them.")
        self._sessions = self._gauge("sessions", "Streaming sessions.")
        self._viewers = self._gauge("viewers", "Viewers connected.")
        self._sources = self._gauge("gaze_sources", "Gaze sources connected.")
        self._queue = self._gauge("requested_frames", "Frames of requests, running or waiting for their turn.", "state")
        self._held = self._gauge("held_bytes", "Memory of what is kept, and granted to frames in work.", "kind")
        self._quarantined = self._gauge(
            "quarantined_scenes", "Scenes refused since they bring this service down: 1 for each.", "scene"
        )
        ProcessCollector(registry=self._registry)

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
        """A request (`http`) or a `connection` was refused, or a client of a stream (`websocket`) sent away."""
        self._refused.labels(via, kind).inc()

    def superseded(self) -> None:
        """A gaze was replaced before it was rendered."""
        self._superseded.inc()

    def dropped(self) -> None:
        """A viewer missed a frame."""
        self._dropped.inc()

    def text(self, now: Now) -> bytes:
        """Everything, in Prometheus' text format."""
        self._connections.set(now.connections)
        self._sessions.set(now.sessions)
        self._viewers.set(now.viewers)
        self._sources.set(now.gaze_sources)
        self._queue.labels("running").set(now.running_frames)
        self._queue.labels("waiting").set(now.waiting_frames)
        for kind, size in now.held_bytes.items():
            self._held.labels(kind).set(size)
        self._quarantined.clear()
        for scene_id in now.quarantined:
            self._quarantined.labels(scene_id).set(1)
        return generate_latest(self._registry)

    def _counter(self, name: str, text: str, *labels: str) -> Counter:
        return Counter(f"gazetrace_{name}", text, labels, registry=self._registry)

    def _gauge(self, name: str, text: str, *labels: str) -> Gauge:
        return Gauge(f"gazetrace_{name}", text, labels, registry=self._registry)

    def _histogram(self, name: str, text: str, *labels: str) -> Histogram:
        return Histogram(f"gazetrace_{name}", text, labels, buckets=BUCKETS_S, registry=self._registry)
