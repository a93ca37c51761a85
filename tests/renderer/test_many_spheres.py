"""Ten thousand spheres: what being exact costs against the same spheres as triangles."""

from __future__ import annotations

import statistics
import time

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import Material, Mesh, PointLight, Scene, Sphere, Surroundings
from tests.renderer.drawing import icosphere

SPHERES = 10_000


@pytest.mark.bench
def test_ten_thousand_spheres_take_at_most_twice_the_time_of_their_meshes() -> None:
    """In turn in one run, processor time, median of 7; 80 smoothly shaded triangles stand for a sphere."""
    rng = np.random.default_rng(1)
    center, radius = rng.uniform(-10, 10, (SPHERES, 3)), rng.uniform(0.05, 0.3, SPHERES)
    material = Material("matt", diffuse=(0.7, 0.6, 0.5))
    vertices, faces = icosphere(1)
    mesh = Mesh(
        (center[:, None] + radius[:, None, None] * vertices).reshape(-1, 3),
        (faces + len(vertices) * np.arange(SPHERES)[:, None, None]).reshape(-1, 3),
        material,
        normals=np.tile(vertices, (SPHERES, 1)),
    )
    spheres = tuple(Sphere((x, y, z), r, material) for (x, y, z), r in zip(center.tolist(), radius, strict=True))
    prepared = [
        prepare(
            Scene(
                meshes=meshes,
                spheres=balls,
                lights=(PointLight((20.0, 30.0, 25.0), (8000.0,) * 3),),
                surroundings=Surroundings(horizon=(0.8,) * 3),
                camera=Camera((0.0, 5.0, 28.0), (0.0, 0.0, 0.0)),
            )
        )
        for meshes, balls in (((), spheres), ((mesh,), ()))
    ]
    request = FrameRequest(Gaze(480.0, 270.0), Display(960, 540), None, Quality(samples_per_cell=2))
    renderer = Renderer(threads=2)
    ratios = []
    for _ in range(8):
        times = []
        for scene in prepared:
            renderer.forget_samples()
            began = time.process_time()
            renderer.render(scene, request)
            times.append(time.process_time() - began)
        ratios.append(times[0] / times[1])
    renderer.close()
    ratio = statistics.median(ratios[1:])
    assert ratio <= 2.0, f"{SPHERES} spheres take {ratio:.2f} times as long as their meshes"
