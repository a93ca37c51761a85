"""The work of streams, off the event loop: loading scenes, rendering, encoding."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from renderer.codec import encode
from renderer.frame import Frame
from renderer.prepared import PreparedScene
from service.plan import Configuration, Step
from service.rendering import NS_PER_MS, Order, Rendered, Studio

LOSSLESS_THREADS = 1
"""Lossless pictures encoded at once: they may wait, the frames of a moving gaze may not."""

LOSSLESS_QUALITY = 100

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False, slots=True)
class Encoded:
    """A frame as it is sent.

    Attributes:
        image: the file.
        encode_ms: time this took [ms].
        finished_ns: when it was done [monotonic ns].
    """

    image: bytes
    encode_ms: float
    finished_ns: int


class Stage:
    """Threads on which the sessions of one service work.

    Args:
        studio: renders.
        threads: frames rendered at once, over all sessions.
    """

    def __init__(self, studio: Studio, threads: int) -> None:
        self.studio = studio
        self._renders = ThreadPoolExecutor(threads, thread_name_prefix="gazetrace-stream")
        self._loads = ThreadPoolExecutor(threads, thread_name_prefix="gazetrace-stream-load")
        self._lossless = ThreadPoolExecutor(LOSSLESS_THREADS, thread_name_prefix="gazetrace-stream-lossless")

    async def prepare(self, order: Order) -> PreparedScene:
        """The scene of an order that may be rendered.

        Raises:
            OverLimit, UnknownScene, SceneError: where it may not.
        """
        self.studio.check_order(order)
        return await self._on(self._loads, lambda: self.studio.library.load(order.scene_id))

    async def render(
        self, configuration: Configuration, step: Step, abandon: threading.Event
    ) -> tuple[Rendered, Encoded]:
        """One step, rendered and encoded.

        Raises:
            Abandoned: soon after `abandon` is set.
            OverLimit: for too many camera rays.
        """

        def work() -> tuple[Rendered, Encoded]:
            rendered = self.studio.trace(configuration.order.scene_id, configuration.prepared, step.request, abandon)
            return rendered, self._encode(rendered.frame, step.format, step.image_quality)

        return await self._on(self._renders, work)

    async def encode_lossless(self, frame: Frame, image_format: str) -> Encoded:
        """A frame once more, without loss."""
        return await self._on(self._lossless, lambda: self._encode(frame, image_format, LOSSLESS_QUALITY))

    def close(self) -> None:
        """Take no more work; what has begun ends by itself."""
        for threads in (self._renders, self._loads, self._lossless):
            threads.shutdown(wait=False, cancel_futures=True)

    def _encode(self, frame: Frame, image_format: str, quality: int) -> Encoded:
        began_ns = time.monotonic_ns()
        image = encode(frame.pixels, image_format, quality)
        finished_ns = time.monotonic_ns()
        encode_ms = (finished_ns - began_ns) / NS_PER_MS
        self.studio.metrics.encoded("stream", encode_ms)
        return Encoded(image, encode_ms, finished_ns)

    @staticmethod
    async def _on(threads: ThreadPoolExecutor, work: Callable[[], Result]) -> Result:
        return await asyncio.get_running_loop().run_in_executor(threads, work)
