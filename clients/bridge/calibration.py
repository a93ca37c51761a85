"""From what a tracker says to where the eye looked, learned from points that somebody looked at."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from clients.bridge.errors import ConfigError
from clients.bridge.sample import Point
from clients.bridge.screen import Screen

LARGEST_CONDITION = 1e6
"""Points on one line, or too near each other, leave the mapping open."""


class Model(StrEnum):
    """The shape of the mapping."""

    AFFINE = "affine"
    """x and y of the screen are linear in x and y measured: 3 points or more."""
    QUADRATIC = "quadratic"
    """With squares and the product as well: 6 points or more."""


LEAST_POINTS = {Model.AFFINE: 3, Model.QUADRATIC: 6}


class Pair(NamedTuple):
    """A point that was looked at.

    Attributes:
        measured: what the tracker said: fractions of the screen, or its own numbers if its unit is `raw`.
        target: where the point was, in fractions of the screen.
    """

    measured: Point
    target: Point


@dataclass(frozen=True, eq=False, slots=True)
class Calibration:
    """A fitted mapping.

    Attributes:
        model: its shape.
        pairs: what it was fitted to.
        center, scale: (2,) float64, which bring the measured points near -1 to 1.
        weights: (3 or 6, 2) float64.
    """

    model: Model
    pairs: tuple[Pair, ...]
    center: NDArray[np.float64]
    scale: NDArray[np.float64]
    weights: NDArray[np.float64]

    def apply(self, measured: Point) -> Point:
        """Where the eye looks, in fractions of the screen."""
        u = (measured.x - self.center[0]) / self.scale[0]
        v = (measured.y - self.center[1]) / self.scale[1]
        terms = (1.0, u, v) if self.model is Model.AFFINE else (1.0, u, v, u * u, u * v, v * v)
        x = sum(term * weight for term, weight in zip(terms, self.weights[:, 0].tolist(), strict=True))
        y = sum(term * weight for term, weight in zip(terms, self.weights[:, 1].tolist(), strict=True))
        return Point(float(x), float(y))

    def residuals_deg(self, screen: Screen) -> list[float]:
        """The angle between each target and where the mapping puts what was measured there [deg]."""
        return [screen.angle(self.apply(pair.measured), pair.target) for pair in self.pairs]

    def margin_deg(self, screen: Screen) -> float:
        """How far off the gaze may be [deg]: the root mean square error at a point left out of the fit.

        With few points a model passes through them almost exactly, so errors at the fitted points would flatter it.
        Where one point less leaves the mapping open, those errors are all there is.
        """
        errors = []
        for index, pair in enumerate(self.pairs):
            others = self.pairs[:index] + self.pairs[index + 1 :]
            try:
                errors.append(screen.angle(fit(self.model, others).apply(pair.measured), pair.target))
            except ConfigError:
                errors.append(screen.angle(self.apply(pair.measured), pair.target))
        return math.sqrt(sum(error**2 for error in errors) / len(errors))

    def save(self, path: Path) -> None:
        """Write the points to a file, whole or not at all; the fit is made again when it is read."""
        points = [[*pair.measured, *pair.target] for pair in self.pairs]
        half = path.with_name(path.name + ".part")
        half.write_text(json.dumps({"model": self.model, "points": points}, indent=1) + "\n")
        half.replace(path)


def fit(model: Model, pairs: tuple[Pair, ...]) -> Calibration:
    """The mapping with the least squared error.

    Raises:
        ConfigError: for too few points, points that are no numbers, or points that leave it open.
    """
    if len(pairs) < LEAST_POINTS[model]:
        raise ConfigError("calibration", f"{LEAST_POINTS[model]} points or more for {model}", len(pairs))
    measured = np.array([pair.measured for pair in pairs], dtype=np.float64)
    target = np.array([pair.target for pair in pairs], dtype=np.float64)
    if not (np.isfinite(measured).all() and np.isfinite(target).all()):
        raise ConfigError("calibration", "finite numbers", "others")
    center = measured.mean(axis=0)
    scale = np.abs(measured - center).max(axis=0)
    if not (scale > 0).all():
        raise ConfigError("calibration", "points that differ in x and in y", "points on one line")
    u, v = ((measured - center) / scale).T
    columns = [np.ones_like(u), u, v] + ([u * u, u * v, v * v] if model is Model.QUADRATIC else [])
    terms = np.stack(columns, axis=1)
    if np.linalg.cond(terms) > LARGEST_CONDITION:
        raise ConfigError("calibration", f"points that settle a mapping of kind {model}", "points on one curve")
    weights = np.linalg.lstsq(terms, target, rcond=None)[0]
    return Calibration(model, pairs, center, scale, weights)


def load_calibration(path: Path) -> Calibration:
    """The mapping of a file such as `{"model": "affine", "points": [[mx, my, x, y], ...]}`.

    Raises:
        ConfigError: naming the file, for anything else.
    """
    try:
        record = json.loads(path.read_text())
        points = [[float(number) for number in point] for point in record["points"]]
        pairs = tuple(Pair(Point(mx, my), Point(x, y)) for mx, my, x, y in points)
        return fit(Model(record["model"]), pairs)
    except OSError as error:
        raise ConfigError(f"calibration {path}", "a file that can be read", error.strerror) from None
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"calibration {path}", "a model and points [mx, my, x, y]", str(error)) from None
    except ConfigError as error:
        raise ConfigError(f"{error.setting} {path}", error.expected, error.found) from None
