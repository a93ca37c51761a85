"""What is fed with bytes: every reader of files, messages and requests.

A target takes any bytes. It returns, or it fails: with an exception other than the one its reader promises, a message
of more than one line, a number that is not finite where none may be, or a time out of proportion.
"""

from __future__ import annotations

import functools
import json
import math
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

import numpy as np
from pydantic import ValidationError

from clients.bridge.codec import Codec
from clients.bridge.config import Config
from clients.bridge.protocols import PROTOCOLS
from clients.decoding import decode_image
from clients.gaze_trace import GazeTraceError, parse_gaze_trace
from renderer.camera import Camera
from renderer.codec import decode_texture
from renderer.display import Display
from renderer.errors import RenderError, SceneError, SettingsError
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.mesh_file import load_model
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import Scene
from renderer.scene_file import load_scene_folder
from service import protocol
from service.record import ProtocolError
from service.request import CellMapQuery, FrameQuery, RenderBody, StreamBody
from tests.renderer.model_files import png
from tests.renderer.test_damaged_files import good_files

Target = Callable[[bytes], None]

MOST_TRIANGLES = 20_000

SCENE = b"""title = "t"
exposure = 1.5
[camera]
position = [0.0, 1.5, 4.0]
look_at = [0.0, 0.0, 0.0]
vertical_fov_deg = 40.0
[[camera_path]]
time_s = 0.0
position = [0.0, 1.5, 4.0]
look_at = [0.0, 0.0, 0.0]
[surroundings]
zenith = [0.3, 0.4, 0.6]
ambient = [0.1, 0.1, 0.1]
[materials.a]
base = "ashikhmin-shirley"
specular = [0.8, 0.8, 0.8]
exponent_u = 800.0
normal_texture = "t.png"
[materials.b]
diffuse_texture = { file = "t.png", wrap_u = "mirror" }
alpha_texture = "t.png"
transmission = [1.0, 1.0, 1.0]
ior = 1.5
reflection = [0.2, 0.2, 0.2]
[[mesh]]
file = "a.obj"
material = "a"
scale = [1, -2, 1]
rotate_deg = [0.0, 30.0, 0.0]
[[sphere]]
center = [0.5, 0.9, 0.2]
radius = 0.1
material = "b"
[[light]]
kind = "point"
position = [2.0, 3.0, 2.0]
intensity = [40.0, 40.0, 40.0]
[[light]]
kind = "rectangle"
corner = [-0.5, 2.5, -0.5]
edge_u = [1.0, 0.0, 0.0]
edge_v = [0.0, 0.0, 1.0]
radiance = [9.0, 9.0, 9.0]
[[light]]
kind = "sphere"
center = [-1.0, 1.5, 0.5]
radius = 0.1
radiance = [20.0, 18.0, 15.0]
"""

REQUEST = json.dumps(
    {
        "scene": "atrium", "gaze": {"x": 0.5, "y": 0.5, "unit": "fraction"}, "format": "webp", "image_quality": 80,
        "display": {"width_px": 64, "height_px": 36, "width_cm": 50, "height_cm": 35, "distance_cm": 60},
        "camera": {"position": [0, 1.6, 5], "look_at": [0, 1.4, 0], "up": [0, 1, 0], "vertical_fov_deg": 40},
        "quality": {"map": "aligned", "samples_per_cell": 4, "effects": ["+shadows"], "deadline_ms": 40.0,
                    "acuity": {"model": "peli", "eccentricity": "paper", "scale": 1.5, "margin_deg": 0.5}},
    }
).encode()  # fmt: skip

MESSAGES = (
    b'{"type":"hello","token":"abcdefgh","session":"s"}',
    b'{"type":"configure","id":1,"scene":"atrium","display":{"width_px":64},"format":"jpeg","image_quality":80}',
    b'{"type":"gaze","x":0.5,"y":0.5,"unit":"fraction","valid":true,"seq":1,"tracker_time_ns":5,"phase":"fixation"}',
    b'{"type":"gaze_batch","samples":[{"x":1.0,"y":2.0},{"valid":false}]}',
    b'{"type":"ping","id":1,"client_time_ns":4}',
    b'{"type":"error","code":"over-limit","message":"m","field":"f","id":1}',
    b'{"type":"target","x":0.5,"y":0.5,"unit":"px","index":0,"count":5}',
)


@functools.cache
def _folder() -> Path:
    """Files beside the one that is damaged; kept until the process ends."""
    kept = tempfile.TemporaryDirectory(prefix="gazetrace-fuzz-")
    _folder_owner.append(kept)
    place = Path(kept.name)
    for name, data in good_files().items():
        (place / name).write_bytes(data)
    (place / "t.png").write_bytes(png((9, 8, 7)))
    return place


_folder_owner: list[tempfile.TemporaryDirectory[str]] = []


@functools.cache
def _renderer() -> Renderer:
    return Renderer(threads=1)


def _one_line(error: Exception) -> None:
    assert len(str(error).splitlines()) <= 1, f"a message of several lines: {error}"


def _render(scene: Scene) -> None:
    """A tiny frame of a scene must be finite."""
    try:
        prepared = prepare(scene)
    except RenderError as error:
        _one_line(error)
        return
    quality = Quality(map="full", samples_per_cell=1, max_depth=2)
    for camera in (scene.camera, Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0))):
        frame = _renderer().render(prepared, FrameRequest(Gaze(2, 1), Display(4, 3), camera, quality, linear=True))
        assert np.isfinite(frame.pixels).all()
        rejected = frame.cost.rejected_samples
        assert rejected.not_a_number == rejected.negative == 0


def scene(data: bytes) -> None:
    """scene.toml."""
    (_folder() / "scene.toml").write_bytes(data)
    try:
        made = load_scene_folder(_folder(), max_triangles=MOST_TRIANGLES)
    except SceneError as error:
        _one_line(error)
        return
    _render(made)


def mesh(name: str, data: bytes) -> None:
    """A mesh file, or what one names."""
    place = _folder() / name
    good = place.read_bytes()
    place.write_bytes(data)
    try:
        model = load_model(_folder() / ("a.obj" if name == "m.mtl" else name), max_triangles=MOST_TRIANGLES)
    except SceneError as error:
        _one_line(error)
        return
    finally:
        place.write_bytes(good)
    for part in model.meshes:
        assert np.isfinite(part.vertices).all()
    _render(Scene(meshes=model.meshes))


def picture(data: bytes) -> None:
    """A texture."""
    try:
        made = decode_texture(data, "t.png", 1 << 16)
    except SceneError as error:
        _one_line(error)
        return
    assert made.pixels.dtype == np.uint8


def message(data: bytes) -> None:
    """Text of every wire; what is read is written and read again."""
    text = data.decode(errors="replace")
    for decode in (
        protocol.decode_stream_up, protocol.decode_stream_down, protocol.decode_gaze_up, protocol.decode_gaze_down,
    ):  # fmt: skip
        try:
            read: Any = decode(text)
        except ProtocolError as error:
            _one_line(error)
            continue
        assert decode(protocol.encode(read)) == read


def frame(data: bytes) -> None:
    """A binary message and its image."""
    try:
        made = protocol.unpack_frame(data)
        decode_image(made.header, made.image)
    except ProtocolError as error:
        _one_line(error)


def request(data: bytes) -> None:
    """The body of a render request, and of what a stream shows."""
    for body in (RenderBody, StreamBody):
        try:
            order = body.model_validate_json(data).order()
        except SettingsError as error:
            _one_line(error)
            continue
        except ValidationError:
            continue
        _finite(order.request)


def query(data: bytes) -> None:
    """Query parameters."""
    given = dict(parse_qsl(data.decode(errors="replace"), keep_blank_values=True, max_num_fields=1000))
    for kind in (FrameQuery, CellMapQuery):
        try:
            asked = kind.model_validate(given)
            made = FrameRequest(asked.gaze(), asked.display(), None, asked.quality())
        except SettingsError as error:
            _one_line(error)
            continue
        except ValidationError:
            continue
        _finite(made)


def _finite(made: FrameRequest) -> None:
    assert math.isfinite(made.gaze.x)
    assert math.isfinite(made.gaze.y)
    assert 0 < made.display.pitch_x_cm < math.inf
    assert 0 < made.display.pitch_y_cm < math.inf


def trace(data: bytes) -> None:
    """A gaze recording."""
    try:
        parse_gaze_trace(data.decode(errors="replace"), "gaze.csv")
    except GazeTraceError as error:
        _one_line(error)


def tracker(name: str, data: bytes) -> None:
    """What an eye tracker sends, at once and in two parts."""
    whole, parts = _codec(name), _codec(name)
    together = list(whole.feed(data))
    middle = len(data) // 2
    assert [*parts.feed(data[:middle]), *parts.feed(data[middle:])] == together
    for sample in together:
        for point in (sample.left, sample.right, sample.both):
            assert point is None or (math.isfinite(point.x) and math.isfinite(point.y))


def _codec(name: str) -> Codec:
    return PROTOCOLS[name](Config())


TRACKERS = {
    "smi": b"ET_SPL 1000 b 640.0 512.0 641.0 513.0 0 0\r\n",
    "asl": bytes(range(16)),
    "iscan": b"DD\x10\x00\x20\x00\x30\x00" * 2,
    "gazepoint": b'<REC TIME="1.5" FPOGX="0.5" FPOGY="0.5" FPOGV="1" BPOGX="0.5" BPOGY="0.5" BPOGV="1" />\r\n',
    "eyetribe": b'{"category":"tracker","request":"get","statuscode":200,"values":{"frame":{"state":7,"time":5,'
    b'"raw":{"x":1,"y":2},"lefteye":{"raw":{"x":1,"y":2}},"righteye":{"raw":{"x":1,"y":2}}}}}\n',
    "csv": b"1,0.5,0.5\n",
    "jsonl": b'{"t":1,"x":0.5,"y":0.5}\n',
}

PICTURE_FRAME = b'{"frame":1,"session":"s","config":1,"scene":"a","width":1,"height":1,"format":"%s","image_bytes":%d}'


def targets() -> dict[str, tuple[Target, tuple[bytes, ...]]]:
    """Every target by name, with inputs to begin with."""
    files = good_files()
    texture = png((9, 8, 7))
    found: dict[str, tuple[Target, tuple[bytes, ...]]] = {
        "scene": (scene, (SCENE,)),
        "picture": (picture, (texture,)),
        "message": (message, MESSAGES),
        "frame": (frame, (b"\x10\0\0\0{}", len(PICTURE_FRAME).to_bytes(4, "little") + PICTURE_FRAME)),
        "request": (request, (REQUEST,)),
        "query": (query, (b"gaze_x=600&gaze_y=4e2&width_px=64&acuity_scale=1.5&effects=%2Bshadows&height_cm=35",)),
        "trace": (trace, (b"t_ms,x_px,y_px,valid\n0,5,6,1\n10,7,8,0\n", b"t_s,x_fraction,y_fraction\n0,.5,.5\n")),
    }
    for name, data in files.items():
        found[f"mesh:{name}"] = functools.partial(mesh, name), (data,)
    for name, data in TRACKERS.items():
        found[f"tracker:{name}"] = functools.partial(tracker, name), (data,)
    return found


def strict(target: Target, data: bytes) -> None:
    """Run a target; a warning is a failure."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        target(data)
