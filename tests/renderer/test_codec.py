"""Pictures survive the codec; images in every pixel format give the right colours; damage gives one clear error."""

from __future__ import annotations

import io
import subprocess
import sys
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image, JpegImagePlugin

from renderer.codec import CONTENT_TYPE, FORMATS, decode_texture, encode
from renderer.errors import SceneError, SettingsError

PICTURES = arrays(np.uint8, st.tuples(st.integers(1, 12), st.integers(1, 12), st.just(3)))


def saved(image: Image.Image, image_format: str, **options: object) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, image_format, **options)
    return buffer.getvalue()


def gradient(height: int = 32, width: int = 48) -> np.ndarray:
    y, x = np.mgrid[0:height, 0:width]
    return np.stack([x * 5, y * 7, (x + y) * 3], axis=-1).astype(np.uint8)


@given(PICTURES)
def test_png_is_lossless(pixels: np.ndarray) -> None:
    np.testing.assert_array_equal(decode_texture(encode(pixels, "png"), "picture").pixels, pixels)


@given(arrays(np.float32, st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(3))))
def test_raw_is_the_floats_themselves(pixels: np.ndarray) -> None:
    found = np.frombuffer(encode(pixels, "raw"), dtype="<f4").reshape(pixels.shape)
    np.testing.assert_array_equal(found.view(np.uint32), pixels.view(np.uint32))


@pytest.mark.parametrize(("image_format", "tolerance"), [("jpeg", 6.0), ("webp", 6.0)])
def test_lossy_formats_stay_close(image_format: str, tolerance: float) -> None:
    pixels = gradient()
    decoded = decode_texture(encode(pixels, image_format, 95), "picture").pixels
    assert np.abs(decoded.astype(float) - pixels).mean() < tolerance


def test_lower_quality_is_smaller() -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    for image_format in ("jpeg", "webp"):
        assert len(encode(pixels, image_format, 20)) < len(encode(pixels, image_format, 95))


def test_pixels_that_are_not_contiguous_are_encoded_as_seen() -> None:
    pixels = gradient()[:, ::-1]
    np.testing.assert_array_equal(decode_texture(encode(pixels, "png"), "picture").pixels, pixels)


def test_every_format_has_a_content_type() -> None:
    assert set(CONTENT_TYPE) == set(FORMATS)


def test_encode_refuses_what_the_user_asks_wrong() -> None:
    with pytest.raises(SettingsError, match="format: expected one of png, jpeg, webp, raw, found 'bmp'"):
        encode(gradient(), "bmp")
    with pytest.raises(SettingsError, match="image_quality: expected an integer from 1 to 100, found 0"):
        encode(gradient(), "jpeg", 0)
    with pytest.raises(SettingsError, match="16383"):
        encode(np.zeros((1, 16_384, 3), dtype=np.uint8), "webp")


@pytest.mark.parametrize(
    ("pixels", "image_format"),
    [
        (np.zeros((4, 4), dtype=np.uint8), "png"),
        (np.zeros((4, 4, 4), dtype=np.uint8), "png"),
        (np.zeros((4, 4, 3), dtype=np.float32), "png"),
        (np.zeros((4, 4, 3), dtype=np.uint8), "raw"),
        (np.zeros((0, 4, 3), dtype=np.uint8), "png"),
    ],
)
def test_encode_refuses_our_own_mistakes(pixels: np.ndarray, image_format: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        encode(pixels, image_format)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (3, 5)])
def test_odd_sizes(size: tuple[int, int]) -> None:
    pixels = np.random.default_rng(2).integers(0, 256, (*size, 3), dtype=np.uint8)
    np.testing.assert_array_equal(decode_texture(saved(Image.fromarray(pixels), "png"), "t").pixels, pixels)


def test_grey_and_its_transparency() -> None:
    grey = np.array([[0, 100], [200, 255]], dtype=np.uint8)
    expected = np.repeat(grey[:, :, None], 3, axis=2)
    np.testing.assert_array_equal(decode_texture(saved(Image.fromarray(grey), "png"), "t").pixels, expected)
    with_alpha = Image.fromarray(np.dstack([grey, np.array([[0, 1], [128, 255]], dtype=np.uint8)]), "LA")
    np.testing.assert_array_equal(decode_texture(saved(with_alpha, "png"), "t").pixels, expected)


def test_transparency_keeps_its_colour() -> None:
    rgba = np.array([[[10, 20, 30, 0], [40, 50, 60, 255]]], dtype=np.uint8)
    found = decode_texture(saved(Image.fromarray(rgba), "png"), "t")
    np.testing.assert_array_equal(found.pixels, rgba[:, :, :3])
    np.testing.assert_array_equal(found.opacity, rgba[:, :, 3])


def test_an_image_that_is_whole_has_no_alpha() -> None:
    rgba = np.full((2, 2, 4), 255, dtype=np.uint8)
    assert decode_texture(saved(Image.fromarray(rgba), "png"), "t").alpha is None
    assert decode_texture(saved(Image.fromarray(rgba[:, :, :3]), "jpeg"), "t").alpha is None


@pytest.mark.parametrize("image_format", ["png", "tiff"])
def test_sixteen_bit_grey_is_rounded_not_clipped(image_format: str) -> None:
    grey = np.array([[0, 128, 129, 257], [32_768, 65_406, 65_407, 65_535]], dtype=np.uint16)
    found = decode_texture(saved(Image.fromarray(grey), image_format), "t").pixels
    expected = np.array([[0, 0, 1, 1], [128, 254, 255, 255]], dtype=np.uint8)
    np.testing.assert_array_equal(found, np.repeat(expected[:, :, None], 3, axis=2))


def png_chunk(kind: bytes, body: bytes) -> bytes:
    return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")


def test_sixteen_bit_colour() -> None:
    samples = np.array([[0, 0x7FFF, 0xFFFF]], dtype=">u2")
    header = (1).to_bytes(4, "big") * 2 + bytes([16, 2, 0, 0, 0])
    data = b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", header)
    data += png_chunk(b"IDAT", zlib.compress(b"\0" + samples.tobytes())) + png_chunk(b"IEND", b"")
    np.testing.assert_allclose(decode_texture(data, "t").pixels[0, 0].astype(int), [0, 127, 255], atol=1)


def test_palettes_with_and_without_transparency() -> None:
    palette = Image.new("P", (2, 1))
    palette.putpalette([255, 0, 0, 0, 0, 255])
    palette.putdata([0, 1])
    expected = [[[255, 0, 0], [0, 0, 255]]]
    for options in ({}, {"transparency": 1}, {"transparency": bytes([10, 200])}):
        np.testing.assert_array_equal(decode_texture(saved(palette, "png", **options), "t").pixels, expected)
    np.testing.assert_array_equal(decode_texture(saved(palette, "gif"), "t").pixels, expected)


def test_one_bit_and_cmyk() -> None:
    bits = Image.fromarray(np.array([[True, False]]))
    np.testing.assert_array_equal(decode_texture(saved(bits, "png"), "t").pixels, [[[255, 255, 255], [0, 0, 0]]])
    cmyk = Image.new("CMYK", (8, 8), (0, 255, 255, 0))
    red = decode_texture(saved(cmyk, "tiff"), "t").pixels[4, 4]
    assert red[0] > 230
    assert max(red[1:]) < 25


def test_pixels_cannot_be_changed_by_accident() -> None:
    with pytest.raises(ValueError, match="read-only"):
        decode_texture(encode(gradient(), "png"), "t").pixels[0, 0, 0] = 1


def test_empty_foreign_and_floating_images_are_refused_by_name() -> None:
    floating = saved(Image.fromarray(np.ones((2, 2), dtype=np.float32)), "tiff")
    for data, found in ((b"", "an empty file"), (b"no image at all", "something else"), (floating, "floating-point")):
        with pytest.raises(SceneError, match=rf"^wood\.png: expected .*found {found}"):
            decode_texture(data, "wood.png")


def test_postscript_never_runs() -> None:
    with pytest.raises(SceneError, match="something else"):
        decode_texture(saved(Image.new("RGB", (4, 4)), "eps"), "page.eps")


def test_a_bomb_is_refused_before_it_is_unpacked() -> None:
    header = (60_000).to_bytes(4, "big") * 2 + bytes([8, 2, 0, 0, 0])
    bomb = b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", header) + png_chunk(b"IDAT", zlib.compress(b"\0" * 1000))
    with pytest.raises(SceneError, match=r"bomb\.png: expected 1 to 67108864 pixels, found 60000 x 60000"):
        decode_texture(bomb, "bomb.png")
    with pytest.raises(SceneError, match="found 48 x 32"):
        decode_texture(encode(gradient(), "png"), "t", max_pixels=1000)


@pytest.mark.parametrize("image_format", ["png", "jpeg", "webp", "tiff", "gif", "bmp", "tga", "ppm", "pcx"])
def test_damage_is_a_texture_or_a_scene_error(image_format: str) -> None:
    good = saved(Image.fromarray(gradient()), image_format)
    generator = np.random.default_rng(3)
    damaged = [good[: len(good) * i // 40] for i in range(40)]
    for _ in range(150):
        data = bytearray(good)
        for at in generator.integers(0, len(data), 3):
            data[at] = generator.integers(0, 256)
        damaged.append(bytes(data))
    messages = []
    for data in damaged:
        try:
            decode_texture(data, "t", max_pixels=1 << 20)
        except SceneError as error:
            messages.append(str(error))
    assert len(messages) > 10
    assert all(message.startswith("t: expected") and "\n" not in message for message in messages)


def test_warnings_of_the_image_library_become_errors_outside_tests_too() -> None:
    script = """
import io, sys, warnings
from PIL import Image, JpegImagePlugin
from renderer.codec import decode_texture
from renderer.errors import SceneError
buffer = io.BytesIO()
Image.new("RGB", (4, 4), (1, 2, 3)).save(buffer, "tiff")
data = bytearray(buffer.getvalue())
outcomes = set()
for at in range(len(data)):
    for value in (0, 255):
        changed = data.copy()
        changed[at] = value
        try:
            decode_texture(bytes(changed), "t", max_pixels=1 << 16)
            outcomes.add("texture")
        except SceneError as error:
            outcomes.add("warned" if isinstance(error.__cause__, Warning) else "error")
print(sorted(outcomes))
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert run.stdout.strip() == "['error', 'texture', 'warned']"
    assert run.stderr == ""


@pytest.mark.parametrize(("quality", "sampling"), [(100, 0), (90, 0), (89, 2), (75, 2)])
def test_jpeg_keeps_all_colour_at_high_quality(quality: int, sampling: int) -> None:
    with Image.open(io.BytesIO(encode(gradient(), "jpeg", quality))) as image:
        assert JpegImagePlugin.get_sampling(image) == sampling
