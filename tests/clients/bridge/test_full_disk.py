"""A disk that fills up under a recording: gaze goes on, and the recording holds what came before."""

from __future__ import annotations

from pathlib import Path

from clients.bridge.port import Chunk
from clients.bridge.recording import Recorder, read_recording
from tests.clients.bridge.running import listener, running
from tests.clients.bridge.terminal import Terminal
from tests.clients.bridge.test_daemon import START, config, looking, valid
from tests.small_disk import small_disk

DISK_BYTES = 64 << 10


def test_a_recording_ends_with_its_disk_and_takes_no_memory_for_the_rest(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk") as disk:
        recorder = Recorder(disk / "a.rec", {})
        chunks = [Chunk(bytes([index % 256]) * 1000, index, index == 0) for index in range(200)]
        while recorder.error is None:
            for chunk in chunks:
                recorder.keep(chunk)
        assert "No space left" in recorder.error
        waiting = recorder.waiting
        for chunk in chunks:
            recorder.keep(chunk)
        assert recorder.waiting == waiting
        recorder.close()
        kept = read_recording(disk / "a.rec").chunks
        assert sum(len(chunk.data) for chunk in kept) > DISK_BYTES / 2
        assert kept == chunks[: len(kept)]


def test_gaze_goes_on_when_the_disk_of_its_recording_is_full(terminal: Terminal, tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk") as disk, listener() as service:
        (disk / "filler").write_bytes(b"x" * (DISK_BYTES - 8 * 1024))
        file = disk / "a.rec"
        with running(config(terminal, service, record=file)) as found:
            terminal.read(len(START))
            with looking(terminal):
                found.log.until(lambda items: any("No space left" in item["text"] for item in items))
                before = len(valid(service.heard.items))
                service.heard.until(lambda items: len(valid(items)) > before + 100)
        assert found.ended() == 0
        assert read_recording(file).chunks
