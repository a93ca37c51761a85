"""What a measurement wants of a renderer."""

from __future__ import annotations

from typing import Protocol

from renderer.frame import Frame, FrameRequest
from renderer.prepared import PreparedScene


class Renders(Protocol):
    """Whoever renders a frame, at once or when there is time."""

    def render(self, prepared: PreparedScene, request: FrameRequest) -> Frame:
        """Render one frame."""
