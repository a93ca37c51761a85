"""scene.toml: every field arrives where it belongs, every mistake is told with its place."""

from __future__ import annotations

import io
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import renderer.scene_file
from renderer.errors import SceneError
from renderer.framing import DEFAULT_MATERIAL, STUDIO, frame_model
from renderer.model import Model
from renderer.scene import PointLight, RectangleLight, Scene, SphereLight, Surroundings
from renderer.scene_file import load_scene_folder
from tests.renderer.model_files import gltf

VASE = """mtllib vase.mtl
v 0 0 0
v 100 0 0
v 0 100 0
v 0 0 100
usemtl Body
f 1 3 2
f 1 4 3
usemtl Lid
f 1 2 4
f 2 3 4
"""


BALL = '[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = "m"\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files of the worked example."""
    place = tmp_path / "vase"
    place.mkdir()
    (place / "vase.obj").write_text(VASE)
    (place / "vase.mtl").write_text("newmtl Body\nKd 0.1 0.2 0.3\nnewmtl Lid\nKd 0.4 0.5 0.6\n")
    picture = io.BytesIO()
    Image.new("RGB", (2, 2), (10, 20, 30)).save(picture, "png")
    for name in ("wood.png", "worn.png", "bumps.png"):
        (place / name).write_bytes(picture.getvalue())
    return place


def load(folder: Path, text: str) -> Scene:
    (folder / "scene.toml").write_text(text)
    return load_scene_folder(folder, label="vase")


def refused(folder: Path, text: str) -> str:
    with pytest.raises(SceneError) as caught:
        load(folder, text)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def worked_example() -> str:
    documentation = renderer.scene_file.__doc__
    assert documentation is not None
    return documentation.split("```toml\n")[1].split("```")[0]


def test_the_worked_example(folder: Path) -> None:
    scene = load(folder, worked_example())
    assert scene.title == "A vase on a table"
    assert scene.exposure == 1.0
    assert scene.camera.position == (0.0, 1.5, 2.0)
    assert scene.camera.vertical_fov_deg == 40.0
    assert scene.surroundings == Surroundings((0.3, 0.4, 0.6), (0.8, 0.8, 0.8), (0.1, 0.1, 0.1))
    assert [mesh.material.name for mesh in scene.meshes] == ["gold", "gold"]
    assert scene.meshes[0].material.reflection == (0.5, 0.4, 0.2)
    assert scene.spheres[0].material.transmission == (1.0, 1.0, 1.0)
    assert scene.spheres[0].radius == 0.1
    assert scene.lights == (
        PointLight((2.0, 3.0, 2.0), (40.0, 40.0, 40.0)),
        RectangleLight((-0.5, 2.5, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (9.0, 9.0, 9.0)),
        SphereLight((-1.0, 1.5, 0.5), 0.1, (20.0, 18.0, 15.0)),
    )


def test_the_worked_example_shows_every_field(folder: Path) -> None:
    stated = tomllib.loads(worked_example())
    expected = {
        "": {"title", "exposure", "camera", "camera_path", "surroundings", "materials", "mesh", "sphere", "light"},
        "camera": {"position", "look_at", "up", "vertical_fov_deg"},
        "camera_path": {"time_s", "position", "look_at", "up", "vertical_fov_deg"},
        "surroundings": {"zenith", "horizon", "ambient"},
        "mesh": {"file", "material", "use_camera", "use_lights", "scale", "rotate_deg", "translate", "casts_shadows"},
        "sphere": {"center", "radius", "material", "casts_shadows"},
        "light": {"kind", "position", "intensity", "casts_shadows"},
    }
    found = {
        key: set(value[0] if isinstance(value, list) else value) for key, value in stated.items() if key in expected
    }
    assert {"": set(stated)} | found == expected
    assert [set(light) for light in stated["light"][1:]] == [
        {"kind", "corner", "edge_u", "edge_v", "radiance", "two_sided"},
        {"kind", "center", "radius", "radiance"},
    ]
    fields = set().union(*stated["materials"].values())
    assert fields | {"emission"} == {
        "diffuse", "specular", "shininess", "emission", "reflection", "transmission", "ior", "diffuse_texture",
        "base", "exponent_u", "exponent_v", "specular_texture",
        "alpha_texture", "alpha_cutoff", "normal_texture", "normal_scale", "priority",
    }  # fmt: skip


def test_a_mesh_in_its_place(folder: Path) -> None:
    scene = load(
        folder,
        '[[mesh]]\nfile = "vase.obj"\nscale = [0.01, 0.02, 0.01]\nrotate_deg = [90, 0, 90]\ntranslate = [5, 0, 0]\n',
    )
    corner = {tuple(vertex) for mesh in scene.meshes for vertex in mesh.vertices.round(9).tolist()}
    # x -> about x stays x -> about z is y; y -> about x is z; z -> about x is -y -> about z is x
    assert corner == {(5.0, 0.0, 0.0), (5.0, 1.0, 0.0), (5.0, 0.0, 2.0), (6.0, 0.0, 0.0)}


@pytest.mark.parametrize("scale", ["1", "-1", "[1, -2, 3]", "[-1, -1, 1]"])
def test_mirrored_meshes_still_face_outwards(folder: Path, scale: str) -> None:
    scene = load(folder, f'[[mesh]]\nfile = "vase.obj"\nscale = {scale}\n')
    volume = 0.0
    for mesh in scene.meshes:
        a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
        volume += float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6
    assert volume > 0


def test_textures_and_how_they_go_on(folder: Path) -> None:
    scene = load(folder, worked_example().replace('material = "glass"', 'material = "wood"'))
    wood = scene.spheres[0].material
    assert wood.diffuse_texture is not None
    assert wood.specular_texture is not None
    assert (wood.diffuse_texture.wrap_u, wood.diffuse_texture.wrap_v) == ("repeat", "repeat")
    assert wood.alpha_texture is wood.diffuse_texture
    assert wood.alpha_cutoff == 0.5
    assert wood.normal_texture is not None
    assert wood.normal_texture is not wood.diffuse_texture
    deeper = load(folder, '[materials.m]\nnormal_texture = "bumps.png"\nnormal_scale = -2\n' + BALL).spheres[0].material
    assert deeper.normal_texture is not None
    assert (deeper.normal_scale, wood.normal_scale) == (-2.0, 1.0)
    assert (wood.specular_texture.wrap_u, wood.specular_texture.wrap_v) == ("mirror", "clamp")


def test_a_material_of_the_other_base(folder: Path) -> None:
    text = worked_example().replace('material = "glass"', 'material = "brushed_steel"')
    (material,) = (sphere.material for sphere in load(folder, text).spheres)
    assert (material.base, material.exponent_u, material.exponent_v) == ("ashikhmin-shirley", 800.0, 20.0)
    assert material.specular == (0.9, 0.9, 0.92)


def test_the_files_own_materials_and_their_replacement(folder: Path) -> None:
    own = load(folder, '[[mesh]]\nfile = "vase.obj"\n')
    assert [mesh.material.diffuse for mesh in own.meshes] == [(0.1, 0.2, 0.3), (0.4, 0.5, 0.6)]
    text = '[materials.wood]\ndiffuse_texture = "wood.png"\n[[mesh]]\nfile = "vase.obj"\nmaterial = { Lid = "wood" }\n'
    replaced = load(folder, text)
    assert [mesh.material.name for mesh in replaced.meshes] == ["Body", "wood"]
    texture = replaced.meshes[1].material.diffuse_texture
    assert texture is not None
    np.testing.assert_array_equal(texture.pixels[0, 0], [10, 20, 30])
    assert replaced.meshes[1].material.diffuse == (1.0, 1.0, 1.0)


def test_a_file_placed_twice_is_read_once(folder: Path) -> None:
    scene = load(folder, '[[mesh]]\nfile = "vase.obj"\n[[mesh]]\nfile = "vase.obj"\ncasts_shadows = false\n')
    assert [mesh.casts_shadows for mesh in scene.meshes] == [True, True, False, False]
    assert scene.meshes[0].faces is scene.meshes[2].faces


def test_what_is_left_out_is_framed(folder: Path) -> None:
    scene = load(folder, '[[mesh]]\nfile = "vase.obj"\n')
    framed = frame_model(Model(scene.meshes), "vase")
    assert scene.camera == framed.camera
    assert scene.lights == framed.lights
    assert scene.surroundings is STUDIO


def test_what_is_given_is_taken(folder: Path) -> None:
    scene = load(folder, "light = []\n[surroundings]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n")
    assert scene.lights == ()
    assert scene.surroundings == Surroundings()
    assert scene.spheres[0].material is DEFAULT_MATERIAL
    only_camera = load(folder, "light = []\n[camera]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\n")
    assert only_camera.meshes == ()


RECTANGLE = "[[light]]\nkind = 'rectangle'\ncorner = [0, 0, 0]\nradiance = [1, 1, 1]\nedge_u = [1, 0, 0]\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("title = 3", "vase/scene.toml: title: expected text, found 3"),
        ("exposure = 0", "vase/scene.toml: exposure: expected a number in (0, 1e+12], found 0"),
        ("exposure = nan", "vase/scene.toml: exposure: expected a number in (0, 1e+12], found nan"),
        ("exposure = true", "vase/scene.toml: exposure: expected a number"),
        ("tilte = 'x'", "vase/scene.toml: tilte: expected one of the fields camera, camera_path, exposure, light"),
        ("camera = 1", "vase/scene.toml: camera: expected a table of fields, found 1"),
        ("[camera]\nposition = [0, 0, 1]", "vase/scene.toml: camera.look_at: expected 3 numbers, found nothing"),
        ("[camera]\nposition = [0, 0]\nlook_at = [0, 0, 0]", "vase/scene.toml: camera.position: expected 3 numbers"),
        ("[camera]\nposition = [0, 0, 'x']", "vase/scene.toml: camera.position[2]: expected a number"),
        (
            "[camera]\nposition = [0, 0, 1]\nlook_at = [0, 0, 1]",
            "vase/scene.toml: camera.look_at: expected a point away from camera.position, found (0.0, 0.0, 1.0)",
        ),
        (
            "[camera]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\nfov = 3",
            "vase/scene.toml: camera.fov: expected one of the fields look_at, position, up, vertical_fov_deg, found 3",
        ),
        ("[surroundings]\nambient = [1, 2, -3]", "vase/scene.toml: surroundings.ambient[2]: expected a number"),
        ("mesh = 3", "vase/scene.toml: mesh: expected a list, found 3"),
        ("[[mesh]]", "vase/scene.toml: mesh[0].file: expected text, found nothing"),
        ("[[mesh]]\nfile = 'none.obj'", "vase/scene.toml: mesh[0].file: expected an existing file, found no file"),
        ("[[mesh]]\nfile = '../x.obj'", "vase/scene.toml: mesh[0].file: expected a file inside the folder vase"),
        ("[[mesh]]\nfile = '/x.obj'", "vase/scene.toml: mesh[0].file: expected a file inside the folder vase"),
        ("[[mesh]]\nfile = 'wood.png'", "vase/scene.toml: mesh[0].file: expected a mesh file (.obj, .glb"),
        ("[[mesh]]\nfile = 'vase.obj'\nscale = 0", "vase/scene.toml: mesh[0].scale: expected factors other than 0"),
        ("[[mesh]]\nfile = 'vase.obj'\nscale = [1, 0, 1]", "vase/scene.toml: mesh[0].scale: expected factors other"),
        ("[[mesh]]\nfile = 'vase.obj'\nscale = '1'", "vase/scene.toml: mesh[0].scale: expected a number"),
        ("[[mesh]]\nfile = 'vase.obj'\nrotate_deg = 90", "vase/scene.toml: mesh[0].rotate_deg: expected 3 numbers"),
        ("[[mesh]]\nfile = 'vase.obj'\nmaterial = 'gold'", "vase/scene.toml: mesh[0].material: expected a material"),
        (
            "[materials.red]\n[[mesh]]\nfile = 'vase.obj'\nmaterial = 'gold'",
            "vase/scene.toml: mesh[0].material: expected one of red, found 'gold'",
        ),
        (
            "[materials.red]\n[[mesh]]\nfile = 'vase.obj'\nmaterial = { Foot = 'red' }",
            "vase/scene.toml: mesh[0].material: expected materials of the file (Body, Lid), found 'Foot'",
        ),
        (
            "[materials.red]\n[[mesh]]\nfile = 'vase.obj'\nmaterial = { Lid = 'gold' }",
            "vase/scene.toml: mesh[0].material.Lid: expected one of red, found 'gold'",
        ),
        (
            "[materials.red]\ndiffuse = [2, 0, 0]",
            "vase/scene.toml: materials.red.diffuse[0]: expected a number in [0, 1]",
        ),
        (
            "[materials.red]\ncolor = 1",
            "vase/scene.toml: materials.red.color: expected one of the fields alpha_cutoff, ",
        ),
        (
            "[materials.red]\nbase = 'lambert'",
            "vase/scene.toml: materials.red.base: expected one of phong, ashikhmin-shirley, found 'lambert'",
        ),
        (
            "[materials.red]\nbase = 'ashikhmin-shirley'\nspecular = [2, 0, 0]",
            "vase/scene.toml: materials.red.specular[0]: expected a number in [0, 1], found 2",
        ),
        (
            "[materials.red]\nexponent_v = -1",
            "vase/scene.toml: materials.red.exponent_v: expected a number in [0, 1e+09], found -1",
        ),
        ("[materials.red]\npriority = 1.5", "vase/scene.toml: materials.red.priority: expected an integer"),
        ("[materials.red]\nior = 100", "vase/scene.toml: materials.red.ior: expected a number in [0.1, 10], found 100"),
        (
            "[materials.red]\ndiffuse_texture = 'none.png'",
            "vase/scene.toml: materials.red.diffuse_texture: expected an existing file, found no file 'none.png'",
        ),
        (
            "[materials.red]\nspecular_texture = { file = 'wood.png', wrap_u = 'tile' }",
            "vase/scene.toml: materials.red.specular_texture.wrap_u: expected one of repeat, clamp, mirror, found",
        ),
        (
            "[materials.red]\nspecular_texture = { file = 'wood.png', wrap = 'clamp' }",
            "vase/scene.toml: materials.red.specular_texture.wrap: expected one of the fields file, wrap_u, wrap_v",
        ),
        (
            "[materials.red]\nnormal_scale = 1e4",
            "vase/scene.toml: materials.red.normal_scale: expected a number in [-1000",
        ),
        (
            "[materials.red]\ndiffuse_texture = 7",
            "vase/scene.toml: materials.red.diffuse_texture: expected text, found 7",
        ),
        ("[materials.red]\ndiffuse_texture = 'vase.obj'", "vase/vase.obj: expected an image that can be read"),
        ("[[sphere]]\ncenter = [0, 0, 0]", "vase/scene.toml: sphere[0].radius: expected a number, found nothing"),
        ("[[sphere]]\ncenter = [0, 0, 0]\nradius = 0", "vase/scene.toml: sphere[0].radius: expected a number in (0"),
        ("[[light]]\nposition = [0, 0, 0]", "vase/scene.toml: light[0].kind: expected one of point, rectangle, sphere"),
        ("[[light]]\nkind = 'sun'", "vase/scene.toml: light[0].kind: expected one of point, rectangle, sphere"),
        (
            RECTANGLE + "edge_v = [2, 0, 0]",
            "vase/scene.toml: light[0].edge_v: expected an edge at right angles to edge_u",
        ),
        (RECTANGLE + "edge_v = [0, 0, 0]", "vase/scene.toml: light[0].edge_v: expected an edge with a length, found"),
        ("title = 'a\nb'", "vase/scene.toml: expected TOML, found a mistake:"),
        ("", "vase/scene.toml: expected something to show, found no triangle and no sphere"),
    ],
)
def test_mistakes_are_told_with_their_place(folder: Path, text: str, message: str) -> None:
    assert refused(folder, text).startswith(message)


def lamp_file(folder: Path) -> None:
    """A glTF file of one triangle, a camera and a light."""
    tree = gltf(
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 683.0}]}},
        cameras=[{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
        nodes=[{"mesh": 0, "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 0, 3]}],
    )
    (folder / "lamp.gltf").write_text(json.dumps(tree))


def test_a_mesh_files_camera_and_lights_are_used_where_asked_for(folder: Path) -> None:
    lamp_file(folder)
    table = '[[mesh]]\nfile = "lamp.gltf"\nscale = 2\n'
    assert load(folder, table).camera == frame_model(Model(load(folder, table).meshes), "vase").camera
    assert len(load(folder, table).lights) == 3
    scene = load(folder, table + "use_camera = true\nuse_lights = true\n")
    assert scene.camera.position == (0.0, 0.0, 6.0)
    (light,) = scene.lights
    assert light.position == (0.0, 0.0, 6.0)
    np.testing.assert_allclose(light.intensity, (4.0, 4.0, 4.0))
    more = load(
        folder,
        '[[light]]\nkind = "point"\nposition = [9, 9, 9]\nintensity = [1, 1, 1]\n' + table + "use_lights = true\n",
    )
    assert [light.position for light in more.lights] == [(9.0, 9.0, 9.0), (0.0, 0.0, 6.0)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[mesh]]\nfile = 'vase.obj'\nuse_camera = true", "mesh[0].use_camera: expected one file with a camera"),
        ("[[mesh]]\nfile = 'vase.obj'\nuse_lights = true", "mesh[0].use_lights: expected a file with lights"),
        (
            "[[mesh]]\nfile = 'lamp.gltf'\nuse_camera = true\n" * 2,
            "mesh[1].use_camera: expected one file with a camera",
        ),
        (
            "[camera]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\n[[mesh]]\nfile = 'lamp.gltf'\nuse_camera = true",
            "camera: expected no camera beside that of a mesh file (use_camera)",
        ),
        ("[[mesh]]\nfile = 'lamp.gltf'\nuse_lights = 1", "mesh[0].use_lights: expected true or false, found 1"),
    ],
)
def test_mistakes_in_taking_a_mesh_files_view(folder: Path, text: str, message: str) -> None:
    lamp_file(folder)
    assert refused(folder, text).startswith(f"vase/scene.toml: {message}")


def test_a_mistake_in_a_mesh_file_names_that_file(folder: Path) -> None:
    (folder / "vase.obj").write_text("v 0 0 zero\n")
    assert (
        refused(folder, "[[mesh]]\nfile = 'vase.obj'")
        == "vase/vase.obj: line 1: v: expected 3 numbers, found '0 0 zero'"
    )


def test_triangles_of_all_meshes_together_are_limited(folder: Path) -> None:
    (folder / "scene.toml").write_text("[[mesh]]\nfile = 'vase.obj'\n" * 3)
    with pytest.raises(SceneError, match=r"mesh\[2\]\.file: expected at most 8 triangles in all, found 12"):
        load_scene_folder(folder, max_triangles=8)


def test_links_out_of_the_folder_are_refused(folder: Path) -> None:
    outside = folder.parent / "secret.obj"
    outside.write_text(VASE)
    (folder / "link.obj").symlink_to(outside)
    assert "expected a file inside the folder vase" in refused(folder, "[[mesh]]\nfile = 'link.obj'")
    (folder / "scene.toml").unlink()
    (folder.parent / "other.toml").write_text("title = 'secret'")
    (folder / "scene.toml").symlink_to("../other.toml")
    with pytest.raises(SceneError, match="expected a file inside"):
        load_scene_folder(folder)


def test_no_scene_file(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"scene\.toml: expected an existing file"):
        load_scene_folder(tmp_path)


def test_damaged_scene_files_give_a_scene_or_an_error(folder: Path) -> None:
    good = worked_example().encode()
    generator = np.random.default_rng(6)
    scenes, messages = 0, []
    for round_number in range(300):
        data = bytearray(good[: len(good) * round_number // 100] if round_number < 100 else good)
        for at in generator.integers(0, max(len(data), 1), 2):
            if data:
                data[at] = generator.choice(np.frombuffer(b'0-9.[]="x \n\xff', dtype=np.uint8))
        (folder / "scene.toml").write_bytes(data)
        try:
            load_scene_folder(folder)
            scenes += 1
        except SceneError as error:
            messages.append(str(error))
    assert scenes > 10
    assert len(messages) > 10
    assert not any("\n" in message for message in messages)
