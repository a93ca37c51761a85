"""A glass and a mirror sphere over a checkerboard.

After T. Whitted, "An improved illumination model for shaded display", CACM 23(6), 1980.
"""

from __future__ import annotations

from renderer.camera import Camera
from renderer.scene import Material, PointLight, Rgb, Scene, Sphere, Surroundings, Texture
from renderer.scenes.patterns import checkerboard
from renderer.shapes import quad

SQUARE_M = 1.0
"""Side of one field of the floor [m]."""

FLOOR_M = (-9.0, 10.0, -16.0, 6.0)
"""Left, right, far and near edge of the floor [m]."""

GLASS = Material("glass", diffuse=(0.0, 0.0, 0.0), specular=(0.5, 0.5, 0.5), shininess=900.0,
                 transmission=(0.97, 0.99, 0.98), ior=1.5)  # fmt: skip
MIRROR = Material("mirror", diffuse=(0.02, 0.02, 0.03), specular=(0.6, 0.6, 0.6), shininess=600.0,
                  reflection=(0.86, 0.88, 0.92))  # fmt: skip


def spheres() -> Scene:
    """The scene: two large spheres, five small ones, one floor and two lights."""
    left, right, far, near = FLOOR_M
    fields = Texture(checkerboard(light=(246, 214, 44), dark=(196, 22, 16)), "checkerboard")
    floor = quad((left, 0.0, near), (right - left, 0.0, 0.0), (0.0, 0.0, far - near))
    return Scene(
        meshes=(floor.mesh(Material("floor", (0.92, 0.92, 0.92), diffuse_texture=fields), 2 * SQUARE_M),),
        spheres=(
            Sphere((-0.75, 1.62, 1.1), 0.98, GLASS),
            Sphere((1.15, 1.38, -1.5), 1.22, MIRROR),
            _enamel((-2.75, 0.42, -1.9), 0.42, (0.05, 0.16, 0.62)),
            _enamel((2.35, 0.30, 0.9), 0.30, (0.03, 0.42, 0.22)),
            _enamel((3.55, 0.48, -2.9), 0.48, (0.80, 0.74, 0.66)),
            _enamel((0.62, 0.22, 1.75), 0.22, (0.74, 0.09, 0.32)),
            _enamel((-4.30, 0.60, -4.6), 0.60, (0.86, 0.36, 0.05)),
        ),
        lights=(
            PointLight((-6.0, 11.0, 7.5), (520.0, 505.0, 480.0)),
            PointLight((7.0, 8.0, 5.0), (95.0, 102.0, 118.0)),
        ),
        surroundings=Surroundings(zenith=(0.03, 0.10, 0.42), horizon=(0.34, 0.56, 0.88), ambient=(0.12, 0.13, 0.16)),
        camera=Camera(position=(0.1, 2.05, 6.6), look_at=(0.12, 1.18, 0.0), vertical_fov_deg=38.0),
        exposure=1.05,
        title="Spheres: glass and mirror over a checkerboard, after Whitted 1980",
    )


def _enamel(center: tuple[float, float, float], radius: float, colour: Rgb) -> Sphere:
    """A small glossy sphere."""
    return Sphere(center, radius, Material("enamel", colour, specular=(0.35, 0.35, 0.35), shininess=70.0))
