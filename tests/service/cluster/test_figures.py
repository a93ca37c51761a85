"""What tracing on a cluster costs beside tracing here: `pytest -m bench -s tests/service/cluster/test_figures.py`.

Prints figures as JSON; those under `rates` are what a simulation of larger clusters wants: of one core, by its
processor time. Ratios are of things measured in turn, on the same two cores.
"""

from __future__ import annotations

import json
import pickle
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from typing import Any, TypeVar

import pytest

from clients.command_line.animate import drawn
from renderer.camera_path import orbited
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.library import SceneLibrary
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.store import SampleStore
from renderer.tracing import Lack, ThreadTracing, Traced
from renderer.workers import WorkerPool, Workers
from service.cluster.cluster import Cluster
from service.cluster.piece import Colours, cheaper_as_sums, piece_of, take_in, trace_piece
from tests.service.cluster.nodes import cluster_of

START_S = 300.0
SCREEN = Display()
GAZE = Gaze(960, 540)
SMALL_PIECE = 64
"""Cells of a piece whose time is its way."""

CLIP_FRAMES = 12
Result = TypeVar("Result")

LEAST_SCALING = 1.2
MOST_OVERHEAD = 1.5


class Keeping:
    """Traces on threads, and keeps what was lacking."""

    def __init__(self) -> None:
        self.lacks: list[tuple[Lack, SampleStore]] = []

    def trace(self, lack: Lack, store: SampleStore, pool: Workers) -> Traced:
        self.lacks.append((lack, store))
        return ThreadTracing().trace(lack, store, pool)


@pytest.fixture(scope="module")
def atrium() -> PreparedScene:
    return SceneLibrary().load("atrium")


def asked(samples: int, screen: Display = SCREEN) -> FrameRequest:
    return FrameRequest(GAZE, screen, None, Quality(samples_per_cell=samples))


def seconds(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


@dataclass(frozen=True, eq=False)
class Cut:
    """A frame cut into pieces.

    Attributes:
        lack, store: what a frame of so many samples hands over, and an empty store.
        parts: of its cells.
    """

    lack: Lack
    store: SampleStore
    parts: list[slice]

    @property
    def sums(self) -> bool:
        return cheaper_as_sums(self.lack, self.store)

    def packed(self, parts: list[slice]) -> list[bytes]:
        return [pickle.dumps(piece_of(self.lack, self.store, part, sums=self.sums)) for part in parts]

    def taken(self, colours: list[Colours]) -> None:
        for part, one in zip(self.parts, colours, strict=True):
            take_in(self.lack, self.store, part, self.sums, one)


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """What it gives, and the processor time of this process [s]."""
    began = time.process_time()
    result = work()
    return result, time.process_time() - began


@pytest.mark.bench
def test_bytes_and_packing(atrium: PreparedScene) -> None:
    """Of a frame of 1920x1080, cut as for two workers; no cluster is needed."""
    keeping, pool = Keeping(), WorkerPool(1)
    renderer = Renderer(1, tracing=keeping)
    renderer.render(atrium, asked(1))
    renderer.close()
    ((lack, kept),) = keeping.lacks
    cells, slots = len(lack.chosen), len(kept.samples.number)
    parts = [slice(start, min(cells, start + cells // 6 + 1)) for start in range(0, cells, cells // 6 + 1)]
    many = Cut(lack._replace(quality=asked(32).quality, until=lack.until * 32), SampleStore(slots), parts)
    once = Cut(lack, SampleStore(slots), parts)
    assert many.sums
    assert not once.sums
    pieces, packing_s = timed(partial(once.packed, parts))
    fixed = len(once.packed([slice(0, 1)])[0])
    colours, tracing_s = timed(lambda: [trace_piece(atrium, pickle.loads(piece), pool) for piece in pieces])
    _, taking_s = timed(partial(once.taken, colours))
    pool.close()
    out, out_of_many = (sum(map(len, packed)) for packed in (pieces, many.packed(parts)))
    rates = {
        "samples_per_s": cells / tracing_s,
        "pack_cells_per_s": cells / packing_s,
        "take_cells_per_s": cells / taking_s,
        "bytes_out_per_cell": (out - fixed * len(parts)) / cells,
        "bytes_back_per_sample": sum(len(one.numbers) for one in colours) / cells,
        "most_bytes_back_per_cell": 20.0,
    }
    wire = {"1 sample": [out, 12 * cells], "32 samples": [out_of_many, 20 * cells]}
    print(
        "\n"
        + json.dumps({"cells": cells, "bytes out and back": wire, "bytes a piece": fixed, "rates": rates}, indent=1)
    )
    assert rates["bytes_out_per_cell"] < 2.0


@pytest.mark.bench
@pytest.mark.skipif(find_spec("ray") is None, reason="the extra 'cluster', Ray, is not installed")
def test_a_frame_and_a_clip_beside_this_machine(atrium: PreparedScene) -> None:
    """A frame by a worker with two threads over one by two threads here; a clip by two workers over one by one."""
    here = Renderer(2)
    with cluster_of(pair=2) as nodes:
        cluster = Cluster(nodes.address)
        cluster.wait_ready(START_S)
        far = Renderer(2, tracing=cluster)
        found: dict[str, Any] = {}
        for samples, repeats in ((1, 7), (32, 1)):
            ratios = []
            for _ in range(repeats + (samples == 1)):
                for renderer in (here, far):
                    renderer.forget_samples()
                took = [seconds(partial(renderer.render, atrium, asked(samples))) for renderer in (far, here)]
                ratios.append(took[0] / took[1])
            found[f"frame of {samples}, cluster over here"] = statistics.median(ratios[samples == 1 :])
        tiny = asked(1, Display(32, 18))
        ways = []
        for x in range(30):
            far.forget_samples()
            here.forget_samples()
            one = replace(tiny, gaze=Gaze(x, 9))
            ways.append(seconds(partial(far.render, atrium, one)) - seconds(partial(here.render, atrium, one)))
        found["rates"] = {"round_trip_s": statistics.median(ways[10:])}
        cluster.close()
        nodes.remove("pair")
        nodes.add("one")
        cluster = Cluster(nodes.address)
        cluster.wait_ready(START_S)
        camera, small = atrium.scene.camera, Display(480, 270)
        shots = [replace(asked(4, small), camera=orbited(camera, 3.0 * frame)) for frame in range(CLIP_FRAMES)]
        tasks = [partial(drawn, shot, []) for shot in shots]
        list(cluster.run(atrium, tasks))
        alone = seconds(lambda: list(cluster.run(atrium, [partial(drawn, _turned(shot), []) for shot in shots])))
        nodes.add("two")
        cluster.wait_ready(START_S, 2)
        list(cluster.run(atrium, [partial(drawn, _turned(shot, 2), []) for shot in shots[:4]]))
        both = seconds(lambda: list(cluster.run(atrium, [partial(drawn, _turned(shot, 3), []) for shot in shots])))
        found["clip, one worker over two"] = alone / both
        cluster.close()
    print("\n" + json.dumps(found, indent=1))
    assert found["frame of 32, cluster over here"] < MOST_OVERHEAD
    assert found["clip, one worker over two"] > LEAST_SCALING


def _turned(shot: FrameRequest, times: int = 1) -> FrameRequest:
    """The same work, which no worker has done before."""
    assert shot.camera is not None
    return replace(shot, camera=orbited(shot.camera, 0.1 * times))
