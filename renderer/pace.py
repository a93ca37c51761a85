"""How fast this machine renders, learned from the frames it makes."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Hashable
from typing import NamedTuple

from renderer.frame import FrameRequest
from renderer.prepared import PreparedScene
from renderer.whitted import shadow_rays_each

GAIN = 1 / 4
"""Weight of a new measurement in the mean and the mean deviation: both follow within some frames."""

FIRST_DEVIATION = 1 / 4
"""Mean deviation, over the mean, that is assumed when there is only one measurement."""

CAUTION = 2.0
"""Mean deviations that are added to a mean when time is planned (Jacobson 1988 adds 2, later 4, for timeouts)."""

OUTLIER = 3.0
"""Factor from the mean beyond which a measurement is cut: one hiccup does not undo what many frames have shown."""

LEAST_SAMPLES = 1024
"""Fewer samples than this are traced too fast to learn from."""

KEPT_RATES = 256
"""Rates kept, those used last: a scene that is gone is forgotten."""

MAP_SEED_NS = 40.0
FRAME_SEED_NS = 30.0
SAMPLE_SEED_NS = 4000.0
"""What a single thread is taken to need for a pixel of a new map, for a pixel of a frame beside its samples,
and for a camera sample with all it spawns, until it is measured: two to four times what a core of 2020 takes [ns].
"""


class Rate(NamedTuple):
    """Time for one unit of work.

    Attributes:
        mean: exponential mean of the measurements, or a guess [ns].
        deviation: exponential mean of their distances from it [ns].
        measured: how many there were.
    """

    mean: float
    deviation: float = 0.0
    measured: int = 0

    @property
    def cautious(self) -> float:
        """A time that few units exceed [ns]."""
        return self.mean + CAUTION * self.deviation

    def after(self, ns: float) -> Rate:
        """The rate once a unit has taken `ns` (mean and deviation as in Jacobson 1988, section 2).

        The first measurements replace the guess and are averaged evenly; none of them counts as an outlier.
        """
        if self.measured == 0:
            return Rate(ns, ns * FIRST_DEVIATION, 1)
        gain = max(GAIN, 1 / (self.measured + 1))
        if self.measured * GAIN >= 1:
            ns = min(max(ns, self.mean / OUTLIER), self.mean * OUTLIER)
        error = ns - self.mean
        return Rate(self.mean + gain * error, self.deviation + gain * (abs(error) - self.deviation), self.measured + 1)


class Rates(NamedTuple):
    """What a frame's parts take [ns].

    Attributes:
        map_pixel: a pixel of a screen whose map is new.
        frame_pixel: a pixel, for all but its map and its samples.
        sample: a camera sample.
    """

    map_pixel: float
    frame_pixel: float
    sample: float


class Pace:
    """Rates of one renderer by what was rendered; any number of threads may read and teach it."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._rates: OrderedDict[Hashable, Rate] = OrderedDict()
        self._lock = threading.Lock()

    def rates(self, prepared: PreparedScene, request: FrameRequest) -> Rates:
        """Cautious rates for a frame."""
        seeds = (MAP_SEED_NS, FRAME_SEED_NS, SAMPLE_SEED_NS)
        with self._lock:
            return Rates(
                *(
                    self._rates.get(key, Rate(seed / self._threads)).cautious
                    for key, seed in zip(_keys(prepared, request), seeds, strict=True)
                )
            )

    def learn(
        self, prepared: PreparedScene, request: FrameRequest, map_ns: float | None, frame_ns: float, trace_ns: float,
        samples: int,
    ) -> None:  # fmt: skip
        """Take note of a finished frame.

        Args:
            prepared, request: what was rendered.
            map_ns: time for its map, None if that was there.
            frame_ns: time for all else but tracing.
            trace_ns, samples: time for tracing, and camera samples asked for.
        """
        map_key, frame_key, sample_key = _keys(prepared, request)
        pixels = request.display.pixels
        with self._lock:
            self._note(frame_key, frame_ns / pixels)
            if map_ns is not None:
                self._note(map_key, map_ns / pixels)
            if samples >= LEAST_SAMPLES:
                self._note(sample_key, trace_ns / samples)

    def _note(self, key: Hashable, ns: float) -> None:
        self._rates[key] = self._rates.get(key, Rate(ns)).after(ns)
        self._rates.move_to_end(key)
        while len(self._rates) > KEPT_RATES:
            self._rates.popitem(last=False)


def _keys(prepared: PreparedScene, request: FrameRequest) -> tuple[Hashable, Hashable, Hashable]:
    """What decides the rates of map, frame and samples; screens within a factor of two in pixels share them."""
    quality, size = request.quality, request.display.pixels.bit_length()
    return (
        ("map", quality.map, size),
        ("frame", quality.reconstruction, request.linear, size),
        (
            "sample",
            prepared.identity,
            quality.max_depth,
            shadow_rays_each(quality),
            quality.antialiasing,
            quality.effects,
        ),
    )
