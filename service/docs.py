"""The OpenAPI document as a page for people, without scripts and without anything from elsewhere."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

Document = Mapping[str, Any]

LONGEST_CHOICE = 8
"""Values of an enumeration that a type names."""


def documentation(document: Document) -> str:
    """The HTML page for an OpenAPI 3.1 document: operations first, then the models they name."""
    info = document["info"]
    operations = [
        _operation(method, path, operation, document)
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]
    models = [_model(name, schema) for name, schema in sorted(document["components"]["schemas"].items())]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width"><title>gazetrace: the API</title>'
        '<link rel="icon" href="page/icon.svg"><link rel="stylesheet" href="page/docs.css"></head><body><main>'
        f"<h1>{escape(info['title'])} <small>{escape(info['version'])}</small></h1>"
        f"<p>{escape(info['summary'])}. <a href='./'>The page</a> · <a href='openapi.json'>openapi.json</a></p>"
        f"<p>{escape(info['description'])}</p>"
        f"<h2>Routes</h2>{''.join(operations)}<h2>Models</h2>{''.join(models)}</main></body></html>"
    )


def _operation(method: str, path: str, operation: Document, document: Document) -> str:
    parts = [
        f"<h3><b>{method.upper()}</b> <code>{escape(path)}</code> {escape(operation.get('summary', ''))}</h3>",
        _paragraphs(operation.get("description", "")),
    ]
    if "parameters" in operation:
        parts.append(_table("Parameter", _parameters(operation)))
    if "requestBody" in operation:
        schema = operation["requestBody"]["content"]["application/json"]["schema"]
        parts.append(f"<p>Body: {_type(schema)}</p>")
        example = _resolve(schema, document).get("example")
        if example is not None:
            parts.append(f"<pre>{escape(_json(example))}</pre>")
    replies = sorted(operation["responses"].items())
    parts.append("<ul>" + "".join(_reply(status, reply) for status, reply in replies) + "</ul>")
    return f"<section>{''.join(parts)}</section>"


def _parameters(operation: Document) -> Iterator[tuple[str, str, str]]:
    for parameter in operation["parameters"]:
        schema = parameter["schema"]
        description = parameter.get("description", schema.get("description", ""))
        yield parameter["name"], _type(schema), _text(description) + _required(parameter["required"], schema)


def _reply(status: str, reply: Document) -> str:
    kinds = [
        escape(media) + (f" {_type(content['schema'])}" if content.get("schema") else "")
        for media, content in reply.get("content", {}).items()
    ]
    return f"<li><b>{status}</b> {_text(reply['description'])} <small>{', '.join(kinds)}</small></li>"


def _model(name: str, schema: Document) -> str:
    required = schema.get("required", ())
    rows = (
        (field, _type(what), _text(what.get("description", "")) + _required(field in required, what))
        for field, what in schema.get("properties", {}).items()
    )
    return (
        f'<section id="{escape(name)}"><h3>{escape(name)}</h3>{_paragraphs(schema.get("description", ""))}'
        f"{_table('Field', rows)}</section>"
    )


def _table(first: str, rows: Iterator[tuple[str, str, str]]) -> str:
    body = "".join(f"<tr><td><code>{escape(name)}</code><td>{kind}<td>{what}" for name, kind, what in rows)
    return f"<table><thead><tr><th>{first}<th>Type<th></thead><tbody>{body}</tbody></table>"


def _required(required: bool, schema: Document) -> str:
    if required:
        return " <em>required</em>"
    if "default" not in schema:
        return ""
    return f" <small>default <code>{escape(_json(schema['default']))}</code></small>"


def _type(schema: Document) -> str:
    """A schema in a few words of HTML."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f'<a href="#{escape(name)}">{escape(name)}</a>'
    if "anyOf" in schema:
        return " or ".join(_type(option) for option in schema["anyOf"])
    if "const" in schema:
        return f"<code>{escape(_json(schema['const']))}</code>"
    if "enum" in schema:
        return " | ".join(f"<code>{escape(str(value))}</code>" for value in schema["enum"][:LONGEST_CHOICE])
    if schema.get("type") == "array":
        return f"list of {_type(schema.get('items', {}))}"
    return escape(schema.get("type", "any") + _bounds(schema))


def _bounds(schema: Document) -> str:
    words = {"exclusiveMinimum": ">", "minimum": "≥", "maximum": "≤", "maxLength": "length ≤"}
    return "".join(f" {word} {schema[key]:g}" for key, word in words.items() if key in schema)


def _resolve(schema: Document, document: Document) -> Document:
    name = schema["$ref"].rpartition("/")[2]
    resolved: Document = document["components"]["schemas"][name]
    return resolved


def _paragraphs(text: str) -> str:
    return "".join(f"<p>{_text(paragraph)}</p>" for paragraph in text.split("\n\n") if paragraph)


def _text(text: str) -> str:
    """Text with code between backquotes as HTML."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def _json(value: object) -> str:
    return json.dumps(value, indent=2 if isinstance(value, dict) and value else None)
