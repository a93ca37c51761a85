"""COLLADA files: geometry, nodes, materials, lights, cameras, and mistakes told with their line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import renderer.xml_tree
from renderer.framing import DEFAULT_MATERIAL
from renderer.mesh_file import load_model
from renderer.model import Model
from renderer.scene import Material
from tests.renderer.model_files import (
    DAE_SQUARE,
    DAE_TRIANGLES,
    area_vector,
    dae,
    dae_source,
    load,
    png,
    refused,
)

CORNERS = '<vertices id="corners"><input semantic="POSITION" source="#square"/></vertices>'
VERTEX = '<input semantic="VERTEX" source="#corners" offset="0"/>'


def read(folder: Path, text: str) -> Model:
    (folder / "a.dae").write_text(text)
    return load_model(folder / "a.dae")


@pytest.mark.parametrize(
    ("primitive", "triangles"),
    [
        (f"<triangles>{VERTEX}<p>0 1 2 0 2 3</p></triangles>", 2),
        (f"<polylist>{VERTEX}<vcount>4</vcount><p>0 1 2 3</p></polylist>", 2),
        (f"<polylist>{VERTEX}<vcount>3 2 3 1</vcount><p>0 1 2 0 1 0 2 3 1</p></polylist>", 2),
        (f"<polygons>{VERTEX}<p>0 1 2</p><p>0 2 3</p></polygons>", 2),
        (f"<polygons>{VERTEX}<ph><p>0 1 2 3</p><h>0 1 2</h></ph></polygons>", 2),
        (f"<tristrips>{VERTEX}<p>0 1 3 2</p><p>0 1</p></tristrips>", 2),
        (f"<trifans>{VERTEX}<p>0 1 2 3</p><p></p></trifans>", 2),
        (f"<lines>{VERTEX}<p>0 1</p></lines>{DAE_TRIANGLES}", 2),
    ],
)
def test_every_kind_of_primitive_covers_the_square(tmp_path: Path, primitive: str, triangles: int) -> None:
    (mesh,) = read(tmp_path, dae(primitive)).meshes
    assert len(mesh.faces) == triangles
    np.testing.assert_allclose(area_vector(mesh), [0, 0, 1])
    assert mesh.normals is None
    assert mesh.uvs is None
    assert mesh.material is DEFAULT_MATERIAL


def test_a_concave_polygon_is_covered_once(tmp_path: Path) -> None:
    sources = dae_source("square", (0, 0, 0, 4, 0, 0, 4, 4, 0, 2, 1, 0, 0, 4, 0), 3) + CORNERS
    primitive = f"<polylist>{VERTEX}<vcount>5</vcount><p>0 1 2 3 4</p></polylist>"
    (mesh,) = read(tmp_path, dae(primitive, sources=sources)).meshes
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(10.0)


def test_normals_and_texture_coordinates_have_indices_of_their_own(tmp_path: Path) -> None:
    sources = DAE_SQUARE + dae_source("n", (0, 0, 1, 0, 1, 0), 3) + dae_source("t", (0, 0, 9, 0.5, 0.25, 9), 3)
    primitive = (
        f'<triangles>{VERTEX}<input semantic="NORMAL" source="#n" offset="2"/>'
        '<input semantic="TEXCOORD" source="#t" offset="1" set="0"/>'
        "<p>0 0 0 1 1 0 2 0 1  0 0 0 2 0 1 3 1 1</p></triangles>"
    )
    (mesh,) = read(tmp_path, dae(primitive, sources=sources)).meshes
    assert len(mesh.vertices) == 4
    assert mesh.normals is not None
    assert mesh.uvs is not None
    np.testing.assert_array_equal(mesh.normals[mesh.faces[1]], [[0, 0, 1], [0, 1, 0], [0, 1, 0]])
    np.testing.assert_array_equal(mesh.uvs[mesh.faces[1]], [[0, 0], [0, 0], [0.5, 0.25]])


def test_normals_beside_the_positions(tmp_path: Path) -> None:
    sources = (DAE_SQUARE + dae_source("n", (0, 0, 1) * 4, 3)).replace(
        "</vertices>", '<input semantic="NORMAL" source="#n"/></vertices>'
    )
    (mesh,) = read(tmp_path, dae(sources=sources)).meshes
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 4)


@pytest.mark.parametrize(
    ("asset", "corner"),
    [
        ("<up_axis>Y_UP</up_axis>", (1, 2, 3)),
        ("", (1, 2, 3)),
        ("<up_axis>Z_UP</up_axis>", (1, 3, -2)),
        ("<up_axis>X_UP</up_axis>", (-2, 1, 3)),
        ('<unit meter="0.5" name="half"/>', (0.5, 1, 1.5)),
        ('<unit meter="0,50"/><up_axis> Z_UP </up_axis>', (0.5, 1.5, -1)),
        ("<unit/>", (1, 2, 3)),
    ],
)
def test_up_axis_and_unit(tmp_path: Path, asset: str, corner: tuple[float, float, float]) -> None:
    nodes = '<node><translate>1 2 3</translate><instance_geometry url="#g"/></node>'
    (mesh,) = read(tmp_path, dae(asset=asset, nodes=nodes)).meshes
    np.testing.assert_allclose(mesh.vertices[0], corner)


@pytest.mark.parametrize(
    ("transform", "corner"),
    [
        # where the square's corner (1, 1, 0) goes
        ("<translate>1 2 3</translate>", (2, 3, 3)),
        ("<rotate>0 0 2 90</rotate>", (-1, 1, 0)),
        ("<scale>2 3 4</scale>", (2, 3, 0)),
        ("<matrix>0 0 1 5  1 0 0 6  0 1 0 7  0 0 0 1</matrix>", (5, 7, 8)),
        ("<translate>1 0 0</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>", (0, 2, 0)),
        ("<lookat>0 0 5  5 0 5  0 1 0</lookat>", (0, 1, 6)),
        ("<skew>45 0 1 0 1 0 0</skew>", (2, 1, 0)),
        ("<rotate>0 0 0 90</rotate>", (1, 1, 0)),
    ],
)
def test_transforms(tmp_path: Path, transform: str, corner: tuple[float, float, float]) -> None:
    (mesh,) = read(tmp_path, dae(nodes=f'<node>{transform}<instance_geometry url="#g"/></node>')).meshes
    np.testing.assert_allclose(mesh.vertices[2], corner, atol=1e-12)


def test_nodes_multiply_from_the_root_down_and_are_instanced(tmp_path: Path) -> None:
    shared = '<node id="n"><translate>0 1 0</translate><instance_geometry url="#g"/></node>'
    nodes = (
        '<node><translate>10 0 0</translate><node><scale>2 2 2</scale><instance_node url="#n"/></node>'
        '<instance_node url="#n"/></node><node id="%41"/>'
    )
    meshes = read(tmp_path, dae(nodes=nodes, libraries=f"<library_nodes>{shared}</library_nodes>")).meshes
    assert sorted(mesh.vertices[0].tolist() for mesh in meshes) == [[10, 1, 0], [10, 2, 0]]


def test_without_a_scene_all_geometry_is_shown(tmp_path: Path) -> None:
    text = dae()
    bare = text[: text.index("<library_visual_scenes>")] + "</COLLADA>"
    assert len(read(tmp_path, bare).meshes) == 1
    assert len(read(tmp_path, dae(nodes="<node/>")).meshes) == 1


@pytest.mark.parametrize(
    "numbers", ["0,0 0,0 0 1,0 0,0 0 1,0 1,0 0 0,0 1e0 0", "0.0, 0, 0, 1.0, 0, 0, 1, 1, 0, 0, 1, 0"]
)
def test_numbers_with_commas(tmp_path: Path, numbers: str) -> None:
    text = dae()
    (mesh,) = read(tmp_path, text.replace("0 0 0 1 0 0 1 1 0 0 1 0", numbers)).meshes
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def test_long_lists_of_numbers_are_read_piece_by_piece(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renderer.xml_tree, "_PIECE", 7)
    (mesh,) = read(tmp_path, dae().replace("0 0 0 1 0 0", "0.125 \n 0 \t-0.25   1e-3 0 0")).meshes
    np.testing.assert_array_equal(mesh.vertices, [[0.125, 0, -0.25], [0.001, 0, 0], [1, 1, 0], [0, 1, 0]])


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    text = (
        dae()
        .replace("utf-8", "latin-1" if encoding == "latin-1" else "utf-8")
        .replace('name="square"', 'name="Würfel"')
    )
    text = text if encoding != "utf-16" else text.replace('encoding="utf-8"', "")
    (tmp_path / "a.dae").write_bytes(text.encode(encoding))
    (mesh,) = load_model(tmp_path / "a.dae").meshes
    assert "Würfel" in mesh.name


def test_skins_stand_in_their_bind_pose_and_morphs_in_their_base_shape(tmp_path: Path) -> None:
    libraries = (
        '<library_controllers><controller id="m"><morph source="#g"/></controller>'
        '<controller id="k"><skin source="#m"><bind_shape_matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>'
        "</skin></controller></library_controllers>"
    )
    moved = "<translate>0 0 9</translate>"
    skin = f'<node>{moved}<instance_controller url="#k"/></node>'
    (mesh,) = read(tmp_path, dae(nodes=skin, libraries=libraries)).meshes
    np.testing.assert_array_equal(mesh.vertices[0], [5, 0, 0])
    morph = f'<node>{moved}<instance_controller url="#m"/></node>'
    (mesh,) = read(tmp_path, dae(nodes=morph, libraries=libraries)).meshes
    np.testing.assert_array_equal(mesh.vertices[0], [0, 0, 9])


def looked(effect: str, bind: str = "", extra: str = "") -> str:
    """A file whose square has the material of an effect."""
    nodes = (
        '<node><instance_geometry url="#g"><bind_material><technique_common>'
        f'<instance_material symbol="look" target="#m">{bind}</instance_material>'
        "</technique_common></bind_material></instance_geometry></node>"
    )
    libraries = (
        f'{extra}<library_effects><effect id="e"><profile_COMMON>{effect}</profile_COMMON></effect></library_effects>'
        '<library_materials><material id="m" name="Paint"><instance_effect url="#e"/></material></library_materials>'
    )
    return dae(nodes=nodes, libraries=libraries)


def material(folder: Path, shader: str) -> Material:
    (mesh,) = read(folder, looked(f"<technique>{shader}</technique>")).meshes
    return mesh.material


NONE = (0.0, 0.0, 0.0)
KD = "<diffuse><color>0.2 0.4 0.6 1</color></diffuse>"
KS = "<specular><color>0.5 0.5 0.25 1</color></specular>"


@pytest.mark.parametrize(
    ("shader", "expected"),
    [
        (f"<phong>{KD}{KS}<shininess><float>60</float></shininess></phong>",
         {"diffuse": (0.2, 0.4, 0.6), "specular": np.array((0.5, 0.5, 0.25)) / math.pi, "shininess": 60.0}),
        (f"<phong>{KS}<shininess><float>0.5</float></shininess></phong>", {"shininess": 64.0}),
        (f"<blinn>{KS}<shininess><float>60</float></shininess></blinn>", {"shininess": 15.0}),
        (f"<lambert>{KD}{KS}</lambert>", {"diffuse": (0.2, 0.4, 0.6), "specular": NONE}),
        (f"<constant>{KD.replace('diffuse', 'emission')}</constant>", {"emission": (0.2, 0.4, 0.6), "diffuse": NONE}),
        (f"<lambert>{KD}<emission><color>0.1 0.2 0.3</color></emission></lambert>", {"emission": (0.1, 0.2, 0.3)}),
        ("<phong><reflective><color>1 0.5 0 1</color></reflective><reflectivity><float>0.5</float></reflectivity>"
         "</phong>",
         {"reflection": (0.5, 0.25, 0.0)}),
        (f"<phong>{KD}<transparent><color>1 1 1 0.25</color></transparent></phong>",
         {"transmission": (0.75, 0.75, 0.75), "diffuse": (0.05, 0.1, 0.15), "ior": 1.0}),
        (f"<phong>{KD}<transparency><float>0.75</float></transparency></phong>", {"transmission": (0.25, 0.25, 0.25)}),
        (f'<phong>{KD}<transparent opaque="A_ZERO"><color>0 0 0 0.25</color></transparent></phong>',
         {"transmission": (0.25, 0.25, 0.25)}),
        ('<phong><transparent opaque="RGB_ZERO"><color>0.5 1 0 1</color></transparent>'
         "<transparency><float>0.5</float></transparency>"
         "<index_of_refraction><float>1.5</float></index_of_refraction></phong>",
         {"transmission": (0.25, 0.5, 0.0), "ior": 1.5}),
        (f'<phong>{KD}<transparent opaque="RGB_ZERO"><color>0 0 0 1</color></transparent></phong>',
         {"transmission": NONE}),
        (f"<phong>{KD}<transparency><float>0</float></transparency></phong>",
         {"transmission": NONE, "diffuse": (0.2, 0.4, 0.6)}),
        ("<phong><diffuse/><specular><color/></specular></phong>", {"diffuse": (0.8, 0.8, 0.8), "specular": NONE}),
        ("", {"diffuse": (0.8, 0.8, 0.8)}),
    ],
)  # fmt: skip
def test_materials(tmp_path: Path, shader: str, expected: dict[str, object]) -> None:
    found = material(tmp_path, shader)
    assert found.name == "Paint"
    for name, value in expected.items():
        np.testing.assert_allclose(getattr(found, name), value, atol=1e-12, err_msg=name)


def test_an_exporter_that_takes_opacity_for_its_opposite_is_found_out(tmp_path: Path) -> None:
    stated = "<phong>{}<transparency><float>{}</float></transparency></phong>"
    effect = '<effect id="o"><profile_COMMON><technique>{}</technique></profile_COMMON></effect>'
    other = f"<library_effects>{effect}</library_effects>"
    shader = stated.format(KD, 0.2)
    for opacity, expected in ((0.0, 0.2), (0.5, 0.8)):
        text = looked(f"<technique>{shader}</technique>", extra=other.format(stated.format("", opacity)))
        (mesh,) = read(tmp_path, text).meshes
        np.testing.assert_allclose(mesh.material.transmission, [expected] * 3)
    hidden = looked(f"<technique><lambert>{KD}</lambert></technique>", extra=other.format(stated.format("", 0)))
    assert read(tmp_path, hidden).meshes[0].material.transmission == NONE


@pytest.mark.parametrize("path", ["wood%20grain.png", "file:///C:/Textures/WOOD GRAIN.png", "..\\x\\wood grain.PNG"])
def test_textures_by_way_of_sampler_and_surface(tmp_path: Path, path: str) -> None:
    (tmp_path / "wood grain.png").write_bytes(png((10, 20, 30)))
    images = f'<library_images><image id="i"><init_from>{path}</init_from></image></library_images>'
    params = (
        '<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>'
        '<newparam sid="p"><sampler2D><source>f</source></sampler2D></newparam>'
    )
    diffuse = '<diffuse><texture texture="p" texcoord="UV1"/></diffuse>'
    sources = DAE_SQUARE + dae_source("t0", (0, 0), 2) + dae_source("t1", (0.5, 0.25), 2)
    primitive = (
        f'<triangles material="look">{VERTEX}<input semantic="TEXCOORD" source="#t0" offset="1" set="0"/>'
        '<input semantic="TEXCOORD" source="#t1" offset="1" set="1"/><p>0 0 1 0 2 0</p></triangles>'
    )
    bind = '<bind_vertex_input semantic="UV1" input_semantic="TEXCOORD" input_set="1"/>'
    specular = '<specular><texture texture="i" texcoord="UV1"/></specular>'
    text = looked(f"{params}<technique><phong>{diffuse}{specular}</phong></technique>", bind, images)
    text = text.replace(DAE_TRIANGLES, primitive).replace(DAE_SQUARE, sources)
    model = read(tmp_path, text)
    (mesh,) = model.meshes
    assert mesh.material.diffuse_texture is not None
    np.testing.assert_array_equal(mesh.material.diffuse_texture.pixels, [[[10, 20, 30]]])
    assert mesh.material.diffuse == (1.0, 1.0, 1.0)
    assert mesh.material.specular_texture is not None
    np.testing.assert_allclose(mesh.material.specular, 1 / math.pi)
    np.testing.assert_array_equal(mesh.uvs, [[0.5, 0.25]] * 3)
    assert model.notes == ()


@pytest.mark.parametrize("image", ["", '<image id="i"><init_from>../none.png</init_from></image>', '<image id="i"/>'])
def test_a_missing_texture_is_left_out_with_a_note(tmp_path: Path, image: str) -> None:
    diffuse = '<diffuse><texture texture="i" texcoord="UV"/></diffuse>'
    extra = f"<library_images>{image}</library_images>"
    model = read(tmp_path, looked(f"<technique><lambert>{diffuse}</lambert></technique>", extra=extra))
    assert model.meshes[0].material.diffuse_texture is None
    assert model.meshes[0].material.diffuse == (0.8, 0.8, 0.8)
    assert len(model.notes) == 1
    assert model.notes[0].startswith("texture left out: ")


def lamp(light: str, transform: str = "") -> tuple[str, str]:
    """A library with one light, and a node that shows it."""
    library = f'<library_lights><light id="l"><technique_common>{light}</technique_common></light></library_lights>'
    return library, f'<node>{transform}<instance_light url="#l"/></node><node><instance_geometry url="#g"/></node>'


def test_lights(tmp_path: Path) -> None:
    point = (
        "<point><color>1 0.5 0</color><constant_attenuation>2</constant_attenuation>"
        "<linear_attenuation>3</linear_attenuation><quadratic_attenuation>4</quadratic_attenuation></point>"
    )
    library, nodes = lamp(point, "<translate>2 4 6</translate>")
    (light,) = read(tmp_path, dae(libraries=library, nodes=nodes, asset='<unit meter="0.5"/>')).lights
    assert light.position == (1.0, 2.0, 3.0)
    np.testing.assert_allclose(light.irradiance, (math.pi, math.pi / 2, 0))
    assert light.falloff == (2.0, 6.0, 16.0)
    library, nodes = lamp("<directional><color>1 1 1</color></directional>", "<rotate>1 0 0 -90</rotate>")
    (light,) = read(tmp_path, dae(libraries=library, nodes=nodes)).lights
    assert light.direction is not None
    np.testing.assert_allclose(light.direction, (0, -1, 0), atol=1e-12)
    library, nodes = lamp("<spot><color>1 1 1</color><falloff_angle>30</falloff_angle></spot>")
    model = read(tmp_path, dae(libraries=library, nodes=nodes))
    assert model.lights[0].falloff == (1.0, 0.0, 0.0)
    assert model.notes == ("a spot light is shown as one that lights to all sides",)
    library, nodes = lamp("<ambient><color>0.1 0.2 0.3</color></ambient>")
    model = read(tmp_path, dae(libraries=library, nodes=nodes))
    assert (model.lights, model.ambient) == ((), (0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    ("optics", "vertical_deg"),
    [
        ("<yfov>30</yfov>", 30.0),
        ("<xfov>60</xfov><yfov>30</yfov><aspect_ratio>1</aspect_ratio>", 30.0),
        ("<xfov>90</xfov><aspect_ratio>2</aspect_ratio>", 2 * math.degrees(math.atan(0.5))),
        ("<xfov>90</xfov>", 2 * math.degrees(math.atan(0.75))),
    ],
)
def test_cameras(tmp_path: Path, optics: str, vertical_deg: float) -> None:
    library = (
        '<library_cameras><camera id="o"><optics><technique_common><orthographic/></technique_common></optics></camera>'
        f'<camera id="c"><optics><technique_common><perspective>{optics}</perspective></technique_common></optics>'
        "</camera></library_cameras>"
    )
    nodes = (
        '<node><instance_geometry url="#g"/><instance_camera url="#o"/></node>'
        '<node><lookat>0 0 5  5 0 5  0 1 0</lookat><instance_camera url="#c"/></node>'
    )
    model = read(tmp_path, dae(libraries=library, nodes=nodes))
    assert model.camera is not None
    assert model.camera.vertical_fov_deg == pytest.approx(vertical_deg)
    assert model.camera.position == (0.0, 0.0, 5.0)
    np.testing.assert_allclose(model.camera.look_at, (5, 0, 5), atol=1e-12)
    assert model.notes == ("an orthographic camera is left out",)


def test_what_refers_to_nothing_is_left_out_with_a_note(tmp_path: Path) -> None:
    nodes = '<node><instance_light url="#none"/><instance_camera url=""/><instance_geometry url="#g"/></node>'
    model = read(tmp_path, dae(nodes=nodes))
    assert len(model.meshes) == 1
    assert len(model.notes) == 2
    assert "line 9: instance_light: expected a reference to an element of this file, found '#none'" in model.notes[0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<p>0 1 2", "<p>0 1 9", "line 6: triangles: expected POSITION indices from 0 to 3, found 9"),
        ("<p>0 1 2", "<p>0 1 -1", "line 6: triangles: expected POSITION indices from 0 to 3, found -1"),
        ("<p>0 1 2", "<p>0 1", "line 6: triangles: expected corners in threes, found 5"),
        ("<p>0 1 2", "<p>0 1 x", "line 6: p: expected whole numbers, found invalid literal"),
        ("<p>0 1 2", f"<p>0 1 {2**80}", "line 6: p: expected whole numbers, found"),
        ('offset="0"', 'offset="3"', "line 6: p: expected a multiple of 4 indices, found 6"),
        ('offset="0"', 'offset="99999"', "line 6: input: expected an offset up to 64, found 99999"),
        ('offset="0"', 'offset="-1"', "line 6: input: expected a whole number in offset, found -1"),
        ('semantic="VERTEX"', 'semantic="WERTEX"', "line 6: triangles: expected an input VERTEX, found WERTEX"),
        ('semantic="POSITION"', 'semantic="NORMAL"', "line 5: vertices: expected an input POSITION, found none"),
        ('source="#corners"', 'source="#corner"', "line 6: input: expected a reference to an element of this file"),
        (
            'count="4" stride="3"',
            'count="5" stride="3"',
            "line 5: accessor: expected at most 12 numbers",
        ),
        ('stride="3"', 'stride="0"', "line 5: accessor: expected a stride from 1 to 64, found 0"),
        ("<technique_common>", "<technique>", "expected XML, found damage: mismatched tag: line 5"),
        ("0 0 0 1 0 0", "0 zero 0 1 0 0", "line 5: float_array: expected numbers, found could not convert string"),
        ("0 0 0 1 0 0", "0 nan 0 1 0 0", "'square': vertex 0: expected finite coordinates up to"),
        ("<node>", "<node><matrix>1 2</matrix>", "line 9: matrix: expected 16 finite numbers up to 1e+12, found 1 2"),
        (
            "<node>",
            "<node><scale>1e9 1 1</scale><scale>1e9 1 1</scale>",
            "line 9: scale: expected a transform up to",
        ),
        ("<up_axis>", '<unit meter="0"/><up_axis>', "line 2: unit: expected a length in metres above 0, found 0"),
        ("<COLLADA ", "<X3D ", "expected XML, found damage: mismatched tag"),
        ("</COLLADA>", "", "expected XML, found damage: no element found"),
        ("<node>", '<node id="n"><instance_node url="#n"/>', "line 9: node: expected at most 100000 nodes, nested"),
    ],
)
def test_mistakes_are_told_with_their_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = dae()
    assert old in text
    found = refused(tmp_path, "a.dae", text.replace(old, new, 1))
    assert message in found
    assert found.startswith("a.dae: ")


def test_another_kind_of_xml_file_is_refused(tmp_path: Path) -> None:
    assert refused(tmp_path, "a.dae", "<svg/>") == "a.dae: line 1: svg: expected a COLLADA file, found an element svg"


@pytest.mark.parametrize(
    "declaration",
    [
        '<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">',
        '<!ENTITY a SYSTEM "file:///etc/passwd">',
        '<!ENTITY % a SYSTEM "http://127.0.0.1:9/a.dtd"> %a;',
    ],
)
def test_entities_are_refused(tmp_path: Path, declaration: str) -> None:
    text = dae().replace("<COLLADA", f"<!DOCTYPE COLLADA [{declaration}]><COLLADA", 1)
    assert "expected a file without entities, found 'a'" in refused(tmp_path, "a.dae", text)


def test_a_document_type_alone_opens_nothing(tmp_path: Path) -> None:
    text = dae().replace("<COLLADA", '<!DOCTYPE COLLADA SYSTEM "file:///none/a.dtd"><COLLADA', 1)
    assert len(read(tmp_path, text).meshes) == 1


def test_nesting_without_end_and_nodes_that_double_are_refused(tmp_path: Path) -> None:
    deep = "<node>" * 50_000
    assert "nested at most 256 deep" in refused(tmp_path, "a.dae", dae(nodes=deep))
    twice = "<instance_node url='#n{}'/>" * 2
    doubling = "".join(f'<node id="n{i}">{twice.format(i + 1, i + 1)}</node>' for i in range(40))
    library = f'<library_nodes>{doubling}<node id="n40"/></library_nodes>'
    text = dae(nodes='<instance_node url="#n0"/>', libraries=library)
    assert "expected at most 100000 nodes" in refused(tmp_path, "a.dae", text)


def test_triangles_count_each_time_they_are_shown(tmp_path: Path) -> None:
    nodes = '<node><instance_geometry url="#g"/></node>' * 3
    assert len(load(tmp_path, "a.dae", dae(nodes=nodes), max_triangles=6)) == 3
    assert "expected at most 5 triangles in all" in refused(tmp_path, "a.dae", dae(nodes=nodes), max_triangles=5)
