"""Rows beside other renderers, which are given our own scene."""

from __future__ import annotations

import contextlib
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clients.command_line.benchmark.frame_rows import timed_frame_ms
from clients.command_line.benchmark.job import Job
from clients.command_line.benchmark.row import Row, measured_row, missing_row
from clients.command_line.peers.alike import matt_alike, whitted_alike
from clients.command_line.peers.mitsuba_scene import (
    VECTOR,
    fastest_variant,
    has_mitsuba,
    mitsuba,
    mitsuba_scene,
    render_on,
)
from clients.command_line.peers.povray import find_povray, povray_trace_s
from renderer.benchmark import RecordedRays, recording, trace_rays
from renderer.frame import FrameRequest
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scenes import BUILT_IN
from renderer.workers import WorkerPool

MITSUBA_AIMS = {1: 4.0, 16: 1.8}
"""How many times as many samples a second, by samples a pixel."""

POVRAY_AIM = 10.0
POVRAY_SCENE = "spheres"
"""Mirrors and glass: what it was made for; and a text of a hundred thousand triangles is slow to read."""

DIRECT = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
"""Mitsuba's integrator that sends one ray to a light for each camera ray, as we do."""


def peer_rows(job: Job) -> tuple[Row, ...]:
    """Each peer's time for the same work over ours; where Embree traces for both, also over that of our rays alone."""
    return *_mitsuba_rows(job), *_povray_rows(job)


def _mitsuba_rows(job: Job) -> tuple[Row, ...]:
    what = {samples: f"samples/s beside Mitsuba 3, {samples} a pixel" for samples in MITSUBA_AIMS}
    if not has_mitsuba():
        why = "not installed: pip install 'gazetrace[peers]'"
        return tuple(missing_row("peers", text, why) for text in what.values())
    try:
        scene = matt_alike(job.prepared.scene)
    except ValueError as error:
        return tuple(missing_row("peers", text, str(error)) for text in what.values())
    variant = fastest_variant()
    scene = replace(scene, camera=job.request.camera or scene.camera)
    theirs = mitsuba_scene(scene, job.request.display, variant)
    render_on(job.renderer.threads)
    ours = replace(job, prepared=prepare(scene))
    rows = []
    for samples, aim in MITSUBA_AIMS.items():
        if variant != VECTOR and samples > 1:
            rows.append(
                missing_row("peers", what[samples], f"takes minutes with {variant}, as there is no LLVM library")
            )
            continue
        request = _full(ours.request, samples, depth=0)
        timed_frame_ms(job.renderer, ours, request)
        _mitsuba_s(theirs, variant, samples, seed=0)  # what it compiles is kept
        rays, gains, bounds, rates = _rays_alone(ours, request, every=samples), [], [], []
        for repeat in range(job.heavy_repeats):
            own_s = timed_frame_ms(job.renderer, ours, request) / 1e3
            peer_s = _mitsuba_s(theirs, variant, samples, seed=repeat + 1)
            gains.append(peer_s / own_s)
            bounds.append(peer_s / rays.traced_s(ours))
            rates.append(request.display.pixels * samples / own_s / 1e6)
        note = f"{variant}; matt, 1 light, full map; ours {sorted(rates)[len(rates) // 2]:.1f} M/s"
        rows.append(measured_row("peers", what[samples], gains, aim=aim, at_least=True, note=note))
        rows.append(
            measured_row(
                "peers", f"Mitsuba 3 / tracing our rays alone, {samples} a pixel", bounds, note="tracing alone"
            )
        )
    return tuple(rows)


def _mitsuba_s(scene: Any, variant: str, samples: int, seed: int) -> float:
    """Time of one of its pictures [s]."""
    mi = mitsuba(variant)
    integrator = mi.load_dict(DIRECT)
    began = time.perf_counter()
    np.array(mi.render(scene, integrator=integrator, spp=samples, seed=seed))
    return time.perf_counter() - began


def _povray_rows(job: Job) -> tuple[Row, ...]:
    what = f"POV-Ray's trace time / full frame, {POVRAY_SCENE}"
    if find_povray() is None:
        return (missing_row("peers", what, "not installed: its program is povray"),)
    scene = whitted_alike(BUILT_IN[POVRAY_SCENE]())
    ours = replace(job, prepared=prepare(scene))
    request = replace(_full(job.request, 1, job.request.quality.max_depth), camera=None)
    timed_frame_ms(job.renderer, ours, request)
    gains = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(job.heavy_repeats):
            own_s = timed_frame_ms(job.renderer, ours, request) / 1e3
            depth, threads = request.quality.max_depth, job.renderer.threads
            gains.append(povray_trace_s(scene, request.display, depth, threads, Path(folder)) / own_s)
    note = f"1 sample a pixel, depth {request.quality.max_depth}, no textures"
    return (measured_row("peers", what, gains, aim=POVRAY_AIM, at_least=True, note=note),)


class _RaysAlone(NamedTuple):
    """Rays of a frame.

    Attributes:
        rays: some of them.
        share: which share of all.
    """

    rays: RecordedRays
    share: float

    def traced_s(self, job: Job) -> float:
        """How long all of them take to trace, as we do that, and nothing else [s]."""
        intersector = job.prepared.intersector
        with contextlib.closing(WorkerPool(job.renderer.threads)) as pool:
            began = time.perf_counter()
            trace_rays(self.rays, pool, intersector.nearest, intersector.occluded)
            return (time.perf_counter() - began) / self.share


def _rays_alone(job: Job, request: FrameRequest, every: int) -> _RaysAlone:
    """The rays of a frame, of one batch in `every`: a picture of many samples has more than memory should hold."""
    recorded, rays = recording(job.prepared, every)
    job.renderer.forget_samples()
    frame = job.renderer.render(recorded, request)
    return _RaysAlone(rays, rays.number / frame.cost.rays.total)


def _full(request: FrameRequest, samples: int, depth: int) -> FrameRequest:
    """The frame with every pixel a cell."""
    return replace(request, quality=Quality(map="full", samples_per_cell=samples, max_depth=depth))
