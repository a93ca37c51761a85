"""The library loads each scene once, keeps what was used last, sees changes, and lets nothing out of its folder."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import renderer.library
from renderer.errors import SceneError, UnknownScene
from renderer.library import SceneLibrary
from renderer.prepared import PreparedScene
from renderer.scene import Scene
from renderer.scenes import BUILT_IN

MESH = '[[mesh]]\nfile = "a.obj"\n'
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def write(folder: Path, scene_id: str, text: str = MESH, obj: str = OBJ) -> Path:
    place = folder / scene_id
    place.mkdir(exist_ok=True)
    (place / "scene.toml").write_text(text)
    (place / "a.obj").write_text(obj)
    return place


@pytest.fixture
def loads(monkeypatch: pytest.MonkeyPatch) -> list[Scene]:
    """Every scene that is prepared, in order; preparing itself is as ever."""
    prepared: list[Scene] = []
    prepare = renderer.library.prepare

    def counted(scene: Scene) -> PreparedScene:
        prepared.append(scene)
        return prepare(scene)

    monkeypatch.setattr(renderer.library, "prepare", counted)
    return prepared


def test_built_in_scenes_need_no_folder() -> None:
    library = SceneLibrary()
    assert library.ids() == tuple(BUILT_IN)
    assert library.load("spheres").scene.spheres


def test_ids_are_the_built_in_ones_and_then_the_folders(tmp_path: Path) -> None:
    for name in ("zebra", "a_1-b", "9", "x" * 64):
        write(tmp_path, name)
    for name in ("Upper", "with blank", "x" * 65, "-dash", ".hidden", "dot.dot"):
        write(tmp_path, name)
    (tmp_path / "no_scene").mkdir()
    (tmp_path / "file").write_text("")
    assert SceneLibrary(tmp_path).ids() == (*BUILT_IN, "9", "a_1-b", "x" * 64, "zebra")


@pytest.mark.parametrize("scene_id", ["nope", "", "..", "../a", "a/..", "a/", "/etc", "A", "a\n", "a\0", "no_scene"])
def test_unknown_scenes(tmp_path: Path, scene_id: str) -> None:
    write(tmp_path, "a")
    (tmp_path / "no_scene").mkdir()
    library = SceneLibrary(tmp_path)
    for ask in (library.load, library.version):
        with pytest.raises(UnknownScene) as caught:
            ask(scene_id)
        assert "a" in str(caught.value)


def test_a_scene_is_loaded_once(tmp_path: Path, loads: list[Scene]) -> None:
    write(tmp_path, "a")
    library = SceneLibrary(tmp_path)
    assert library.load("a") is library.load("a")
    assert len(loads) == 1


def test_threads_that_ask_at_once_share_one_loading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, "a")
    library = SceneLibrary(tmp_path)
    waiting, go_on, count = threading.Event(), threading.Event(), 0
    prepare = renderer.library.prepare

    def slow(scene: Scene) -> PreparedScene:
        nonlocal count
        count += 1
        waiting.set()
        assert go_on.wait(30)
        return prepare(scene)

    monkeypatch.setattr(renderer.library, "prepare", slow)
    with ThreadPoolExecutor(8) as pool:
        first = pool.submit(library.load, "a")
        assert waiting.wait(30)
        others = [pool.submit(library.load, "a") for _ in range(6)]
        other_scene = pool.submit(library.version, "spheres")
        assert other_scene.result(30)
        go_on.set()
        assert len({id(each.result(30)) for each in [first, *others]}) == 1
    assert count == 1


@pytest.mark.parametrize("changed", ["scene.toml", "a.obj"])
def test_changed_files_are_loaded_anew(tmp_path: Path, loads: list[Scene], changed: str) -> None:
    place = write(tmp_path, "a")
    library = SceneLibrary(tmp_path)
    before, version = library.load("a"), library.version("a")
    assert library.version("a") == version
    with (place / changed).open("a") as file:
        file.write("# a comment\n")
    assert library.version("a") != version
    assert library.load("a") is not before
    assert len(loads) == 2


def test_a_file_of_the_same_size_and_time_is_still_seen_as_changed(tmp_path: Path) -> None:
    place = write(tmp_path, "a")
    library = SceneLibrary(tmp_path)
    version, status = library.version("a"), (place / "a.obj").stat()
    (place / "a.obj").write_text(OBJ.replace("1", "2", 1))
    os.utime(place / "a.obj", ns=(status.st_atime_ns, status.st_mtime_ns))
    assert library.version("a") != version


def test_versions_are_short_and_differ(tmp_path: Path) -> None:
    write(tmp_path, "a")
    write(tmp_path, "b")
    library = SceneLibrary(tmp_path)
    versions = {library.version(scene_id) for scene_id in ("a", "b", "spheres")}
    assert len(versions) == 3
    assert all(len(version) == 16 and version.isalnum() for version in versions)


def test_a_broken_scene_leaves_the_others_alone_until_it_is_mended(tmp_path: Path, loads: list[Scene]) -> None:
    place = write(tmp_path, "broken", obj="v 0 0 zero\n")
    write(tmp_path, "fine")
    library = SceneLibrary(tmp_path)
    for _ in range(2):
        with pytest.raises(SceneError, match=r"^broken/a\.obj: line 1: v: expected 3 numbers"):
            library.load("broken")
    assert "broken" in library.ids()
    assert library.load("fine").scene.triangles == 1
    (place / "a.obj").write_text(OBJ)
    assert library.load("broken").scene.triangles == 1


def test_a_broken_scene_is_not_read_again_until_it_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, "broken", obj="v 0 0 zero\n")
    library = SceneLibrary(tmp_path)
    reads = []
    load = renderer.library.load_scene_folder
    monkeypatch.setattr(
        renderer.library, "load_scene_folder", lambda *args, **names: reads.append(1) or load(*args, **names)
    )
    for _ in range(3):
        with pytest.raises(SceneError):
            library.load("broken")
    assert len(reads) == 1


def test_scenes_used_longest_ago_are_dropped_first(tmp_path: Path, loads: list[Scene]) -> None:
    for name in "abc":
        write(tmp_path, name)
    size = SceneLibrary(tmp_path).load("a").nbytes
    assert size > 0
    library = SceneLibrary(tmp_path, max_bytes=2 * size)
    loads.clear()
    library.load("a"), library.load("b"), library.load("a"), library.load("c")
    assert library.nbytes == 2 * size
    library.load("a")
    assert len(loads) == 3
    library.load("b")
    assert len(loads) == 4


def test_a_scene_larger_than_the_bound_is_kept_while_it_is_the_last(tmp_path: Path, loads: list[Scene]) -> None:
    for name in "ab":
        write(tmp_path, name)
    library = SceneLibrary(tmp_path, max_bytes=1)
    library.load("a"), library.load("a")
    assert len(loads) == 1
    library.load("b"), library.load("a")
    assert len(loads) == 3


def test_links_that_leave_the_scenes_folder_are_refused(tmp_path: Path) -> None:
    scenes = tmp_path / "scenes"
    scenes.mkdir()
    write(tmp_path, "outside")
    (scenes / "link").symlink_to("../outside")
    (scenes / "loop").symlink_to("loop")
    write(scenes, "real")
    (scenes / "alias").symlink_to("real")
    thief = write(scenes, "thief")
    (thief / "a.obj").unlink()
    (thief / "a.obj").symlink_to("../real/a.obj")
    library = SceneLibrary(scenes)
    assert library.ids() == (*BUILT_IN, "alias", "real", "thief")
    with pytest.raises(UnknownScene):
        library.load("link")
    with pytest.raises(SceneError, match="expected a file inside the folder thief"):
        library.load("thief")
    assert library.load("alias").scene.triangles == 1


def test_a_scenes_folder_reached_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    write(tmp_path / "real", "a")
    (tmp_path / "link").symlink_to("real")
    assert SceneLibrary(tmp_path / "link").load("a").scene.triangles == 1


def test_a_folder_named_like_a_built_in_scene_takes_its_place(tmp_path: Path) -> None:
    place = write(tmp_path, "cornell")
    library = SceneLibrary(tmp_path)
    assert library.ids() == tuple(BUILT_IN)
    assert library.load("cornell").scene.triangles == 1
    (place / "scene.toml").unlink()
    assert library.load("cornell").scene.triangles != 1


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="expected a folder of scenes, found none"):
        SceneLibrary(tmp_path / "none")
    scenes = tmp_path / "scenes"
    scenes.mkdir()
    library = SceneLibrary(scenes)
    scenes.rmdir()
    assert library.ids() == tuple(BUILT_IN)


def test_too_many_files_are_not_a_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renderer.library, "MAX_FILES", 5)
    place = write(tmp_path, "a")
    library = SceneLibrary(tmp_path)
    assert library.version("a")
    for number in range(4):
        (place / f"{number}.txt").write_text("")
    with pytest.raises(SceneError, match="a: expected at most 5 files"):
        library.load("a")
