"""TOML text as values, bounded in size and nesting before the parser sees it.

tomllib takes time that grows with the square of a key's parts: 13 s for `a.a.a...` of 40 KB.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any, Final

from renderer.errors import SceneError

MAX_TOML_BYTES: Final = 4 << 20
"""Largest scene file: 4 MiB, some 40,000 spheres; one of that size takes seconds whatever it says."""

MAX_KEY_PARTS: Final = 16
"""Most parts of a key; none of a scene has more than three."""

_LONG_KEY: Final = re.compile(
    rf"""(?<![\w"'-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){{{MAX_KEY_PARTS}}}""",
)


def read_toml(data: bytes, file: str) -> dict[str, Any]:
    """The values of a TOML file.

    Args:
        data: its content, UTF-8.
        file: what messages call it.

    Raises:
        SceneError: naming the file, and for a mistake its line: text that is no TOML, too long, or keys of too
            many parts.
    """
    if len(data) > MAX_TOML_BYTES:
        raise SceneError(f"{file}: expected at most {MAX_TOML_BYTES} bytes, found {len(data)} bytes")
    try:
        text = data.decode("utf-8-sig")
        if found := _LONG_KEY.search(text):
            line = text.count("\n", 0, found.start()) + 1
            raise SceneError(f"{file}: line {line}: expected keys of at most {MAX_KEY_PARTS} parts, found more")
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError(f"{file}: expected TOML, found a mistake: {error}") from None
