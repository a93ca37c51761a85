"""The materials of a scene as the kernels read them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.atlas import Reading
from renderer.effects import EffectPlan, has_bumps, has_highlight, has_holes, is_boundary, pictures_of
from renderer.scene import Material, Scene

SPECULAR = 1
MIRROR = 2
BOUNDARY = 4
LIT = 8
REFRACTS = 16
MIRROR_ANYWAY = 32
REFRACTS_ANYWAY = 64
MICROFACETS = 256
GRAINED = 512
SPAWNS = MIRROR | REFRACTS | MIRROR_ANYWAY | REFRACTS_ANYWAY
"""Bits of what a material calls for: a `BOUNDARY` mirrors by Fresnel's equations, `REFRACTS` sends rays through
it; the two `ANYWAY` send rays though they bring nothing, as forced effects do; `MICROFACETS` is the base of
Ashikhmin and Shirley, `GRAINED` a tangent."""

_COLOURS = [
    (f"{name}_{channel}", np.float32)
    for name in ("diffuse", "specular", "emission", "reflection", "transmission")
    for channel in ("red", "green", "blue")
]

MATERIAL = np.dtype(
    [
        *_COLOURS,
        *((name, np.float32) for name in ("shininess", "ior", "exponent_u", "exponent_v")),
        ("alpha_cutoff", np.float32),
        ("normal_scale", np.float32),
        *((name, np.int32) for name in ("picture", "specular_picture", "alpha_picture", "normal_picture")),
        ("calls", np.int32),
        ("medium", np.int32),
    ]
)
"""One material as the kernels read it; pictures are -1 without a texture, `calls` are the bits above,
`medium` is its number as a medium, 0 for none."""


def used_materials(scene: Scene) -> list[Material]:
    """Materials that a triangle or sphere has, each once, in order of first use."""
    used = dict.fromkeys(mesh.material for mesh in scene.meshes if len(mesh.faces))
    used.update(dict.fromkeys(sphere.material for sphere in scene.spheres))
    return list(used)


def readings_of(material: Material, plan: EffectPlan) -> list[Reading]:
    """What is looked up of a material's textures."""
    readings = [Reading(texture) for texture in pictures_of(material)]
    if material.normal_texture is not None and "normal_maps" in plan.names and has_bumps(material):
        readings.append(Reading(material.normal_texture, normals=True))
    return readings


def material_table(
    materials: list[Material], media: list[Material], picture: dict[Reading, int], plan: EffectPlan
) -> NDArray[np.void]:
    """(k,) MATERIAL.

    Args:
        materials: k of them.
        media: those of them that are media, by rank.
        picture: rows of the atlas, of all that is looked up.
        plan: what runs.
    """
    table = np.zeros(len(materials), dtype=MATERIAL)
    for row, material in enumerate(materials):
        for name in ("diffuse", "specular", "emission", "reflection", "transmission"):
            for channel, value in zip(("red", "green", "blue"), getattr(material, name), strict=True):
                table[row][f"{name}_{channel}"] = value
        for name in ("shininess", "ior", "exponent_u", "exponent_v", "alpha_cutoff", "normal_scale"):
            table[row][name] = getattr(material, name)
        holes = material.alpha_texture if "cutouts" in plan.names and has_holes(material) else None
        for name, texture in (
            ("picture", material.diffuse_texture),
            ("specular_picture", material.specular_texture),
            ("alpha_picture", holes),
            ("normal_picture", material.normal_texture),
        ):
            reading = Reading(texture, normals=name == "normal_picture") if texture else None
            table[row][name] = picture.get(reading, -1) if reading else -1
        table[row]["calls"] = calls_of(material, plan)
        table[row]["medium"] = media.index(material) + 1 if material in media else 0
    return table


def calls_of(material: Material, plan: EffectPlan) -> int:
    """The bits of what a material calls for, of what the plan lets run."""
    return (
        (SPECULAR if "specular" in plan.names and (has_highlight(material) or "specular" in plan.forced) else 0)
        | (MIRROR if "reflection" in plan.names and (any(material.reflection) or is_boundary(material)) else 0)
        | (MIRROR_ANYWAY if "reflection" in plan.forced else 0)
        | (BOUNDARY if any(material.transmission) else 0)
        | (REFRACTS if "refraction" in plan.names and any(material.transmission) else 0)
        | (REFRACTS_ANYWAY if "refraction" in plan.forced else 0)
        | (LIT if any(material.diffuse) or has_highlight(material) else 0)
        | (MICROFACETS if material.base == "ashikhmin-shirley" else 0)
        | (GRAINED if _is_grained(material) else 0)
    )


def _is_grained(material: Material) -> bool:
    """Whether it matters for its looks where the texture coordinate u runs."""
    return material.base == "ashikhmin-shirley" and material.exponent_u != material.exponent_v
