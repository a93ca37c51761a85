"""Pictures as bytes: frames out (PNG, JPEG, WebP, raw), textures in. The only file that knows Pillow and simplejpeg.

Measured for a 1920×1080 frame on 2 cores: PNG 50 to 250 ms, WebP 60 to 110 ms, JPEG 7 to 18 ms, raw 5 ms.
"""

from __future__ import annotations

import io
import logging
import warnings
import zlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
import simplejpeg
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from renderer.errors import SceneError, SettingsError, require_choice, require_integer
from renderer.scene import Texture

# Pillow's own limit warns before it raises; `decode_texture` checks the size itself before any pixel is decoded.
Image.MAX_IMAGE_PIXELS = None
# Whatever is wrong with a texture is said once, in our own error: not as a warning or on the terminal too.
warnings.filterwarnings("error", module=r"PIL(\.|$)")
logging.getLogger("PIL").addHandler(logging.NullHandler())

FORMATS: Final = ("png", "jpeg", "webp", "raw")
"""Formats of a frame. `raw` is float32 little-endian, h*w*3 values, linear."""

CONTENT_TYPE: Final[Mapping[str, str]] = MappingProxyType(
    {"png": "image/png", "jpeg": "image/jpeg", "webp": "image/webp", "raw": "application/octet-stream"}
)
"""Media type of each of `FORMATS`."""

LONGEST_SIDE_PX: Final[Mapping[str, int]] = MappingProxyType({"jpeg": 65_500, "webp": 16_383})
"""Longest side a format can hold [px], as libjpeg and libwebp compile it; the others hold any frame."""

MAX_TEXTURE_PIXELS: Final = 1 << 26
"""Most pixels of a texture by default: 8192 × 8192, 200 MB decoded."""

_TEXTURE_FORMATS: Final = ("PNG", "JPEG", "WEBP", "BMP", "DIB", "TGA", "GIF", "TIFF", "PPM", "PCX")
"""Raster formats that a texture may have; none of them runs another program or reads another file."""

_FULL_CHROMA_QUALITY: Final = 90
"""JPEG quality from which colour is kept at full resolution."""


def encode(pixels: NDArray[np.uint8] | NDArray[np.float32], image_format: str, quality: int = 90) -> bytes:
    """The picture as a file in memory.

    Args:
        pixels: (h, w, 3); uint8 sRGB for `png`, `jpeg` and `webp`, float32 linear for `raw`.
        image_format: one of `FORMATS`. PNG is lossless, compressed fast rather than small.
        quality: 1 to 100, for `jpeg` and `webp`.

    Raises:
        SettingsError: for an unknown format, a quality out of range, or a frame too large for the format.
        ValueError: for pixels of another shape or dtype than the format takes.
    """
    require_choice("format", image_format, FORMATS)
    require_integer("image_quality", quality, 1, 100)
    dtype = np.float32 if image_format == "raw" else np.uint8
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != dtype or pixels.size == 0:
        raise ValueError(f"{image_format}: expected (h, w, 3) {dtype.__name__}, found {pixels.shape} {pixels.dtype}")
    if image_format == "raw":
        return pixels.astype("<f4", copy=False).tobytes()
    longest = LONGEST_SIDE_PX.get(image_format, max(pixels.shape))
    if max(pixels.shape[:2]) > longest:
        raise SettingsError("format", f"png or raw for a side of more than {longest} px", image_format)
    if image_format == "jpeg":
        return _jpeg(np.ascontiguousarray(pixels, dtype=np.uint8), quality)
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(buffer, image_format, **_save_options(image_format, quality))
    return buffer.getvalue()


def decode_texture(data: bytes, name: str, max_pixels: int = MAX_TEXTURE_PIXELS) -> Texture:
    """The texture in an image file.

    Grey, palette, CMYK and 16-bit images become 8-bit RGB; transparency becomes the texture's alpha, unless all
    of the image is whole. Of an animation, the first picture.

    Args:
        data: the whole file: PNG, JPEG, WebP, BMP, TGA, GIF, TIFF, PPM or PCX.
        name: the file, for messages.
        max_pixels: refuse more than that, before decoding.

    Raises:
        SceneError: naming the file, for damage, another format or too many pixels.
    """
    if not data:
        raise SceneError(f"{name}: expected an image, found an empty file")
    try:
        with Image.open(io.BytesIO(data), formats=_TEXTURE_FORMATS) as image:
            width, height = image.size
            if not 0 < width * height <= max_pixels:
                raise SceneError(f"{name}: expected 1 to {max_pixels} pixels, found {width} x {height}")
            alpha = _alpha8(image)
            pixels = _rgb8(image, name)
    except SceneError:
        raise
    except Exception as error:
        # Pillow's readers raise whatever their parsing runs into: OSError, SyntaxError, ValueError,
        # struct.error, EOFError, OverflowError, the warnings turned into errors above, and more.
        unknown = isinstance(error, UnidentifiedImageError)
        found = "something else" if unknown else " ".join(str(error).split())
        raise SceneError(
            f"{name}: expected an image that can be read ({', '.join(_TEXTURE_FORMATS)}), "
            f"found {found or type(error).__name__}"
        ) from error
    pixels.flags.writeable = False
    return Texture(pixels, name, alpha=alpha)


def _jpeg(pixels: NDArray[np.uint8], quality: int) -> bytes:
    """A JPEG file. libjpeg-turbo as in Pillow, but without a copy into Pillow's own layout: a fifth faster."""
    subsampling = "444" if quality >= _FULL_CHROMA_QUALITY else "420"
    data: bytes = simplejpeg.encode_jpeg(pixels, quality, "RGB", subsampling, fastdct=False)
    return data


def _save_options(image_format: str, quality: int) -> dict[str, int]:
    """Pillow's options. Run-length matching is the fastest on foveated frames, and there also the smallest."""
    if image_format == "png":
        return {"compress_level": 1, "compress_type": zlib.Z_RLE}
    return {"quality": quality, "method": 0}


def _rgb8(image: Image.Image, name: str) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 colours of an opened image."""
    if image.mode.startswith("I"):
        return _grey16(image, name)
    if image.mode == "F":
        raise SceneError(f"{name}: expected 8 or 16 bits a channel, found floating-point numbers")
    if image.mode in ("P", "PA"):
        # straight to RGB, Pillow warns about palettes that carry transparency
        image = image.convert("RGBA")
    return np.array(image.convert("RGB"), dtype=np.uint8)


def _alpha8(image: Image.Image) -> NDArray[np.uint8] | None:
    """(h, w) uint8 alpha of an opened image; None where nothing of it is transparent."""
    if image.mode.startswith("I") or not image.has_transparency_data:
        return None
    alpha = np.array(image.convert("RGBA").getchannel("A"), dtype=np.uint8)
    alpha.flags.writeable = False
    return None if alpha.min() == 255 else alpha


def _grey16(image: Image.Image, name: str) -> NDArray[np.uint8]:
    """A 16-bit grey image, rounded to 8 bits: Pillow's own conversion of these modes clips at 255."""
    grey = np.asarray(image).astype(np.int64)
    if grey.min() < 0 or grey.max() > 0xFFFF:
        raise SceneError(f"{name}: expected 8 or 16 bits a channel, found values from {grey.min()} to {grey.max()}")
    levels = ((grey + 128) // 257).astype(np.uint8)
    return np.repeat(levels[:, :, None], 3, axis=2)
