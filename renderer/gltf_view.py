"""Lights (KHR_lights_punctual) and cameras of a glTF file.

A spot lights to all sides here, as bright as on its axis. Of orthographic cameras nothing is read.

Source: Khronos glTF 2.0 specification, section 3.10; KHR_lights_punctual.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.errors import SettingsError
from renderer.fields import Fields
from renderer.gltf_data import LARGEST_INDEX
from renderer.model import INVERSE_SQUARE, NO_FALLOFF, StatedLight, camera_of
from renderer.scene import MAX_RADIANCE

LUMENS_PER_WATT: Final = 683.0
"""Luminous efficacy of 555 nm [lm/W], with which exporters turn watts into candela and lux, and we back."""

KINDS: Final = ("point", "spot", "directional")
"""Kinds of lights."""


def read_light(top: Fields, index: int, world_from_node: NDArray[np.float64]) -> StatedLight:
    """The light `index` of the file, on a node.

    Args:
        top: the file.
        index: into the extension's list of lights.
        world_from_node: (4, 4).

    Raises:
        SceneError: naming the file and the field.
    """
    stated = list(top.table("extensions").table("KHR_lights_punctual").tables("lights"))
    if index >= len(stated):
        raise top.refuse("extensions.KHR_lights_punctual.lights", f"at least {index + 1} entries", len(stated))
    fields = stated[index]
    kind = fields.choice("type", KINDS)
    watts = fields.number("intensity", 0.0, MAX_RADIANCE, 1.0) / LUMENS_PER_WATT
    red, green, blue = (watts * part for part in fields.rgb("color", 1.0, (1.0, 1.0, 1.0)))
    px, py, pz = world_from_node[:3, 3].tolist()
    if kind != "directional":
        return StatedLight((red, green, blue), (px, py, pz), falloff=INVERSE_SQUARE)
    dx, dy, dz = (-world_from_node[:3, 2]).tolist()
    if not 0.0 < math.hypot(dx, dy, dz) < math.inf:
        raise fields.refuse("type", "a node that keeps the light's direction", kind)
    return StatedLight((red, green, blue), direction=(dx, dy, dz), falloff=NO_FALLOFF)


def read_camera(fields: Fields, world_from_node: NDArray[np.float64]) -> Camera | None:
    """The camera of one entry of `cameras`, on a node; None for an orthographic one.

    Raises:
        SceneError: naming the file and the field.
    """
    if fields.choice("type", ("perspective", "orthographic")) == "orthographic":
        return None
    perspective = fields.table("perspective")
    try:
        return camera_of(world_from_node, math.degrees(perspective.number("yfov", 0.0, math.pi, open_low=True)))
    except SettingsError as error:
        raise fields.in_file(error) from None


def light_of(node: Fields) -> int | None:
    """The index of a node's light; None for none."""
    light = node.table("extensions").table("KHR_lights_punctual")
    return light.integer("light", 0, LARGEST_INDEX) if "light" in light else None
