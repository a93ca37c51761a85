"""What LANES rays met, side by side: written lane by lane at once, read one ray at a time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.finish import Finish
from renderer.gather import held, keep
from renderer.kernel import formula
from renderer.lanes import LANES, choose, whole
from renderer.surface import Surface

SURFACE = 0
MATERIAL = SURFACE + 13
ENTERING = SURFACE + 14
FINISH = 15
CALLS = FINISH + 6
WEIGHTS = 31
DENSITY = 33
MIRRORED = 34
EYE = 37
WIDTH = 40
TURN = 41
ROWS = 42
"""Rows of `Places.rows`: the 15 numbers of a surface with MATERIAL and ENTERING
among them, the 16 of its finish with CALLS among them, the weights of a
triangle's second and third corner, texture coordinates per scene unit, what it mirrors, the direction to the eye, the
width of the ray, and how many rays of the same sample are right before it; ROWS of them."""

REFRACTED, MIRRORED_ON = 0, 11
GOES, FROM, TOWARDS, SHARE, SPREAD = 0, 1, 4, 7, 10
ETA = 22
CHILD_ROWS = 23
"""Rows of `Places.children`: from REFRACTED and from MIRRORED_ON on a ray that the surface sends on, whether it does,
its origin, direction, weight, and how its width grows; the index of refraction before the surface over that behind."""

BEHIND, BEFORE = 0, 1
"""Rows of `Places.around`: the media that these are in."""

SENT = 0
START = 3
LIGHTS = 6
LIGHT_ROWS = 7
"""Rows of `Places.light`: what the surface sends back without lights, and the origin of its shadow rays; from LIGHTS on
LIGHT_ROWS for each point light: the direction of its shadow ray, how far it looks, and what the light adds."""

UNLIT = -1.0
"""How far it looks where the light adds nothing; 0 where the light casts no shadows."""


class Places(NamedTuple):
    """Room for what LANES rays met.

    Attributes:
        rows: (ROWS, LANES) float64.
        light: (LIGHTS + LIGHT_ROWS * l, LANES) float32 for l point lights.
        children: (CHILD_ROWS, LANES) float64.
        around: (2, LANES) int64.
    """

    rows: NDArray[np.float64]
    light: NDArray[np.float32]
    children: NDArray[np.float64]
    around: NDArray[np.int64]


def make_places(lights: int) -> Places:
    """Room for a scene of `lights` point lights."""
    light = np.zeros((LIGHTS + LIGHT_ROWS * lights, LANES), dtype=np.float32)
    children, around = np.zeros((CHILD_ROWS, LANES)), np.zeros((2, LANES), dtype=np.int64)
    return Places(np.zeros((ROWS, LANES)), light, children, around)


@formula
def keep_surfaces(rows: NDArray[np.float64], s: Surface) -> None:
    """Write the surfaces that all rays met."""
    keep(rows, SURFACE, s.px)
    keep(rows, SURFACE + 1, s.py)
    keep(rows, SURFACE + 2, s.pz)
    keep(rows, SURFACE + 3, s.gx)
    keep(rows, SURFACE + 4, s.gy)
    keep(rows, SURFACE + 5, s.gz)
    keep(rows, SURFACE + 6, s.nx)
    keep(rows, SURFACE + 7, s.ny)
    keep(rows, SURFACE + 8, s.nz)
    keep(rows, SURFACE + 9, s.u)
    keep(rows, SURFACE + 10, s.v)
    keep(rows, SURFACE + 11, s.offset)
    keep(rows, SURFACE + 12, s.lift)
    keep(rows, SURFACE + 13, s.material)
    keep(rows, SURFACE + 14, s.entering)


@formula
def keep_some_surfaces(rows: NDArray[np.float64], marked: Any, s: Surface) -> None:
    """Write the surfaces that the marked rays met, and leave the others."""
    old = surfaces_of(rows)
    keep_surfaces(
        rows,
        Surface(
            choose(marked, s.px, old.px), choose(marked, s.py, old.py), choose(marked, s.pz, old.pz),
            choose(marked, s.gx, old.gx), choose(marked, s.gy, old.gy), choose(marked, s.gz, old.gz),
            choose(marked, s.nx, old.nx), choose(marked, s.ny, old.ny), choose(marked, s.nz, old.nz),
            choose(marked, s.u, old.u), choose(marked, s.v, old.v),
            choose(marked, s.offset, old.offset), choose(marked, s.lift, old.lift),
            choose(marked, s.material, old.material), choose(marked, s.entering, old.entering),
        ),
    )  # fmt: skip


@formula
def surfaces_of(rows: NDArray[np.float64]) -> Surface:
    """The surfaces that all rays met, in lanes."""
    return Surface(
        held(rows, SURFACE), held(rows, SURFACE + 1), held(rows, SURFACE + 2),
        held(rows, SURFACE + 3), held(rows, SURFACE + 4), held(rows, SURFACE + 5),
        held(rows, SURFACE + 6), held(rows, SURFACE + 7), held(rows, SURFACE + 8),
        held(rows, SURFACE + 9), held(rows, SURFACE + 10), held(rows, SURFACE + 11), held(rows, SURFACE + 12),
        whole(held(rows, SURFACE + 13)), held(rows, SURFACE + 14) != 0.0,
    )  # fmt: skip


@formula
def surface_of(rows: NDArray[np.float64], lane: int) -> Surface:
    """The surface that one ray met."""
    return Surface(
        rows[SURFACE, lane], rows[SURFACE + 1, lane], rows[SURFACE + 2, lane],
        rows[SURFACE + 3, lane], rows[SURFACE + 4, lane], rows[SURFACE + 5, lane],
        rows[SURFACE + 6, lane], rows[SURFACE + 7, lane], rows[SURFACE + 8, lane],
        rows[SURFACE + 9, lane], rows[SURFACE + 10, lane], rows[SURFACE + 11, lane], rows[SURFACE + 12, lane],
        int(rows[SURFACE + 13, lane]), rows[SURFACE + 14, lane] != 0.0,
    )  # fmt: skip


@formula
def keep_finishes(rows: NDArray[np.float64], f: Finish) -> None:
    """Write what the surfaces that all rays met are made of."""
    keep(rows, FINISH, f.kr)
    keep(rows, FINISH + 1, f.kg)
    keep(rows, FINISH + 2, f.kb)
    keep(rows, FINISH + 3, f.sr)
    keep(rows, FINISH + 4, f.sg)
    keep(rows, FINISH + 5, f.sb)
    keep(rows, FINISH + 6, f.calls)
    keep(rows, FINISH + 7, f.shininess)
    keep(rows, FINISH + 8, f.nu)
    keep(rows, FINISH + 9, f.nv)
    keep(rows, FINISH + 10, f.ux)
    keep(rows, FINISH + 11, f.uy)
    keep(rows, FINISH + 12, f.uz)
    keep(rows, FINISH + 13, f.hx)
    keep(rows, FINISH + 14, f.hy)
    keep(rows, FINISH + 15, f.hz)


@formula
def finish_of(rows: NDArray[np.float64], lane: int) -> Finish:
    """What the surface that one ray met is made of."""
    return Finish(
        rows[FINISH, lane], rows[FINISH + 1, lane], rows[FINISH + 2, lane],
        rows[FINISH + 3, lane], rows[FINISH + 4, lane], rows[FINISH + 5, lane],
        int(rows[FINISH + 6, lane]), rows[FINISH + 7, lane], rows[FINISH + 8, lane], rows[FINISH + 9, lane],
        rows[FINISH + 10, lane], rows[FINISH + 11, lane], rows[FINISH + 12, lane],
        rows[FINISH + 13, lane], rows[FINISH + 14, lane], rows[FINISH + 15, lane],
    )  # fmt: skip


@formula
def keep_three(rows: NDArray[np.floating], row: int, x: float, y: float, z: float) -> None:
    """Write three rows."""
    keep(rows, row, x)
    keep(rows, row + 1, y)
    keep(rows, row + 2, z)
