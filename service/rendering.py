"""An order for a frame in, an encoded picture and its header out; nothing here knows HTTP."""

from __future__ import annotations

import hashlib
import itertools
import json
import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from importlib import metadata

from renderer.cellmap import CellMap
from renderer.codec import LONGEST_SIDE_PX, encode
from renderer.display import MAX_SIDE_PX, Display
from renderer.frame import Frame, FrameCost, FrameRequest
from renderer.gaze import Gaze
from renderer.library import SceneLibrary
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from service.idle import Idle
from service.metrics import Metrics
from service.room import Room
from service.settings import Settings
from service.watch import Watch

NS_PER_MS = 1_000_000

BYTES_A_PIXEL = 128
"""Memory of a frame in work: 110 were measured, with a cell a pixel and adaptive samples."""

LONGEST_REASON = 200
"""Characters of a compiler's message that are told; the log has all of it."""

log = logging.getLogger(__name__)


class NotReady(Exception):
    """The renderer is still compiling its kernels, or could not."""


class OverLimit(Exception):
    """More than this service grants one request: `field` names what, `message` says how much is granted."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field}: {message}")
        self.field = field
        self.message = message


@dataclass(frozen=True, slots=True)
class Order:
    """A frame someone asked for.

    Attributes:
        scene_id: of the scene library.
        request: what to render.
        format: `png`, `jpeg`, `webp` or `raw`.
        image_quality: of JPEG and WebP, 1 to 100.
    """

    scene_id: str
    request: FrameRequest
    format: str
    image_quality: int


@dataclass(frozen=True, slots=True)
class Picture:
    """A finished order.

    Attributes:
        data: the encoded image.
        header: what it shows and what it cost, ready for JSON.
        timing_ms: time of each stage [ms].
    """

    data: bytes
    header: Mapping[str, object]
    timing_ms: Mapping[str, float]


@dataclass(frozen=True, eq=False, slots=True)
class Rendered:
    """A frame that is not encoded yet.

    Attributes:
        frame: the picture and its cost.
        map_ms: time spent on its map before rendering [ms].
        started_ns, finished_ns: when rendering began and ended [monotonic ns].
    """

    frame: Frame
    map_ms: float
    started_ns: int
    finished_ns: int

    def stages(self) -> dict[str, float]:
        """Time of each stage [ms]."""
        times = self.frame.cost.time_ms
        return {"map": times.map + self.map_ms, "trace": times.trace, "reconstruct": times.reconstruct}


class Studio:
    """Scenes, renderer and limits of one service. Every method but `warm_up` blocks its thread.

    Args:
        settings: limits.
        renderer: traces; belongs to the caller.
        library: scenes; belongs to the caller.
        metrics: counts frames.
        watch: over the scenes at work.
        obstacle: why nothing can be traced now, None if it can; asked again and again.

    Attributes:
        idle: whoever has work for when nobody waits for a frame asks it.
        room: memory for frames in work.
        watch: whoever traces a scene tells it.
    """

    def __init__(
        self,
        settings: Settings,
        renderer: Renderer,
        library: SceneLibrary,
        metrics: Metrics,
        watch: Watch,
        obstacle: Callable[[], str | None] = lambda: None,
    ) -> None:
        self.settings = settings
        self.metrics = metrics
        self.watch = watch
        self.library = library
        self.idle = Idle()
        self.room = Room(settings.frame_bytes)
        self._renderer = renderer
        self._frames = itertools.count(1)
        self._not_ready: str | None = "the kernels are not compiled yet"
        self._obstacle = obstacle
        self._closed = False
        self._libraries = library_versions()

    def warm_up(self, announce: Callable[[str], None], settled: Callable[[], None]) -> threading.Thread:
        """Compile or load the kernels on a thread of its own, and be ready when it ends; `settled` is called before."""

        def compile_kernels() -> None:
            started = time.monotonic()
            self._not_ready = "the kernels are being compiled"
            announce("compiling the kernels (tens of seconds the first time, then a few) ...")
            try:
                self._renderer.warm_up()
            except Exception as error:
                if self._closed:
                    return
                log.exception("the kernels cannot be compiled")
                self._not_ready = f"the kernels cannot be compiled: {' '.join(str(error).split())[:LONGEST_REASON]}"
                announce(self._not_ready)
                return
            settled()
            self._not_ready = None
            announce(f"ready in {time.monotonic() - started:.1f} s")

        thread = threading.Thread(target=compile_kernels, name="gazetrace-warm-up", daemon=True)
        thread.start()
        return thread

    def close(self) -> None:
        """Say no more about kernels: the renderer is about to end, perhaps while it still compiles them."""
        self._closed = True
        self.room.close()
        self.watch.close()

    def require_ready(self) -> None:
        """Return if frames can be rendered.

        Raises:
            NotReady: saying why not.
        """
        why = self._not_ready or self._obstacle()
        if why is not None:
            raise NotReady(why)

    def check_order(self, order: Order) -> None:
        """Return if one request may ask for this frame, and its format can hold it.

        Raises:
            OverLimit: naming the field.
        """
        display = order.request.display
        self.check(display, order.request.quality)
        longest = LONGEST_SIDE_PX.get(order.format, MAX_SIDE_PX)
        if max(display.width_px, display.height_px) > longest:
            raise OverLimit("format", f"{order.format} holds no side of more than {longest:,} px")

    def check(self, display: Display, quality: Quality) -> None:
        """Return if one request may ask for so much.

        Raises:
            OverLimit: naming the field.
        """
        limits = self.settings
        if display.pixels > limits.max_pixels:
            raise OverLimit(
                "display", f"{display.width_px} x {display.height_px} px is more than {limits.max_pixels:,} pixels"
            )
        if display.pixels * BYTES_A_PIXEL > limits.frame_bytes:
            raise OverLimit(
                "display",
                f"{display.width_px} x {display.height_px} px take {display.pixels * BYTES_A_PIXEL:,} bytes of memory, "
                f"more than {limits.frame_bytes:,}",
            )
        if quality.samples_per_cell > limits.max_samples_per_cell:
            raise OverLimit(
                "quality.samples_per_cell", f"{quality.samples_per_cell} is more than {limits.max_samples_per_cell}"
            )
        if quality.shadow_samples > limits.max_samples_per_cell:
            raise OverLimit(
                "quality.shadow_samples", f"{quality.shadow_samples} is more than {limits.max_samples_per_cell}"
            )
        if quality.max_depth > limits.max_depth:
            raise OverLimit("quality.max_depth", f"{quality.max_depth} is more than {limits.max_depth}")
        if quality.map == "full":
            self._check_rays(display.pixels, quality)

    def cell_map(self, display: Display, quality: Quality, gaze: Gaze) -> tuple[CellMap, bool]:
        """The cells for a gaze, and whether they were known already."""
        with self.idle.busy(), self.room.take(display.pixels * BYTES_A_PIXEL):
            return self._renderer.cell_map(display, quality, gaze)

    def held_bytes(self) -> dict[str, int]:
        """What is kept between frames, and what frames in work may take, by kind."""
        return {
            "maps": self._renderer.map_cache.nbytes,
            "samples": self._renderer.store_cache.nbytes,
            "scenes": self.library.nbytes,
            "frames": self.room.lent,
        }

    def etag(self, order: Order) -> str:
        """A strong ETag of the picture: it changes whenever the bytes can.

        Raises:
            UnknownScene: if there is no such scene.
        """
        version = self.library.version(order.scene_id)
        stated = json.dumps([asdict(order), version, self._libraries], sort_keys=True)
        return f'"{hashlib.blake2b(stated.encode(), digest_size=16).hexdigest()}"'

    def render(self, order: Order, received_ns: int) -> Picture:
        """Load the scene, render and encode; `wait` of the timing is all that came before rendering.

        Args:
            order: already checked.
            received_ns: when it came in [monotonic ns].

        Raises:
            UnknownScene, SceneError: for a scene that is not there or cannot be loaded.
            OverLimit: for more camera rays than one request may ask for.
        """
        rendered = self.trace(order.scene_id, self.library.load(order.scene_id), order.request)
        data = encode(rendered.frame.pixels, order.format, order.image_quality)
        finished_ns = time.monotonic_ns()
        timing_ms = {
            "wait": (rendered.started_ns - received_ns) / NS_PER_MS,
            **rendered.stages(),
            "encode": (finished_ns - rendered.finished_ns) / NS_PER_MS,
            "total": (finished_ns - received_ns) / NS_PER_MS,
        }
        timing_ms = {stage: round(time_ms, 3) for stage, time_ms in timing_ms.items()}
        header = {
            "frame": next(self._frames),
            **_shown(order, rendered.frame),
            **spent(order.request, rendered.frame.cost),
            "timing_ms": timing_ms,
            "service_time_ns": {
                "gaze_received": received_ns,
                "started": rendered.started_ns,
                "finished": finished_ns,
            },
        }
        self.metrics.encoded("request", timing_ms["encode"])
        self.metrics.sent("request", len(data))
        return Picture(data, header, timing_ms)

    def trace(
        self, scene_id: str, prepared: PreparedScene, request: FrameRequest, abandon: threading.Event | None = None
    ) -> Rendered:
        """Render a frame without encoding it.

        Args:
            scene_id: its id.
            prepared: the scene.
            request: already checked.
            abandon: set it, from another thread, to give up the frame.

        Raises:
            Abandoned: soon after `abandon` is set.
            Stopping: if the service ends before it can begin.
            OverLimit: for more camera rays than one request may ask for.
        """
        with self.idle.busy(), self.room.take(request.display.pixels * BYTES_A_PIXEL, abandon):
            started_ns = time.monotonic_ns()
            known_map, map_ms = self._check_cells(request)
            with self.watch.tracing(scene_id, abandon):
                frame = self._renderer.render(prepared, request, abandon)
        cost = replace(frame.cost, map_cached=frame.cost.map_cached and known_map)
        if cost.rejected_samples.total:
            log.warning("%s: samples that are no light: %s", scene_id, asdict(cost.rejected_samples))
        rendered = Rendered(replace(frame, cost=cost), map_ms, started_ns, time.monotonic_ns())
        self.metrics.frame(cost, rendered.stages())
        return rendered

    def _check_cells(self, request: FrameRequest) -> tuple[bool, float]:
        """Count the cells where the pixels alone do not tell that the rays are few enough.

        Returns:
            whether the map was known before (True too where it was not needed), and the time this took [ms].
        """
        if request.display.pixels * request.quality.samples_per_cell <= self.settings.max_camera_rays:
            return True, 0.0
        started_ns = time.monotonic_ns()
        cells, known = self._renderer.cell_map(request.display, request.quality, request.gaze)
        self._check_rays(cells.cells, request.quality)
        return known, (time.monotonic_ns() - started_ns) / NS_PER_MS

    def _check_rays(self, cells: int, quality: Quality) -> None:
        rays = cells * quality.samples_per_cell
        if rays > self.settings.max_camera_rays:
            raise OverLimit(
                "quality.samples_per_cell",
                f"{quality.samples_per_cell} for each of {cells:,} cells is more than "
                f"{self.settings.max_camera_rays:,} camera rays",
            )


def library_versions() -> str:
    """Versions of what encodes and compiles: with the scene's version they decide the bytes of a picture."""
    return " ".join(
        f"{package} {metadata.version(package)}" for package in ("embreex", "numba", "pillow", "simplejpeg")
    )


def _shown(order: Order, frame: Frame) -> dict[str, object]:
    """The header's part on what the picture shows."""
    gaze = order.request.gaze
    return {
        "scene": order.scene_id,
        "width": frame.pixels.shape[1],
        "height": frame.pixels.shape[0],
        "format": order.format,
        "gaze": {"x": gaze.x, "y": gaze.y},
    }


def spent(request: FrameRequest, cost: FrameCost) -> dict[str, object]:
    """The header's part on what the picture cost."""
    return {
        "map": {
            "kind": cost.map,
            "cells": cost.cells,
            "bucket_px": cost.bucket_px,
            "margin_deg": request.quality.acuity.margin_deg,
            "cached": cost.map_cached,
        },
        "samples_per_cell": cost.samples_per_cell,
        "samples": round(cost.mean_samples, 3),
        "acuity_scale": cost.acuity_scale,
        "deadline_ms": cost.deadline_ms,
        "deadline_promised": cost.deadline_promised,
        "deadline_met": cost.deadline_met,
        "max_error": cost.max_error,
        "error_met": cost.error_met,
        "cells_traced": cost.cells_traced,
        "cells_reused": cost.cells_reused,
        "rays": asdict(cost.rays),
        "effects": list(cost.effects),
        "effect_reasons": dict(zip(cost.effects, cost.effect_reasons, strict=True)),
        "error": {"rms": cost.rms_error, "foveal_rms": cost.foveal_rms_error, "guessed": round(cost.guessed_error, 4)},
        "rejected_samples": asdict(cost.rejected_samples),
    }
