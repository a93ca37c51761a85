"""Pictures small enough to be part of a page, and small parts of them unchanged."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

LARGEST_WIDTH_PX: Final = 1000
"""Widest picture on a page; a wider one is averaged down in linear light, by a whole factor."""

WINDOW_PX: Final = 160
"""Side of an enlarged part."""

WEBP: Final[dict[str, Any]] = {"quality": 84, "method": 0}
"""A tenth of the time that the thorough methods take, for 13 % more bytes."""

Window = tuple[int, int, int, int]
"""Left, top, right, bottom [px]."""


def read_picture(path: Path) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 sRGB of a PNG file."""
    from matplotlib.image import imread

    pixels = np.asarray(imread(path))[..., :3]
    codes: NDArray[np.uint8] = np.rint(255 * pixels).astype(np.uint8)
    return codes


def whole(pixels: NDArray[np.uint8]) -> str:
    """A picture, made smaller, as an address that holds it; WebP, with losses."""
    return _address(shrink(pixels, LARGEST_WIDTH_PX), "webp", WEBP)


def part(pixels: NDArray[np.uint8], window: Window) -> str:
    """A part of a picture as an address that holds it; PNG, without losses."""
    left, top, right, bottom = window
    return _address(pixels[top:bottom, left:right], "png", {})


def shrink(pixels: NDArray[np.uint8], largest_width: int) -> NDArray[np.uint8]:
    """The mean light of each square of pixels; the squares are as small as the width allows.

    Args:
        pixels: (h, w, 3) uint8 sRGB; rows and columns that fill no square are left out.
        largest_width: of what comes out [px].
    """
    height, width = pixels.shape[:2]
    factor = -(-width // largest_width)
    rows, columns = height // factor, width // factor
    if factor == 1 or rows == 0:
        return pixels
    light = _light_of_code()[pixels[: rows * factor, : columns * factor]]
    mean = light.reshape(rows, factor, columns, factor, 3).mean(axis=(1, 3))
    middles = (_light_of_code()[1:] + _light_of_code()[:-1]) / 2
    codes: NDArray[np.uint8] = np.searchsorted(middles, mean).astype(np.uint8)
    return codes


def window_around(x: float, y: float, width: int, height: int) -> Window:
    """The square of `WINDOW_PX` around a point, moved to lie on a screen of this size [px]."""
    across, down = min(WINDOW_PX, width), min(WINDOW_PX, height)
    left = int(np.clip(x - across / 2, 0, width - across))
    top = int(np.clip(y - down / 2, 0, height - down))
    return left, top, left + across, top + down


def _light_of_code() -> NDArray[np.float64]:
    """(256,) linear light of each code (IEC 61966-2-1)."""
    code = np.arange(256) / 255
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def _address(pixels: NDArray[np.uint8], kind: str, options: dict[str, Any]) -> str:
    from matplotlib.image import imsave

    buffer = io.BytesIO()
    imsave(buffer, np.ascontiguousarray(pixels), format=kind, pil_kwargs=options)
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode()}"
