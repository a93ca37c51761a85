"""Our scenes as Mitsuba 3 takes them, and the pictures it makes of them."""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.display import Display
from renderer.scene import (
    Light,
    Material,
    Mesh,
    PointLight,
    Rgb,
    Scene,
    Sphere,
    SphereLight,
    Surroundings,
    Texture,
)
from tests.renderer.drawing import BLACK, WHITE

VARIANT = "scalar_rgb"


def has_mitsuba() -> bool:
    return importlib.util.find_spec("mitsuba") is not None


def mitsuba() -> Any:
    """The package, set to plain C++ in float32 that computes in RGB."""
    import mitsuba as package

    if package.variant() != VARIANT:
        package.set_variant(VARIANT)
    return package


def mitsuba_scene(scene: Scene, display: Display) -> Any:
    """The same scene; surroundings that are even all round are an emitter, others are left out."""
    mi = mitsuba()
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
        parts[f"light{number}"] = _light(light)
    for number, mesh in enumerate(scene.meshes):
        parts[f"mesh{number}"] = _mesh(mesh)
    for number, sphere in enumerate(scene.spheres):
        parts[f"sphere{number}"] = _sphere(sphere)
    return mi.load_dict(parts)


def repeated_pictures(
    scene: Any, integrator: dict[str, Any], repeats: int, samples: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean picture of independent ones and the standard error of each of its values, (h, w, 3) float64.

    Args:
        scene: of `mitsuba_scene`.
        integrator: Mitsuba's own.
        repeats: how many pictures.
        samples: a pixel, at random places in it.
    """
    mi = mitsuba()
    method = mi.load_dict(integrator)
    pictures = np.array([mi.render(scene, integrator=method, spp=samples, seed=seed) for seed in range(repeats)])
    pictures = pictures.astype(np.float64)
    return pictures.mean(axis=0), pictures.std(axis=0, ddof=1) / np.sqrt(repeats)


def followed_picture(scene: Any, around: Surroundings, display: Display, depth: int) -> NDArray[np.float64]:
    """One ray through the middle of each pixel, followed as Whitted does, by Mitsuba's camera, shapes,
    materials and lights: (h, w, 3) float64 radiance.

    Args:
        scene: of `mitsuba_scene`.
        around: what rays see that meet nothing.
        display: its size.
        depth: how many mirrors and boundaries a ray may meet.
    """
    mi = mitsuba()
    (sensor,) = scene.sensors()
    lights = scene.emitters()
    picture = np.zeros((display.height_px, display.width_px, 3))
    for row in range(display.height_px):
        for column in range(display.width_px):
            place = mi.Point2f((column + 0.5) / display.width_px, (row + 0.5) / display.height_px)
            ray, _ = sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
            picture[row, column] = _followed(mi, scene, lights, around, ray, depth)
    return picture


def _followed(mi: Any, scene: Any, lights: Any, around: Surroundings, ray: Any, depth: int) -> NDArray[np.float64]:
    hit = scene.ray_intersect(ray)
    if not hit.is_valid():
        high = min(1.0, max(0.0, ray.d.y))
        return high * np.array(around.zenith) + (1.0 - high) * np.array(around.horizon)
    material = hit.bsdf()
    seen = np.zeros(3)
    middle = mi.Point2f(0.5)
    if mi.has_flag(material.flags(), mi.BSDFFlags.Smooth):
        for light in lights:
            way, arriving = light.sample_direction(hit, middle)
            if way.pdf > 0.0:
                sent = np.array(material.eval(mi.BSDFContext(), hit, hit.to_local(way.d)) * arriving)
                seen += sent * _let_through(scene, hit.spawn_ray_to(way.p))
    if (passing := _through(hit, ray)) > 0.0:
        seen += passing * _followed(mi, scene, lights, around, hit.spawn_ray(ray.d), depth)
    for part in range(material.component_count() if depth > 0 else 0):
        if mi.has_flag(material.flags(part), mi.BSDFFlags.Delta):
            # Carried as importance is, light knows no n^2 where it is refracted: Whitted's model has none.
            context = mi.BSDFContext(mi.TransportMode.Importance, int(mi.BSDFFlags.All), part)
            turned, share = material.sample(context, hit, 0.5, middle)
            if turned.pdf > 0.0:
                onwards = hit.spawn_ray(hit.to_world(turned.wo))
                seen += np.array(share) * _followed(mi, scene, lights, around, onwards, depth - 1)
    return seen


def _through(hit: Any, ray: Any) -> float:
    """Share of the light that passes the holes of what was hit."""
    return float(hit.bsdf(ray).eval_null_transmission(hit)[0])


def _let_through(scene: Any, ray: Any) -> float:
    """Share of the light that passes all there is along a ray that ends at a light."""
    share = 1.0
    while share > 0.0:
        hit = scene.ray_intersect(ray)
        if not hit.is_valid():
            break
        share *= _through(hit, ray)
        onwards = hit.spawn_ray(ray.d)
        onwards.maxt = ray.maxt - hit.t
        ray = onwards
    return share


def _light(light: Light) -> dict[str, Any]:
    if isinstance(light, PointLight):
        return {"type": "point", "position": list(light.position), "intensity": _rgb(light.intensity)}
    shining = {"bsdf": _diffuse(BLACK), "emitter": {"type": "area", "radiance": _rgb(light.radiance)}}
    if isinstance(light, SphereLight):
        return {"type": "sphere", "center": list(light.center), "radius": light.radius, **shining}
    corner, u, v = np.array(light.corner), np.array(light.edge_u), np.array(light.edge_v)
    world_from_square = np.eye(4)  # Mitsuba's rectangle is (-1, -1) to (1, 1), and shines along z
    world_from_square[:3] = np.stack([u / 2, v / 2, np.cross(u, v), corner + u / 2 + v / 2], axis=1)
    return {"type": "rectangle", "to_world": mitsuba().ScalarTransform4f(world_from_square), **shining}


def _mesh(mesh: Mesh) -> Any:
    mi = mitsuba()
    looks = mi.Properties()
    looks["bsdf"] = mi.load_dict(_material(mesh.material))
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


def _sphere(sphere: Sphere) -> dict[str, Any]:
    assert not any(sphere.material.emission)
    return {
        "type": "sphere", "center": list(sphere.center), "radius": sphere.radius, "bsdf": _material(sphere.material),
    }  # fmt: skip


def _material(material: Material) -> dict[str, Any]:
    """Matt, a mirror, both (half of each, twice as bright) or a dielectric."""
    assert not any(material.specular)
    if any(material.transmission):
        return {
            "type": "dielectric", "int_ior": material.ior, "ext_ior": 1.0,
            "specular_transmittance": _rgb(material.transmission),
        }  # fmt: skip
    if material.diffuse_texture is not None:
        assert material.diffuse == WHITE
        colours = _bitmap(material.diffuse_texture.pixels, material.diffuse_texture, raw=False, filter_type="bilinear")
        return _two_sided({"type": "diffuse", "reflectance": colours})
    if material.alpha_texture is not None:
        assert material.alpha_texture.alpha is not None
        stripes = _bitmap(material.alpha_texture.alpha, material.alpha_texture, raw=True, filter_type="nearest")
        return {"type": "mask", "opacity": stripes, "bsdf": _two_sided(_diffuse(material.diffuse))}
    matt, mirror = _diffuse(material.diffuse), _mirror(material.reflection)
    if not any(material.reflection):
        return _two_sided(matt)
    if not any(material.diffuse):
        return _two_sided(mirror)
    double = [_diffuse(_twice(material.diffuse)), _mirror(_twice(material.reflection))]
    return _two_sided({"type": "blendbsdf", "weight": 0.5, "matt": double[0], "mirror": double[1]})


def _bitmap(pixels: NDArray[np.uint8], texture: Texture, raw: bool, filter_type: str) -> dict[str, Any]:
    assert texture.wrap_u == texture.wrap_v
    return {
        "type": "bitmap", "bitmap": mitsuba().Bitmap(pixels), "raw": raw, "filter_type": filter_type,
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
