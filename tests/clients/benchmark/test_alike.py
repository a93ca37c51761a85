"""Scenes for other renderers: the shapes are ours, and both show the same light."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clients.command_line.peers.alike import matt_alike, whitted_alike
from clients.command_line.peers.mitsuba_scene import fastest_variant, has_mitsuba, mitsuba, mitsuba_scene
from clients.command_line.peers.povray import find_povray, povray_picture, povray_trace_s
from renderer.camera import Camera
from renderer.display import Display
from renderer.pipeline import Renderer
from renderer.scene import Material, PointLight, Scene
from renderer.scenes import BUILT_IN
from tests.agreement.comparison import require
from tests.renderer.drawing import FINE, floor, shoot

SCREEN = Display(48, 32)


def test_shapes_stay_and_one_lamp_is_left() -> None:
    scene = BUILT_IN["gallery"]()
    alike = matt_alike(scene)
    assert alike.triangles == scene.triangles
    assert [sphere.center for sphere in alike.spheres] == [sphere.center for sphere in scene.spheres]
    assert len(alike.lights) == 1
    for material in (thing.material for thing in (*alike.meshes, *alike.spheres)):
        assert any(material.diffuse)
        assert material.diffuse_texture is None
        assert not any((*material.specular, *material.reflection, *material.transmission, *material.emission))


def test_a_scene_without_such_a_lamp_is_refused() -> None:
    with pytest.raises(ValueError, match="expected a scene with a point light that casts shadows, found none"):
        matt_alike(BUILT_IN["cornell"]())
    with pytest.raises(ValueError, match="expected a scene with point lights alone"):
        whitted_alike(BUILT_IN["cornell"]())


def test_mirrors_and_glass_stay() -> None:
    scene = BUILT_IN["spheres"]()
    alike = whitted_alike(scene)
    for ours, theirs in zip(scene.spheres, alike.spheres, strict=True):
        assert any(ours.material.reflection) == any(theirs.material.reflection)
        assert any(ours.material.transmission) == any(theirs.material.transmission)


def test_mitsuba_sees_the_matt_scene_as_we_do(renderer: Renderer) -> None:
    """Half of all pixels at least to a percent: noise of edges alone is left."""
    require(has_mitsuba(), "Mitsuba (the extra 'peers')")
    lamp = PointLight((0.5, 4.0, 1.0), (20.0, 20.0, 20.0))
    camera = Camera((0.0, 2.0, 6.0), (0.0, 0.5, 0.0))
    shiny = Material("shiny", (0.5, 0.3, 0.2), (0.2, 0.2, 0.2), 20.0)
    spheres = BUILT_IN["spheres"]().spheres
    scene = matt_alike(Scene((floor(shiny),), spheres, (lamp,), camera=camera, exposure=FINE))
    variant = fastest_variant()
    integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    theirs_scene = mitsuba_scene(scene, SCREEN, variant)
    mi = mitsuba(variant)
    theirs = np.array(mi.render(theirs_scene, integrator=mi.load_dict(integrator), spp=16, seed=1))
    ours = shoot(renderer, scene, SCREEN.width_px, SCREEN.height_px, depth=0).pixels
    assert theirs.shape == ours.shape
    assert float(np.median(np.abs(theirs - ours))) < 0.01 * float(ours.max())


def test_povray_sees_the_mirrors_as_we_do_and_says_how_long_it_took(renderer: Renderer, tmp_path: Path) -> None:
    require(find_povray() is not None, "POV-Ray (Debian's package povray)")
    scene = whitted_alike(BUILT_IN["spheres"]())
    dim = tuple(replace(light, intensity=tuple(part / 50 for part in light.intensity)) for light in scene.lights)
    scene = replace(scene, lights=dim, exposure=FINE)
    theirs = povray_picture(scene, SCREEN, 3, tmp_path)
    ours = shoot(renderer, scene, SCREEN.width_px, SCREEN.height_px, depth=3).pixels
    assert float((np.abs(theirs - ours).max(axis=2) < 0.01).mean()) > 0.98
    assert 0.0 <= povray_trace_s(scene, SCREEN, 3, 2, tmp_path) < 60.0
