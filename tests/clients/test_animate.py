"""`gazetrace animate`: its frames are those of `render`, and a clip that was stopped goes on."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clients.command_line import main
from clients.command_line.errors import UsageError
from clients.command_line.frame_folder import LOG, FrameFolder
from renderer.codec import decode_texture
from tests.clients.commands import failing, interrupted
from tests.small_disk import enlarge, small_disk

pytestmark = pytest.mark.usefixtures("plain_environment")

SCREEN = ("--size", "96x54", "--screen-cm", "20", "--samples", "2", "--acuity-scale", "8", "--bucket", "0")
EYE = "t_ms,x_px,y_px,valid\n0,20,10,1\n30,,,0\n70,60.5,40,1\n79,5,5,1\n80,-9,70,1\n100,48,27,1\n"
SHOWN = ["20,10", "20,10", "-9,70"]
"""Gaze at 0, 40 and 80 ms: the first, the one before the blink, the newest."""

LONG = ("matte", *SCREEN, "--gaze-trace", "simulated", "--seconds", "0.8")
"""More frames than a small disk holds."""

REC709_LUMA = np.array([0.2126, 0.7152, 0.0722])
"""Weights of red, green and blue in what a video keeps at full resolution."""

PATH_SCENE = """\
[[sphere]]
center = [0, 0, 0]
radius = 1
[[camera_path]]
time_s = 0
position = [0, 1, 5]
look_at = [0, 0, 0]
[[camera_path]]
time_s = 0.08
position = [1, 1, 4]
look_at = [0, 0, 0]
"""


@pytest.fixture(autouse=True)
def eye(plain_environment: None, tmp_path: Path) -> Path:
    path = tmp_path / "eye.csv"
    path.write_text(EYE)
    return path


def animate(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    """What the command prints as JSON."""
    assert main(["animate", *words, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def pictures(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.png"))}


def rendered(capsys: pytest.CaptureFixture[str], tmp_path: Path, *words: str) -> bytes:
    assert main(["render", *words, "-o", "one.png"]) == 0
    capsys.readouterr()
    return (tmp_path / "one.png").read_bytes()


def test_each_frame_is_the_one_that_render_makes(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    record = animate(capsys, "spheres", *SCREEN, "--gaze-trace", "eye.csv", "--overlay", "gaze", "-o", "clip/")
    frames = pictures(tmp_path / "clip")
    assert list(frames) == ["frame-00000.png", "frame-00001.png", "frame-00002.png"]
    for frame, gaze in zip(frames.values(), SHOWN, strict=True):
        assert frame == rendered(capsys, tmp_path, "spheres", *SCREEN, "--overlay", "gaze", "--gaze", gaze)
    assert (record["frames"], record["frames_rendered"], record["fps"], record["seconds"]) == (3, 3, 25.0, 0.12)
    assert (record["width"], record["height"], record["samples_per_cell"]) == (96, 54, 2)
    assert record["rays"]["primary"] == pytest.approx(3 * 2 * record["mean_cells_traced"], abs=1)
    assert 0 < record["mean_cells_traced"] < record["mean_cells"], "the second frame has nothing new"
    assert set(record["timing_ms"]) >= {"map", "trace", "reconstruct", "encode"}


def test_a_trace_in_fractions_and_one_of_another_screen_are_scaled(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "fractions.csv").write_text("t_s,x_fraction,y_fraction\n0,0.25,0.5\n")
    (tmp_path / "large.csv").write_text("t_s,x,y\n0,480,540\n")
    animate(capsys, "matte", *SCREEN, "--gaze-trace", "fractions.csv", "-o", "a")
    animate(capsys, "matte", *SCREEN, "--gaze-trace", "large.csv", "--trace-size", "1920x1080", "-o", "b/%d.png")
    expected = rendered(capsys, tmp_path, "matte", *SCREEN, "--gaze", "24,27")
    assert pictures(tmp_path / "a") == {"frame-00000.png": expected}
    assert pictures(tmp_path / "b") == {"0.png": expected}


def test_the_camera_follows_the_path_of_the_scene(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "ball").mkdir()
    (tmp_path / "ball" / "scene.toml").write_text(PATH_SCENE)
    animate(capsys, "ball", *SCREEN, "--gaze-trace", "eye.csv", "-o", "clip")
    frames = pictures(tmp_path / "clip")
    for frame, at in (("frame-00000.png", "0,1,5"), ("frame-00001.png", "0.5,1,4.5"), ("frame-00002.png", "1,1,4")):
        gaze = SHOWN[int(frame[10])]
        view = ("--camera-position", at, "--camera-look-at", "0,0,0")
        assert frames[frame] == rendered(capsys, tmp_path, "ball", *SCREEN, "--gaze", gaze, *view), frame
    animate(capsys, "ball", *SCREEN, "--gaze-trace", "eye.csv", "--camera-position", "0,1,5", "-o", "still")
    assert pictures(tmp_path / "still")["frame-00001.png"] == frames["frame-00000.png"], "a stated camera stays"
    animate(capsys, "ball", *SCREEN, "--gaze-trace", "eye.csv", "--orbit", "270", "-o", "orbit")
    turned = rendered(capsys, tmp_path, "ball", *SCREEN, "--gaze", SHOWN[2], "--camera-position", "0,1,-5")
    assert pictures(tmp_path / "orbit")["frame-00002.png"] == turned, "two thirds of 270 degrees"


def test_a_video_shows_every_frame_at_its_time(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="the extra 'video' is not installed")
    words = ("spheres", *SCREEN, "--gaze-trace", "simulated", "--seconds", "0.4", "--fps", "30000/1001")
    record = animate(capsys, *words, "-o", "clip.mp4")
    animate(capsys, *words, "-o", "pictures")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.mp4", "eye.csv", "pictures"]
    expected = [decode_texture(data, name).pixels for name, data in pictures(tmp_path / "pictures").items()]
    with av.open(str(tmp_path / "clip.mp4")) as container:
        (stream,) = container.streams
        assert (stream.codec_context.name, stream.pix_fmt) == ("h264", "yuv420p")
        shown = list(container.decode(stream))
    assert len(shown) == len(expected) == record["frames"] == 12
    assert [frame.time for frame in shown] == pytest.approx([index * 1001 / 30000 for index in range(12)])
    for frame, pixels in zip(shown, expected, strict=True):
        found = frame.to_ndarray(format="rgb24").astype(float)
        assert np.abs((found - pixels) @ REC709_LUMA).mean() < 3
        np.testing.assert_allclose(found.mean(axis=(0, 1)), pixels.mean(axis=(0, 1)), atol=2, err_msg="another colour")
    assert record["bytes"] == (tmp_path / "clip.mp4").stat().st_size


def test_an_interrupted_clip_goes_on(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """What is left of the first run: some frames, half a line of the log, a picture that is gone."""
    words = ("matte", *SCREEN, "--gaze-trace", "simulated", "--seconds", "0.4", "-o", "clip")
    whole = animate(capsys, *words)
    frames = pictures(tmp_path / "clip")
    log = tmp_path / "clip" / LOG
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:7]) + lines[7][:20])
    for frame in (4, 6, 8):
        (tmp_path / "clip" / f"frame-{frame:05d}.png").unlink()
    again = animate(capsys, *words)
    assert (whole["frames_rendered"], again["frames_rendered"]) == (10, 5)
    assert pictures(tmp_path / "clip") == frames
    third = animate(capsys, *words)
    assert third["frames_rendered"] == 0
    assert main(["animate", *words]) == 0
    said = capsys.readouterr()
    assert "10 frames of matte, 96x54, 0.4 s at 25 a second" in said.out
    assert "10 of them from an earlier run" in said.out
    assert said.err == ""


def test_ctrl_c_leaves_a_clip_that_goes_on(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Standard error is a terminal here: at least two frames are done when the progress says so."""
    words = ("spheres", *SCREEN, "--gaze-trace", "simulated", "--seconds", "60", "--orbit", "90", "-o", "clip")
    seen = interrupted(rb"\b([2-9]|\d\d+)/1500", "animate", *words)
    stopped = re.search(rb"stopped with (\d+) of 1500 frames; the same command goes on", seen)
    assert stopped is not None, seen
    assert 2 <= int(stopped[1]) < 1500
    assert len(pictures(tmp_path / "clip")) == int(stopped[1])
    lines = (tmp_path / "clip" / LOG).read_text().splitlines()
    assert [json.loads(line)["frame"] for line in lines[1:]] == list(range(int(stopped[1])))


def test_a_full_disk_is_one_line_and_what_was_finished_is_kept(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    whole = pictures_of(capsys, tmp_path / "elsewhere")
    with small_disk(tmp_path / "disk", "64k") as disk:
        for _ in range(2):
            said = failing(capsys, "animate", *LONG, "-o", "disk/clip", status=1)
            found = pictures(disk / "clip")
            told = re.fullmatch(
                rf"gazetrace: disk/clip/(frame-\d+.png|{LOG}): No space left on device; (\d+) .*\n", said
            )
            assert told is not None, said
            kept = int(told[2])
            assert kept == (disk / "clip" / LOG).read_bytes().count(b"\n") - 1
            assert kept <= len(found) <= kept + 1  # of the last one there may be no record; it is made again
            assert 0 < len(found) < len(whole)
            assert found.items() <= whole.items()
            assert {path.name for path in (disk / "clip").iterdir()} == {LOG, *found}
        enlarge(disk, "1m")
        assert animate(capsys, *LONG, "-o", "disk/clip")["frames_rendered"] == len(whole) - kept
        assert pictures(disk / "clip") == whole


def test_a_disk_full_under_the_video_keeps_its_frames(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pytest.importorskip("av")
    with small_disk(tmp_path / "disk", "1m") as disk:
        whole = pictures_of(capsys, disk / "clip.mp4.frames")
        room = os.statvfs(disk)
        (disk / "filler").write_bytes(b"x" * (room.f_bfree * room.f_bsize))
        said = failing(capsys, "animate", *LONG, "-o", "disk/clip.mp4", status=1)
        assert said.startswith(
            "gazetrace: disk/clip.mp4: No space left on device; all frames are kept in disk/clip.mp4."
        )
        assert {path.name for path in disk.iterdir()} == {"filler", "clip.mp4.frames"}
        assert pictures(disk / "clip.mp4.frames") == whole
        (disk / "filler").unlink()
        assert animate(capsys, *LONG, "-o", "disk/clip.mp4")["frames_rendered"] == 0
        assert {path.name for path in disk.iterdir()} == {"clip.mp4"}


def pictures_of(capsys: pytest.CaptureFixture[str], folder: Path) -> dict[str, bytes]:
    """All frames of the clip, in a folder."""
    animate(capsys, *LONG, "-o", f"{folder}/")
    return pictures(folder)


def test_another_request_starts_over_and_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ("matte", *SCREEN, "--gaze-trace", "eye.csv", "-o", "clip")
    animate(capsys, *words, "--fps", "50")
    (tmp_path / "clip" / "mine.png").write_bytes(b"mine")
    assert len(pictures(tmp_path / "clip")) == 6
    for change, name in (
        (("--max-depth", "2"), "quality"),
        (("--overlay", "roi"), "overlay"),
        (("--orbit", "9"), "camera"),
    ):
        assert main(["animate", *words, *change, "--json"]) == 0
        said = capsys.readouterr()
        assert json.loads(said.out)["frames_rendered"] == 3
        assert re.fullmatch(r"gazetrace: clip held frames of another request \([\w, ]+\): starting over\n", said.err)
        assert name in said.err
        assert sorted(pictures(tmp_path / "clip")) == [*(f"frame-0000{frame}.png" for frame in range(3)), "mine.png"]
    assert animate(capsys, *words, "--orbit", "9")["frames_rendered"] == 0


def test_a_changed_scene_is_another_request(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "ball").mkdir()
    for radius in ("1", "1.1"):
        (tmp_path / "ball" / "scene.toml").write_text(PATH_SCENE.replace("radius = 1", f"radius = {radius}"))
        record = animate(capsys, "ball", *SCREEN, "--gaze-trace", "eye.csv", "-o", "clip")
        assert record["frames_rendered"] == 3


def test_two_runs_never_share_a_folder(tmp_path: Path) -> None:
    with (
        FrameFolder(tmp_path / "clip", "%d.png", {"fps": "25"}) as first,
        pytest.raises(UsageError, match="clip: expected no other run at work there"),
        FrameFolder(tmp_path / "clip", "%d.png", {"fps": "25"}),
    ):
        pytest.fail("a second run began")
    first.remove()
    assert not (tmp_path / "clip").exists()


def test_a_log_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / LOG).write_text('{"level": "info"}\n')
    with pytest.raises(UsageError, match=r"frames\.jsonl: expected what an earlier run wrote there"):
        FrameFolder(tmp_path, "%d.png", {}).__enter__()
    assert (tmp_path / LOG).read_text() == '{"level": "info"}\n'


def test_a_clip_costs_less_than_its_frames_one_by_one(capsys: pytest.CaptureFixture[str]) -> None:
    """Samples of earlier frames are used again while the camera stays."""
    words = ("matte", *SCREEN, "--bucket", "0", "--acuity-scale", "4", "--gaze-trace", "simulated", "--seconds", "1")
    record = animate(capsys, *words, "-o", "clip")
    assert record["mean_cells_traced"] < 0.5 * record["mean_cells"]


FROM_EYE = ("--gaze-trace", "eye.csv")
EYE_TO_A = (*FROM_EYE, "-o", "a")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ((), "required: -o/--output, --gaze-trace"),
        (("-o", "a"), "required: --gaze-trace"),
        (("--gaze-trace", "none.csv", "-o", "a"), "--gaze-trace: expected a file or the word simulated, found no file"),
        (("--gaze-trace", "bad.csv", "-o", "a"), "bad.csv: line 2: x: expected a number, found 'x'"),
        ((*FROM_EYE, "--gaze", "1,2", "-o", "a"), "unrecognized arguments: --gaze 1,2"),
        ((*EYE_TO_A, "--seconds", "0"), "--seconds: expected a number in (0, 86400], found 0"),
        ((*EYE_TO_A, "--seconds", "nan"), "--seconds: expected a number in (0, 86400]"),
        ((*EYE_TO_A, "--seconds", "86400"), "--seconds: expected at most 100000 frames"),
        ((*EYE_TO_A, "--seed", "-1"), "--seed: expected an integer from 0 to"),
        ((*EYE_TO_A, "--trace-size", "0x4"), "--trace-size: expected sides of at least 1"),
        ((*EYE_TO_A, "--fps", "0"), "--fps: expected a number from 0.1 to 1000, found '0'"),
        ((*EYE_TO_A, "--fps", "1/0"), "--fps: expected a number from 0.1 to 1000"),
        ((*EYE_TO_A, "--orbit", "nan"), "--orbit: expected a number of degrees, found nan"),
        ((*FROM_EYE, "-o", "a.avi"), "--output: expected a video (.mp4, .m4v, .mkv, .mov), a folder, or"),
        ((*FROM_EYE, "-o", "a.png"), "--output: expected a video"),
        ((*FROM_EYE, "-o", "no/a.mp4"), "--output: expected a place in an existing folder"),
        ((*FROM_EYE, "-o", "eye.csv/%d.png"), "--output: expected room for a folder, found the file"),
        ((*FROM_EYE, "-o", "a.mp4", "--size", "65x36"), "--size: expected even sides for a video"),
    ],
)  # fmt: skip
def test_bad_usage_is_one_line_and_status_2(
    words: tuple[str, ...], complaint: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "bad.csv").write_text("t_ms,x,y\n0,x,0\n")
    before = sorted(tmp_path.iterdir())
    assert complaint in failing(capsys, "animate", "matte", *words)
    assert sorted(tmp_path.iterdir()) == before


def test_without_pyav_it_says_what_to_install(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    said = failing(capsys, "animate", "matte", "--gaze-trace", "eye.csv", "-o", "clip.mp4")
    assert "expected a folder, as videos need PyAV: pip install 'gazetrace[video]'" in said
