"""Where the settings say that bytes come from, and what they mean on the screen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from clients.bridge.calibration import Calibration, load_calibration
from clients.bridge.clock import DeviceClock
from clients.bridge.codec import MILLISECOND_NS, Codec
from clients.bridge.config import Config
from clients.bridge.errors import ConfigError
from clients.bridge.gaze import GazeOptions, GazePath
from clients.bridge.lsl import SCHEME as LSL_SCHEME
from clients.bridge.played import PlayedPort, records
from clients.bridge.port import Port, SerialPort
from clients.bridge.protocols import OF_A_SCHEME, origin_of, tick_lengths, unit_of
from clients.bridge.recording import ReplayPort, read_recording
from clients.bridge.screen import Place, Screen, Unit
from clients.gaze_trace import GazeTrace, GazeTraceError, read_gaze_trace
from clients.simulated_gaze import simulated_gaze

SIMULATED_S = 600.0
"""A simulated eye does the same again after so long."""


def screen_of(config: Config, display: Mapping[str, Any] | None = None) -> Screen:
    """The screen: what the settings say of it, else what the session's display says."""
    known = Screen() if display is None else Screen.of_display(display)
    width_px, height_px = config.screen_px or (known.width_px, known.height_px)
    width_cm, height_cm = config.screen_cm or (known.width_cm, known.height_cm)
    return Screen(width_px, height_px, width_cm, height_cm, config.distance_cm or known.distance_cm)


def place_of(config: Config, codec: Codec, screen: Screen) -> Place:
    """What the device's numbers mean on that screen."""
    return Place(unit_of(config, codec), origin_of(config, codec), screen)


def path_of(config: Config, codec: Codec) -> GazePath:
    """From samples to gaze, as the settings say.

    Raises:
        ConfigError: for a calibration that cannot be read.
    """
    calibration: Calibration | None = None
    if config.calibration is not None:
        calibration = load_calibration(config.calibration)
    clock = DeviceClock(tick_lengths(config, codec), codec.wrap, round(config.device_latency_ms * MILLISECOND_NS))
    options = GazeOptions(config.eye, round(config.pad_ms * MILLISECOND_NS), config.saccade_deg_s, config.smooth)
    return GazePath(place_of(config, codec, screen_of(config)), clock, options, calibration)


def require_calibration(config: Config, codec: Codec) -> None:
    """Refuse to send what means nothing on a screen.

    Raises:
        ConfigError: for raw numbers without a calibration.
    """
    if unit_of(config, codec) is Unit.RAW and config.calibration is None:
        raise ConfigError("calibration", "a file, because these numbers are camera units: --calibrate makes one", None)


def port_opener(config: Config, codec: Codec) -> Callable[[], Port]:
    """What opens the port, by its name, anew at each call.

    Raises:
        ConfigError: if there is nothing to open, or a file cannot be read.
    """
    if config.port is not None:
        url = config.port
        if url.startswith(tuple(OF_A_SCHEME)):
            return network_opener(url, config.surface)
        return lambda: SerialPort(url, config.baud, not config.no_dtr)
    if config.replay is not None:
        recording = read_recording(config.replay)
        return lambda: ReplayPort(recording, config.speed, config.loop)
    trace = trace_of(config)
    if trace is None:
        raise ConfigError("port", "a device (--list-ports shows them), or --replay, --trace or --simulate", None)
    place = place_of(config, codec, screen_of(config))
    loop = config.loop or config.simulate
    return lambda: PlayedPort(records(trace, codec, place, config.rate_hz, loop), config.speed)


def network_opener(url: str, surface: str | None) -> Callable[[], Port]:
    """What opens a port that another package brings.

    Raises:
        ConfigError: where that package is missing.
    """
    extra = "lsl" if url.startswith(LSL_SCHEME) else "pupil"
    try:
        if extra == "lsl":
            from clients.bridge.lsl_port import LslPort

            return lambda: LslPort(url)
        from clients.bridge.pupil_port import PupilPort
    except (ImportError, RuntimeError) as error:  # RuntimeError: pylsl without its library
        raise ConfigError("port", f"the extra {extra} for it: pip install 'gazetrace[{extra}]'", str(error)) from None
    return lambda: PupilPort(url, surface)


def trace_of(config: Config) -> GazeTrace | None:
    """The trace to play, of a file or simulated; None if none is to be played.

    Raises:
        ConfigError: if the file cannot be read.
    """
    if config.trace is not None:
        try:
            return read_gaze_trace(config.trace)
        except GazeTraceError as error:
            raise ConfigError("trace", "a gaze trace", str(error)) from None
        except OSError as error:
            raise ConfigError("trace", "a file that can be read", f"{config.trace}: {error.strerror}") from None
    return simulated_gaze(SIMULATED_S) if config.simulate else None
