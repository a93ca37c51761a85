"""A Ray cluster that traces, and does whole tasks: what the rest of the service and the commands know of it."""

from __future__ import annotations

import itertools
import logging
import math
import pickle
import threading
import uuid
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from renderer.frame import RayCounts
from renderer.prepared import PreparedScene
from renderer.store import SampleStore
from renderer.tracing import Lack, Traced, total_rays
from renderer.workers import Workers
from service.cluster.backlog import Backlog, cut
from service.cluster.crew import Crew
from service.cluster.errand import RUN, TRACE, Errand
from service.cluster.link import ADDRESS, DEFAULT_OBJECT_STORE_BYTES, OBJECT_STORE_BYTES, THREADS
from service.cluster.piece import Colours, cheaper_as_sums, piece_of, take_in
from service.cluster.worker import Presence, Task, pack_scene

PIECES: Final = 3
"""Pieces that a worker's share of a frame is cut into, so that who is faster than expected can take some over."""

SHORTEST_S, LONGEST_S = 0.01, 0.25
"""Bounds on the time that a worker should take for a piece: what its way costs, and what may be lost with a worker."""

WORTH_S: Final = 0.005
"""Work for which another worker is asked [s]: a piece's way takes about as long."""

KEPT_SCENES: Final = 16
"""Scenes in the cluster's shared memory."""

PATIENCE_S: Final = 20.0
"""How long a frame waits for a worker, where all that there were are gone [s]."""

SEED_RATE: Final = 250_000.0
"""Camera samples a second that a thread is taken to trace until it is measured."""

log = logging.getLogger(__name__)


class Cluster:
    """The workers of a Ray cluster. `trace` is a way to trace that `Renderer` takes.

    Args:
        address: of the cluster, HOST:PORT; `auto` for the one this machine belongs to; `local` to start one here.
        threads: of a cluster started here; None for all cores.
        announce: receives lines for people: workers that come and go.
        object_store_bytes: shared memory of a cluster started here.
    """

    def __init__(
        self,
        address: str,
        threads: int | None = None,
        announce: Callable[[str], None] = log.info,
        object_store_bytes: int = DEFAULT_OBJECT_STORE_BYTES,
    ) -> None:
        options = {ADDRESS: address, THREADS: threads, OBJECT_STORE_BYTES: object_store_bytes}
        self._crew = Crew(address, options, announce)
        self._name = uuid.uuid4().hex
        self._numbers = itertools.count()
        self._scenes: OrderedDict[object, str] = OrderedDict()
        self._lock = threading.Lock()

    @property
    def obstacle(self) -> str | None:
        """Why nothing can be traced now; None if it can."""
        return self._crew.obstacle

    @property
    def workers(self) -> tuple[Presence, ...]:
        """The workers that are ready."""
        with self._crew.changed:
            return tuple(member.presence for member in self._crew.members.values())

    def wait_ready(self, patience_s: float, workers: int = 1) -> None:
        """Return when so many workers are ready.

        Raises:
            ClusterLost: if they are not in time.
        """
        self._crew.wait_ready(patience_s, workers)

    def close(self) -> None:
        """Leave the cluster; one that was started here ends."""
        self._crew.close()

    def trace(self, lack: Lack, store: SampleStore, pool: Workers) -> Traced:
        """Have what is lacking traced by the workers, as `Tracing` describes.

        Raises:
            ClusterLost: if the cluster is lost, or has no worker for a while.
            SceneError: if no worker can load the scene.
            WorkerFailed: if a piece fails wherever it is tried.
        """
        ends = np.cumsum(lack.until - lack.first, dtype=np.int64)
        key = self._key(lack.prepared)
        sums = cheaper_as_sums(lack, store)
        shares, everyone = self._shares(key, store, ends)
        parts = [part for pieces in shares.values() for part in pieces]
        numbers = itertools.count()
        own = {member: [next(numbers) for _ in pieces] for member, pieces in shares.items()}
        samples = [float(ends[part.stop - 1] - (ends[part.start - 1] if part.start else 0)) for part in parts]
        errand = Errand(
            self._crew, key, lambda: pack_scene(lack.prepared), TRACE,
            lambda item: pickle.dumps(piece_of(lack, store, parts[item], sums=sums)),
            samples, pool.abandon, PATIENCE_S, stays=False, helped=everyone,
        )  # fmt: skip
        counts, rejected = [RayCounts()], np.zeros(3, dtype=np.int64)
        for done in errand.done(Backlog(own, samples)):
            colours: Colours = pickle.loads(done.data)
            found = take_in(lack, store, parts[done.item], sums, colours)
            counts.append(found.rays)
            rejected += found.rejected
            errand.learn(done.member, samples[done.item], colours.trace_ns / 1e9)
        return Traced(total_rays(counts), rejected)

    def run(
        self, prepared: PreparedScene, tasks: Sequence[Task], beside: Any = None, patience_s: float = math.inf
    ) -> Iterator[tuple[int, Any]]:
        """Have tasks done by the workers, each worker a row of neighbouring ones, one at a time.

        Args:
            prepared: the scene.
            tasks: what to do; functions of modules that the nodes have too.
            beside: what the tasks are given beside the scene.
            patience_s: how long to wait where the cluster is lost or has no worker [s].

        Yields:
            the number of each task and its result, as they are done.

        Raises:
            ClusterLost: at the end of patience.
            SceneError: if no worker can load the scene.
            WorkerFailed: if a task fails wherever it is tried.
        """
        key = self._key(prepared) if beside is None else self._new_key()
        with self._crew.changed:
            members = sorted(self._crew.members)
        shares = cut(np.arange(1, len(tasks) + 1), [1.0] * len(members), math.inf) if members else []
        own = {
            member: [item for part in pieces for item in range(part.start, part.stop)]
            for member, pieces in zip(members, shares, strict=True)
        }
        weights = [1.0] * len(tasks)
        errand = Errand(
            self._crew, key, lambda: pack_scene(prepared, beside), RUN, lambda item: pickle.dumps(tasks[item]),
            weights, None, patience_s, stays=True, helped=True,
        )  # fmt: skip
        backlog = Backlog(own, weights)
        if not members:
            backlog.put_back(range(len(tasks)))
        try:
            for done in errand.done(backlog):
                errand.learn(done.member, 1.0, done.away_s)
                yield done.item, pickle.loads(done.data)
        finally:
            if beside is not None:
                self._crew.forget(key)

    def _key(self, prepared: PreparedScene) -> str:
        """The name of a scene in the cluster; the scenes used longest ago are forgotten there."""
        with self._lock:
            if prepared.identity not in self._scenes:
                self._scenes[prepared.identity] = self._new_key()
            self._scenes.move_to_end(prepared.identity)
            dropped = [self._scenes.popitem(last=False)[1] for _ in range(len(self._scenes) - KEPT_SCENES)]
            key = self._scenes[prepared.identity]
        for old in dropped:
            self._crew.forget(old)
        return key

    def _new_key(self) -> str:
        return f"{self._name}-{next(self._numbers)}"

    def _shares(self, key: str, store: SampleStore, ends: NDArray[np.int64]) -> tuple[dict[int, list[slice]], bool]:
        """The pieces of each worker that is to take part, and whether all of them are.

        Those take part that hold the scene and have least to do, and for the same store the same ones.
        """
        with self._crew.changed:
            members = self._crew.members
            able = [number for number, member in members.items() if key not in member.broken]
            rates = {
                number: members[number].rates.get((key, TRACE), SEED_RATE * members[number].presence.threads)
                for number in able
            }
            sticks = partial(_preference, id(store))
            able.sort(key=lambda n: (key not in members[n].warm, members[n].pieces, sticks(n)))
        if not able:
            return {-1: cut(ends, [SEED_RATE], LONGEST_S)[0]}, True
        total = float(ends[-1])
        mean = sum(rates.values()) / len(rates)
        chosen = sorted(able[: max(1, min(len(able), math.ceil(total / (WORTH_S * mean))))])
        speeds = [rates[number] for number in chosen]
        piece_s = min(max(total / sum(speeds) / PIECES, SHORTEST_S), LONGEST_S)
        shares = dict(zip(chosen, cut(ends, speeds, piece_s), strict=True))
        return shares, len(chosen) == len(able)


def _preference(store: int, worker: int) -> int:
    """Ranks workers for a store, otherwise for each store."""
    return hash((store, worker))
