"""Self-contained pages: style, script, data and pictures inside one file that works from disk."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

ASSETS: Final = Path(__file__).parent / "page"
"""Style sheets and scripts."""

MEDIA_TYPES: Final = {".png": "image/png", ".jpg": "image/jpeg", ".webp": "image/webp", ".svg": "image/svg+xml"}

ICON: Final = "data:,"
"""No icon: the browser need not look for one."""


def page(title: str, body: str, scripts: Sequence[str] = (), data: Any = None) -> str:
    """A whole HTML document.

    Args:
        title: of the window.
        body: HTML.
        scripts: names of scripts in `ASSETS`, run in this order in one scope.
        data: what the script finds as JSON in the element `data`; None for nothing.
    """
    parts = [
        "<!doctype html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<link rel="icon" href="{ICON}">',
        f"<title>{text(title)}</title>",
        f"<style>\n{asset('report.css')}</style>",
        "</head>",
        f"<body>\n{body}",
    ]
    if data is not None:
        # A "<" inside a script could end it.
        held = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
        parts.append(f'<script type="application/json" id="data">{held}</script>')
    if scripts:
        parts.append('<script>\n"use strict";\n' + "\n".join(asset(name) for name in scripts) + "</script>")
    return "\n".join([*parts, "</body>", "</html>", ""])


def asset(name: str) -> str:
    """A style sheet or script."""
    return (ASSETS / name).read_text(encoding="utf-8")


def text(value: object) -> str:
    """Fit for HTML, inside attributes too."""
    return html.escape(str(value))


def data_url(path: Path) -> str:
    """A picture as an address that holds it."""
    encoded = base64.b64encode(path.read_bytes()).decode()
    return f"data:{MEDIA_TYPES[path.suffix.lower()]};base64,{encoded}"


def figure(title: str, path: Path, caption: str) -> str:
    """A picture under a heading, with what it shows below."""
    return (
        f'<h2>{text(title)}</h2>\n<figure><img src="{data_url(path)}" alt="{text(title)}">'
        f"<figcaption>{text(caption)}</figcaption></figure>"
    )


def table(heads: Iterable[str], rows: Iterable[Iterable[str]], caption: str = "") -> str:
    """A table whose first column is text and whose others are numbers; cells are HTML."""
    head = "".join(f'<th scope="col">{cell}</th>' for cell in heads)
    body = "\n".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    said = f"<caption>{caption}</caption>" if caption else ""
    return f'<div class="wide"><table>{said}<thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table></div>'


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Names and values, as a list."""
    return "<dl>" + "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in pairs) + "</dl>"


def machine_facts(record: dict[str, Any]) -> str:
    """Machine, versions and command of a record."""
    machine = record["machine"]
    packages = ", ".join(f"{name} {version}" for name, version in machine["packages"].items())
    threads = f"{machine['cores']} cores, {machine['threads']} of them used, {machine['memory_gib']:g} GiB"
    return facts(
        [
            ("command", record["command"]),
            ("made", record["made"]),
            ("gazetrace", record["version"]),
            ("machine", f"{machine['processor']}; {threads}"),
            ("system", f"{machine['platform']}; Python {machine['python']}; {packages}"),
        ]
    )
