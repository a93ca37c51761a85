"""Effects forced on and off; contributions and lights that cannot be noticed."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.display import Display
from renderer.effect_choice import EFFECTS, read_effect_choice, require_effect_choice
from renderer.errors import SettingsError
from renderer.forced import with_effects
from renderer.frame import Frame, FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from renderer.scene import BLACK, Material, RectangleLight, Rgb, Scene, Sphere, Surroundings, Texture
from renderer.scenes import BUILT_IN
from tests.renderer.drawing import WHITE_LAMBERT, floor, glass, light, mirror

CHECKS = Texture(np.uint8([[[40] * 3, [255] * 3], [[255] * 3, [40] * 3]]), "checks")
BUMPS = Texture(np.uint8([[[90, 128, 220], [128, 150, 250]]]), "bumps")
TILES = Material("tiles", diffuse_texture=CHECKS, normal_texture=BUMPS)
SHINY = Material("shiny", diffuse=(0.3, 0.4, 0.5), specular=(0.6,) * 3)
LACE = dataclasses.replace(SHINY, alpha_texture=CHECKS)
PANEL = RectangleLight((-1, 3, -1), (2, 0, 0), (0, 0, 2), (2.0,) * 3)
KINDS = ("shadow", "reflection", "refraction")


def everything() -> Scene:
    """A scene that calls for all effects."""
    return Scene(
        meshes=(floor(TILES, -1.0),),
        spheres=(
            Sphere((-1.2, 0, 0), 0.8, glass()),
            Sphere((1.2, 0, 0), 0.8, mirror(0.7)),
            Sphere((0, -0.5, 1.5), 0.5, LACE),
        ),
        lights=(light(3, 4, 3, 40.0), PANEL),
        surroundings=Surroundings((0.2, 0.3, 0.5), (0.5, 0.5, 0.5), (0.1, 0.1, 0.1)),
        camera=Camera((0, 1, 6), (0, -0.3, 0)),
    )


def plain() -> Scene:
    """A scene that calls for none."""
    lights = (light(3, 4, 3, 40.0, casts_shadows=False), dataclasses.replace(PANEL, casts_shadows=False))
    return dataclasses.replace(
        everything(),
        meshes=(floor(WHITE_LAMBERT, -1.0, casts_shadows=False),),
        spheres=(Sphere((0, 0, 0), 1.0, WHITE_LAMBERT, casts_shadows=False),),
        lights=lights,
    )


@cache
def prepared_of(make: object) -> PreparedScene:
    assert callable(make)
    return prepare(make())


def see(
    renderer: Renderer,
    scene: Scene | PreparedScene,
    *effects: str,
    linear: bool = False,
    width: int = 48,
    anew: bool = True,
) -> Frame:
    if anew:
        renderer.forget_samples()
    quality = Quality(map="full", samples_per_cell=2, effects=effects)
    prepared = prepare(scene) if isinstance(scene, Scene) else scene
    display = Display(width, width * 3 // 4)
    return renderer.render(prepared, FrameRequest(Gaze(0, 0), display, None, quality, linear))


def without(scene: Scene, **changes: object) -> Scene:
    """The scene with fields of all its materials changed."""
    return dataclasses.replace(
        scene,
        meshes=tuple(
            dataclasses.replace(mesh, material=dataclasses.replace(mesh.material, **changes)) for mesh in scene.meshes
        ),
        spheres=tuple(
            dataclasses.replace(ball, material=dataclasses.replace(ball.material, **changes)) for ball in scene.spheres
        ),
    )


def test_the_two_scenes_call_for_all_and_for_nothing() -> None:
    assert prepared_of(everything).plan.names == EFFECTS
    assert prepared_of(plain).plan.names == ()


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_that_is_not_called_for_may_be_left_out(renderer: Renderer, effect: str) -> None:
    """Nor does one that is called for change by being forced on."""
    for make, word in ((plain, f"-{effect}"), (everything, f"+{effect}")):
        as_planned, forced = (see(renderer, prepared_of(make), *words) for words in ((), (word,)))
        np.testing.assert_array_equal(forced.pixels, as_planned.pixels)
        assert forced.cost.effects == as_planned.cost.effects
        if make is plain:
            assert forced.cost.rays == as_planned.cost.rays
            assert forced.cost.rays.total == forced.cost.rays.primary


@pytest.mark.parametrize("effect", ["textures", "normal_maps", "specular", "reflection", "refraction"])
def test_forced_on_where_nothing_calls_for_it_an_effect_brings_nothing_but_its_cost(
    renderer: Renderer, effect: str
) -> None:
    as_planned, forced = (see(renderer, prepared_of(plain), *words) for words in ((), (f"+{effect}",)))
    np.testing.assert_array_equal(forced.pixels, as_planned.pixels)
    assert forced.cost.effects == (effect,)
    assert forced.cost.effect_reasons == ("forced on",)
    hits = int((see(renderer, hit_mask(plain()), linear=True).pixels[..., 0] > 0).sum())
    if effect in ("reflection", "refraction"):
        assert getattr(forced.cost.rays, effect) > hits
        assert forced.cost.rays.total == forced.cost.rays.primary + getattr(forced.cost.rays, effect)
    else:
        assert forced.cost.rays == as_planned.cost.rays


def hit_mask(scene: Scene) -> Scene:
    """White where rays hit something, black elsewhere."""
    lit = without(scene, diffuse=BLACK, emission=(1.0,) * 3)
    return dataclasses.replace(lit, lights=(), surroundings=Surroundings())


def test_a_scene_with_effects_forced_shares_its_pictures_and_triangles() -> None:
    """Requests decide how many such there are, and the bound on scenes knows nothing of them."""
    prepared = prepare(everything())
    textures = prepared.surfaces.textures
    casting = [("+shadows",), ("+soft_shadows", "-textures"), ("+shadows", "+cutouts")]
    forced = [with_effects(prepared, choice) for choice in [("+textures",), ("+cutouts",), ("+normal_maps",), *casting]]
    assert all(variant.surfaces.textures is textures for variant in forced)
    assert all(variant.sieve is not None and variant.sieve.surfaces.textures is textures for variant in forced)
    first, *others = forced[-len(casting) :]
    assert all(variant.intersector is first.intersector for variant in others)


def test_every_effect_forced_on_traces_each_kind_of_ray(renderer: Renderer) -> None:
    words = tuple(f"+{effect}" for effect in EFFECTS)
    rays = see(renderer, prepared_of(plain), *words).cost.rays
    assert min(rays.shadow, rays.reflection, rays.refraction) > 48 * 36
    assert rays.reflection == rays.refraction


def test_shadows_forced_on_are_those_of_a_scene_where_all_cast_them(renderer: Renderer) -> None:
    quiet = plain()
    casting = dataclasses.replace(
        quiet,
        meshes=tuple(dataclasses.replace(mesh, casts_shadows=True) for mesh in quiet.meshes),
        spheres=tuple(dataclasses.replace(ball, casts_shadows=True) for ball in quiet.spheres),
        lights=tuple(dataclasses.replace(lamp, casts_shadows=True) for lamp in quiet.lights),
    )
    truth = see(renderer, casting, linear=True)
    forced = see(renderer, prepared_of(plain), "+shadows", "+soft_shadows", linear=True)
    np.testing.assert_array_equal(forced.pixels, truth.pixels)
    assert forced.cost.rays == truth.cost.rays
    assert forced.cost.effects == truth.cost.effects == ("shadows", "soft_shadows")


def test_an_effect_forced_off_leaves_the_scene_without_it(renderer: Renderer) -> None:
    scene = everything()
    quiet = {kind: tuple(dataclasses.replace(lamp, casts_shadows=False) for lamp in scene.lights) for kind in "ps"}
    others: dict[str, Scene] = {
        "textures": without(scene, diffuse_texture=None),
        "normal_maps": without(scene, normal_texture=None),
        "specular": without(scene, specular=BLACK),
        "shadows": dataclasses.replace(scene, lights=(quiet["p"][0], scene.lights[1])),
        "soft_shadows": dataclasses.replace(scene, lights=(scene.lights[0], quiet["s"][1])),
    }
    full = see(renderer, prepared_of(everything), linear=True)
    for effect, other in others.items():
        forced, truth = (
            see(renderer, prepared_of(everything), f"-{effect}", linear=True),
            see(renderer, other, linear=True),
        )
        np.testing.assert_array_equal(forced.pixels, truth.pixels, err_msg=effect)
        assert forced.cost.rays == truth.cost.rays
        assert effect not in forced.cost.effects
        assert (forced.pixels != full.pixels).any(), effect


@pytest.mark.parametrize("effect", ["reflection", "refraction"])
def test_a_ray_forced_off_is_not_traced_and_the_other_is(renderer: Renderer, effect: str) -> None:
    """Glass still mirrors and still lets through by Fresnel's shares."""
    other = {"reflection": "refraction", "refraction": "reflection"}[effect]
    forced = see(renderer, prepared_of(everything), f"-{effect}")
    assert getattr(forced.cost.rays, effect) == 0 < getattr(forced.cost.rays, other)
    ball = Scene(spheres=(Sphere((0, 0, 0), 1.0, glass()),), surroundings=Surroundings((1, 1, 1), (1, 1, 1)))
    camera = dataclasses.replace(ball, camera=Camera((0, 0, 4), (0, 0, 0), vertical_fov_deg=1e-3))
    seen = see(renderer, camera, f"-{effect}", linear=True).pixels
    expected = 0.96**2 if effect == "reflection" else 0.04
    np.testing.assert_allclose(seen, expected, rtol=1e-5)


def test_forced_frames_and_planned_ones_share_no_samples(renderer: Renderer) -> None:
    prepared = prepare(everything())
    before = see(renderer, prepared).pixels
    assert (see(renderer, prepared, "-shadows", anew=False).pixels != before).any()
    again = see(renderer, prepared, anew=False)
    np.testing.assert_array_equal(again.pixels, before)
    assert again.cost.cells_traced == 0


def test_a_glass_ball_that_no_ray_meets_refracts_no_ray(renderer: Renderer) -> None:
    """Behind the camera; the scene calls for refraction, the picture does not."""
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT),), spheres=(Sphere((0, 3, 20), 1.0, glass()),), camera=Camera((0, 2, 5), (0, 0, 0))
    )
    cost = see(renderer, scene).cost
    assert cost.effects == ("reflection", "refraction")
    assert cost.rays.total == cost.rays.primary


def test_a_choice_is_read_from_text() -> None:
    assert read_effect_choice("+soft_shadows,-reflection") == ("+soft_shadows", "-reflection")
    assert read_effect_choice(" textures , -specular,") == ("+textures", "-specular")
    assert read_effect_choice("") == ()


@pytest.mark.parametrize(
    ("choice", "found"),
    [
        (("+fog",), r"'\+fog'"),
        (("shadows",), "'shadows'"),
        (("",), "''"),
        (("+shadows", "-shadows"), r"'\+shadows,-shadows'"),
        ((7,), "7"),
        ("+shadows", r"'\+shadows'"),
    ],
)
def test_a_choice_that_makes_no_sense_is_refused(choice: object, found: str) -> None:
    with pytest.raises(SettingsError, match=rf"quality\.effects: expected .*, found {found}"):
        require_effect_choice("quality.effects", choice)
    with pytest.raises(SettingsError, match=r"quality\.effects"):
        Quality(effects=choice)  # type: ignore[arg-type]


# contributions that cannot change a pixel


def srgb_codes(linear: NDArray[np.floating]) -> NDArray[np.int64]:
    """8-bit codes by the standard's own formula (IEC 61966-2-1)."""
    clipped = np.clip(linear.astype(np.float64), 0, 1)
    coded = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return np.floor(255 * coded + 0.5).astype(np.int64)


@pytest.mark.parametrize("scene_id", ["spheres", "gallery"])
def test_rays_too_faint_to_follow_change_hardly_a_pixel(renderer: Renderer, scene_id: str) -> None:
    """Against the same frame with every ray followed: no code differs by more than 1, and 1 in 500 at all."""
    scene = BUILT_IN[scene_id]()
    cut = see(renderer, scene, width=96)
    endless = see(renderer, dataclasses.replace(scene, exposure=1e9), linear=True, width=96)
    assert cut.cost.rays.total < endless.cost.rays.total
    difference = np.abs(cut.pixels.astype(np.int64) - srgb_codes(endless.pixels * scene.exposure))
    assert difference.max() <= 1
    assert (difference > 0).mean() <= 1 / 500


def test_faint_rays_that_add_up_change_no_code_by_more_than_one(renderer: Renderer) -> None:
    """Glass in glass: every boundary splits a ray in two, and dozens of them are dropped under each pixel."""
    balls = tuple(Sphere((0, 0, 0), 1.0 - i / 8, glass(1.5 if i % 2 == 0 else 1 / 1.5)) for i in range(6))
    bright = Surroundings((0.02, 0.03, 0.05), (0.05, 0.04, 0.03))
    scene = Scene(spheres=balls, surroundings=bright, camera=Camera((0, 0, 5), (0, 0, 0), vertical_fov_deg=25))
    quality = Quality(map="full", samples_per_cell=1, max_depth=10)
    request = FrameRequest(Gaze(0, 0), Display(40, 40), None, quality)
    cut = renderer.render(prepare(scene), request)
    every = renderer.render(
        prepare(dataclasses.replace(scene, exposure=1e9)), dataclasses.replace(request, linear=True)
    )
    assert cut.cost.rays.total < every.cost.rays.total / 2
    difference = np.abs(cut.pixels.astype(np.int64) - srgb_codes(every.pixels))
    assert difference.max() <= 1
    assert (difference > 0).mean() <= 0.1


# lights that cannot be noticed


GROUND = floor(WHITE_LAMBERT)


@pytest.mark.parametrize(
    ("position", "intensity", "counts"),
    [((0, 1000, 0), 1e2, False), ((0, 1000, 0), 1e3, True), ((0, 1, 0), 1e-3, True), ((0, 0, 0), 1e-9, True)],
)
def test_a_light_too_far_to_change_a_pixel_is_left_out(
    renderer: Renderer, position: Rgb, intensity: float, counts: bool
) -> None:
    """At 1 km 100 W/sr leave 1e-4/pi, below half the smallest step 1.5e-4."""
    scene = Scene(meshes=(GROUND,), lights=(light(*position, intensity),), camera=Camera((0, 3, 5), (0, 0, 0)))
    assert bool(see(renderer, scene).cost.effects) == counts
    brighter = dataclasses.replace(scene, exposure=1e3)
    assert see(renderer, brighter).cost.effects == ("shadows",)


def test_faint_lights_count_together(renderer: Renderer) -> None:
    """Four of them stay below half a step, forty do not."""
    for number, counts in ((4, False), (40, True)):
        lights = tuple(light(i, 1000, 0, 1e2) for i in range(number))
        scene = Scene(meshes=(GROUND,), lights=lights, camera=Camera((0, 3, 5), (0, 0, 0)))
        frame = see(renderer, scene)
        assert bool(frame.cost.rays.shadow) == counts
        assert (frame.pixels.max() > 0) == counts


def test_a_panel_that_faces_away_lights_nothing_but_is_seen(renderer: Renderer) -> None:
    up = RectangleLight((-2, 1, -2), (0, 0, 4), (4, 0, 0), (1.0,) * 3)
    scene = Scene(meshes=(GROUND,), lights=(up,), camera=Camera((0, 5, 0), (0, 0, 0), (0, 0, -1), 10))
    frame = see(renderer, scene)
    assert frame.cost.effects == ()
    assert (frame.pixels == 255).all()
    assert see(renderer, dataclasses.replace(scene, lights=(dataclasses.replace(up, two_sided=True),))).cost.effects


def test_triangles_without_area_call_for_nothing(renderer: Renderer) -> None:
    flat = dataclasses.replace(GROUND, vertices=GROUND.vertices * (1, 1, 0), material=glass())
    frame = see(renderer, Scene(meshes=(GROUND, flat), camera=Camera((0, 3, 5), (0, 0, 0))))
    assert frame.cost.effects == ()
