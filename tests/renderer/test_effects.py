"""The effect plan: only what can be seen or can cast a shadow counts, and what is not called for costs no rays."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.effects import plan_effects
from renderer.pipeline import Renderer
from renderer.scene import Material, Mesh, PointLight, Scene, Sphere, Surroundings, Texture
from tests.renderer.drawing import BLACK, WHITE, WHITE_LAMBERT, box, floor, glass, lamp, light, mirror, shoot

LIGHTS = (light(0, 4, 0, 50.0),)
CAMERA = Camera((0, 2, 8), (0, 0.5, 0))
CHECKS = Texture(np.uint8([[[0] * 3, [255] * 3]]), "checks")
SHINY = Material("shiny", specular=(0.5, 0.5, 0.5))
METAL = Material("metal", diffuse=BLACK, specular=BLACK, base="ashikhmin-shirley")
BUMPS = Texture(np.uint8([[[40, 128, 255], [128, 128, 255]]]), "bumps")
FLAT = Texture(np.uint8([[[127, 128, 255], [128, 127, 90]]]), "flat")
BUMPY = Material("bumpy", normal_texture=BUMPS)
AMBIENT = Surroundings(ambient=WHITE)
GHOST_FLOOR = floor(WHITE_LAMBERT, casts_shadows=False)


def ball(material: Material, casts_shadows: bool = True) -> Sphere:
    return Sphere((0, 1, 0), 1.0, material, casts_shadows)


def names(scene: Scene) -> tuple[str, ...]:
    return plan_effects(scene).names


def test_a_matte_scene_traces_primary_rays_only(renderer: Renderer) -> None:
    scene = Scene(
        meshes=(GHOST_FLOOR, box((-1, 0, -1), (1, 1, 1), WHITE_LAMBERT, casts_shadows=False)),
        lights=LIGHTS,
        surroundings=Surroundings(ambient=(0.1, 0.1, 0.1)),
        camera=CAMERA,
    )
    assert names(scene) == ()
    cost = shoot(renderer, scene, 32, 24, samples=3).cost
    assert cost.effects == ()
    assert cost.rays.primary == cost.rays.total == 32 * 24 * 3


@pytest.mark.parametrize(
    ("scene", "effects", "kinds"),
    [
        (Scene(meshes=(floor(WHITE_LAMBERT),), lights=LIGHTS), ("shadows",), {"shadow"}),
        (Scene(meshes=(GHOST_FLOOR,), spheres=(ball(WHITE_LAMBERT),), lights=LIGHTS), ("shadows",), {"shadow"}),
        (Scene(meshes=(GHOST_FLOOR,), spheres=(ball(mirror()),)), ("reflection",), {"reflection"}),
        (Scene(meshes=(GHOST_FLOOR,), spheres=(ball(glass()),)), ("reflection", "refraction"),
         {"reflection", "refraction"}),
        (Scene(meshes=(GHOST_FLOOR,), spheres=(ball(dataclasses.replace(glass(1.0), transmission=(1, 1, 0.9))),)),
         ("refraction",), {"refraction"}),
        (Scene(meshes=(floor(WHITE_LAMBERT, casts_shadows=False),), spheres=(ball(glass(1.0)),), lights=LIGHTS),
         (), set()),
        (Scene(meshes=(floor(SHINY, casts_shadows=False),), lights=LIGHTS), ("specular",), set()),
        (Scene(meshes=(floor(METAL, casts_shadows=False),), lights=LIGHTS), ("specular",), set()),
        (Scene(meshes=(floor(METAL),)), (), set()),
        (Scene(meshes=(floor(Material(diffuse_texture=CHECKS)),)), ("textures",), set()),
        (Scene(meshes=(floor(Material(reflection=(0.5,) * 3, specular_texture=CHECKS)),)), ("textures", "reflection"),
         {"reflection"}),
        (Scene(meshes=(floor(BUMPY, casts_shadows=False),), lights=LIGHTS), ("normal_maps",), set()),
        (Scene(spheres=(ball(dataclasses.replace(BUMPY, diffuse=BLACK, reflection=WHITE)),)),
         ("normal_maps", "reflection"), {"reflection"}),
        (Scene(meshes=(floor(dataclasses.replace(METAL, normal_texture=BUMPS)),), surroundings=AMBIENT),
         ("normal_maps",), set()),
        (Scene(spheres=(ball(lamp()),), lights=LIGHTS), (), set()),
        (Scene(), (), set()),
    ],
)  # fmt: skip
def test_an_effect_runs_where_something_calls_for_it(
    renderer: Renderer, scene: Scene, effects: tuple[str, ...], kinds: set[str]
) -> None:
    assert names(scene) == effects
    cost = shoot(renderer, scene, 32, 24, camera=CAMERA).cost
    assert cost.effects == effects
    traced = {kind for kind in ("shadow", "reflection", "refraction") if getattr(cost.rays, kind)}
    assert traced == kinds


@pytest.mark.parametrize(
    "scene",
    [
        Scene(meshes=(GHOST_FLOOR, Mesh(np.zeros((3, 3)), np.zeros((0, 3), np.int64), mirror()))),
        Scene(meshes=(GHOST_FLOOR,), lights=(PointLight((0, 4, 0), BLACK),), spheres=(ball(Material("grey")),)),
        Scene(meshes=(floor(SHINY),), lights=(PointLight((0, 4, 0), BLACK),)),
        Scene(meshes=(GHOST_FLOOR,), lights=LIGHTS, spheres=(ball(WHITE_LAMBERT, casts_shadows=False),)),
        Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(0, 4, 0, 50.0, casts_shadows=False),)),
        Scene(meshes=(floor(Material(diffuse=BLACK, diffuse_texture=CHECKS)),)),
        Scene(meshes=(floor(Material(specular_texture=CHECKS)),)),
        Scene(meshes=(GHOST_FLOOR,), spheres=(ball(Material(reflection=BLACK, transmission=BLACK, ior=2.0)),)),
        Scene(meshes=(floor(BUMPY),), surroundings=AMBIENT),
        Scene(meshes=(floor(Material(normal_texture=FLAT), casts_shadows=False),), lights=LIGHTS),
        Scene(meshes=(floor(dataclasses.replace(BUMPY, normal_scale=0.0), casts_shadows=False),), lights=LIGHTS),
        Scene(meshes=(floor(dataclasses.replace(BUMPY, diffuse=BLACK), casts_shadows=False),), lights=LIGHTS),
    ],
    ids=[
        "a mirror that no face has",
        "a black light",
        "a highlight of a black light",
        "casters that cast no shadow",
        "a light that casts no shadow",
        "a texture times black",
        "a specular texture without a highlight",
        "an index without transmission",
        "bumps without a light",
        "a normal map that is flat",
        "bumps of no height",
        "bumps of what sends nothing back",
    ],
)
def test_what_cannot_be_seen_calls_for_nothing(renderer: Renderer, scene: Scene) -> None:
    assert names(scene) == ()
    assert shoot(renderer, scene, 16, 12, camera=CAMERA).cost.rays.total == 16 * 12


def test_shadow_rays_go_only_where_light_would_arrive(renderer: Renderer) -> None:
    """A black shiny floor sends shadow rays from its highlight alone, a floor below the light none at all."""
    polished = Material("black lacquer", diffuse=BLACK, specular=WHITE, shininess=1e4)
    scene = Scene(meshes=(floor(polished),), lights=LIGHTS, camera=CAMERA)
    assert shoot(renderer, scene, 32, 24).cost.rays.shadow < 32 * 24 // 10
    above = Scene(meshes=(floor(WHITE_LAMBERT, y=9.0),), lights=LIGHTS, camera=Camera((0, 20, 0), (0, 9, 0), (0, 0, 1)))
    assert shoot(renderer, above, 8, 8).cost.rays.shadow == 0


def test_reasons_can_be_read() -> None:
    scene = Scene(
        meshes=(floor(Material("tiles", diffuse_texture=CHECKS)),),
        spheres=(ball(glass()), ball(glass()), ball(mirror())),
        lights=(*LIGHTS, light(1, 1, 1)),
    )
    reasons = {effect.name: effect.reason for effect in plan_effects(scene).effects}
    assert reasons == {
        "textures": "2 triangles of material 'tiles'",
        "shadows": "2 point lights, 4 shadow-casting objects",
        "reflection": "2 spheres of material 'glass'; 1 sphere of material 'mirror'",
        "refraction": "2 spheres of material 'glass'",
    }


def test_many_materials_are_summed_up() -> None:
    shiny = tuple(ball(Material(f"metal {i}", reflection=(0.1 + i / 10,) * 3)) for i in range(5))
    (effect,) = plan_effects(Scene(spheres=shiny)).effects
    assert effect.reason.endswith("; 2 more materials")
    assert effect.reason.count("1 sphere of") == 3
