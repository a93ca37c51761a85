"""The settings that are measured: the default with one thing varied at a time, and samples for each kind of map.

A thing is varied where the scene answers to it: shadow samples where a light with a size casts shadows, depth
where something mirrors or is seen through, each effect that the scene calls for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from renderer.accuracy.record import DEFAULT, PAPER
from renderer.acuity import MODELS, Acuity
from renderer.effects import EffectPlan
from renderer.quality import MAPS, Quality


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting of the grid; attributes as in `SettingResult`."""

    id: str
    label: str
    group: str
    quality: Quality
    marks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Extent:
    """How much of each thing is tried.

    Attributes:
        samples: camera rays a cell, by map.
        scales: factors on the cells' width.
        models: acuity models beside the default one.
        regular, adaptive, smooth: camera rays a cell with regular and adaptive anti-aliasing and with smooth
            reconstruction.
        shadow_samples: shadow rays a camera ray to each light with a size.
        depths: mirrors and boundaries a ray may meet.
        paper_samples: camera rays a cell of the paper's setting.
    """

    samples: tuple[tuple[str, tuple[int, ...]], ...]
    scales: tuple[float, ...]
    models: tuple[str, ...]
    regular: tuple[int, ...]
    adaptive: tuple[int, ...]
    smooth: tuple[int, ...]
    shadow_samples: tuple[int, ...]
    depths: tuple[int, ...]
    paper_samples: int


FULL: Final = Extent(
    samples=tuple((kind, (1, 2, 4, 8, 16, 32)) for kind in MAPS),
    scales=(0.5, 0.7, 1.4, 2.0, 3.0, 4.0, 8.0),
    models=tuple(model for model in MODELS if model != Acuity().model),
    regular=(4, 16),
    adaptive=(8, 16, 32),
    smooth=(1, 4, 16),
    shadow_samples=(2, 4, 8),
    depths=(0, 1, 2, 3, 8),
    paper_samples=32,
)
"""Everything; the paper's tables are for 32 rays a cell."""

QUICK: Final = Extent(
    samples=(("aligned", (1, 2, 4, 8)), ("scanline", (4,)), ("full", (1, 4))),
    scales=(0.5, 2.0, 4.0),
    models=("geisler-perry", "guenter"),
    regular=(4,),
    adaptive=(8,),
    smooth=(4,),
    shadow_samples=(4,),
    depths=(0, 1),
    paper_samples=4,
)
"""Enough to see which way things go."""


def grid(extent: Extent, plan: EffectPlan) -> tuple[Setting, ...]:
    """The settings to measure for a scene that calls for `plan`, the default first, no id twice."""
    settings = (*_maps(extent), *_acuities(extent), *_samplings(extent), *_rays(extent, plan), *_effects(plan))
    return tuple(sorted(settings, key=lambda setting: DEFAULT not in setting.marks))


def most_samples(settings: Sequence[Setting]) -> int:
    """Camera rays a cell of the setting that sends most."""
    return max(setting.quality.samples_per_cell for setting in settings)


def _maps(extent: Extent) -> Iterator[Setting]:
    default = Quality()
    for kind, numbers in extent.samples:
        for samples in numbers:
            quality = replace(default, map=kind, samples_per_cell=samples)
            group = "samples" if kind == default.map else "map"
            marks = (DEFAULT,) if quality == default else ()
            yield Setting(f"{kind}-{samples}", f"{kind}, {_rays_text(samples)}", group, quality, marks)
    paper = replace(
        default,
        map="scanline",
        gaze_bucket_px=0,
        samples_per_cell=extent.paper_samples,
        acuity=Acuity(eccentricity="paper"),
    )
    yield Setting("paper", f"the paper's map, {_rays_text(extent.paper_samples)}", "map", paper, (PAPER,))


def _acuities(extent: Extent) -> Iterator[Setting]:
    default = Quality()
    for scale in extent.scales:
        quality = replace(default, acuity=Acuity(scale=scale))
        yield Setting(f"scale-{scale:g}".replace(".", "-"), f"cells {scale:g} times as wide", "acuity_scale", quality)
    for model in extent.models:
        yield Setting(f"acuity-{model}", f"acuity {model}", "acuity_model", replace(default, acuity=Acuity(model)))


def _samplings(extent: Extent) -> Iterator[Setting]:
    default = Quality()
    for kind, numbers in (("regular", extent.regular), ("adaptive", extent.adaptive)):
        for samples in numbers:
            quality = replace(default, antialiasing=kind, samples_per_cell=samples)
            text = _rays_text(samples) if kind == "regular" else f"at most {_rays_text(samples)}"
            yield Setting(f"{kind}-{samples}", f"{kind}, {text}", "antialiasing", quality)
    for samples in extent.smooth:
        quality = replace(default, reconstruction="smooth", samples_per_cell=samples)
        yield Setting(f"smooth-{samples}", f"smooth, {_rays_text(samples)}", "reconstruction", quality)


def _rays(extent: Extent, plan: EffectPlan) -> Iterator[Setting]:
    default = Quality()
    if "soft_shadows" in plan.names:
        for each in extent.shadow_samples:
            quality = replace(default, shadow_samples=each * default.samples_per_cell)
            label = f"{each} shadow rays a camera ray"
            yield Setting(f"shadow-samples-{quality.shadow_samples}", label, "shadow_samples", quality)
    if {"reflection", "refraction"} & set(plan.names):
        for depth in extent.depths:
            yield Setting(f"depth-{depth}", f"depth {depth}", "max_depth", replace(default, max_depth=depth))


def _effects(plan: EffectPlan) -> Iterator[Setting]:
    for name in plan.names:
        text = name.replace("_", " ")
        yield Setting(
            f"no-{name.replace('_', '-')}", f"no {text}", "effects", replace(Quality(), effects=(f"-{name}",))
        )


def _rays_text(samples: int) -> str:
    return f"{samples} sample{'' if samples == 1 else 's'}"
