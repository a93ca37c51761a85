"""What a client may ask for, checked and turned into the renderer's records.

The fields, their defaults and their bounds are the records' own, so that the OpenAPI document says what the
renderer does. Bodies are read strictly (no number in quotes); query parameters are text and are read as numbers.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, model_validator

from renderer.acuity import MAX_MARGIN_DEG, MAX_SCALE, Acuity
from renderer.camera import MAX_POSITION_M, Camera
from renderer.display import MAX_LENGTH_CM, MAX_SIDE_PX, Display
from renderer.effect_choice import EFFECTS, read_effect_choice
from renderer.frame import FrameRequest
from renderer.gaze import MAX_GAZE_PX, Gaze
from renderer.quality import (
    ERROR_SAMPLES,
    MAX_BUCKET_PX,
    MAX_DEADLINE_MS,
    MAX_DEPTH,
    MAX_ERROR,
    MAX_SAMPLES,
    Quality,
)
from service.rendering import Order

DISPLAY = Display()
QUALITY = Quality()
ACUITY = Acuity()
CAMERA = Camera()

IMAGE_QUALITY = 90
"""Quality of JPEG and WebP where a request names none."""

SceneId = Annotated[str, Field(max_length=64, description="a scene's id, from /v1/scenes")]
GazeCoordinate = Annotated[float, Field(ge=-MAX_GAZE_PX, le=MAX_GAZE_PX)]
GazeUnit = Annotated[
    Literal["px", "fraction"], Field(description="of the gaze: display pixels, or shares (0 to 1) of width and height")
]
SidePx = Annotated[int, Field(ge=1, le=MAX_SIDE_PX, description="size of the frame [px]")]
LengthCm = Annotated[float, Field(gt=0, le=MAX_LENGTH_CM, description="physical size of the screen [cm]")]
DistanceCm = Annotated[float, Field(gt=0, le=MAX_LENGTH_CM, description="from the eye to the screen [cm]")]
MapKind = Annotated[
    Literal["aligned", "scanline", "full"],
    Field(description="tiling of the screen into cells; full: one cell a pixel"),
]
BucketPx = Annotated[
    int, Field(ge=0, le=MAX_BUCKET_PX, description="side of the squares of gaze that share a map [px]; 0: exact gaze")
]
Samples = Annotated[int, Field(ge=1, le=MAX_SAMPLES, description="camera rays a cell")]
Antialiasing = Annotated[
    Literal["stochastic", "regular", "adaptive"],
    Field(description="where in a cell they go; adaptive: samples_per_cell only where fewer leave a visible error"),
]
ShadowSamples = Annotated[
    int, Field(ge=1, le=MAX_SAMPLES, description="shadow rays a cell sends to each light with a size")
]
Depth = Annotated[int, Field(ge=0, le=MAX_DEPTH, description="mirrors and boundaries a ray may meet")]
FORCED = "effects forced on or off whatever the scene calls for: +soft_shadows, -reflection"
Effects = Annotated[list[Annotated[str, Field(max_length=40)]], Field(max_length=len(EFFECTS), description=FORCED)]
Reconstruction = Annotated[
    Literal["nearest", "smooth"],
    Field(description="how cells become pixels: each its cell's colour, or cells blended into their neighbours"),
]
DeadlineMs = Annotated[
    float,
    Field(
        gt=0,
        le=MAX_DEADLINE_MS,
        description="time for the frame without encoding [ms]: fewer samples and, if need be, coarser cells",
    ),
]
MaxError = Annotated[
    float,
    Field(
        gt=0,
        le=MAX_ERROR,
        description="standard error, a share of white, that the frame may state over the screen and in the fovea: no "
        f"more samples than it takes, of samples_per_cell at most ({ERROR_SAMPLES} where that is not stated)",
    ),
]
AcuityModel = Annotated[
    Literal["peli", "geisler-perry", "guenter", "watson", "stelacsf"],
    Field(description="what the eye resolves away from the gaze"),
]
Eccentricity = Annotated[
    Literal["exact", "paper"], Field(description="the eye is in front of the screen's centre, or of the gaze")
]
AcuityScale = Annotated[
    float, Field(ge=1 / MAX_SCALE, le=MAX_SCALE, description="factor on the cells' width; above 1: coarser")
]
MarginDeg = Annotated[float, Field(ge=0, le=MAX_MARGIN_DEG, description="error of the eye tracker to allow for [deg]")]
Format = Annotated[
    Literal["png", "jpeg", "webp", "raw"],
    Field(description="raw: float32 little-endian linear Rec.709 radiance, height * width * 3, top row first"),
]
ImageQuality = Annotated[int, Field(ge=1, le=100, description="of JPEG and WebP")]
Point = Annotated[
    list[Annotated[float, Field(ge=-MAX_POSITION_M, le=MAX_POSITION_M)]],
    Field(min_length=3, max_length=3, description="x, y, z [m]"),
]


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class GazeBody(_Body):
    """Where the eye looks."""

    x: GazeCoordinate
    y: GazeCoordinate
    unit: GazeUnit = "px"


class DisplayBody(_Body):
    """The screen and the distance it is seen from."""

    width_px: SidePx = DISPLAY.width_px
    height_px: SidePx = DISPLAY.height_px
    width_cm: LengthCm = DISPLAY.width_cm
    height_cm: LengthCm | None = Field(default=DISPLAY.height_cm, description="null: square pixels")
    distance_cm: DistanceCm = DISPLAY.distance_cm

    def record(self) -> Display:
        """The renderer's record.

        Raises:
            SettingsError: for pixels too small to reckon with.
        """
        return Display(**self.model_dump())


class CameraBody(_Body):
    """The view."""

    position: Point
    look_at: Point
    up: Point = list(CAMERA.up)
    vertical_fov_deg: float = Field(default=CAMERA.vertical_fov_deg, ge=1e-3, le=179.0)

    def record(self) -> Camera:
        """The renderer's record.

        Raises:
            SettingsError: for a view of no length, or `up` along it.
        """
        position, look_at, up = ((x, y, z) for x, y, z in (self.position, self.look_at, self.up))
        return Camera(position, look_at, up, self.vertical_fov_deg)


class AcuityBody(_Body):
    """The eye."""

    model: AcuityModel = "peli"
    eccentricity: Eccentricity = "exact"
    scale: AcuityScale = ACUITY.scale
    margin_deg: MarginDeg = ACUITY.margin_deg

    def record(self) -> Acuity:
        """The renderer's record."""
        return Acuity(**self.model_dump())


_Asking = TypeVar("_Asking", bound="QualityBody | FrameQuery")


def _with_enough_samples(asking: _Asking) -> _Asking:
    """What asks for an error and not for a number of samples may have as many as that usually takes."""
    if asking.max_error is not None and "samples_per_cell" not in asking.model_fields_set:
        asking.samples_per_cell = ERROR_SAMPLES
    return asking


class QualityBody(_Body):
    """What the frame may cost."""

    map: MapKind = "aligned"
    gaze_bucket_px: BucketPx = QUALITY.gaze_bucket_px
    samples_per_cell: Samples = QUALITY.samples_per_cell
    antialiasing: Antialiasing = "stochastic"
    shadow_samples: ShadowSamples = QUALITY.shadow_samples
    max_depth: Depth = QUALITY.max_depth
    effects: Effects = []
    acuity: AcuityBody = AcuityBody()
    reconstruction: Reconstruction = "nearest"
    deadline_ms: DeadlineMs | None = None
    max_error: MaxError | None = None

    @model_validator(mode="after")
    def _enough_samples(self) -> Self:
        return _with_enough_samples(self)

    def record(self) -> Quality:
        """The renderer's record."""
        stated = self.model_dump(exclude={"acuity", "effects"})
        return Quality(acuity=self.acuity.record(), effects=tuple(self.effects), **stated)


class _ViewBody(_Body):
    scene: SceneId
    display: DisplayBody = DisplayBody()
    camera: CameraBody | None = Field(default=None, description="null: the scene's own")
    quality: QualityBody = QualityBody()
    format: Format = "png"
    image_quality: ImageQuality = IMAGE_QUALITY

    def request_at(self, gaze: Gaze, display: Display) -> FrameRequest:
        """The same for a gaze on the display, which is this one's own."""
        camera = None if self.camera is None else self.camera.record()
        return FrameRequest(gaze, display, camera, self.quality.record(), linear=self.format == "raw")


class RenderBody(_ViewBody):
    """A frame: only `scene` and `gaze` are required."""

    model_config = ConfigDict(
        json_schema_extra={
            "example": {
                "scene": "atrium",
                "gaze": {"x": 1000, "y": 500},
                "display": {"width_px": 1920, "height_px": 1080, "width_cm": 50, "height_cm": 35, "distance_cm": 60},
                "quality": {"samples_per_cell": 4},
                "format": "png",
            }
        }
    )

    gaze: GazeBody

    def order(self) -> Order:
        """The same in the renderer's terms.

        Raises:
            SettingsError: naming the field, for what only the renderer's records can tell.
        """
        display = self.display.record()
        gaze = gaze_on(display, self.gaze.x, self.gaze.y, self.gaze.unit)
        return Order(self.scene, self.request_at(gaze, display), self.format, self.image_quality)


class StreamBody(_ViewBody):
    """What a stream shows: only `scene` is required. `format` is that of all frames but the last, lossless one."""

    gaze: GazeBody | None = None
    format: Format = "jpeg"

    def order(self) -> Order:
        """The same in the renderer's terms, for a gaze in the middle of the screen.

        Raises:
            SettingsError: naming the field, for what only the renderer's records can tell.
        """
        display = self.display.record()
        middle = Gaze(display.width_px / 2, display.height_px / 2)
        return Order(self.scene, self.request_at(middle, display), self.format, self.image_quality)


class NoQuery(BaseModel):
    """No query parameters."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class SceneListQuery(NoQuery):
    """How much a list of scenes tells."""

    details: bool = True


class CellQuery(NoQuery):
    """What decides the cells, as query parameters."""

    gaze_x: GazeCoordinate
    gaze_y: GazeCoordinate
    unit: GazeUnit = "px"
    width_px: SidePx = DISPLAY.width_px
    height_px: SidePx = DISPLAY.height_px
    width_cm: LengthCm = DISPLAY.width_cm
    height_cm: LengthCm | None = Field(
        default=DISPLAY.height_cm, description="physical height [cm]; none: square pixels"
    )
    distance_cm: DistanceCm = DISPLAY.distance_cm
    map: MapKind = "aligned"
    gaze_bucket_px: BucketPx = QUALITY.gaze_bucket_px
    samples_per_cell: Samples = QUALITY.samples_per_cell
    acuity_model: AcuityModel = "peli"
    eccentricity: Eccentricity = "exact"
    acuity_scale: AcuityScale = ACUITY.scale
    margin_deg: MarginDeg = ACUITY.margin_deg

    def display(self) -> Display:
        """The renderer's record."""
        return Display(self.width_px, self.height_px, self.width_cm, self.height_cm, self.distance_cm)

    def gaze(self) -> Gaze:
        """The renderer's record."""
        return gaze_on(self.display(), self.gaze_x, self.gaze_y, self.unit)

    def quality(self) -> Quality:
        """The renderer's record."""
        acuity = Acuity(self.acuity_model, self.eccentricity, self.acuity_scale, self.margin_deg)
        return Quality(self.map, self.gaze_bucket_px, self.samples_per_cell, acuity=acuity)


class CellMapQuery(CellQuery):
    """The cells for a gaze."""

    format: Literal["png", "json"] | None = Field(
        default=None, description="none: what the Accept header prefers, else JSON"
    )
    drawing: Literal["cells", "rays"] = Field(
        default="cells", description="of a picture: the cells coloured by their side, or by camera rays a pixel"
    )


class FrameQuery(CellQuery):
    """A frame of the scene's own view, as query parameters."""

    antialiasing: Antialiasing = "stochastic"
    shadow_samples: ShadowSamples = QUALITY.shadow_samples
    max_depth: Depth = QUALITY.max_depth
    effects: Annotated[str, Field(max_length=200, description=f"{FORCED}, with commas between")] = ""
    reconstruction: Reconstruction = "nearest"
    deadline_ms: DeadlineMs | None = None
    max_error: MaxError | None = None
    format: Format = "png"
    image_quality: ImageQuality = IMAGE_QUALITY

    @model_validator(mode="after")
    def _enough_samples(self) -> Self:
        return _with_enough_samples(self)

    def quality(self) -> Quality:
        """The renderer's record."""
        return replace(
            CellQuery.quality(self),
            antialiasing=self.antialiasing,
            shadow_samples=self.shadow_samples,
            max_depth=self.max_depth,
            effects=read_effect_choice(self.effects),
            reconstruction=self.reconstruction,
            deadline_ms=self.deadline_ms,
            max_error=self.max_error,
        )

    def order(self, scene_id: str) -> Order:
        """The same in the renderer's terms."""
        request = FrameRequest(self.gaze(), self.display(), None, self.quality(), linear=self.format == "raw")
        return Order(scene_id, request, self.format, self.image_quality)


def gaze_on(display: Display, x: float, y: float, unit: str) -> Gaze:
    """A gaze in pixels of `display`.

    Raises:
        SettingsError: if it lies too far off the screen.
    """
    if unit == "fraction":
        return Gaze(x * display.width_px, y * display.height_px)
    return Gaze(x, y)
