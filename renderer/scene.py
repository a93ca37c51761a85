"""The scene as its author states it: float64, metres, y up, linear Rec.709 light.

Nothing here knows how the scene is traced; `prepared` turns it into what the kernels read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.camera_path import CameraPath
from renderer.errors import (
    SceneError,
    require_all,
    require_choice,
    require_flag,
    require_integer,
    require_kind,
    require_number,
    require_point,
    require_rgb,
    short,
)

Rgb = tuple[float, float, float]

BLACK: Rgb = (0.0, 0.0, 0.0)
WHITE: Rgb = (1.0, 1.0, 1.0)

MAX_COORDINATE_M = 1e12
"""Largest coordinate of a scene [m]: beyond, products of three lengths leave float32 (Embree)."""

MAX_SHININESS = 1e9
"""Largest exponent of a highlight."""

MAX_NORMAL_SCALE = 1e3
"""Largest factor of the bumps of a normal map."""

BASES = ("phong", "ashikhmin-shirley")
"""Models of how a surface scatters light."""

MAX_PRIORITY = 1000

MAX_RADIANCE = 1e12
"""Largest radiance a scene may state; keeps every product finite in float32."""

MAX_INTENSITY = 1e24
"""Largest intensity of a point light [W/sr]: the largest radiance, a thousand kilometres away."""

RIGHT_ANGLE = 1e-4
"""Largest cosine between the edges of a rectangle: what coordinates of five digits round to."""

WRAPS = ("repeat", "clamp", "mirror")
"""What a texture shows beyond its edges: itself again, its edge, itself mirrored."""


@dataclass(frozen=True, eq=False, slots=True)
class Texture:
    """An image looked up by texture coordinates, filtered bilinearly, and between smaller copies where it is
    seen small.

    Attributes:
        pixels: (h, w, 3) uint8, sRGB-coded but in normal maps, row 0 at the top; v = 0 is the bottom edge.
        name: for messages.
        wrap_u, wrap_v: `repeat`, `clamp` or `mirror`, across and up.
        alpha: (h, w) uint8, 255 where it is whole; None for a picture without. Colours are not multiplied by it.

    Raises:
        SceneError: for another shape or dtype, or no pixels.
        SettingsError: for an unknown wrap.
    """

    pixels: NDArray[np.uint8]
    name: str = "texture"
    wrap_u: str = "repeat"
    wrap_v: str = "repeat"
    alpha: NDArray[np.uint8] | None = None

    @property
    def opacity(self) -> NDArray[np.uint8]:
        """(h, w) uint8 what it is as an alpha map: its alpha, or where it has none its green channel."""
        return self.pixels[:, :, 1] if self.alpha is None else self.alpha

    def __post_init__(self) -> None:
        require_kind("texture.name", self.name, str)
        require_choice(f"{self.name}: wrap_u", self.wrap_u, WRAPS)
        require_choice(f"{self.name}: wrap_v", self.wrap_v, WRAPS)
        require_kind(f"{self.name}: pixels", self.pixels, np.ndarray)
        if self.pixels.dtype != np.uint8 or self.pixels.ndim != 3 or self.pixels.shape[2] != 3 or self.pixels.size == 0:
            raise SceneError(
                f"{self.name}: expected (height, width, 3) uint8 pixels, found {self.pixels.shape} {self.pixels.dtype}"
            )
        if self.alpha is None:
            return
        require_kind(f"{self.name}: alpha", self.alpha, np.ndarray)
        if self.alpha.dtype != np.uint8 or self.alpha.shape != self.pixels.shape[:2]:
            raise SceneError(
                f"{self.name}: expected alpha as {self.pixels.shape[:2]} uint8, "
                f"found {self.alpha.shape} {self.alpha.dtype}"
            )


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface does with light: a base that scatters it, and effects added to the base.

    With the base `phong` (Whitted 1980), under a point light of intensity I at distance r, a surface sends
    (diffuse/pi * N.L + specular * (R.V)^shininess) * I / r^2 to the eye; with `ashikhmin-shirley` it sends
    f * N.L * I / r^2, f from `ashikhmin_shirley`, which stays within what arrives. Emission, reflection,
    transmission and textures are added to either.

    Attributes:
        name: for messages.
        diffuse: diffuse albedo, 0 to 1 each; multiplied by `diffuse_texture` where there is one.
        specular: highlight: with `phong` its height, 0 or more each; with `ashikhmin-shirley` the share
            mirrored head-on, Rs, 0 to 1 each.
        shininess: exponent of the highlight of `phong`, 0 to 1e9.
        emission: radiance sent out by itself [W/(sr m^2)], seen by rays but lighting nothing.
        reflection: mirror share, 0 to 1 each.
        transmission: share let through, 0 to 1 each; above 0 the surface is a dielectric boundary
            whose mirrored share is Fresnel's F and whose transmitted share is (1 - F) * transmission.
        ior: index of refraction inside the surface relative to outside, 0.1 to 10; 1 goes straight through.
        priority: -1000 to 1000: it is the material of closed solids, made of a medium of index `ior`, that may lie
            in or overlap others; where they do, the highest priority is what there is, and of equal ones the larger
            index. None: the surface stands for itself, whatever is around it, as one with holes always does.
        diffuse_texture: multiplies `diffuse`; None for none.
        specular_texture: multiplies `specular` and `reflection`; None for none.
        alpha_texture: cuts holes where its alpha (without alpha: its green) is below `alpha_cutoff`; rays of
            every kind pass them. None for none.
        alpha_cutoff: 0 to 1.
        normal_texture: bends the shading normal: the code c of red stands for the component 2c - 1 along the
            texture coordinate u, green along v, blue out of the surface; not sRGB-coded. None for none.
        normal_scale: multiplies the components along u and v, -1000 to 1000.
        base: `phong` or `ashikhmin-shirley`.
        exponent_u, exponent_v: exponents of the highlight of `ashikhmin-shirley` along and across the grain,
            0 to 1e9; the grain runs along the texture coordinate u, round a sphere along its parallels. The
            smaller the exponent, the farther the highlight stretches that way: metal brushed along u has a
            large exponent_u and a small exponent_v.

    Raises:
        SettingsError: naming the field, for a value out of range.
    """

    name: str = "material"
    diffuse: Rgb = (0.8, 0.8, 0.8)
    specular: Rgb = BLACK
    shininess: float = 32.0
    emission: Rgb = BLACK
    reflection: Rgb = BLACK
    transmission: Rgb = BLACK
    ior: float = 1.5
    diffuse_texture: Texture | None = None
    base: str = "phong"
    exponent_u: float = 100.0
    exponent_v: float = 100.0
    specular_texture: Texture | None = None
    alpha_texture: Texture | None = None
    alpha_cutoff: float = 0.5
    normal_texture: Texture | None = None
    normal_scale: float = 1.0
    priority: int | None = None

    def __post_init__(self) -> None:
        require_kind("material.name", self.name, str)
        where = f"material {self.name!r}"
        require_choice(f"{where}.base", self.base, BASES)
        for label, value, high in (
            ("diffuse", self.diffuse, 1.0),
            ("specular", self.specular, MAX_RADIANCE if self.base == "phong" else 1.0),
            ("emission", self.emission, MAX_RADIANCE),
            ("reflection", self.reflection, 1.0),
            ("transmission", self.transmission, 1.0),
        ):
            object.__setattr__(self, label, require_rgb(f"{where}.{label}", value, high))
        for label, picture in (
            ("diffuse_texture", self.diffuse_texture),
            ("specular_texture", self.specular_texture),
            ("alpha_texture", self.alpha_texture),
            ("normal_texture", self.normal_texture),
        ):
            if picture is not None:
                require_kind(f"{where}.{label}", picture, Texture)
        for label, exponent in (
            ("shininess", self.shininess),
            ("exponent_u", self.exponent_u),
            ("exponent_v", self.exponent_v),
        ):
            require_number(f"{where}.{label}", exponent, 0.0, MAX_SHININESS)
        require_number(f"{where}.ior", self.ior, 0.1, 10.0)
        if self.priority is not None:
            require_integer(f"{where}.priority", self.priority, -MAX_PRIORITY, MAX_PRIORITY)
        require_number(f"{where}.alpha_cutoff", self.alpha_cutoff, 0.0, 1.0)
        require_number(f"{where}.normal_scale", self.normal_scale, -MAX_NORMAL_SCALE, MAX_NORMAL_SCALE)


@dataclass(frozen=True, eq=False, slots=True)
class Mesh:
    """Triangles of one material.

    Attributes:
        vertices: (n, 3) float64 positions [m].
        faces: (m, 3) int64 vertex indices, counter-clockwise seen from outside.
        material: of every face.
        normals: (n, 3) float64 vertex normals for smooth shading, of any length (zero: use the
            face's own); None for flat faces.
        uvs: (n, 2) float64 texture coordinates; None for none.
        casts_shadows: whether it stands between a light and what the light falls on.
        name: for messages.
        tangents: (n, 4) float64: where the texture coordinate u runs at each vertex, of any length, and 1 where
            v runs along the cross product of normal and tangent, -1 where against it; None: as the texture
            coordinates say. They count on smooth meshes only.

    Raises:
        SceneError: naming the mesh, for wrong shapes, indices out of range or vertices that are not finite.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    material: Material
    normals: NDArray[np.float64] | None = None
    uvs: NDArray[np.float64] | None = None
    casts_shadows: bool = True
    name: str = "mesh"
    tangents: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        require_kind("mesh.name", self.name, str)
        require_kind(f"{self.name}: material", self.material, Material)
        require_flag(f"{self.name}: casts_shadows", self.casts_shadows)
        vertices = _numbers(self.name, "vertices", self.vertices, 3)
        n = len(vertices)
        _require_bounded(self.name, "vertex", vertices)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", _indices(self.name, self.faces, n))
        for label, values, columns in (
            ("normals", self.normals, 3), ("uvs", self.uvs, 2), ("tangents", self.tangents, 4),
        ):  # fmt: skip
            if values is not None:
                object.__setattr__(self, label, _numbers(self.name, label, values, columns, n))


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere traced by its equation, not tessellated.

    Attributes:
        center: position [m].
        radius: [m], above 0.
        material: of its surface; textures map longitude to u and latitude to v.
        casts_shadows: whether it stands between a light and what the light falls on.

    Raises:
        SettingsError: for a centre that is not finite or a radius that is not positive.
    """

    center: tuple[float, float, float]
    radius: float
    material: Material
    casts_shadows: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", require_point("sphere.center", self.center, MAX_COORDINATE_M))
        require_number("sphere.radius", self.radius, 0.0, MAX_COORDINATE_M, open_low=True)
        require_kind("sphere.material", self.material, Material)
        require_flag("sphere.casts_shadows", self.casts_shadows)


@dataclass(frozen=True, slots=True)
class PointLight:
    """A light without size, falling off with the square of the distance.

    Attributes:
        position: [m].
        intensity: [W/sr], 0 or more each.
        casts_shadows: False lights through everything.
    """

    position: tuple[float, float, float]
    intensity: Rgb
    casts_shadows: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", require_point("light.position", self.position, MAX_COORDINATE_M))
        object.__setattr__(self, "intensity", require_rgb("light.intensity", self.intensity, MAX_INTENSITY))
        require_flag("light.casts_shadows", self.casts_shadows)


class RectangleError(SceneError):
    """Edges that make no rectangle; `field` names the one at fault."""

    def __init__(self, field: str, expected: str, found: object) -> None:
        super().__init__(f"light.{field}: expected {expected}, found {found}")
        self.field = field
        self.expected = expected
        self.found = found


@dataclass(frozen=True, slots=True)
class RectangleLight:
    """A rectangle that shines evenly in all directions of its side; its shadows are soft.

    It is seen by rays on the side that shines, not from behind, and casts no shadow itself.

    Attributes:
        corner: one corner [m].
        edge_u, edge_v: the edges that start there [m], at right angles; the side they wind around
            counter-clockwise (edge_u x edge_v points out of it) shines.
        radiance: [W/(sr m^2)], 0 or more each.
        two_sided: whether the other side shines too.
        casts_shadows: False lights through everything.

    Raises:
        SettingsError: naming the field, for a value out of range.
        RectangleError: for an edge without length, or edges that are not at right angles.
    """

    corner: tuple[float, float, float]
    edge_u: tuple[float, float, float]
    edge_v: tuple[float, float, float]
    radiance: Rgb
    two_sided: bool = False
    casts_shadows: bool = True

    def __post_init__(self) -> None:
        for name in ("corner", "edge_u", "edge_v"):
            object.__setattr__(self, name, require_point(f"light.{name}", getattr(self, name), MAX_COORDINATE_M))
        object.__setattr__(self, "radiance", require_rgb("light.radiance", self.radiance, MAX_RADIANCE))
        require_flag("light.two_sided", self.two_sided)
        require_flag("light.casts_shadows", self.casts_shadows)
        for name, edge in (("edge_u", self.edge_u), ("edge_v", self.edge_v)):
            if not math.hypot(*edge) > 0.0:
                raise RectangleError(name, "an edge with a length", edge)
        u, v = (np.array(edge) / math.hypot(*edge) for edge in (self.edge_u, self.edge_v))
        if not abs(float(u @ v)) <= RIGHT_ANGLE:
            raise RectangleError("edge_v", f"an edge at right angles to edge_u {self.edge_u}", self.edge_v)


@dataclass(frozen=True, slots=True)
class SphereLight:
    """A sphere that shines evenly outwards; its shadows are soft.

    It is seen by rays from outside, and casts no shadow itself; inside it there is no light.

    Attributes:
        center: [m].
        radius: [m], above 0.
        radiance: [W/(sr m^2)], 0 or more each.
        casts_shadows: False lights through everything.
    """

    center: tuple[float, float, float]
    radius: float
    radiance: Rgb
    casts_shadows: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", require_point("light.center", self.center, MAX_COORDINATE_M))
        require_number("light.radius", self.radius, 0.0, MAX_COORDINATE_M, open_low=True)
        object.__setattr__(self, "radiance", require_rgb("light.radiance", self.radiance, MAX_RADIANCE))
        require_flag("light.casts_shadows", self.casts_shadows)


AreaLight = RectangleLight | SphereLight
Light = PointLight | RectangleLight | SphereLight


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What rays that leave the scene see, and the light that comes from everywhere.

    Attributes:
        zenith: radiance straight up.
        horizon: radiance at and below the horizon; in between it blends with the height of the ray.
        ambient: radiance that lights every surface evenly: a surface sends out diffuse * ambient.
    """

    zenith: Rgb = BLACK
    horizon: Rgb = BLACK
    ambient: Rgb = BLACK

    def __post_init__(self) -> None:
        for name in ("zenith", "horizon", "ambient"):
            rgb = require_rgb(f"surroundings.{name}", getattr(self, name), MAX_RADIANCE)
            object.__setattr__(self, name, rgb)


@dataclass(frozen=True, eq=False, slots=True)
class Scene:
    """Everything a frame shows, and the view its author chose.

    Attributes:
        meshes, spheres, lights: the content; all may be empty.
        surroundings: light from outside.
        camera: the default view.
        exposure: factor from radiance to display-linear 0..1.
        title: one line for people.
        camera_path: where the camera goes in a clip; None where it stays.
    """

    meshes: tuple[Mesh, ...] = ()
    spheres: tuple[Sphere, ...] = ()
    lights: tuple[Light, ...] = ()
    surroundings: Surroundings = field(default_factory=Surroundings)
    camera: Camera = field(default_factory=Camera)
    exposure: float = 1.0
    title: str = ""
    camera_path: CameraPath | None = None

    def __post_init__(self) -> None:
        for name, kinds in (
            ("meshes", (Mesh,)), ("spheres", (Sphere,)), ("lights", (PointLight, RectangleLight, SphereLight)),
        ):  # fmt: skip
            object.__setattr__(self, name, require_all(f"scene.{name}", getattr(self, name), *kinds))
        require_kind("scene.surroundings", self.surroundings, Surroundings)
        require_kind("scene.camera", self.camera, Camera)
        require_number("scene.exposure", self.exposure, 0.0, MAX_RADIANCE, open_low=True)
        require_kind("scene.title", self.title, str)
        if self.camera_path is not None:
            require_kind("scene.camera_path", self.camera_path, CameraPath)

    @property
    def triangles(self) -> int:
        """Number of triangles in all meshes."""
        return sum(len(mesh.faces) for mesh in self.meshes)


def _numbers(name: str, label: str, values: object, columns: int, rows: int | None = None) -> NDArray[np.float64]:
    """`values` as a (rows, columns) float64 array; any number of rows if `rows` is None.

    Raises:
        SceneError: naming the mesh, for anything but an array of real numbers of that shape.
    """
    array = _array(name, label, values, "fiu", "numbers", columns, rows)
    with np.errstate(over="ignore", invalid="ignore"):
        return array.astype(np.float64, copy=False)


def _indices(name: str, values: object, n: int) -> NDArray[np.int64]:
    """`values` as an (m, 3) int64 array of vertex indices.

    Raises:
        SceneError: naming the mesh, and the first face with an index that is not from 0 to n - 1.
    """
    array = _array(name, "faces", values, "iu", "integers", 3, None)
    if len(array) and (array.min() < 0 or array.max() >= n):
        bad = int(np.argmax((array < 0).any(axis=1) | (array >= n).any(axis=1)))
        raise SceneError(f"{name}: face {bad}: expected vertex indices from 0 to {n - 1}, found {array[bad].tolist()}")
    return array.astype(np.int64, copy=False)


def _array(
    name: str, label: str, values: object, kinds: str, numbers: str, columns: int, rows: int | None
) -> NDArray[Any]:
    if not isinstance(values, np.ndarray):
        raise SceneError(f"{name}: {label}: expected an array of {numbers}, found {short(values)}")
    if values.dtype.kind not in kinds:
        raise SceneError(f"{name}: {label}: expected {numbers}, found {values.dtype}")
    shape = (len(values) if rows is None and values.ndim else rows, columns)
    if values.shape != shape:
        raise SceneError(f"{name}: {label}: expected shape {shape}, found {values.shape}")
    return values


def _require_bounded(name: str, label: str, points: NDArray[np.float64]) -> None:
    good = (np.abs(points) <= MAX_COORDINATE_M).all(axis=1)
    if not good.all():
        bad = int(np.argmin(good))
        raise SceneError(
            f"{name}: {label} {bad}: expected finite coordinates up to {MAX_COORDINATE_M:g} m, "
            f"found {points[bad].tolist()}"
        )
