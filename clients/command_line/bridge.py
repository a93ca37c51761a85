"""`gazetrace bridge`: from an eye tracker to a session of the service."""

from __future__ import annotations

import argparse
import asyncio
import json
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clients.bridge.codec import MILLISECOND_NS
from clients.bridge.config import OF_THE_DEVICE, VARIABLE_PREFIX, Config, of_environment, of_file
from clients.bridge.errors import ConfigError
from clients.command_line.errors import OK, UsageError
from clients.command_line.serve import setting_texts

if TYPE_CHECKING:
    from clients.bridge.daemon import Bridge
    from clients.bridge.gaze import Gaze
    from clients.bridge.log import Log

DESCRIPTION = """\
Read an eye tracker and send its gaze to a session of the service.

It runs until it is stopped: either side may be absent at first, go away and come back. Each flag can also be
set in a TOML file (--config: smi_format = "...") or by an environment variable (--smi-format by
GAZETRACE_BRIDGE_SMI_FORMAT); flags win over variables, variables over the file.

Exit status: 0; 2 for settings that cannot be used; 3 with --fail-fast if no sample came; 1 for any other failure."""

EXAMPLES = """\
examples:
  gazetrace bridge --probe --port /dev/ttyUSB0
      The first hour: which protocol, how fast, 20 samples.

  gazetrace bridge --port /dev/ttyUSB0 --protocol asl --baud 57600 --session lab
      Gaze of an ASL tracker for the viewers of the session "lab".

  gazetrace bridge --port socket://127.0.0.1:4242 --protocol gazepoint --calibrate lab.json
      Look at nine targets in the viewer, then go on with that calibration.

  gazetrace bridge --simulate --session lab
      No tracker at hand: an eye that fixates, jumps and blinks."""

METAVARS = {
    "port": "PORT", "service": "URL", "token": "TOKEN", "session": "NAME", "protocol": "NAME", "screen_px": "WxH",
    "screen_cm": "WxH", "pattern": "REGEX", "fields": "A,B", "paths": "A=PATH,...", "iscan_columns": "X,Y",
    "smi_format": "FORMAT", "calibration": "FILE", "record": "FILE", "replay": "FILE", "trace": "FILE",
    "status_file": "FILE", "unit": "UNIT", "origin": "ORIGIN", "eye": "EYE", "model": "MODEL", "time_unit": "UNIT",
    "surface": "NAME",
}  # fmt: skip


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse: a flag for every setting, and what to do instead of running."""
    parser = commands.add_parser(
        "bridge",
        help="send an eye tracker's gaze to the service",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    instead = parser.add_argument_group("instead of running").add_mutually_exclusive_group()
    instead.add_argument("--list-ports", action="store_true", help="list the serial ports of this machine")
    instead.add_argument("--probe", action="store_true", help="find out what a device sends, show 20 samples, exit")
    instead.add_argument("--dry-run", action="store_true", help="print gaze as CSV instead of sending it")
    instead.add_argument("--emit", nargs=2, metavar=("PROTOCOL", "PORT"), help=EMIT_HELP)
    parser.add_argument("--calibrate", type=Path, metavar="FILE", help="calibrate first, with targets in the viewer")
    parser.add_argument("--config", type=Path, metavar="FILE", help="a TOML file of settings")
    parser.add_argument(
        "--json", action="store_true", help="print JSON where a list, a probe, gaze or counts are printed"
    )
    described = setting_texts(Config)
    settings = parser.add_argument_group("settings")
    for setting in fields(Config):
        text = described[setting.name].replace("%", "%%")
        if setting.default is False:
            settings.add_argument(flag_of(setting.name), dest=setting.name, action="store_const", const="1", help=text)
        else:
            metavar = METAVARS.get(setting.name, "N")
            settings.add_argument(
                flag_of(setting.name), dest=setting.name, metavar=metavar, help=text + _default(setting)
            )
    parser.set_defaults(run=run)


EMIT_HELP = (
    "act as a device: on a real port, on a new pseudo-terminal of that name, or on tcp:PORT; "
    "what it shows comes from --trace or a simulated eye"
)


def run(arguments: argparse.Namespace) -> int:
    """Run the bridge, or do what was asked for instead."""
    if arguments.list_ports:
        return list_ports(arguments.json)
    given = {setting.name: getattr(arguments, setting.name) for setting in fields(Config)}
    flags = {name: text for name, text in given.items() if text is not None}
    try:
        config, about = settings_of(flags, arguments.config)
        if arguments.emit is not None:
            protocol, target = arguments.emit
            return emit(config, protocol, target, arguments.json)
        if arguments.probe:
            return show_probe(config, arguments.json)
        return bridge(config, about, arguments)
    except ConfigError as error:
        name = error.setting.partition(" ")[0]
        by_variable = name not in flags and name in of_environment()
        blamed = VARIABLE_PREFIX + name.upper() if by_variable else flag_of(name)
        raise UsageError(
            f"{blamed}{error.setting.removeprefix(name)}: expected {error.expected}, found {error.found!r}"
        ) from error


def settings_of(flags: dict[str, str], file: Path | None) -> tuple[Config, dict[str, str]]:
    """The settings, and what of them a recording keeps.

    Raises:
        ConfigError: naming the setting.
    """
    variables = of_environment()
    path = Path(variables.pop("config")) if file is None and "config" in variables else file
    variables.pop("config", None)
    stated = {**({} if path is None else of_file(path)), **variables, **flags}
    if "replay" in stated:
        from clients.bridge.recording import read_recording

        kept = read_recording(Path(stated["replay"]).expanduser()).about.get("settings", {})
        stated = {**{name: str(text) for name, text in kept.items() if name in OF_THE_DEVICE}, **stated}
    return Config.read(stated), {name: text for name, text in stated.items() if name in OF_THE_DEVICE}


def bridge(config: Config, about: dict[str, str], arguments: argparse.Namespace) -> int:
    """Run until stopped."""
    from clients.bridge.daemon import Bridge, NewCalibration

    if arguments.calibrate is not None and arguments.dry_run:
        raise UsageError("--calibrate: expected a service that shows targets, found --dry-run")
    log = stderr_log(config)
    show = None
    if arguments.dry_run:
        show = print_gaze(arguments.json, lambda: running.stop())
    calibrate = None if arguments.calibrate is None else NewCalibration(arguments.calibrate)
    running = Bridge(config, log, show, calibrate, about)
    return asyncio.run(run_until_signal(running))


async def run_until_signal(running: Bridge) -> int:
    """Run until it ends by itself, or is told to by Ctrl-C or SIGTERM."""
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, running.stop)
    return await running.run()


def print_gaze(as_json: bool, end: Callable[[], None]) -> Callable[[Gaze], None]:
    """Prints each gaze on standard output, and calls `end` once nobody reads it any more."""
    names = ("seq", "captured_ns", "tracker_time_ns", "valid", "x", "y", "phase")
    if not as_json:
        print(",".join(names), flush=True)

    def show(gaze: Gaze) -> None:
        values = [getattr(gaze, name) for name in names]
        try:
            if as_json:
                print(json.dumps(dict(zip(names, values, strict=True))), flush=True)
            else:
                texts = ("" if v is None else str(int(v) if isinstance(v, bool) else v) for v in values)
                print(",".join(texts), flush=True)
        except BrokenPipeError:
            end()

    return show


def stderr_log(config: Config) -> Log:
    """Events on standard error."""
    from clients.bridge.log import Log

    def write(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    return Log(write, config.log_json)


def list_ports(as_json: bool) -> int:
    """Print the serial ports of this machine."""
    from clients.bridge.port import listed_ports

    ports = listed_ports()
    if as_json:
        print(json.dumps([port._asdict() for port in ports], indent=2))
        return OK
    for port in ports:
        print(f"{port.stable_name or port.device}  {port.description}")
    if not ports:
        print("no serial ports; network devices go by socket://host:port")
    return OK


def show_probe(config: Config, as_json: bool) -> int:
    """Print what a device sends."""
    from clients.bridge.health import BUSY_SHARE
    from clients.bridge.probe import probe
    from clients.bridge.protocols import OF_A_SCHEME, codec_of
    from clients.bridge.source import port_opener

    of_a_kind = config.port is not None and config.port.startswith(tuple(OF_A_SCHEME))
    known = codec_of(config) if config.protocol is not None or of_a_kind else None
    found = probe(port_opener(config, known or codec_of(Config(protocol="smi"))), known)
    if as_json:
        print(json.dumps({**found._asdict(), "samples": [sample._asdict() for sample in found.samples]}, indent=2))
        return OK
    for sample in found.samples:
        points = ((name, getattr(sample, name)) for name in ("left", "right", "both"))
        told = "  ".join(f"{name} {point.x:g},{point.y:g}" for name, point in points if point is not None)
        print(f"{'-' if sample.ticks is None else format(sample.ticks, '.12g'):>16}  {told or 'lost'}")
    print(f"protocol  {found.protocol}")
    print(f"rate      {found.rate_hz:.1f} samples/s, {found.valid:.0%} valid, {found.bad} bad records")
    load = "" if found.line_load is None else f", {found.line_load:.0%} of what the line carries"
    print(f"bytes     {found.bytes_per_s:,.0f} a second{load}")
    if found.line_load is not None and found.line_load > BUSY_SHARE:
        print(f"warning   the line is loaded above {BUSY_SHARE:.0%}: records will be late; raise the baud rate")
    return OK


def emit(config: Config, protocol: str, target: str, as_json: bool) -> int:
    """Act as a device until stopped, and say what became of its records."""
    from dataclasses import replace

    from clients.bridge.emitter import emit as send
    from clients.bridge.emitter import opened
    from clients.bridge.played import records
    from clients.bridge.protocols import codec_of
    from clients.bridge.source import place_of, screen_of, trace_of

    config = replace(config, protocol=protocol, simulate=config.trace is None)
    codec = codec_of(config)
    trace = trace_of(config)
    assert trace is not None
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    source = records(trace, codec, place_of(config, codec, screen_of(config)), config.rate_hz, config.loop)
    with opened(target, config.baud, lambda text: print(text, flush=True)) as write:
        told = send(source, write, stop)
    if as_json:
        print(json.dumps(told._asdict()))
    else:
        print(
            f"{told.sent:,} records sent, the latest {told.latest_ns / MILLISECOND_NS:.1f} ms after its time; "
            f"{told.discarded:,} discarded because the reader was too slow, {told.unread:,} while nobody read"
        )
    return OK


def flag_of(setting: str) -> str:
    """The flag of a setting."""
    return "--" + setting.replace("_", "-")


def _default(setting: Field[Any]) -> str:
    if setting.default in (None, MISSING):
        return ""
    value = setting.default
    text = ",".join(str(part) for part in value) if isinstance(value, tuple) else f"{value}"
    return f" (default {text})".replace("%", "%%")
