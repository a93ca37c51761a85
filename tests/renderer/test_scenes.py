"""The built-in scenes: what each promises to show, and that they come out the same every time."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from renderer.display import Display
from renderer.effects import plan_effects
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import BLACK, Material, RectangleLight, Scene
from renderer.scenes import BUILT_IN

IDS = ("spheres", "cornell", "atrium", "gallery", "matte")

SceneOf = Callable[[str], Scene]


@pytest.fixture(scope="module")
def scene_of() -> SceneOf:
    """Built-in scenes, each made once for this file."""
    return cache(lambda scene_id: BUILT_IN[scene_id]())


def materials_of(scene: Scene) -> list[Material]:
    return [mesh.material for mesh in scene.meshes] + [sphere.material for sphere in scene.spheres]


def test_the_built_in_scenes_are_these_five() -> None:
    assert tuple(BUILT_IN) == IDS


def test_no_scene_is_made_before_it_is_asked_for() -> None:
    code = "import sys, renderer.scenes; print(sorted(m for m in sys.modules if m.startswith('renderer.scenes.')))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert shown.stdout.strip() == "[]"


@pytest.mark.parametrize("scene_id", IDS)
def test_normals_are_unit_and_agree_with_the_winding_and_uvs_are_finite(scene_id: str, scene_of: SceneOf) -> None:
    for mesh in scene_of(scene_id).meshes:
        assert len(mesh.faces) > 0, mesh.name
        a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
        face_normals = np.cross(b - a, c - a)
        assert (np.abs(face_normals).max(axis=1) > 0.0).all(), mesh.name
        assert mesh.uvs is None or np.isfinite(mesh.uvs).all(), mesh.name
        if mesh.normals is not None:
            np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-9, err_msg=mesh.name)
            facing = (mesh.normals[mesh.faces[:, 0]] * face_normals).sum(axis=1)
            assert (facing > 0.0).mean() > 0.99, mesh.name


@pytest.mark.parametrize("scene_id", IDS)
def test_two_builds_are_equal_to_the_last_bit(scene_id: str, scene_of: SceneOf) -> None:
    first, second = scene_of(scene_id), BUILT_IN[scene_id]()
    assert first.lights == second.lights
    assert first.camera == second.camera
    assert len(first.meshes) == len(second.meshes)
    for one, other in zip(first.meshes, second.meshes, strict=True):
        for part in ("vertices", "faces", "normals", "uvs"):
            np.testing.assert_array_equal(getattr(one, part), getattr(other, part))
        if one.material.diffuse_texture is not None:
            assert other.material.diffuse_texture is not None
            np.testing.assert_array_equal(one.material.diffuse_texture.pixels, other.material.diffuse_texture.pixels)
    assert [sphere.center for sphere in first.spheres] == [sphere.center for sphere in second.spheres]


@pytest.mark.parametrize("scene_id", IDS)
def test_the_picture_uses_the_range_of_the_display_and_hardly_clips(
    scene_id: str, scene_of: SceneOf, renderer: Renderer
) -> None:
    quality = Quality(map="full", samples_per_cell=1)
    frame = renderer.render(
        prepare(scene_of(scene_id)), FrameRequest(Gaze(80.0, 45.0), Display(160, 90), None, quality)
    )
    brightest = frame.pixels.max(axis=2)
    assert frame.cost.rejected_samples.total == 0
    assert float(np.percentile(brightest, 97)) > 180
    assert float((brightest == 255).mean()) < 0.04


def test_the_benchmark_scene_is_large_and_mirrors_only_water_and_inlay(scene_of: SceneOf) -> None:
    scene = scene_of("atrium")
    assert 300_000 <= scene.triangles <= 500_000
    mirrors = {mesh.material.name for mesh in scene.meshes if mesh.material.reflection != BLACK}
    assert mirrors == {"polished inlay", "water"}
    assert sum(light.casts_shadows for light in scene.lights) == 1
    assert sum(mesh.material.diffuse_texture is not None for mesh in scene.meshes) >= 10


def test_matte_calls_for_nothing(scene_of: SceneOf) -> None:
    scene = scene_of("matte")
    for material in materials_of(scene):
        assert material.diffuse_texture is None
        assert (material.specular, material.reflection, material.transmission) == (BLACK, BLACK, BLACK)
    assert not any(part.casts_shadows for part in (*scene.meshes, *scene.spheres))
    assert plan_effects(scene).effects == ()


def test_spheres_shows_glass_before_a_mirror_over_a_two_coloured_checkerboard(scene_of: SceneOf) -> None:
    scene = scene_of("spheres")
    (glass,) = (sphere for sphere in scene.spheres if sphere.material.transmission != BLACK)
    (mirror,) = (sphere for sphere in scene.spheres if sphere.material.reflection != BLACK)
    eye = np.array(scene.camera.position)
    assert np.linalg.norm(eye - glass.center) < np.linalg.norm(eye - mirror.center)
    (floor,) = scene.meshes
    texture, uvs = floor.material.diffuse_texture, floor.uvs
    assert texture is not None
    assert uvs is not None
    colours, counts = np.unique(texture.pixels.reshape(-1, 3), axis=0, return_counts=True)
    assert len(colours) == 2
    assert counts[0] == counts[1]
    metres_per_tile = np.ptp(floor.vertices[:, [0, 2]], axis=0) / np.ptp(uvs, axis=0)
    np.testing.assert_allclose(metres_per_tile, 2.0)


def test_cornell_has_the_published_corners_in_metres(scene_of: SceneOf) -> None:
    scene = scene_of("cornell")
    by_name = {mesh.name: mesh for mesh in scene.meshes}
    white = by_name["floor, ceiling and back wall"].vertices
    np.testing.assert_allclose(white.min(axis=0), (0.0, 0.0, 0.0))
    np.testing.assert_allclose(white.max(axis=0), (0.556, 0.5488, 0.5592))
    assert float(white[white[:, 1] == 0.0][:, 0].max()) == pytest.approx(0.5528)
    blocks = by_name["blocks"].vertices
    short = [(0.130, 0.065), (0.082, 0.225), (0.240, 0.272), (0.290, 0.114)]
    tall = [(0.423, 0.247), (0.265, 0.296), (0.314, 0.456), (0.472, 0.406)]
    corners = {(x, y, z) for top, block in ((0.165, short), (0.33, tall)) for x, z in block for y in (0.0, top)}
    assert {tuple(float(part) for part in np.round(vertex, 6)) for vertex in blocks} == corners
    (lamp,) = scene.lights
    assert isinstance(lamp, RectangleLight)
    np.testing.assert_allclose(lamp.corner, (0.343, 0.5488, 0.227))
    np.testing.assert_allclose(np.add(lamp.edge_u, lamp.edge_v), (-0.130, 0.0, 0.105), atol=1e-12)
    assert np.cross(lamp.edge_u, lamp.edge_v)[1] < 0.0
    assert plan_effects(scene).names == ("soft_shadows",)
    red, green = by_name["left wall"].material.diffuse, by_name["right wall"].material.diffuse
    assert red[0] > 5 * red[1]
    assert green[1] > 2 * green[0]


def test_cornells_walls_face_the_inside_and_its_blocks_the_outside(scene_of: SceneOf) -> None:
    middle = np.array([0.278, 0.2744, 0.2796])
    for mesh in scene_of("cornell").meshes:
        assert mesh.normals is not None
        if mesh.name != "blocks":
            assert ((middle - mesh.vertices) * mesh.normals).sum(axis=1).min() > 0.0, mesh.name
    (blocks,) = (mesh for mesh in scene_of("cornell").meshes if mesh.name == "blocks")
    for half in np.split(np.arange(len(blocks.vertices)), 2):
        away = blocks.vertices[half] - blocks.vertices[half].mean(axis=0)
        assert blocks.normals is not None
        assert (away * blocks.normals[half]).sum(axis=1).min() > 0.0
