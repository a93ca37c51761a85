"""A prepared scene with effects forced on or off, sharing everything else with the scene it comes from.

Forced on, `shadows` and `soft_shadows` make every light and every object cast them, whatever the author
says; any other effect runs on every surface and, where nothing calls for it, brings nothing but its cost.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np

from renderer.atlas import Reading, build_atlas
from renderer.effect_choice import EffectChoice
from renderer.effects import forced_plan
from renderer.intersection import Intersector
from renderer.material_table import calls_of, readings_of, used_materials
from renderer.prepared import PreparedScene, Sieve, prepare
from renderer.scene import Texture

MOST_VARIANTS = 8
"""Variants of a scene that are kept; they are cheap to make."""

WHITE = Reading(Texture(np.full((1, 1, 3), 255, dtype=np.uint8), "white"))
FLAT = Reading(Texture(np.array([[[128, 128, 255]]], dtype=np.uint8), "flat"), normals=True)
"""What surfaces without a texture, or without a normal map, look up where these are forced on."""

LOOKED_UP = {
    "textures": (("picture", "specular_picture"), WHITE),
    "cutouts": (("alpha_picture",), WHITE),
    "normal_maps": (("normal_picture",), FLAT),
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
    textures = surfaces.textures
    if plan.forced & LOOKED_UP.keys():
        used = used_materials(prepared.scene)
        shown = itertools.chain(*(readings_of(material, prepared.plan) for material in used))
        textures, picture = build_atlas([*dict.fromkeys(shown), WHITE, FLAT])
    for effect, (names, stand_in) in LOOKED_UP.items():
        for name in names:
            if effect not in plan.names:
                materials[name] = -1
            elif effect in plan.forced:
                materials[name][materials[name] == -1] = picture[stand_in]
    lights, area_lights = surfaces.lights.copy(), surfaces.area_lights.copy()
    for table, effect in ((lights, "shadows"), (area_lights, "soft_shadows")):
        if effect not in plan.names:
            table["casts"] = 0
        elif effect in plan.forced:
            table["casts"] = 1
    sieve = prepared.sieve
    if plan.forced & {"shadows", "soft_shadows"}:
        intersector, sieve = _all_casting(prepared)
    if sieve is not None:
        sieve = sieve._replace(surfaces=sieve.surfaces._replace(materials=materials, textures=textures))
    return dataclasses.replace(
        prepared,
        plan=plan,
        surfaces=surfaces._replace(materials=materials, lights=lights, area_lights=area_lights, textures=textures),
        intersector=intersector,
        sieve=sieve,
        variants={},
    )


def _all_casting(prepared: PreparedScene) -> tuple[Intersector, Sieve | None]:
    """What answers rays where everything casts shadows."""
    if "cutouts" not in prepared.plan.names:
        return prepared.intersector.all_casting(), None
    scene = prepared.scene
    meshes = tuple(dataclasses.replace(mesh, casts_shadows=True) for mesh in scene.meshes)
    spheres = tuple(dataclasses.replace(sphere, casts_shadows=True) for sphere in scene.spheres)
    casting = prepare(dataclasses.replace(scene, meshes=meshes, spheres=spheres))
    return casting.intersector, casting.sieve
