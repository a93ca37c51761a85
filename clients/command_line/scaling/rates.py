"""What the simulation is told: how fast one core is, and the machines it asks about."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from clients.command_line.errors import UsageError

BITS_PER_BYTE = 8
BITS_PER_GBIT = 1e9


@dataclass(frozen=True, slots=True)
class Rates:
    """How fast things are, as measured; those of one core are held to add up over cores.

    Attributes:
        samples_per_s: camera samples, with all rays they cause, that a core traces.
        map_px_per_s: pixels of a screen whose cell map a core builds.
        picture_px_per_s: pixels that a core reconstructs and tone maps.
        encode_px_per_s: pixels that are encoded as JPEG; one core does a frame.
        pack_cells_per_s: cells that a frame's thread packs to be sent.
        take_cells_per_s: cells whose samples that thread puts into the sample store as they come back.
        bytes_out_per_cell: what a cell takes on its way to a worker.
        bytes_back_per_sample: what a sample takes on its way back.
        most_bytes_back_per_cell: and a cell at most, since sums are sent where they are shorter.
        piece_s: processor time for a piece beside that, at the service.
        round_trip_s: a piece's way there and back, beside its bytes.
        spread: standard deviation of the time a piece takes, over its mean.
    """

    samples_per_s: float = 1.3e6
    map_px_per_s: float = 6.1e7
    picture_px_per_s: float = 8.0e7
    encode_px_per_s: float = 3.0e8
    pack_cells_per_s: float = 2.4e7
    take_cells_per_s: float = 1.6e7
    bytes_out_per_cell: float = 1.0
    bytes_back_per_sample: float = 12.0
    most_bytes_back_per_cell: float = 20.0
    piece_s: float = 1e-3
    round_trip_s: float = 5e-3
    spread: float = 0.22


@dataclass(frozen=True, slots=True)
class Machine:
    """A node.

    Attributes:
        cores: of its processor.
        gbit_per_s: of its network, each way at once.
    """

    cores: int = 32
    gbit_per_s: float = 25.0

    @property
    def bytes_per_s(self) -> float:
        """What it sends, and receives, at once."""
        return self.gbit_per_s * BITS_PER_GBIT / BITS_PER_BYTE


@dataclass(frozen=True, slots=True)
class Work:
    """A frame.

    Attributes:
        pixels: of its screen.
        cells: that are traced.
        samples: of each of them.
        new_map: whether its cell map is built.
    """

    pixels: int
    cells: int
    samples: int = 1
    new_map: bool = True

    def picture_s(self, rates: Rates, cores: float) -> float:
        """Time of the map and the picture at the service [s], which all of its cores work on."""
        map_s = self.pixels / rates.map_px_per_s if self.new_map else 0.0
        return (map_s + self.pixels / rates.picture_px_per_s) / cores

    def encode_s(self, rates: Rates) -> float:
        """Time of encoding there [s], by one core."""
        return self.pixels / rates.encode_px_per_s

    def bytes_back_per_cell(self, rates: Rates) -> float:
        """What a cell takes on its way back."""
        return min(self.samples * rates.bytes_back_per_sample, rates.most_bytes_back_per_cell)


def read_rates(path: Path) -> Rates:
    """Rates from a JSON object with some of their names; the others stay as they are.

    Raises:
        UsageError: naming file and field.
    """
    try:
        given: Any = json.loads(path.read_text())
    except (OSError, UnicodeError, ValueError) as error:
        raise UsageError(f"--rates: {path}: {getattr(error, 'strerror', None) or 'expected JSON'}") from None
    names = [field.name for field in fields(Rates)]
    if not isinstance(given, dict):
        raise UsageError(f"--rates: {path}: expected an object with some of {', '.join(names)}")
    for name, value in given.items():
        if name not in names:
            raise UsageError(f"--rates: {path}: {name}: expected one of {', '.join(names)}")
        least = 0.0 if name in ("piece_s", "round_trip_s", "spread") else math.nextafter(0.0, 1.0)
        if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value < math.inf:
            raise UsageError(f"--rates: {path}: {name}: expected a number above 0, found {value!r}")
    return Rates(**{name: float(value) for name, value in given.items()})
