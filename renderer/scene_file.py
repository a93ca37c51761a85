"""Scenes in a folder: scene.toml beside the mesh and texture files that it names.

A worked example, `vase/scene.toml`; every field is optional but those of a mesh, sphere, light
or keyframe without "or" behind them:

```toml
title = "A vase on a table"
exposure = 1.0                     # factor from radiance to the display's 0..1

[camera]                           # left out: the first of the path below, or one that frames the whole scene
position = [0.0, 1.5, 2.0]         # metres, y up
look_at = [0.0, 0.9, 0.0]
up = [0.0, 1.0, 0.0]               # or this default
vertical_fov_deg = 40.0            # or 40

[[camera_path]]                    # any number: views that the camera of a clip passes through, in order of time
time_s = 0.0                       # since the clip began
position = [0.0, 1.5, 2.0]
look_at = [0.0, 0.9, 0.0]
up = [0.0, 1.0, 0.0]               # or this default
vertical_fov_deg = 40.0            # or 40

[surroundings]                     # left out: a pale studio; given: black but for what it says
zenith = [0.3, 0.4, 0.6]           # radiance straight up
horizon = [0.8, 0.8, 0.8]
ambient = [0.1, 0.1, 0.1]          # light from everywhere

[materials.gold]                   # the fields of renderer.scene.Material
diffuse = [0.35, 0.25, 0.08]
specular = [2.0, 1.6, 0.8]
shininess = 120.0
reflection = [0.5, 0.4, 0.2]

[materials.brushed_steel]
base = "ashikhmin-shirley"         # or phong
diffuse = [0.05, 0.05, 0.05]
specular = [0.9, 0.9, 0.92]
exponent_u = 800.0                 # or 100: along the grain, which follows the texture coordinate u
exponent_v = 20.0                  # or 100: across it; a small exponent is a long highlight

[materials.wood]
diffuse = [1.0, 1.0, 1.0]          # or 1 under a texture
diffuse_texture = "wood.png"
specular = [0.5, 0.5, 0.5]
specular_texture = { file = "worn.png", wrap_u = "mirror", wrap_v = "clamp" }  # or repeat
alpha_texture = "wood.png"         # holes where its alpha (without alpha: its green) is below alpha_cutoff
alpha_cutoff = 0.5                 # or 0.5
normal_texture = "bumps.png"       # bends normals: red along u, green along v (up), blue outwards; not sRGB
normal_scale = 1.0                 # or 1: how deep its bumps are

[materials.glass]
diffuse = [0.0, 0.0, 0.0]
transmission = [1.0, 1.0, 1.0]
ior = 1.5
priority = 1                       # or none: where solids overlap, the highest counts

[[mesh]]
file = "vase.obj"                  # OBJ, GLB, glTF, PLY, STL, COLLADA or 3DS
material = "gold"                  # or the file's own; { Lid = "wood" } replaces only its material Lid
use_camera = false                 # or false; true: the scene is seen by the file's camera, in place of [camera]
use_lights = false                 # or false; true: the file's lights, beside those of [[light]]
scale = 0.01                       # or 1; [1, 2, 1] scales unequally, a negative factor mirrors
rotate_deg = [0.0, 30.0, 0.0]      # or 0: about x, then y, then z, after scaling
translate = [0.0, 0.8, 0.0]        # or 0, after rotating
casts_shadows = true               # or true

[[sphere]]
center = [0.5, 0.9, 0.2]
radius = 0.1
material = "glass"                 # or clay
casts_shadows = true

[[light]]                          # none: framed lights; light = [] leaves the scene to its surroundings
kind = "point"
position = [2.0, 3.0, 2.0]
intensity = [40.0, 40.0, 40.0]     # W/sr, inverse-square falloff
casts_shadows = true

[[light]]
kind = "rectangle"
corner = [-0.5, 2.5, -0.5]
edge_u = [1.0, 0.0, 0.0]           # the two edges from there, at right angles;
edge_v = [0.0, 0.0, 1.0]           # the side around which they run counter-clockwise shines
radiance = [9.0, 9.0, 9.0]         # W/(sr m^2)
two_sided = false                  # or false

[[light]]
kind = "sphere"
center = [-1.0, 1.5, 0.5]
radius = 0.1
radiance = [20.0, 18.0, 15.0]
```

Files are named from the folder on, and must lie inside it.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import MAX_POSITION_M, Camera
from renderer.camera_path import read_camera_path
from renderer.codec import MAX_TEXTURE_PIXELS, decode_texture
from renderer.errors import SettingsError
from renderer.fields import Fields
from renderer.folder import MAX_FILE_BYTES, Folder
from renderer.framing import DEFAULT_MATERIAL, STUDIO, bounding_sphere, framed_camera, framed_lights
from renderer.mesh_file import MAX_TRIANGLES, read_model
from renderer.model import Model, point_lights
from renderer.placement import placed, placed_camera, placed_light
from renderer.scene import (
    BASES,
    BLACK,
    MAX_COORDINATE_M,
    MAX_NORMAL_SCALE,
    MAX_PRIORITY,
    MAX_RADIANCE,
    MAX_SHININESS,
    WRAPS,
    Light,
    Material,
    Mesh,
    PointLight,
    RectangleError,
    RectangleLight,
    Rgb,
    Scene,
    Sphere,
    SphereLight,
    Surroundings,
    Texture,
)
from renderer.toml_text import read_toml

SCENE_FILE: Final = "scene.toml"
"""Name of the file that makes a folder a scene."""

MAX_INTENSITY: Final = 1e24
"""Largest intensity of a light [W/sr]."""

_DEFAULTS: Final = Material()


def load_scene_folder(
    folder: Path,
    *,
    label: str | None = None,
    max_bytes: int = MAX_FILE_BYTES,
    max_triangles: int = MAX_TRIANGLES,
    max_texture_pixels: int = MAX_TEXTURE_PIXELS,
) -> Scene:
    """The scene that `folder`/scene.toml describes.

    Args:
        folder: nothing outside it is opened.
        label: what messages call it; its path unless given.
        max_bytes: refuse larger files, each.
        max_triangles: refuse more triangles, of all meshes together.
        max_texture_pixels: refuse images of more pixels, each.

    Raises:
        SceneError: "folder/scene.toml: field: expected ..., found ...", or the same of a file it names.
    """
    tree = Folder(folder.resolve(), str(folder) if label is None else label, max_bytes, max_texture_pixels)
    file = tree.file_label(SCENE_FILE)
    data, _ = tree.read(SCENE_FILE, file)
    return _Reader(tree, max_triangles).scene(Fields(read_toml(data, file), file))


@dataclass(slots=True)
class _Reader:
    """The state of reading one scene; each texture and each mesh file is read once."""

    folder: Folder
    max_triangles: int
    materials: dict[str, Material] = field(default_factory=dict)
    textures: dict[tuple[str, str, str], Texture] = field(default_factory=dict)
    files: dict[str, Model] = field(default_factory=dict)
    triangles: int = 0
    cameras: list[Camera] = field(default_factory=list)
    lights: list[PointLight] = field(default_factory=list)
    ambient: Rgb = BLACK

    def scene(self, top: Fields) -> Scene:
        """The scene of the file's top level."""
        title = top.text("title", "")
        exposure = top.number("exposure", 0.0, MAX_RADIANCE, 1.0, open_low=True)
        materials = top.table("materials")
        for name in materials.names():
            self.materials[name] = self._material(materials.table(name), name)
        meshes = [mesh for fields in top.tables("mesh") for mesh in self._meshes(fields)]
        spheres = [self._sphere(fields) for fields in top.tables("sphere")]
        lights: tuple[Light, ...] = tuple(_light(fields) for fields in top.tables("light"))
        surroundings = _surroundings(top.table("surroundings")) if "surroundings" in top else STUDIO
        if self.ambient != BLACK:
            red, green, blue = (a + b for a, b in zip(surroundings.ambient, self.ambient, strict=True))
            surroundings = dataclasses.replace(surroundings, ambient=(red, green, blue))
        camera = _camera(top.table("camera")) if "camera" in top else None
        if self.cameras and camera is not None:
            raise top.refuse("camera", "no camera beside that of a mesh file (use_camera)", top.value("camera"))
        camera = self.cameras[0] if self.cameras else camera
        lights += tuple(self.lights)
        lit = "light" in top or bool(self.lights)
        camera_path = read_camera_path(top.tables("camera_path"))
        if camera is None and camera_path is not None:
            camera = camera_path.keyframes[0].camera
        top.refuse_unknown()
        if camera is None or not lit:
            bounds = bounding_sphere(meshes, spheres, top.file)
            camera = camera or framed_camera(meshes, spheres, bounds)
            lights = lights if lit else framed_lights(bounds, top.file)
        return Scene(tuple(meshes), tuple(spheres), lights, surroundings, camera, exposure, title, camera_path)

    def _material(self, fields: Fields, name: str) -> Material:
        texture, shine, holes, bumps = (
            self._texture(fields, f"{kind}_texture") for kind in ("diffuse", "specular", "alpha", "normal")
        )
        base = fields.choice("base", BASES, _DEFAULTS.base)
        brightest = MAX_RADIANCE if base == "phong" else 1.0
        material = Material(
            name,
            diffuse=fields.rgb("diffuse", 1.0, _DEFAULTS.diffuse if texture is None else (1.0, 1.0, 1.0)),
            specular=fields.rgb("specular", brightest, _DEFAULTS.specular),
            shininess=fields.number("shininess", 0.0, MAX_SHININESS, _DEFAULTS.shininess),
            emission=fields.rgb("emission", MAX_RADIANCE, _DEFAULTS.emission),
            reflection=fields.rgb("reflection", 1.0, _DEFAULTS.reflection),
            transmission=fields.rgb("transmission", 1.0, _DEFAULTS.transmission),
            ior=fields.number("ior", 0.1, 10.0, _DEFAULTS.ior),
            priority=fields.integer("priority", -MAX_PRIORITY, MAX_PRIORITY) if "priority" in fields else None,
            diffuse_texture=texture,
            specular_texture=shine,
            alpha_texture=holes,
            alpha_cutoff=fields.number("alpha_cutoff", 0.0, 1.0, _DEFAULTS.alpha_cutoff),
            normal_texture=bumps,
            normal_scale=fields.number("normal_scale", -MAX_NORMAL_SCALE, MAX_NORMAL_SCALE, _DEFAULTS.normal_scale),
            base=base,
            exponent_u=fields.number("exponent_u", 0.0, MAX_SHININESS, _DEFAULTS.exponent_u),
            exponent_v=fields.number("exponent_v", 0.0, MAX_SHININESS, _DEFAULTS.exponent_v),
        )
        fields.refuse_unknown()
        return material

    def _texture(self, fields: Fields, key: str) -> Texture | None:
        """The texture that a field names, alone or in a table with how it goes on beyond its edges."""
        if key not in fields:
            return None
        if isinstance(fields.value(key), dict):
            table, file = fields.table(key), "file"
        else:
            table, file = Fields({key: fields.value(key)}, fields.file, fields.place), key
        data, inner = self.folder.read(table.text(file), f"{table.file}: {table.where(file)}")
        wrap_u, wrap_v = (table.choice(side, WRAPS, "repeat") for side in ("wrap_u", "wrap_v"))
        table.refuse_unknown()
        if (inner, wrap_u, wrap_v) not in self.textures:
            plain = decode_texture(data, self.folder.file_label(inner), self.folder.max_texture_pixels)
            self.textures[inner, wrap_u, wrap_v] = dataclasses.replace(plain, wrap_u=wrap_u, wrap_v=wrap_v)
        return self.textures[inner, wrap_u, wrap_v]

    def _meshes(self, fields: Fields) -> list[Mesh]:
        """The meshes of one [[mesh]] table, in their place."""
        name = fields.text("file")
        if name not in self.files:
            where = f"{fields.file}: {fields.where('file')}"
            self.files[name] = read_model(self.folder, name, where, self.max_triangles)
        meshes = self.files[name].meshes
        self.triangles += sum(len(mesh.faces) for mesh in meshes)
        if self.triangles > self.max_triangles:
            raise fields.refuse("file", f"at most {self.max_triangles} triangles in all", self.triangles)
        matrix = _matrix(fields)
        self._use_view(fields, self.files[name], matrix)
        casts_shadows = fields.flag("casts_shadows", True)
        replacements = self._replacements(fields, [mesh.material.name for mesh in meshes])
        fields.refuse_unknown()
        return [
            placed(
                dataclasses.replace(
                    mesh,
                    material=replacements.get(mesh.material.name, mesh.material),
                    casts_shadows=casts_shadows,
                ),
                matrix,
            )
            for mesh in meshes
        ]

    def _use_view(self, fields: Fields, model: Model, matrix: NDArray[np.float64]) -> None:
        """Take in the camera and the lights of a mesh file where its table asks for them."""
        try:
            if fields.flag("use_camera", False):
                if model.camera is None or self.cameras:
                    found = "a second camera" if self.cameras else fields.text("file")
                    raise fields.refuse("use_camera", "one file with a camera", found)
                self.cameras.append(placed_camera(model.camera, matrix))
            if fields.flag("use_lights", False):
                if not model.lights and model.ambient == BLACK:
                    raise fields.refuse("use_lights", "a file with lights", fields.text("file"))
                bounds = bounding_sphere(model.meshes, (), fields.file)
                lights = point_lights(model.lights, bounds.center, bounds.radius, fields.file)
                self.lights.extend(placed_light(light, matrix) for light in lights)
                red, green, blue = (a + b for a, b in zip(self.ambient, model.ambient, strict=True))
                self.ambient = (red, green, blue)
        except SettingsError as error:
            raise fields.in_file(error) from None

    def _replacements(self, fields: Fields, names: list[str]) -> dict[str, Material]:
        """By name, the materials that take the place of the file's own."""
        if "material" not in fields:
            return {}
        if isinstance(fields.value("material"), str):
            material = self._named(fields, "material")
            return dict.fromkeys(names, material)
        table = fields.table("material")
        for name in table.names():
            if name not in names:
                raise fields.refuse("material", f"materials of the file ({', '.join(dict.fromkeys(names))})", name)
        return {name: self._named(table, name) for name in table.names()}

    def _named(self, fields: Fields, key: str) -> Material:
        if not self.materials:
            raise fields.refuse(key, "a material that a table [materials.NAME] describes", fields.value(key))
        return self.materials[fields.choice(key, tuple(self.materials))]

    def _sphere(self, fields: Fields) -> Sphere:
        sphere = Sphere(
            fields.point("center", MAX_COORDINATE_M),
            fields.number("radius", 0.0, MAX_COORDINATE_M, open_low=True),
            self._named(fields, "material") if "material" in fields else DEFAULT_MATERIAL,
            fields.flag("casts_shadows", True),
        )
        fields.refuse_unknown()
        return sphere


def _light(fields: Fields) -> Light:
    kind = fields.choice("kind", ("point", "rectangle", "sphere"))
    light: Light
    try:
        if kind == "point":
            light = PointLight(
                fields.point("position", MAX_COORDINATE_M),
                fields.rgb("intensity", MAX_INTENSITY),
                fields.flag("casts_shadows", True),
            )
        elif kind == "sphere":
            light = SphereLight(
                fields.point("center", MAX_COORDINATE_M),
                fields.number("radius", 0.0, MAX_COORDINATE_M, open_low=True),
                fields.rgb("radiance", MAX_RADIANCE),
                fields.flag("casts_shadows", True),
            )
        else:
            light = RectangleLight(
                fields.point("corner", MAX_COORDINATE_M),
                fields.point("edge_u", MAX_COORDINATE_M),
                fields.point("edge_v", MAX_COORDINATE_M),
                fields.rgb("radiance", MAX_RADIANCE),
                fields.flag("two_sided", False),
                fields.flag("casts_shadows", True),
            )
    except RectangleError as error:
        raise fields.refuse(error.field, error.expected, error.found) from None
    fields.refuse_unknown()
    return light


def _surroundings(fields: Fields) -> Surroundings:
    zenith, horizon, ambient = (fields.rgb(key, MAX_RADIANCE, BLACK) for key in ("zenith", "horizon", "ambient"))
    fields.refuse_unknown()
    return Surroundings(zenith, horizon, ambient)


def _camera(fields: Fields) -> Camera:
    try:
        camera = Camera(
            fields.point("position", MAX_POSITION_M),
            fields.point("look_at", MAX_POSITION_M),
            fields.point("up", MAX_POSITION_M, (0.0, 1.0, 0.0)),
            fields.number("vertical_fov_deg", 1e-3, 179.0, 40.0),
        )
    except SettingsError as error:
        raise fields.in_file(error) from None
    fields.refuse_unknown()
    return camera


def _matrix(fields: Fields) -> NDArray[np.float64]:
    """(4, 4) transform of a [[mesh]] table: translate * rotate * scale."""
    if isinstance(fields.value("scale"), list):
        scale = fields.numbers("scale", 3, -MAX_COORDINATE_M, MAX_COORDINATE_M)
    else:
        scale = (fields.number("scale", -MAX_COORDINATE_M, MAX_COORDINATE_M, 1.0),) * 3
    if 0.0 in scale:
        raise fields.refuse("scale", "factors other than 0", fields.value("scale"))
    x, y, z = (math.radians(angle) for angle in fields.point("rotate_deg", 1e6, (0.0, 0.0, 0.0)))
    about_x = np.array([[1, 0, 0], [0, math.cos(x), -math.sin(x)], [0, math.sin(x), math.cos(x)]])
    about_y = np.array([[math.cos(y), 0, math.sin(y)], [0, 1, 0], [-math.sin(y), 0, math.cos(y)]])
    about_z = np.array([[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = about_z @ about_y @ about_x * np.array(scale)
    matrix[:3, 3] = fields.point("translate", MAX_COORDINATE_M, (0.0, 0.0, 0.0))
    return matrix
