"""The flags that say what a frame looks like: gaze, screen, quality, camera."""

from __future__ import annotations

import argparse
import re
from dataclasses import replace
from typing import Any

from clients.command_line.errors import blame_flag
from renderer.acuity import ECCENTRICITIES, MODELS, Acuity
from renderer.camera import Camera
from renderer.display import Display
from renderer.effect_choice import EFFECTS, read_effect_choice
from renderer.errors import SettingsError
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.quality import ANTIALIASING, ERROR_SAMPLES, MAPS, RECONSTRUCTIONS, Quality

FLAG_OF_FIELD = {
    "gaze": "--gaze",
    "display.width_px": "--size",
    "display.height_px": "--size",
    "display.width_cm": "--screen-cm",
    "display.height_cm": "--screen-cm",
    "display.distance_cm": "--distance-cm",
    "camera.position": "--camera-position",
    "camera.look_at": "--camera-look-at",
    "camera.up": "--camera-up",
    "camera.vertical_fov_deg": "--camera-fov",
    "quality.map": "--map",
    "quality.gaze_bucket_px": "--bucket",
    "quality.samples_per_cell": "--samples",
    "quality.antialiasing": "--antialiasing",
    "quality.shadow_samples": "--shadow-samples",
    "quality.max_depth": "--max-depth",
    "quality.effects": "--effects",
    "quality.reconstruction": "--reconstruction",
    "quality.deadline_ms": "--deadline-ms",
    "quality.max_error": "--max-error",
    "quality.acuity.model": "--acuity-model",
    "quality.acuity.eccentricity": "--eccentricity",
    "quality.acuity.scale": "--acuity-scale",
    "quality.acuity.margin_deg": "--margin-deg",
}


def add_frame_flags(
    parser: argparse.ArgumentParser,
    samples: int = Quality().samples_per_cell,
    *,
    gaze: bool = True,
    detail: bool = True,
) -> None:
    """Add the flags of `FLAG_OF_FIELD` to `parser`, with the records' own defaults, but `samples` a cell.

    Args:
        parser: of the command.
        samples: default of `--samples`.
        gaze: False leaves `--gaze` out, for a command that has its gaze from elsewhere.
        detail: False leaves out those of the quality, for a command that has its own.
    """
    if gaze:
        _add_gaze_flag(parser.add_argument_group("gaze"))
    parser.set_defaults(gaze=None)
    _add_screen_flags(parser.add_argument_group("screen"))
    if detail:
        _add_quality_flags(parser.add_argument_group("detail"), samples)
    camera = parser.add_argument_group("camera (each defaults to the scene's own)")
    camera.add_argument("--camera-position", type=three_numbers, metavar="X,Y,Z", help="where the eye is [m]")
    camera.add_argument("--camera-look-at", type=three_numbers, metavar="X,Y,Z", help="the middle of the picture [m]")
    camera.add_argument("--camera-up", type=three_numbers, metavar="X,Y,Z", help="what is up in the picture")
    camera.add_argument("--camera-fov", type=float, metavar="DEG", help="vertical field of view [deg]")


def _add_gaze_flag(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--gaze",
        type=two_numbers,
        metavar="X,Y",
        help="where the eye looks, in pixels from the top-left corner; may lie off the screen (default: the centre)",
    )


def _add_screen_flags(screen: argparse._ArgumentGroup) -> None:
    default = Display()
    screen.add_argument(
        "--size",
        type=size,
        default=(default.width_px, default.height_px),
        metavar="WxH",
        help=f"the frame in pixels (default {default.width_px}x{default.height_px})",
    )
    screen.add_argument(
        "--screen-cm",
        type=screen_cm,
        default=(default.width_cm, default.height_cm),
        metavar="W[xH]",
        help=f"the screen in centimetres; without H its pixels are square (default {default.width_cm:g})",
    )
    screen.add_argument(
        "--distance-cm",
        type=float,
        default=default.distance_cm,
        metavar="CM",
        help="from the eye to the screen (default %(default)g)",
    )


def _add_quality_flags(detail: argparse._ArgumentGroup, samples: int) -> None:
    default = Quality()
    tiling = detail.add_mutually_exclusive_group()
    tiling.add_argument(
        "--map",
        default=default.map,
        metavar="KIND",
        help=f"how the screen is divided into cells: {', '.join(MAPS)} (default %(default)s)",
    )
    tiling.add_argument(
        "--full", action="store_const", const="full", dest="map", help="one cell a pixel: the reference, as --map full"
    )
    numbers: tuple[tuple[str, type, int | float, str, str], ...] = (
        ("--shadow-samples", int, default.shadow_samples, "N", "shadow rays a cell sends to each light with a size"),
        ("--max-depth", int, default.max_depth, "N", "mirrors and glass boundaries a ray may meet"),
        ("--bucket", int, default.gaze_bucket_px, "PX", "side of the squares of gaze that share a map; 0: none"),
        ("--margin-deg", float, default.acuity.margin_deg, "DEG", "error of the eye tracker to allow for"),
        ("--acuity-scale", float, default.acuity.scale, "F", "2: cells twice as wide as the eye calls for"),
    )
    detail.add_argument(
        "--samples",
        type=int,
        metavar="N",
        help=f"camera rays a cell (default {samples}, or {ERROR_SAMPLES} with --max-error)",
    )
    detail.set_defaults(default_samples=samples)
    for flag, kind, value, metavar, text in numbers:
        detail.add_argument(flag, type=kind, default=value, metavar=metavar, help=f"{text} (default {value:g})")
    detail.add_argument(
        "--deadline-ms",
        type=float,
        metavar="MS",
        help="time for the frame without encoding: fewer samples and, if need be, coarser cells (default: none)",
    )
    detail.add_argument(
        "--max-error",
        type=float,
        metavar="E",
        help="no more samples than it takes for the frame's own standard error, a share of white, to be at most E over "
        "the screen and in the fovea; of --samples at most (default: none)",
    )
    choices = (
        ("--antialiasing", default.antialiasing, "KIND", "where a cell's samples go", ANTIALIASING),
        ("--reconstruction", default.reconstruction, "KIND", "how cells become pixels", RECONSTRUCTIONS),
        ("--acuity-model", default.acuity.model, "MODEL", "how acuity falls off from the gaze", MODELS),
        ("--eccentricity", default.acuity.eccentricity, "KIND", "eye before the screen or the gaze", ECCENTRICITIES),
    )
    for flag, name, metavar, text, names in choices:
        detail.add_argument(
            flag, default=name, metavar=metavar, help=f"{text}: {', '.join(names)} (default %(default)s)"
        )

    detail.add_argument(
        "--effects",
        default="",
        metavar="+ON,-OFF",
        help="force effects on or off to see what they cost, as --effects=+soft_shadows,-reflection; "
        f"there are {', '.join(EFFECTS)} (default: what the scene calls for)",
    )


def frame_request(
    arguments: argparse.Namespace, scene_camera: Camera, *, linear: bool = False, quality: Quality | None = None
) -> FrameRequest:
    """What the flags ask for.

    Args:
        arguments: parsed flags of `add_frame_flags`.
        scene_camera: the scene's own view, for what the flags leave open.
        linear: whether to ask for float32 radiance.
        quality: in place of that of the flags.

    Raises:
        UsageError: naming the flag whose value is out of range.
    """
    try:
        display = display_of(arguments)
        return FrameRequest(
            gaze_of(arguments, display),
            display,
            _camera_of(arguments, scene_camera),
            quality_of(arguments) if quality is None else quality,
            linear,
        )
    except SettingsError as error:
        raise blame_flag(error, FLAG_OF_FIELD) from error


def display_of(arguments: argparse.Namespace) -> Display:
    """The screen that the flags describe."""
    width_px, height_px = arguments.size
    width_cm, height_cm = arguments.screen_cm
    return Display(width_px, height_px, width_cm, height_cm, arguments.distance_cm)


def gaze_of(arguments: argparse.Namespace, display: Display) -> Gaze:
    """The gaze of the flags, or the middle of the screen."""
    if arguments.gaze is None:
        return Gaze(display.width_px / 2, display.height_px / 2)
    return Gaze(*arguments.gaze)


def quality_of(arguments: argparse.Namespace) -> Quality:
    """The detail that the flags ask for."""
    acuity = Acuity(arguments.acuity_model, arguments.eccentricity, arguments.acuity_scale, arguments.margin_deg)
    return Quality(
        map=arguments.map,
        gaze_bucket_px=arguments.bucket,
        samples_per_cell=_samples_of(arguments),
        antialiasing=arguments.antialiasing,
        shadow_samples=arguments.shadow_samples,
        max_depth=arguments.max_depth,
        effects=read_effect_choice(arguments.effects),
        acuity=acuity,
        reconstruction=arguments.reconstruction,
        deadline_ms=arguments.deadline_ms,
        max_error=arguments.max_error,
    )


def _samples_of(arguments: argparse.Namespace) -> int:
    if arguments.samples is not None:
        return int(arguments.samples)
    return ERROR_SAMPLES if arguments.max_error is not None else int(arguments.default_samples)


def camera_changes(arguments: argparse.Namespace) -> dict[str, Any]:
    """What the flags say of the camera."""
    stated = {
        "position": arguments.camera_position,
        "look_at": arguments.camera_look_at,
        "up": arguments.camera_up,
        "vertical_fov_deg": arguments.camera_fov,
    }
    return {name: value for name, value in stated.items() if value is not None}


def _camera_of(arguments: argparse.Namespace, scene_camera: Camera) -> Camera | None:
    changes = camera_changes(arguments)
    return replace(scene_camera, **changes) if changes else None


def two_numbers(text: str) -> tuple[float, float]:
    """Read `X,Y`."""
    x, y = _numbers(text, ",", 2, "two numbers such as 960,540")
    return x, y


def three_numbers(text: str) -> tuple[float, float, float]:
    """Read `X,Y,Z`."""
    x, y, z = _numbers(text, ",", 3, "three numbers such as 0,1.6,5")
    return x, y, z


def size(text: str) -> tuple[int, int]:
    """Read `WxH` in whole pixels."""
    if not re.fullmatch(r"\d{1,9}[xX]\d{1,9}", text):
        raise argparse.ArgumentTypeError(f"expected width and height in pixels such as 1920x1080, found {text!r}")
    width, height = text.lower().split("x")
    return int(width), int(height)


def screen_cm(text: str) -> tuple[float, float | None]:
    """Read `W` or `WxH` in centimetres."""
    if "x" not in text.lower():
        return _numbers(text, "x", 1, "a width such as 50, or 50x35")[0], None
    width, height = _numbers(text.lower(), "x", 2, "width and height in centimetres such as 50x35")
    return width, height


def _numbers(text: str, separator: str, count: int, expected: str) -> tuple[float, ...]:
    parts = text.split(separator)
    try:
        numbers = tuple(float(part) for part in parts)
    except ValueError:
        numbers = ()
    if len(numbers) != count:
        raise argparse.ArgumentTypeError(f"expected {expected}, found {text!r}")
    return numbers
