"""Our scenes as Mitsuba 3 takes them. The only file that knows its package."""

from __future__ import annotations

import importlib.util
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from renderer.display import Display
from renderer.scene import BLACK, WHITE, Light, Material, Mesh, PointLight, Rgb, Scene, Sphere, SphereLight, Texture

SCALAR: Final = "scalar_rgb"
"""Plain C++ in float32 that computes in RGB, one ray at a time."""

VECTOR: Final = "llvm_ad_rgb"
"""The same compiled for the machine's vectors, where there is an LLVM library."""


def has_mitsuba() -> bool:
    """Whether it is installed."""
    return importlib.util.find_spec("mitsuba") is not None


def mitsuba(variant: str = SCALAR) -> Any:
    """The package, set to compute in one of its ways; what was made in another one is of no use then."""
    import mitsuba as package

    if package.variant() != variant:
        package.set_variant(variant)
    return package


def fastest_variant() -> str:
    """`VECTOR` where it works on this machine, else `SCALAR`."""
    try:
        mi = mitsuba(VECTOR)
        mi.Float(1.0) + mi.Float(1.0)
    except (ImportError, RuntimeError):  # there is no LLVM library, or this build has no such variant
        return SCALAR
    return VECTOR


def render_on(threads: int) -> None:
    """Let Mitsuba trace on so many threads from now on."""
    import drjit

    drjit.set_thread_count(threads)


def mitsuba_scene(scene: Scene, display: Display, variant: str = SCALAR) -> Any:
    """The same scene; surroundings that are even all round are an emitter, others are left out.

    Args:
        scene: of flat matt, mirroring and transparent things without highlights.
        display: whose pixels its film has.
        variant: for which it is made.
    """
    mi = mitsuba(variant)
    camera, around = scene.camera, scene.surroundings
    view = mi.ScalarTransform4f().look_at(origin=list(camera.position), target=list(camera.look_at), up=list(camera.up))
    film = {
        "type": "hdrfilm", "width": display.width_px, "height": display.height_px, "rfilter": {"type": "box"},
        "pixel_format": "rgb", "component_format": "float32",
    }  # fmt: skip
    parts: dict[str, Any] = {
        "type": "scene",
        "embree_use_robust_intersections": True,
        "sensor": {
            "type": "perspective", "fov": camera.vertical_fov_deg, "fov_axis": "y", "near_clip": 1e-3,
            "to_world": view, "film": film,
        },
    }  # fmt: skip
    if any(around.zenith) and around.zenith == around.horizon:
        parts["around"] = {"type": "constant", "radiance": _rgb(around.zenith)}
    for number, light in enumerate(scene.lights):
        parts[f"light{number}"] = _light(mi, light)
    for number, mesh in enumerate(scene.meshes):
        parts[f"mesh{number}"] = _mesh(mi, mesh)
    for number, sphere in enumerate(scene.spheres):
        parts[f"sphere{number}"] = _sphere(mi, sphere)
    return mi.load_dict(parts)


def _light(mi: Any, light: Light) -> dict[str, Any]:
    if isinstance(light, PointLight):
        return {"type": "point", "position": list(light.position), "intensity": _rgb(light.intensity)}
    shining = {"bsdf": _diffuse(BLACK), "emitter": {"type": "area", "radiance": _rgb(light.radiance)}}
    if isinstance(light, SphereLight):
        return {"type": "sphere", "center": list(light.center), "radius": light.radius, **shining}
    corner, u, v = np.array(light.corner), np.array(light.edge_u), np.array(light.edge_v)
    world_from_square = np.eye(4)  # Mitsuba's rectangle is (-1, -1) to (1, 1), and shines along z
    world_from_square[:3] = np.stack([u / 2, v / 2, np.cross(u, v), corner + u / 2 + v / 2], axis=1)
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(world_from_square), **shining}


def _mesh(mi: Any, mesh: Mesh) -> Any:
    looks = mi.Properties()
    looks["bsdf"] = mi.load_dict(_material(mi, mesh.material))
    if any(mesh.material.emission):
        looks["emitter"] = mi.load_dict({"type": "area", "radiance": _rgb(mesh.material.emission)})
    assert mesh.normals is None
    mapped = mesh.uvs is not None
    made = mi.Mesh(mesh.name, len(mesh.vertices), len(mesh.faces), looks, has_vertex_texcoords=mapped)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = mesh.vertices.astype(np.float32).ravel()
    if mesh.uvs is not None:
        parameters["vertex_texcoords"] = (mesh.uvs * (1, -1) + (0, 1)).astype(np.float32).ravel()  # v runs down there
    parameters["faces"] = mesh.faces.astype(np.uint32).ravel()
    parameters.update()
    return made


def _sphere(mi: Any, sphere: Sphere) -> dict[str, Any]:
    assert not any(sphere.material.emission)
    return {
        "type": "sphere", "center": list(sphere.center), "radius": sphere.radius,
        "bsdf": _material(mi, sphere.material),
    }  # fmt: skip


def _material(mi: Any, material: Material) -> dict[str, Any]:
    """Matt, a mirror, both (half of each, twice as bright) or a dielectric."""
    assert not any(material.specular)
    if any(material.transmission):
        return {
            "type": "dielectric", "int_ior": material.ior, "ext_ior": 1.0,
            "specular_transmittance": _rgb(material.transmission),
        }  # fmt: skip
    if material.diffuse_texture is not None:
        assert material.diffuse == WHITE
        colours = _bitmap(
            mi, material.diffuse_texture.pixels, material.diffuse_texture, raw=False, filter_type="bilinear"
        )
        return _two_sided({"type": "diffuse", "reflectance": colours})
    if material.alpha_texture is not None:
        assert material.alpha_texture.alpha is not None
        stripes = _bitmap(mi, material.alpha_texture.alpha, material.alpha_texture, raw=True, filter_type="nearest")
        return {"type": "mask", "opacity": stripes, "bsdf": _two_sided(_diffuse(material.diffuse))}
    matt, mirror = _diffuse(material.diffuse), _mirror(material.reflection)
    if not any(material.reflection):
        return _two_sided(matt)
    if not any(material.diffuse):
        return _two_sided(mirror)
    double = [_diffuse(_twice(material.diffuse)), _mirror(_twice(material.reflection))]
    return _two_sided({"type": "blendbsdf", "weight": 0.5, "matt": double[0], "mirror": double[1]})


def _bitmap(mi: Any, pixels: NDArray[np.uint8], texture: Texture, raw: bool, filter_type: str) -> dict[str, Any]:
    assert texture.wrap_u == texture.wrap_v
    return {
        "type": "bitmap", "bitmap": mi.Bitmap(pixels), "raw": raw, "filter_type": filter_type,
        "wrap_mode": texture.wrap_u,
    }  # fmt: skip


def _diffuse(colour: Rgb) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": _rgb(colour)}


def _mirror(colour: Rgb) -> dict[str, Any]:
    return {"type": "conductor", "material": "none", "specular_reflectance": _rgb(colour)}


def _two_sided(front: dict[str, Any]) -> dict[str, Any]:
    return {"type": "twosided", "bsdf": front}


def _twice(colour: Rgb) -> Rgb:
    red, green, blue = colour
    return 2 * red, 2 * green, 2 * blue


def _rgb(colour: Rgb) -> dict[str, Any]:
    return {"type": "rgb", "value": list(colour)}
