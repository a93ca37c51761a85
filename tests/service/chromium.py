"""A headless Chromium, driven through its own DevTools protocol over a pipe: no package, no driver, no port."""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import os
import queue
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from service.protocol import FrameHeader, unpack_frame

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
ASK_AGAIN_S = 5
PATIENCE_S = 60

TEXT, BINARY = 1, 2
"""Opcodes of a WebSocket's frames (RFC 6455, 5.2)."""

# Chromium reads commands from descriptor 3 and writes events to 4.
LAUNCH = (
    "import os, sys; os.dup2(int(sys.argv[1]), 3); os.dup2(int(sys.argv[2]), 4); os.execv(sys.argv[3], sys.argv[3:])"
)


def find_chromium() -> str | None:
    """Path of the browser, None where there is none."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


class Page:
    """A browser with one page at a time: commands, what it evaluates, and every event since it was opened."""

    def __init__(self, commands: int, events: int) -> None:
        self._commands = os.fdopen(commands, "wb", buffering=0)
        self._events = os.fdopen(events, "rb", buffering=0)
        self._ids = itertools.count(1)
        self._replies: dict[int, queue.Queue[dict[str, Any]]] = {}
        self.events: list[dict[str, Any]] = []
        self._context: str | None = None
        self._session: str | None = None
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def open(
        self, url: str, width: int, height: int, ratio: float = 1.0, settings: Mapping[str, str] | None = None
    ) -> None:
        """A new page that knows nothing of earlier ones, listened to from its beginning.

        Args:
            url: of the page.
            width, height: of its window [CSS px].
            ratio: device pixels to a CSS pixel.
            settings: what an earlier visit would have kept.
        """
        self.leave()
        self._context = self.command("Target.createBrowserContext")["browserContextId"]
        target = self.command("Target.createTarget", url="about:blank", browserContextId=self._context)["targetId"]
        self._session = self.command("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.command(f"{domain}.enable")
        self.resize(width, height, ratio)
        if settings is not None:
            self.command("Page.navigate", url=url.partition("#")[0] + "docs")
            self.wait_for("location.pathname.endsWith('docs')")
            self.evaluate(f"localStorage.setItem('gazetrace-settings', {json.dumps(json.dumps(settings))})")
        self.command("Page.navigate", url=url)

    def reload(self) -> None:
        """Open the same page again; what it said so far is forgotten."""
        self.events.clear()
        self.command("Page.reload")

    def leave(self) -> None:
        """Close the page, and forget what it said and stored."""
        self._session = None
        if self._context is not None:
            self.command("Target.disposeBrowserContext", browserContextId=self._context)
            self._context = None
        self.events.clear()

    def resize(self, width: int, height: int, ratio: float = 1.0) -> None:
        """Give the page another window."""
        self.command(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio, mobile=False
        )

    def close(self) -> None:
        """Let go of the pipes, once the browser has ended."""
        self._listener.join(PATIENCE_S)
        self._commands.close()
        self._events.close()

    def command(self, method: str, *, patience_s: float = PATIENCE_S, **parameters: object) -> dict[str, Any]:
        """Send a command and return its result; `queue.Empty` if there is none in time."""
        number = next(self._ids)
        self._replies[number] = queue.Queue()
        message: dict[str, object] = {"id": number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        self._commands.write(json.dumps(message).encode() + b"\0")
        reply = self._replies[number].get(timeout=patience_s)
        assert "error" not in reply, (method, reply["error"])
        result: dict[str, Any] = reply["result"]
        return result

    def evaluate(self, expression: str, patience_s: float = PATIENCE_S) -> Any:
        """The value of a JavaScript expression; `queue.Empty` if there is none in time."""
        result = self.command(
            "Runtime.evaluate", patience_s=patience_s, expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def wait_for(self, condition: str) -> Any:
        """Evaluate a JavaScript expression until it is true, once a drawn picture; its value.

        A page that is just being left for another one never answers, so each question is asked again after a while.
        """
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            with contextlib.suppress(queue.Empty):
                question = f"new Promise((done) => setTimeout(() => done({condition}), 16))"
                value = self.evaluate(question, ASK_AGAIN_S)
                if value:
                    return value
        raise AssertionError(f"never true: {condition}; the page says: {self.evaluate('document.body.innerText')}")

    def point_at(self, x: float, y: float) -> None:
        """Move the mouse [CSS px]."""
        self.command("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def drag(self, start: tuple[float, float], end: tuple[float, float], button: str, modifiers: int = 0) -> None:
        """Press a mouse button, move and let go [CSS px]."""
        for kind, (x, y) in (("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end)):
            self.command(
                "Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=1, modifiers=modifiers
            )

    def press(self, key: str) -> None:
        """Press a key and let go, by its name in a KeyboardEvent."""
        code = {"Escape": 27, "Enter": 13, "Tab": 9}.get(key, 0)
        text = {"text": key} if len(key) == 1 else {}
        self.command("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, **text)
        self.command("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code)

    def click(self, selector: str) -> None:
        """Click on an element as its own script would."""
        self.evaluate(f"document.querySelector({json.dumps(selector)}).click()")

    def enter(self, selector: str, value: object) -> None:
        """Set a field and say that it was changed."""
        self.evaluate(
            f"""(() => {{
              const field = document.querySelector({json.dumps(selector)});
              field.value = {json.dumps(str(value))};
              field.dispatchEvent(new Event("input", {{ bubbles: true }}));
            }})()"""
        )

    def said(self, kind: str) -> list[dict[str, Any]]:
        """The messages of this type that the page has sent over its WebSockets."""
        return [message for message in map(json.loads, self._texts("webSocketFrameSent")) if message["type"] == kind]

    def heard(self, kind: str) -> list[dict[str, Any]]:
        """The messages of this type that the page has received over its WebSockets."""
        return [
            message for message in map(json.loads, self._texts("webSocketFrameReceived")) if message["type"] == kind
        ]

    def shown(self, which: Callable[[FrameHeader], bool] = lambda _: True) -> FrameHeader:
        """Wait until the newest frame that the page has acknowledged, and so drawn, is like this; its header."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            newest = self._newest_drawn()
            if newest is not None and which(newest):
                return newest
            self.evaluate("new Promise((done) => setTimeout(done, 16))")
        raise AssertionError(f"no such frame; the page says: {self.evaluate('document.body.innerText')}")

    def _newest_drawn(self) -> FrameHeader | None:
        acknowledged = set()
        for event in reversed(self.events):
            response = event["params"].get("response", {})
            if event["method"] == "Network.webSocketFrameSent" and response["opcode"] == TEXT:
                acknowledged.add(json.loads(response["payloadData"]).get("frame"))
            elif event["method"] == "Network.webSocketFrameReceived" and response["opcode"] == BINARY:
                header = unpack_frame(base64.b64decode(response["payloadData"])).header
                if header.frame in acknowledged:
                    return header
        return None

    def _texts(self, event_name: str) -> list[str]:
        frames = [event["params"]["response"] for event in self.events if event["method"] == f"Network.{event_name}"]
        return [frame["payloadData"] for frame in frames if frame["opcode"] == TEXT]

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

    def _listen(self) -> None:
        received = b""
        while chunk := self._events.read(65_536):
            *messages, received = (received + chunk).split(b"\0")
            for message in map(json.loads, messages):
                if "id" in message:
                    self._replies[message["id"]].put(message)
                else:
                    self.events.append(message)


@contextlib.contextmanager
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
