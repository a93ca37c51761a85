"""A prepared scene with effects forced on or off, sharing everything else with the scene it comes from.

Forced on, `shadows` and `soft_shadows` make every light and every object cast them, whatever the author
says; any other effect runs on every surface and, where nothing calls for it, brings nothing but its cost.
"""

from __future__ import annotations

import dataclasses

from renderer.atlas import FLAT_ROW, WHITE_ROW
from renderer.effect_choice import EffectChoice
from renderer.effects import forced_plan
from renderer.intersection import Intersector
from renderer.material_table import calls_of, used_materials
from renderer.prepared import PreparedScene, Sieve, prepare

MOST_VARIANTS = 8
"""Variants of a scene that are kept; they are cheap to make."""

CASTING = frozenset({"shadows", "soft_shadows"})
"""Effects that have everything cast shadows where they are forced on."""

LOOKED_UP = {
    "textures": (("picture", "specular_picture"), WHITE_ROW),
    "cutouts": (("alpha_picture",), WHITE_ROW),
    "normal_maps": (("normal_picture",), FLAT_ROW),
}
"""Fields of the material table that name a texture, by effect, and what stands in for one."""


def with_effects(prepared: PreparedScene, choice: EffectChoice) -> PreparedScene:
    """`prepared` with the effects of `choice` forced on or off; itself where that is nothing."""
    if not choice:
        return prepared
    variant = prepared.variants.get(choice)
    if variant is None:
        if len(prepared.variants) >= MOST_VARIANTS:
            prepared.variants.clear()
        variant = prepared.variants[choice] = _forced(prepared, choice)
    return variant


def _forced(prepared: PreparedScene, choice: EffectChoice) -> PreparedScene:
    plan = forced_plan(prepared.plan, choice)
    surfaces, intersector = prepared.surfaces, prepared.intersector
    materials = surfaces.materials.copy()
    materials["calls"] = [calls_of(material, plan) for material in used_materials(prepared.scene)]
    for effect, (names, stand_in) in LOOKED_UP.items():
        for name in names:
            if effect not in plan.names:
                materials[name] = -1
            elif effect in plan.forced:
                materials[name][materials[name] == -1] = len(surfaces.textures.pictures) + stand_in
    lights, area_lights = surfaces.lights.copy(), surfaces.area_lights.copy()
    for table, effect in ((lights, "shadows"), (area_lights, "soft_shadows")):
        if effect not in plan.names:
            table["casts"] = 0
        elif effect in plan.forced:
            table["casts"] = 1
    sieve = prepared.sieve
    if plan.forced & CASTING:
        intersector, sieve = _all_casting(prepared)
    if sieve is not None:
        sieve = sieve._replace(surfaces=sieve.surfaces._replace(materials=materials, textures=surfaces.textures))
    return dataclasses.replace(
        prepared,
        plan=plan,
        surfaces=surfaces._replace(materials=materials, lights=lights, area_lights=area_lights),
        intersector=intersector,
        sieve=sieve,
        variants={},
    )


def _all_casting(prepared: PreparedScene) -> tuple[Intersector, Sieve | None]:
    """What answers rays where everything casts shadows; variants share it, since it may hold all triangles again."""
    for variant in list(prepared.variants.values()):
        if variant.plan.forced & CASTING:
            return variant.intersector, variant.sieve
    if "cutouts" not in prepared.plan.names:
        return prepared.intersector.all_casting(), None
    scene = prepared.scene
    meshes = tuple(dataclasses.replace(mesh, casts_shadows=True) for mesh in scene.meshes)
    spheres = tuple(dataclasses.replace(sphere, casts_shadows=True) for sphere in scene.spheres)
    casting = prepare(dataclasses.replace(scene, meshes=meshes, spheres=spheres))
    return casting.intersector, casting.sieve
