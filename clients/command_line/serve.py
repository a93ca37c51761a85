"""`gazetrace serve`: the HTTP service and its page."""

from __future__ import annotations

import argparse
import inspect
import os
import re
from collections.abc import Mapping
from dataclasses import Field, fields
from typing import Any

from clients.command_line.cluster import check_cluster
from clients.command_line.errors import OK, UsageError
from renderer.errors import SettingsError
from service.settings import VARIABLE_PREFIX, Settings

DESCRIPTION = """\
Serve frames over HTTP, with a page to try it at / and the interface described at /docs.

It listens on this machine only, unless it is given a token that clients must send. Each flag can also be
set by an environment variable: --max-pixels by GAZETRACE_MAX_PIXELS, and so on; the flag wins."""

EXAMPLES = """\
examples:
  gazetrace serve
      On this machine, port 8321: open http://127.0.0.1:8321/ in a browser.

  gazetrace serve --port 9000 --scenes-folder my-scenes --threads 4
      With the scenes my-scenes/NAME/scene.toml beside the built-in ones, on four cores.

  gazetrace serve --cluster render.example:6379
      Traced by every machine of the Ray cluster whose head that is; `local` starts one on this machine.

  GAZETRACE_TOKEN=a-long-secret gazetrace serve --host 0.0.0.0
      For other machines too. They send the header `Authorization: Bearer a-long-secret`."""

FLAGS = {"scenes": "--scenes-folder"}
"""Flags that do not spell like their setting."""


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse: a flag for every setting."""
    parser = commands.add_parser(
        "serve",
        help="serve frames over HTTP",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    described = setting_texts()
    for setting in fields(Settings):
        text = described[setting.name].replace("%", "%%")
        if isinstance(setting.default, bool):
            parser.add_argument(flag_of(setting.name), dest=setting.name, action="store_const", const="1", help=text)
        else:
            parser.add_argument(
                flag_of(setting.name), dest=setting.name, metavar=_metavar(setting), help=text + _default(setting)
            )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Serve until stopped."""
    settings = settings_of(arguments, os.environ)
    check_cluster(settings.cluster)
    from service.supervisor import serve

    serve(settings, announce, debug=arguments.debug)
    return OK


def announce(line: str) -> None:
    """Tell whoever started the service, at once even where standard output is a file."""
    print(line, flush=True)


def settings_of(arguments: argparse.Namespace, environ: Mapping[str, str]) -> Settings:
    """The settings of the environment, with those of the flags over them.

    Raises:
        UsageError: naming the flag, or the variable where no flag was given.
    """
    given = {
        f"{VARIABLE_PREFIX}{setting.name.upper()}": getattr(arguments, setting.name) for setting in fields(Settings)
    }
    given = {variable: text for variable, text in given.items() if text is not None}
    try:
        return Settings.from_environment({**environ, **given})
    except SettingsError as error:
        name = error.field
        if name in given:
            name = flag_of(name.removeprefix(VARIABLE_PREFIX).lower())
        raise UsageError(f"{name}: expected {error.expected}, found {error.found!r}") from error


def flag_of(setting: str) -> str:
    """The flag of a setting."""
    return FLAGS.get(setting, "--" + setting.replace("_", "-"))


def setting_texts(record: type[Any] = Settings) -> dict[str, str]:
    """What each setting does: the docstring of the record of settings, in the words of a command line."""
    lines = inspect.cleandoc(record.__doc__ or "").splitlines()
    texts = {match[1]: match[2] for line in lines if (match := re.fullmatch(r"    (\w+): (.+?)\.?", line))}
    return {name: text.removeprefix("True to ").replace("None", "unset") for name, text in texts.items()}


def _metavar(setting: Field[Any]) -> str:
    kinds = {"port": "PORT", "host": "ADDRESS", "token": "TOKEN", "scenes": "DIR", "cluster": "ADDRESS"}
    return kinds.get(setting.name, "A,B" if isinstance(setting.default, tuple) else "N")


def _default(setting: Field[Any]) -> str:
    return "" if setting.default in (None, ()) else f" (default {setting.default})"
