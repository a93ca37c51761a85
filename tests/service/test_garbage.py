"""Python's search for garbage in the process of a service."""

from __future__ import annotations

import json
import subprocess
import sys

from service.garbage import MIDDLE_AFTER, OLDEST_AFTER
from tests.service.conftest import PATIENCE_S

RUN = """
import gc, json, os, signal
from service.listener import listen
from service.server import run
from service.settings import Settings
from service.watch import Watch

def announce(line):
    if line.startswith("ready"):
        print(json.dumps([gc.get_freeze_count(), len(gc.get_objects()), gc.get_threshold()]), flush=True)
        os.kill(os.getpid(), signal.SIGTERM)

settings = Settings(port=0, threads=1)
with listen(settings) as listener:
    run(settings, listener, announce, Watch())
"""


def test_what_a_ready_service_keeps_is_not_looked_at_again_for_garbage() -> None:
    """A look at all of it would stop every frame for a tenth of a second and more."""
    done = subprocess.run([sys.executable, "-c", RUN], stdout=subprocess.PIPE, timeout=PATIENCE_S, check=False)
    set_aside, looked_at, thresholds = json.loads(done.stdout)
    assert set_aside > 100_000
    assert looked_at < set_aside / 100
    assert thresholds[1:] == [MIDDLE_AFTER, OLDEST_AFTER]
