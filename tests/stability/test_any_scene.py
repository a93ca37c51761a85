"""Whatever the scene, its picture is finite: materials that make no sense, things in things, lights in them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.camera import Camera
from renderer.pipeline import Renderer
from renderer.scene import Material, Mesh, PointLight, Scene, Sphere, Surroundings, Texture
from tests.renderer.drawing import ball_mesh, box, shoot

shares = st.sampled_from([0.0, 0.04, 0.5, 1.0])
colours = st.tuples(shares, shares, shares)
brightness = st.sampled_from([0.0, 1e-6, 1.0, 1e6, 1e12])
positions = st.tuples(*[st.sampled_from([-1.0, -0.5, 0.0, 1e-7, 0.25, 1.0, 3.0])] * 3)
materials = st.builds(
    Material,
    diffuse=colours,
    specular=colours,
    shininess=st.sampled_from([0.0, 1.0, 50.0, 1e9]),
    emission=st.tuples(brightness, brightness, brightness),
    reflection=colours,
    transmission=colours,
    ior=st.sampled_from([0.1, 0.7, 1.0, 1.5, 10.0]),
    priority=st.sampled_from([None, 0, 1]),
    base=st.sampled_from(["phong", "ashikhmin-shirley"]),
    exponent_u=st.sampled_from([0.0, 3.0, 1e9]),
    exponent_v=st.sampled_from([0.0, 300.0, 1e9]),
    specular_texture=st.sampled_from([None, Texture(np.uint8([[[0] * 3], [[255] * 3]]), "s", "clamp", "mirror")]),
    alpha_texture=st.sampled_from([None, Texture(np.uint8([[[0] * 3, [255] * 3]]))]),
    diffuse_texture=st.sampled_from([None, Texture(np.uint8([[[0] * 3, [255] * 3, [9] * 3]]))]),
    normal_texture=st.sampled_from([None, Texture(np.uint8([[[0] * 3, [255] * 3, [9, 128, 200], [128, 128, 0]]]))]),
    normal_scale=st.sampled_from([-1000.0, 1e-30, 1.0]),
)
spheres = st.builds(
    Sphere, positions, st.sampled_from([1e-9, 0.25, 0.5, 1.0, 1e3, 1e9]), materials, casts_shadows=st.booleans()
)


@st.composite
def meshes(draw: st.DrawFn) -> Mesh:
    """A box, a ball, or loose triangles with wild normals and texture coordinates."""
    material, casts = draw(materials), draw(st.booleans())
    kind = draw(st.sampled_from(["box", "ball", "loose"]))
    if kind == "box":
        return box((-1, -1, -1), draw(st.sampled_from([(1, 1, 1), (1, -1, 1), (1e-8, 1, 1)])), material, casts)
    if kind == "ball":
        return ball_mesh(material, 1, draw(st.booleans()), casts)
    count = draw(st.integers(1, 6))
    corners = np.array(draw(st.lists(positions, min_size=3 * count, max_size=3 * count)))
    wild = st.sampled_from([0.0, 1.0, -1.0, 1e-23, 1e30, math.nan, math.inf])
    normals = np.array(draw(st.lists(st.tuples(wild, wild, wild), min_size=3 * count, max_size=3 * count)))
    uvs = np.array(draw(st.lists(st.tuples(wild, wild), min_size=3 * count, max_size=3 * count)))
    faces = np.arange(3 * count).reshape(-1, 3)
    return Mesh(corners, faces, material, normals if draw(st.booleans()) else None, uvs, casts)


lights_anywhere = st.builds(
    PointLight, positions, st.tuples(brightness, brightness, brightness), casts_shadows=st.booleans()
)
scenes = st.builds(
    Scene,
    meshes=st.lists(meshes(), max_size=3).map(tuple),
    spheres=st.lists(spheres, max_size=4).map(tuple),
    lights=st.lists(lights_anywhere, max_size=3).map(tuple),
    surroundings=st.builds(Surroundings, colours, colours, colours),
    camera=st.builds(
        Camera,
        st.sampled_from([(0.0, 0.0, 4.0), (0.0, 0.0, 0.0), (0.25, 1.0, 0.5), (1.0, 1e-7, 1.0), (3e6, 2e6, 1e6)]),
        st.sampled_from([(0.0, 0.0, -9.0), (-1.0, -0.5, -3.0)]), vertical_fov_deg=st.sampled_from([20.0, 100.0]),
    ),
    exposure=st.sampled_from([1e-3, 1.0, 1e3]),
)  # fmt: skip


@settings(max_examples=150)
@given(scenes, st.sampled_from([0, 3, 6]))
def test_h50_every_frame_of_every_scene_is_finite(renderer: Renderer, scene: Scene, depth: int) -> None:
    """Also with lights on and in surfaces, the eye inside things, and materials that make no sense."""
    frame = shoot(renderer, scene, 12, 9, samples=2, depth=depth)
    assert np.isfinite(frame.pixels).all()
    assert (frame.pixels >= 0).all()
    # Only light beyond 1e16 may be cut: lamps of 1e12 W/sr stand on surfaces and in them.
    assert dataclasses.replace(frame.cost.rejected_samples, too_bright=0).total == 0
    assert math.isfinite(frame.cost.rms_error)
