"""Scene files that would keep the parser busy are refused before it sees them; all others are read as they stand."""

from __future__ import annotations

import time
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.errors import SceneError
from renderer.toml_text import MAX_KEY_PARTS, MAX_TOML_BYTES, read_toml

SOON_S = 5.0
"""A hundredth of what the longest of the keys below takes the parser, and much more than a refusal does."""


def refused(text: str) -> str:
    with pytest.raises(SceneError) as caught:
        read_toml(text.encode(), "scene.toml")
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("part", ["a", '"a"', "'a b'", "a-1 ", "\ta", "1"])
@pytest.mark.parametrize("around", ["{} = 1", "[{}]", "[[{}]]", "x = {{ {} = 1 }}"])
def test_a_key_without_end_is_refused_at_once(part: str, around: str) -> None:
    began = time.process_time()
    text = "title = 'fine'\n" + around.format(".".join([part] * 200_000))
    expected = f"scene.toml: line 2: expected keys of at most {MAX_KEY_PARTS} parts, found more"
    assert refused(text) == expected
    assert time.process_time() - began < SOON_S


@pytest.mark.parametrize("text", ["x" * 1_000_000, '"' * 1_000_000, "x = " + "[" * 100_000, "x = " + "{a=" * 100_000])
def test_other_nonsense_takes_no_time_either(text: str) -> None:
    began = time.process_time()
    assert refused(text).startswith("scene.toml: expected TOML, found a mistake: ")
    assert time.process_time() - began < SOON_S


def test_a_file_of_more_bytes_than_any_scene_is_refused() -> None:
    assert read_toml(b"#" * MAX_TOML_BYTES, "scene.toml") == {}
    assert refused("#" * (MAX_TOML_BYTES + 1)) == (
        f"scene.toml: expected at most {MAX_TOML_BYTES} bytes, found {MAX_TOML_BYTES + 1} bytes"
    )


@pytest.mark.parametrize(
    "text",
    [
        ".".join("a" * MAX_KEY_PARTS) + " = 1",
        f"x = [{', '.join(['1.5'] * 100)}]",
        "title = 'one. two. three. four. five. six. seven... and so on, to the end.'",
        "x = '" + "../" * 50 + "a.obj'",
    ],
)
def test_what_a_scene_may_hold_is_read_as_it_stands(text: str) -> None:
    assert read_toml(text.encode(), "scene.toml") == tomllib.loads(text)


@given(st.text(st.sampled_from("ab1.[]{}='\"\n,- #\\"), max_size=40))
def test_short_text_is_never_refused_for_its_keys(text: str) -> None:
    try:
        expected = tomllib.loads(text)
    except ValueError:
        assert "expected TOML, found a mistake" in refused(text)
    else:
        assert read_toml(text.encode(), "scene.toml") == expected
