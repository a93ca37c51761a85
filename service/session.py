"""A session: one configuration, one gaze, any number of viewers and gaze sources; it renders while anyone looks.

The newest gaze wins: there is one slot for it. A frame is rendered once, for all viewers. Everything but
rendering and encoding happens on the event loop.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

from renderer.frame import Abandoned
from service import protocol
from service.conditioning import Attention, elapse, next_change_ns, observe
from service.outbox import Outbox
from service.plan import UNCHANGED_FORMATS, Configuration, Look, Step, look_at, step_of, steps_done, steps_of
from service.protocol import CloseCode
from service.refusal import refusal
from service.rendering import NS_PER_MS, NotReady, Rendered
from service.request import StreamBody
from service.shown import Shown, Taken, shown
from service.stage import Encoded, Stage

LOSSLESS = "png"
"""Format of the last frame."""

PATIENCE_NS = 250 * NS_PER_MS
"""How long a frame may keep a new configuration waiting."""

SETTLED_NS = 150 * NS_PER_MS
"""How long the gaze must have rested before the last frame is encoded without loss."""

ENCODE_GAIN = 0.25
"""Weight of the newest frame in the mean time that encoding takes."""

TICK_S = 0.05
"""How often the time is looked at while it alone can change what to render [s]."""

STATUS_NS = 1000 * NS_PER_MS
"""How often counts are told while frames are rendered."""


log = logging.getLogger(__name__)


@dataclass(slots=True)
class Counts:
    """What has happened in a session."""

    frames: int = 0
    superseded: int = 0
    dropped: int = 0
    rejected: int = 0


@dataclass(slots=True)
class Progress:
    """How far the picture of a look has come.

    Attributes:
        look: what it shows.
        since_ns: when it began [monotonic ns].
        taken: the newest step.
        steps: how many are done.
        lossless: the last frame, on its way.
        over: whether there is nothing left to do.
    """

    look: Look
    since_ns: int
    taken: Taken | None = None
    steps: int = 0
    lossless: asyncio.Future[Encoded] | None = None
    over: bool = False


class Session:
    """One session. `run` does its work until it is cancelled.

    Args:
        name: its name on the wire.
        stage: loads scenes, renders and encodes.
        clock: monotonic [ns].
    """

    def __init__(self, name: str, stage: Stage, clock: Callable[[], int]) -> None:
        self.name = name
        self.viewers: set[Outbox] = set()
        self.sources: dict[Outbox, float] = {}
        self.attention = Attention()
        self.configuration: Configuration | None = None
        self.empty_since_ns: int | None = clock()
        self._stage = stage
        self._clock = clock
        self._counts = Counts()
        self._accepted: list[Configuration] = []
        self._progress: Progress | None = None
        self._latest: Shown | None = None
        self._gaze_waits = False
        self._asked_ns = 0
        self._encode_ms = 0.0
        self._status_ns = 0
        self._refusal: protocol.Error | None = None
        self._wake = asyncio.Event()

    # Connections

    def outbox(self) -> Outbox:
        """A place for what waits to be sent to one client of this session."""
        return Outbox(self._clock, self.status, self._stage.studio.metrics)

    def join_viewer(self, viewer: Outbox) -> None:
        """Show frames to a viewer, the present one first."""
        self.viewers.add(viewer)
        viewer.tell(self.ready())
        if self._latest is not None:
            viewer.offer(self._latest)
        self._connections_changed()

    def join_source(self, source: Outbox) -> None:
        """Take gaze from a source."""
        self.sources[source] = 0.0
        source.tell(self.ready())
        self._connections_changed()

    def leave(self, client: Outbox) -> None:
        """Forget a client that has left."""
        if client in self.viewers:
            self._counts.dropped += client.dropped
        self.viewers.discard(client)
        self.sources.pop(client, None)
        self._connections_changed()

    def _connections_changed(self) -> None:
        self.empty_since_ns = None if self.viewers or self.sources else self._clock()
        self._tell_status()
        self._wake.set()

    # What clients say

    def look(self, samples: Iterable[protocol.Gaze]) -> None:
        """Take in gaze, oldest first."""
        now_ns = self._clock()
        state = self.attention.state
        for sample in samples:
            if self._gaze_waits:
                self._counts.superseded += 1
                self._stage.studio.metrics.superseded()
            self._gaze_waits = True
            self.attention = observe(self.attention, sample, now_ns)
        if self.attention.state != state:
            self._tell_status()
        self._wake.set()

    def set_margin(self, source: Outbox, margin_deg: float) -> None:
        """Allow for a source's error."""
        self.sources[source] = margin_deg
        self._wake.set()

    def forward(self, target: protocol.Target) -> None:
        """Show a calibration target on every viewer."""
        for viewer in self.viewers:
            viewer.tell(target)

    def body(self) -> dict[str, Any]:
        """The fields of the newest configuration that was accepted, to change some of them.

        Raises:
            LookupError: if there was none.
        """
        newest = self._accepted[-1] if self._accepted else self.configuration
        if newest is None:
            raise LookupError
        return newest.body.model_dump(exclude={"gaze"})

    async def configure(self, number: int, body: StreamBody) -> None:
        """Put a configuration in force at the next frame; every client is told `ready` by then.

        Raises:
            SettingsError, OverLimit, UnknownScene, SceneError: what was in force stays so.
        """
        order = body.order()
        prepared = await self._stage.prepare(order)
        self._accepted.append(Configuration(number, body, prepared, order))
        if body.gaze is not None:
            self.look([protocol.Gaze(**body.gaze.model_dump())])
        self._wake.set()

    # What clients are told

    def ready(self) -> protocol.Ready:
        """What is in force."""
        in_force = self.configuration
        if in_force is None:
            return protocol.Ready(self.name, None, None, None, None, (), self._clock())
        request, prepared = in_force.order.request, in_force.prepared
        return protocol.Ready(
            self.name,
            in_force.id,
            in_force.order.scene_id,
            asdict(request.display),
            asdict(request.camera or prepared.scene.camera),
            tuple(
                protocol.Effect(effect.name, effect.reason[: protocol.LONGEST_TEXT]) for effect in prepared.plan.effects
            ),
            self._clock(),
        )

    def status(self) -> protocol.Status:
        """The session in numbers."""
        return protocol.Status(
            frames=self._counts.frames,
            superseded=self._counts.superseded,
            dropped=self._counts.dropped + sum(viewer.dropped for viewer in self.viewers),
            rejected=self._counts.rejected,
            viewers=len(self.viewers),
            gaze_sources=len(self.sources),
            gaze_state=self.attention.state,
        )

    def close(self, code: CloseCode, reason: str) -> None:
        """End every connection."""
        for client in (*self.viewers, *self.sources):
            client.close(code, reason)

    def _tell(self, message: protocol.Ready | protocol.Error) -> None:
        for client in (*self.viewers, *self.sources):
            client.tell(message)

    def _tell_status(self) -> None:
        self._status_ns = self._clock()
        for client in (*self.viewers, *self.sources):
            client.tell_status()

    # Rendering

    async def run(self) -> None:
        """Render what the viewers can take in, newest gaze first, until cancelled."""
        while True:
            self._wake.clear()
            self._apply_accepted()
            self._let_time_pass()
            if (step := self._next_step()) is not None:
                await self._take(step)
            elif not self._finish():
                await self._woken()

    def _apply_accepted(self) -> None:
        """Put accepted configurations in force. Frames of the old one are forgotten before `ready` is told."""
        for accepted in self._accepted:
            self._drop_progress()
            for viewer in self.viewers:
                viewer.withdraw()
            self.configuration, self._latest, self._asked_ns = accepted, None, self._clock()
            self._tell(self.ready())
        self._accepted.clear()

    def _let_time_pass(self) -> None:
        before = self.attention
        self.attention = elapse(before, self._clock())
        if self.attention.state != before.state:
            self._tell_status()

    def _next_step(self) -> Step | None:
        """What to render now; None if everything is rendered, or nobody could take it."""
        configuration = self.configuration
        if configuration is None or not any(viewer.wants_frame for viewer in self.viewers):
            return None
        try:
            self._stage.studio.require_ready()
        except NotReady as error:
            self._refuse(error)
            return None
        self._gaze_waits = False
        before = self._progress
        look = look_at(configuration, self.attention, self._margin_deg(), None if before is None else before.look)
        if before is None or before.look != look:
            self._drop_progress()
            self._progress = Progress(look, self._clock())
        progress = self._progress
        assert progress is not None
        if progress.over or progress.steps >= steps_of(configuration, look):
            return None
        return step_of(configuration, look, self.attention, progress.steps, self._encode_ms)

    async def _take(self, step: Step) -> None:
        """Render one step and offer it to every viewer."""
        configuration, progress, attention = self.configuration, self._progress, self.attention
        assert configuration is not None
        assert progress is not None
        asked_ns = max(self._asked_ns, attention.received_ns) if progress.steps == 0 else self._clock()
        try:
            rendered, encoded = await self._rendered(configuration, progress, step)
        except Abandoned:
            return
        except NotReady as error:  # it goes on where it stopped, once there is someone to trace again
            self._refuse(error)
            await self._woken()
            return
        except Exception as error:
            progress.over = True
            self._refuse(error)
            return
        cost, steps = rendered.frame.cost, steps_of(configuration, progress.look)
        progress.steps = steps_done(step, cost, progress.steps, steps)
        if progress.steps >= steps and step.format in UNCHANGED_FORMATS and not progress.look.saccade:
            step, progress.over = replace(step, phase="final"), True
        if step.phase == "moving":
            self._encode_ms += ENCODE_GAIN * (encoded.encode_ms - self._encode_ms)
            self._stage.studio.metrics.moved((encoded.finished_ns - asked_ns) / NS_PER_MS)
        progress.taken = Taken(step, attention, asked_ns, rendered)
        self._counts.rejected += cost.rejected_samples.total
        self._show(progress.taken, encoded)

    async def _rendered(self, configuration: Configuration, progress: Progress, step: Step) -> tuple[Rendered, Encoded]:
        """One step; given up when there is something better to do.

        Raises:
            Abandoned: when it was.
        """
        abandon, began_ns = threading.Event(), self._clock()
        rendering = asyncio.ensure_future(self._stage.render(configuration, step, abandon))
        try:
            while not rendering.done():
                self._wake.clear()
                self._let_time_pass()
                if self._overtaken(configuration, progress, began_ns):
                    abandon.set()
                await self._woken(rendering)
            return rendering.result()
        finally:
            abandon.set()
            rendering.add_done_callback(_forget_error)
            del rendering  # its error refers to this call: the two would keep each other, and the frame's memory

    def _overtaken(self, configuration: Configuration, progress: Progress, began_ns: int) -> bool:
        """Whether what is being rendered is no longer worth its time.

        The first frame of a look is given up only for a new configuration, and only if it takes long: otherwise
        a camera that moves faster than frames are rendered would never be shown. That of the whole screen, for a
        gaze that was lost, is given up when the gaze is back.
        """
        if not self.viewers:
            return True
        first = progress.steps == 0
        if self._accepted and not (first and self._clock() - began_ns < PATIENCE_NS):
            return True
        if first and progress.look.bucket is not None:
            return False
        return look_at(configuration, self.attention, self._margin_deg(), progress.look) != progress.look

    def _margin_deg(self) -> float:
        return max(self.sources.values(), default=0.0)

    def _finish(self) -> bool:
        """Work towards the lossless frame beside whatever else is done; whether something was done."""
        configuration, progress = self.configuration, self._progress
        if configuration is None or progress is None or progress.over or progress.taken is None:
            return False
        taken, look = progress.taken, progress.look
        if taken.step.phase == "final" or look.saccade or progress.steps < steps_of(configuration, look):
            return False
        if progress.lossless is None:
            if self._clock() - progress.since_ns < SETTLED_NS:
                return False
            lossless = asyncio.ensure_future(self._stage.encode_lossless(taken.rendered.frame, LOSSLESS))
            lossless.add_done_callback(lambda _: self._wake.set())
            progress.lossless = lossless
            return True
        if not progress.lossless.done():
            return False
        progress.over = True
        final = replace(taken, step=replace(taken.step, phase="final", format=LOSSLESS))
        try:
            self._show(final, progress.lossless.result())
        except Exception as error:
            self._refuse(error)
        return True

    def _show(self, taken: Taken, encoded: Encoded) -> None:
        """Offer a frame to every viewer."""
        assert self.configuration is not None
        self._refusal = None
        self._counts.frames += 1
        self._latest = shown(
            self._counts.frames, self.name, self.configuration, self._counts.superseded, taken, encoded
        )
        for viewer in self.viewers:
            viewer.offer(self._latest)
        if self._clock() - self._status_ns >= STATUS_NS:
            self._tell_status()

    def _refuse(self, error: Exception) -> None:
        """Tell every client why there is no frame, once."""
        refused = refusal(error)
        if refused != self._refusal:
            self._refusal = refused
            log.info("session %s: frame refused: %s", self.name, refused.message)
            self._tell(refused)

    def _drop_progress(self) -> None:
        if self._progress is not None and self._progress.lossless is not None:
            self._progress.lossless.cancel()
        self._progress = None

    async def _woken(self, rendering: asyncio.Future[Any] | None = None) -> None:
        """Return when there may be something to do."""
        waiting = bool(self.viewers) and self._progress is not None and not self._progress.over
        timed = waiting or next_change_ns(self.attention) is not None or self._refusal is not None
        woken = asyncio.ensure_future(self._wake.wait())
        try:
            await asyncio.wait(
                {woken} if rendering is None else {woken, rendering},
                timeout=TICK_S if timed else None,
                return_when=asyncio.FIRST_COMPLETED,
            )
        finally:
            woken.cancel()


def _forget_error(rendering: asyncio.Future[Any]) -> None:
    """Have a frame that nobody waits for any more end without a complaint in the log that it was given up."""
    if not rendering.cancelled():
        rendering.exception()
