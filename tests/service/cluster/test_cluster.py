"""A real cluster of several raylets on this machine: the same frames, whatever is lost on the way.

One cluster for all tests, in their order: the last ones take it apart.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import threading
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import httpx
import numpy as np
import pytest

from clients.command_line import main
from renderer.accuracy.record import read_report
from renderer.acuity import Acuity
from renderer.display import Display
from renderer.frame import Abandoned, Frame, FrameRequest
from renderer.gaze import Gaze
from renderer.library import SceneLibrary
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from service.cluster.cluster import Cluster
from service.cluster.worker import SCENE_BYTES_VARIABLE
from service.settings import Settings
from tests.renderer.drawing import glass_and_mirror
from tests.service.cluster.nodes import Nodes, cluster_of
from tests.service.conftest import PATIENCE_S, serving

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("ray") is None, reason="the extra 'cluster', Ray, is not installed"),
]

SCREEN = Display(96, 54, width_cm=9.0)
GLANCE_S = 0.1
START_S = 600.0
"""How long workers may take: they load kernels, or compile them."""


class Said:
    """Lines for people, and waiting for one."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._changed = threading.Condition()

    def __call__(self, line: str) -> None:
        with self._changed:
            self.lines.append(line)
            self._changed.notify_all()

    def wait_for(self, words: str, times: int = 1) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: self.count(words) >= times, START_S), self.lines

    def count(self, words: str) -> int:
        return sum(words in line for line in self.lines)


@pytest.fixture(scope="module")
def nodes() -> Iterator[Nodes]:
    with cluster_of(one=1, two=1) as nodes:
        yield nodes


@pytest.fixture(scope="module")
def said() -> Said:
    return Said()


@pytest.fixture(scope="module")
def cluster(nodes: Nodes, said: Said) -> Iterator[Cluster]:
    cluster = Cluster(nodes.address, announce=said)
    cluster.wait_ready(START_S, 2)
    yield cluster
    cluster.close()


@pytest.fixture(scope="module")
def far(cluster: Cluster) -> Iterator[Renderer]:
    """Whatever it renders is traced by the workers."""
    renderer = Renderer(1, tracing=cluster)
    yield renderer
    renderer.close()


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(glass_and_mirror())


def asked(quality: Quality, gaze: tuple[float, float] = (30, 20), screen: Display = SCREEN) -> FrameRequest:
    return FrameRequest(Gaze(*gaze), screen, None, quality, linear=True)


def long_frame(samples: int = 64) -> FrameRequest:
    """Some work for all workers; half a minute with 4096 samples."""
    return asked(Quality(map="full", samples_per_cell=samples), screen=Display(160, 90))


def same(one: Frame, other: Frame) -> None:
    np.testing.assert_array_equal(one.pixels, other.pixels)
    assert one.cost.rays == other.cost.rays
    assert one.cost.rms_error == other.cost.rms_error


@pytest.mark.parametrize("name", ["spheres", "cornell", "gallery"])
def test_frames_of_the_cluster_are_those_of_this_machine(name: str, far: Renderer, renderer: Renderer) -> None:
    """One sample, several, adaptive ones, without an effect, and what a move of the gaze reuses."""
    prepared = SceneLibrary().load(name)
    renderer.forget_samples()
    far.forget_samples()
    few, many = Quality(samples_per_cell=1), Quality(samples_per_cell=3, acuity=Acuity(scale=8.0))
    adaptive = Quality(samples_per_cell=16, antialiasing="adaptive", acuity=Acuity(scale=8.0))
    bare = Quality(samples_per_cell=2, effects=("-shadows", "-soft_shadows"), map="scanline")
    for request in (
        asked(few), asked(many), asked(many, (60, 40)), asked(adaptive), asked(adaptive, (60, 40)), asked(bare),
    ):  # fmt: skip
        one = far.render(prepared, request)
        same(one, renderer.render(prepared, request))
        assert one.cost.samples_traced > 0


def test_a_frame_that_is_given_up_ends_soon(far: Renderer, scene: PreparedScene) -> None:
    far.forget_samples()
    abandon = threading.Event()
    threading.Timer(0.3, abandon.set).start()
    with pytest.raises(Abandoned):
        far.render(scene, long_frame(4096), abandon)


def test_a_worker_killed_in_the_middle_of_a_frame_costs_a_delay(
    cluster: Cluster, far: Renderer, renderer: Renderer, scene: PreparedScene, said: Said
) -> None:
    """Its pieces are traced by the other one; another worker takes its place. It stands still before, to have some."""
    victim = cluster.workers[0].process
    far.render(scene, long_frame())
    far.forget_samples()
    os.kill(victim, signal.SIGSTOP)
    threading.Timer(0.3, os.kill, (victim, signal.SIGKILL)).start()
    found = far.render(scene, long_frame())
    said.wait_for("is gone: 1 left")
    same(found, renderer.render(scene, long_frame()))
    cluster.wait_ready(START_S, 2)
    assert victim not in [worker.process for worker in cluster.workers]


def test_a_worker_that_ends_while_it_has_nothing_to_do_is_replaced(cluster: Cluster, said: Said) -> None:
    """Nobody asks it for anything, and yet its end is noticed."""
    gone, victim = said.count("is gone"), cluster.workers[0].process
    os.kill(victim, signal.SIGKILL)
    said.wait_for("is gone", gone + 1)
    cluster.wait_ready(START_S, 2)
    assert victim not in [worker.process for worker in cluster.workers]


def test_a_scene_that_a_node_cannot_load_is_reported_once(
    nodes: Nodes, cluster: Cluster, far: Renderer, renderer: Renderer, said: Said
) -> None:
    """A node that has less memory for scenes than the others is added; frames come from the others."""
    nodes.add("small", 1, **{SCENE_BYTES_VARIABLE: 1})
    cluster.wait_ready(START_S, 3)
    prepared = prepare(glass_and_mirror())
    for samples in (1, 2, 3):
        request = asked(Quality(samples_per_cell=samples))
        same(far.render(prepared, request), renderer.render(prepared, request))
    said.wait_for("cannot load a scene")
    same(far.render(prepared, long_frame()), renderer.render(prepared, long_frame()))
    assert said.count("cannot load a scene") == 1
    nodes.remove("small")
    said.wait_for("is gone: 2 left")


def test_a_clip_begun_here_is_finished_by_the_cluster(
    nodes: Nodes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Frame for frame the clip of this machine."""
    words = ["animate", "spheres", "--gaze-trace", "simulated", "--seconds", "0.2", "--fps", "25", "--size", "96x54"]
    words += ["--samples", "2", "--orbit", "20", "--overlay", "gaze", "--json", "-o"]
    here, there = tmp_path / "here", tmp_path / "there"
    assert main([*words, str(here)]) == 0
    shutil.copytree(here, there)
    for frame in (1, 2, 4):
        (there / f"frame-{frame:05d}.png").unlink()
    capsys.readouterr()
    assert main([*words, str(there), "--cluster", nodes.address]) == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["frames"], record["frames_rendered"]) == (5, 3)
    for frame in range(5):
        name = f"frame-{frame:05d}.png"
        assert (here / name).read_bytes() == (there / name).read_bytes()


def test_what_accuracy_costs_is_found_by_the_cluster_too(nodes: Nodes, tmp_path: Path) -> None:
    """The same pictures and errors; times are of the workers, and nothing else differs."""
    words = ["accuracy", "spheres", "--quick", "--size", "32x18", "--reference-samples", "2", "--repeats", "1"]
    words += ["--no-report", "-o"]
    assert main([*words, str(tmp_path / "here")]) == 0
    assert main([*words, str(tmp_path / "there"), "--cluster", nodes.address]) == 0
    here, there = (read_report((tmp_path / name / "accuracy.json").read_text()) for name in ("here", "there"))
    assert here.reference.standard_error == there.reference.standard_error
    assert there.machine.threads == 1
    for one, other in zip(here.settings, there.settings, strict=True):
        assert (one.id, one.accuracy, one.stated_error, one.rays) == (
            other.id, other.accuracy, other.stated_error, other.rays,
        )  # fmt: skip
        assert other.time_ms.median > 0.0
        for name in (one.frame, one.error_map):
            assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()


def test_a_stream_goes_on_when_nodes_come_and_go(
    nodes: Nodes, cluster: Cluster, far: Renderer, renderer: Renderer, scene: PreparedScene, said: Said
) -> None:
    """Frame after frame, while one node is lost and another one added."""
    gone = said.count("is gone")
    far.forget_samples()
    renderer.forget_samples()

    def change() -> None:
        nodes.remove("two")
        nodes.add("three", 1)

    changing = threading.Thread(target=change)
    changing.start()
    frames = 0
    while changing.is_alive() or frames < 5:
        request = asked(Quality(samples_per_cell=2), (5 + 16 * frames % 80, 20))
        same(far.render(scene, request), renderer.render(scene, request))
        frames += 1
    changing.join()
    said.wait_for("is gone", gone + 1)
    cluster.wait_ready(START_S, 2)


def test_a_service_whose_head_is_lost_says_so_and_returns(nodes: Nodes, cluster: Cluster, said: Said) -> None:
    """/readyz tells, frames are refused for now, and both come back with the head, without anyone's help."""
    frame = "/v1/scenes/spheres/frame?gaze_x=10&gaze_y=10&width_px=64&height_px=36&samples_per_cell="
    with (
        serving(Settings(port=0, cluster=nodes.address), ready=False) as address,
        httpx.Client(base_url=address, timeout=PATIENCE_S) as client,
    ):
        assert readiness(client, 200)
        before = client.get(f"{frame}3")
        assert before.status_code == 200
        nodes.stop_head()
        assert "cluster" in readiness(client, 503)
        refused = client.get(f"{frame}4")
        assert refused.status_code == 503
        assert refused.headers["retry-after"]
        nodes.start_head()
        nodes.add("after")
        assert readiness(client, 200)
        assert client.get(f"{frame}3").content == before.content
        assert client.get(f"{frame}5").status_code == 200
    assert said.count("the cluster is lost") + said.count("cannot be reached") >= 1
    cluster.wait_ready(START_S)


def readiness(client: httpx.Client, status: int) -> str:
    """What /readyz says, once it answers with this status."""
    pause, reply = threading.Event(), client.get("/readyz")
    for _ in range(int(START_S / GLANCE_S)):
        if reply.status_code == status:
            break
        pause.wait(GLANCE_S)
        reply = client.get("/readyz")
    assert reply.status_code == status
    return reply.text
