"""A prepared scene with effects forced on or off, sharing everything else with the scene it comes from.

Forced on, `shadows` and `soft_shadows` make every light and every object cast them, whatever the author
says; any other effect runs on every surface and, where nothing calls for it, brings nothing but its cost.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np

from renderer.atlas import build_atlas
from renderer.effect_choice import EffectChoice
from renderer.effects import forced_plan, pictures_of
from renderer.intersection import Intersector
from renderer.prepared import PreparedScene, Sieve, calls_of, prepare, used_materials
from renderer.scene import Texture

MOST_VARIANTS = 8
"""Variants of a scene that are kept; they are cheap to make."""

PICTURES = ("picture", "specular_picture")
HOLES = ("alpha_picture",)
"""Fields of the material table that name a texture, for colours and for holes."""

WHITE = Texture(np.full((1, 1, 3), 255, dtype=np.uint8), "white")
"""What surfaces without a texture look up where textures are forced on."""


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
    if "textures" not in plan.names:
        for name in PICTURES:
            materials[name] = -1
    if "cutouts" not in plan.names:
        materials["alpha_picture"] = -1
    if plan.forced & {"textures", "cutouts"}:
        shown = itertools.chain(*(pictures_of(material) for material in used_materials(prepared.scene)))
        textures, picture = build_atlas([*dict.fromkeys(shown), WHITE])
        for name in (*(PICTURES if "textures" in plan.forced else ()), *(HOLES if "cutouts" in plan.forced else ())):
            materials[name][materials[name] == -1] = picture[WHITE]
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
