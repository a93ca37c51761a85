"""A moving camera: views at certain times, and a smooth course through them."""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import MAX_POSITION_M, Camera
from renderer.errors import SettingsError, require_all, require_kind, require_number
from renderer.fields import Fields

MAX_TIME_S: Final = 1e6
"""Latest keyframe [s]: eleven days."""

FOV_DEG: Final = (1e-3, 179.0)
"""Narrowest and widest vertical field of view of a camera [deg]."""


@dataclass(frozen=True, slots=True)
class Keyframe:
    """The view at one time.

    Attributes:
        time_s: since the clip began [s], 0 or more.
        camera: the view.

    Raises:
        SettingsError: for a time out of range.
    """

    time_s: float
    camera: Camera

    def __post_init__(self) -> None:
        require_number("camera_path.time_s", self.time_s, 0.0, MAX_TIME_S)
        require_kind("camera_path.camera", self.camera, Camera)


@dataclass(frozen=True, slots=True)
class CameraPath:
    """Views and when they are reached.

    Attributes:
        keyframes: one or more, each later than the one before.

    Raises:
        SettingsError: naming the keyframe, for none or for times that do not increase.
    """

    keyframes: tuple[Keyframe, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "keyframes", require_all("camera_path", self.keyframes, Keyframe))
        if not self.keyframes:
            raise SettingsError("camera_path", "at least one keyframe", ())
        for index in range(1, len(self.keyframes)):
            before, time_s = self.keyframes[index - 1].time_s, self.keyframes[index].time_s
            if time_s <= before:
                raise SettingsError(f"camera_path[{index}].time_s", f"a time after {before:g}", time_s)

    def camera_at(self, seconds: float) -> Camera:
        """The view at a time; the first or last one before and after the path.

        Position, `look_at`, `up` and the logarithm of the picture's size are Catmull-Rom splines over time (Barry
        and Goldman 1988, with the keyframes' times as knots): they pass through every keyframe at its time, without a
        jump in velocity, and keyframes on a line at even speed give even speed along it.

        Raises:
            SettingsError: where the course between two keyframes passes through a view that is none.
        """
        frames = self.keyframes
        if seconds <= frames[0].time_s:
            return frames[0].camera
        if seconds >= frames[-1].time_s:
            return frames[-1].camera
        knots = np.array([frame.time_s for frame in frames])
        values = _with_ends(np.array([_numbers(frame.camera) for frame in frames]))
        segment = bisect.bisect_right(knots.tolist(), seconds) - 1
        four = slice(segment, segment + 4)
        try:
            return _camera(_catmull_rom(_with_ends(knots)[four], values[four], seconds))
        except SettingsError as error:
            raise SettingsError(f"camera_path at {seconds:g} s: {error.field}", error.expected, error.found) from None


def orbited(camera: Camera, degrees: float) -> Camera:
    """The view from a position turned counter-clockwise, seen from above, about the `up` axis through `look_at`."""
    axis = np.array(camera.up) / np.linalg.norm(camera.up)
    center = np.array(camera.look_at)
    arm = np.array(camera.position) - center
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turned = arm * cosine + np.cross(axis, arm) * sine + axis * (axis @ arm) * (1 - cosine)  # Rodrigues 1840
    return replace(camera, position=_triple(center + turned))


def read_camera_path(tables: Iterable[Fields]) -> CameraPath | None:
    """The path that the tables [[camera_path]] of a scene file describe; None for no table.

    Raises:
        SceneError: naming the file and the field.
    """
    keyframes: list[Keyframe] = []
    for fields in tables:
        time_s = fields.number("time_s", 0.0, MAX_TIME_S)
        if keyframes and time_s <= keyframes[-1].time_s:
            raise fields.refuse("time_s", f"a time after {keyframes[-1].time_s:g}", time_s)
        try:
            camera = Camera(
                fields.point("position", MAX_POSITION_M),
                fields.point("look_at", MAX_POSITION_M),
                fields.point("up", MAX_POSITION_M, (0.0, 1.0, 0.0)),
                fields.number("vertical_fov_deg", *FOV_DEG, 40.0),
            )
        except SettingsError as error:
            name = error.field.removeprefix("camera.")
            raise fields.refuse(name, error.expected, error.found) from None
        fields.refuse_unknown()
        keyframes.append(Keyframe(time_s, camera))
    return CameraPath(tuple(keyframes)) if keyframes else None


def _catmull_rom(knots: NDArray[np.float64], values: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """(k,) value at `time` between knots 1 and 2 of 4, for (4, k) values: Barry and Goldman's pyramid."""

    def between(first: NDArray[np.float64], second: NDArray[np.float64], start: int, end: int) -> NDArray[np.float64]:
        share = (time - float(knots[start])) / float(knots[end] - knots[start])
        return first + (second - first) * share

    a1, a2, a3 = (between(values[i], values[i + 1], i, i + 1) for i in range(3))
    b1, b2 = between(a1, a2, 0, 2), between(a2, a3, 1, 3)
    return between(b1, b2, 1, 2)


def _with_ends(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """One more value at each end, straight on from the last two."""
    first = 2 * values[0] - values[1]
    last = 2 * values[-1] - values[-2]
    return np.concatenate([first[None], values, last[None]])


def _numbers(camera: Camera) -> tuple[float, ...]:
    """What is interpolated of a camera."""
    size = math.log(math.tan(math.radians(camera.vertical_fov_deg) / 2))
    return (*camera.position, *camera.look_at, *camera.up, size)


def _camera(numbers: NDArray[np.float64]) -> Camera:
    """The camera of such numbers."""
    fov_deg = 2 * math.degrees(math.atan(math.exp(numbers[9])))
    return Camera(
        _triple(numbers[:3]), _triple(numbers[3:6]), _triple(numbers[6:9]), min(max(fov_deg, FOV_DEG[0]), FOV_DEG[1])
    )


def _triple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
