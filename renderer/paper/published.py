"""What the paper prints, and the settings behind it as far as it states them."""

from __future__ import annotations

from typing import Final

from renderer.acuity import Acuity
from renderer.display import Display
from renderer.gaze import Gaze
from renderer.quality import Quality

SOURCE: Final = 'A. Siekawa and R. Mantiuk, "Gaze-dependent Ray Tracing" (CESCG 2014)'

SCREEN: Final = Display(1920, 1080, 50.0, 35.0, 60.0)
"""Its screen: 50 x 35 cm, 60 cm from the eye."""

LARGE_SCREEN: Final = Display(5400, 3900, 50.0, 35.0, 60.0)
"""Its largest picture, taken to be on the same screen."""

SAMPLES_PER_CELL: Final = 32
"""Rays a cell, and a pixel of the full picture."""

QUALITY: Final = Quality(
    map="scanline", gaze_bucket_px=0, samples_per_cell=SAMPLES_PER_CELL, acuity=Acuity("peli", "paper")
)
"""Its method: cells in raster order, the exact gaze, the eye in front of the gaze (eq. 4)."""

OUR_QUALITY: Final = Quality(samples_per_cell=SAMPLES_PER_CELL)
"""The defaults of this renderer with as many rays a cell."""

GAZE: Final = Gaze(1000.0, 500.0)
"""A gaze near the centre of `SCREEN`."""

OFF_CENTRE_GAZE: Final = Gaze(300.0, 405.0)
"""A gaze for which the rays on `SCREEN` come out within 2 % of the paper's, which does not state its own."""

LARGE_CENTRE: Final = Gaze(2700.0, 1950.0)
"""The centre of `LARGE_SCREEN`."""

FULL_RAYS: Final = 66.36e6
REDUCED_RAYS: Final = 20.65e6
LARGE_FULL_RAYS: Final = 674e6
LARGE_REDUCED_RAYS: Final = 27e6
"""Camera rays of the full and the gaze-dependent picture, on `SCREEN` and on `LARGE_SCREEN`."""

RAY_RATIO: Final = 3.21
"""`FULL_RAYS` over `REDUCED_RAYS`."""

TIME_RATIO: Final = 3.25
"""Time of the full over that of the gaze-dependent picture, at `RAY_RATIO`."""
