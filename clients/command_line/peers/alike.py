"""A scene with the same shapes as ours that other renderers can show too: what they model otherwise is left out."""

from __future__ import annotations

from dataclasses import replace

from renderer.scene import BLACK, WHITE, Material, Mesh, PointLight, Scene, Sphere, Surroundings

MATT_SHARE = 0.6
"""Diffuse albedo that stands for a material without one."""


def matt_alike(scene: Scene) -> Scene:
    """The same triangles and spheres in plain matt colours, in the light of the first lamp that casts shadows.

    A camera ray then sends one shadow ray, whoever traces it.

    Raises:
        ValueError: for a scene without a point light that casts shadows.
    """
    lamps = [light for light in scene.lights if isinstance(light, PointLight) and light.casts_shadows]
    if not lamps:
        raise ValueError("expected a scene with a point light that casts shadows, found none")
    return replace(
        scene,
        meshes=tuple(_plain_mesh(mesh, _matt(mesh.material)) for mesh in scene.meshes),
        spheres=tuple(replace(sphere, material=_matt(sphere.material), casts_shadows=True) for sphere in scene.spheres),
        lights=(lamps[0],),
        surroundings=Surroundings(),
    )


def whitted_alike(scene: Scene) -> Scene:
    """The same with mirrors, glass and highlights, without textures; glass casts no shadows, highlights are grey.

    Raises:
        ValueError: for a scene that has lights other than point lights.
    """
    if not all(isinstance(light, PointLight) for light in scene.lights):
        raise ValueError("expected a scene with point lights alone, found another light")
    lights = tuple(replace(light, casts_shadows=True) for light in scene.lights)
    return replace(
        scene,
        meshes=tuple(_plain_mesh(mesh, _shining(mesh.material)) for mesh in scene.meshes),
        spheres=tuple(_shining_sphere(sphere) for sphere in scene.spheres),
        lights=lights,
        surroundings=replace(scene.surroundings, ambient=BLACK),
    )


def _plain_mesh(mesh: Mesh, material: Material) -> Mesh:
    casts_shadows = not any(material.transmission)
    return Mesh(mesh.vertices, mesh.faces, material, name=mesh.name, casts_shadows=casts_shadows)


def _shining_sphere(sphere: Sphere) -> Sphere:
    material = _shining(sphere.material)
    return replace(sphere, material=material, casts_shadows=not any(material.transmission))


def _matt(material: Material) -> Material:
    diffuse = material.diffuse if any(material.diffuse) else (MATT_SHARE,) * 3
    return Material(material.name, diffuse)


def _shining(material: Material) -> Material:
    gloss = sum(material.specular) / 3.0 if material.base == "phong" else 0.0
    if any(material.transmission):
        return Material("glass", BLACK, (gloss,) * 3, material.shininess, transmission=WHITE, ior=material.ior)
    return Material(material.name, material.diffuse, (gloss,) * 3, material.shininess, reflection=material.reflection)
