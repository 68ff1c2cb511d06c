"""Maps of pheromone: arrays, and pictures of them."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

# Colours of levels: viridis at every eighth of the way from 0 to the maximum.
_VIRIDIS = (0x440154, 0x472D7B, 0x3B528B, 0x2C728E, 0x21918C, 0x28AE80, 0x5EC962, 0xADDC30, 0xFDE725)
_FULL, _OBSTACLE = 254, 255  # of the palette
_SIDE_PIXELS = 400  # that a small map's longer side has at least


class Map:
    """The levels of one pheromone.

    values        levels in units, the top row first, as pictures have it; NaN where an obstacle is.
                  A NumPy array of doubles, or a list of lists without NumPy
    pheromone     its name; `maximum`: the most that a node can hold
    origin_m      (x, y) of the lower left corner of the lower left cell
    cell_m        the side of a cell
    field_time_s  the time of these levels on the server's clock of evaporation
    """

    def __init__(self, values: Any, facts: Mapping[str, Any]) -> None:
        self.values = values
        self.pheromone: str = facts["pheromone"]
        self.maximum: float = facts["maximum"]
        self.origin_m: tuple[float, float] = (facts["origin_m"][0], facts["origin_m"][1])
        self.cell_m: float = facts["cell_m"]
        self.field_time_s: float = facts["field_time_s"]
        self.rows = len(values)
        self.columns = len(values[0])

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """(left, right, bottom, top) in metres, for matplotlib: imshow(map.values,
        extent=map.extent)."""
        x, y = self.origin_m
        return (x, x + self.columns * self.cell_m, y, y + self.rows * self.cell_m)

    def at(self, x_m: float, y_m: float) -> float:
        """The level at a place. Raises IndexError off the map."""
        column = math.floor((x_m - self.origin_m[0]) / self.cell_m)
        row = math.floor((y_m - self.origin_m[1]) / self.cell_m)
        if not (0 <= column < self.columns and 0 <= row < self.rows):
            raise IndexError(f"({x_m}, {y_m}) is off the map")
        return float(self.values[self.rows - 1 - row][column])

    def place(self, row: int, column: int) -> tuple[float, float]:
        """(x, y) in metres of the centre of the cell values[row][column]."""
        return (self.origin_m[0] + (column + 0.5) * self.cell_m,
                self.origin_m[1] + (self.rows - row - 0.5) * self.cell_m)

    def png(self, pixels_per_cell: int | None = None) -> bytes:
        """A picture as a PNG file: from dark blue, nothing, to yellow, the maximum; obstacles are
        white. By default, small maps are enlarged."""
        side = pixels_per_cell or max(1, _SIDE_PIXELS // max(self.rows, self.columns))
        rows = bytearray()
        for levels in self.values:
            cells = bytes(self._shade(level) for level in levels)
            row = bytes(cell for cell in cells for _ in range(side))
            rows += (b"\0" + row) * side  # 0: no filter
        header = struct.pack(">IIBBBBB", self.columns * side, self.rows * side, 8, 3, 0, 0, 0)
        return b"\x89PNG\r\n\x1a\n" + b"".join(
            _chunk(kind, content) for kind, content in (
                (b"IHDR", header), (b"PLTE", bytes(_palette())),
                (b"IDAT", zlib.compress(bytes(rows))), (b"IEND", b"")))

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        return self.png()

    def __repr__(self) -> str:
        return f"<Map of {self.pheromone}: {self.columns} x {self.rows} cells of {self.cell_m:g} m>"

    def _shade(self, level: float) -> int:
        if math.isnan(level):
            return _OBSTACLE
        return round(min(max(level / self.maximum, 0), 1) * _FULL)


def _palette() -> Iterable[int]:
    for i in range(_FULL + 1):
        at = i * (len(_VIRIDIS) - 1) / _FULL
        below = min(int(at), len(_VIRIDIS) - 2)
        for shift in (16, 8, 0):
            low, high = (_VIRIDIS[it] >> shift & 0xFF for it in (below, below + 1))
            yield round(low + (high - low) * (at - below))
    yield from (255, 255, 255)


def _chunk(kind: bytes, content: bytes) -> bytes:
    return (struct.pack(">I", len(content)) + kind + content
            + struct.pack(">I", zlib.crc32(kind + content)))
