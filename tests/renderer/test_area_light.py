"""Lights with a size: closed forms of their light and of the edges of their shadows, and where they may be seen."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.display import Display
from renderer.frame import Frame, FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import (
    Light,
    Material,
    PointLight,
    RectangleError,
    RectangleLight,
    Rgb,
    Scene,
    Sphere,
    SphereLight,
    Surroundings,
)
from tests.renderer.drawing import BLACK, WHITE, WHITE_LAMBERT, U, aim, floor, light, mirror, quad

DOWN = Camera((0, 3, 0), (0, 0, 0), (0, 0, -1), 1e-3)
"""Looks straight down at the origin from 3 m: every pixel sees the same point."""


def expose(
    renderer: Renderer,
    scene: Scene,
    width: int = 16,
    height: int = 16,
    *,
    samples: int = 1,
    shadow_samples: int = 4,
    camera: Camera | None = None,
) -> Frame:
    """A linear frame, a cell a pixel."""
    quality = Quality(map="full", samples_per_cell=samples, shadow_samples=shadow_samples)
    return renderer.render(
        prepare(scene), FrameRequest(Gaze(0, 0), Display(width, height), camera, quality, linear=True)
    )


def mean_and_error(frame: Frame) -> tuple[float, float]:
    """Mean of the red channel over cells that see the same, and its standard error."""
    red = frame.pixels[..., 0].astype(np.float64)
    return float(red.mean()), float(red.std() / math.sqrt(red.size))


def assert_agrees(frame: Frame, truth: float, largest_error: float) -> None:
    """Within 4.5 standard errors, which are small: `largest_error` of the truth at most."""
    mean, error = mean_and_error(frame)
    assert error <= largest_error * truth
    assert mean == pytest.approx(truth, abs=4.5 * error + 4 * U * truth)


def panel(
    x: float, z: float, height: float, width: float = 1.0, depth: float = 1.0, radiance: float = 1.0, **more: bool
) -> RectangleLight:
    """A rectangle at a height whose middle is over (x, z), shining down."""
    return RectangleLight((x - width / 2, height, z - depth / 2), (width, 0, 0), (0, 0, depth), (radiance,) * 3, **more)


def ball(x: float, y: float, z: float, radius: float, radiance: float = 1.0) -> SphereLight:
    return SphereLight((x, y, z), radius, (radiance,) * 3)


def polygon_irradiance(corners: NDArray[np.float64], point: Rgb, normal: Rgb) -> float:
    """Irradiance for a radiance of 1 from a polygon that the point sees counter-clockwise (Lambert 1760)."""
    towards = np.asarray(corners, dtype=np.float64) - point
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(towards, np.roll(towards, -1, axis=0), strict=True):
        across = np.cross(a, b)
        total += math.atan2(np.linalg.norm(across), a @ b) * float(across @ normal) / np.linalg.norm(across)
    return abs(total) / 2


def panel_irradiance(x0: float, x1: float, z0: float, z1: float, height: float, point: Rgb = (0, 0, 0)) -> float:
    """The same for an upright view of a level rectangle."""
    corners = np.array([(x0, height, z0), (x1, height, z0), (x1, height, z1), (x0, height, z1)])
    return polygon_irradiance(corners, point, (0, 1, 0))


# closed forms


def test_the_formula_of_these_tests_is_the_form_factor_of_the_books() -> None:
    """A rectangle over its corner, parallel to the element (Howell, catalog of view factors, B-3)."""
    a, b = 2.0 / 1.5, 0.7 / 1.5
    p, q = math.hypot(1, a), math.hypot(1, b)
    factor = (a / p * math.atan(b / p) + b / q * math.atan(a / q)) / (2 * math.pi)
    assert panel_irradiance(0, 2.0, 0, 0.7, 1.5) == pytest.approx(math.pi * factor, rel=1e-12)


@pytest.mark.parametrize(
    ("x", "z", "height", "width", "depth"),
    [
        (0.0, 0.0, 1.0, 1.0, 1.0),
        (0.7, -0.4, 0.5, 2.0, 0.3),
        (3.0, 2.0, 0.5, 1.0, 1.0),
        (0.0, 0.0, 0.01, 4.0, 4.0),
        (0.0, 0.0, 1e-6, 4.0, 4.0),
        (0.3, 0.0, 80.0, 1.0, 1.0),
        (40.0, 0.0, 0.5, 1.0, 1.0),
    ],
)
def test_a_rectangle_over_a_plane(
    renderer: Renderer, x: float, z: float, height: float, width: float, depth: float
) -> None:
    """Near, far, wide, at a grazing angle, almost touching."""
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT, half=5),), lights=(panel(x, z, height, width, depth, 7.0),), exposure=1e9
    )
    truth = 7 / math.pi * panel_irradiance(x - width / 2, x + width / 2, z - depth / 2, z + depth / 2, height)
    below_the_light = dataclasses.replace(DOWN, position=(0, min(3.0, height / 2), 0))
    assert_agrees(expose(renderer, scene, 32, 32, shadow_samples=16, camera=below_the_light), truth, 0.005)


def test_a_tilted_rectangle_that_sinks_below_the_horizon(renderer: Renderer) -> None:
    """An upright one, half of it below the floor: what is above counts."""
    lamp = RectangleLight((1, -1, -1), (0, 0, 2), (0, 2, 0), (2.0,) * 3)
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(lamp,), camera=DOWN)
    above = np.array([(1, 0, -1), (1, 0, 1), (1, 1, 1), (1, 1, -1)], dtype=np.float64)
    truth = 2 / math.pi * polygon_irradiance(above, (0, 0, 0), (0, 1, 0))
    assert_agrees(expose(renderer, scene, 64, 64), truth, 0.01)


@pytest.mark.parametrize(
    ("center", "radius"),
    [
        ((0, 2, 0), 0.5),
        ((1, 2, -1), 1.0),
        ((0, 1.0, 0), 0.999),
        ((30, 40, 0), 3.0),
        ((0, 2, 0), 1e-7),
        ((0, 1e3, 0), 900),
    ],
)
def test_a_sphere_above_the_horizon(renderer: Renderer, center: Rgb, radius: float) -> None:
    """Irradiance pi L (R/d)^2 cos."""
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT),), lights=(SphereLight(center, radius, (3.0,) * 3),), camera=DOWN, exposure=1e12
    )
    scene = dataclasses.replace(scene, camera=dataclasses.replace(DOWN, position=(1e-3, 1e-4, 0)))
    distance = math.hypot(*center)
    truth = 3.0 * (radius / distance) ** 2 * center[1] / distance
    assert_agrees(expose(renderer, scene, 32, 32, shadow_samples=16), truth, 0.005)


@pytest.mark.parametrize("height", [-0.5, 0.0, 0.7])
def test_a_sphere_that_the_horizon_cuts(renderer: Renderer, height: float) -> None:
    """Against a quadrature over the cone: cosines above 0."""
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(ball(2, height, 0, 1.0),), camera=DOWN)
    distance = math.hypot(2, height)
    n = 1000
    cosine = 1 - (np.arange(n) + 0.5) / n * (1 - math.sqrt(1 - 1 / distance**2))
    turn = (np.arange(n) + 0.5) / n * 2 * math.pi
    sine = np.sqrt(1 - cosine * cosine)
    up = cosine[:, None] * height / distance + sine[:, None] * np.cos(turn) * 2 / distance
    truth = np.maximum(up, 0).mean() * 2 * (1 - math.sqrt(1 - 1 / distance**2))
    assert_agrees(expose(renderer, scene, 64, 64), truth, 0.02)


def test_a_highlight_of_a_rectangle_is_the_mean_of_those_of_its_points(renderer: Renderer) -> None:
    shiny = Material(diffuse=BLACK, specular=WHITE, shininess=20.0)
    scene = Scene(meshes=(floor(shiny),), lights=(panel(0.3, 0.2, 1.5),), camera=DOWN)
    n = 400
    x, z = np.meshgrid((np.arange(n) + 0.5) / n - 0.2, (np.arange(n) + 0.5) / n - 0.3)
    distance = np.sqrt(x * x + z * z + 1.5**2)
    truth = float(((1.5 / distance) ** 20 * 1.5 / distance**3).mean())
    assert_agrees(expose(renderer, scene, 64, 64), truth, 0.01)


# soft shadows

WIDTH, LIGHT_HEIGHT, EDGE_HEIGHT = 0.5, 2.0, 0.8
PENUMBRA = WIDTH * EDGE_HEIGHT / (LIGHT_HEIGHT - EDGE_HEIGHT)
"""Width of the soft edge under a straight edge, by similar triangles."""


def under_an_edge(renderer: Renderer, pixels: int, shadow_samples: int) -> tuple[NDArray[np.float64], Frame]:
    """A row across the shadow of a half-plane that covers x < 0: x of each pixel's middle, and what is seen."""
    roof = quad((-50, EDGE_HEIGHT, -50), (50, 0, 0), (0, 0, 100), WHITE_LAMBERT)
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT), roof),
        lights=(panel(0, 0, LIGHT_HEIGHT, WIDTH),),
        camera=Camera((0, 0.5, 0), (0, 0, 0), (0, 0, -1), math.degrees(2 * math.atan(0.3 / 0.5 / pixels))),
    )
    frame = expose(renderer, scene, pixels, 1, shadow_samples=shadow_samples)
    return (np.arange(pixels) + 0.5 - pixels / 2) / pixels * 0.6, frame


def test_the_penumbra_of_a_straight_edge_is_as_wide_as_similar_triangles_say(renderer: Renderer) -> None:
    x, frame = under_an_edge(renderer, 600, 256)
    unblocked = np.array([panel_irradiance(-WIDTH / 2, WIDTH / 2, -0.5, 0.5, LIGHT_HEIGHT, (at, 0, 0)) for at in x])
    seen = frame.pixels[0, :, 0] * math.pi / unblocked
    soft = x[(seen > 1e-9) & (seen < 1 - 1e-4)]
    pixel_width = 0.6 / 600
    assert soft.max() - soft.min() == pytest.approx(PENUMBRA, abs=4 * pixel_width)
    assert (soft.max() + soft.min()) / 2 == pytest.approx(0.0, abs=2 * pixel_width)


def test_the_profile_of_a_penumbra_is_that_of_the_part_of_the_light_that_is_seen(renderer: Renderer) -> None:
    x, frame = under_an_edge(renderer, 200, 1024)
    from_x = np.clip(-x * (LIGHT_HEIGHT - EDGE_HEIGHT) / EDGE_HEIGHT, -WIDTH / 2, WIDTH / 2)
    truth = np.array(
        [
            panel_irradiance(left, WIDTH / 2, -0.5, 0.5, LIGHT_HEIGHT, (at, 0, 0)) if left < WIDTH / 2 else 0.0
            for left, at in zip(from_x, x, strict=True)
        ]
    )
    np.testing.assert_allclose(frame.pixels[0, :, 0], truth / math.pi, atol=0.01 * truth.max() / math.pi)


@pytest.mark.parametrize("spread", [True, False])
def test_the_error_falls_faster_than_the_root_of_the_shadow_rays(renderer: Renderer, spread: bool) -> None:
    """From 4 to 256 rays by more than sqrt(64) = 8, whether one camera sample sends them all or each sends one."""
    roof = quad((-50, EDGE_HEIGHT, -50), (50, 0, 0), (0, 0, 100), WHITE_LAMBERT)
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT), roof),
        lights=(panel(0, 0, LIGHT_HEIGHT, WIDTH),),
        camera=dataclasses.replace(DOWN, position=(0.047, 0.5, 0), look_at=(0.047, 0, 0)),
    )
    errors = []
    for rays in (4, 256):
        frame = expose(renderer, scene, 32, 32, samples=rays if spread else 1, shadow_samples=rays)
        assert frame.cost.rays.shadow == 32 * 32 * rays
        errors.append(float(frame.pixels[..., 0].std()))
    assert errors[1] < errors[0] / 12


def test_stratification_beats_points_at_random(renderer: Renderer) -> None:
    """About half the light seen: 16 independent rays would leave an error of a quarter, its strata leave much less."""
    roof = quad((-50, EDGE_HEIGHT, -50), (50, 0, 0), (0, 0, 100), WHITE_LAMBERT)
    camera = dataclasses.replace(DOWN, position=(0.047, 0.5, 0), look_at=(0.047, 0, 0))
    scene = Scene(meshes=(floor(WHITE_LAMBERT), roof), lights=(panel(0, 0, LIGHT_HEIGHT, WIDTH),), camera=camera)
    seen = expose(renderer, scene, 32, 32, shadow_samples=16).pixels[..., 0]
    assert seen.std() < seen.mean() / 4 / 3


@pytest.mark.parametrize("radius", [0.05, 0.2, 0.35])
def test_a_ball_before_a_larger_sphere_of_light_leaves_a_ring(renderer: Renderer, radius: float) -> None:
    """pi L (sin^2 of the light's half angle - sin^2 of the ball's), both straight above."""
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT),),
        spheres=(Sphere((0, 1.5, 0), radius, WHITE_LAMBERT),),
        lights=(ball(0, 3, 0, 1.0),),
        camera=dataclasses.replace(DOWN, position=(0, 0.5, 0)),
    )
    truth = 1 / 9 - (radius / 1.5) ** 2
    assert_agrees(expose(renderer, scene, 48, 48, shadow_samples=16), truth, 0.01)


def test_a_ball_that_covers_the_light_leaves_nothing(renderer: Renderer) -> None:
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT),),
        spheres=(Sphere((0, 1.5, 0), 0.55, WHITE_LAMBERT),),
        lights=(ball(0, 3, 0, 1.0),),
        camera=dataclasses.replace(DOWN, position=(0, 0.5, 0)),
    )
    np.testing.assert_array_equal(expose(renderer, scene).pixels, 0.0)


# rays


@pytest.mark.parametrize(
    ("samples", "shadow_samples", "sent"),
    [(1, 4, 4), (4, 4, 1), (3, 4, 2), (8, 4, 1), (2, 64, 32), (1, 1, 1), (5, 6, 2)],
)
def test_the_shadow_rays_of_a_cell_are_spread_over_its_samples(
    renderer: Renderer, samples: int, shadow_samples: int, sent: int
) -> None:
    lights = (panel(0, 0, 1), ball(1, 2, 0, 0.5))
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=lights, camera=DOWN)
    cost = expose(renderer, scene, 8, 8, samples=samples, shadow_samples=shadow_samples).cost
    assert cost.effects == ("soft_shadows",)
    assert cost.rays.primary == 64 * samples
    assert cost.rays.shadow == 64 * samples * sent * len(lights)


def test_what_a_mirror_shows_sends_one_ray_a_sample(renderer: Renderer) -> None:
    """A floor of mirror below a matt ceiling."""
    ceiling = quad((-5, 3, -5), (10, 0, 0), (0, 0, 10), WHITE_LAMBERT)
    lamp = RectangleLight((1, 1, 0), (0, 0, 1), (1, 0, 0), (1.0,) * 3)
    camera = dataclasses.replace(DOWN, position=(0, 2, 0))
    scene = Scene(meshes=(floor(mirror()), ceiling), lights=(lamp,), camera=camera)
    cost = expose(renderer, scene, 8, 8, samples=2, shadow_samples=16).cost
    assert cost.rays.reflection == 64 * 2
    assert cost.rays.shadow == 64 * 2


@pytest.mark.parametrize("samples", [1, 4])
def test_each_sample_alone_is_unbiased(renderer: Renderer, samples: int) -> None:
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(panel(0.5, 0.2, 0.4, 2.0),), camera=DOWN)
    scene = dataclasses.replace(scene, camera=dataclasses.replace(DOWN, position=(0, 0.2, 0)))
    truth = panel_irradiance(-0.5, 1.5, -0.3, 0.7, 0.4) / math.pi
    assert_agrees(expose(renderer, scene, 96, 96, samples=samples, shadow_samples=1), truth, 0.01)


def test_a_light_without_shadows_sends_no_ray(renderer: Renderer) -> None:
    roof = quad((-50, EDGE_HEIGHT, -50), (50, 0, 0), (0, 0, 100), WHITE_LAMBERT)
    lamp = panel(0, 0, LIGHT_HEIGHT, casts_shadows=False)
    camera = dataclasses.replace(DOWN, position=(0, 0.5, 0))
    frame = expose(renderer, Scene(meshes=(floor(WHITE_LAMBERT), roof), lights=(lamp,), camera=camera), 32, 32)
    assert frame.cost.rays.shadow == 0
    assert frame.cost.effects == ()
    assert_agrees(frame, panel_irradiance(-0.5, 0.5, -0.5, 0.5, LIGHT_HEIGHT) / math.pi, 0.01)


def test_more_threads_change_no_bit(renderer: Renderer) -> None:
    lights = (panel(0, 0, 2, 2), ball(1, 1, 0, 0.3), light(0, 3, 1))
    scene = Scene(
        meshes=(floor(mirror(0.5)), floor(WHITE_LAMBERT, -1.0, 20.0)),
        spheres=(Sphere((0, 0.5, 0), 0.4, WHITE_LAMBERT),),
        lights=lights,
        camera=Camera((0, 2, 5), (0, 0, 0)),
    )
    seen = expose(renderer, scene, 48, 32, samples=3).pixels
    other = Renderer(threads=1)
    np.testing.assert_array_equal(expose(other, scene, 48, 32, samples=3).pixels, seen)
    other.close()
    assert (expose(renderer, scene, 48, 32, samples=3, shadow_samples=16).pixels != seen).any()


def test_a_frame_that_grows_ends_as_the_one_made_at_once(renderer: Renderer) -> None:
    scene = prepare(
        Scene(
            meshes=(floor(WHITE_LAMBERT),),
            spheres=(Sphere((0, 0.5, 0), 0.4, WHITE_LAMBERT),),
            lights=(panel(0, 0, 2, 2),),
            camera=Camera((0, 2, 5), (0, 0, 0)),
        )
    )
    quality = Quality(map="full", samples_per_cell=6, shadow_samples=16)
    last = FrameRequest(Gaze(0, 0), Display(32, 24), None, quality, linear=True)
    for samples in (1, 3, 4):
        renderer.render(scene, dataclasses.replace(last, samples=samples))
    grown = renderer.render(scene, last).pixels
    renderer.forget_samples()
    np.testing.assert_array_equal(grown, renderer.render(scene, last).pixels)


# what is seen of a light


def test_a_rectangle_is_seen_on_the_side_that_shines(renderer: Renderer) -> None:
    behind = Surroundings(zenith=(0.25,) * 3, horizon=(0.25,) * 3)
    for two_sided in (False, True):
        lamp = panel(0, 0, 1, radiance=3.0, two_sided=two_sided)
        scene = Scene(meshes=(floor(mirror(), half=0.1),), lights=(lamp,), surroundings=behind)
        below, above = (
            expose(renderer, scene, 1, 1, camera=aim((0.2, y, 0.2), (0.2, 1, 0.2))).pixels[0, 0, 0] for y in (-1, 3)
        )
        assert below == 3.0
        assert above == (3.0 if two_sided else 0.25)
        beside = expose(renderer, scene, 1, 1, camera=aim((0.6, -1, 0), (0.6, 1, 0))).pixels[0, 0, 0]
        assert beside == 0.25
        mirrored = expose(renderer, scene, 1, 1, camera=aim((0.05, 0.5, 0), (0.05, 0, 0))).pixels[0, 0, 0]
        assert mirrored == pytest.approx(3.0, rel=4 * U)


def test_a_sphere_is_seen_from_outside(renderer: Renderer) -> None:
    scene = Scene(lights=(ball(0, 0, 0, 1.0, 2.0),), surroundings=Surroundings(horizon=(0.5,) * 3, zenith=(0.5,) * 3))
    for at, seen in ((0.0, 2.0), (0.999, 2.0), (1.001, 0.5)):
        assert expose(renderer, scene, 1, 1, camera=aim((at, 0, 5), (at, 0, 0))).pixels[0, 0, 0] == seen
    assert expose(renderer, scene, 1, 1, camera=aim((0, 0, 0), (1, 0, 0))).pixels[0, 0, 0] == 0.5


@pytest.mark.parametrize("offset", [0.0, 1000.0])
def test_a_lamp_flush_with_the_ceiling_is_seen_and_lights_the_room(renderer: Renderer, offset: float) -> None:
    def box_of(lights: tuple[Light, ...], hole: bool) -> Scene:
        ceiling = () if hole else (quad((-5 + offset, 2, -5), (10, 0, 0), (0, 0, 10), WHITE_LAMBERT),)
        ground = quad((-5 + offset, 0, 5), (10, 0, 0), (0, 0, -10), WHITE_LAMBERT)
        return Scene(meshes=(ground, *ceiling), lights=lights)

    lamp = panel(offset, 0, 2, radiance=4.0)
    up = Camera((offset, 1, 0), (offset, 2, 0), (0, 0, 1), 40)
    np.testing.assert_array_equal(expose(renderer, box_of((lamp,), False), camera=up).pixels, 4.0)
    down = Camera((offset, 1, 0), (offset, 0, 0), (0, 0, 1), 60)
    lit, bare = (expose(renderer, box_of((lamp,), hole), camera=down).pixels for hole in (False, True))
    np.testing.assert_array_equal(lit, bare)


def test_the_shape_of_a_light_shades_nothing(renderer: Renderer) -> None:
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(0, 3, 0, 9.0),), camera=aim((1, 1, 0), (0, 0, 0)))
    lamps = (ball(0, 1.5, 0, 0.3, 0.1), panel(0, 0, 2, 2, 2, 0.1, two_sided=True))
    alone = expose(renderer, scene, 1, 1).pixels
    both = expose(renderer, dataclasses.replace(scene, lights=(*scene.lights, *lamps)), 1, 1).pixels
    assert both[0, 0, 0] > alone[0, 0, 0]


def test_inside_a_sphere_of_light_it_is_dark(renderer: Renderer) -> None:
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(ball(0, 0.5, 0, 1.0),), camera=aim((0, 0.5, 0), (0, 0, 0)))
    assert expose(renderer, scene, 1, 1).pixels[0, 0, 0] == 0.0


# whatever the place


@pytest.mark.parametrize("height", [0.0, 5e-324, 1e-300, 1e-160, 1e-30, 1e-17, 1e-12, 1e-9, 1e-7, 1e-5, -1e-9])
def test_a_light_that_touches_the_surface_is_finite(renderer: Renderer, height: float) -> None:
    """And no brighter than if it filled half the sky."""
    lamps: tuple[Light, ...] = (
        panel(0, 0, height),
        RectangleLight((0, height, 0), (0.5, 0, 0), (0, 0.5, 0), (1.0,) * 3, two_sided=True),
        ball(0, 0.5 + height, 0, 0.5),
        ball(0, height, 0, 1e-12),
    )
    for lamp in lamps:
        scene = Scene(meshes=(floor(WHITE_LAMBERT, casts_shadows=False),), lights=(lamp,))
        for place in ((1e-3, 1e-4, 1e-3), (0.6, 2.0, 0.1)):
            camera = Camera(place, (0, 0, 0), (0, 0, 1), 60)
            frame = expose(renderer, scene, 9, 9, samples=3, camera=camera)
            assert frame.cost.rejected_samples.total == 0
            assert np.isfinite(frame.pixels).all()
            assert (frame.pixels >= 0).all()
            assert np.median(frame.pixels) <= 2.0


coordinate = st.floats(-3, 3) | st.sampled_from([0.0, 1e-30, -1e-9, 1e6, -1e11])
size = st.floats(-15, 8).map(lambda power: 10.0**power)


@given(
    corner=st.tuples(coordinate, coordinate, coordinate),
    turn=st.floats(0, 7),
    tilt=st.floats(-2, 2),
    width=size,
    depth=size,
    two_sided=st.booleans(),
)
def test_any_light_is_finite(
    renderer: Renderer, corner: Rgb, turn: float, tilt: float, width: float, depth: float, two_sided: bool
) -> None:
    u = (width * math.cos(turn), 0.0, width * math.sin(turn))
    v = (
        -depth * math.sin(turn) * math.cos(tilt),
        depth * math.sin(tilt),
        depth * math.cos(turn) * math.cos(tilt),
    )
    lamps = (RectangleLight(corner, u, v, (9.0,) * 3, two_sided), SphereLight(corner, width, (5.0,) * 3))
    scene = Scene(
        meshes=(floor(Material(specular=(0.5,) * 3, reflection=(0.3,) * 3)),),
        spheres=(Sphere((0, 1, 0), 1.0, WHITE_LAMBERT),),
        lights=lamps,
        camera=Camera((0, 2, 6), (0, 0.5, 0)),
    )
    frame = expose(renderer, scene, 12, 9, samples=2)
    assert frame.cost.rejected_samples.total == 0
    assert np.isfinite(frame.pixels).all()
    assert (frame.pixels >= 0).all()
    assert frame.pixels.max() <= 9.0 * (1 + 0.5 * 2 * math.pi) * 3


@pytest.mark.parametrize(
    ("u", "v", "field"),
    [
        ((0, 0, 0), (0, 0, 1), "edge_u"),
        ((1, 0, 0), (0, 0, 0), "edge_v"),
        ((1, 0, 0), (1, 0, 1), "edge_v"),
        ((1, 0, 0), (2, 0, 0), "edge_v"),
    ],
)
def test_edges_that_make_no_rectangle_are_refused(u: Rgb, v: Rgb, field: str) -> None:
    with pytest.raises(RectangleError, match=rf"light\.{field}: expected an edge .*, found"):
        RectangleLight((0, 0, 0), u, v, WHITE)


def test_edges_that_are_nearly_at_right_angles_make_the_rectangle_they_mean(renderer: Renderer) -> None:
    lamp = RectangleLight((-0.5, 1, -0.5), (1, 0, 0), (5e-5, 0, 1), (1.0,) * 3)
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(lamp,))
    camera = dataclasses.replace(DOWN, position=(0, 0.5, 0))
    truth = panel_irradiance(-0.5, 0.5, -0.5, 0.5, 1) / math.pi
    assert_agrees(expose(renderer, scene, 32, 32, shadow_samples=16, camera=camera), truth, 0.01)


def test_a_sphere_keeps_its_light_from_any_distance(renderer: Renderer) -> None:
    """The same half angle, from a metre to a million kilometres."""
    seen = []
    for distance in (1.0, 1e3, 1e6, 1e9):
        lamps: tuple[Light, ...] = (ball(0, distance, 0, 0.01 * distance, 1e3),)
        scene = Scene(
            meshes=(floor(WHITE_LAMBERT),), lights=lamps, camera=dataclasses.replace(DOWN, position=(0, 0.5, 0))
        )
        seen.append(mean_and_error(expose(renderer, scene))[0])
    np.testing.assert_allclose(seen, 1e3 * 0.01**2, rtol=1e-4)


def test_point_lights_stay_as_they_are_beside_lights_with_a_size(renderer: Renderer) -> None:
    """Both kinds add up."""
    around: tuple[PointLight, SphereLight] = (light(1, 2, 0, 5.0), ball(-1, 2, 0, 1e-4, 1e6))
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), camera=DOWN)
    one, other, both = (
        expose(renderer, dataclasses.replace(scene, lights=lights), 1, 1).pixels[0, 0, 0]
        for lights in ((around[0],), (around[1],), around)
    )
    assert both == pytest.approx(one + other, rel=4 * U)
