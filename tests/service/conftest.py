"""A real service on a real port for the tests of this folder."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest

from renderer.pipeline import Renderer
from service.app import create_app
from service.listener import address_of, listen
from service.server import Server
from service.settings import Settings
from service.survey import Survey

PATIENCE_S = 120
"""Longest wait for anything; kernels may have to be compiled first."""

BROKEN_SCENE = "broken"


@contextmanager
def serving(
    settings: Settings,
    renderer: Renderer | None = None,
    *,
    ready: bool = True,
    clock: Callable[[], int] = time.monotonic_ns,
    survey: Survey | None = None,
) -> Iterator[str]:
    """A service in a thread of this process: its address. `ready`: once it renders, else at once."""
    lines: list[str] = []
    compiled = threading.Event()

    def announce(line: str) -> None:
        lines.append(line)
        if not line.startswith("compiling"):
            compiled.set()

    with listen(settings) as listener:
        server = Server(create_app(settings, renderer, announce, clock, survey), settings)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            if ready:
                assert compiled.wait(PATIENCE_S), lines
                assert lines[-1].startswith("ready in "), lines
            yield address_of(settings, listener)
        finally:
            server.should_exit = True
            thread.join(PATIENCE_S)
            assert not thread.is_alive()


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    """One renderer for all services, so that kernels are loaded once."""
    renderer = Renderer()
    yield renderer
    renderer.close()


@pytest.fixture(scope="session")
def scenes_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scenes folder with one broken scene."""
    folder = tmp_path_factory.mktemp("scenes")
    (folder / BROKEN_SCENE).mkdir()
    (folder / BROKEN_SCENE / "scene.toml").write_text("title = 'no end\n")
    return folder


@pytest.fixture(scope="session")
def address(renderer: Renderer, scenes_folder: Path) -> Iterator[str]:
    """A service with the default limits."""
    with serving(Settings(port=0, scenes=scenes_folder), renderer) as address:
        yield address


@pytest.fixture
def client(address: str) -> Iterator[httpx.Client]:
    """A client of that service."""
    with httpx.Client(base_url=address, timeout=PATIENCE_S) as client:
        yield client


@pytest.fixture
def client_of(renderer: Renderer) -> Iterator[Callable[[Settings], httpx.Client]]:
    """Starts a service with other settings and gives a client of it."""
    with ExitStack() as stack:

        def start(settings: Settings) -> httpx.Client:
            address = stack.enter_context(serving(settings, renderer))
            return stack.enter_context(httpx.Client(base_url=address, timeout=PATIENCE_S))

        yield start
