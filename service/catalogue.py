"""What each scene holds and which effects it calls for, told without loading it twice."""

from __future__ import annotations

from dataclasses import asdict

from pydantic import BaseModel, Field

from renderer.errors import RenderError
from renderer.library import SceneLibrary
from renderer.prepared import PreparedScene


class SceneSummary(BaseModel):
    """One line on a scene; of a broken one `id` and `error` alone, and without details `id` alone."""

    id: str
    title: str | None = None
    triangles: int | None = None
    spheres: int | None = None
    lights: int | None = None
    effects: list[str] | None = Field(default=None, description="what it calls for; nothing else is simulated")
    error: str | None = Field(default=None, description="why it cannot be loaded")


class SceneList(BaseModel):
    """All scenes: the built-in ones first, then those of the scenes folder."""

    scenes: list[SceneSummary]


class EffectReason(BaseModel):
    """An effect and what in the scene calls for it."""

    name: str
    reason: str


class SceneView(BaseModel):
    """The scene's own camera, in the form of a render request's."""

    position: tuple[float, float, float]
    look_at: tuple[float, float, float]
    up: tuple[float, float, float]
    vertical_fov_deg: float


class SceneDetail(BaseModel):
    """A scene."""

    id: str
    title: str
    version: str = Field(description="changes whenever the scene does")
    triangles: int
    spheres: int
    lights: int
    effects: list[EffectReason]
    camera: SceneView
    exposure: float
    bytes: int = Field(description="memory it takes")


class Catalogue:
    """Descriptions of a library's scenes, remembered until a scene changes. Blocks while a scene loads."""

    def __init__(self, library: SceneLibrary) -> None:
        self._library = library
        self._known: dict[tuple[str, str], SceneDetail] = {}

    def all(self) -> SceneList:
        """One line on each scene, broken ones included."""
        return SceneList(scenes=[self._summary(scene_id) for scene_id in self._library.ids()])

    def ids(self) -> SceneList:
        """The scenes' ids alone, without loading any."""
        return SceneList(scenes=[SceneSummary(id=scene_id) for scene_id in self._library.ids()])

    def detail(self, scene_id: str) -> SceneDetail:
        """One scene.

        Raises:
            UnknownScene, SceneError: for a scene that is not there or cannot be loaded.
        """
        version = self._library.version(scene_id)
        if (scene_id, version) not in self._known:
            detail = _describe(scene_id, version, self._library.load(scene_id))
            for known_id, known_version in list(self._known):
                if known_id == scene_id:
                    self._known.pop((known_id, known_version), None)
            self._known[scene_id, version] = detail
        return self._known[scene_id, version]

    def _summary(self, scene_id: str) -> SceneSummary:
        try:
            detail = self.detail(scene_id)
        except RenderError as error:
            return SceneSummary(id=scene_id, error=str(error))
        return SceneSummary(
            **detail.model_dump(include={"id", "title", "triangles", "spheres", "lights"}),
            effects=[effect.name for effect in detail.effects],
        )


def _describe(scene_id: str, version: str, prepared: PreparedScene) -> SceneDetail:
    scene = prepared.scene
    return SceneDetail(
        id=scene_id,
        title=scene.title,
        version=version,
        triangles=scene.triangles,
        spheres=len(scene.spheres),
        lights=len(scene.lights),
        effects=[EffectReason(name=effect.name, reason=effect.reason) for effect in prepared.plan.effects],
        camera=SceneView(**asdict(scene.camera)),
        exposure=scene.exposure,
        bytes=prepared.nbytes,
    )
