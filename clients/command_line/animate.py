"""`gazetrace animate`: a clip of a scene as an eye would get it, frame by frame, into a video or pictures."""

from __future__ import annotations

import argparse
import json
import math
import re
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from clients.command_line.clip_text import clip_record, clip_text
from clients.command_line.cluster import add_cluster, check_cluster, joined
from clients.command_line.errors import OK, CommandFailed, UsageError
from clients.command_line.fingerprint import fingerprint
from clients.command_line.frame_flags import add_frame_flags, frame_request
from clients.command_line.frame_folder import FrameFolder
from clients.command_line.gaze_trace_flags import Playback, add_gaze_trace_flags, playback_of
from clients.command_line.interrupt import heeding
from clients.command_line.progress import counting, milliseconds_since, say
from clients.command_line.render import OVERLAYS, add_threads, check_threads, cost_record, draw_overlays, ready_renderer
from clients.command_line.scene_argument import SCENE_HELP, add_scenes_folder, load_scene
from renderer.camera import Camera
from renderer.camera_path import orbited
from renderer.errors import SettingsError
from renderer.gaze import Gaze

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from renderer.frame import FrameRequest
    from renderer.pipeline import Renderer
    from renderer.prepared import PreparedScene

DESCRIPTION = """\
Render a clip of SCENE, each frame as fine as the eye that is played back could tell at that moment.

The gaze comes from a recording, or from the simulated eye; while it is lost, as in a blink, the last one holds. The
camera follows the [[camera_path]] of the scene if it has one, or --orbit, or stays. What was rendered is kept beside
the output until the clip is complete: the same command goes on where it was stopped."""

EXAMPLES = """\
examples:
  gazetrace animate atrium --gaze-trace simulated --fps 25 --samples 4 -o clip.mp4
      Ten seconds of the atrium at 1920x1080, four rays a cell, for a simulated eye.

  gazetrace animate atrium --gaze-trace eye.csv --orbit 90 --overlay gaze -o clip.mp4
      For a recorded eye, whose gaze is marked; the camera turns by a quarter.

  gazetrace animate my-scenes/vase --gaze-trace eye.csv --trace-size 1920x1080 --size 1280x720 -o frames/
      A smaller clip as pictures frames/frame-00000.png and so on, for any video encoder."""

VIDEO_SUFFIXES: Final = (".mp4", ".m4v", ".mkv", ".mov")
FRAME_NAME: Final = "frame-%05d.png"
MAX_FRAMES: Final = 100_000
FPS: Final = (Fraction(1, 10), Fraction(1000))
"""Fewest and most frames a second."""


@dataclass(frozen=True, slots=True)
class Output:
    """Where the clip goes.

    Attributes:
        video: the file to write in the end; None where the pictures are the clip.
        folder: of the pictures.
        pattern: names of the pictures.
    """

    video: Path | None
    folder: Path
    pattern: str


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "animate",
        help="render a clip for a gaze that moves",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", metavar="SCENE", help=SCENE_HELP)
    parser.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="FILE",
        help=f"a video ({', '.join(VIDEO_SUFFIXES)}), a folder for frame-00000.png, ..., or a pattern: clip/%%04d.png",
    )
    parser.add_argument(
        "--fps", type=frame_rate, default=Fraction(25), metavar="F", help="frames a second (default 25)"
    )
    add_gaze_trace_flags(parser)
    add_frame_flags(parser, gaze=False)
    parser.add_argument(
        "--orbit", type=float, metavar="DEG", help="turn the camera so far about what it looks at, over the whole clip"
    )
    parser.add_argument(
        "--overlay", action="append", default=[], choices=OVERLAYS, help="draw on every frame, as `render` does"
    )
    parser.add_argument("--json", action="store_true", help="print what the clip cost as JSON")
    add_threads(parser)
    add_cluster(parser)
    add_scenes_folder(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Render what is missing, put it together, print the cost."""
    check_threads(arguments.threads)
    check_cluster(arguments.cluster)
    frame_request(arguments, Camera())  # complain about a flag before a scene takes seconds to load
    output = output_of(arguments.output, arguments.size)
    playback = playback_of(arguments)
    count = frame_count(playback, arguments.fps)
    if arguments.orbit is not None and not math.isfinite(arguments.orbit):
        raise UsageError(f"--orbit: expected a number of degrees, found {arguments.orbit:g}")
    started_ns = time.perf_counter_ns()
    prepared = load_scene(arguments.scene, arguments.scenes_folder)
    shots = shots_of(arguments, playback, prepared, count)
    from renderer.version import source_hash

    request = {
        "renderer": source_hash(),
        "scene": fingerprint(prepared.scene),
        "size": list(arguments.size),
        "fps": str(arguments.fps),
        "gaze": fingerprint([shot.gaze for shot in shots]),
        "camera": fingerprint([shot.camera for shot in shots]),
        "screen": asdict(shots[0].display),
        "quality": asdict(shots[0].quality),
        "overlay": sorted(set(arguments.overlay)),
    }
    with FrameFolder(output.folder, output.pattern, request) as frames:
        if frames.changed:
            say(f"{output.folder} held frames of another request ({', '.join(frames.changed)}): starting over")
        earlier = len(frames.costs)
        try:
            render_missing(arguments, prepared, shots, frames)
        except KeyboardInterrupt:
            say(f"stopped with {len(frames.costs)} of {count} frames; the same command goes on")
            raise
        costs = [frames.costs[frame] for frame in range(count)]
        if output.video is not None:
            assemble(output.video, frames, count, arguments.fps, arguments.size)
            frames.remove()
    record = {
        "output": str(output.video or output.folder / output.pattern),
        "scene": arguments.scene,
        "fps": float(arguments.fps),
        "seconds": float(count / arguments.fps),
        "bytes": None if output.video is None else output.video.stat().st_size,
        **clip_record(costs, rendered=count - earlier),
        "elapsed_s": round(milliseconds_since(started_ns) / 1e3, 3),
    }
    print(json.dumps(record, indent=2) if arguments.json else clip_text(record))
    return OK


def output_of(text: str, size: tuple[int, int]) -> Output:
    """What `--output` names.

    Raises:
        UsageError: if it is none of a video, a folder and a pattern, cannot be written, or needs what is not there.
    """
    path = Path(text)
    suffix = path.suffix.lower()
    if suffix in VIDEO_SUFFIXES and not path.is_dir():
        _require_video(size)
        output = Output(path, path.with_name(f"{path.name}.frames"), FRAME_NAME)
    elif suffix == ".png" and re.fullmatch(r"[^%]*%0?\d*d[^%]*", path.name):
        output = Output(None, path.parent, path.name)
    elif path.is_dir() or text.endswith("/") or not suffix:
        output = Output(None, path, FRAME_NAME)
    else:
        kinds = f"a video ({', '.join(VIDEO_SUFFIXES)}), a folder, or a pattern such as clip/%04d.png"
        raise UsageError(f"--output: expected {kinds}, found {text!r}")
    if not output.folder.parent.is_dir():
        raise UsageError(f"--output: expected a place in an existing folder, found {text!r}")
    if output.folder.exists() and not output.folder.is_dir():
        raise UsageError(f"--output: expected room for a folder, found the file {str(output.folder)!r}")
    return output


def _require_video(size: tuple[int, int]) -> None:
    if find_spec("av") is None:
        raise UsageError("--output: expected a folder, as videos need PyAV: pip install 'gazetrace[video]'")
    if size[0] % 2 or size[1] % 2:
        raise UsageError(f"--size: expected even sides for a video, found {size[0]}x{size[1]}")


def frame_rate(text: str) -> Fraction:
    """Read a number such as 25, 29.97 or 30000/1001."""
    try:
        rate = Fraction(text)
    except (ValueError, ZeroDivisionError):
        rate = Fraction(0)
    if not FPS[0] <= rate <= FPS[1] or rate.denominator > 10_000:
        raise argparse.ArgumentTypeError(f"expected a number from {float(FPS[0])} to {FPS[1]}, found {text!r}")
    return rate


def frame_count(playback: Playback, fps: Fraction) -> int:
    """Number of frames that fill the playback's time.

    Raises:
        UsageError: for too many.
    """
    count = max(1, math.ceil(round(playback.seconds * fps, 6)))
    if count > MAX_FRAMES:
        raise UsageError(f"--seconds: expected at most {MAX_FRAMES} frames, found {count}")
    return count


def shots_of(
    arguments: argparse.Namespace, playback: Playback, prepared: PreparedScene, count: int
) -> list[FrameRequest]:
    """What each frame shows: the newest gaze at its time, through the camera where it is then.

    Raises:
        UsageError: where the camera's path leads through a view that is none.
    """
    scene = prepared.scene
    request = frame_request(arguments, scene.camera)
    trace = playback.trace.held((request.display.width_px / 2, request.display.height_px / 2))
    shots = []
    for frame in range(count):
        seconds = float(frame / arguments.fps)
        sample = trace.sample(trace.newest(seconds))
        camera = request.camera
        try:
            if arguments.orbit is not None:
                camera = orbited(camera or scene.camera, arguments.orbit * frame / count)
            elif camera is None and scene.camera_path is not None:
                camera = scene.camera_path.camera_at(seconds)
            shots.append(replace(request, gaze=Gaze(sample.x, sample.y), camera=camera))
        except SettingsError as error:
            raise UsageError(f"frame {frame}: {error}") from error
    return shots


def render_missing(
    arguments: argparse.Namespace, prepared: PreparedScene, shots: Sequence[FrameRequest], frames: FrameFolder
) -> None:
    """Render the frames that the folder lacks; a renderer reuses what it has traced, and so does each worker's."""
    missing = [frame for frame in range(len(shots)) if frame not in frames.costs]
    if not missing:
        return
    text, done = f"rendering {arguments.scene}", len(shots) - len(missing)
    if arguments.cluster is not None:
        with joined(arguments.cluster, arguments.threads) as cluster, counting(text, len(shots), done) as tick:
            tasks = [partial(drawn, shots[frame], arguments.overlay) for frame in missing]
            for number, (picture, cost) in cluster.run(prepared, tasks):
                frames.add(missing[number], picture, cost)
                tick()
        return
    stop = threading.Event()
    renderer = ready_renderer(arguments.threads, abandon=stop)
    with heeding(stop), counting(text, len(shots), done) as tick:
        for frame in missing:
            frames.add(frame, *drawn(shots[frame], arguments.overlay, renderer, prepared))
            tick()
    renderer.close()


def drawn(
    shot: FrameRequest, overlay: list[str], renderer: Renderer, prepared: PreparedScene, _: object = None
) -> tuple[bytes, dict[str, Any]]:
    """One frame as a PNG file, and what it cost."""
    from renderer.codec import encode

    rendered = renderer.render(prepared, shot)
    started_ns = time.perf_counter_ns()
    picture = encode(draw_overlays(rendered.pixels, shot, renderer, overlay), "png")
    return picture, cost_record(rendered, shot, {"encode": milliseconds_since(started_ns)})


def assemble(video: Path, frames: FrameFolder, count: int, fps: Fraction, size: tuple[int, int]) -> None:
    """Put the pictures together into the video.

    Raises:
        CommandFailed: where it cannot be written, as on a full disk.
    """
    from clients.video import write_video

    try:
        with counting(f"writing {video.name}", count) as tick:
            write_video(video, _pictures(frames, count, tick), fps, size)
    except OSError as error:
        kept = f"all frames are kept in {frames.folder}, and the same command goes on once this is mended"
        raise CommandFailed(f"{video}: {error.strerror}; {kept}") from error


def _pictures(frames: FrameFolder, count: int, tick: Any) -> Iterator[NDArray[np.uint8]]:
    from renderer.codec import decode_texture

    for frame in range(count):
        path = frames.path(frame)
        yield decode_texture(path.read_bytes(), str(path)).pixels
        tick()
