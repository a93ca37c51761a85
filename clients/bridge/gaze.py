"""From samples to gaze: when, where on the screen, whether the eye is seen, and what it does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

from clients.bridge.calibration import Calibration
from clients.bridge.clock import DeviceClock
from clients.bridge.codec import MILLISECOND_NS
from clients.bridge.one_euro import OneEuro
from clients.bridge.saccade import SaccadeDetector
from clients.bridge.sample import Eye, Point, Sample, gaze_of
from clients.bridge.screen import Place, Screen

PAD_MS = 50.0
"""After the eye opens, gaze is not trusted for so long: 50 to 100 ms are usual."""

REACH = 2.0
"""A gaze further off the screen than so many screens is a code or a failed calibration, never a gaze."""

SILENCE_NS = 250 * MILLISECOND_NS
"""Without a sample for so long the eye counts as lost: the slowest line carries eleven records a second."""

Phase = Literal["fixation", "saccade", "blink"]


class Gaze(NamedTuple):
    """Where the eye looks, or that it is lost.

    Attributes:
        seq: running number of the sample.
        x, y: fractions of the screen from its top-left corner; None where lost.
        tracker_time_ns: the device's own time; None without one.
        arrival_ns: first byte, by our monotonic clock.
        captured_ns: when the eye was there, estimated, by our monotonic clock.
        received_ns: when the last byte was read.
        phase: what the eye does; None where no sample came.
        measured: what the device said, mapped to the screen but not calibrated; None where lost.
    """

    seq: int
    x: float | None
    y: float | None
    tracker_time_ns: int | None
    arrival_ns: int
    captured_ns: int
    received_ns: int
    phase: Phase | None
    measured: Point | None

    @property
    def valid(self) -> bool:
        """Whether the eye is seen."""
        return self.x is not None


@dataclass(slots=True)
class GazeOptions:
    """How samples become gaze.

    Attributes:
        eye: whose gaze counts.
        pad_ns: how long gaze is not trusted after the eye was lost.
        saccade_deg_s: velocity threshold [deg/s]; None for the one that suits the rate.
        smooth: whether to apply the One-Euro filter.
    """

    eye: Eye = Eye.BEST
    pad_ns: int = round(PAD_MS * MILLISECOND_NS)
    saccade_deg_s: float | None = None
    smooth: bool = False


class GazePath:
    """Turns samples into gaze, one after the other.

    Args:
        place: where the device's points lie on the screen; may be replaced at any time.
        clock: the device's clock.
        options: how.
        calibration: from there to the true point; None for none.
    """

    def __init__(
        self, place: Place, clock: DeviceClock, options: GazeOptions, calibration: Calibration | None = None
    ) -> None:
        self.place = place
        self.clock = clock
        self.calibration = calibration
        self._options = options
        self._saccades = SaccadeDetector(options.saccade_deg_s)
        self._filter = OneEuro() if options.smooth else None
        self._seq = 0
        self._last: Gaze | None = None
        self._trusted_from_ns: int | None = None
        self._open = False

    @property
    def rate_hz(self) -> float:
        """Samples a second while the eye is seen."""
        return self._saccades.rate_hz

    def restart(self) -> None:
        """The device was lost: its clock and the eye's past say nothing any more."""
        self.clock.restart()
        self._forget()

    def take(self, sample: Sample, arrival_ns: int, received_ns: int) -> Gaze:
        """The gaze of a sample.

        Args:
            sample: as it came.
            arrival_ns: when its first byte began, by our monotonic clock.
            received_ns: when its last byte was read.
        """
        tracker_ns, captured_ns = self.clock.map(sample.ticks, arrival_ns)
        measured, at = self._where(sample)
        phase: Phase | None = "blink"
        if at is None:
            self._forget()
        else:
            if not self._open:
                self._open = True
                self._trusted_from_ns = captured_ns + (self._options.pad_ns if self._seq > 0 else 0)
            at, phase = self._follow(at, captured_ns, self.place.screen)
        x, y = at if at is not None else (None, None)
        return self._told(Gaze(self._seq, x, y, tracker_ns, arrival_ns, captured_ns, received_ns, phase, measured))

    def missing(self, now_ns: int, gone: bool = False) -> Gaze | None:
        """That the eye is lost because no sample comes; None as long as one may, or once that was said.

        Args:
            now_ns: our monotonic clock.
            gone: whether the device is known to be gone.
        """
        last = self._last
        if last is None or not last.valid or not (gone or now_ns - last.received_ns >= SILENCE_NS):
            return None
        self._forget()
        return self._told(Gaze(self._seq, None, None, None, now_ns, now_ns, now_ns, None, None))

    def _told(self, gaze: Gaze) -> Gaze:
        self._seq += 1
        self._last = gaze
        return gaze

    def _where(self, sample: Sample) -> tuple[Point | None, Point | None]:
        """What was measured and where that is on the screen; None where the eye is lost or that cannot be."""
        point = gaze_of(sample, self._options.eye)
        if point is None:
            return None, None
        measured = self.place.fraction(point)
        at = measured if self.calibration is None else self.calibration.apply(measured)
        if not (math.isfinite(at.x) and math.isfinite(at.y)):
            return None, None
        if max(abs(at.x - 0.5), abs(at.y - 0.5)) > REACH + 0.5:
            return measured, None
        return measured, at

    def _follow(self, at: Point, captured_ns: int, screen: Screen) -> tuple[Point | None, Phase]:
        """Watch a visible eye: its place, smoothed if that is asked for, and what it does."""
        at_deg = screen.degrees(*at)
        moving = self._saccades.update(captured_ns, at_deg)
        if self._filter is not None:
            if moving:
                self._filter.reset()
            at = screen.fraction(*self._filter.update(captured_ns, at_deg))
        if self._trusted_from_ns is not None:
            if captured_ns < self._trusted_from_ns:
                return None, "blink"
            self._trusted_from_ns = None
        return at, "saccade" if moving else "fixation"

    def _forget(self) -> None:
        self._open = False
        self._saccades.reset()
        if self._filter is not None:
            self._filter.reset()
