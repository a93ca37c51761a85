"""Camera paths: through every view at its time, smoothly, and even where the views are even."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.camera import Camera
from renderer.camera_path import CameraPath, Keyframe, orbited
from renderer.errors import SceneError, SettingsError
from renderer.scene_file import load_scene_folder

coordinates = st.floats(-50, 50)
points = st.tuples(coordinates, coordinates, coordinates)


@st.composite
def paths(draw: st.DrawFn, least: int = 1) -> CameraPath:
    """Paths high above what they look at, so that no course between two views looks along `up`."""
    gaps = draw(st.lists(st.floats(0.05, 20), min_size=least, max_size=6))
    times = np.cumsum(gaps) - gaps[0]
    return CameraPath(
        tuple(
            Keyframe(
                float(time),
                Camera(
                    (draw(coordinates), 1e5 + draw(coordinates), 0.0),
                    (draw(coordinates), 0.0, draw(coordinates)),
                    (1.0, 0.0, draw(st.floats(-0.1, 0.1))),
                    draw(st.floats(20, 90)),
                ),
            )
            for time in times
        )
    )


def position(path: CameraPath, seconds: float) -> np.ndarray:
    return np.array(path.camera_at(seconds).position)


@given(paths())
def test_the_path_passes_through_every_view_and_rests_at_its_ends(path: CameraPath) -> None:
    for keyframe in path.keyframes:
        seen = path.camera_at(keyframe.time_s)
        for name in ("position", "look_at", "up", "vertical_fov_deg"):
            np.testing.assert_allclose(getattr(seen, name), getattr(keyframe.camera, name), rtol=1e-9, atol=1e-6)
    assert path.camera_at(-1.0) is path.keyframes[0].camera
    assert path.camera_at(path.keyframes[-1].time_s + 1e3) is path.keyframes[-1].camera


@given(paths(least=3), st.data())
def test_the_velocity_does_not_jump_at_a_view(path: CameraPath, data: st.DataObject) -> None:
    """The difference of the two one-sided velocities vanishes with the step they are taken over."""
    keyframe = data.draw(st.sampled_from(path.keyframes[1:-1]))
    at = keyframe.time_s

    def jump(step: float) -> float:
        here = position(path, at)
        before, after = (here - position(path, at - step)) / step, (position(path, at + step) - here) / step
        return float(np.linalg.norm(after - before))

    assert jump(1e-4) <= 0.2 * jump(1e-2) + 1e-3


@given(points, points, st.lists(st.floats(0.05, 20), min_size=2, max_size=6), st.floats(0, 1))
def test_even_motion_stays_even(
    start: tuple[float, ...], velocity: tuple[float, ...], gaps: list[float], share: float
) -> None:
    times = np.cumsum(gaps) - gaps[0]

    def along(time: float) -> Camera:
        x, y, z = np.array(start) + np.array(velocity) * time
        return Camera((float(x), float(y), float(z)), (float(x), float(y), float(z) - 1.0))

    path = CameraPath(tuple(Keyframe(float(time), along(time)) for time in times))
    now = share * float(times[-1])
    np.testing.assert_allclose(position(path, now), along(now).position, atol=1e-7)


def test_a_zoom_stays_between_its_ends() -> None:
    path = CameraPath(tuple(Keyframe(float(i), Camera(vertical_fov_deg=fov)) for i, fov in enumerate((60.0, 15.0))))
    fields_of_view = [path.camera_at(seconds).vertical_fov_deg for seconds in np.linspace(0, 1, 20)]
    assert (np.diff(fields_of_view) < 0).all()
    sizes = np.log(np.tan(np.radians(fields_of_view) / 2))
    np.testing.assert_allclose(np.diff(sizes), np.diff(sizes)[0], rtol=1e-9, err_msg="the picture grows evenly")


def test_a_course_through_what_it_looks_at_is_said_with_its_time() -> None:
    ahead, behind = Camera((0, 0, 1), (0, 0, 0)), Camera((0, 0, -1), (0, 0, 0))
    with pytest.raises(SettingsError, match=r"camera_path at 0\.5 s: camera\.look_at: expected a point away from"):
        CameraPath((Keyframe(0.0, ahead), Keyframe(1.0, behind))).camera_at(0.5)


@pytest.mark.parametrize("time_s", [0.0, -1.0, float("nan")])
def test_views_have_to_follow_each_other(time_s: float) -> None:
    with pytest.raises(SettingsError, match=r"time_s"):
        CameraPath((Keyframe(0.0, Camera()), Keyframe(time_s, Camera())))
    with pytest.raises(SettingsError, match="at least one keyframe"):
        CameraPath(())


def test_an_orbit_keeps_its_distance_height_and_target() -> None:
    camera = Camera((3, 2, 0), (1, 1, 1))
    for degrees in (0.0, 30.0, 90.0, 200.0):
        turned = orbited(camera, degrees)
        assert turned.look_at == camera.look_at
        assert turned.position[1] == pytest.approx(2)
        assert np.linalg.norm(np.subtract(turned.position, turned.look_at)) == pytest.approx(np.sqrt(6))
    np.testing.assert_allclose(orbited(camera, 90).position, (0, 2, -1), atol=1e-12)
    np.testing.assert_allclose(orbited(orbited(camera, 50), 310).position, camera.position, atol=1e-12)


SCENE = """\
[[sphere]]
center = [0, 0, 0]
radius = 1
[[camera_path]]
time_s = 0
position = [0, 1, 5]
look_at = [0, 0, 0]
[[camera_path]]
time_s = 2.5
position = [5, 1, 0]
look_at = [0, 0, 0]
up = [0, 1, 0.1]
vertical_fov_deg = 25
"""


def test_a_scene_file_may_hold_a_path(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    scene = load_scene_folder(tmp_path)
    assert scene.camera_path == CameraPath(
        (
            Keyframe(0.0, Camera((0, 1, 5), (0, 0, 0))),
            Keyframe(2.5, Camera((5, 1, 0), (0, 0, 0), (0, 1, 0.1), 25.0)),
        )
    )
    assert scene.camera == scene.camera_path.keyframes[0].camera
    (tmp_path / "scene.toml").write_text(SCENE.split("[[camera_path]]")[0])
    assert load_scene_folder(tmp_path).camera_path is None


@pytest.mark.parametrize(
    ("good", "bad", "complaint"),
    [
        ("time_s = 2.5", "time_s = 0", "camera_path[1].time_s: expected a time after 0, found 0.0"),
        ("time_s = 2.5", "", "camera_path[1].time_s: expected a number, found nothing"),
        ("time_s = 0", "time_s = -1", "camera_path[0].time_s: expected a number in [0, 1e+06], found -1"),
        ("position = [5, 1, 0]", "position = [0, 0, 0]", "camera_path[1].look_at: expected a point away from camera"),
        ("position = [5, 1, 0]", "position = [5, 1]", "camera_path[1].position: expected 3 numbers, found [5, 1]"),
        ("up = [0, 1, 0.1]", "up = [5, 1, 0]", "camera_path[1].up: expected a direction that is not along the view"),
        ("vertical_fov_deg = 25", "vertical_fov_deg = 180", "camera_path[1].vertical_fov_deg: expected a number in"),
        ("up = ", "upp = ", "camera_path[1].upp: expected one of the fields look_at, position, time_s, up,"),
    ],
)
def test_a_broken_path_is_one_line_naming_the_field(good: str, bad: str, complaint: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.replace(good, bad))
    with pytest.raises(SceneError, match=re.escape(f"scene.toml: {complaint}")):
        load_scene_folder(tmp_path)
