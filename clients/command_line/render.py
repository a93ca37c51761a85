"""`gazetrace render`: one frame into a file, and what it cost."""

from __future__ import annotations

import argparse
import json
import os
import threading
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clients.command_line.errors import OK, UsageError
from clients.command_line.frame_flags import add_frame_flags, frame_request
from clients.command_line.progress import milliseconds_since, working
from clients.command_line.scene_argument import SCENE_HELP, add_scenes_folder, load_scene
from renderer.camera import Camera
from renderer.display import Display
from renderer.frame import Frame, FrameRequest

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from renderer.pipeline import Renderer

FORMAT_OF_SUFFIX = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg", ".webp": "webp", ".raw": "raw"}
MOST_THREADS = 1024
GUESSED = 0.5
"""Share of the screen with one sample a cell from which a frame's error is called guessed."""

OVERLAYS = ("cells", "rays", "roi", "gaze")

DESCRIPTION = """\
Render one frame of SCENE, fine where the gaze is and coarser where the eye could not tell, and say what it cost.

SCENE is the name of a scene (`gazetrace scenes` lists them), the path of a folder with a scene.toml, or the
path of a bare mesh file (OBJ, GLB, glTF, PLY, STL), which is framed and lit by itself."""

EXAMPLES = """\
examples:
  gazetrace render atrium --gaze 600,400 -o frame.png
      A 1920x1080 frame for a screen 50 cm wide, 60 cm from the eye that looks at pixel (600, 400).

  gazetrace render atrium --gaze 600,400 --overlay cells --overlay gaze -o cells.png
      The same with its cells tinted by size, and a cross at the gaze.

  gazetrace render model.obj --full --samples 16 --size 1280x720 -o reference.png
      A mesh file at full resolution, 16 rays a pixel: the reference to compare with.

  gazetrace render spheres --gaze -200,540 --camera-position 0,2,6 --json -o frame.webp
      A gaze left of the screen, another view, and the cost as JSON on standard output."""


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "render",
        help="render one frame into a file",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", metavar="SCENE", help=SCENE_HELP)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="FILE",
        help="where the frame goes: .png, .jpg, .webp, or .raw (float32 linear RGB, little-endian, row by row)",
    )
    add_frame_flags(parser)
    output = parser.add_argument_group("output")
    output.add_argument(
        "--overlay",
        action="append",
        default=[],
        choices=OVERLAYS,
        help="draw the cells, their rays a pixel, the rings at 2.5, 5 and 10 deg, or a cross at the gaze on top; "
        "may be repeated",
    )
    output.add_argument("--json", action="store_true", help="print the cost as JSON")
    add_threads(parser)
    add_scenes_folder(parser)
    parser.set_defaults(run=run)


def add_threads(parser: argparse.ArgumentParser) -> None:
    """Add `--threads`."""
    parser.add_argument("--threads", type=int, metavar="N", help="threads to trace on (default: one a core)")


def check_threads(threads: int | None) -> None:
    """Return if so many threads can be had.

    Raises:
        UsageError: if not.
    """
    if threads is not None and not 1 <= threads <= MOST_THREADS:
        raise UsageError(f"--threads: expected an integer from 1 to {MOST_THREADS}, found {threads}")


def run(arguments: argparse.Namespace) -> int:
    """Render, write the file, print the cost."""
    image_format = output_format(arguments.output)
    linear = image_format == "raw"
    if linear and arguments.overlay:
        raise UsageError("--overlay: expected a .png, .jpg or .webp output to draw on, found .raw")
    check_threads(arguments.threads)
    # Complain about a flag before a scene takes seconds to load.
    require_fit(frame_request(arguments, Camera(), linear=linear).display, image_format)

    prepared = load_scene(arguments.scene, arguments.scenes_folder)
    request = frame_request(arguments, prepared.scene.camera, linear=linear)
    renderer = ready_renderer(arguments.threads)
    started_ns = time.perf_counter_ns()
    with working(f"rendering {arguments.scene}"):
        frame = renderer.render(prepared, request)
    render_ms = milliseconds_since(started_ns)
    pixels = draw_overlays(frame.pixels, request, renderer, arguments.overlay)
    renderer.close()

    from renderer.codec import encode

    started_ns = time.perf_counter_ns()
    data = encode(pixels, image_format)
    encode_ms = milliseconds_since(started_ns)
    write_whole(arguments.output, data)

    cost = cost_record(frame, request, {"encode": encode_ms, "total": render_ms + encode_ms})
    record = {"output": str(arguments.output), "scene": arguments.scene, "format": image_format, **cost}
    print(json.dumps(record, indent=2) if arguments.json else cost_text(record))
    return OK


def ready_renderer(threads: int | None, *, keeps: bool = True, abandon: threading.Event | None = None) -> Renderer:
    """A renderer whose kernels are compiled; one that keeps nothing from frame to frame unless it `keeps`."""
    with working("loading kernels; the first time they are compiled, which takes a minute or two"):
        from renderer.pipeline import Renderer

        renderer = Renderer(threads, abandon=abandon) if keeps else Renderer(threads, 0, 0, abandon=abandon)
        renderer.warm_up()
    return renderer


def output_format(path: Path) -> str:
    """The image format that the file's suffix asks for, once it is clear that the file can be written.

    Raises:
        UsageError: for another suffix, a folder, or a file in a folder that is not there or closed.
    """
    image_format = FORMAT_OF_SUFFIX.get(path.suffix.lower())
    if image_format is None:
        raise UsageError(f"--output: expected a file ending in {', '.join(FORMAT_OF_SUFFIX)}, found {str(path)!r}")
    if path.is_dir():
        raise UsageError(f"--output: expected a file, found the folder {str(path)!r}")
    if not path.parent.is_dir():
        raise UsageError(f"--output: expected a file in an existing folder, found {str(path)!r}")
    if not os.access(path.parent, os.W_OK):
        raise UsageError(f"--output: expected a folder that can be written to, found {str(path.parent)!r}")
    return image_format


def require_fit(display: Display, image_format: str) -> None:
    """Return if a file of this format can hold the frame.

    Raises:
        UsageError: if not.
    """
    from renderer.codec import LONGEST_SIDE_PX

    longest = LONGEST_SIDE_PX.get(image_format)
    if longest is not None and max(display.width_px, display.height_px) > longest:
        size = f"{display.width_px}x{display.height_px}"
        raise UsageError(f"--size: expected sides of at most {longest} pixels for {image_format}, found {size}")


def write_whole(path: Path, data: bytes) -> None:
    """Write `data` beside `path` first, so that nobody ever finds half a file under that name.

    Raises:
        OSError: naming `path`.
    """
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        partial.write_bytes(data)
        partial.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        partial.unlink(missing_ok=True)


def draw_overlays(
    pixels: NDArray[np.uint8] | NDArray[np.float32], request: FrameRequest, renderer: Renderer, overlays: list[str]
) -> NDArray[Any]:
    """`pixels` with the overlays that were asked for, rays and cells below, the gaze on top."""
    from renderer.overlay import draw_cells, draw_gaze, draw_rays, draw_region_of_interest

    drawn: NDArray[Any] = pixels
    if "rays" in overlays or "cells" in overlays:
        cell_map, _ = renderer.cell_map(request.display, request.quality, request.gaze)
        if "rays" in overlays:
            drawn = draw_rays(drawn, cell_map, request.quality.samples_per_cell)
        if "cells" in overlays:
            drawn = draw_cells(drawn, cell_map)
    if "roi" in overlays:
        drawn = draw_region_of_interest(drawn, request.display, request.gaze, request.quality.acuity.eccentricity)
    if "gaze" in overlays:
        drawn = draw_gaze(drawn, request.gaze)
    return drawn


def cost_record(frame: Frame, request: FrameRequest, extra_ms: dict[str, float]) -> dict[str, Any]:
    """What a frame cost, under the names of the wire's frame header."""
    cost = frame.cost
    times = {"map": cost.time_ms.map, "trace": cost.time_ms.trace, "reconstruct": cost.time_ms.reconstruct, **extra_ms}
    rays = cost.rays
    return {
        "width": request.display.width_px,
        "height": request.display.height_px,
        "gaze": {"x": request.gaze.x, "y": request.gaze.y},
        "map": {"kind": cost.map, "cells": cost.cells, "bucket_px": cost.bucket_px, "cached": cost.map_cached},
        "samples_per_cell": cost.samples_per_cell,
        "samples": round(cost.mean_samples, 3),
        "acuity_scale": cost.acuity_scale,
        "deadline_ms": cost.deadline_ms,
        "deadline_promised": cost.deadline_promised,
        "deadline_met": cost.deadline_met,
        "max_error": cost.max_error,
        "error_met": cost.error_met,
        "cells_traced": cost.cells_traced,
        "cells_reused": cost.cells_reused,
        "rays": {
            "primary": rays.primary,
            "shadow": rays.shadow,
            "reflection": rays.reflection,
            "refraction": rays.refraction,
        },
        "effects": list(cost.effects),
        "effect_reasons": dict(zip(cost.effects, cost.effect_reasons, strict=True)),
        "error": {"rms": cost.rms_error, "foveal_rms": cost.foveal_rms_error, "guessed": round(cost.guessed_error, 4)},
        "rejected_samples": asdict(cost.rejected_samples),
        "timing_ms": {stage: round(ms, 3) for stage, ms in times.items()},
    }


def rejected_text(rejected: dict[str, int]) -> list[tuple[str, str]]:
    """A warning about samples that were no light, by why; none where there were none."""
    found = [f"{count:,} {reason.replace('_', ' ')}" for reason, count in rejected.items() if count]
    return [("warning", "samples that are no light: " + ", ".join(found))] if found else []


def cost_text(record: dict[str, Any]) -> str:
    """The same for people, a line a subject."""
    cells, pixels = record["map"]["cells"], record["width"] * record["height"]
    rays = {kind: count for kind, count in record["rays"].items() if count}
    gaze = record["gaze"]
    lines = [
        ("frame", f"{record['output']}: {record['width']}x{record['height']} of {record['scene']}, "
                  f"gaze ({gaze['x']:g}, {gaze['y']:g})"),
        ("cells", f"{cells:,} {record['map']['kind']}, {100 * cells / pixels:.1f} % of the {pixels:,} pixels; "
                  f"{record['samples']:g} samples each"),
        ("rays", f"{sum(rays.values()):,}: " + ", ".join(f"{count:,} {kind}" for kind, count in rays.items())),
        ("effects", ", ".join(record["effects"]) or "none: the scene calls for primary rays only"),
        ("time", ", ".join(f"{ms:,.1f} ms {stage}" for stage, ms in record["timing_ms"].items())),
    ]  # fmt: skip
    if record["deadline_ms"] is not None:
        met = "met" if record["deadline_met"] else "missed" if record["deadline_promised"] else "missed, as foreseen,"
        lines.append(("deadline", f" of {record['deadline_ms']:g} ms {met} with {record['samples_per_cell']} samples "
                                  f"a cell and an acuity scale of {record['acuity_scale']:g}"))  # fmt: skip
    if record["max_error"] is not None:
        met = "met" if record["error_met"] else "not met"
        lines.append(
            ("wish", f"an error of {record['max_error']:g} {met} with {record['samples_per_cell']} samples a cell")
        )
    foveal = record["error"]["foveal_rms"]
    near = "" if foveal is None else f", {foveal:.5f} within 2.5 deg of the gaze"
    known = "estimated" if record["error"]["guessed"] < GUESSED else "guessed from neighbours"
    lines.append(("error", f"{record['error']['rms']:.5f} rms over the screen{near} ({known}, linear, 1 is white)"))
    lines += rejected_text(record["rejected_samples"])
    return "\n".join(f"{name:<8}{text}" for name, text in lines)
