"""What deciding at run time costs: the shading kernel against one with everything cut out that its scene never needs.

The trimmed kernel is the renderer's own source with the branches of uncalled effects taken out before it is
compiled, so it can only be faster; it must give the same bytes.
"""

from __future__ import annotations

import inspect
import statistics
import textwrap
import time
from typing import Any

import numba
import numpy as np
import pytest

from renderer import finishing, lighting, material_table, reflectance, shading, shadow_rays, spawning, whitted
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from renderer.scenes import BUILT_IN

TURNS = 9
MOST_OVERHEAD = 1.08
"""Processor time of the frame over that of the frame with the trimmed kernel: 0.99 to 1.05 on the built-in scenes, and
as much as two runs of the same kernel differ."""

TESTS_OF_EFFECTS = {
    "textures": ("anywhere((picture >= 0) | (specular_picture >= 0) | (normal_picture >= 0))",),
    "specular": ("anywhere(shiny)",),
    "reflection": ("anywhere(goes)",),
    "refraction": ("(calls & REFRACTS != 0)",),
}
NEVER_FORCED = (
    "anyway & MIRROR_ANYWAY != 0",
    "anyway & REFRACTS_ANYWAY != 0",
)


def trimmed(function: Any, never: list[str], changed: dict[str, Any]) -> Any:
    """A compiled function anew, with conditions that never hold replaced, and other functions to call.

    Args:
        function: compiled by `kernel` or `formula`.
        never: conditions of its source to be taken as False.
        changed: what names mean in it, where not what they meant.
    """
    source = textwrap.dedent(inspect.getsource(function.py_func))
    for condition in never:
        source = source.replace(condition, "False")
    source = "from __future__ import annotations\n" + source[source.index("def ") :]
    names = {**function.py_func.__globals__, **changed}
    exec(compile(source, f"<trimmed {function.py_func.__name__}>", "exec"), names)
    return numba.njit(nogil=True, error_model="numpy", _nrt=False, forceinline=function.py_func.__name__ != "shade")(
        names[function.py_func.__name__]
    )


def trimmed_shade(prepared: PreparedScene) -> Any:
    """The shading kernel with nothing in it that the scene does not call for."""
    called = prepared.plan.names
    never = [test for effect, tests in TESTS_OF_EFFECTS.items() if effect not in called for test in tests]
    never += NEVER_FORCED
    bits = np.bitwise_or.reduce(prepared.surfaces.materials["calls"])
    if not bits & material_table.BOUNDARY:
        never.append("anywhere(through)")
    if not bits & material_table.GRAINED:
        never.append("anywhere(calls & GRAINED != 0)")
    if not bits & material_table.SPAWNS:
        never += ["spawn and anywhere(finish.calls & SPAWNS != 0)", "spawn and calls & SPAWNS != 0"]
    if not bits & material_table.MICROFACETS:
        never.append("anywhere(faceted)")
    if len(prepared.surfaces.indices) == 1:
        never.append("len(surfaces.indices) > 1")
    if not len(prepared.surfaces.area_lights):
        never.append("area_lights > 0")
    response = trimmed(reflectance.reflectance, never, {})
    evenly = trimmed(reflectance.even_light, never, {})
    from_point = trimmed(lighting.point_light, never, {"reflectance": response})
    changed = {
        "finish_off": trimmed(finishing.finish_off, never, {}),
        "light_up": trimmed(lighting.light_up, never, {"point_light": from_point, "even_light": evenly}),
        "ask_area_lights": trimmed(shadow_rays.ask_area_lights, never, {"reflectance": response}),
        "send_on": trimmed(spawning.send_on, never, {}),
        "write_children": trimmed(spawning.write_children, never, {}),
    }
    return trimmed(shading.shade, never, changed)


@pytest.mark.bench
@pytest.mark.parametrize("scene_id", ["matte", "spheres", "gallery", "atrium"])
def test_the_plan_costs_hardly_more_than_a_kernel_trimmed_to_the_scene(
    scene_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Timed in turn on one thread, in processor time, which other programs disturb little."""
    prepared = prepare(BUILT_IN[scene_id]())
    request = FrameRequest(Gaze(320, 180), Display(640, 360), None, Quality(map="full", samples_per_cell=1))
    kernels = {"planned": shading.shade, "trimmed": trimmed_shade(prepared)}
    renderer = Renderer(threads=1)
    times: dict[str, list[float]] = {name: [] for name in kernels}
    pictures = {}
    for turn in range(TURNS + 1):
        for name, shade in kernels.items():
            monkeypatch.setattr(whitted, "shade", shade)
            renderer.forget_samples()
            began = time.process_time()
            pictures[name] = renderer.render(prepared, request).pixels
            if turn > 0:
                times[name].append(time.process_time() - began)
    renderer.close()
    np.testing.assert_array_equal(pictures["planned"], pictures["trimmed"])
    ratio = statistics.median(a / b for a, b in zip(times["planned"], times["trimmed"], strict=True))
    assert ratio <= MOST_OVERHEAD, f"{scene_id}: {ratio:.3f} of the time with the trimmed kernel"
