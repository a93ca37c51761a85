"""Settings: every field a variable, nothing unsafe by accident."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest
import trustme

from renderer.errors import SettingsError
from service.settings import Settings, is_loopback

STATED = {
    "host": ("0.0.0.0", "0.0.0.0"),
    "port": ("9000", 9000),
    "token": ("a-long-token", "a-long-token"),
    "view_token": ("another-token", "another-token"),
    "gaze_token": ("a-third-token", "a-third-token"),
    "insecure": ("yes", True),
    "log_json": ("on", True),
    "threads": ("3", 3),
    "cluster": ("render.example:6379", "render.example:6379"),
    "max_pixels": ("1000", 1000),
    "max_samples_per_cell": ("8", 8),
    "max_depth": ("2", 2),
    "max_camera_rays": ("5000", 5000),
    "max_body_bytes": ("512", 512),
    "max_header_bytes": ("4096", 4096),
    "max_connections": ("4", 4),
    "client_timeout_s": ("3", 3),
    "min_bytes_per_s": ("10", 10),
    "max_concurrent_renders": ("2", 2),
    "max_queued_renders": ("0", 0),
    "max_sessions": ("2", 2),
    "max_viewers": ("3", 3),
    "max_message_bytes": ("2048", 2048),
    "max_messages_per_s": ("100", 100),
    "ping_s": ("5", 5),
    "session_expiry_s": ("0", 0),
    "frame_bytes": ("9", 9),
    "map_cache_bytes": ("1", 1),
    "store_bytes": ("2", 2),
    "scene_bytes": ("3", 3),
    "max_scene_file_bytes": ("4", 4),
    "max_triangles": ("5", 5),
    "max_texture_pixels": ("6", 6),
    "max_load_s": ("7", 7),
    "max_load_bytes": ("8", 8),
    "max_scene_crashes": ("9", 9),
    "allowed_hosts": ("render.example, lab", ("render.example", "lab")),
    "allowed_origins": ("https://lab.example", ("https://lab.example",)),
}


def test_every_field_has_a_variable(tmp_path: Path) -> None:
    environ = {f"GAZETRACE_{name.upper()}": text for name, (text, _) in STATED.items()}
    certfile = tmp_path / "service.pem"
    trustme.CA().issue_cert("localhost").private_key_and_cert_chain_pem.write_to_path(str(certfile))
    paths = {"scenes": tmp_path, "certfile": certfile, "keyfile": certfile}
    environ |= {f"GAZETRACE_{name.upper()}": str(path) for name, path in paths.items()}
    settings = Settings.from_environment(environ)
    assert {field.name for field in fields(Settings)} == {*STATED, *paths}
    for name, (_, value) in STATED.items():
        assert getattr(settings, name) == value, name
    for name, path in paths.items():
        assert getattr(settings, name) == path
    assert Settings.from_environment(settings.to_environment()) == settings


def test_the_defaults_survive_the_way_through_the_environment() -> None:
    assert Settings.from_environment(Settings().to_environment()) == Settings()


def test_empty_and_foreign_variables_state_nothing() -> None:
    environ = {"GAZETRACE_PORT": "", "GAZETRACE_TOKEN": " ", "GAZETRACE_OTHER": "1", "PORT": "1"}
    assert Settings.from_environment(environ) == Settings()


@pytest.mark.parametrize(
    ("variable", "text"),
    [
        ("GAZETRACE_PORT", "http"),
        ("GAZETRACE_CLUSTER", "render.example"),
        ("GAZETRACE_CLUSTER", "render.example:70000"),
        ("GAZETRACE_CLUSTER", ":6379"),
        ("GAZETRACE_PORT", "65536"),
        ("GAZETRACE_PORT", "-1"),
        ("GAZETRACE_THREADS", "0"),
        ("GAZETRACE_MAX_PIXELS", "0"),
        ("GAZETRACE_MAX_SAMPLES_PER_CELL", "4097"),
        ("GAZETRACE_MAX_DEPTH", "65"),
        ("GAZETRACE_MAX_CAMERA_RAYS", "1e6"),
        ("GAZETRACE_MAX_BODY_BYTES", "0"),
        ("GAZETRACE_MAX_HEADER_BYTES", "1023"),
        ("GAZETRACE_MAX_CONNECTIONS", "0"),
        ("GAZETRACE_CLIENT_TIMEOUT_S", "0"),
        ("GAZETRACE_MAX_MESSAGES_PER_S", "0"),
        ("GAZETRACE_CERTFILE", "/no/such/file"),
        ("GAZETRACE_CERTFILE", __file__),
        ("GAZETRACE_KEYFILE", __file__),
        ("GAZETRACE_VIEW_TOKEN", "no-token-beside-it"),
        ("GAZETRACE_MAX_CONCURRENT_RENDERS", "0"),
        ("GAZETRACE_MAX_QUEUED_RENDERS", "-1"),
        ("GAZETRACE_MAX_SESSIONS", "0"),
        ("GAZETRACE_MAX_VIEWERS", "0"),
        ("GAZETRACE_MAX_MESSAGE_BYTES", "65537"),
        ("GAZETRACE_PING_S", "0"),
        ("GAZETRACE_SESSION_EXPIRY_S", "-1"),
        ("GAZETRACE_STORE_BYTES", "-1"),
        ("GAZETRACE_FRAME_BYTES", "0"),
        ("GAZETRACE_MAX_SCENE_FILE_BYTES", "0"),
        ("GAZETRACE_MAX_TRIANGLES", "0"),
        ("GAZETRACE_MAX_TEXTURE_PIXELS", "0"),
        ("GAZETRACE_MAX_LOAD_S", "0"),
        ("GAZETRACE_MAX_LOAD_BYTES", "0"),
        ("GAZETRACE_MAX_SCENE_CRASHES", "1"),
        ("GAZETRACE_INSECURE", "maybe"),
        ("GAZETRACE_SCENES", "/no/such/folder"),
        ("GAZETRACE_TOKEN", "short"),
        ("GAZETRACE_TOKEN", "has a space in it"),
        ("GAZETRACE_TOKEN", "nicht-für-köpfe"),
        ("GAZETRACE_ALLOWED_ORIGINS", "lab.example"),
        ("GAZETRACE_ALLOWED_ORIGINS", "https://lab.example/page"),
        ("GAZETRACE_HOST", "0.0.0.0"),
    ],
)
def test_a_wrong_variable_is_named(variable: str, text: str) -> None:
    with pytest.raises(SettingsError) as raised:
        Settings.from_environment({variable: text})
    assert raised.value.field == variable
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "::1", "localhost", "LOCALHOST", "localhost."])
def test_loopback_needs_no_token(host: str) -> None:
    assert is_loopback(host)
    assert Settings(host=host).token is None


@pytest.mark.parametrize(
    "host", ["0.0.0.0", "::", "192.168.1.2", "example.org", "127.0.0.1.example.org", "localhost.org"]
)
def test_beyond_this_machine_a_token_or_a_word_is_needed(host: str) -> None:
    with pytest.raises(SettingsError, match="GAZETRACE_TOKEN"):
        Settings(host=host)
    assert Settings(host=host, token="a-long-token").host == host
    assert Settings(host=host, insecure=True).host == host


def test_the_token_is_not_shown() -> None:
    assert "a-long-token" not in repr(Settings(token="a-long-token"))
    with pytest.raises(SettingsError) as raised:
        Settings(token="tiny")
    assert "tiny" not in str(raised.value)


def test_tokens_differ() -> None:
    for more in ({"view_token": "a-long-token"}, {"view_token": "another-one", "gaze_token": "another-one"}):
        with pytest.raises(SettingsError, match="differ"):
            Settings(token="a-long-token", **more)
