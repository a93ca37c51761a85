"""glTF files: geometry, nodes, materials, textures, and mistakes told with their field."""

from __future__ import annotations

import base64
import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from renderer.framing import DEFAULT_MATERIAL
from renderer.mesh_file import load_model
from renderer.scene import Material, Mesh
from tests.renderer.model_files import KD, NONE, glb, gltf, load, png, refused, volume


def load_gltf(folder: Path, **changes: object) -> tuple[Mesh, ...]:
    return load(folder, "a.gltf", json.dumps(gltf(**changes)))


def gltf_material(folder: Path, **fields: object) -> Material:
    (mesh,) = load_gltf(folder, materials=[fields])
    return mesh.material


def test_gltf_text_and_binary_are_the_same(tmp_path: Path) -> None:
    (text,) = load_gltf(tmp_path)
    (binary,) = load(tmp_path, "a.glb", glb(gltf()))
    for mesh in (text, binary):
        np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
        np.testing.assert_array_equal(mesh.faces, [[0, 1, 2]])
        np.testing.assert_allclose(mesh.normals, [[math.sqrt(0.5), math.sqrt(0.5), 0]] * 3, atol=1e-7)
        np.testing.assert_array_equal(mesh.uvs, [[0, 1], [1, 1], [0, 0]])
        assert mesh.material.name == "m"


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -1, 1], [1, 1, -1], [-2, -3, -0.5]])
def test_gltf_mirrored_node_still_faces_outwards(tmp_path: Path, scale: list[float]) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    scene = trimesh.Scene()
    scene.add_geometry(ball, transform=np.diag([*scale, 1.0]))
    (mesh,) = load(tmp_path, "a.glb", scene.export(file_type="glb", include_normals=True))
    assert volume(mesh) == pytest.approx(ball.volume * abs(np.prod(scale)), rel=1e-5)
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    own = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", own, mesh.normals[mesh.faces[:, 0]]) > 0).all()


def test_gltf_nodes_multiply_from_the_root_down(tmp_path: Path) -> None:
    half = math.sqrt(0.5)
    nodes = [
        {"children": [1, 2], "translation": [10, 0, 0]},
        {"mesh": 0, "rotation": [0, 0, half, half]},
        {"mesh": 0, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 5, 0, 1]},
    ]
    turned, scaled = load_gltf(tmp_path, nodes=nodes)
    np.testing.assert_allclose(turned.vertices, [[10, 0, 0], [10, 1, 0], [9, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(scaled.vertices, [[10, 5, 0], [12, 5, 0], [10, 7, 0]], atol=1e-12)


def test_gltf_agrees_with_another_reader(tmp_path: Path) -> None:
    generator = np.random.default_rng(4)
    scene = trimesh.Scene()
    for index in range(4):
        transform = trimesh.transformations.random_rotation_matrix(num=1, rand=generator.random(3))
        transform = np.asarray(transform).reshape(4, 4) @ np.diag([*generator.uniform(-2, 2, 3), 1.0])
        transform[:3, 3] = generator.uniform(-5, 5, 3)
        scene.add_geometry(trimesh.creation.box(), node_name=f"n{index}", transform=transform)
    data = scene.export(file_type="glb")
    meshes = load(tmp_path, "a.glb", data)
    theirs = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False).dump()
    assert len(meshes) == len(theirs) == 4
    middles = sorted(mesh.vertices[mesh.faces].mean(axis=(0, 1)).round(4).tolist() for mesh in meshes)
    np.testing.assert_allclose(
        middles, sorted(m.triangles.mean(axis=(0, 1)).round(4).tolist() for m in theirs), atol=1e-3
    )
    assert all(volume(mesh) > 0 for mesh in meshes)


def test_gltf_sparse_strided_strips_and_fans(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype="<f4")
    interleaved = np.zeros((4, 5), dtype="<f4")
    interleaved[:, :3] = points
    blob = interleaved.tobytes() + bytes([3, 0, 0, 0]) + np.array([[1, 1, 9]], dtype="<f4").tobytes()
    tree = gltf(
        buffers=[{"byteLength": len(blob), "uri": "data:;base64," + base64.b64encode(blob).decode()}],
        bufferViews=[
            {"buffer": 0, "byteLength": 80, "byteStride": 20},
            {"buffer": 0, "byteOffset": 80, "byteLength": 4},
            {"buffer": 0, "byteOffset": 84, "byteLength": 12},
        ],
        accessors=[
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "sparse": {
                    "count": 1,
                    "indices": {"bufferView": 1, "componentType": 5121},
                    "values": {"bufferView": 2},
                },
            }
        ],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (0, 1, 5, 6)]}],
    )
    strip, fan = load(tmp_path, "a.gltf", json.dumps(tree))
    np.testing.assert_array_equal(strip.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 9]])
    np.testing.assert_array_equal(strip.faces, [[0, 1, 2], [2, 1, 3]])
    np.testing.assert_array_equal(fan.faces, [[0, 1, 2], [0, 2, 3]])
    assert strip.material is DEFAULT_MATERIAL


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        (
            {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1], "metallicFactor": 0}},
            {"diffuse": KD, "reflection": NONE, "shininess": 0.0, "transmission": NONE},
        ),
        (
            {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1], "roughnessFactor": 0}},
            {"diffuse": NONE, "reflection": KD, "shininess": 2e4 - 2},
        ),
        (
            {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1], "roughnessFactor": 0.5}},
            {"diffuse": (0.15, 0.3, 0.45), "reflection": (0.05, 0.1, 0.15), "shininess": 30.0},
        ),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [1, 0.5, 0],
             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}},
            {"emission": (4.0, 2.0, 0.0)},
        ),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.5, 1, 1, 1]},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                            "KHR_materials_volume": {"thicknessFactor": 1}, "KHR_materials_ior": {"ior": 1.33}}},
            {"transmission": (0.5, 1.0, 1.0), "ior": 1.33, "diffuse": (0.25, 0.0, 0.0)},
        ),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}},
            {"transmission": (0.5, 0.5, 0.5), "ior": 1.0},
        ),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [1, 1, 1, 0.25]}, "alphaMode": "BLEND"},
            {"transmission": (0.75, 0.75, 0.75), "ior": 1.0, "diffuse": (0.25, 0.25, 0.25)},
        ),
        (
            {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1]},
             "extensions": {"KHR_materials_unlit": {}}},
            {"emission": KD, "diffuse": NONE},
        ),
    ],
)  # fmt: skip
def test_gltf_materials(tmp_path: Path, fields: dict[str, Any], expected: dict[str, Any]) -> None:
    found = gltf_material(tmp_path, **fields)
    for name, value in expected.items():
        np.testing.assert_allclose(getattr(found, name), value, atol=1e-9, err_msg=name)


def test_gltf_highlight_of_a_rough_dielectric_sends_back_its_share(tmp_path: Path) -> None:
    found = gltf_material(tmp_path, pbrMetallicRoughness={"metallicFactor": 0, "roughnessFactor": 0.3})
    angle = np.linspace(0, math.pi / 2, 200_001)
    lobe = 2 * math.pi * np.trapezoid(np.cos(angle) ** found.shininess * np.sin(angle), angle)
    np.testing.assert_allclose(np.array(found.specular) * lobe, 0.04, rtol=1e-4)


def test_gltf_samplers_say_how_a_texture_goes_on(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png((255, 255, 255), (0, 0, 0)))
    found = []
    for sampler in ({}, {"wrapS": 33071, "wrapT": 33648}, {"wrapS": 10497, "wrapT": 33071}):
        (mesh,) = load_gltf(
            tmp_path,
            images=[{"uri": "a.png"}],
            samplers=[sampler],
            textures=[{"source": 0, "sampler": 0}],
            materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        )
        assert mesh.material.diffuse_texture is not None
        found.append((mesh.material.diffuse_texture.wrap_u, mesh.material.diffuse_texture.wrap_v))
    assert found == [("repeat", "repeat"), ("clamp", "mirror"), ("repeat", "clamp")]


@pytest.mark.parametrize(
    ("stated", "cutoff"),
    [
        ({"alphaMode": "MASK"}, 0.5),
        ({"alphaMode": "MASK", "alphaCutoff": 0.2}, 0.4),
        ({"alphaMode": "BLEND"}, 0.5),
        ({}, None),
    ],
)
def test_gltf_alpha_cuts_holes(tmp_path: Path, stated: dict[str, object], cutoff: float | None) -> None:
    """The cutoff is meant for the texture's alpha times the factor's."""
    Image.fromarray(np.uint8([[[9, 9, 9, 0], [9, 9, 9, 255]]])).save(tmp_path / "leaf.png")
    factor = 0.5 if "alphaCutoff" in stated else 1.0
    pbr = {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 1, 1, factor]}
    (mesh,) = load_gltf(
        tmp_path,
        images=[{"uri": "leaf.png"}],
        textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": pbr, **stated}],
    )
    if cutoff is None:
        assert mesh.material.alpha_texture is None
    else:
        assert mesh.material.alpha_texture is mesh.material.diffuse_texture
        assert mesh.material.alpha_cutoff == pytest.approx(cutoff)


def test_gltf_textures_from_files_and_buffers(tmp_path: Path) -> None:
    picture = png((255, 255, 255), (0, 0, 0))
    (tmp_path / "wood grain.png").write_bytes(picture)
    encoded = "data:image/png;base64," + base64.b64encode(picture).decode()
    for uri in ("wood%20grain.png", "./wood grain.png", encoded):
        (mesh,) = load_gltf(
            tmp_path,
            images=[{"uri": uri}],
            textures=[{"source": 0}],
            materials=[
                {
                    "pbrMetallicRoughness": {
                        "baseColorTexture": {
                            "index": 0,
                            "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 3]}},
                        },
                        "roughnessFactor": 0,
                    }
                }
            ],
        )
        assert mesh.material.diffuse_texture is not None
        np.testing.assert_array_equal(mesh.material.diffuse_texture.pixels, [[[255] * 3, [0] * 3]])
        np.testing.assert_allclose(mesh.material.reflection, (0.5, 0.5, 0.5))
        np.testing.assert_allclose(mesh.uvs, [[0.5, 1], [2.5, 1], [0.5, -2]])


def bumpy_gltf(stated: dict[str, Any], colours: dict[str, Any] | None = None, **nodes: object) -> dict[str, object]:
    """A file whose material has a normal map, and whose triangle has TANGENT: along y, w = -1."""
    tangents = np.array([[0, 1, 0, -1]] * 3, "<f4").tobytes()
    document = gltf()
    document["buffers"].append(
        {"byteLength": len(tangents), "uri": "data:;base64," + base64.b64encode(tangents).decode()}
    )
    document["bufferViews"].append({"buffer": len(document["buffers"]) - 1, "byteLength": len(tangents)})
    document["accessors"].append(
        {"bufferView": len(document["bufferViews"]) - 1, "componentType": 5126, "count": 3, "type": "VEC4"}
    )
    document["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = len(document["accessors"]) - 1
    document["images"] = [{"uri": "a.png"}]
    document["textures"] = [{"source": 0}]
    pbr = {"baseColorTexture": {"index": 0, **colours}} if colours is not None else {}
    document["materials"] = [{"name": "m", "normalTexture": {"index": 0, **stated}, "pbrMetallicRoughness": pbr}]
    document["nodes"] = [{"mesh": 0, **nodes}]
    return dict(document)


def test_gltf_normal_maps_with_tangents(tmp_path: Path) -> None:
    """A mirrored node turns the tangents with the surface, and their handedness round."""
    (tmp_path / "a.png").write_bytes(png((200, 100, 250)))
    for name, document, tangent in (
        ("plain", bumpy_gltf({"scale": 0.5}), [0, 1, 0, -1]),
        ("coloured", bumpy_gltf({"scale": 0.5}, {}), [0, 1, 0, -1]),
        ("mirrored", bumpy_gltf({"scale": 0.5}, scale=[1, -2, 1]), [0, -2, 0, 1]),
    ):
        (mesh,) = load(tmp_path, f"{name}.gltf", json.dumps(document))
        assert mesh.material.normal_texture is not None
        np.testing.assert_array_equal(mesh.material.normal_texture.pixels, [[[200, 100, 250]]])
        assert mesh.material.normal_scale == 0.5
        np.testing.assert_array_equal(mesh.tangents, [tangent] * 3)


def test_gltf_normal_maps_laid_on_in_their_own_way(tmp_path: Path) -> None:
    """Alone, they take their transform along, and tangents from the coordinates; beside other colours they are
    left out with a note."""
    (tmp_path / "a.png").write_bytes(png((200, 100, 250)))
    turned = {"extensions": {"KHR_texture_transform": {"scale": [2, 3]}}}
    for colours in (None, turned):
        (mesh,) = load(tmp_path, "a.gltf", json.dumps(bumpy_gltf(turned, colours)))
        assert mesh.material.normal_texture is not None
        assert mesh.tangents is None
        np.testing.assert_allclose(mesh.uvs, [[0, 1], [2, 1], [0, -2]])
    (tmp_path / "b.gltf").write_text(json.dumps(bumpy_gltf(turned, {})))
    model = load_model(tmp_path / "b.gltf")
    assert model.meshes[0].material.normal_texture is None
    assert model.notes == ("material 'm': a normal map that is laid on otherwise than the colours is left out",)
    message = refused(tmp_path, "c.gltf", json.dumps(bumpy_gltf({"scale": 1e9})))
    assert message.startswith("c.gltf: materials[0].normalTexture.scale: expected a number in [-1000, 1000]")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"asset": {"version": "1.0"}}, "a.gltf: asset.version: expected 2.0, found '1.0'"),
        ({"asset": {}}, "a.gltf: asset.version: expected text, found nothing"),
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "a.gltf: extensionsRequired: expected extensions"),
        ({"nodes": []}, "a.gltf: nodes: expected at least 1 entries, found 0"),
        ({"nodes": [{"mesh": 7}]}, "a.gltf: meshes: expected at least 8 entries, found 1"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "a.gltf: nodes[0]: expected one parent, found more or a circle"),
        ({"nodes": [{"mesh": 0, "children": ["x"]}]}, "a.gltf: nodes[0].children: expected indices from 0"),
        ({"nodes": [{"mesh": 0, "scale": [1, 1]}]}, "a.gltf: nodes[0].scale: expected 3 numbers, found [1, 1]"),
        ({"nodes": [{"mesh": 0, "scale": [1, 1e99, 1]}]}, "a.gltf: nodes[0].scale[1]: expected a number"),
        ({"nodes": [{"mesh": 0, "rotation": [0, 0, 0, 0]}]}, "a.gltf: nodes[0].rotation: expected a quaternion"),
        ({"nodes": [{}]}, "a.gltf: expected 1 to 20000000 triangles, found 0"),
        ({"bufferViews": []}, "a.gltf: bufferViews: expected at least 1 entries, found 0"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 9999}]}, "a.gltf: bufferViews[0].byteLength: expected at most"),
        ({"buffers": [{"byteLength": 4}]}, "a.gltf: buffers[0].uri: expected a file or data"),
        ({"buffers": [{"uri": "none.bin"}]}, "a.gltf: buffers[0].uri: expected an existing file"),
        ({"buffers": [{"uri": "../../etc/passwd"}]}, "a.gltf: buffers[0].uri: expected a file inside the folder"),
        ({"buffers": [{"uri": "%2e%2e/x.bin"}]}, "a.gltf: buffers[0].uri: expected a file inside the folder"),
        ({"buffers": [{"uri": "data:;base64,???"}]}, "a.gltf: buffers[0].uri: expected base64 data"),
        ({"materials": []}, "a.gltf: materials: expected at least 1 entries, found 0"),
        ({"materials": [{"emissiveFactor": [2, 0, 0]}]}, "a.gltf: materials[0].emissiveFactor[0]: expected a number"),
        ({"accessors": [{"bufferView": 0, "componentType": 1, "count": 3, "type": "VEC3"}]}, "a.gltf: accessors[0].co"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}]}, "a.gltf: accessors[0]"),
        ({"accessors": "none"}, "a.gltf: accessors: expected a list, found 'none'"),
    ],
)
def test_gltf_mistakes_are_told_with_their_field(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    assert refused(tmp_path, "a.gltf", json.dumps(gltf(**changes))).startswith(message)


def test_gltf_indices_out_of_range_and_uneven(tmp_path: Path) -> None:
    tree = gltf()
    tree["accessors"][3]["count"] = 2
    assert "indices: expected a multiple of 3" in refused(tmp_path, "a.gltf", json.dumps(tree))
    tree = gltf()
    tree["accessors"][3]["bufferView"] = 2
    assert "expected vertex indices from 0 to 2, found [0, 0, 65535]" in refused(tmp_path, "a.gltf", json.dumps(tree))
    tree = gltf()
    tree["accessors"][3] = tree["accessors"][0] | {"type": "SCALAR"}
    assert "expected unsigned integers" in refused(tmp_path, "a.gltf", json.dumps(tree))


def test_gltf_that_is_not_json_or_nested_without_end(tmp_path: Path) -> None:
    assert refused(tmp_path, "a.gltf", b"{").startswith("a.gltf: expected JSON, found damage")
    assert refused(tmp_path, "a.gltf", b"[" * 100_000).startswith("a.gltf: expected JSON, found damage")
    assert refused(tmp_path, "a.gltf", b"[1]").startswith("a.gltf: top level: expected a table of fields, found [1]")
    assert "expected a JSON chunk" in refused(tmp_path, "a.glb", b"glTF\2\0\0\0\x0c\0\0\0")


def test_gltf_mesh_shown_many_times_counts_each_time(tmp_path: Path) -> None:
    nodes = [{"mesh": 0} for _ in range(5)]
    tree = json.dumps(gltf(nodes=nodes, scenes=[{"nodes": [0, 1, 2, 3, 4]}]))
    assert len(load(tmp_path, "a.gltf", tree, max_triangles=5)) == 5
    assert "expected at most 4 triangles" in refused(tmp_path, "a.gltf", tree, max_triangles=4)


def test_gltf_lights_and_camera_stand_where_their_nodes_are(tmp_path: Path) -> None:
    half = math.sqrt(0.5)
    lights = [
        {"type": "point", "color": [1, 0.5, 0], "intensity": 683.0},
        {"type": "directional", "intensity": 1366.0},
        {"type": "spot", "spot": {}},
    ]
    tree = gltf(
        extensionsUsed=["KHR_lights_punctual"],
        extensionsRequired=["KHR_lights_punctual"],
        extensions={"KHR_lights_punctual": {"lights": lights}},
        cameras=[{"type": "orthographic"}, {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
        nodes=[
            {"mesh": 0, "translation": [10, 0, 0], "children": [1, 2, 3]},
            {"translation": [0, 5, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}, "camera": 0},
            {"rotation": [-half, 0, 0, half], "extensions": {"KHR_lights_punctual": {"light": 1}}, "camera": 1},
            {"extensions": {"KHR_lights_punctual": {"light": 2}}},
        ],
    )
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    model = load_model(tmp_path / "a.gltf")
    point, sun, spot = model.lights
    assert (point.position, point.irradiance, point.falloff) == ((10, 5, 0), (1.0, 0.5, 0.0), (0.0, 0.0, 1.0))
    assert sun.direction is not None
    np.testing.assert_allclose(sun.direction, (0, -1, 0), atol=1e-12)
    assert sun.irradiance == (2.0, 2.0, 2.0)
    assert spot.position == (10, 0, 0)
    assert model.camera is not None
    assert model.camera.position == (10, 0, 0)
    np.testing.assert_allclose(np.array(model.camera.look_at) - (10, 0, 0), (0, -10, 0), atol=1e-12)
    assert model.camera.vertical_fov_deg == pytest.approx(math.degrees(0.5))
    assert model.notes == ("nodes[1]: an orthographic camera is left out",)


@pytest.mark.parametrize(
    ("light", "message"),
    [
        ({"type": "point", "intensity": -1}, "extensions.KHR_lights_punctual.lights[0].intensity: expected a number"),
        ({"type": "area"}, "extensions.KHR_lights_punctual.lights[0].type: expected one of point, spot, directional"),
        (None, "extensions.KHR_lights_punctual.lights: expected at least 1 entries, found 0"),
    ],
)
def test_gltf_mistakes_in_lights(tmp_path: Path, light: dict[str, object] | None, message: str) -> None:
    tree = gltf(
        extensions={"KHR_lights_punctual": {"lights": [] if light is None else [light]}},
        nodes=[{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}],
    )
    assert refused(tmp_path, "a.gltf", json.dumps(tree)).startswith(f"a.gltf: {message}")
