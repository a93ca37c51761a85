"""The scenes that come with the renderer, made in code from nothing but numbers.

`BUILT_IN` maps the id of each to the function that makes it; a scene's module is imported, and its
geometry made, when it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from renderer.scene import Scene


def _spheres() -> Scene:
    from renderer.scenes.spheres import spheres

    return spheres()


def _cornell() -> Scene:
    from renderer.scenes.cornell import cornell

    return cornell()


def _atrium() -> Scene:
    from renderer.scenes.atrium import atrium

    return atrium()


def _gallery() -> Scene:
    from renderer.scenes.gallery import gallery

    return gallery()


def _matte() -> Scene:
    from renderer.scenes.matte import matte

    return matte()


BUILT_IN: Mapping[str, Callable[[], Scene]] = MappingProxyType(
    {"spheres": _spheres, "cornell": _cornell, "atrium": _atrium, "gallery": _gallery, "matte": _matte}
)
"""The built-in scenes by id."""
