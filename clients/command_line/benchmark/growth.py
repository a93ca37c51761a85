"""How the time of a frame grows with pixels, triangles, lights and depth."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from clients.command_line.benchmark.fit import PowerLaw, fitted_power_law
from clients.command_line.benchmark.growth_scenes import hills, room_of_mirrors
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality

SCREENS: Final = ((960, 540), (1920, 1080), (3840, 2160), (5400, 3900))
"""0.5 to 21 million pixels."""

TRIANGLES: Final = (1_000, 10_000, 100_000, 1_000_000)
MANY_TRIANGLES: Final = 10_000_000
LIGHTS: Final = (1, 2, 4, 8, 16, 32)
LIT_TRIANGLES: Final = 10_000
DEPTHS: Final = (0, 1, 2, 4, 8, 16, 32)

SCREEN_CM: Final = (50.0, 35.0)
SCREEN: Final = (960, 540)
"""Of all series but those of pixels."""

FULL: Final = Quality(map="full", samples_per_cell=1)
GAZE_DEPENDENT: Final = Quality(samples_per_cell=1)


@dataclass(frozen=True, slots=True)
class Point:
    """One size of a thing.

    Attributes:
        x: the size.
        rays: traced for the frame.
        ms, low, high: time of tracing and reconstruction, over the repeats [ms].
    """

    x: float
    rays: int
    ms: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Series:
    """The times of one frame that differs in one size.

    Attributes:
        name: of the series.
        x_label: what the size is.
        points: by size.
        time: the fitted law of the time by size.
        time_of_rays: the fitted exponent of the time by rays; None where these do not change.
        note: what the frame shows.
    """

    name: str
    x_label: str
    points: tuple[Point, ...]
    time: PowerLaw
    time_of_rays: float | None
    note: str


@dataclass(frozen=True, slots=True)
class _Plan:
    """A series to be measured: the scene and the request of each size."""

    name: str
    x_label: str
    frames: tuple[tuple[float, Callable[[], PreparedScene], FrameRequest], ...]
    note: str


def steps(most_triangles: int, repeats: int) -> int:
    """How often `measure_growth` calls `tick`."""
    sizes = 2 * len(SCREENS) + len(_triangles(most_triangles)) + len(LIGHTS) + len(DEPTHS)
    return (repeats + 1) * sizes


def measure_growth(
    renderer: Renderer,
    prepared: PreparedScene,
    most_triangles: int,
    repeats: int,
    tick: Callable[[], None],
) -> Iterator[Series]:
    """Time frames of all sizes, the sizes of a series in turn.

    Args:
        renderer: its caches are emptied.
        prepared: the scene shown on screens of more and more pixels.
        most_triangles: 1,000 or more.
        repeats: how often each frame is timed, 1 or more.
        tick: called after each frame.
    """
    for plan in _plans(prepared, most_triangles):
        yield _measured(renderer, plan, repeats, tick)


def _plans(prepared: PreparedScene, most_triangles: int) -> Iterator[_Plan]:
    def always(scene: PreparedScene) -> Callable[[], PreparedScene]:
        return lambda: scene

    shown = always(prepared)
    for name, quality, note in (
        ("pixels, full", FULL, "every pixel a cell"),
        ("pixels, gaze-dependent", GAZE_DEPENDENT, "aligned cells, the gaze at the centre"),
    ):
        frames = tuple((float(width * height), shown, _request((width, height), quality)) for width, height in SCREENS)
        yield _Plan(name, "pixels", frames, note)

    def hilly(triangles: int) -> Callable[[], PreparedScene]:
        return lambda: prepare(hills(triangles))

    numbers = _triangles(most_triangles)
    frames = tuple((float(number), hilly(number), _request(SCREEN, FULL)) for number in numbers)
    yield _Plan("triangles", "triangles", frames, "hills, one light with shadows")
    lit = [(float(lights), always(prepare(hills(LIT_TRIANGLES, lights)))) for lights in LIGHTS]
    frames = tuple((lights, scene, _request(SCREEN, FULL)) for lights, scene in lit)
    yield _Plan("lights", "point lights with shadows", frames, "the same hills")
    room = always(prepare(room_of_mirrors()))
    frames = tuple((depth + 1.0, room, _request(SCREEN, replace(FULL, max_depth=depth))) for depth in DEPTHS)
    yield _Plan("depth", "depth + 1", frames, "a room of mirrors")


def _triangles(most: int) -> tuple[int, ...]:
    return tuple(number for number in (*TRIANGLES, MANY_TRIANGLES) if number <= most)


def _request(screen: tuple[int, int], quality: Quality) -> FrameRequest:
    width_px, height_px = screen
    return FrameRequest(Gaze(width_px / 2, height_px / 2), Display(width_px, height_px, *SCREEN_CM), None, quality)


def _measured(renderer: Renderer, plan: _Plan, repeats: int, tick: Callable[[], None]) -> Series:
    frames = [(x, make(), request) for x, make, request in plan.frames]
    times: list[list[float]] = [[] for _ in frames]
    rays = [0] * len(frames)
    for repeat in range(repeats + 1):  # the first is not timed: pages of memory are new to it
        for number, (_, scene, request) in enumerate(frames):
            renderer.forget_samples()
            cost = renderer.render(scene, request).cost
            rays[number] = cost.rays.total
            if repeat > 0:
                times[number].append(cost.time_ms.trace + cost.time_ms.reconstruct)
            tick()
    renderer.forget_samples()
    renderer.map_cache.clear()
    points = tuple(
        Point(x, count, statistics.median(series), min(series), max(series))
        for (x, _, _), count, series in zip(frames, rays, times, strict=True)
    )
    return Series(plan.name, plan.x_label, points, *_laws(points), plan.note)


def _laws(points: Sequence[Point]) -> tuple[PowerLaw, float | None]:
    """Time by size, and the exponent of time by rays where these grow at least twofold."""
    milliseconds = [point.ms for point in points]
    rays = [point.rays for point in points]
    time = fitted_power_law([point.x for point in points], milliseconds)
    if max(rays) < 2 * min(rays):
        return time, None
    return time, fitted_power_law(rays, milliseconds).exponent
