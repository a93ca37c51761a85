"""Whatever a scene's files name, in every format that can name one: nothing outside the scene's folder is opened."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import pytest

import renderer
from renderer.errors import SceneError
from renderer.scene import Scene
from renderer.scene_file import load_scene_folder
from tests.renderer.model_files import chunk, dae, gltf, png, three_ds, three_ds_cube, three_ds_object
from tests.renderer.test_collada_file import looked
from tests.renderer.test_three_ds_file import material, of_faces

SECRET = (1, 200, 77)
"""Colour of the picture that lies outside."""

ESCAPES: Final[Mapping[str, Callable[[Path], str]]] = MappingProxyType(
    {
        "up": lambda _: "../secret",
        "up and down": lambda _: "sub/../../secret",
        "up twice": lambda _: "../../scenes/secret",
        "absolute": lambda outside: str(outside),
        "double slash": lambda outside: "/" + str(outside),
        "a file's link": lambda _: "link",
        "a folder's link": lambda _: "way-out/secret",
        "a chain of links": lambda _: "chain",
        "backslashes": lambda _: "..\\secret",
        "percent signs": lambda _: "%2e%2e/secret",
        "percent slash": lambda _: "..%2Fsecret",
        "a URL": lambda outside: f"file://{outside}",
        "a host": lambda outside: f"file://localhost{outside}",
        "blanks around": lambda _: " ../secret ",
        "a dot": lambda _: "./../secret",
        "this process": lambda _: "/proc/self/cwd/secret",
    }
)
"""Ways to name the file `secret` beside the folder `lab`, without the ending of its name."""

ODD = ("", ".", "..", "/", "~", "~root", "\0", "a\0b", "con", "C:\\secret.png", "\\\\host\\share\\secret.png",
       "http://127.0.0.1:9/secret.png", "data:,", "\n", "\u202egnp.terces", "x" * 5000, "sub", "|cat secret.png",
       "%00", "%", "$(secret.png)", "secret.png/..", "../secret.png\0.png")  # fmt: skip
"""Names that are none, or of something that is no file."""

OWN: Final = (Path(sys.prefix), Path(sys.base_prefix), Path(renderer.__file__).parent)
"""Where Python finds its own modules."""

_opened: list[str] | None = None


def _watch(event: str, arguments: tuple[Any, ...]) -> None:
    if _opened is not None and event in ("open", "os.listdir", "socket.connect", "subprocess.Popen"):
        _opened.append(os.fspath(arguments[0]) if isinstance(arguments[0], str | bytes | Path) else event)


sys.addaudithook(_watch)


@contextmanager
def opened() -> Iterator[list[str]]:
    """Every file that this process opens meanwhile, by its real path."""
    global _opened
    _opened, found = [], []
    try:
        yield found
    finally:
        found += [os.path.realpath(os.fsdecode(name)) for name in _opened]
        _opened = None


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """The path of the secret files without their endings; beside them lies the folder `lab`."""
    scenes = tmp_path / "scenes"
    (scenes / "lab" / "sub").mkdir(parents=True)
    (scenes / "secret.png").write_bytes(png(SECRET))
    (scenes / "secret.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (scenes / "secret.mtl").write_text("newmtl m\nKd 0.01 0.02 0.03\n")
    (scenes / "secret.bin").write_bytes(b"\0" * 1000)
    for ending in ("png", "obj", "mtl", "bin"):
        (scenes / "lab" / f"link.{ending}").symlink_to(f"../secret.{ending}")
        (scenes / "lab" / f"chain.{ending}").symlink_to(f"link.{ending}")
    (scenes / "lab" / "way-out").symlink_to("..")
    return scenes / "secret"


def quoted(text: str) -> str:
    """As a TOML string."""
    return json.dumps(text)


def mesh_in_scene(name: str) -> dict[str, str | bytes]:
    return {"scene.toml": f"[[mesh]]\nfile = {quoted(name)}"}


def texture_in_scene(name: str) -> dict[str, str | bytes]:
    ball = '[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = "m"\n'
    return {"scene.toml": f"[materials.m]\ndiffuse_texture = {quoted(name)}\n{ball}"}


def texture_in_table(name: str) -> dict[str, str | bytes]:
    ball = '[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = "m"\n'
    return {"scene.toml": f"[materials.m]\nnormal_texture = {{ file = {quoted(name)} }}\n{ball}"}


def library_in_obj(name: str) -> dict[str, str | bytes]:
    return mesh_in_scene("a.obj") | {"a.obj": f"mtllib {name}\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"}


def texture_in_mtl(name: str) -> dict[str, str | bytes]:
    return library_in_obj("a.mtl") | {"a.mtl": f"newmtl m\nmap_Kd {name}\n"}


def buffer_in_gltf(name: str) -> dict[str, str | bytes]:
    return mesh_in_scene("a.gltf") | {"a.gltf": json.dumps(gltf(buffers=[{"byteLength": 92, "uri": name}]))}


def image_in_gltf(name: str) -> dict[str, str | bytes]:
    textured = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorTexture": {"index": 0}}}
    tree = gltf(images=[{"uri": name}], textures=[{"source": 0}], materials=[textured])
    return mesh_in_scene("a.gltf") | {"a.gltf": json.dumps(tree)}


def image_in_collada(name: str) -> dict[str, str | bytes]:
    shown = "".join(f"&#{ord(letter)};" for letter in name)
    image = f'<library_images><image id="i"><init_from>{shown}</init_from></image></library_images>'
    diffuse = '<diffuse><texture texture="i" texcoord="UV"/></diffuse>'
    return mesh_in_scene("a.dae") | {
        "a.dae": looked(f"<technique><lambert>{diffuse}</lambert></technique>", extra=image)
    }


def scene_in_collada(name: str) -> dict[str, str | bytes]:
    shown = "".join(f"&#{ord(letter)};" for letter in name)
    return mesh_in_scene("a.dae") | {"a.dae": dae(nodes=f'<node><instance_geometry url="{shown}#g"/></node>')}


def texture_in_3ds(name: str) -> dict[str, str | bytes]:
    look = material(chunk(0xA200, chunk(0xA300, name.encode(errors="replace") + b"\0")))
    cube = three_ds_object("Box", three_ds_cube(in_faces=of_faces("m", *range(12))))
    return mesh_in_scene("a.3ds") | {"a.3ds": three_ds(look, cube)}


NAMERS: Final = (
    (mesh_in_scene, "obj"),
    (texture_in_scene, "png"),
    (texture_in_table, "png"),
    (library_in_obj, "mtl"),
    (texture_in_mtl, "png"),
    (buffer_in_gltf, "bin"),
    (image_in_gltf, "png"),
    (image_in_collada, "png"),
    (scene_in_collada, "dae"),
    (texture_in_3ds, "png"),
)
"""Files that name another one, and what that one is."""


def load(folder: Path, files: dict[str, str | bytes]) -> Scene | None:
    """The scene of these files, or None for one that is refused; nothing else of the machine was opened for it."""
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass"))
    scene, message = None, ""
    with opened() as found:
        try:
            scene = load_scene_folder(folder, label="lab")
        except SceneError as error:
            message = str(error)
    assert message.isprintable()
    strangers = [path for path in found if path != str(folder) and not Path(path).is_relative_to(folder)]
    assert not [path for path in strangers if not any(Path(path).is_relative_to(own) for own in OWN)]
    assert str(folder / "scene.toml") in found
    return scene


def shows_secret(scene: Scene) -> bool:
    textures = [mesh.material.diffuse_texture for mesh in scene.meshes]
    textures += [sphere.material.diffuse_texture for sphere in scene.spheres]
    return any(texture is not None and np.array_equal(texture.pixels[0, 0], SECRET) for texture in textures)


@pytest.mark.parametrize(("files", "ending"), NAMERS, ids=[files.__name__ for files, _ in NAMERS])
def test_the_file_is_found_inside(outside: Path, files: Callable[[str], dict[str, str | bytes]], ending: str) -> None:
    """Else what follows would show nothing: under the same name, but inside, it is opened."""
    if ending in ("bin", "dae"):
        pytest.skip("a buffer of zeros makes no triangle; COLLADA files are not opened from others")
    folder = outside.parent / "lab"
    (folder / f"own.{ending}").write_bytes(outside.with_suffix(f".{ending}").read_bytes())
    scene = load(folder, files(f"own.{ending}"))
    assert scene is not None
    if ending == "png" and files is not texture_in_table:
        assert shows_secret(scene)


@pytest.mark.parametrize("way", ESCAPES)
@pytest.mark.parametrize(("files", "ending"), NAMERS, ids=[files.__name__ for files, _ in NAMERS])
def test_no_name_leads_out(
    outside: Path, files: Callable[[str], dict[str, str | bytes]], ending: str, way: str
) -> None:
    scene = load(outside.parent / "lab", files(f"{ESCAPES[way](outside)}.{ending}"))
    assert scene is None or not shows_secret(scene)


@pytest.mark.parametrize(("files", "ending"), NAMERS, ids=[files.__name__ for files, _ in NAMERS])
def test_odd_names_are_names_of_nothing(
    outside: Path, files: Callable[[str], dict[str, str | bytes]], ending: str
) -> None:
    del ending
    for name in ODD:
        scene = load(outside.parent / "lab", files(name))
        assert scene is None or not shows_secret(scene)
