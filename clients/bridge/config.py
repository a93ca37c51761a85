"""The bridge's settings: from a file, the environment and the command line, in that order."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from clients.bridge.calibration import Model
from clients.bridge.codec import MICROSECOND_NS, MILLISECOND_NS, SECOND_NS
from clients.bridge.errors import ConfigError
from clients.bridge.fields import LEAST_CONFIDENCE
from clients.bridge.gaze import PAD_MS
from clients.bridge.pattern_lines import DEFAULT_PATTERN
from clients.bridge.sample import Eye
from clients.bridge.screen import Origin, Unit
from clients.bridge.smi import DEFAULT_FORMAT

VARIABLE_PREFIX = "GAZETRACE_BRIDGE_"
OF_THE_DEVICE = (
    "protocol", "baud", "unit", "origin", "eye", "time_unit", "smi_format", "asl_counted", "iscan_parameters",
    "iscan_columns", "fields", "paths", "pattern", "surface", "least_confidence",
)  # fmt: skip
"""Settings that say what a device's bytes mean: a recording keeps them."""

SERVICE_TOKEN = "GAZETRACE_TOKEN"
"""The service's own variable, which counts where the bridge has no token of its own."""

TIME_UNITS = {"s": SECOND_NS, "ms": MILLISECOND_NS, "us": MICROSECOND_NS, "ns": 1}


@dataclass(frozen=True, slots=True)
class Config:
    """Every setting of the bridge; `GAZETRACE_BRIDGE_PORT` in the environment sets `port`, and so on.

    Attributes:
        port: the device: `/dev/serial/by-id/...`, `socket://host:port`, `rfc2217://host:port`, `hwgrep://REGEX`, `lsl://`.
        protocol: what it speaks: smi, asl, iscan, iscan-ascii, gazepoint, eyetribe, csv, jsonl, regex, lsl or pupil.
        baud: bits a second on its line.
        no_dtr: True to leave DTR and RTS low: boards that restart on DTR stay up.
        service: the service's address.
        session: the session that gaze goes to.
        token: the service's token; None for GAZETRACE_TOKEN, if that is set.
        unit: what the device's numbers count: px, fraction, deg, asl or raw; None for what its protocol says.
        origin: where the device's (0, 0) is: top-left, bottom-left or center; None for what its protocol says.
        eye: whose gaze counts: best, left, right or average.
        screen_px: the screen's pixels, such as 1920x1080; None for those of the session's display.
        screen_cm: its size [cm], such as 50x35; None for that of the session's display.
        distance_cm: from the eye to it [cm]; None for that of the session's display.
        calibration: file of a calibration to apply.
        model: what a new calibration fits: affine or quadratic.
        device_latency_ms: what passes in the device before its first byte [ms].
        time_unit: of the device's clock: s, ms, us or ns; None for what its protocol or its rate says.
        saccade_deg_s: velocity above which the eye is in a saccade [deg/s]; None for 70, or 30 below 100 Hz.
        pad_ms: how long gaze is not trusted after a blink [ms].
        smooth: True for the One-Euro filter.
        max_rate_hz: most gazes sent a second; None for all.
        smi_format: what SMI is told to send.
        asl_counted: True if ASL sends the frame number: 10 bytes instead of 8.
        poll_byte: what ASL on demand is asked with, a number; None if it streams. Experimental.
        iscan_parameters: how many parameters ISCAN sends.
        iscan_columns: which of them, from 0, are the gaze.
        iscan_start: the byte that starts ISCAN.
        iscan_stop: the byte that stops ISCAN.
        fields: what the numbers of a csv line are: x, y, t (time), v (validity), c (confidence), xl, yl, xr, yr, or -.
        paths: where the fields of a jsonl record stand, such as x=gaze.0,y=gaze.1; for lsl, the channels' labels.
        pattern: a regular expression whose groups name the fields.
        surface: what the screen is called as a surface in Pupil Capture; None for gaze in the scene camera's picture.
        least_confidence: of a device that states one, 0 to 1; below it the eye counts as lost.
        record: file to keep every byte in.
        replay: a recording to play instead of a port.
        trace: CSV file of gaze to play instead of a port.
        simulate: True for a simulated eye instead of a port.
        speed: of what is played; 0 for as fast as possible.
        loop: True to play it again and again.
        rate_hz: records a second of a trace or a simulated eye; None for its own.
        fail_fast: True to give up if no sample comes in the first 5 s.
        status_file: file that holds the newest health line as JSON.
        log_json: True for log lines as JSON.
    """

    port: str | None = None
    protocol: str | None = None
    baud: int = 115_200
    no_dtr: bool = False
    service: str = "http://127.0.0.1:8321"
    session: str = "main"
    token: str | None = field(default=None, repr=False)
    unit: Unit | None = None
    origin: Origin | None = None
    eye: Eye = Eye.BEST
    screen_px: tuple[float, float] | None = None
    screen_cm: tuple[float, float] | None = None
    distance_cm: float | None = None
    calibration: Path | None = None
    model: Model = Model.QUADRATIC
    device_latency_ms: float = 0.0
    time_unit: int | None = None
    saccade_deg_s: float | None = None
    pad_ms: float = PAD_MS
    smooth: bool = False
    max_rate_hz: float | None = None
    smi_format: str = DEFAULT_FORMAT
    asl_counted: bool = False
    poll_byte: int | None = None
    iscan_parameters: int = 2
    iscan_columns: tuple[int, int] = (0, 1)
    iscan_start: int = 128
    iscan_stop: int = 129
    fields: tuple[str, ...] = ("x", "y")
    paths: Mapping[str, str] = field(default_factory=dict)
    pattern: str = DEFAULT_PATTERN
    surface: str | None = None
    least_confidence: float = LEAST_CONFIDENCE
    record: Path | None = None
    replay: Path | None = None
    trace: Path | None = None
    simulate: bool = False
    speed: float = 1.0
    loop: bool = False
    rate_hz: float | None = None
    fail_fast: bool = False
    status_file: Path | None = None
    log_json: bool = False

    def __post_init__(self) -> None:
        if not 50 <= self.baud <= 4_000_000:
            raise ConfigError("baud", "50 to 4000000", self.baud)
        for name in ("distance_cm", "saccade_deg_s", "max_rate_hz", "rate_hz"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ConfigError(name, "a number above 0", value)
        for name in ("device_latency_ms", "pad_ms", "speed"):
            value = getattr(self, name)
            if not (math.isfinite(value) and 0 <= value <= 10_000):
                raise ConfigError(name, "0 to 10000", value)
        if not 0 <= self.least_confidence <= 1:
            raise ConfigError("least_confidence", "0 to 1", self.least_confidence)
        for name in ("screen_px", "screen_cm"):
            size = getattr(self, name)
            if size is not None and not all(math.isfinite(side) and side > 0 for side in size):
                raise ConfigError(name, "two numbers above 0, such as 50x35", size)
        sources = [name for name in ("port", "replay", "trace", "simulate") if getattr(self, name)]
        if len(sources) > 1:
            raise ConfigError(sources[1], f"one source of gaze, not beside {sources[0]}", " and ".join(sources))

    @classmethod
    def read(cls, *layers: Mapping[str, str]) -> Config:
        """The settings that texts state; of two layers the later one wins.

        Raises:
            ConfigError: naming the setting.
        """
        known = {setting.name for setting in fields(cls)}
        stated: dict[str, Any] = {}
        for layer in layers:
            for name, text in layer.items():
                if name not in known:
                    raise ConfigError(name, "a setting of the bridge", text)
                stated[name] = _READ[name](name, text)
        return cls(**stated)


def of_file(path: Path) -> dict[str, str]:
    """What a TOML file states, as texts.

    Raises:
        ConfigError: naming the file.
    """
    try:
        with open(path, "rb") as file:
            return {name: _as_text(value) for name, value in tomllib.load(file).items()}
    except OSError as error:
        raise ConfigError("config", "a file that can be read", f"{path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise ConfigError("config", "TOML", f"{path}: {error}") from None


def of_environment(environ: Mapping[str, str] = os.environ) -> dict[str, str]:
    """What the environment states; an empty value states nothing."""
    token = environ.get(SERVICE_TOKEN, "")
    stated = {"token": token} if token else {}
    for name, text in environ.items():
        if name.startswith(VARIABLE_PREFIX) and text.strip():
            stated[name.removeprefix(VARIABLE_PREFIX).lower()] = text.strip()
    return stated


def _as_text(value: Any) -> str:
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, list):
        return ",".join(str(item) for item in value)
    if isinstance(value, dict):
        return ",".join(f"{name}={item}" for name, item in value.items())
    return str(value)


def _text(_: str, text: str) -> str:
    return text


def _path(_: str, text: str) -> Path:
    return Path(text).expanduser()


def _integer(name: str, text: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        raise ConfigError(name, "an integer", text) from None


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ConfigError(name, "a number", text) from None


def _switch(name: str, text: str) -> bool:
    if text.lower() in ("1", "true", "yes", "on"):
        return True
    if text.lower() in ("0", "false", "no", "off"):
        return False
    raise ConfigError(name, "1 or 0", text)


def _size(name: str, text: str) -> tuple[float, float]:
    width, _, height = text.lower().partition("x")
    return _number(name, width), _number(name, height)


def _columns(name: str, text: str) -> tuple[int, int]:
    words = text.split(",")
    if len(words) != 2:
        raise ConfigError(name, "two numbers, such as 0,1", text)
    return _integer(name, words[0]), _integer(name, words[1])


def _names(_: str, text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(","))


def _pairs(name: str, text: str) -> dict[str, str]:
    pairs = [word.partition("=") for word in text.split(",")]
    if not all(key and equals and value for key, equals, value in pairs):
        raise ConfigError(name, "pairs such as x=gaze.0,y=gaze.1", text)
    return {key.strip(): value.strip() for key, _, value in pairs}


def _choice(kind: Callable[[str], Any], names: tuple[str, ...]) -> Callable[[str, str], Any]:
    def read(name: str, text: str) -> Any:
        if text not in names:
            raise ConfigError(name, " or ".join(names), text)
        return kind(text)

    return read


_READ: Mapping[str, Callable[[str, str], Any]] = {
    **dict.fromkeys(("port", "protocol", "service", "session", "token", "smi_format", "pattern", "surface"), _text),
    **dict.fromkeys(("calibration", "record", "replay", "trace", "status_file"), _path),
    **dict.fromkeys(("baud", "poll_byte", "iscan_parameters", "iscan_start", "iscan_stop"), _integer),
    **dict.fromkeys(
        (
            "distance_cm",
            "device_latency_ms",
            "saccade_deg_s",
            "pad_ms",
            "max_rate_hz",
            "speed",
            "rate_hz",
            "least_confidence",
        ),
        _number,
    ),
    **dict.fromkeys(("no_dtr", "smooth", "asl_counted", "simulate", "loop", "fail_fast", "log_json"), _switch),
    **dict.fromkeys(("screen_px", "screen_cm"), _size),
    "unit": _choice(Unit, tuple(Unit)),
    "origin": _choice(Origin, tuple(Origin)),
    "eye": _choice(Eye, tuple(Eye)),
    "model": _choice(Model, tuple(Model)),
    "time_unit": _choice(TIME_UNITS.__getitem__, tuple(TIME_UNITS)),
    "iscan_columns": _columns,
    "fields": _names,
    "paths": _pairs,
}
"""How each setting's text is read."""
