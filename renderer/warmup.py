"""Scenes that pass through every kernel, to compile them before the first user's frame needs them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from renderer.camera import Camera
from renderer.scene import Material, Mesh, PointLight, RectangleLight, Scene, Sphere, SphereLight, Texture


def every_effect() -> Scene:
    """A textured smooth floor, a mirror, a glass ball and ice in water, lit by each kind of light with shadows."""
    checks = Texture(np.array([[[255] * 3, [90] * 3], [[90] * 3, [255] * 3]], dtype=np.uint8), "checks")
    floor = Mesh(
        vertices=np.array([[-9, 0, -9], [9, 0, -9], [9, 0, 9], [-9, 0, 9]], dtype=np.float64),
        faces=np.array([[0, 2, 1], [0, 3, 2]]),
        material=Material(
            "floor", specular=(0.1, 0.1, 0.1), diffuse_texture=checks, alpha_texture=checks, normal_texture=checks
        ),
        normals=np.array([[0.1, 1, 0], [0, 1, 0.1], [-0.1, 1, 0], [0, 1, -0.1]]),
        uvs=np.array([[0, 0], [9, 0], [9, 9], [0, 9]], dtype=np.float64),
    )
    return Scene(
        meshes=(floor,),
        spheres=(
            Sphere((-1.0, 1.0, 0.0), 1.0, Material("mirror", reflection=(0.8, 0.8, 0.8), base="ashikhmin-shirley")),
            Sphere((1.0, 1.0, 0.0), 1.0, Material("glass", diffuse=(0.0, 0.0, 0.0), transmission=(1.0, 1.0, 1.0))),
            Sphere((1.0, 1.0, 3.0), 0.5, Material("water", transmission=(1.0, 1.0, 1.0), ior=1.33, priority=0)),
            Sphere((1.2, 1.0, 3.0), 0.5, Material("ice", transmission=(1.0, 1.0, 1.0), ior=1.31, priority=1)),
        ),
        lights=(
            PointLight((3.0, 8.0, 5.0), (400.0, 400.0, 400.0)),
            RectangleLight((-1.0, 5.0, -1.0), (2.0, 0.0, 0.0), (0.0, 0.0, 2.0), (5.0, 5.0, 5.0)),
            SphereLight((-4.0, 3.0, 2.0), 0.5, (5.0, 5.0, 5.0)),
        ),
        camera=Camera((0.0, 2.0, 7.0), (0.0, 1.0, 0.0)),
    )


def nothing_behind() -> Scene:
    """The same without holes, glass or water: rays end at the first thing in their way, for which there is a kernel."""
    scene = every_effect()
    (floor,) = scene.meshes
    solid = replace(floor, material=replace(floor.material, alpha_texture=None))
    return replace(scene, meshes=(solid,), spheres=scene.spheres[:1])
