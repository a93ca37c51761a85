"""Names that a file system, a URL or a shell might make something of, on the wire in place of a scene."""

from __future__ import annotations

import http.client
import json
from urllib.parse import quote, urlsplit

from tests.service.conftest import PATIENCE_S

ODD_NAMES = (
    "..", "../..", "../../etc/passwd", "matte/../spheres", "/etc/passwd", "..\\..\\etc", "%2e%2e%2fetc%2fpasswd",
    "~root", "file:///etc/passwd", "matte\0.toml", "matte.", ".matte", "MATTE", "mätte", "matte\n", " matte", "con",
    "m" * 65, "//", "*", "matte/scene.toml",
)  # fmt: skip
"""None is a scene's."""

ROUTES = ("/v1/scenes/{}", "/v1/scenes/{}/frame?gaze_x=1&gaze_y=1&width_px=8&height_px=8", "/v1/scenes/{}/accuracy")

REFUSALS = (404, 422)


def ask_odd_names(address: str) -> list[str]:
    """Ask each route for each name, as it is, quoted and quoted twice; the replies that were no plain refusal."""
    where = urlsplit(address)
    assert where.hostname is not None
    connection = http.client.HTTPConnection(where.hostname, where.port, timeout=PATIENCE_S)
    wrong = []
    try:
        for target in dict.fromkeys(route.format(name) for route in ROUTES for name in _written(ODD_NAMES)):
            connection.putrequest("GET", target)
            connection.endheaders()
            reply = connection.getresponse()
            body = reply.read()
            kind = reply.headers.get_content_type()
            if reply.status not in REFUSALS or kind != "application/problem+json" or not json.loads(body)["detail"]:
                wrong.append(f"{target}: {reply.status} {kind} {body[:200]!r}")
    finally:
        connection.close()
    return wrong


def _written(names: tuple[str, ...]) -> list[str]:
    """The ways to write names in a path; those that no request line can hold only quoted."""
    quoted = [quote(name, safe="") for name in names]
    plain = [name for name in names if name.isascii() and name.isprintable() and " " not in name]
    return [*plain, *quoted, *(quote(name, safe="") for name in quoted)]
