"""Scenes and cells over the wire."""

from __future__ import annotations

import math

import httpx
import numpy as np
import pytest

from renderer.codec import decode_texture
from renderer.scenes import BUILT_IN
from service.settings import Settings
from tests.service.conftest import BROKEN_SCENE, serving

GAZE = {"gaze_x": 300, "gaze_y": 170, "width_px": 640, "height_px": 360, "acuity_scale": 6}


def test_all_scenes_are_listed_the_broken_one_with_its_error(client: httpx.Client) -> None:
    scenes = {scene["id"]: scene for scene in client.get("/v1/scenes").json()["scenes"]}
    assert set(scenes) == {*BUILT_IN, BROKEN_SCENE}
    assert "scene.toml" in scenes[BROKEN_SCENE]["error"]
    for scene_id in BUILT_IN:
        scene = scenes[scene_id]
        assert "error" not in scene
        assert scene["title"]
        assert scene["triangles"] + scene["spheres"] > 0
    assert scenes["matte"]["effects"] == []
    assert {"reflection", "refraction", "shadows"} <= set(scenes["spheres"]["effects"])
    assert scenes["atrium"]["triangles"] >= 300_000


def test_scenes_are_named_without_being_loaded(address: str) -> None:
    with serving(Settings(port=0, scene_bytes=0), ready=False) as fresh:
        scenes = httpx.get(f"{fresh}/v1/scenes", params={"details": "false"}).json()["scenes"]
    assert scenes == [{"id": scene_id} for scene_id in BUILT_IN]


def test_a_scene_tells_what_it_holds_and_calls_for(client: httpx.Client) -> None:
    scene = client.get("/v1/scenes/spheres").json()
    assert scene["id"] == "spheres"
    assert scene["spheres"] >= 2
    assert scene["lights"] >= 1
    assert all(effect["name"] and effect["reason"] for effect in scene["effects"])
    camera = scene["camera"]
    assert set(camera) == {"position", "look_at", "up", "vertical_fov_deg"}
    stated = {"scene": "spheres", "gaze": {"x": 1, "y": 2}, "display": {"width_px": 64, "height_px": 36}}
    with_camera = client.post("/v1/render", json={**stated, "camera": camera})
    assert with_camera.content == client.post("/v1/render", json=stated).content


def test_cells_in_numbers(client: httpx.Client) -> None:
    counts = client.get("/v1/cellmap", params={**GAZE, "samples_per_cell": 8}).json()
    assert counts["pixels"] == 640 * 360
    assert len(counts["sides"]) > 3
    assert sum(side["cells"] for side in counts["sides"]) == counts["cells"]
    assert sum(side["pixels"] for side in counts["sides"]) == counts["pixels"]
    assert math.isclose(sum(side["share_of_pixels"] for side in counts["sides"]), 1)
    assert all(side["pixels"] == side["cells"] * side["side_px"] ** 2 for side in counts["sides"])
    assert [side["side_px"] for side in counts["sides"]] == sorted(side["side_px"] for side in counts["sides"])
    assert counts["camera_rays"] == 8 * counts["cells"]
    assert counts["camera_rays_full"] == 8 * counts["pixels"]
    assert math.isclose(counts["share"], counts["cells"] / counts["pixels"])
    assert client.get("/v1/cellmap", params={**GAZE, "samples_per_cell": 8}).json()["cached"]


def test_the_full_map_has_a_cell_a_pixel(client: httpx.Client) -> None:
    counts = client.get("/v1/cellmap", params={**GAZE, "map": "full"}).json()
    assert (counts["cells"], counts["share"]) == (counts["pixels"], 1)
    assert [side["side_px"] for side in counts["sides"]] == [1]


def test_a_cell_map_is_what_a_frame_is_made_of(client: httpx.Client) -> None:
    counts = client.get("/v1/cellmap", params=GAZE).json()
    frame = client.get("/v1/scenes/matte/frame", params={**GAZE, "samples_per_cell": 1})
    assert f'"cells":{counts["cells"]},' in frame.headers["gazetrace-frame"]


@pytest.mark.parametrize(
    ("query", "accept", "media_type"),
    [
        ({}, "*/*", "application/json"),
        ({}, "application/json", "application/json"),
        ({}, "image/png", "image/png"),
        ({}, "image/avif,image/webp,image/png,*/*;q=0.8", "image/png"),
        ({}, "application/json, image/png;q=0.5", "application/json"),
        ({"format": "png"}, "application/json", "image/png"),
        ({"format": "json"}, "image/png", "application/json"),
    ],
)
def test_numbers_or_a_picture(client: httpx.Client, query: dict[str, str], accept: str, media_type: str) -> None:
    reply = client.get("/v1/cellmap", params={**GAZE, **query}, headers={"Accept": accept})
    assert reply.status_code == 200
    assert reply.headers["content-type"] == media_type
    assert reply.headers["vary"] == "Accept"


def test_the_drawing_shows_fine_cells_at_the_gaze_and_outlined_ones_far_away(client: httpx.Client) -> None:
    corner = {**GAZE, "gaze_x": 0, "gaze_y": 0, "acuity_scale": 4, "format": "png"}
    drawn = decode_texture(client.get("/v1/cellmap", params=corner).content, "reply").pixels.astype(int)
    assert drawn.shape == (360, 640, 3)
    far = drawn[-60:, -60:]
    assert len(np.unique(far.reshape(-1, 3), axis=0)) >= 2
    assert not np.array_equal(drawn[2, 2], drawn[-3, -3])
    rays = decode_texture(client.get("/v1/cellmap", params={**corner, "drawing": "rays"}).content, "reply").pixels
    assert rays[2, 2].sum() > rays[-3, -3].sum() + 50, "brighter where there are more"
