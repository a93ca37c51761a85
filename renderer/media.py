"""The media a ray is in: transparent solids that lie in or overlap each other, told apart by priority.

Where solids whose materials have a `priority` overlap, the one of the highest displaces the others, so that a
drink may reach a little into its glass and still meet it without a gap of air (Schmidt and Budge, "Simple Nested
Dielectrics in Ray Traced Images", Journal of Graphics Tools 7(2), 2002). Media are numbered by rank, 1 and up: the
medium of a place is the largest number among the solids around it, and air, 0, where there are none.

What a ray is in is kept in one integer: up to `MOST_AROUND` numbers of 8 bits, in any order. A solid entered
twice counts twice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.effects import has_holes
from renderer.errors import SceneError
from renderer.kernel import formula
from renderer.scene import Material, Sphere

BITS = 8
MASK = (1 << BITS) - 1
MOST_AROUND = 7
"""Solids around one place that are kept track of; a further one counts as not entered."""


def rank_media(materials: Sequence[Material]) -> list[Material]:
    """The materials that are media, the one that gives way to all others first.

    Of equal priorities the larger index of refraction counts more, then whatever else tells them apart: the order
    in which a scene names them never does.

    Raises:
        SceneError: for more than 255 of them.
    """
    media = [material for material in materials if is_medium(material)]
    if len(media) > MASK:
        raise SceneError(f"expected at most {MASK} transparent materials with a priority, found {len(media)}")
    return sorted(media, key=lambda m: (m.priority or 0, m.ior, m.transmission, m.reflection, m.name))


def is_medium(material: Material) -> bool:
    """Whether its solids take part in `priority`: it is transparent, and no hole leads around its surface."""
    return material.priority is not None and any(material.transmission) and not has_holes(material)


def indices_of(media: Sequence[Material]) -> NDArray[np.float64]:
    """(m + 1,) float64 index of refraction of air and of each medium by number."""
    return np.array([1.0, *(material.ior for material in media)])


def distinct_spheres(spheres: Sequence[Sphere], media: Sequence[Material]) -> list[Sphere]:
    """`spheres` without those in the very place of another one, of a medium that displaces theirs."""
    rank = {material: number for number, material in enumerate(media)}
    highest: dict[tuple[object, float], int] = {}
    for sphere in spheres:
        if sphere.material in rank:
            place = (sphere.center, sphere.radius)
            highest[place] = max(highest.get(place, 0), rank[sphere.material])
    return [
        sphere
        for sphere in spheres
        if sphere.material not in rank or rank[sphere.material] == highest[sphere.center, sphere.radius]
    ]


@formula
def with_medium(around: int, medium: int) -> int:
    """The media around a ray that has entered one more."""
    for slot in range(MOST_AROUND):
        if (around >> (BITS * slot)) & MASK == 0:
            return around | (medium << (BITS * slot))
    return around


@formula
def without_medium(around: int, medium: int) -> int:
    """The media around a ray that has left one; the same where it was not in it."""
    for slot in range(MOST_AROUND):
        if (around >> (BITS * slot)) & MASK == medium:
            return around ^ (medium << (BITS * slot))
    return around


@formula
def dominant(around: int) -> int:
    """The medium that displaces the others; 0 for air."""
    highest = 0
    for slot in range(MOST_AROUND):
        highest = max(highest, (around >> (BITS * slot)) & MASK)
    return highest


@formula
def _cross(before: int, behind: int, medium: int, enters: bool) -> tuple[int, int]:
    """Media on both sides of a face, with one more solid that it bounds.

    Whoever leaves a solid has been in it, even if entering it went unnoticed, as between two faces closer than
    the offset of a ray.
    """
    if enters:
        return before, with_medium(behind, medium)
    left = without_medium(behind, medium)
    return (with_medium(before, medium) if left == behind else before), left


@formula
def crossed(around: int, medium: int, other: int, entering: bool) -> tuple[int, int]:
    """Media before and behind a face.

    Args:
        around: media of the ray that meets it.
        medium: whose solid it bounds.
        other: the medium of a second solid that it bounds too: above 0 where that lies on the same side of the
            face, below 0 on the other side, 0 for none.
        entering: whether the ray comes from outside the first.
    """
    before, behind = _cross(around, around, medium, entering)
    if other != 0:
        before, behind = _cross(before, behind, abs(other), entering == (other > 0))
    return before, behind
