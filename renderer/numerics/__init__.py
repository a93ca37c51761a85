"""What numerical care costs and what it saves: each choice made in the renderer, measured against what it beats.

The ways that lose are here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Callable

from renderer.numerics.angles import compare_angles
from renderer.numerics.comparison import Comparison
from renderer.numerics.leaving import compare_leaving
from renderer.numerics.light import compare_light
from renderer.numerics.places import compare_places
from renderer.numerics.spheres import compare_spheres
from renderer.numerics.traversal import compare_traversal

__all__ = ["CHAPTERS", "Comparison"]

CHAPTERS: dict[str, Callable[[], tuple[Comparison, ...]]] = {
    "traversal": compare_traversal,
    "leaving a surface": compare_leaving,
    "spheres": compare_spheres,
    "places": compare_places,
    "angles": compare_angles,
    "light": compare_light,
}
"""What is compared, by subject; half a minute in all."""
