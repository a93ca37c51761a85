"""Frames as a video file, H.264 in MP4, Matroska or QuickTime. The only file that knows PyAV."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Final

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray

CONTAINERS: Final[Mapping[str, str]] = MappingProxyType(
    {".mp4": "mp4", ".m4v": "mp4", ".mkv": "matroska", ".mov": "mov"}
)
"""Container by suffix."""

CRF: Final = 18
"""Constant rate factor of x264: 18 is taken for visually lossless, so that what is coarse was rendered so."""

PRESET: Final = "medium"

BT709: Final = 1
"""Rec.709 in the tables of ISO/IEC 23091-2: primaries, transfer and matrix."""


def write_video(path: Path, frames: Iterable[NDArray[np.uint8]], fps: Fraction, size: tuple[int, int]) -> None:
    """Write the file as a whole: nobody ever finds half of it under its name.

    Args:
        path: its suffix is one of `CONTAINERS`.
        frames: (h, w, 3) uint8 each; frame k is shown from k/fps seconds on.
        fps: frames a second.
        size: (w, h) [px], both even: colour has half the resolution (yuv420p, which every player shows).
    """
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with av.open(str(partial), "w", format=CONTAINERS[path.suffix.lower()]) as container:
            stream = container.add_stream("libx264", rate=fps, options={"crf": str(CRF), "preset": PRESET})
            stream.width, stream.height = size
            stream.pix_fmt = "yuv420p"
            context = stream.codec_context
            context.time_base = 1 / fps
            context.color_primaries = context.color_trc = context.colorspace = BT709
            context.color_range = ColorRange.MPEG
            for index, pixels in enumerate(frames):
                frame = av.VideoFrame.from_ndarray(pixels, format="rgb24").reformat(
                    format="yuv420p", dst_colorspace=Colorspace.ITU709, dst_color_range=ColorRange.MPEG
                )
                frame.pts, frame.time_base = index, 1 / fps
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
