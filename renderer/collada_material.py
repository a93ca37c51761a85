"""Materials of COLLADA files (the common profile) as this renderer's materials.

| COLLADA | becomes |
|---|---|
| diffuse colour or texture | diffuse; diffuse_texture (then diffuse is 1) |
| specular colour or texture, of phong and blinn | specular = colour / pi; specular_texture (then 1 / pi) |
| shininess s, of phong | shininess = s; a value up to 1 counts as a share of 128 |
| shininess s, of blinn | shininess = s / 4, for the lobe round the half vector is that much narrower |
| emission | emission; of a texture nothing |
| reflective * reflectivity | reflection |
| transparent, transparency | transmission = 1 - opacity; ior = index_of_refraction where that is above 1, else 1 |
| constant | emission, no diffuse |

What is let through is taken from the diffuse. Opacity is the alpha of `transparent` times `transparency` (A_ONE,
the default), 1 minus that (A_ZERO), or the same of each colour (RGB_ONE, RGB_ZERO). A file in which some surface
has an opacity of 0 was written by an exporter that took opacity for its opposite: there all count as 1 minus what
is stated. Transparent textures are left out.

Source: Khronos, COLLADA 1.4.1 specification, chapter 8, and 1.5.0, chapter 8, "Determining transparency".
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from renderer.errors import SettingsError
from renderer.folder import percent_decoded
from renderer.scene import BLACK, MAX_SHININESS, Material, Rgb, Texture
from renderer.texture_search import TextureSearch
from renderer.xml_tree import Element

SHADERS: Final = ("phong", "blinn", "lambert", "constant")
"""Elements of the common profile that say how a surface looks."""

LARGEST_STATED: Final = 128.0
"""Shininess that a share of 1 stands for: the largest of the fixed-function pipeline."""

MAX_FOLLOWED: Final = 8
"""Most references from a texture to its image: sampler, surface, image."""

_GREY: Final = (0.8, 0.8, 0.8, 1.0)
_WHITE: Final[Rgb] = (1.0, 1.0, 1.0)
_Rgba = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class ColladaMaterial:
    """A material, and the name of the texture coordinates that its texture takes; empty for the first."""

    material: Material
    texcoord: str = ""


def mistakes_opacity(effects: Iterable[Element]) -> bool:
    """Whether some surface of a file would be invisible: its exporter wrote what is let through as opacity.

    Raises:
        SceneError: naming the file, the line and the element.
    """
    return any(
        max(_opacity(found)) == 0.0 for effect in effects for found in effect.descendants() if found.tag in SHADERS
    )


def read_effect(
    effect: Element, name: str, images: dict[str, Element], textures: TextureSearch, mistaken: bool
) -> ColladaMaterial:
    """The material that an effect describes.

    Args:
        effect: the element.
        name: for messages.
        images: the file's elements by id.
        textures: finds its textures.
        mistaken: whether the file `mistakes_opacity`.

    Raises:
        SceneError: naming the file, the line and the element.
    """
    shader = next((found for found in effect.descendants() if found.tag in SHADERS), None)
    if shader is None:
        return ColladaMaterial(Material(name))
    params = {found.attributes.get("sid", ""): found for found in effect.descendants() if found.tag == "newparam"}
    stated = shader.first("diffuse/texture")
    texture = None if stated is None else _texture(stated, params, images, textures)
    shiny = shader.tag in ("phong", "blinn")
    shown = shader.first("specular/texture") if shiny else None
    shine = None if shown is None else _texture(shown, params, images, textures)
    specular = _color(shader, "specular", (0.0, 0.0, 0.0, 1.0))[:3] if shine is None else _WHITE
    diffuse = _color(shader, "diffuse", _GREY if shader.tag != "constant" else (0.0, 0.0, 0.0, 1.0))[:3]
    if texture is not None:
        diffuse = _WHITE
    opacity = _opacity(shader)
    clear = opacity if mistaken and _states_opacity(shader) else (1.0 - opacity[0], 1.0 - opacity[1], 1.0 - opacity[2])
    ior = shader.number("index_of_refraction/float", 1.0)
    mirror = _color(shader, "reflective", (0.0, 0.0, 0.0, 1.0))[:3]
    try:
        material = Material(
            name,
            diffuse=_product(diffuse, (1.0 - clear[0], 1.0 - clear[1], 1.0 - clear[2])),
            specular=_scaled(specular, 1.0 / math.pi) if shiny else BLACK,
            shininess=_shininess(shader),
            emission=_color(shader, "emission", (0.0, 0.0, 0.0, 1.0))[:3],
            reflection=_scaled(mirror, _share(shader, "reflectivity", 0.0)),
            transmission=clear,
            ior=min(max(ior, 1.0), 10.0),
            diffuse_texture=texture,
            specular_texture=shine,
        )
    except SettingsError as error:
        raise shader.refuse(error.expected, f"{error.field} {error.found}") from None
    return ColladaMaterial(material, "" if stated is None else stated.attributes.get("texcoord", ""))


def _texture(
    stated: Element, params: dict[str, Element], images: dict[str, Element], textures: TextureSearch
) -> Texture | None:
    """The texture of a texture element: by way of sampler and surface, or straight by the image's id."""
    name = stated.attributes.get("texture", "").strip()
    for _ in range(MAX_FOLLOWED):
        param = params.get(name)
        if param is None:
            break
        sampler, surface = param.first("sampler2D"), param.first("surface/init_from")
        source = None if sampler is None else (sampler.first("source") or sampler.first("instance_image"))
        following = surface or source
        if following is None:
            break
        name = following.attributes.get("url", following.text).strip().removeprefix("#")
    image = images.get(name)
    path = None if image is None or image.tag != "image" else image.first("init_from")
    if path is None:
        textures.notes.append(f"texture left out: line {stated.line} names no image of the file: {name[:80]!r}")
        return None
    written = (path.first("ref") or path).text.strip()
    return textures.load(percent_decoded(written))


def _states_opacity(shader: Element) -> bool:
    return any(True for _ in shader.all("transparent", "transparency"))


def _opacity(shader: Element) -> Rgb:
    """Share held back, as the file states it; 1 where it states none."""
    if not _states_opacity(shader):
        return _WHITE
    transparent = shader.first("transparent")
    mode = "A_ONE" if transparent is None else transparent.attributes.get("opaque", "A_ONE")
    red, green, blue, alpha = _color(shader, "transparent", (1.0, 1.0, 1.0, 1.0))
    amount = _share(shader, "transparency", 1.0)
    parts = (red, green, blue) if mode.startswith("RGB") else (alpha, alpha, alpha)
    r, g, b = (1.0 - part * amount if mode.endswith("_ZERO") else part * amount for part in parts)
    return r, g, b


def _shininess(shader: Element) -> float:
    stated = min(max(shader.number("shininess/float", 32.0), 0.0), MAX_SHININESS)
    exponent = stated * LARGEST_STATED if stated <= 1.0 else stated
    return exponent / 4.0 if shader.tag == "blinn" else exponent


def _share(shader: Element, tag: str, default: float) -> float:
    return min(max(shader.number(f"{tag}/float", default), 0.0), 1.0)


def _color(shader: Element, tag: str, default: _Rgba) -> _Rgba:
    """The colour in a child, each part from 0 to 1; alpha 1 unless stated. A texture is no colour."""
    found = shader.first(f"{tag}/color")
    if found is None or not found.text.strip():
        return default
    values = found.floats()
    if len(values) not in (3, 4) or not np.isfinite(values).all():
        raise found.refuse("red, green, blue and alpha", found.text)
    red, green, blue, alpha = [*values.clip(0.0, 1.0).tolist(), 1.0][:4]
    return red, green, blue, alpha


def _scaled(colour: Rgb, factor: float) -> Rgb:
    return colour[0] * factor, colour[1] * factor, colour[2] * factor


def _product(a: Rgb, b: Rgb) -> Rgb:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]
