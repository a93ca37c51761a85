"""How time grows: the scenes have the sizes they are asked for, and each frame is timed."""

from __future__ import annotations

import numpy as np
import pytest

from clients.command_line.benchmark import growth
from clients.command_line.benchmark.growth_scenes import hills, room_of_mirrors
from renderer.display import Display
from renderer.frame import FrameCost, FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import Scene


def cost(renderer: Renderer, scene: Scene, depth: int = 0) -> FrameCost:
    quality = Quality(map="full", samples_per_cell=1, max_depth=depth)
    return renderer.render(prepare(scene), FrameRequest(Gaze(0, 0), Display(32, 18), None, quality)).cost


@pytest.mark.parametrize("triangles", [2, 1_000, 100_000])
def test_hills_have_as_many_triangles(triangles: int) -> None:
    scene = hills(triangles)
    assert scene.triangles == pytest.approx(triangles, rel=0.04)
    (mesh,) = scene.meshes
    corners = mesh.vertices[mesh.faces]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 1] > 0).all()  # they face up
    assert len(prepare(scene).surfaces.facets) == scene.triangles  # none is left out


def test_all_hills_are_hit_and_each_lamp_gets_a_ray(renderer: Renderer) -> None:
    for lamps in (1, 4):
        rays = cost(renderer, hills(1_000, lamps)).rays
        assert rays.primary == 32 * 18
        assert rays.shadow == pytest.approx(lamps * rays.primary, rel=0.1)


def test_each_ray_in_the_room_goes_as_deep_as_it_may(renderer: Renderer) -> None:
    for depth in (0, 3, 32):
        rays = cost(renderer, room_of_mirrors(), depth).rays
        assert rays.reflection == depth * rays.primary


def test_every_series_is_measured(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growth, "SCREEN", (32, 18))
    monkeypatch.setattr(growth, "SCREENS", ((32, 18), (64, 36)))
    ticks: list[None] = []
    series = list(growth.measure_growth(renderer, prepare(hills(100)), 10_000, 2, lambda: ticks.append(None)))
    assert len(ticks) == growth.steps(10_000, 2)
    by_name = {one.name: one for one in series}
    assert list(by_name) == ["pixels, full", "pixels, gaze-dependent", "triangles", "lights", "depth"]
    full = by_name["pixels, full"]
    assert [point.x for point in full.points] == [576, 2304]
    assert full.points[1].rays == pytest.approx(4 * full.points[0].rays, rel=0.01)
    assert all(0 < point.low <= point.ms <= point.high for one in series for point in one.points)
    assert [point.x for point in by_name["triangles"].points] == [1_000, 10_000]
    assert by_name["triangles"].time_of_rays is None
    assert by_name["depth"].time_of_rays is not None
