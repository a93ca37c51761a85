"""Meshes, lights and the camera of COLLADA files (.dae), versions 1.4 and 1.5.

Read here rather than by a library, because pycollada 0.9 leaves out in silence what hangs on a controller, what
is written with decimal commas, and what stands beside empty elements; and so that damage is said with its line.
The scene is shown as it stands, without animation: skinned geometry in its bind pose, morphed geometry in its
base shape. Lines, splines, physics, and references to other files are left out.

Source: Khronos, COLLADA 1.4.1 and 1.5.0 specifications.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.collada_geometry import PRIMITIVES, read_primitive
from renderer.collada_material import ColladaMaterial, mistakes_opacity, read_effect
from renderer.collada_view import parent_from_node, read_camera, read_color, read_light, world_from_file
from renderer.errors import SceneError, SettingsError
from renderer.folder import Folder, percent_decoded
from renderer.framing import DEFAULT_MATERIAL
from renderer.model import Model, StatedLight
from renderer.placement import placed
from renderer.scene import BLACK, MAX_COORDINATE_M, MAX_RADIANCE, Mesh, Rgb
from renderer.texture_search import TextureSearch
from renderer.xml_tree import Element, read_xml

MAX_NODES: Final = 100_000
"""Most nodes of a scene, each counted as often as it is shown."""

MAX_NESTING: Final = 200
"""Deepest nesting of nodes, and longest chain of controllers; a circle of references ends here."""


def read_collada(folder: Folder, data: bytes, inner: str, max_triangles: int) -> Model:
    """The content of a COLLADA file, a mesh for each primitive that a node shows.

    Args:
        folder: where its textures may lie.
        data: the file.
        inner: its path from the folder's root.
        max_triangles: refuse more, counting geometry each time it is shown.

    Raises:
        SceneError: naming the file, the line and the element.
    """
    label = folder.file_label(inner)
    root = read_xml(data, label)
    if root.tag != "COLLADA":
        raise root.refuse("a COLLADA file", f"an element {root.tag}")
    return _Reader(root, TextureSearch(folder, inner), max_triangles, world_from_file(root)).model()


@dataclass(slots=True)
class _Reader:
    """What is read of one file; each primitive and each material is read once."""

    root: Element
    textures: TextureSearch
    max_triangles: int
    world: NDArray[np.float64]
    ids: dict[str, Element] = field(default_factory=dict)
    primitives: dict[tuple[int, int | None], Mesh] = field(default_factory=dict)
    materials: dict[str, ColladaMaterial] = field(default_factory=dict)
    meshes: list[Mesh] = field(default_factory=list)
    lights: list[StatedLight] = field(default_factory=list)
    ambient: Rgb = BLACK
    camera: Camera | None = None
    triangles: int = 0
    mistaken: bool = False

    def model(self) -> Model:
        """What the scene shows, or without a scene all geometry as it stands."""
        for element in self.root.descendants():
            if "id" in element.attributes:
                self.ids.setdefault(element.attributes["id"].strip(), element)
        self.mistaken = mistakes_opacity(self._library("library_effects", "effect"))
        scene = self._scene()
        if scene is not None:
            for node, world_from_node in self._nodes(scene):
                self._show(node, world_from_node)
        if not self.meshes:
            for geometry in self._library("library_geometries", "geometry"):
                self._geometry(geometry, None, self.world)
        notes = tuple(dict.fromkeys(self.textures.notes))
        return Model(tuple(self.meshes), tuple(self.lights), self.ambient, self.camera, notes)

    def _library(self, library: str, tag: str) -> Iterator[Element]:
        return (element for found in self.root.all(library) for element in found.all(tag))

    def _scene(self) -> Element | None:
        stated = self.root.first("scene/instance_visual_scene")
        if stated is not None:
            return self._find(stated.attributes.get("url", ""), stated)
        return next(self._library("library_visual_scenes", "visual_scene"), None)

    def _find(self, reference: str, asked_by: Element) -> Element:
        """The element of this file that a reference such as "#id" means."""
        name = reference.strip().removeprefix("#")
        found = self.ids.get(name) or self.ids.get(percent_decoded(name))
        if found is None:
            raise asked_by.refuse("a reference to an element of this file", repr(reference[:80]))
        return found

    def _target(self, instance: Element) -> Element | None:
        """The element that an instance shows; left out with a note where the file has none of that id."""
        try:
            return self._find(instance.attributes.get("url", ""), instance)
        except SceneError as error:
            self.textures.notes.append(f"left out: {error}")
            return None

    def _nodes(self, scene: Element) -> Iterator[tuple[Element, NDArray[np.float64]]]:
        """All nodes of the scene, depth first, with their (4, 4) transforms to the world."""
        shown = 0
        waiting = [(node, self.world, 1) for node in reversed(self._children(scene))]
        while waiting:
            node, world_from_parent, depth = waiting.pop()
            shown += 1
            if shown > MAX_NODES or depth > MAX_NESTING:
                raise node.refuse(f"at most {MAX_NODES} nodes, nested at most {MAX_NESTING} deep", "more, or a circle")
            world_from_node = world_from_parent @ parent_from_node(node)
            if not (np.abs(world_from_node) <= MAX_COORDINATE_M).all():
                raise node.refuse(f"a transform up to {MAX_COORDINATE_M:g}", "more")
            yield node, world_from_node
            waiting.extend((child, world_from_node, depth + 1) for child in reversed(self._children(node)))

    def _children(self, parent: Element) -> list[Element]:
        """The nodes in a node or scene, its own and those it refers to."""
        found = [child if child.tag == "node" else self._target(child) for child in parent.all("node", "instance_node")]
        return [child for child in found if child is not None]

    def _show(self, node: Element, world_from_node: NDArray[np.float64]) -> None:
        """Take in what a node shows."""
        for instance in node.all("instance_geometry", "instance_controller", "instance_light", "instance_camera"):
            target = self._target(instance)
            if target is None:
                continue
            if instance.tag == "instance_geometry":
                self._geometry(target, instance, world_from_node)
            elif instance.tag == "instance_controller":
                self._controller(target, instance, world_from_node)
            elif instance.tag == "instance_light":
                self._light(target, world_from_node)
            elif self.camera is None:
                self._camera(target, world_from_node)

    def _controller(self, controller: Element, instance: Element, world_from_node: NDArray[np.float64]) -> None:
        """A skin in its bind pose, which does not depend on the node; a morph in its base shape."""
        world_from_mesh = world_from_node
        for _ in range(MAX_NESTING):
            skin = controller.first("skin")
            how = skin or controller.first("morph")
            if how is None:
                break
            if skin is not None:
                bound = np.eye(4)
                shape = skin.first("bind_shape_matrix")
                if shape is not None:
                    values = shape.floats()
                    if len(values) != 16 or not (np.abs(values) <= MAX_COORDINATE_M).all():
                        raise shape.refuse("16 finite numbers", shape.text)
                    bound[:3] = values.reshape(4, 4)[:3]
                world_from_mesh = self.world @ bound
            controller = self._find(how.attributes.get("source", ""), how)
        self._geometry(controller, instance, world_from_mesh)

    def _geometry(self, geometry: Element, instance: Element | None, world_from_mesh: NDArray[np.float64]) -> None:
        """Show the primitives of a geometry, in the materials that its instance binds to them."""
        mesh = geometry.first("mesh") or geometry.first("convex_mesh")
        if mesh is None:
            return
        bound = {} if instance is None else _bound_materials(instance)
        name = f"{self.root.file}: {geometry.attributes.get('name', geometry.attributes.get('id', 'geometry'))!r}"
        for primitive in mesh.all(*PRIMITIVES):
            symbol = primitive.attributes.get("material", "")
            binding = bound.get(symbol)
            look = self._material(symbol if binding is None else binding.attributes.get("target", ""))
            made = self._primitive(primitive, _texcoord(binding, look.texcoord), name)
            self.triangles += len(made.faces)
            if self.triangles > self.max_triangles:
                raise primitive.refuse(f"at most {self.max_triangles} triangles in all", "more")
            self.meshes.append(placed(dataclasses.replace(made, material=look.material), world_from_mesh))

    def _primitive(self, primitive: Element, texcoord: int | None, name: str) -> Mesh:
        key = (id(primitive), texcoord)
        if key not in self.primitives:
            self.primitives[key] = read_primitive(primitive, self._find, texcoord, name, self.max_triangles)
        return self.primitives[key]

    def _material(self, reference: str) -> ColladaMaterial:
        """The material with an id; the default one where the file has none of that id."""
        name = reference.strip().removeprefix("#")
        if name not in self.materials:
            material = self.ids.get(name)
            instance = None if material is None else material.first("instance_effect")
            look = ColladaMaterial(DEFAULT_MATERIAL)
            if material is not None and instance is not None:
                effect = self._target(instance)
                if effect is not None:
                    title = material.attributes.get("name", name)
                    look = read_effect(effect, title, self.ids, self.textures, self.mistaken)
            self.materials[name] = look
        return self.materials[name]

    def _light(self, light: Element, world_from_node: NDArray[np.float64]) -> None:
        for kind in (found for technique in light.all("technique_common") for found in technique.children):
            if kind.tag == "ambient":
                red, green, blue = (
                    min(a + b, MAX_RADIANCE) for a, b in zip(self.ambient, read_color(kind), strict=True)
                )
                self.ambient = (red, green, blue)
            elif kind.tag in ("point", "spot", "directional"):
                self.lights.append(read_light(kind, world_from_node, float(np.abs(self.world[:3, :3]).max())))
                if kind.tag == "spot":
                    self.textures.notes.append("a spot light is shown as one that lights to all sides")

    def _camera(self, camera: Element, world_from_node: NDArray[np.float64]) -> None:
        try:
            self.camera = read_camera(camera, world_from_node)
        except SettingsError as error:
            raise camera.refuse(error.expected, f"{error.field} {error.found}") from None
        if self.camera is None:
            self.textures.notes.append("an orthographic camera is left out")


def _bound_materials(instance: Element) -> dict[str, Element]:
    """The instance_material elements of an instance, by the symbol that its primitives use."""
    found = instance.first("bind_material/technique_common")
    return {} if found is None else {each.attributes.get("symbol", ""): each for each in found.all("instance_material")}


def _texcoord(binding: Element | None, name: str) -> int | None:
    """The set of texture coordinates that a binding gives for the name that a texture uses; None for the first."""
    if binding is None or not name:
        return None
    for bound in binding.all("bind_vertex_input"):
        if bound.attributes.get("semantic") == name:
            return bound.index("input_set", 0)
    return None
