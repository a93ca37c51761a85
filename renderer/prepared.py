"""The scene as the kernels read it: re-centred, scaled to about unit size, in flat arrays.

Positions are moved to the middle of the geometry in float64 and scaled by a power of two before they
become float32, so that neither a far nor a tiny or giant scene loses digits to its place or its unit.
Degenerate triangles and exact copies are left out: they show nothing and slow every ray.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.area_light import area_light_table
from renderer.atlas import TextureAtlas, build_atlas
from renderer.direction import unit
from renderer.effect_choice import EffectChoice
from renderer.effects import EffectPlan, plan_effects, without_unseen
from renderer.errors import SceneError
from renderer.intersection import Intersector
from renderer.light_reach import reaching_lights
from renderer.material_table import GRAINED, material_table, readings_of, used_materials
from renderer.media import distinct_spheres, indices_of, rank_media
from renderer.scene import Light, Material, Mesh, PointLight, Scene, Sphere
from renderer.shared_face import join_faces, mixed_bits
from renderer.sphere import SphereTree, build_sphere_tree
from renderer.tangent import TANGENT, mesh_tangents

FACET = 32
"""Numbers a triangle takes: 128 bytes."""

MATERIAL_COLUMN = 24
SMOOTH_COLUMN = 25
NORMAL_COLUMN = 26
REACH_COLUMN = 29
DENSITY_COLUMN = 30
OTHER_COLUMN = 31

LIGHT = np.dtype([*((name, np.float64) for name in ("x", "y", "z", "red", "green", "blue")), ("casts", np.int64)])
"""One point light in scene units; `casts` is 1 where shadow rays are to be traced."""


class Surfaces(NamedTuple):
    """Everything the shading kernels read of a scene.

    Attributes:
        facets: (m, FACET) float32, one triangle each, in two cache lines: for each of its three corners
            position, unit normal and texture coordinates; then the row of its material, 1 where the
            corner normals are not the triangle's own, its own unit normal, its largest coordinate, its
            texture coordinates per scene unit, and the medium of a second solid that it bounds, see `shared_face`.
        tangents: (m, TANGENT) float32, see `tangent`; (0, TANGENT) where no material is grained or
            has a normal map that shows.
        spheres: analytic spheres.
        materials: (k,) MATERIAL, each that something visible has.
        lights: (l,) LIGHT, each point light that can be noticed.
        area_lights: (a,) AREA_LIGHT, each light with a size that shines.
        surroundings: (3, 3) float64 radiance at the zenith, at the horizon, and from everywhere.
        textures: pictures.
        indices: (m + 1,) float64 index of refraction of air and of each medium by number, see `media`.
    """

    facets: NDArray[np.float32]
    tangents: NDArray[np.float32]
    spheres: SphereTree
    materials: NDArray[np.void]
    lights: NDArray[np.void]
    area_lights: NDArray[np.void]
    surroundings: NDArray[np.float64]
    textures: TextureAtlas
    indices: NDArray[np.float64]


class Sieve(NamedTuple):
    """The cut-out things of a scene that cast shadows: rays to lights pass their holes.

    Attributes:
        surfaces: their triangles and spheres alone, with the materials and textures of the scene.
        intersector: over the same.
    """

    surfaces: Surfaces
    intersector: Intersector


@dataclass(frozen=True, eq=False, slots=True)
class PreparedScene:
    """A scene ready to be traced.

    Attributes:
        scene: as its author stated it, but for what cannot be seen.
        plan: the effects it calls for.
        center: (3,) float64 world position of the scene-unit origin [m].
        scale: scene units per metre, a power of two.
        brightest: largest radiance that something sends out by itself; highlights of lights may be brighter.
        surfaces: what the kernels read.
        intersector: what answers rays.
        nbytes: approximate size in memory.
        sieve: its cut-out things that cast shadows; None where there are none.
        identity: stands for the scene in caches, so that they do not keep the scene itself in memory.
        variants: the same with effects forced on or off, by choice, for `with_effects`.
    """

    scene: Scene
    plan: EffectPlan
    center: NDArray[np.float64]
    scale: float
    brightest: float
    surfaces: Surfaces
    intersector: Intersector
    nbytes: int
    sieve: Sieve | None = None
    identity: object = field(default_factory=object)
    variants: dict[EffectChoice, PreparedScene] = field(default_factory=dict)


EMBREE_BYTES_A_TRIANGLE = 150
"""Rough size of Embree's tree and vertex copy, for the bound on cached scenes [byte]."""


def prepare(scene: Scene) -> PreparedScene:
    """Turn a scene into what the kernels read.

    Raises:
        SceneError: where it is too far spread out for float32.
    """
    scene = without_unseen(scene)
    plan = plan_effects(scene)
    center, scale = _centre_and_scale(scene)
    materials = used_materials(scene)
    readings = itertools.chain(*(readings_of(material, plan) for material in materials))
    atlas, picture = build_atlas(list(dict.fromkeys(readings)))
    row = {material: index for index, material in enumerate(materials)}
    media = rank_media(materials)
    table = material_table(materials, media, picture, plan)
    directed = (table["calls"] & GRAINED != 0) | (table["normal_picture"] >= 0)
    vertices, faces, facets, tangents, casts = _triangles(scene, row, table["medium"], directed, center, scale)
    pierced = table["alpha_picture"] >= 0
    whole = ~pierced[facets[:, MATERIAL_COLUMN].astype(np.int64)]
    spheres = _sphere_tree(
        [
            dataclasses.replace(s, casts_shadows=s.casts_shadows and not pierced[row[s.material]])
            for s in distinct_spheres(scene.spheres, media)
        ],
        row, center, scale,
    )  # fmt: skip
    lights = sorted(reaching_lights(scene), key=_rank)
    area_lights = [
        light for light in sorted(scene.lights, key=_rank) if not isinstance(light, PointLight) and any(light.radiance)
    ]
    surfaces = Surfaces(
        facets=facets,
        tangents=tangents,
        spheres=spheres,
        materials=table,
        textures=atlas,
        lights=_light_table([light for light in lights if isinstance(light, PointLight)], plan, center, scale),
        area_lights=area_light_table(area_lights, lights, center, scale, "soft_shadows" in plan.names),
        surroundings=np.array(
            [scene.surroundings.zenith, scene.surroundings.horizon, scene.surroundings.ambient], dtype=np.float64
        ),
        indices=indices_of(media),
    )
    intersector = Intersector(vertices, faces, casts & whole, spheres, surfaces.area_lights)
    sieved = _sphere_tree(
        [s for s in scene.spheres if s.casts_shadows and pierced[row[s.material]]], row, center, scale
    )
    sieve = _sieve(surfaces, sieved, vertices, faces, casts & ~whole)
    nbytes = facets.nbytes + tangents.nbytes + surfaces.textures.texels.nbytes + EMBREE_BYTES_A_TRIANGLE * len(faces)
    nbytes += sum(mesh.vertices.nbytes + mesh.faces.nbytes for mesh in scene.meshes)
    brightest = max(itertools.chain(scene.surroundings.zenith, scene.surroundings.horizon,
                                    *(material.emission for material in materials),
                                    *(light.radiance for light in area_lights)))  # fmt: skip
    return PreparedScene(scene, plan, center, scale, brightest, surfaces, intersector, nbytes, sieve)


def _rank(light: Light) -> tuple[object, ...]:
    """Where a light stands among the others, whatever their order in the scene: sums and samples depend on it.

    By colour before place, so that a scene may be turned.
    """
    colour = light.intensity if isinstance(light, PointLight) else light.radiance
    return type(light).__name__, colour, dataclasses.astuple(light)


def _sphere_tree(
    spheres: Sequence[Sphere], row: dict[Material, int], center: NDArray[np.float64], scale: float
) -> SphereTree:
    """Spheres in scene units."""
    return build_sphere_tree(
        (np.array([sphere.center for sphere in spheres]).reshape(-1, 3) - center) * scale,
        np.array([sphere.radius for sphere in spheres], dtype=np.float64) * scale,
        np.array([row[sphere.material] for sphere in spheres], dtype=np.int32),
        np.array([sphere.casts_shadows for sphere in spheres], dtype=np.uint8),
    )


def _sieve(
    surfaces: Surfaces,
    spheres: SphereTree,
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    pierced: NDArray[np.bool_],
) -> Sieve | None:
    """The cut-out things that cast shadows, by the (m,) bool mask of the triangles; None where there are none."""
    if not pierced.any() and len(spheres.radius) == 0:
        return None
    facets = aligned_facets(int(pierced.sum()))
    facets[:] = surfaces.facets[pierced]
    alone = surfaces._replace(facets=facets, spheres=spheres, area_lights=surfaces.area_lights[:0])
    everything = np.ones(len(facets), dtype=np.bool_)
    return Sieve(alone, Intersector(vertices, faces[pierced], everything, spheres, alone.area_lights))


def _centre_and_scale(scene: Scene) -> tuple[NDArray[np.float64], float]:
    """Middle of the geometry and the power of two that makes its half extent about 1.

    Spheres are traced in float64 and count only where there are no triangles; digits are then needed
    most around the smallest one, which may lie on one as large as the Earth.
    """
    boxes = [(mesh.vertices[mesh.faces].min((0, 1)), mesh.vertices[mesh.faces].max((0, 1)))
             for mesh in scene.meshes if len(mesh.faces)]  # fmt: skip
    if not boxes:
        boxes = [(np.subtract(s.center, s.radius), np.add(s.center, s.radius)) for s in scene.spheres]
    if not boxes:
        return np.zeros(3), 1.0
    low = np.min([box[0] for box in boxes], axis=0)
    high = np.max([box[1] for box in boxes], axis=0)
    half = float((high - low).max()) / 2
    middle = (low + high) / 2
    if not scene.triangles:
        middle = np.array(min(scene.spheres, key=lambda sphere: sphere.radius).center, dtype=np.float64)
    return middle, math.ldexp(1.0, min(MAX_SCALE_EXPONENT, -math.frexp(half)[1])) if half > 0.0 else 1.0


MAX_SCALE_EXPONENT = 60
"""Scenes smaller than 2^-60 m are not made larger: a camera 1e15 m away must stay within float32."""


def _light_table(
    lights: list[PointLight], plan: EffectPlan, center: NDArray[np.float64], scale: float
) -> NDArray[np.void]:
    """Point lights in scene units: intensity over squared distance stays the same when both are scaled."""
    table = np.zeros(len(lights), dtype=LIGHT)
    for row, light in enumerate(lights):
        x, y, z = (np.array(light.position) - center) * scale
        red, green, blue = np.array(light.intensity) * (scale * scale)
        table[row] = (x, y, z, red, green, blue, light.casts_shadows and "shadows" in plan.names)
    return table


_Triangles = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]


def _triangles(
    scene: Scene,
    row: dict[Material, int],
    medium: NDArray[np.int32],
    directed: NDArray[np.bool_],
    center: NDArray[np.float64],
    scale: float,
) -> _Triangles:
    """Vertices, faces, facets, tangents and shadow flags of all meshes together.

    Args:
        scene: with the meshes.
        row: of each material in the material table.
        medium: (k,) int32 column of the material table.
        directed: (k,) bool rows of the material table that need tangents.
        center, scale: of the scene's units.
    """
    meshes = [mesh for mesh in scene.meshes if len(mesh.faces)]
    vertices = [np.zeros((0, 3), dtype=np.float32)]
    faces = [np.zeros((0, 3), dtype=np.int64)]
    facets = aligned_facets(sum(len(mesh.faces) for mesh in meshes))
    any_directed = any(directed[row[mesh.material]] for mesh in meshes)
    tangents = np.zeros((len(facets) if any_directed else 0, TANGENT), dtype=np.float32)
    casts = np.zeros(len(facets), dtype=np.bool_)
    first_vertex = first_face = 0
    for mesh in meshes:
        local = ((mesh.vertices - center) * scale).astype(np.float32)
        part = slice(first_face, first_face + len(mesh.faces))
        _fill_facets(mesh, local, row[mesh.material], facets[part])
        if directed[row[mesh.material]]:
            tangents[part] = mesh_tangents(mesh)
        vertices.append(local)
        faces.append(mesh.faces + first_vertex)
        casts[part] = mesh.casts_shadows
        first_vertex += len(local)
        first_face = part.stop
    if first_vertex > np.iinfo(np.int32).max:
        raise SceneError(f"{scene.title or 'scene'}: expected fewer than 2^31 vertices, found {first_vertex}")
    keep = _distinct(facets)
    if medium.any():
        keep = _shared(facets, keep, medium)
    if len(keep) < len(facets):
        kept = aligned_facets(len(keep))
        kept[:] = facets[keep]
        facets = kept
        tangents = tangents[keep] if any_directed else tangents
    return np.concatenate(vertices), np.concatenate(faces).astype(np.int32)[keep], facets, tangents, casts[keep]


def aligned_facets(count: int) -> NDArray[np.float32]:
    """(count, FACET) float32 zeros whose rows begin on cache-line pairs."""
    row_bytes = 4 * FACET
    raw = np.zeros(count * row_bytes + row_bytes, dtype=np.uint8)
    start = -raw.ctypes.data % row_bytes
    return raw[start : start + count * row_bytes].view(np.float32).reshape(count, FACET)


def _fill_facets(mesh: Mesh, local: NDArray[np.float32], material: int, facets: NDArray[np.float32]) -> None:
    """Write the triangles of a mesh whose vertices in scene units are `local`, (n, 3) float32."""
    corners = np.zeros((len(mesh.faces), 3, 8), dtype=np.float32)
    corners[:, :, :3] = local[mesh.faces]
    edge = corners[:, 1:, :3].astype(np.float64) - corners[:, :1, :3]
    own = unit(np.cross(edge[:, 0], edge[:, 1]))[:, None, :]
    if mesh.normals is None:
        corners[:, :, 3:6] = own
    else:
        given = unit(np.asarray(mesh.normals, dtype=np.float64))[mesh.faces]
        corners[:, :, 3:6] = np.where((given == 0.0).all(axis=2, keepdims=True), own, given)
    if mesh.uvs is not None:
        with np.errstate(over="ignore", invalid="ignore"):
            corners[:, :, 6:8] = mesh.uvs[mesh.faces]
    facets[:, :MATERIAL_COLUMN] = corners.reshape(-1, MATERIAL_COLUMN)
    facets[:, MATERIAL_COLUMN] = material
    facets[:, NORMAL_COLUMN : NORMAL_COLUMN + 3] = own[:, 0]
    facets[:, REACH_COLUMN] = np.abs(corners[:, :, :3]).max(axis=(1, 2))
    facets[:, DENSITY_COLUMN] = _densities(corners, edge)
    facets[:, SMOOTH_COLUMN] = np.abs(corners[:, :, 3:6] - own).max(axis=(1, 2)) > FLAT_NORMAL


def _densities(corners: NDArray[np.float32], edge: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m,) texture coordinates per scene unit: the root of the ratio of a triangle's areas; 0 where there is none.

    Args:
        corners: (m, 3, 8) as in facets.
        edge: (m, 2, 3) from the first corner to the others.
    """
    with np.errstate(all="ignore"):
        along = corners[:, 1:, 6:8].astype(np.float64) - corners[:, :1, 6:8]
        flat = np.abs(along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0])
        density = np.sqrt(flat / np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1))
    return np.where(density <= np.finfo(np.float32).max, density, 0.0)


FLAT_NORMAL = 1e-6
"""Largest difference of a corner normal from the triangle's own that is rounding only."""


def _distinct(facets: NDArray[np.float32]) -> NDArray[np.int64]:
    """Rows of triangles to keep: with an area, and the first of those at the same place."""
    positions = facets[:, :MATERIAL_COLUMN].reshape(-1, 3, 8)[:, :, :3]
    wide = positions.astype(np.float64)
    area = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    solid = np.flatnonzero((area != 0.0).any(axis=1))
    flat = positions[solid].reshape(len(solid), 9) + np.float32(0.0)
    mixed = np.sort(mixed_bits(flat))
    if not (mixed[1:] == mixed[:-1]).any():
        return solid
    _, first = np.unique(flat, axis=0, return_index=True)
    return np.asarray(solid[np.sort(first)])


def _shared(facets: NDArray[np.float32], rows: NDArray[np.int64], medium: NDArray[np.int32]) -> NDArray[np.int64]:
    """Those of `rows` to keep where solids share faces; the kept ones get to know whose faces they stand for."""
    corners = facets[rows, :MATERIAL_COLUMN].reshape(-1, 3, 8)[:, :, :3]
    normals = facets[rows, NORMAL_COLUMN : NORMAL_COLUMN + 3]
    keep, other = join_faces(corners, normals, medium[facets[rows, MATERIAL_COLUMN].astype(np.int64)].astype(np.int64))
    facets[rows, OTHER_COLUMN] = other
    return np.asarray(rows[keep])
