"""The bridge as it runs: a thread that reads the device, an event loop that talks to the service, a slot between."""

from __future__ import annotations

import asyncio
import json
import random
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from clients.backoff import Backoff
from clients.bridge.calibration import fit
from clients.bridge.calibration_walk import CalibrationWalk, WalkState
from clients.bridge.codec import SECOND_NS, Codec
from clients.bridge.config import Config
from clients.bridge.device import Device, Ears
from clients.bridge.device_state import DeviceState
from clients.bridge.errors import ConfigError
from clients.bridge.gaze import Gaze
from clients.bridge.health import BUSY_SHARE, Meter, in_ms, percentile
from clients.bridge.log import Log
from clients.bridge.notify import notify, watchdog_interval_s
from clients.bridge.port import Chunk, Port
from clients.bridge.protocols import codec_of
from clients.bridge.recording import Recorder
from clients.bridge.service_link import Listeners, ServiceLink, ServiceState
from clients.bridge.slot import Slot
from clients.bridge.source import path_of, place_of, port_opener, require_calibration, screen_of
from service.protocol import Target

HEALTH_S = 5.0
FAIL_FAST_S = 5.0
ALIVE_NS = 5 * SECOND_NS
"""The device's thread shows itself several times a second."""
DRAIN_S = 1.0
"""How long the last gazes of a recording may take to be sent."""

OK, FAILED, NEVER_SEEN = 0, 1, 3
"""Exit statuses; 2 is for settings that cannot be used."""


@dataclass(slots=True)
class NewCalibration:
    """A calibration to be made.

    Attributes:
        file: where it is kept.
        walk: the targets.
    """

    file: Path
    walk: CalibrationWalk = field(default_factory=CalibrationWalk)


class Bridge:
    """One device, one session.

    Args:
        config: the settings.
        log: where events are told.
        show: takes each gaze instead of a service: a dry run. None to send.
        calibrate: a calibration to be made before anything is sent; None for none.
        about: what a recording is to say of the device.

    Raises:
        ConfigError: for settings that cannot be used.
    """

    def __init__(
        self,
        config: Config,
        log: Log,
        show: Callable[[Gaze], None] | None = None,
        calibrate: NewCalibration | None = None,
        about: Mapping[str, str] | None = None,
    ) -> None:
        self.config = config
        self._log = log
        self._show = show
        self._walk = calibrate.walk if calibrate is not None else None
        self._calibrate = calibrate
        self._about = dict(about or {})
        self.codec: Codec = codec_of(config)
        if show is None and calibrate is None:
            require_calibration(config, self.codec)
        self._path = path_of(config, self.codec)
        self._open_port = port_opener(config, self.codec)
        self._recorder: Recorder | None = None
        self._byte_ns = 0.0
        self._meter = Meter(time.monotonic_ns())
        self._slot = Slot()
        self._min_interval_ns = SECOND_NS / config.max_rate_hz if config.max_rate_hz else 0.0
        self._last_put: Gaze | None = None
        self._decimated = 0
        self._seen = threading.Event()
        self._stopping: asyncio.Event | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._status = OK
        ears = Ears(self._gaze, self._chunk, self._device_state, lambda why: log.say("device", why))
        self.device = Device(self._open, self.codec, self._path, ears, Backoff(random.random))
        self.link: ServiceLink | None = None
        if show is None:
            listeners = Listeners(self._service_state, self._display, lambda said: log.say_once("service", said))
            backoff = Backoff(random.random)
            self.link = ServiceLink(config.service, config.session, config.token, self._slot, listeners, backoff)

    def stop(self) -> None:
        """Have `run` end; from any thread."""
        loop, stopping = self._loop, self._stopping
        if loop is not None and stopping is not None:
            with suppress(RuntimeError):  # the loop may end in this moment
                loop.call_soon_threadsafe(stopping.set)

    async def run(self) -> int:
        """Work until stopped or the recording ends; the exit status.

        Raises:
            ConfigError: for a setting that turned out to be unusable.
        """
        self._loop = asyncio.get_running_loop()
        self._stopping = asyncio.Event()
        if self.config.record is not None:
            self._recorder = Recorder(self.config.record, {"settings": self._about})
        if self.link is not None and self._path.calibration is not None:
            self.link.margin(self._path.calibration.margin_deg(self._path.place.screen))
        thread = threading.Thread(target=self._read, name="device", daemon=True)
        works = [self._report(), self._watchdog(), self._fail_fast()]
        if self.link is not None:
            works.append(self.link.run())
        tasks = [asyncio.create_task(work) for work in works]
        for task in tasks:
            task.add_done_callback(self._ended)
        thread.start()
        notify("READY=1")
        try:
            await self._stopping.wait()
        finally:
            notify("STOPPING=1")
            self.device.stop()
            await asyncio.to_thread(thread.join)
            if self.link is not None and self.link.state is ServiceState.READY:
                await self._drain()
            for task in tasks:
                task.cancel()
            results = await asyncio.gather(*tasks, return_exceptions=True)
            self._say_health()
            if self._recorder is not None:
                await asyncio.to_thread(self._recorder.close)
        if self.device.error is not None:
            raise self.device.error
        for result in results:
            if isinstance(result, Exception):
                raise result
        return self._status

    # The device's thread

    def _read(self) -> None:
        try:
            self.device.run()
        finally:
            self.stop()

    def _open(self) -> Port:
        port = self._open_port()
        self._byte_ns = port.byte_ns
        return port

    def _chunk(self, chunk: Chunk) -> None:
        self._meter.received(len(chunk.data))
        if self._recorder is not None:
            self._recorder.keep(chunk)
            if self._recorder.error is not None:
                self._log.say_once("recording", self._recorder.error)

    def _gaze(self, gaze: Gaze) -> None:
        self._seen.set()
        if gaze.phase is not None:  # else it only says that no sample came
            self._meter.sample(gaze.valid, gaze.captured_ns, gaze.received_ns)
        if self._walk is not None:
            self._step(self._walk, gaze)
        elif self._show is not None:
            self._show(gaze)
        elif self._due(gaze):
            self._last_put = gaze
            self._slot.put(gaze)
            self._call(self.link.filled if self.link is not None else self.stop)

    def _due(self, gaze: Gaze) -> bool:
        """Whether the rate allows to send it; that the eye was lost or found is always sent."""
        last = self._last_put
        if last is None or last.valid != gaze.valid or not self._min_interval_ns:
            return True
        if gaze.captured_ns - last.captured_ns < self._min_interval_ns:
            self._decimated += 1
            return False
        return True

    def _device_state(self, state: DeviceState, why: str) -> None:
        self._log.say("device", f"{state}: {why}", state=str(state))

    def _call(self, function: Callable[[], None]) -> None:
        if self._loop is not None:
            with suppress(RuntimeError):  # the loop may end in this moment
                self._loop.call_soon_threadsafe(function)

    def _step(self, walk: CalibrationWalk, gaze: Gaze) -> None:
        """Calibrate: nothing happens before somebody can see the targets."""
        link = self.link
        if link is None or link.state is not ServiceState.READY:
            return
        if not link.viewers:
            page = f"{self.config.service}/?session={self.config.session}"
            self._log.say_once("calibration", f"waiting for somebody to open {page}: the targets are shown there")
            return
        if not walk.step(gaze.received_ns, gaze.measured):
            return
        count = len(walk.targets)
        if walk.state is WalkState.WALKING:
            x, y = walk.target
            self._log.say("calibration", f"target {walk.index + 1} of {count}")
            self._call(lambda: link.target(Target(x, y, "fraction", walk.index, count)))
            return
        self._walk = None
        self._call(lambda: link.target(Target(None, None, "fraction", count - 1, count)))
        try:
            if walk.state is WalkState.FAILED:
                raise ConfigError("calibration", "gaze at each target", f"too little at target {walk.index + 1}")
            self._calibrated(link, walk)
        except (ConfigError, OSError) as error:
            self._log.say("calibration", f"failed: {error}")
            self._status = FAILED
            self.stop()

    def _calibrated(self, link: ServiceLink, walk: CalibrationWalk) -> None:
        calibration = fit(self.config.model, tuple(walk.pairs))
        if self._calibrate is not None:
            calibration.save(self._calibrate.file)
        screen = self._path.place.screen
        residuals, margin = calibration.residuals_deg(screen), calibration.margin_deg(screen)
        self._path.calibration = calibration
        self._call(lambda: link.margin(margin))
        self._log.say(
            "calibration",
            f"{margin:.2f} deg off (left-out points), {max(residuals):.2f} deg at the worst point of the fit",
            margin_deg=round(margin, 4),
            residuals_deg=[round(residual, 4) for residual in residuals],
        )

    # The event loop

    def _service_state(self, state: ServiceState, why: str) -> None:
        self._log.say("service", f"{state}: {why}", state=str(state))

    def _display(self, display: Mapping[str, Any]) -> None:
        """The session's display is known, or has changed."""
        try:
            screen = screen_of(self.config, display)
        except (KeyError, ValueError, TypeError, ConfigError) as error:
            self._log.say_once("service", f"its display is not understood: {error}")
            return
        self._path.place = place_of(self.config, self.codec, screen)
        if self.link is not None and self._path.calibration is not None:
            self.link.margin(self._path.calibration.margin_deg(screen))

    def _ended(self, task: asyncio.Task[None]) -> None:
        """A task that failed must not leave a bridge that only seems to run."""
        if not task.cancelled() and task.exception() is not None:
            self.stop()

    async def _drain(self) -> None:
        """Let the last gazes of a recording be sent."""
        with suppress(TimeoutError):
            async with asyncio.timeout(DRAIN_S):
                while len(self._slot):
                    await asyncio.sleep(0.01)

    async def _report(self) -> None:
        while True:
            await asyncio.sleep(HEALTH_S)
            self._say_health()

    async def _watchdog(self) -> None:
        """Tell systemd that both the loop and the thread live, whether or not data flows."""
        interval_s = watchdog_interval_s()
        while interval_s is not None:
            if time.monotonic_ns() - self.device.beat_ns < ALIVE_NS:
                notify("WATCHDOG=1")
            await asyncio.sleep(interval_s)

    async def _fail_fast(self) -> None:
        if self.config.fail_fast:
            await asyncio.sleep(FAIL_FAST_S)
            if not self._seen.is_set():
                self._log.say("device", f"no sample in {FAIL_FAST_S:g} s: giving up")
                self._status = NEVER_SEEN
                self.stop()

    def health(self) -> dict[str, Any]:
        """How it went since the last time this was asked."""
        now_ns = time.monotonic_ns()
        record: dict[str, Any] = {"device": str(self.device.state), **self._meter.report(now_ns, self._byte_ns)}
        record |= {
            "bad_records": self.codec.bad,
            "device_opens": self.device.opens,
            "clock_restarts": self._path.clock.restarts,
            "clock_drift_ppm": round(self._path.clock.drift * 1e6, 1),
        }
        link = self.link
        if link is not None:
            latencies = list(link.latencies_ns)
            link.latencies_ns.clear()
            record |= {
                "service": str(link.state),
                "sent": link.sent,
                "dropped": self._slot.dropped,
                "decimated": self._decimated,
                "connections": link.connections,
                "latency_ms_p50": in_ms(percentile(latencies, 50)),
                "latency_ms_p99": in_ms(percentile(latencies, 99)),
                "round_trip_ms": in_ms(link.clock.round_trip_ns),
                "service_clock_offset_ms": in_ms(link.clock.offset_ns),
            }
        if self._recorder is not None:
            record["recorded_bytes"] = self._recorder.bytes_written
        return record

    def _say_health(self) -> None:
        record = self.health()
        told = " ".join(f"{name}={value}" for name, value in record.items() if value is not None)
        self._log.say("health", told, **record)
        load = record["line_load_percent"]
        if load is not None and load > 100 * BUSY_SHARE:
            self._log.say_once("device", f"the line is loaded above {100 * BUSY_SHARE:.0f} %: raise the baud rate")
        if self.config.status_file is not None:
            write_status(self.config.status_file, record)


def write_status(path: Path, record: Mapping[str, Any]) -> None:
    """Write a health record, whole or not at all; a full disk stops nothing."""
    half = path.with_name(path.name + ".part")
    with suppress(OSError):
        half.write_text(json.dumps(record) + "\n")
        half.replace(path)
