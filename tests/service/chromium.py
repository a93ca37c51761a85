"""A headless Chromium, driven through its own DevTools protocol over a pipe: no package, no driver, no port."""

from __future__ import annotations

import itertools
import json
import os
import queue
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
PATIENCE_S = 60

# Chromium reads commands from descriptor 3 and writes events to 4.
LAUNCH = (
    "import os, sys; os.dup2(int(sys.argv[1]), 3); os.dup2(int(sys.argv[2]), 4); os.execv(sys.argv[3], sys.argv[3:])"
)


def find_chromium() -> str | None:
    """Path of the browser, None where there is none."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


class Page:
    """One page: commands, what it evaluates, and every event since it was opened."""

    def __init__(self, commands: int, events: int) -> None:
        self._commands = os.fdopen(commands, "wb", buffering=0)
        self._events = os.fdopen(events, "rb", buffering=0)
        self._ids = itertools.count(1)
        self._replies: dict[int, queue.Queue[dict[str, Any]]] = {}
        self.events: list[dict[str, Any]] = []
        self._session: str | None = None
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def open(self, url: str, width: int, height: int) -> None:
        """A new page, listened to from its beginning."""
        target = self.command("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.command("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.command(f"{domain}.enable")
        self.command(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )
        self.command("Page.navigate", url=url)

    def close(self) -> None:
        """Let go of the pipes, once the browser has ended."""
        self._listener.join(PATIENCE_S)
        self._commands.close()
        self._events.close()

    def command(self, method: str, **parameters: object) -> dict[str, Any]:
        """Send a command and return its result."""
        number = next(self._ids)
        self._replies[number] = queue.Queue()
        message: dict[str, object] = {"id": number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        self._commands.write(json.dumps(message).encode() + b"\0")
        reply = self._replies[number].get(timeout=PATIENCE_S)
        assert "error" not in reply, (method, reply["error"])
        result: dict[str, Any] = reply["result"]
        return result

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression."""
        result = self.command("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def wait_for(self, condition: str) -> Any:
        """Evaluate a JavaScript expression until it is true, once a drawn picture; its value."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            value = self.evaluate(f"new Promise((done) => setTimeout(() => done({condition}), 16))")
            if value:
                return value
        raise AssertionError(f"never true: {condition}; the page says: {self.evaluate('document.body.innerText')}")

    def point_at(self, x: float, y: float) -> None:
        """Move the mouse [CSS px]."""
        self.command("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def complaints(self) -> list[str]:
        """Console errors and warnings, exceptions, and what the security policy blocked."""
        found = []
        for event in self.events:
            parameters = event["params"]
            if event["method"] == "Runtime.exceptionThrown":
                found.append(parameters["exceptionDetails"].get("exception", {}).get("description", "exception"))
            elif event["method"] == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning"):
                found.append(str(parameters["args"]))
            elif event["method"] == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
                found.append(f"{parameters['entry']['text']} {parameters['entry'].get('url', '')}")
        return found

    def requests(self, path: str) -> list[dict[str, Any]]:
        """The JSON bodies that the page has sent to `path`."""
        return [
            json.loads(event["params"]["request"]["postData"])
            for event in self.events
            if event["method"] == "Network.requestWillBeSent" and event["params"]["request"]["url"].endswith(path)
        ]

    def _listen(self) -> None:
        received = b""
        while chunk := self._events.read(65_536):
            *messages, received = (received + chunk).split(b"\0")
            for message in map(json.loads, messages):
                if "id" in message:
                    self._replies[message["id"]].put(message)
                else:
                    self.events.append(message)


@contextmanager
def browsing(chromium: str, profile: Path) -> Iterator[Page]:
    """A browser with nothing in it, gone in the end."""
    their_commands, our_commands = os.pipe()
    our_events, their_events = os.pipe()
    arguments = [
        "--headless",
        "--remote-debugging-pipe",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        f"--user-data-dir={profile}",
    ]
    with subprocess.Popen(
        [sys.executable, "-c", LAUNCH, str(their_commands), str(their_events), chromium, *arguments],
        pass_fds=(their_commands, their_events),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as browser:
        os.close(their_commands)
        os.close(their_events)
        page = Page(our_commands, our_events)
        try:
            yield page
        finally:
            browser.kill()
            browser.wait(PATIENCE_S)
            page.close()
