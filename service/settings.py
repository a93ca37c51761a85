"""What whoever runs the service decides: where it listens, who may ask, how much one request may cost."""

from __future__ import annotations

import ipaddress
import os
import ssl
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from renderer.display import MAX_SIDE_PX
from renderer.errors import SettingsError, require_integer
from renderer.quality import MAX_DEPTH, MAX_SAMPLES
from service.protocol import MAX_TEXT_BYTES

VARIABLE_PREFIX = "GAZETRACE_"

SHORTEST_TOKEN = 8
"""Fewest characters of a token; a shorter one is soon guessed."""

CLUSTERS = ("auto", "local")
"""In place of the address of a cluster."""

MOST_THREADS = 1024
MOST_RENDERS = 64
MOST_QUEUED = 10_000
MOST_BYTES = 1 << 44
MOST_CAMERA_RAYS = 10**13
MOST_SESSIONS = 1024
LEAST_MESSAGE_BYTES = 1024
LEAST_HEADER_BYTES, MOST_HEADER_BYTES = 1024, 1 << 20
MOST_CONNECTIONS = 65_536
MOST_MESSAGES_PER_S = 1_000_000
LONGEST_CLIENT_TIMEOUT_S = 3600
LONGEST_LOAD_S = 24 * 3600
LEAST_SCENE_CRASHES, MOST_SCENE_CRASHES = 2, 1000
LONGEST_EXPIRY_S = 7 * 24 * 3600


@dataclass(frozen=True, slots=True)
class Settings:
    """Every setting of the service; `GAZETRACE_PORT` in the environment sets `port`, and so on.

    Attributes:
        host: address to listen on; other than this machine's own (loopback) it needs `token` or `insecure`.
        port: port to listen on, 0 for any free one.
        token: what a client must send as `Authorization: Bearer TOKEN`; None asks nobody.
        view_token: what may be sent in its place, and lets its holder look but not be a gaze.
        gaze_token: what may be sent in its place by a gaze source, and lets its holder do nothing else.
        certfile: certificate chain (PEM), to serve HTTPS.
        keyfile: its private key (PEM); None if it is in `certfile`.
        insecure: True to listen beyond this machine without a token.
        log_json: True to write a line of JSON to standard error for each request and stream.
        scenes: folder of scene folders; None for the built-in scenes alone.
        threads: cores to render on; None for all.
        cluster: Ray cluster that traces: HOST:PORT, `auto` for this machine's, `local` for its own; None for none.
        max_pixels: largest frame [px]; an 8K screen.
        max_samples_per_cell: most camera rays a cell.
        max_depth: most mirrors and boundaries a ray may meet.
        max_camera_rays: most camera rays a frame: cells times samples a cell.
        max_body_bytes: largest request body.
        max_header_bytes: largest head of a request: its first line and its headers.
        max_connections: connections at once, streams among them; beyond, a client is told to come back.
        client_timeout_s: how long a client may take to send a request, and may leave unread what it is sent [s].
        min_bytes_per_s: least that a client must take in of what waits for it, on average over that time [1/s].
        max_concurrent_renders: frames rendered at once.
        max_queued_renders: frames that may wait for their turn; beyond, a client is told to come back.
        max_sessions: streaming sessions at once.
        max_viewers: viewers, and gaze sources, of one session.
        max_message_bytes: longest message of a stream that is read.
        max_messages_per_s: most messages a second of a client of a stream, over any second.
        ping_s: how often a client of a stream is asked whether it is there, and how long it may take to answer once
            it was sent nothing more, or take in nothing of what was [s].
        session_expiry_s: how long a session is kept for those who left it [s].
        frame_bytes: memory for frames in work, 128 bytes a pixel; beyond, they wait for each other.
        map_cache_bytes: memory for cell maps.
        store_bytes: memory for samples of earlier frames.
        scene_bytes: memory for loaded scenes.
        max_scene_file_bytes: largest file of a scene in the scenes folder.
        max_triangles: most triangles of such a scene.
        max_texture_pixels: most pixels of a picture on its surfaces.
        max_load_s: how long reading such a scene may take [s].
        max_load_bytes: memory that reading such a scene may take.
        max_scene_crashes: crashes of native code with a scene at work, after which it is refused; 2 or more.
        allowed_hosts: further names this service goes by, for a proxy in front of it; `*` for any.
        allowed_origins: origins, such as `https://lab.example`, whose pages may use it from a browser.

    Raises:
        SettingsError: naming the setting, for a value out of range, and for an unsafe address.
    """

    host: str = "127.0.0.1"
    port: int = 8321
    token: str | None = field(default=None, repr=False)
    view_token: str | None = field(default=None, repr=False)
    gaze_token: str | None = field(default=None, repr=False)
    certfile: Path | None = None
    keyfile: Path | None = None
    insecure: bool = False
    log_json: bool = False
    scenes: Path | None = None
    threads: int | None = None
    cluster: str | None = None
    max_pixels: int = 33_177_600
    max_samples_per_cell: int = 256
    max_depth: int = 16
    max_camera_rays: int = 200_000_000
    max_body_bytes: int = 64 << 10
    max_header_bytes: int = 32 << 10
    max_connections: int = 512
    client_timeout_s: int = 20
    min_bytes_per_s: int = 4096
    max_concurrent_renders: int = 4
    max_queued_renders: int = 16
    max_sessions: int = 16
    max_viewers: int = 16
    max_message_bytes: int = MAX_TEXT_BYTES
    max_messages_per_s: int = 2500
    ping_s: int = 20
    session_expiry_s: int = 60
    frame_bytes: int = 4 << 30
    map_cache_bytes: int = 256 << 20
    store_bytes: int = 512 << 20
    scene_bytes: int = 1 << 30
    max_scene_file_bytes: int = 1 << 30
    max_triangles: int = 20_000_000
    max_texture_pixels: int = 1 << 26
    max_load_s: int = 120
    max_load_bytes: int = 4 << 30
    max_scene_crashes: int = 2
    allowed_hosts: tuple[str, ...] = ()
    allowed_origins: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.host:
            raise SettingsError("host", "an address or a name", self.host)
        require_integer("port", self.port, 0, 65_535)
        if self.threads is not None:
            require_integer("threads", self.threads, 1, MOST_THREADS)
        require_integer("max_pixels", self.max_pixels, 1, MAX_SIDE_PX**2)
        require_integer("max_samples_per_cell", self.max_samples_per_cell, 1, MAX_SAMPLES)
        require_integer("max_depth", self.max_depth, 0, MAX_DEPTH)
        require_integer("max_camera_rays", self.max_camera_rays, 1, MOST_CAMERA_RAYS)
        require_integer("max_body_bytes", self.max_body_bytes, 1, MOST_BYTES)
        require_integer("max_header_bytes", self.max_header_bytes, LEAST_HEADER_BYTES, MOST_HEADER_BYTES)
        require_integer("max_connections", self.max_connections, 1, MOST_CONNECTIONS)
        require_integer("client_timeout_s", self.client_timeout_s, 1, LONGEST_CLIENT_TIMEOUT_S)
        require_integer("min_bytes_per_s", self.min_bytes_per_s, 1, MOST_BYTES)
        require_integer("max_concurrent_renders", self.max_concurrent_renders, 1, MOST_RENDERS)
        require_integer("max_queued_renders", self.max_queued_renders, 0, MOST_QUEUED)
        require_integer("max_sessions", self.max_sessions, 1, MOST_SESSIONS)
        require_integer("max_viewers", self.max_viewers, 1, MOST_SESSIONS)
        require_integer("max_message_bytes", self.max_message_bytes, LEAST_MESSAGE_BYTES, MAX_TEXT_BYTES)
        require_integer("max_messages_per_s", self.max_messages_per_s, 1, MOST_MESSAGES_PER_S)
        require_integer("ping_s", self.ping_s, 1, LONGEST_CLIENT_TIMEOUT_S)
        require_integer("session_expiry_s", self.session_expiry_s, 0, LONGEST_EXPIRY_S)
        require_integer("max_load_s", self.max_load_s, 1, LONGEST_LOAD_S)
        require_integer("max_scene_crashes", self.max_scene_crashes, LEAST_SCENE_CRASHES, MOST_SCENE_CRASHES)
        for name in ("map_cache_bytes", "store_bytes", "scene_bytes"):
            require_integer(name, getattr(self, name), 0, MOST_BYTES)
        for name in ("frame_bytes", "max_scene_file_bytes", "max_triangles", "max_texture_pixels", "max_load_bytes"):
            require_integer(name, getattr(self, name), 1, MOST_BYTES)
        if self.cluster is not None:
            require_cluster("cluster", self.cluster)
        if self.scenes is not None and not os.path.isdir(self.scenes):
            raise SettingsError("scenes", "a folder", str(self.scenes))
        for origin in self.allowed_origins:
            _require_origin(origin)
        self._require_certificate()
        self._require_token()

    def _require_certificate(self) -> None:
        """Refuse files that are not there or hold something else, and a key without a certificate."""
        for name in ("certfile", "keyfile"):
            path = getattr(self, name)
            if path is not None and not os.path.isfile(path):
                raise SettingsError(name, "a file", str(path))
        if self.keyfile is not None and self.certfile is None:
            raise SettingsError("keyfile", "a certfile that it belongs to", "none")
        if self.certfile is not None:
            try:
                ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.certfile, self.keyfile, lambda: "")
            except (ssl.SSLError, OSError) as error:
                raise SettingsError(
                    "certfile", "a certificate and its key without a password, in PEM", f"{self.certfile} ({error})"
                ) from None

    def _require_token(self) -> None:
        """Refuse weak tokens, tokens that are no alternatives, and an address that others reach without one."""
        tokens = {name: getattr(self, name) for name in ("token", "view_token", "gaze_token")}
        stated = {name: token for name, token in tokens.items() if token is not None}
        for name, token in stated.items():
            if not token.isascii() or not token.isprintable() or " " in token:
                raise SettingsError(name, "visible ASCII characters", "others")
            if len(token) < SHORTEST_TOKEN:
                raise SettingsError(name, f"{SHORTEST_TOKEN} characters or more", f"{len(token)} characters")
            if self.token is None:
                raise SettingsError(name, "a token beside it, which may do everything", "none")
        if len(set(stated.values())) < len(stated):
            raise SettingsError("token", "tokens that differ from each other", "the same one twice")
        if self.token is None and not self.insecure and not is_loopback(self.host):
            raise SettingsError(
                "host", "127.0.0.1, or a token (GAZETRACE_TOKEN) to listen beyond this machine", self.host
            )

    @classmethod
    def from_environment(cls, environ: Mapping[str, str]) -> Settings:
        """The settings that `environ` states, the rest as they are by default; an empty value states nothing.

        Raises:
            SettingsError: naming the variable.
        """
        stated: dict[str, Any] = {}
        try:
            for setting in fields(cls):
                text = environ.get(VARIABLE_PREFIX + setting.name.upper(), "").strip()
                if text:
                    stated[setting.name] = _READ.get(setting.name, _integer)(setting.name, text)
            return cls(**stated)
        except SettingsError as error:
            raise SettingsError(VARIABLE_PREFIX + error.field.upper(), error.expected, error.found) from None

    def to_environment(self) -> dict[str, str]:
        """The variables from which `from_environment` makes the same settings."""
        return {
            VARIABLE_PREFIX + setting.name.upper(): _written(getattr(self, setting.name)) for setting in fields(self)
        }


def require_cluster(field: str, address: str) -> None:
    """Refuse what is no address of a Ray cluster.

    Raises:
        SettingsError: naming the field.
    """
    host, colon, port = address.rpartition(":")
    if address not in CLUSTERS and not (host and colon and port.isascii() and port.isdigit() and int(port) <= 65_535):
        raise SettingsError(field, "HOST:PORT, auto or local", address)


def require_ray(field: str) -> None:
    """Refuse a cluster where Ray is not installed.

    Raises:
        SettingsError: naming the field.
    """
    if find_spec("ray") is None:
        raise SettingsError(field, "Ray: pip install 'gazetrace[cluster]'", "no package ray")


def is_loopback(host: str) -> bool:
    """Whether `host` (a name or an address, no port) is this machine as seen from itself."""
    if host.lower().rstrip(".") == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _require_origin(origin: str) -> None:
    parts = urlsplit(origin)
    if parts.scheme not in ("http", "https") or f"{parts.scheme}://{parts.netloc}" != origin or not parts.netloc:
        raise SettingsError("allowed_origins", "origins such as https://lab.example", origin)


def _text(_: str, text: str) -> str:
    return text


def _integer(name: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise SettingsError(name, "an integer", text) from None


def _switch(name: str, text: str) -> bool:
    if text.lower() in ("1", "true", "yes", "on"):
        return True
    if text.lower() in ("0", "false", "no", "off"):
        return False
    raise SettingsError(name, "1 or 0", text)


def _path(_: str, text: str) -> Path:
    return Path(text).expanduser()


def _list(_: str, text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())


def _written(value: object) -> str:
    """A setting as the text of a variable; nothing for None."""
    if value is None or isinstance(value, tuple):
        return ",".join(value or ())
    return str(int(value)) if isinstance(value, bool) else str(value)


_READ: Mapping[str, Callable[[str, str], object]] = {
    "host": _text,
    "token": _text,
    "view_token": _text,
    "gaze_token": _text,
    "certfile": _path,
    "keyfile": _path,
    "insecure": _switch,
    "log_json": _switch,
    "scenes": _path,
    "cluster": _text,
    "allowed_hosts": _list,
    "allowed_origins": _list,
}
"""How a variable's text is read where it is no integer."""
