"""Frames of the wire as arrays. The only file of the clients that knows Pillow."""

from __future__ import annotations

import io
import warnings
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from service.protocol import FrameHeader, ProtocolError

PILLOW_FORMATS: Final = {"png": "PNG", "jpeg": "JPEG", "webp": "WEBP"}


def decode_image(header: FrameHeader, image: bytes) -> NDArray[np.uint8] | NDArray[np.float32]:
    """The picture of a frame.

    Returns:
        (height, width, 3): uint8 sRGB, or for `raw` float32 linear Rec.709.

    Raises:
        ProtocolError: if the image is not what its header says.
    """
    shape = (header.height, header.width, 3)
    if header.format == "raw":
        expected = 4 * header.height * header.width * 3
        if len(image) != expected:
            raise ProtocolError("image", f"expected {expected} bytes, found {len(image)}")
        return np.frombuffer(image, dtype="<f4").reshape(shape)
    try:
        with (
            warnings.catch_warnings(),
            Image.open(io.BytesIO(image), formats=[PILLOW_FORMATS[header.format]]) as opened,
        ):
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # its size is checked here
            if (opened.height, opened.width, opened.mode) != (*shape[:2], "RGB"):
                found = f"{opened.width}x{opened.height} {opened.mode}"
                raise ProtocolError("image", f"expected {header.width}x{header.height} RGB, found {found}")
            return np.array(opened, dtype=np.uint8)
    except (UnidentifiedImageError, OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ProtocolError("image", f"expected a whole {header.format}, found a mistake: {error}") from None
