"""The model of Ashikhmin and Shirley on the plane z = 0: ours, and as the paper prints it."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.ashikhmin_shirley import ashikhmin_shirley

Vector = NDArray[np.float64]


UP: Vector = np.array([0.0, 0.0, 1.0])


ALONG: Vector = np.array([1.0, 0.0, 0.0])


EXPONENTS = (0.0, 1.0, 10.0, 300.0, 1e4, 1e6, 1e8)


exponents = st.sampled_from(EXPONENTS) | st.floats(0.0, 1e9)


angles = st.floats(0.0, math.pi / 2) | st.sampled_from([0.0, 1e-9, 1e-4, math.pi / 2 - 1e-9])


turns = st.floats(0.0, 2 * math.pi)


directions = st.builds(
    lambda theta, phi: np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]),
    angles,
    turns,
)


def terms(to_light: Vector, to_eye: Vector, nu: float, nv: float, along: Vector = ALONG) -> tuple[float, float, float]:
    """The model's terms on the plane z = 0, which include the cosine of the light."""
    return ashikhmin_shirley(*UP, *along, nu, nv, *to_light, *to_eye)


def brdf(to_light: Vector, to_eye: Vector, nu: float, nv: float, rs: float, rd: float) -> float:
    highlight, schlick, matt = terms(to_light, to_eye, nu, nv)
    return (highlight * (rs + (1 - rs) * schlick) + matt * rd * (1 - rs)) / float(to_light[2])


def as_printed(k1: Vector, k2: Vector, nu: float, nv: float, rs: float, rd: float) -> float:
    """Equations 4 and 5 of the paper, symbol by symbol; loses its digits where h is near n."""
    n, u, v = UP, ALONG, np.array([0.0, 1.0, 0.0])
    h = (k1 + k2) / np.linalg.norm(k1 + k2)
    fresnel = rs + (1 - rs) * (1 - k1 @ h) ** 5
    exponent = (nu * (h @ u) ** 2 + nv * (h @ v) ** 2) / (1 - (h @ n) ** 2)
    specular = math.sqrt((nu + 1) * (nv + 1)) / (8 * math.pi) * (n @ h) ** exponent / ((h @ k1) * max(n @ k1, n @ k2))
    diffuse = 28 * rd / (23 * math.pi) * (1 - rs) * (1 - (1 - (n @ k1) / 2) ** 5) * (1 - (1 - (n @ k2) / 2) ** 5)
    return float(specular * fresnel + diffuse)


any_part = st.integers(0, 2**32 - 1).map(lambda word: float(np.uint32(word).view(np.float32)))


any_vectors = (
    st.tuples(any_part, any_part, any_part).map(np.array).filter(lambda v: bool(np.isfinite(v).all() and v.any()))
)
