"""The effect plan: what a scene calls for, and therefore which rays exist.

Only content that can be seen or can cast a shadow counts: a material that no face has, a light that is
black or too faint to change a pixel, a texture that nothing looks up call for nothing.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from renderer.effect_choice import EFFECTS, EffectChoice
from renderer.light_reach import reaching_lights
from renderer.scene import BLACK, WHITE, Light, Material, Mesh, PointLight, RectangleLight, Scene, SphereLight, Texture


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect of the tracer.

    Attributes:
        name: one of `EFFECTS`.
        reason: what in the scene calls for it, one line.
    """

    name: str
    reason: str


@dataclass(frozen=True, slots=True)
class EffectPlan:
    """The effects that run, in the order in which a ray meets them.

    Attributes:
        effects: with their reasons.
        forced: names of those that run on every surface, whether anything calls for them or not.
    """

    effects: tuple[Effect, ...]
    forced: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect in self.effects)


def plan_effects(scene: Scene) -> EffectPlan:
    """What `scene` calls for, with the reason of each effect."""
    scene = without_unseen(scene)
    users = _material_users(scene)
    lights = reaching_lights(scene)
    casting: dict[str, list[Light]] = {
        "shadows": [light for light in lights if isinstance(light, PointLight) and light.casts_shadows],
        "soft_shadows": [light for light in lights if not isinstance(light, PointLight) and light.casts_shadows],
    }
    casters = _casters(scene)
    calls: dict[str, Callable[[Material], bool]] = {
        "cutouts": has_holes,
        "textures": lambda material: bool(textures_of(material)),
        "normal_maps": lambda material: _shows_its_normal(material, bool(lights), scene) and has_bumps(material),
        "specular": lambda material: has_highlight(material) and bool(lights),
        "shadows": lambda material: _takes_light(material) and bool(casting["shadows"]) and casters > 0,
        "soft_shadows": lambda material: _takes_light(material) and bool(casting["soft_shadows"]) and casters > 0,
        "reflection": lambda material: material.reflection != BLACK or is_boundary(material),
        "refraction": lambda material: material.transmission != BLACK,
    }
    effects = []
    for name, calls_for in calls.items():
        called_by = [material for material in users if calls_for(material)]
        if called_by and name in casting:
            effects.append(Effect(name, f"{_named_lights(casting[name])}, {_count(casters, 'shadow-casting object')}"))
        elif called_by:
            effects.append(Effect(name, _bearers(called_by, users)))
    return EffectPlan(tuple(effects))


def forced_plan(plan: EffectPlan, choice: EffectChoice) -> EffectPlan:
    """`plan` with some effects forced on or off."""
    reasons = {effect.name: effect.reason for effect in plan.effects}
    for word in choice:
        if word[0] == "+":
            reasons.setdefault(word[1:], "forced on")
        else:
            reasons.pop(word[1:], None)
    forced = frozenset(word[1:] for word in choice if word[0] == "+")
    return EffectPlan(tuple(Effect(name, reasons[name]) for name in EFFECTS if name in reasons), forced)


def has_holes(material: Material) -> bool:
    """Whether its alpha map cuts something out of it."""
    texture = material.alpha_texture
    return texture is not None and int(texture.opacity.min()) < 255 * material.alpha_cutoff


def has_bumps(material: Material) -> bool:
    """Whether its normal map bends a normal somewhere."""
    texture = material.normal_texture
    if texture is None or material.normal_scale == 0.0:
        return False
    across = texture.pixels[:, :, :2]
    return bool(((across != 127) & (across != 128)).any())


def textures_of(material: Material) -> list[Texture]:
    """The textures of a material that change its colour; one that multiplies black does not."""
    shown = []
    if material.diffuse_texture is not None and material.diffuse != BLACK:
        shown.append(material.diffuse_texture)
    if material.specular_texture is not None and (material.specular != BLACK or material.reflection != BLACK):
        shown.append(material.specular_texture)
    return shown


def pictures_of(material: Material) -> list[Texture]:
    """All textures of a material that are looked up, but for its normal map."""
    holes = material.alpha_texture
    return [*textures_of(material), *([holes] if holes is not None and has_holes(material) else [])]


def _material_users(scene: Scene) -> dict[Material, Counter[str]]:
    """Materials that something visible has, with how many triangles and spheres have them."""
    users: dict[Material, Counter[str]] = {}
    for mesh in scene.meshes:
        solid = _solid_faces(mesh)
        if solid:
            users.setdefault(mesh.material, Counter())["triangle"] += solid
    for sphere in scene.spheres:
        users.setdefault(sphere.material, Counter())["sphere"] += 1
    return users


def _solid_faces(mesh: Mesh) -> int:
    """How many of its triangles have an area; the others are not seen."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return int((np.cross(b - a, c - a) != 0.0).any(axis=1).sum())


def _casters(scene: Scene) -> int:
    meshes = sum(1 for mesh in scene.meshes if mesh.casts_shadows and len(mesh.faces))
    return meshes + sum(1 for sphere in scene.spheres if sphere.casts_shadows)


def has_highlight(material: Material) -> bool:
    """Whether light makes a highlight on it: Ashikhmin and Shirley's base always has one at grazing angles."""
    return material.specular != BLACK or material.base == "ashikhmin-shirley"


def _takes_light(material: Material) -> bool:
    return material.diffuse != BLACK or has_highlight(material)


def _shows_its_normal(material: Material, lit: bool, scene: Scene) -> bool:
    """Whether where a surface faces changes its looks: under lights, or as a mirror or a boundary."""
    turned = material.base == "ashikhmin-shirley" and scene.surroundings.ambient != BLACK
    return (lit and _takes_light(material)) or turned or material.reflection != BLACK or is_boundary(material)


def is_boundary(material: Material) -> bool:
    """Whether Fresnel's equations mirror a part of the light (not where the index stays the same)."""
    return material.transmission != BLACK and (material.ior != 1.0 or material.priority is not None)


def without_unseen(scene: Scene) -> Scene:
    """`scene` without what nothing is seen of: it lets all light through, unbent, and adds none; nor shades anything.

    Left in it would cost rays, and these would start anew behind it, rounded.
    """
    meshes = tuple(mesh for mesh in scene.meshes if not _is_unseen(mesh.material))
    spheres = tuple(sphere for sphere in scene.spheres if not _is_unseen(sphere.material))
    return (
        scene
        if len(meshes) + len(spheres) == len(scene.meshes) + len(scene.spheres)
        else (dataclasses.replace(scene, meshes=meshes, spheres=spheres))
    )


def _is_unseen(material: Material) -> bool:
    """Whether a surface of it changes nothing for any ray."""
    added = (material.diffuse, material.specular, material.reflection, material.emission)
    clear = material.transmission == WHITE and material.ior == 1.0 and material.priority is None
    return clear and material.base == "phong" and all(share == BLACK for share in added)


def _named_lights(lights: Sequence[Light]) -> str:
    """How many lights of each kind."""
    kinds = {PointLight: "point light", RectangleLight: "rectangle light", SphereLight: "sphere light"}
    counts = Counter(kinds[type(light)] for light in lights)
    return " and ".join(_count(number, kind) for kind, number in sorted(counts.items()))


def _bearers(called_by: list[Material], users: dict[Material, Counter[str]]) -> str:
    """What has these materials."""
    parts = []
    for material in called_by[:3]:
        bearers = " and ".join(_count(number, kind) for kind, number in sorted(users[material].items()))
        parts.append(f"{bearers} of material {material.name!r}")
    if len(called_by) > 3:
        parts.append(_count(len(called_by) - 3, "more material"))
    return "; ".join(parts)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
