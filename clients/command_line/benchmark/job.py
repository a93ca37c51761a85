"""What rows are measured on."""

from __future__ import annotations

from dataclasses import dataclass, replace

from renderer.frame import FrameRequest
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene

HEAVY_REPEATS = 3
"""Most repeats of what takes seconds each time."""


@dataclass(frozen=True, slots=True)
class Job:
    """A frame of a scene, and how much to measure of it.

    Attributes:
        scene: name of the scene, as `gazetrace serve` knows it.
        prepared: the scene.
        request: the frame.
        renderer: on which it is rendered; its caches are emptied.
        repeats: how often each is timed.
        many: samples a cell where many are asked for.
        stream_frames: frames of the stream whose memory is watched.
        service_flags: of the service that streams it.
    """

    scene: str
    prepared: PreparedScene
    request: FrameRequest
    renderer: Renderer
    repeats: int
    many: int
    stream_frames: int
    service_flags: tuple[str, ...]

    @property
    def heavy_repeats(self) -> int:
        """How often to time what takes seconds."""
        return min(self.repeats, HEAVY_REPEATS)

    def with_samples(self, samples: int) -> FrameRequest:
        """The frame with so many samples a cell."""
        return replace(self.request, quality=replace(self.request.quality, samples_per_cell=samples))
