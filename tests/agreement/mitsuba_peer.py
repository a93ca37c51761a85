"""The pictures that Mitsuba 3 makes of our scenes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clients.command_line.peers.mitsuba_scene import mitsuba
from renderer.display import Display
from renderer.scene import Surroundings


def repeated_pictures(
    scene: Any, integrator: dict[str, Any], repeats: int, samples: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean picture of independent ones and the standard error of each of its values, (h, w, 3) float64.

    Args:
        scene: of `mitsuba_scene`.
        integrator: Mitsuba's own.
        repeats: how many pictures.
        samples: a pixel, at random places in it.
    """
    mi = mitsuba()
    method = mi.load_dict(integrator)
    pictures = np.array([mi.render(scene, integrator=method, spp=samples, seed=seed) for seed in range(repeats)])
    pictures = pictures.astype(np.float64)
    return pictures.mean(axis=0), pictures.std(axis=0, ddof=1) / np.sqrt(repeats)


def followed_picture(scene: Any, around: Surroundings, display: Display, depth: int) -> NDArray[np.float64]:
    """One ray through the middle of each pixel, followed as Whitted does, by Mitsuba's camera, shapes,
    materials and lights: (h, w, 3) float64 radiance.

    Args:
        scene: of `mitsuba_scene`.
        around: what rays see that meet nothing.
        display: its size.
        depth: how many mirrors and boundaries a ray may meet.
    """
    mi = mitsuba()
    (sensor,) = scene.sensors()
    lights = scene.emitters()
    picture = np.zeros((display.height_px, display.width_px, 3))
    for row in range(display.height_px):
        for column in range(display.width_px):
            place = mi.Point2f((column + 0.5) / display.width_px, (row + 0.5) / display.height_px)
            ray, _ = sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
            picture[row, column] = _followed(mi, scene, lights, around, ray, depth)
    return picture


def _followed(mi: Any, scene: Any, lights: Any, around: Surroundings, ray: Any, depth: int) -> NDArray[np.float64]:
    hit = scene.ray_intersect(ray)
    if not hit.is_valid():
        high = min(1.0, max(0.0, ray.d.y))
        return high * np.array(around.zenith) + (1.0 - high) * np.array(around.horizon)
    material = hit.bsdf()
    seen = np.zeros(3)
    middle = mi.Point2f(0.5)
    if mi.has_flag(material.flags(), mi.BSDFFlags.Smooth):
        for light in lights:
            way, arriving = light.sample_direction(hit, middle)
            if way.pdf > 0.0:
                sent = np.array(material.eval(mi.BSDFContext(), hit, hit.to_local(way.d)) * arriving)
                seen += sent * _let_through(scene, hit.spawn_ray_to(way.p))
    if (passing := _through(hit, ray)) > 0.0:
        seen += passing * _followed(mi, scene, lights, around, hit.spawn_ray(ray.d), depth)
    for part in range(material.component_count() if depth > 0 else 0):
        if mi.has_flag(material.flags(part), mi.BSDFFlags.Delta):
            # Carried as importance is, light knows no n^2 where it is refracted: Whitted's model has none.
            context = mi.BSDFContext(mi.TransportMode.Importance, int(mi.BSDFFlags.All), part)
            turned, share = material.sample(context, hit, 0.5, middle)
            if turned.pdf > 0.0:
                onwards = hit.spawn_ray(hit.to_world(turned.wo))
                seen += np.array(share) * _followed(mi, scene, lights, around, onwards, depth - 1)
    return seen


def _through(hit: Any, ray: Any) -> float:
    """Share of the light that passes the holes of what was hit."""
    return float(hit.bsdf(ray).eval_null_transmission(hit)[0])


def _let_through(scene: Any, ray: Any) -> float:
    """Share of the light that passes all there is along a ray that ends at a light."""
    share = 1.0
    while share > 0.0:
        hit = scene.ray_intersect(ray)
        if not hit.is_valid():
            break
        share *= _through(hit, ray)
        onwards = hit.spawn_ray(ray.d)
        onwards.maxt = ray.maxt - hit.t
        ray = onwards
    return share
