"""The field as specified in section 10, without regard to speed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from ..client import Intensities


def round_half_away(numerator: int, denominator: int) -> int:
    """numerator / denominator to the nearest integer, halves away from zero."""
    size = (2 * abs(numerator) + denominator) // (2 * denominator)
    return size if numerator >= 0 else -size


def sine_q14(heading: int) -> int:
    """The sine of a binary angle in 1/16384, mirrored from the first quarter wave."""
    quarter, step = divmod(heading % 65536, 16384)
    if quarter % 2:
        step = 16384 - step
    value = math.floor(16384 * math.sin(2 * math.pi * step / 65536) + 0.5)
    return -value if quarter >= 2 else value


def cosine_q14(heading: int) -> int:
    return sine_q14(heading + 16384)


@dataclass(frozen=True)
class Pheromone:
    """A pheromone type as it is configured, in whole numbers."""

    type: int
    core_um: int
    sigma_um: int
    tau_ms: int
    quantum_millionths: int
    most_quanta: int
    directional: bool = False


class OffTheMap(Exception):
    """The position is outside of the map's bounds."""


@dataclass(frozen=True)
class Model:
    """A map and its contents. Coordinates are in pose units."""

    width_um: int
    height_um: int
    cell_um: int
    pose_unit_um: int
    antenna_distance_um: int
    pheromones: dict[int, Pheromone]
    origin_x_um: int = 0
    origin_y_um: int = 0
    nodes: dict[tuple[int, int, int], tuple[int, int]] = field(default_factory=dict)
    """(type, column, row) to (quanta, time of the last deposit in ms)"""

    def position(self, x: int, y: int) -> tuple[int, int]:
        """A position in micrometres, if it is on the map."""
        px, py = x * self.pose_unit_um, y * self.pose_unit_um
        right, top = self.origin_x_um + self.width_um, self.origin_y_um + self.height_um
        if not (self.origin_x_um <= px <= right and self.origin_y_um <= py <= top):
            raise OffTheMap(f"({x}, {y})")
        return px, py

    def node(self, x: int, y: int) -> tuple[int, int]:
        """Column and row of the node nearest to a position."""
        px, py = self.position(x, y)
        a = self.cell_um
        column = (2 * (px - self.origin_x_um) + a) // (2 * a)
        row = (2 * (py - self.origin_y_um) + a) // (2 * a)
        return min(column, self.width_um // a), min(row, self.height_um // a)

    def quanta(self, pheromone: int, column: int, row: int, now_ms: int) -> int:
        """The number of quanta that a node holds now."""
        count, since = self.nodes.get((pheromone, column, row), (0, 0))
        tau = self.pheromones[pheromone].tau_ms
        return max(0, count - (now_ms - since) // tau) if tau else count

    def deposit(self, pheromone: int, x: int, y: int, quanta: int = 1, now_ms: int = 0) -> None:
        column, row = self.node(x, y)
        count = self.quanta(pheromone, column, row, now_ms) + quanta
        most = self.pheromones[pheromone].most_quanta
        self.nodes[pheromone, column, row] = (min(most, count), now_ms)

    def antennas(self, x: int, y: int, heading: int) -> tuple[tuple[int, int], tuple[int, int]]:
        """Where the left and the right antenna are, in micrometres."""
        px, py = self.position(x, y)
        b = self.antenna_distance_um
        ox = round_half_away(-b * sine_q14(heading), 32768)
        oy = round_half_away(b * cosine_q14(heading), 32768)
        return (px + ox, py + oy), (px - ox, py - oy)

    def sources(self, pheromone: int, now_ms: int) -> Iterator[tuple[int, int, int]]:
        """x and y in micrometres, and the quanta, of each node that holds any."""
        for kind, column, row in self.nodes:
            if kind == pheromone and (count := self.quanta(kind, column, row, now_ms)):
                x = self.origin_x_um + column * self.cell_um
                y = self.origin_y_um + row * self.cell_um
                yield x, y, count

    def sense(self, pheromone: int, x: int, y: int, heading: int, now_ms: int = 0) -> Intensities:
        """The expected answer of the server."""
        kind = self.pheromones[pheromone]
        px, py = self.position(x, y)
        cos, sin = cosine_q14(heading), sine_q14(heading)
        near = [
            (qx, qy, count)
            for qx, qy, count in self.sources(pheromone, now_ms)
            if not kind.directional or (qx - px) * cos + (qy - py) * sin >= 0
        ]
        intensities = []
        for ax, ay in self.antennas(x, y, heading):
            total = sum(count * weight_q16(kind, qx - ax, qy - ay) for qx, qy, count in near)
            scaled = 4096 * kind.quantum_millionths * total
            intensities.append(round_half_away(scaled, 65536 * 1_000_000))
        return fit_to_wire(*intensities)


def weight_q16(kind: Pheromone, dx: int, dy: int) -> int:
    """The weight of a source at a distance, in 1/65536."""
    distance = math.sqrt(dx * dx + dy * dy)
    k = 65536 / kind.sigma_um
    value = math.floor((kind.core_um + kind.sigma_um - distance) * k + 0.5)
    return max(0, min(65536, value))


def fit_to_wire(left: int, right: int) -> Intensities:
    """Scales two intensities down together if one of them does not fit."""
    most = max(abs(left), abs(right))
    if most <= 32767:
        return Intensities(left, right)
    small = [abs(p) * 32767 // most for p in (left, right)]
    return Intensities(small[0] if left >= 0 else -small[0], small[1] if right >= 0 else -small[1])
