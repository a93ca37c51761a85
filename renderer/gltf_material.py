"""glTF's metallic-roughness materials as this renderer's materials.

| glTF | becomes |
|---|---|
| baseColorFactor, baseColorTexture | diffuse, diffuse_texture |
| metallicFactor m, roughnessFactor r | mirror share s = m (1 - r)^2: reflection = s base, diffuse = (1 - s) base |
| roughness r | shininess n = 2 / max(r, 0.1)^4 - 2 (Walter et al. 2007: alpha = r^2) |
| F0 = 0.04 (1 - m) + m base | specular = F0 (n + 1) / (2 pi), a lobe whose integral is F0 |
| emissiveFactor, KHR_materials_emissive_strength | emission |
| KHR_materials_transmission t | transmission = t (1 - m) base |
| KHR_materials_ior | ior, 1.5 unless stated, where KHR_materials_volume has a thickness; else 1, a thin sheet |
| alphaMode MASK | holes where the alpha of the base colour is below alphaCutoff |
| alphaMode BLEND, alpha a | where t = 0: transmission = 1 - a with ior 1; holes where its texture is below 1/2 |
| normalTexture, its scale | normal_texture, normal_scale, where it is laid on like the base colour texture |
| KHR_materials_unlit | emission = base, no diffuse (with a texture it is lit: emission has none) |

What is let through is taken from the diffuse. Of the metallic-roughness and emissive textures, and of the
base colour texture where it tints a mirror or glass, the mean counts. Occlusion maps are skipped.

Source: Khronos glTF 2.0 specification, section 3.9 and appendix B; the extensions' own documents.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.errors import SettingsError
from renderer.fields import Fields
from renderer.scene import BLACK, MAX_NORMAL_SCALE, MAX_RADIANCE, Material, Rgb, Texture
from renderer.texture import srgb_to_linear

MIN_ROUGHNESS: Final = 0.1
"""Roughness below which a highlight is not made smaller: it would slip between the rays."""

MAX_UV: Final = 1e6
"""Largest offset and scale of a texture transform."""

_WHITE: Final[Rgb] = (1.0, 1.0, 1.0)
_LOAD = Callable[[Fields], Texture]


@dataclass(frozen=True, eq=False, slots=True)
class GltfMaterial:
    """A material, and how its texture is laid on.

    Attributes:
        material: as the renderer sees it.
        texcoord: which set of texture coordinates its textures take.
        uv_transform: (2, 3) float64 matrix for (u, v, 1), v down as in glTF; None for none.
        notes: what was left out, for people.
    """

    material: Material
    texcoord: int = 0
    uv_transform: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()


def read_material(fields: Fields, name: str, load: _LOAD) -> GltfMaterial:
    """The material of one entry of `materials`.

    Args:
        fields: the entry.
        name: for messages.
        load: the texture that a textureInfo object points at.

    Raises:
        SceneError: naming the file and the field.
    """
    pbr, extensions = fields.table("pbrMetallicRoughness"), fields.table("extensions")
    red, green, blue, alpha = pbr.numbers("baseColorFactor", 4, 0.0, 1.0, (1.0, 1.0, 1.0, 1.0))
    base: Rgb = (red, green, blue)
    info = pbr.table("baseColorTexture") if "baseColorTexture" in pbr else None
    texture = load(info) if info is not None else None
    bumps = fields.table("normalTexture") if "normalTexture" in fields else None
    laid_on = info if info is not None else bumps
    texcoord, uv_transform = _laid_on(laid_on) if laid_on is not None else (0, None)
    notes: tuple[str, ...] = ()
    if bumps is not None and not _same_place(_laid_on(bumps), (texcoord, uv_transform)):
        bumps = None
        notes = (f"material {name!r}: a normal map that is laid on otherwise than the colours is left out",)
    if "KHR_materials_unlit" in extensions and texture is None:
        return GltfMaterial(Material(name, diffuse=BLACK, emission=base))
    tint = base if texture is None else _times(base, _mean_light(texture))
    metallic, roughness = _metallic_roughness(pbr, load)
    share = metallic * (1.0 - roughness) ** 2
    stated_ior = extensions.table("KHR_materials_ior").number("ior", 0.0, 10.0, 1.5) or 1.5
    transmission, ior = _transmission(extensions, tint, metallic, stated_ior)
    mode = fields.choice("alphaMode", ("OPAQUE", "MASK", "BLEND"), "OPAQUE")
    if transmission == BLACK and mode == "BLEND":
        transmission, ior = (1.0 - alpha, 1.0 - alpha, 1.0 - alpha), 1.0
    cutoff = 0.5
    if mode == "MASK":
        cutoff = min(1.0, fields.number("alphaCutoff", 0.0, 1e30, 0.5) / max(alpha, 1e-9))
    exponent = 2.0 / max(roughness, MIN_ROUGHNESS) ** 4 - 2.0
    head_on = ((stated_ior - 1.0) / (stated_ior + 1.0)) ** 2
    mirrored = _mixed((head_on, head_on, head_on), tint, metallic)
    try:
        material = Material(
            name,
            diffuse=_times(_scaled(base, 1.0 - share), (1 - transmission[0], 1 - transmission[1], 1 - transmission[2])),
            specular=_scaled(mirrored, (exponent + 1.0) / (2.0 * math.pi)),
            shininess=exponent,
            emission=_emission(fields, extensions, load),
            reflection=_scaled(tint, share),
            transmission=transmission,
            ior=ior,
            diffuse_texture=texture,
            alpha_texture=texture if mode != "OPAQUE" and texture is not None and texture.alpha is not None else None,
            alpha_cutoff=cutoff,
            normal_texture=load(bumps) if bumps is not None else None,
            normal_scale=bumps.number("scale", -MAX_NORMAL_SCALE, MAX_NORMAL_SCALE, 1.0) if bumps is not None else 1.0,
        )
    except SettingsError as error:
        raise fields.in_file(error) from None
    return GltfMaterial(material, texcoord, uv_transform, notes)


def _metallic_roughness(pbr: Fields, load: _LOAD) -> tuple[float, float]:
    metallic = pbr.number("metallicFactor", 0.0, 1.0, 1.0)
    roughness = pbr.number("roughnessFactor", 0.0, 1.0, 1.0)
    if "metallicRoughnessTexture" in pbr:
        _, green, blue = load(pbr.table("metallicRoughnessTexture")).pixels.mean(axis=(0, 1)) / 255.0
        metallic, roughness = metallic * float(blue), roughness * float(green)
    return metallic, roughness


def _transmission(extensions: Fields, tint: Rgb, metallic: float, ior: float) -> tuple[Rgb, float]:
    """Share let through, and the index of refraction behind the surface."""
    through = extensions.table("KHR_materials_transmission").number("transmissionFactor", 0.0, 1.0, 0.0)
    inside = extensions.table("KHR_materials_volume").number("thicknessFactor", 0.0, 1e30, 0.0) > 0.0
    share = through * (1.0 - metallic)
    return (_scaled(tint, share), ior if inside else 1.0) if share > 0.0 else (BLACK, 1.0)


def _emission(fields: Fields, extensions: Fields, load: _LOAD) -> Rgb:
    emission = fields.rgb("emissiveFactor", 1.0, BLACK)
    if emission == BLACK:
        return BLACK
    if "emissiveTexture" in fields:
        emission = _times(emission, _mean_light(load(fields.table("emissiveTexture"))))
    strength = extensions.table("KHR_materials_emissive_strength").number("emissiveStrength", 0.0, MAX_RADIANCE, 1.0)
    return _scaled(emission, strength)


_Place = tuple[int, NDArray[np.float64] | None]


def _same_place(a: _Place, b: _Place) -> bool:
    """Whether two textures are laid on alike."""
    if a[1] is None or b[1] is None:
        return a[0] == b[0] and a[1] is b[1]
    return a[0] == b[0] and np.array_equal(a[1], b[1])


def _laid_on(info: Fields) -> _Place:
    """The set of texture coordinates of a texture, and their transform (KHR_texture_transform)."""
    texcoord = info.integer("texCoord", 0, 63, 0)
    extensions = info.table("extensions")
    if "KHR_texture_transform" not in extensions:
        return texcoord, None
    stated = extensions.table("KHR_texture_transform")
    texcoord = stated.integer("texCoord", 0, 63, texcoord)
    du, dv = stated.numbers("offset", 2, -MAX_UV, MAX_UV, (0.0, 0.0))
    su, sv = stated.numbers("scale", 2, -MAX_UV, MAX_UV, (1.0, 1.0))
    angle = stated.number("rotation", -1e6, 1e6, 0.0)
    cos, sin = math.cos(angle), math.sin(angle)
    return texcoord, np.array([[cos * su, sin * sv, du], [-sin * su, cos * sv, dv]])


def _mean_light(texture: Texture) -> Rgb:
    """Mean linear colour of a texture."""
    linear = srgb_to_linear(np.arange(256) / 255.0)
    flat = texture.pixels.reshape(-1, 3)
    red, green, blue = (
        float(np.bincount(flat[:, channel], minlength=256) @ linear) / len(flat) for channel in range(3)
    )
    return red, green, blue


def _scaled(colour: Rgb, factor: float) -> Rgb:
    return colour[0] * factor, colour[1] * factor, colour[2] * factor


def _times(a: Rgb, b: Rgb) -> Rgb:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def _mixed(a: Rgb, b: Rgb, share: float) -> Rgb:
    return (
        a[0] + (b[0] - a[0]) * share,
        a[1] + (b[1] - a[1]) * share,
        a[2] + (b[2] - a[2]) * share,
    )
