"""Reflection and refraction at a smooth boundary: Snell's law and Fresnel's equations, in numbers or lanes."""

from __future__ import annotations

from renderer.kernel import formula
from renderer.lanes import choose, least, most, root


@formula
def refracted_cosine(cosine: float, eta: float) -> float:
    """Cosine of the refracted angle; 0 or less under total internal reflection.

    Args:
        cosine: of the angle of incidence, 0 to 1 (clamped).
        eta: index of refraction on the incident side over that behind the boundary.

    The radicand is formed from (1 - c)(1 + c), which keeps its digits near normal incidence.
    """
    c = most(0.0, least(1.0, cosine))
    radicand = 1.0 - eta * eta * ((1.0 - c) * (1.0 + c))
    return choose(radicand > 0.0, root(choose(radicand > 0.0, radicand, 0.0)), -1.0)


@formula
def fresnel(cosine: float, refracted: float, eta: float) -> float:
    """Share of unpolarised light that a dielectric boundary reflects, 0 to 1 (Born and Wolf 1999, sec. 1.5.2).

    Args:
        cosine, refracted: cosines of the angles of incidence and refraction; `refracted` 0 or less means
            total internal reflection.
        eta: index of refraction on the incident side over that behind the boundary.
    """
    c = most(0.0, least(1.0, cosine))
    parallel = (c - eta * refracted) / (c + eta * refracted)
    perpendicular = (eta * c - refracted) / (eta * c + refracted)
    share = 0.5 * (parallel * parallel + perpendicular * perpendicular)
    return choose(refracted <= 0.0, 1.0, choose(eta == 1.0, 0.0, share))
