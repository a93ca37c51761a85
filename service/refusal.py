"""Every error a stream answers with: the same kinds as the HTTP problems, as messages of the wire."""

from __future__ import annotations

import logging

from pydantic import ValidationError

from renderer.errors import SceneError, SettingsError, UnknownScene
from service import protocol
from service.jobs import Stopping
from service.problem import OUT_OF_MEMORY, field_error, shown
from service.rendering import NotReady, OverLimit

log = logging.getLogger(__name__)


def refusal(error: Exception) -> protocol.Error:
    """What to tell a client whose request was refused; a mistake of our own goes to the log."""
    if isinstance(error, ValidationError):
        items = [field_error({**item, "loc": ("body", *item["loc"])}) for item in error.errors()]
        text = "; ".join(f"{item.field}: {item.message}" for item in items)
        return protocol.Error("invalid-request", _cut(text), items[0].field)
    if isinstance(error, SettingsError):
        text = f"{error.field}: expected {error.expected}, found {shown(error.found)}"
        return protocol.Error("invalid-request", _cut(text), error.field)
    if isinstance(error, OverLimit):
        return protocol.Error("over-limit", str(error), error.field)
    if isinstance(error, UnknownScene):
        return protocol.Error("unknown-scene", _cut(str(error)), "scene")
    if isinstance(error, SceneError):
        return protocol.Error("broken-scene", _cut(str(error)), "scene")
    if isinstance(error, LookupError):
        return protocol.Error("invalid-request", "expected configure before a change of it", "type")
    if isinstance(error, NotReady):
        return protocol.Error("not-ready", str(error))
    if isinstance(error, Stopping):
        return protocol.Error("stopping", str(error))
    if isinstance(error, protocol.ProtocolError):
        return protocol.Error("protocol", _cut(error.message), _cut(error.field))
    if isinstance(error, MemoryError):
        log.error("a stream is out of memory: %s", error)
        return protocol.Error("out-of-memory", OUT_OF_MEMORY)
    log.error("a stream failed", exc_info=error)
    return protocol.Error("mistake", "this failed by a mistake of the service; its log says more")


def _cut(text: str) -> str:
    return text[: protocol.LONGEST_TEXT]
