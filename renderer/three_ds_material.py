"""Materials of 3DS files as this renderer's materials.

| 3DS | becomes |
|---|---|
| diffuse colour, texture map 1 | diffuse, diffuse_texture (then diffuse is 1) |
| specular colour, shininess strength | specular = colour * strength / pi |
| specular map | specular_texture, laid on as texture map 1 (then the specular colour is 1) |
| shininess s | shininess = 2^(10 s) |
| transparency t | transmission = t with ior 1; what is let through is taken from the diffuse |
| self-illumination e | emission = e * diffuse |

Colours are display codes, turned into linear light. All other maps are left out.

Source: 3D Studio File Toolkit, 1996; J. E. Hoffmann and J. Kyprianidis, lib3ds (the exponent).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from renderer.scene import BLACK, Material, Rgb
from renderer.texture_search import TextureSearch
from renderer.three_ds_chunk import Chunk

_NAME: Final = 0xA000
_DIFFUSE, _SPECULAR = 0xA020, 0xA030
_SHININESS, _STRENGTH, _TRANSPARENCY, _SELF_ILLUMINATION = 0xA040, 0xA041, 0xA050, 0xA084
_TEXTURE, _SPECULAR_MAP, _MAP_NAME = 0xA200, 0xA204, 0xA300
_V_SCALE, _U_SCALE, _U_OFFSET, _V_OFFSET = 0xA354, 0xA356, 0xA358, 0xA35A

_GREY: Final[Rgb] = (0.8, 0.8, 0.8)
_WHITE: Final[Rgb] = (1.0, 1.0, 1.0)

LARGEST_UV: Final = 1e6
"""Largest scale and offset of a texture."""


@dataclass(frozen=True, slots=True)
class ThreeDsMaterial:
    """A material, and how its texture is laid on: uv * scale + offset, v up."""

    material: Material
    uv_scale: tuple[float, float] = (1.0, 1.0)
    uv_offset: tuple[float, float] = (0.0, 0.0)


def read_material(chunk: Chunk, textures: TextureSearch) -> ThreeDsMaterial:
    """The material of a material entry.

    Raises:
        SceneError: naming the file and the chunk.
    """
    name, diffuse, specular = "", _GREY, BLACK
    shares = {_SHININESS: 0.5, _STRENGTH: 1.0, _TRANSPARENCY: 0.0, _SELF_ILLUMINATION: 0.0}
    texture_name, shine_name = "", ""
    laid: dict[int, float] = {}
    for part in chunk.chunks():
        if part.kind == _NAME:
            name = part.text()[0]
        elif part.kind == _DIFFUSE:
            diffuse = part.color(diffuse)
        elif part.kind == _SPECULAR:
            specular = part.color(specular)
        elif part.kind in shares:
            shares[part.kind] = part.share(shares[part.kind])
        elif part.kind == _TEXTURE:
            texture_name, laid = _texture_map(part)
        elif part.kind == _SPECULAR_MAP:
            shine_name, _ = _texture_map(part)
    texture = textures.load(texture_name) if texture_name else None
    if texture is not None:
        diffuse = _WHITE
    shine = textures.load(shine_name) if shine_name else None
    if shine is not None:
        specular = _WHITE
    clear = shares[_TRANSPARENCY]
    material = Material(
        name,
        diffuse=_scaled(diffuse, 1.0 - clear),
        specular=_scaled(specular, shares[_STRENGTH] / math.pi),
        shininess=2.0 ** (10.0 * shares[_SHININESS]),
        emission=_scaled(diffuse, shares[_SELF_ILLUMINATION]),
        transmission=(clear, clear, clear),
        ior=1.0 if clear > 0.0 else 1.5,
        diffuse_texture=texture,
        specular_texture=shine,
    )
    return ThreeDsMaterial(
        material,
        (laid.get(_U_SCALE, 1.0), laid.get(_V_SCALE, 1.0)),
        (laid.get(_U_OFFSET, 0.0), laid.get(_V_OFFSET, 0.0)),
    )


def _texture_map(chunk: Chunk) -> tuple[str, dict[int, float]]:
    """The file of a texture map, and its scales and offsets."""
    name, laid = "", {}
    for part in chunk.chunks():
        if part.kind == _MAP_NAME:
            name = part.text()[0]
        elif part.kind in (_V_SCALE, _U_SCALE, _U_OFFSET, _V_OFFSET):
            value = float(part.floats(1)[0][0])
            if np.abs(value) <= LARGEST_UV:
                laid[part.kind] = value
    return name, laid


def _scaled(colour: Rgb, factor: float) -> Rgb:
    return colour[0] * factor, colour[1] * factor, colour[2] * factor
