"""Our scenes as POV-Ray 3.7 reads them, and the pictures it makes of them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.camera import view_frame
from renderer.display import Display
from renderer.scene import Material, Mesh, PointLight, Scene, Sphere

PATIENCE_S: Final = 600
"""Longest that a picture may take [s]."""

TRACE_TIME: Final = re.compile(r"Trace Time:.*?\(([\d.]+) seconds\)")
"""Where it says how long tracing took, without reading the scene [s]."""

NEAR_M: Final = 0.001
"""`fade_distance` D: POV-Ray's light is 2/(1 + (d/D)^2), which is 2 D^2/d^2 but for 1e-6 of (1 m / d)^2."""

VISIBLE: Final = 1.0 / 255
"""Weight below which a ray cannot change a picture of 8 bits."""

STEP: Final = 1.0 / 65535
"""Between two codes of its 16-bit picture, the finest it writes: half floats are 30 times coarser near 1."""


def find_povray() -> str | None:
    """Path of the program, None where there is none."""
    return shutil.which("povray")


def povray_picture(scene: Scene, display: Display, depth: int, folder: Path) -> NDArray[np.float64]:
    """One ray through the middle of each pixel.

    Args:
        scene: in which nothing is brighter than 1.
        display: its size.
        depth: how many mirrors and boundaries a ray may meet.
        folder: for its files.

    Returns:
        (h, w, 3) float64 linear radiance in steps of 1/65535.
    """
    _run(scene, display, depth, folder, ("+Otheirs.ppm", "+FP16", "File_Gamma=1.0", "Dither=off", "+WT1"))
    return read_ppm((folder / "theirs.ppm").read_bytes())


def povray_trace_s(scene: Scene, display: Display, depth: int, threads: int, folder: Path) -> float:
    """How long it takes to trace the same picture on `threads` threads, without reading the scene or writing it [s].

    Args:
        scene, display, depth, folder: as in `povray_picture`; rays too weak to be seen in 8 bits are left out.
        threads: to trace on.
    """
    said = _run(scene, display, depth, folder, ("-F", f"+WT{threads}"), weakest=VISIBLE)
    found = TRACE_TIME.search(said)
    if found is None:
        raise ValueError(f"POV-Ray: expected a line 'Trace Time: ... (N seconds)', found {said[-200:]!r}")
    return float(found[1])


def _run(scene: Scene, display: Display, depth: int, folder: Path, options: Sequence[str], weakest: float = 0.0) -> str:
    """Make one picture; what the program says about it.

    Raises:
        FileNotFoundError: if it is not installed.
        subprocess.CalledProcessError: if it fails.
    """
    program = find_povray()
    if program is None:
        raise FileNotFoundError("expected the program povray, found none")
    (folder / "scene.pov").write_text(povray_source(scene, display, depth, weakest))
    size = (f"+W{display.width_px}", f"+H{display.height_px}")
    environ = {**os.environ, "HOME": str(folder)}
    done = subprocess.run(
        (program, "+Iscene.pov", *size, "-A", "-D", *options),
        cwd=folder,
        env=environ,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    )
    return done.stderr


def read_ppm(content: bytes) -> NDArray[np.float64]:
    """(h, w, 3) float64 from 0 to 1 of a binary PPM of 16 bits."""
    head = re.match(rb"P6\s+(?:#.*\n\s*)*(\d+)\s+(\d+)\s+(65535)\s", content)
    assert head is not None, content[:80]
    width, height, largest = map(int, head.groups())
    return np.frombuffer(content, ">u2", offset=head.end()).reshape(height, width, 3) / float(largest)


def povray_source(scene: Scene, display: Display, depth: int, weakest: float = 0.0) -> str:
    """The scene in POV-Ray's language: our vectors as they are, since its camera states its own axes.

    Args:
        scene, display, depth: as in `povray_picture`.
        weakest: weight below which a ray is not followed.
    """
    view = view_frame(scene.camera, display)
    width, height = display.width_px * view.step_x, -display.height_px * view.step_y
    middle = view.corner + width / 2 - height / 2
    around = scene.surroundings
    parts = [
        "#version 3.7;",
        f"global_settings {{ assumed_gamma 1.0 adc_bailout {weakest!r} max_trace_level {depth + 1} "
        f"ambient_light rgb {_vector(around.ambient)} }}",
        f"camera {{ perspective location {_vector(scene.camera.position)} direction {_vector(middle)} "
        f"right {_vector(width)} up {_vector(height)} }}",
        "sky_sphere { pigment { function { min(max(y, 0), 0.9999999) } color_map { "
        f"[0 rgb {_vector(around.horizon)}] [1 rgb {_vector(around.zenith)}] }} }} }}",
    ]
    for light in scene.lights:
        assert isinstance(light, PointLight)
        assert light.casts_shadows
        colour = np.array(light.intensity) / (2 * NEAR_M**2)
        parts.append(
            f"light_source {{ {_vector(light.position)} color rgb {_vector(colour)} "
            f"fade_distance {NEAR_M} fade_power 2 }}"
        )
    parts.extend(_mesh(mesh) for mesh in scene.meshes)
    parts.extend(_sphere(sphere) for sphere in scene.spheres)
    return "\n".join(parts) + "\n"


def _mesh(mesh: Mesh) -> str:
    normals = ""
    if mesh.normals is not None:
        normals = f"normal_vectors {{ {len(mesh.normals)}, {_vectors(mesh.normals)} }} "
    looks = _material(mesh.material, mesh.casts_shadows)
    return (
        f"mesh2 {{ vertex_vectors {{ {len(mesh.vertices)}, {_vectors(mesh.vertices)} }} {normals}"
        f"face_indices {{ {len(mesh.faces)}, {_vectors(mesh.faces)} }} {looks} }}"
    )


def _sphere(sphere: Sphere) -> str:
    looks = _material(sphere.material, sphere.casts_shadows)
    return f"sphere {{ {_vector(sphere.center)}, {sphere.radius!r} {looks} }}"


def _material(material: Material, casts_shadows: bool) -> str:
    """kd/pi is its `diffuse`, ks its `phong`: both know no colour of the highlight but the light's."""
    (gloss,) = set(material.specular)
    assert not any(material.emission)
    shadow = "" if casts_shadows else "no_shadow "
    phong = f"phong {gloss!r} phong_size {material.shininess!r}"
    if any(material.transmission):
        assert not any(material.diffuse)
        return (
            f"pigment {{ rgbf {_vector((*material.transmission, 1.0))} }} finish {{ ambient 0 diffuse 0 {phong} "
            f"reflection {{ 0, 1 fresnel on }} conserve_energy }} interior {{ ior {material.ior!r} }} {shadow}"
        )
    mirror = f"reflection {{ rgb {_vector(material.reflection)} }} " if any(material.reflection) else ""
    return (
        f"pigment {{ rgb {_vector(material.diffuse)} }} "
        f"finish {{ ambient 1 diffuse {1 / np.pi!r} {phong} {mirror}}} {shadow}"
    )


def _vector(numbers: ArrayLike) -> str:
    return "<" + ", ".join(repr(number) for number in np.asarray(numbers).tolist()) + ">"


def _vectors(rows: NDArray[np.generic]) -> str:
    return ", ".join(_vector(row) for row in rows)
