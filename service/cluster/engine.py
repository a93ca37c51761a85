"""The process that talks to Ray, and the only file that does: `python -m service.cluster.engine`.

It joins the cluster, or starts one, keeps one worker on each node that has processors, passes on what `link` sends and
what workers answer, and ends when the cluster's head is lost. It decides nothing else.
"""

from __future__ import annotations

import json
import logging
import os
import queue
import secrets
import socket
import sys
import threading
import time
from concurrent.futures import Future
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Final

from service.cluster.link import (
    ADDRESS,
    ANSWER,
    ASK,
    DOWN,
    FORGET,
    GONE,
    JOINED,
    LOCAL,
    LOST,
    OBJECT_STORE_BYTES,
    SCENE,
    START,
    THREADS,
    UP,
)
from service.cluster.worker import Presence, Worker

LOOK_S: Final = 0.5
"""How often nodes and head are looked at [s]."""

HEAD_PATIENCE_S: Final = 3.0
"""How long the head may be out of reach [s]; a connection takes milliseconds."""

MOST_AT_ONCE: Final = 16
"""Calls that a worker takes at once; its threads are shared between them."""

FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 60.0
"""Before a worker that could not be started is started again on the same node [s]: twice as long each time."""

NAMESPACE: Final = "gazetrace"

TOKEN_BYTES: Final = 32
"""Of the secret that a cluster on this machine asks of whoever connects; nobody else is told."""


@dataclass
class _Node:
    """A node of the cluster with processors.

    Attributes:
        threads: processors.
        worker: its actor, None where there is none now.
        number: of its worker.
        since: when it was started, or may be [monotonic s].
        ready: whether it has said so.
        asked: whether it was asked if it is still there, and has not answered yet.
        pause_s: before the next one, should this fail.
    """

    threads: int
    worker: Any = None
    number: int = 0
    since: float = 0.0
    ready: bool = False
    asked: bool = False
    pause_s: float = FIRST_PAUSE_S


class Engine:
    """Workers on the nodes of a cluster, and a channel to whoever uses them."""

    def __init__(self, ray: Any, channel: Connection) -> None:
        self._ray = ray
        self._channel = channel
        self._actor = ray.remote(Worker)
        self._nodes: dict[str, _Node] = {}
        self._workers: dict[int, Any] = {}
        self._scenes: dict[str, Any] = {}
        self._numbers = 0
        self._lock = threading.RLock()
        self._outbox: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
        threading.Thread(target=self._send, daemon=True).start()

    def tell(self, *message: Any) -> None:
        """Send a message, in turn."""
        self._outbox.put(message)

    def listen(self) -> None:
        """Do what is asked until the channel is closed."""
        while True:
            try:
                kind, *rest = self._channel.recv()
            except (EOFError, OSError):
                return
            if kind == SCENE:
                key, packed = rest
                self._scenes[key] = self._ray.put(packed)
            elif kind == FORGET:
                self._scenes.pop(rest[0], None)
            elif kind == ASK:
                self._ask(*rest)

    def _ask(self, job: int, number: int, method: str, key: str, packed: bytes | None) -> None:
        with self._lock:
            worker = self._workers.get(number)
        argument = self._scenes.get(key) if packed is None else packed
        if worker is None or argument is None:
            self.tell(LOST, job, number, "the worker is gone")
            return
        try:
            future = getattr(worker, method).remote(key, argument).future()
        except Exception as error:
            self.tell(LOST, job, number, str(error))
            return
        future.add_done_callback(lambda done: self._answered(job, number, done))

    def _answered(self, job: int, number: int, done: Future[Any]) -> None:
        error = done.exception()
        if error is None:
            self.tell(ANSWER, job, number, done.result())
        else:
            self.tell(LOST, job, number, type(error).__name__)
            self._lose(number)

    def watch(self, address: tuple[str, int]) -> None:
        """Keep a worker on each node until the head cannot be reached."""
        seen = time.monotonic()
        pause = threading.Event()
        while True:
            if _reachable(address):
                seen = time.monotonic()
                self._look()
            elif time.monotonic() - seen > HEAD_PATIENCE_S:
                self.tell(DOWN, f"the head of the cluster at {address[0]}:{address[1]} cannot be reached")
                return
            pause.wait(LOOK_S)

    def _look(self) -> None:
        """Start workers where they are missing, ask the others whether they are there; forget nodes that are gone."""
        alive = {node["NodeID"]: int(node["Resources"].get("CPU", 0)) for node in self._ray.nodes() if node["Alive"]}
        now = time.monotonic()
        with self._lock:
            for name in [name for name in self._nodes if name not in alive]:
                self._lose(self._nodes.pop(name).number)
            for name, threads in alive.items():
                if threads < 1:
                    continue
                node = self._nodes.setdefault(name, _Node(threads))
                if node.worker is None and now >= node.since:
                    self._start(name, node)
                elif node.ready and not node.asked:
                    self._ask_after(node)

    def _start(self, name: str, node: _Node) -> None:
        affinity = self._ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy(name, soft=False)
        options = {"num_cpus": 0, "max_restarts": 0, "max_concurrency": MOST_AT_ONCE, "scheduling_strategy": affinity}
        self._numbers += 1
        node.worker, node.number = self._actor.options(**options).remote(node.threads), self._numbers
        node.ready = node.asked = False
        number = node.number
        self._workers[number] = node.worker
        self.tell(START, number, node.threads)
        future = node.worker.presence.remote().future()
        future.add_done_callback(lambda done: self._came(name, number, done))

    def _came(self, name: str, number: int, done: Future[Any]) -> None:
        error = done.exception()
        with self._lock:
            node = self._nodes.get(name)
            if error is None and node is not None and node.number == number:
                presence: Presence = done.result()
                node.ready, node.pause_s = True, FIRST_PAUSE_S
                self.tell(JOINED, number, presence)
                return
        self._lose(number, "" if error is None else str(error).partition("\n")[0])

    def _ask_after(self, node: _Node) -> None:
        """Notice a worker that has ended while it had nothing to do: Ray tells only who asks it for something."""
        number, node.asked = node.number, True

        def answered(done: Future[Any]) -> None:
            if done.exception() is not None:
                self._lose(number)
            with self._lock:
                if node.number == number:
                    node.asked = False

        node.worker.presence.remote().future().add_done_callback(answered)

    def _lose(self, number: int, why: str = "") -> None:
        """A worker is gone; another takes its place if its node is still there."""
        with self._lock:
            if self._workers.pop(number, None) is None:
                return
            for node in self._nodes.values():
                if node.number == number:
                    if not node.ready:
                        node.since = time.monotonic() + node.pause_s
                        node.pause_s = min(LONGEST_PAUSE_S, 2 * node.pause_s)
                    node.worker = None
        self.tell(GONE, number, why)

    def _send(self) -> None:
        while True:
            message = self._outbox.get()
            try:
                self._channel.send(message)
            except OSError:
                os._exit(1)
            if message[0] == DOWN:
                os._exit(1)


def _reachable(address: tuple[str, int]) -> bool:
    try:
        socket.create_connection(address, timeout=1.0).close()
    except OSError:
        return False
    return True


def main(descriptor: int, options: dict[str, Any]) -> None:
    """Join a cluster and serve the other end of a socket until it is closed."""
    channel = Connection(descriptor)
    where, _, at = options[ADDRESS].rpartition(":")
    if where and not _reachable((where, int(at))):
        channel.send((DOWN, f"the head of the cluster at {options[ADDRESS]} cannot be reached"))
        return
    if options[ADDRESS] == LOCAL:  # it listens on every address of this machine
        os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(TOKEN_BYTES)}
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_raylet_start_wait_time_s", "120")
    import ray
    import ray.util.scheduling_strategies

    quiet: dict[str, Any] = {"namespace": NAMESPACE, "log_to_driver": False, "logging_level": logging.ERROR}
    try:
        if options[ADDRESS] == LOCAL:
            context = ray.init(
                num_cpus=options[THREADS],
                include_dashboard=False,
                object_store_memory=options[OBJECT_STORE_BYTES],
                **quiet,
            )
        else:
            context = ray.init(address=options[ADDRESS], **quiet)
    except Exception as error:
        why = " ".join(str(error).split())
        channel.send((DOWN, f"the cluster at {options[ADDRESS]} cannot be joined: {why}"))
        return
    host, _, port = context.address_info["gcs_address"].rpartition(":")
    engine = Engine(ray, channel)
    engine.tell(UP)
    threading.Thread(target=engine.watch, args=((host, int(port)),), daemon=True).start()
    engine.listen()
    ray.shutdown()


if __name__ == "__main__":
    main(int(sys.argv[1]), json.loads(sys.argv[2]))
