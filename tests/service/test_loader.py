"""Scenes read in a process of their own: the same scenes, and an end to whatever goes wrong there."""

from __future__ import annotations

import io
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from renderer.codec import MAX_TEXTURE_PIXELS
from renderer.errors import SceneError
from renderer.folder import MAX_FILE_BYTES
from renderer.mesh_file import MAX_TRIANGLES
from renderer.scene import Scene
from renderer.scene_file import load_scene_folder
from service.loader import Loader
from service.settings import Settings
from tests.service.conftest import PATIENCE_S

SCENE = """
[materials.wood]
diffuse_texture = "wood.png"
[[mesh]]
file = "quad.obj"
[[mesh]]
file = "quad.obj"
material = "wood"
translate = [0, 1, 0]
[[sphere]]
center = [0, 2, 0]
radius = 0.5
"""


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A scene with two meshes and a picture."""
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "quad.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1 4/1\n")
    picture = io.BytesIO()
    Image.new("RGB", (5, 3), (10, 20, 30)).save(picture, "png")
    (tmp_path / "wood.png").write_bytes(picture.getvalue())
    return tmp_path


def refused(place: Path, **limits: int) -> str:
    with pytest.raises(SceneError) as caught:
        Loader(Settings(**limits)).read(place, "lab")
    return str(caught.value)


@contextmanager
def held_reader(loader: Loader, place: Path) -> Iterator[tuple[int, Future[Scene]]]:
    """A process that reads a scene and was stopped in it; and what comes of it."""
    with ThreadPoolExecutor(1) as other:
        scene = other.submit(loader.read, place, "lab")
        while not loader.processes:
            assert not scene.done()
        (process,) = loader.processes
        os.kill(process, signal.SIGSTOP)
        yield process, scene


def test_it_is_the_scene_that_this_process_would_read(place: Path) -> None:
    found, expected = Loader(Settings()).read(place, "lab"), load_scene_folder(place, label="lab")
    assert (found.spheres, found.lights, found.camera) == (expected.spheres, expected.lights, expected.camera)
    for ours, theirs in zip(found.meshes, expected.meshes, strict=True):
        np.testing.assert_array_equal(ours.vertices, theirs.vertices)
        np.testing.assert_array_equal(ours.faces, theirs.faces)
    texture, expected_texture = (scene.meshes[1].material.diffuse_texture for scene in (found, expected))
    assert texture is not None
    assert expected_texture is not None
    np.testing.assert_array_equal(texture.pixels, expected_texture.pixels)


def test_a_mistake_is_told_as_this_process_would(place: Path) -> None:
    (place / "quad.obj").write_text("v 0 0\n")
    with pytest.raises(SceneError) as expected:
        load_scene_folder(place, label="lab")
    assert refused(place) == str(expected.value)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"max_scene_file_bytes": 20}, "expected at most 20 bytes, found"),
        ({"max_triangles": 3}, "lab/scene.toml: mesh[1].file: expected at most 3 triangles in all, found 4"),
        ({"max_texture_pixels": 14}, "lab/wood.png: expected 1 to 14 pixels, found 5 x 3"),
    ],
)
def test_the_settings_limit_a_scene(place: Path, limits: dict[str, int], message: str) -> None:
    assert message in refused(place, **limits)


def test_limits_are_by_default_those_of_the_renderer() -> None:
    default = Settings()
    assert default.max_scene_file_bytes == MAX_FILE_BYTES
    assert default.max_triangles == MAX_TRIANGLES
    assert default.max_texture_pixels == MAX_TEXTURE_PIXELS


def test_a_scene_that_takes_too_much_memory_is_refused(place: Path) -> None:
    with (place / "quad.obj").open("ab") as mesh:
        mesh.truncate(256 << 20)
    expected = "lab: expected to be read in 67,108,864 bytes of memory, found that it takes more"
    assert refused(place, max_load_bytes=64 << 20) == expected


@pytest.mark.parametrize("crash", [signal.SIGSEGV, signal.SIGABRT, signal.SIGKILL])
def test_a_crash_is_an_error_of_the_scene_and_the_next_reader_goes_on(place: Path, crash: signal.Signals) -> None:
    loader = Loader(Settings())
    with held_reader(loader, place) as (process, scene):
        os.kill(process, crash)
        os.kill(process, signal.SIGCONT)
        with pytest.raises(SceneError, match=f"lab: expected files that can be read, .* ends in {crash.name}"):
            scene.result(PATIENCE_S)
    assert not loader.processes
    assert loader.read(place, "lab").triangles == 4


def test_a_reader_that_takes_too_long_is_ended(place: Path) -> None:
    loader = Loader(Settings(max_load_s=1))
    expected = "lab: expected to be read within 1 s, found that it takes more"
    with held_reader(loader, place) as (_, scene), pytest.raises(SceneError, match=expected):
        scene.result(PATIENCE_S)
    assert not loader.processes


def test_readers_end_with_the_service(place: Path) -> None:
    loader = Loader(Settings())
    with held_reader(loader, place) as (_, scene):
        loader.close()
        with pytest.raises(SceneError):
            scene.result(PATIENCE_S)
    with pytest.raises(RuntimeError, match="closed"):
        loader.read(place, "lab")
