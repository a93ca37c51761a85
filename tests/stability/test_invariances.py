"""What must not change a picture: where a scene is, how large, how it is turned, in which order it is stated.

Two kinds of sameness, of frames of 48 x 36 pixels with every effect:

- the very same bits, where nothing is rounded anew: scaling by powers of two, moving by whole numbers of the grid,
  another order of meshes, triangles or lights, a mesh in parts, a cell alone;
- the same within `SHARE` of the brightest pixel, and within one 8-bit step, in every pixel but `FLIPS`, where numbers
  are rounded anew. That moves every coordinate by up to 2^-24 of the scene, and what curved mirrors and glass magnify
  shows it most: of 60 frames each, the largest differences found are 0 moved, 6e-6 scaled and 5e-5 turned. A pixel
  whose ray passes a silhouette, or the edge of a shadow or a texel, nearer than that flips: 2e-6 of a pixel here, so of
  some 500 pixels at edges one in a thousand frames.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.display import Display
from renderer.frame import Frame
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import Mesh, Scene, SphereLight
from renderer.tonemap import encode_srgb
from renderer.whitted import Cells, trace_cells, view_of
from tests.renderer.drawing import shoot
from tests.stability.random_scenes import placed, random_rotation, random_scene

WIDTH, HEIGHT = 48, 36
SHARE = 1e-4
FLIPS = 2
seeds = st.integers(0, 2**32 - 1)


def seen(renderer: Renderer, scene: Scene) -> Frame:
    return shoot(renderer, scene, WIDTH, HEIGHT, samples=2, depth=4)


def must_be_equal(renderer: Renderer, scene: Scene, other: Scene) -> None:
    one, two = seen(renderer, scene), seen(renderer, other)
    np.testing.assert_array_equal(two.pixels, one.pixels)
    assert two.cost.rays == one.cost.rays


def must_be_alike(renderer: Renderer, scene: Scene, other: Scene, share: float = SHARE) -> None:
    one, two = (seen(renderer, s).pixels.astype(np.float64) for s in (scene, other))
    off = np.abs(two - one).max(axis=2)
    assert (off > share * max(1.0, float(one.max()))).sum() <= FLIPS, np.sort(off.ravel())[-12:]
    steps = np.abs(encode_srgb(two * scene.exposure).astype(int) - encode_srgb(one * scene.exposure).astype(int)).max(
        axis=2
    )
    assert (steps > 1).sum() <= FLIPS


@settings(max_examples=12)
@given(seeds, st.integers(-20, 20))
def test_scaling_by_a_power_of_two_changes_no_bit(renderer: Renderer, seed: int, power: int) -> None:
    scene = random_scene(seed)
    must_be_equal(renderer, scene, placed(scene, 2.0**power))


@settings(max_examples=25)
@given(seeds, st.floats(-6, 6))
def test_scaling_by_any_factor(renderer: Renderer, seed: int, exponent: float) -> None:
    scene = random_scene(seed)
    must_be_alike(renderer, scene, placed(scene, 10.0**exponent))


steps = st.integers(-40_000_000, 40_000_000)


@settings(max_examples=12)
@given(seeds, steps, steps, steps)
def test_moving_by_up_to_ten_million_sizes_changes_no_bit(
    renderer: Renderer, seed: int, x: int, y: int, z: int
) -> None:
    """The scene is 4 across. Its numbers stay on a grid that float64 holds at that distance."""
    scene = random_scene(seed)
    must_be_equal(renderer, scene, placed(scene, offset=(float(x), float(y), float(z))))


@settings(max_examples=25)
@given(seeds, st.integers(1, 7), seeds)
def test_moving_anywhere(renderer: Renderer, seed: int, exponent: int, direction: int) -> None:
    """What float64 rounds at ten million sizes, 5e-10 of the size, is 150 times finer than float32."""
    scene = random_scene(seed)
    x, y, z = (np.random.default_rng(direction).uniform(-1, 1, 3) * 10.0**exponent * 4).tolist()
    must_be_alike(renderer, scene, placed(scene, offset=(x, y, z)))


@settings(max_examples=25)
@given(seeds, seeds)
def test_turning(renderer: Renderer, seed: int, turn: int) -> None:
    scene = without_axes(random_scene(seed))
    must_be_alike(renderer, scene, placed(scene, rotation=random_rotation(np.random.default_rng(turn))))


def without_axes(scene: Scene) -> Scene:
    """Without what has axes of its own that a turned scene leaves as they are.

    These are the poles of the texture on a sphere, and the directions in which a spherical light is sampled.
    """
    plain = tuple(
        dataclasses.replace(s, material=dataclasses.replace(s.material, diffuse_texture=None)) for s in scene.spheres
    )
    lights = tuple(light for light in scene.lights if not isinstance(light, SphereLight))
    return dataclasses.replace(scene, spheres=plain, lights=lights)


@settings(max_examples=12)
@given(seeds, seeds)
def test_the_order_of_meshes_triangles_spheres_and_lights(renderer: Renderer, seed: int, order: int) -> None:
    scene, rng = random_scene(seed), np.random.default_rng(order)
    meshes = [dataclasses.replace(mesh, faces=rng.permutation(mesh.faces)) for mesh in scene.meshes]
    shuffled = dataclasses.replace(
        scene,
        meshes=tuple(meshes[k] for k in rng.permutation(len(meshes))),
        spheres=tuple(scene.spheres[k] for k in rng.permutation(len(scene.spheres))),
        lights=tuple(scene.lights[k] for k in rng.permutation(len(scene.lights))),
    )
    must_be_equal(renderer, scene, shuffled)


@settings(max_examples=12)
@given(seeds, seeds)
def test_a_mesh_in_parts(renderer: Renderer, seed: int, cut: int) -> None:
    scene, rng = random_scene(seed), np.random.default_rng(cut)

    def halves(mesh: Mesh) -> list[Mesh]:
        first = rng.random(len(mesh.faces)) < 0.5
        return [dataclasses.replace(mesh, faces=mesh.faces[part]) for part in (first, ~first)]

    parts = tuple(part for mesh in scene.meshes for part in halves(mesh))
    must_be_equal(renderer, scene, dataclasses.replace(scene, meshes=parts))


@settings(max_examples=25)
@given(seeds, seeds)
def test_the_order_of_vertices(renderer: Renderer, seed: int, order: int) -> None:
    """Vertices are numbered anew, and each triangle begins at another of its corners; its winding stays."""
    scene, rng = random_scene(seed), np.random.default_rng(order)

    def renumbered(mesh: Mesh) -> Mesh:
        new = rng.permutation(len(mesh.vertices))
        place = np.argsort(new)
        faces = np.array([np.roll(face, rng.integers(3)) for face in place[mesh.faces]])
        uvs, normals = (None if values is None else values[new] for values in (mesh.uvs, mesh.normals))
        return dataclasses.replace(mesh, vertices=mesh.vertices[new], faces=faces, uvs=uvs, normals=normals)

    must_be_alike(renderer, scene, dataclasses.replace(scene, meshes=tuple(renumbered(m) for m in scene.meshes)))


@settings(max_examples=12)
@given(seeds, seeds, st.sampled_from(["aligned", "scanline", "full"]))
def test_a_cell_alone_sees_what_it_sees_in_the_frame(renderer: Renderer, seed: int, pick: int, tiling: str) -> None:
    scene, rng = random_scene(seed), np.random.default_rng(pick)
    prepared, display = prepare(scene), Display(WIDTH, HEIGHT, 50, None, 10)
    quality = Quality(map=tiling, samples_per_cell=3, max_depth=4)
    cells, _ = renderer.cell_map(display, quality, _gaze(rng))
    view = view_of(prepared, scene.camera, display)

    def radiance(chosen: NDArray[np.int32]) -> NDArray[np.float32]:
        first, until = np.zeros_like(chosen), np.full_like(chosen, 3)
        return trace_cells(prepared, view, Cells(cells.x, cells.y, cells.side, chosen, first, until), quality)[0]

    together = radiance(np.arange(cells.cells, dtype=np.int32)).reshape(cells.cells, 3, 3)
    for cell in rng.integers(0, cells.cells, 12).astype(np.int32):
        np.testing.assert_array_equal(radiance(np.array([cell])), together[cell])


def _gaze(rng: np.random.Generator) -> Gaze:
    x, y = (rng.uniform(0, 1, 2) * (WIDTH, HEIGHT)).tolist()
    return Gaze(x, y)
