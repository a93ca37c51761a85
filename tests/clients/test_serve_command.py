"""`gazetrace serve`: its settings as flags, and a service that starts and stops."""

from __future__ import annotations

import re
import signal
import subprocess
import threading
import urllib.request
from collections.abc import Iterator
from dataclasses import fields

import pytest

from clients.command_line import build_parser
from clients.command_line.serve import flag_of, setting_texts, settings_of
from service.settings import Settings
from tests.clients.commands import PATIENCE_S, help_of, start

pytestmark = pytest.mark.usefixtures("plain_environment")


def test_every_setting_is_a_flag_with_its_explanation() -> None:
    text = " ".join(help_of("serve").split())
    for setting in fields(Settings):
        explained = setting_texts()[setting.name]
        assert re.search(rf" {flag_of(setting.name)} ", text)
        assert explained in text


def test_a_flag_wins_over_the_environment_and_errors_name_who_said_it() -> None:
    arguments = build_parser().parse_args(["serve", "--port", "9001", "--insecure"])
    environ = {"GAZETRACE_PORT": "9000", "GAZETRACE_MAX_DEPTH": "3", "GAZETRACE_HOST": "0.0.0.0"}
    settings = settings_of(arguments, environ)
    assert (settings.port, settings.max_depth, settings.insecure, settings.host) == (9001, 3, True, "0.0.0.0")
    with pytest.raises(Exception, match=r"^GAZETRACE_MAX_DEPTH: expected an integer"):
        settings_of(arguments, {"GAZETRACE_MAX_DEPTH": "deep"})


@pytest.fixture
def service() -> Iterator[subprocess.Popen[bytes]]:
    """A running service on a free port."""
    process = start("serve", "--port", "0", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    end_of_patience = threading.Timer(PATIENCE_S, process.kill)
    end_of_patience.start()
    yield process
    end_of_patience.cancel()
    process.kill()
    process.communicate()


def test_serve_says_where_it_is_and_stops_quietly_on_ctrl_c(service: subprocess.Popen[bytes]) -> None:
    assert service.stdout is not None
    lines = []
    while not lines or not lines[-1].startswith("ready in"):
        line = service.stdout.readline().decode()
        assert line, service.stderr and service.stderr.read()
        lines.append(line)
    text = "".join(lines)
    address = re.search(r"serves on (http://127\.0\.0\.1:\d+)", text)
    assert address is not None
    assert "compil" in text, "it says what takes so long"
    question = re.search(r"^curl .*\"(http\S+)\"$", text, re.MULTILINE)
    assert question is not None, "it says how to ask for a frame"
    with urllib.request.urlopen(question[1] + "&width_px=64&height_px=36", timeout=PATIENCE_S) as reply:
        assert reply.read().startswith(b"\x89PNG")
    service.send_signal(signal.SIGINT)
    _, complaints = service.communicate(timeout=PATIENCE_S)
    assert service.returncode == 0
    assert complaints == b""
