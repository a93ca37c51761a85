"""The protocols by name, each with its options."""

from __future__ import annotations

from collections.abc import Callable

from clients.bridge.asl import Asl
from clients.bridge.codec import Codec
from clients.bridge.config import Config
from clients.bridge.csv_lines import CsvLines
from clients.bridge.errors import ConfigError
from clients.bridge.eyetribe import EyeTribe
from clients.bridge.gazepoint import Gazepoint
from clients.bridge.iscan import IscanAscii, IscanBinary
from clients.bridge.json_lines import JsonLines
from clients.bridge.lsl import SCHEME as LSL_SCHEME
from clients.bridge.lsl import Lsl
from clients.bridge.pattern_lines import PatternLines
from clients.bridge.pupil import SCHEME as PUPIL_SCHEME
from clients.bridge.pupil import Pupil
from clients.bridge.sample import Eye
from clients.bridge.screen import Origin, Unit
from clients.bridge.smi import Smi

PROTOCOLS: dict[str, Callable[[Config], Codec]] = {
    "smi": lambda config: Smi(config.smi_format),
    "asl": lambda config: Asl(config.asl_counted, config.poll_byte),
    "iscan": lambda config: IscanBinary(
        config.iscan_parameters, config.iscan_columns, config.iscan_start, config.iscan_stop
    ),
    "iscan-ascii": lambda config: IscanAscii(
        config.iscan_parameters, config.iscan_columns, config.iscan_start, config.iscan_stop
    ),
    "gazepoint": lambda _: Gazepoint(),
    "eyetribe": lambda _: EyeTribe(),
    "csv": lambda config: CsvLines(config.fields, config.least_confidence),
    "jsonl": lambda config: JsonLines(config.paths or None, config.least_confidence),
    "regex": lambda config: PatternLines(config.pattern, config.least_confidence),
    "lsl": lambda config: Lsl(config.paths or None, config.least_confidence),
    "pupil": lambda config: Pupil(config.surface, config.least_confidence),
}


OF_A_SCHEME = {LSL_SCHEME: Lsl.name, PUPIL_SCHEME: Pupil.name}
"""Protocols that come from ports of their own alone."""


def codec_of(config: Config) -> Codec:
    """The protocol that the settings choose, with their options.

    Raises:
        ConfigError: for an unknown one, or options that do not fit it.
    """
    implied = next((name for scheme, name in OF_A_SCHEME.items() if (config.port or "").startswith(scheme)), None)
    protocol = config.protocol or implied
    if protocol is None and (config.simulate or config.trace is not None):
        protocol = Smi.name
    if config.port is not None and protocol != implied and (implied or protocol in OF_A_SCHEME.values()):
        raise ConfigError("protocol", f"one that {config.port} speaks", protocol)
    if protocol not in PROTOCOLS:
        raise ConfigError("protocol", f"one of {', '.join(PROTOCOLS)} (--probe finds out which)", protocol)
    codec = PROTOCOLS[protocol](config)
    apart = codec.binocular or isinstance(codec, CsvLines | JsonLines | PatternLines)
    if config.eye is not Eye.BEST and not apart:
        raise ConfigError("eye", f"best, because {protocol} does not tell eyes apart", str(config.eye))
    return codec


def unit_of(config: Config, codec: Codec) -> Unit:
    """What the device's numbers count: as the settings say, else as its protocol does."""
    return config.unit or Unit(codec.unit)


def origin_of(config: Config, codec: Codec) -> Origin:
    """Where the device's (0, 0) is: as the settings say, else as its protocol does."""
    return config.origin or Origin(codec.origin)


def tick_lengths(config: Config, codec: Codec) -> tuple[float, ...]:
    """How long a tick of the device's clock may be [ns]."""
    if config.time_unit is not None:
        return (config.time_unit,)
    return codec.ticks_ns
