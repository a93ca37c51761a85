"""No fixed length decides anything where rays meet geometry: each small number there is a share of something."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import renderer

GEOMETRY = (
    "area_light", "ashikhmin_shirley", "camera", "cutout", "direction", "embree", "finishing", "footprint",
    "fresnel", "gather", "grain", "group", "intersection", "lanes", "light_reach", "light_samples", "lighting",
    "media", "nested", "normal_map", "packets", "placement", "places", "polygon", "prepared", "rays",
    "reflectance", "sampling", "shading", "shadow_rays", "shared_face", "spawning", "sphere", "surface",
    "tangent", "whitted",
)  # fmt: skip
"""Modules of the renderer that rays and the surfaces they meet pass through."""

SMALL = 1e-2
"""Numbers below this, other than 0, have to say what they are a share of."""

SHARES = {
    "area_light.SMALLEST_SPHERICAL": "a solid angle in steradians",
    "area_light.IN_PLANE": "of a light's distance: 16 float32 spacings",
    "camera.Camera": "the smallest field of view in degrees, and the sine of an angle between unit vectors",
    "packets.BEYOND": "of the distance of the nearest hit: 30 float32 roundings",
    "packets.PARALLEL": "of a direction's largest part",
    "packets.NEAR_EDGE": "a barycentric weight",
    "packets.ASIDE": "of a direction's largest part: 4 float32 spacings",
    "polygon._FLAT": "the sine of an angle",
    "prepared.FLAT_NORMAL": "a difference between unit vectors",
    "sampling.TO_UNIT": "32-bit integers to [0, 1)",
    "sphere.BEYOND": "of the distance of the nearest hit: four million float64 spacings",
    "sphere.build_sphere_tree": "of a sphere's radius: 4 float64 spacings",
    "surface.OFFSET_ULPS": "of the largest coordinate of a triangle: 16 float32 spacings",
    "surface.SPHERE_OFFSET": "of a sphere's largest coordinate: 16 float64 spacings",
}
"""What each of them is, by where it stands."""


def small_numbers(tree: ast.AST) -> Iterator[ast.AST]:
    """Literals between -SMALL and SMALL but 0, powers with a negative exponent, and spacings of floating point."""
    for node in ast.walk(tree):
        match node:
            case ast.Constant(value=float(value)) if 0.0 < abs(value) < SMALL:
                yield node
            case ast.BinOp(op=ast.Pow(), right=ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int(value)))):
                yield node
            case ast.Attribute(attr="eps" | "tiny" | "smallest_normal" | "spacing" | "nextafter" | "ulp"):
                yield node


def name_of(statement: ast.stmt) -> str:
    match statement:
        case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
            return name
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
            return name
    return ast.unparse(statement)


def test_h17_every_small_number_in_geometry_is_a_share_of_something() -> None:
    """An absolute length would also fail the tests of powers of two, which this one explains."""
    found = set()
    for module in GEOMETRY:
        tree = ast.parse((Path(renderer.__file__).parent / f"{module}.py").read_text())
        found |= {f"{module}.{name_of(statement)}" for statement in tree.body for _ in small_numbers(statement)}
    assert found == set(SHARES)
