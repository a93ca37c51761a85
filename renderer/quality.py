"""What a frame may cost: cells, samples, depth."""

from __future__ import annotations

from dataclasses import dataclass, field

from renderer.acuity import Acuity
from renderer.effect_choice import EffectChoice, require_effect_choice
from renderer.errors import require_choice, require_integer, require_kind, require_number

MAPS = ("aligned", "scanline", "full")
ANTIALIASING = ("stochastic", "regular", "adaptive")
RECONSTRUCTIONS = ("nearest", "smooth")
MAX_SAMPLES = 4096
MAX_DEPTH = 64
MAX_BUCKET_PX = 512
MAX_DEADLINE_MS = 600_000.0
MAX_ERROR = 1e6

ERROR_SAMPLES = 64
"""Most samples a cell for a frame that is asked for by its error, where the request does not state how many."""


@dataclass(frozen=True, slots=True)
class Quality:
    """How a frame is sampled.

    Attributes:
        map: tiling of the screen into cells: `aligned` (default), `scanline` (the paper's) or `full`
            (one cell a pixel, the reference).
        gaze_bucket_px: side of the squares of gaze that share a map [px], 0 for the exact gaze.
        samples_per_cell: rays sent from the camera for each cell, 1 to 4096.
        antialiasing: where they go: the first to the cell's centre, the rest at `stochastic` or
            `regular` places over the cell's area; `adaptive` is stochastic, and a cell gets `samples_per_cell`
            only where fewer leave an error that can be seen.
        shadow_samples: shadow rays a cell sends to each area light, 1 to 4096, spread over its camera
            samples: each sends shadow_samples / samples_per_cell of them, rounded up.
        max_depth: how many mirrors and boundaries a ray may meet, 0 to 64.
        effects: effects forced on (+name) or off (-name); the others run where the scene calls for them.
        acuity: the eye's resolution.
        reconstruction: how cells become pixels: `nearest`, each pixel its cell's colour (the paper's), or
            `smooth`, cells blended into their neighbours.
        deadline_ms: time for the whole frame, above 0 to 600,000 [ms]: fewer samples are traced and, if one a
            cell is too many still, cells made coarser, until the frame should be done in time, going by what
            such frames have taken on this machine. None: as much time as it takes.
        max_error: what the frame's stated standard error may be at most, over the screen and in the fovea alike,
            above 0 to 1e6 [shares of white]: no more samples are traced than it takes, of `samples_per_cell` at
            most. None: all of them.

    Raises:
        SettingsError: naming the field, for a value out of range.
    """

    map: str = "aligned"
    gaze_bucket_px: int = 16
    samples_per_cell: int = 4
    antialiasing: str = "stochastic"
    max_depth: int = 5
    effects: EffectChoice = ()
    shadow_samples: int = 4
    acuity: Acuity = field(default_factory=Acuity)
    reconstruction: str = "nearest"
    deadline_ms: float | None = None
    max_error: float | None = None

    def __post_init__(self) -> None:
        require_choice("quality.map", self.map, MAPS)
        require_integer("quality.gaze_bucket_px", self.gaze_bucket_px, 0, MAX_BUCKET_PX)
        require_integer("quality.samples_per_cell", self.samples_per_cell, 1, MAX_SAMPLES)
        require_choice("quality.antialiasing", self.antialiasing, ANTIALIASING)
        require_integer("quality.shadow_samples", self.shadow_samples, 1, MAX_SAMPLES)
        require_effect_choice("quality.effects", self.effects)
        require_kind("quality.acuity", self.acuity, Acuity)
        require_integer("quality.max_depth", self.max_depth, 0, MAX_DEPTH)
        require_choice("quality.reconstruction", self.reconstruction, RECONSTRUCTIONS)
        if self.deadline_ms is not None:
            require_number("quality.deadline_ms", self.deadline_ms, 0.0, MAX_DEADLINE_MS, open_low=True)
        if self.max_error is not None:
            require_number("quality.max_error", self.max_error, 0.0, MAX_ERROR, open_low=True)
