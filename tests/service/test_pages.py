"""The page's files, the documentation, the OpenAPI document."""

from __future__ import annotations

import re

import httpx
import pytest

from service.openapi import package_version
from service.pages import MEDIA_TYPES


@pytest.mark.parametrize("path", ["/", *(f"/page/{name}" for name in MEDIA_TYPES)])
def test_the_page_is_served_and_kept_while_it_is_the_same(client: httpx.Client, path: str) -> None:
    reply = client.get(path)
    assert reply.status_code == 200
    assert reply.headers["content-type"].partition(";")[0] == MEDIA_TYPES[path.rpartition("/")[2] or "index.html"]
    unchanged = client.get(path, headers={"If-None-Match": reply.headers["etag"]})
    assert (unchanged.status_code, unchanged.content) == (304, b"")


@pytest.mark.parametrize("path", ["/", "/docs"])
def test_pages_need_nothing_inline_and_nothing_from_elsewhere(client: httpx.Client, path: str) -> None:
    page = client.get(path).text
    assert "://" not in re.sub(r'xmlns="[^"]*"', "", page)
    assert not re.search(r"<script(?![^>]*\bsrc=)|<style|\bstyle=|\son\w+=", page)
    for name in re.findall(r'(?:src|href)="page/([^"]+)"', page):
        assert name in MEDIA_TYPES


def test_the_openapi_document_is_of_this_service(client: httpx.Client) -> None:
    document = client.get("/openapi.json").json()
    assert document["info"]["version"] == package_version()
    assert set(document["paths"]) == {
        "/v1/render", "/v1/scenes", "/v1/scenes/{scene_id}", "/v1/scenes/{scene_id}/frame",
        "/v1/scenes/{scene_id}/accuracy", "/v1/cellmap",
        "/v1/sessions", "/healthz", "/readyz", "/metrics",
    }  # fmt: skip
    assert "securitySchemes" not in document["components"]
    references = set(re.findall(r"#/components/schemas/(\w+)", client.get("/openapi.json").text))
    assert references <= set(document["components"]["schemas"])
    assert "HTTPValidationError" not in references
    display = document["components"]["schemas"]["DisplayBody"]["properties"]
    assert display["width_px"]["maximum"] == 32_768
    for methods in document["paths"].values():
        for operation in methods.values():
            for status, reply in operation["responses"].items():
                if int(status) >= 400:
                    assert list(reply["content"]) == ["application/problem+json"]


def test_the_documentation_lists_every_route_and_field(client: httpx.Client) -> None:
    document = client.get("/openapi.json").json()
    page = client.get("/docs").text
    for path, methods in document["paths"].items():
        assert f"<code>{path}</code>" in page
        for operation in methods.values():
            for parameter in operation.get("parameters", []):
                assert f"<code>{parameter['name']}</code>" in page
    for name, schema in document["components"]["schemas"].items():
        assert f'id="{name}"' in page
        for field in schema.get("properties", {}):
            assert f"<code>{field}</code>" in page
    assert "33,177,600 pixels" in page
