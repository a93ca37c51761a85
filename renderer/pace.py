"""How fast this machine renders, learned from the frames it makes."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Hashable
from typing import NamedTuple

from renderer.frame import FrameRequest
from renderer.prepared import PreparedScene
from renderer.whitted import shadow_rays_each

GAIN = 1 / 4
"""Weight of a new measurement in the mean and the mean deviation: both follow within some frames."""

LATE_SHARE = 0.03
"""Share of the frames that may take longer than was planned."""

MARGIN_STEP = 0.2
"""Step of the margin's logarithm: a frame that took too long raises it by a fifth, thirty that did not lower it so."""

FIRST_MARGIN = 1.25
"""Margin before there are predictions to learn it from."""

LARGEST_MARGIN = 4.0

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
        measured: how many there were.
    """

    mean: float
    measured: int = 0

    def after(self, ns: float) -> Rate:
        """The rate once a unit has taken `ns`.

        The first measurements replace the guess and are averaged evenly; none of them counts as an outlier.
        """
        if self.measured == 0:
            return Rate(ns, 1)
        gain = max(GAIN, 1 / (self.measured + 1))
        if self.measured * GAIN >= 1:
            ns = min(max(ns, self.mean / OUTLIER), self.mean * OUTLIER)
        return Rate(self.mean + gain * (ns - self.mean), self.measured + 1)


def margin_after(margin: float, ratio: float) -> float:
    """The factor on predictions that all but `LATE_SHARE` of the frames stay within, learned from one more frame.

    A quantile found by steps whose mean is nothing where the quantile is (Robbins and Monro 1951), which needs no
    law of how predictions fail and follows as it changes.

    Args:
        margin: so far, 1 or more.
        ratio: time that the frame took over the time that was predicted.
    """
    step = 1.0 - LATE_SHARE if ratio > margin else -LATE_SHARE
    return min(max(margin * math.exp(MARGIN_STEP * step), 1.0), LARGEST_MARGIN)


class Rates(NamedTuple):
    """What a frame's parts take [ns].

    Attributes:
        map_pixel: a pixel of a screen whose map is new.
        frame_pixel: a pixel, for all but its map and its samples: choosing what fits, reconstruction.
        sample: a camera sample.
        margin: factor on all of them that few frames exceed.
    """

    map_pixel: float
    frame_pixel: float
    sample: float
    margin: float = 1.0


class Pace:
    """Rates of one renderer by what was rendered; any number of threads may read and teach it."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._rates: OrderedDict[Hashable, Rate] = OrderedDict()
        self._margins: OrderedDict[Hashable, float] = OrderedDict()
        self._lock = threading.Lock()

    def rates(self, prepared: PreparedScene, request: FrameRequest) -> Rates:
        """Rates for a frame, and how far they can be trusted."""
        seeds = (MAP_SEED_NS, FRAME_SEED_NS, SAMPLE_SEED_NS)
        keys = _keys(prepared, request)
        with self._lock:
            map_pixel, frame_pixel, sample = (
                self._rates.get(key, Rate(seed / self._threads)).mean for key, seed in zip(keys, seeds, strict=True)
            )
            return Rates(map_pixel, frame_pixel, sample, self._margins.get(keys, FIRST_MARGIN))

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
        keys = map_key, frame_key, sample_key = _keys(prepared, request)
        pixels = request.display.pixels
        with self._lock:
            if all(key in self._rates for key in keys):
                taken = frame_ns + trace_ns + (map_ns or 0.0)
                map_pixel, frame_pixel, sample = (self._rates[key].mean for key in keys)
                around = frame_pixel + (map_pixel if map_ns is not None else 0.0)
                self._trust(keys, taken / (around * pixels + sample * samples))
            self._note(frame_key, frame_ns / pixels)
            if map_ns is not None:
                self._note(map_key, map_ns / pixels)
            if samples >= LEAST_SAMPLES:
                self._note(sample_key, trace_ns / samples)

    def _trust(self, keys: Hashable, ratio: float) -> None:
        self._margins[keys] = margin_after(self._margins.get(keys, FIRST_MARGIN), ratio)
        self._margins.move_to_end(keys)
        while len(self._margins) > KEPT_RATES:
            self._margins.popitem(last=False)

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
