"""Materials of OBJ files (.mtl) as this renderer's materials.

The statements `Kd Ks Ns Ke illum Ni Tf d Tr map_Kd map_Ks map_d norm` are
honoured, in any case of letters; `map_Kn` is another name of `norm`, a normal map. All others are
skipped, also the heights of `map_Bump`, and so are the options of maps but for `-clamp on`. A highlight `Ks` is
meant relative to `Kd` under the same light, so it becomes specular = Ks/pi.

| illum | becomes |
|---|---|
| 0 | a constant colour: emission = Ke + Kd, no diffuse (with a texture: as 1, emission has none) |
| 1 | diffuse = Kd |
| 2, 10 or none | diffuse = Kd, specular = Ks/pi, shininess = Ns |
| 3, 5, 8 | as 2, and a mirror: reflection = Ks |
| 6, 7 | as 2, and glass: transmission = Tf, or 1 - d where d < 1, or 1; ior = Ni, or 1.5 without it |
| 4, 9 | as 6, seen straight through: ior = Ni where that is above 1, else 1 |

With any other illum, d < 1 lets through 1 - d with ior 1. What is let through is taken from the
diffuse: diffuse = Kd * (1 - transmission). Tr is 1 - d, and gives way to d. Without Kd it is 0.8, or 1
under a texture; without Ks it is 0, or 1 under a texture. Reflectances above 1 count as 1. `map_d` cuts holes
where it is below one half: its alpha, or without alpha its green.

Source: B. Fedosejevs, MTL material format (Lightwave, OBJ), 1995, sections "Material color and
illumination statements" and "Illumination models".
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field

from renderer.codec import decode_texture
from renderer.errors import SceneError, SettingsError
from renderer.folder import Folder
from renderer.scene import BLACK, MAX_RADIANCE, MAX_SHININESS, Material, Rgb, Texture

GLASS_IOR = 1.5
"""Index of refraction of glass whose file states none."""

_HONOURED = frozenset({"kd", "ks", "ke", "tf", "ns", "ni", "d", "tr", "illum"})
_MAPS = frozenset({"map_kd", "map_ks", "map_d", "norm", "map_kn"})
_WHITE: Rgb = (1.0, 1.0, 1.0)
_MIRRORS = (3, 5, 8)
_GLASS = (4, 6, 7, 9)
_SEE_THROUGH = (4, 9)

_OPTION_VALUES = {
    "-blendu": 1, "-blendv": 1, "-boost": 1, "-bm": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2,
    "-texres": 1, "-type": 1,
}  # fmt: skip
_OPTION_POINTS = ("-o", "-s", "-t")


@dataclass(slots=True)
class _Statements:
    """One `newmtl` block as read so far; None where the file is silent."""

    kd: Rgb | None = None
    ks: Rgb | None = None
    ke: Rgb = BLACK
    tf: Rgb | None = None
    ns: float = 32.0
    ni: float | None = None
    d: float | None = None
    tr: float | None = None
    illum: int = 2
    maps: dict[str, Texture] = field(default_factory=dict)


@dataclass(slots=True)
class _Reader:
    """The state of reading one .mtl file."""

    folder: Folder
    inner: str
    blocks: dict[str, _Statements] = field(default_factory=dict)
    block: _Statements | None = None
    textures: dict[tuple[str, bool], Texture] = field(default_factory=dict)

    def statement(self, words: list[str], line: str, where: str) -> None:
        """Take in one line."""
        key = words[0].lower()
        if key == "newmtl":
            self.block = self.blocks[" ".join(words[1:])] = _Statements()
        elif key not in _HONOURED | _MAPS:
            return
        elif self.block is None:
            raise SceneError(f"{where}: expected newmtl before any other statement, found {words[0]!r}")
        elif key in _MAPS:
            self.block.maps[key] = self._texture(line, f"{where}: {words[0]}")
        else:
            _set(self.block, key, words[1:], f"{where}: {words[0]}")

    def _texture(self, line: str, where: str) -> Texture:
        name, clamped = _file_name(line)
        data, inner = self.folder.read(name, where, self.inner)
        if (inner, clamped) not in self.textures:
            wrap = "clamp" if clamped else "repeat"
            texture = decode_texture(data, self.folder.file_label(inner), self.folder.max_texture_pixels)
            self.textures[inner, clamped] = dataclasses.replace(texture, wrap_u=wrap, wrap_v=wrap)
        return self.textures[inner, clamped]


def read_mtl(folder: Folder, data: bytes, inner: str) -> dict[str, Material]:
    """The materials of a .mtl file, by name.

    Args:
        folder: where its textures may lie.
        data: the file.
        inner: its path from the folder's root; textures are named relative to it.

    Raises:
        SceneError: naming the file and the line.
    """
    reader = _Reader(folder, inner)
    label = folder.file_label(inner)
    for number, raw in enumerate(decode_text(data).split("\n"), start=1):
        line = raw.strip()
        if line and not line.startswith("#"):
            reader.statement(line.split(), line, f"{label}: line {number}")
    try:
        return {name: _material(name, block) for name, block in reader.blocks.items()}
    except SettingsError as error:
        raise SceneError(f"{label}: {error}") from None


def decode_text(data: bytes) -> str:
    """Text of an OBJ or MTL file, its lines ended by line feeds alone.

    UTF-8 or, by its byte-order mark, UTF-16; anything else counts as Latin-1, where every byte is a letter.
    """
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _material(name: str, block: _Statements) -> Material:
    texture, shine = block.maps.get("map_kd"), block.maps.get("map_ks")
    diffuse = _at_most_1(block.kd or ((0.8, 0.8, 0.8) if texture is None else _WHITE))
    ks = block.ks or (BLACK if shine is None else _WHITE)
    shiny = block.illum >= 2
    if block.illum == 0 and texture is None:
        er, eg, eb = (min(a + b, MAX_RADIANCE) for a, b in zip(diffuse, block.ke, strict=True))
        return Material(name, diffuse=BLACK, emission=(er, eg, eb))
    transmission = _transmission(block)
    r, g, b = (full * (1.0 - through) for full, through in zip(diffuse, transmission, strict=True))
    sr, sg, sb = (highlight / math.pi for highlight in ks)
    return Material(
        name,
        diffuse=(r, g, b),
        specular=(sr, sg, sb) if shiny else BLACK,
        shininess=block.ns,
        emission=block.ke,
        reflection=_at_most_1(ks) if block.illum in _MIRRORS else BLACK,
        transmission=transmission,
        ior=_ior(block),
        diffuse_texture=texture,
        specular_texture=shine,
        alpha_texture=block.maps.get("map_d"),
        normal_texture=block.maps.get("norm", block.maps.get("map_kn")),
    )


def _transmission(block: _Statements) -> Rgb:
    opacity = block.d if block.d is not None else 1.0 - (block.tr or 0.0)
    clear = 1.0 - opacity
    if block.illum not in _GLASS:
        return (clear, clear, clear)
    if block.tf is not None:
        return _at_most_1(block.tf)
    return (clear, clear, clear) if clear > 0.0 else (1.0, 1.0, 1.0)


def _ior(block: _Statements) -> float:
    if block.illum not in _GLASS:
        return 1.0
    if block.illum in _SEE_THROUGH:
        return max(block.ni or 1.0, 1.0)
    return GLASS_IOR if block.ni is None else block.ni


def _at_most_1(value: Rgb) -> Rgb:
    red, green, blue = (min(part, 1.0) for part in value)
    return red, green, blue


def _file_name(line: str) -> tuple[str, bool]:
    """The file of a map, which may hold blanks, without the options before it; and whether one is `-clamp on`."""
    rest, clamped = _after_key(line), False
    while rest.startswith("-"):
        words = rest.split(None, 1)
        option, rest = words[0].lower(), words[1] if len(words) > 1 else ""
        if option not in _OPTION_VALUES and option not in _OPTION_POINTS:
            return f"{option} {rest}".strip(), clamped
        if option == "-clamp":
            clamped = rest.lower().startswith("on")
        taken = 0
        while rest and taken < (_OPTION_VALUES.get(option) or 3):
            words = rest.split(None, 1)
            if option in _OPTION_POINTS and not _is_number(words[0]):
                break
            rest = words[1] if len(words) > 1 else ""
            taken += 1
    return rest, clamped


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _after_key(line: str) -> str:
    parts = line.split(None, 1)
    return parts[1] if len(parts) > 1 else ""


def _set(block: _Statements, key: str, words: list[str], where: str) -> None:
    """Take in one statement other than newmtl and maps."""
    match key:
        case "kd":
            block.kd = _rgb(words, where)
        case "ks":
            block.ks = _rgb(words, where)
        case "ke":
            block.ke = _rgb(words, where)
        case "tf":
            block.tf = _rgb(words, where)
        case "ns":
            block.ns = _number(words, where, MAX_SHININESS)
        case "ni":
            block.ni = _number(words, where, 10.0)
        case "d":
            block.d = _number(words[-1:], where, 1.0)
        case "tr":
            block.tr = _number(words, where, 1.0)
        case "illum":
            block.illum = int(_number(words, where, 10.0))


def _number(words: list[str], where: str, high: float) -> float:
    try:
        value = float(" ".join(words))
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= high:
        raise SceneError(f"{where}: expected a number from 0 to {high:g}, found {' '.join(words)!r}")
    return value


def _rgb(words: list[str], where: str) -> Rgb:
    if len(words) not in (1, 3):
        raise SceneError(f"{where}: expected red, green and blue, found {' '.join(words)!r}")
    red, green, blue = (_number([word], where, MAX_RADIANCE) for word in (words if len(words) == 3 else words * 3))
    return red, green, blue
