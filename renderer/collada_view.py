"""Transforms, lights and cameras of COLLADA files.

A spot lights to all sides here, as bright as on its axis. Light of colour c shows a white surface that faces it as
c, so its irradiance is pi c, over the file's falloff.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.model import LARGEST_FALLOFF, NO_FALLOFF, StatedLight, camera_of, vertical_fov
from renderer.scene import MAX_COORDINATE_M, MAX_RADIANCE, Rgb
from renderer.xml_tree import Element

TRANSFORMS: Final = {"matrix": 16, "translate": 3, "rotate": 4, "scale": 3, "lookat": 9, "skew": 7}
"""Elements that move a node, with how many numbers each holds."""

ASPECT: Final = 4.0 / 3.0
"""Width over height of a picture whose file states only the horizontal field of view."""

_UP: Final = {
    "X_UP": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "Y_UP": np.eye(3),
    "Z_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}


def world_from_file(root: Element) -> NDArray[np.float64]:
    """(4, 4) from the file's coordinates to metres with y up.

    Raises:
        SceneError: for a unit that is no length.
    """
    axis, unit = root.first("asset/up_axis"), root.first("asset/unit")
    metres = 1.0
    if unit is not None and unit.attributes.get("meter", "").strip():
        text = unit.attributes["meter"].strip()
        try:
            metres = float(text.replace(",", "."))
        except ValueError:
            metres = math.nan
        if not 0.0 < metres <= MAX_COORDINATE_M:
            raise unit.refuse("a length in metres above 0", text)
    matrix = np.eye(4)
    matrix[:3, :3] = _UP.get("Y_UP" if axis is None else axis.text.strip(), np.eye(3)) * metres
    return matrix


def parent_from_node(node: Element) -> NDArray[np.float64]:
    """(4, 4) transform of a node: the product of its transforms, in file order.

    Raises:
        SceneError: for numbers that are missing, not finite or out of range.
    """
    matrix = np.eye(4)
    for element in node.all(*TRANSFORMS):
        values = element.floats()
        count = TRANSFORMS[element.tag]
        if len(values) != count or not (np.abs(values) <= MAX_COORDINATE_M).all():
            raise element.refuse(f"{count} finite numbers up to {MAX_COORDINATE_M:g}", element.text)
        matrix = matrix @ _transform(element, values)
        if not (np.abs(matrix) <= MAX_COORDINATE_M).all():
            raise element.refuse(f"a transform up to {MAX_COORDINATE_M:g}", "more")
    return matrix


def _transform(element: Element, values: NDArray[np.float64]) -> NDArray[np.float64]:
    matrix = np.eye(4)
    match element.tag:
        case "matrix":
            matrix[:3] = values.reshape(4, 4)[:3]
        case "translate":
            matrix[:3, 3] = values
        case "scale":
            matrix[:3, :3] = np.diag(values)
        case "rotate":
            matrix[:3, :3] = _rotation(values[:3], math.radians(values[3]))
        case "lookat":
            eye, target, up = values.reshape(3, 3)
            back = _unit(eye - target)
            right = _unit(np.cross(up, back))
            matrix[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
        case _:
            matrix[:3, :3] = _skew(values)
    return matrix


def _rotation(axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """(3, 3) rotation about an axis (Rodrigues); none about an axis of no length."""
    x, y, z = _unit(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: NDArray[np.float64] = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    return rotation


def _skew(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) shear by an angle: points move along the second axis by the tangent times their first coordinate."""
    about, along = _unit(values[1:4]), _unit(values[4:7])
    return np.eye(3) + math.tan(math.radians(values[0])) * np.outer(along, about)


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector


def read_light(kind: Element, world_from_node: NDArray[np.float64], metres: float) -> StatedLight:
    """A point, spot or directional light on a node.

    Args:
        kind: the element `point`, `spot` or `directional`.
        world_from_node: (4, 4).
        metres: length of the file's unit, which its falloff is stated in.

    Raises:
        SceneError: naming the file, the line and the element.
    """
    red, green, blue = (math.pi * part for part in read_color(kind))
    if kind.tag == "directional":
        dx, dy, dz = (-world_from_node[:3, 2]).tolist()
        if math.hypot(dx, dy, dz) == 0.0:
            raise kind.refuse("a node that keeps the light's direction", "one that flattens it")
        return StatedLight((red, green, blue), direction=(dx, dy, dz))
    constant, linear, quadratic = (
        max(kind.number(f"{term}_attenuation", default), 0.0) / metres**power
        for power, (term, default) in enumerate((("constant", 1.0), ("linear", 0.0), ("quadratic", 0.0)))
    )
    falloff = (constant, linear, quadratic)
    x, y, z = world_from_node[:3, 3].tolist()
    usable = 0.0 < max(falloff) <= LARGEST_FALLOFF
    return StatedLight((red, green, blue), (x, y, z), falloff=falloff if usable else NO_FALLOFF)


def read_color(light: Element) -> Rgb:
    """The colour of a light, 0 or more; white where none is stated.

    Raises:
        SceneError: naming the file, the line and the element.
    """
    found = light.first("color")
    if found is None:
        return 1.0, 1.0, 1.0
    values = found.floats()
    if len(values) not in (3, 4) or not ((values >= 0.0) & (values <= MAX_RADIANCE)).all():
        raise found.refuse(f"red, green and blue from 0 to {MAX_RADIANCE:g}", found.text)
    red, green, blue = values[:3].tolist()
    return red, green, blue


def read_camera(camera: Element, world_from_node: NDArray[np.float64]) -> Camera | None:
    """The perspective camera of a camera element, on a node; None for an orthographic one.

    Raises:
        SettingsError: for a field of view out of range or a node that flattens the view.
    """
    perspective = camera.first("optics/technique_common/perspective")
    if perspective is None:
        return None
    aspect = perspective.number("aspect_ratio", ASPECT)
    fov_deg = perspective.number("yfov", 0.0)
    if fov_deg == 0.0:
        across_deg = min(max(perspective.number("xfov", 0.0), 0.0), 179.0)
        fov_deg = vertical_fov(across_deg, aspect if aspect > 0.0 else ASPECT)
    return camera_of(world_from_node, fov_deg)
