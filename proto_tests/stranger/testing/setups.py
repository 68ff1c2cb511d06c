"""The configurations under which the daemon is tested, each with its model."""

from __future__ import annotations

from dataclasses import dataclass

from .model import Model, Pheromone


@dataclass(frozen=True)
class Setup:
    """A configuration file and the model that goes with it."""

    model: Model
    links: tuple[str, ...]
    slot_ms: int
    response_window_ms: int
    wide: bool = False
    """The map reaches beyond what narrow messages can say."""
    field_memory_mib: int | None = None

    def toml(self) -> str:
        m = self.model
        lines = [
            "[map]",
            f"width_m = {m.width_um / 1e6!r}",
            f"height_m = {m.height_um / 1e6!r}",
            f"cell_m = {m.cell_um / 1e6!r}",
            f"origin_x_m = {m.origin_x_um / 1e6!r}",
            f"origin_y_m = {m.origin_y_um / 1e6!r}",
            f"pose_unit_mm = {m.pose_unit_um / 1e3!r}",
            f"wide = {str(self.wide).lower()}",
            "",
            "[antennas]",
            f"bias_m = {m.antenna_distance_um / 1e6!r}",
        ]
        for kind in m.pheromones.values():
            quantum = kind.quantum_millionths / 1e6
            maximum = kind.quantum_millionths * kind.most_quanta / 1e6
            lines += [
                "",
                "[[pheromone]]",
                f"type = {kind.type}",
                f'name = "type-{kind.type}"',
                f"core_m = {kind.core_um / 1e6!r}",
                f"sigma_m = {kind.sigma_um / 1e6!r}",
                f"tau_s = {kind.tau_ms / 1e3!r}",
                f"quantum = {quantum!r}",
                f"maximum = {maximum!r}",
                f"directional = {str(kind.directional).lower()}",
            ]
        for name in self.links:
            lines += [
                "",
                "[[link]]",
                f'name = "{name}"',
                'kind = "pty"',
                f'path = "{name}.pty"',
                f"slot_ms = {self.slot_ms}",
                f"response_window_ms = {self.response_window_ms}",
            ]
        if self.field_memory_mib is not None:
            lines += ["", "[limits]", f"field_memory_mib = {self.field_memory_mib}"]
        return "\n".join(lines) + "\n"


PERMANENT = 1
AHEAD = 2  # directional
FLEETING = 3  # evaporates while we look
FAINT = 5  # rounding matters; evaporates, but not within this test
AHEAD_SLOW = 15  # directional, evaporates, but not within this test
NOT_CONFIGURED = 9


def _kinds(*kinds: Pheromone) -> dict[int, Pheromone]:
    return {kind.type: kind for kind in kinds}


# The map reaches beyond what narrow messages can say (32.8 m), and below zero.
WIDE_MAP = Setup(
    Model(
        width_um=80_000_000,
        height_um=12_000_000,
        cell_um=50_000,
        origin_x_um=-40_000_000,
        origin_y_um=-3_000_000,
        pose_unit_um=1000,
        antenna_distance_um=300_000,
        pheromones=_kinds(
            Pheromone(PERMANENT, 100_000, 400_000, 0, 1_000_000, 20),
            Pheromone(AHEAD, 0, 777_000, 0, 250_000, 15, directional=True),
            Pheromone(FLEETING, 500_000, 100_000, 200, 500_000, 10),
            Pheromone(FAINT, 33_000, 301_000, 3_600_000, 1_000, 255),
            Pheromone(AHEAD_SLOW, 57_000, 613_000, 3_600_000, 125_000, 40, directional=True),
        ),
    ),
    links=("radio-a", "radio-b"),
    slot_ms=3,
    response_window_ms=120,
    wide=True,
)

# One tile holds 8 x 8 nodes, that is 0.8 m x 0.8 m here.
SMALL_MEMORY = Setup(
    Model(
        width_um=100_000_000,
        height_um=100_000_000,
        cell_um=100_000,
        pose_unit_um=10_000,
        antenna_distance_um=217_000,
        pheromones=_kinds(
            Pheromone(4, 0, 1_234_000, 0, 500_000, 8),
            Pheromone(6, 100_000, 900_000, 0, 250_000, 8, directional=True),
        ),
    ),
    links=("radio-c",),
    slot_ms=1,
    response_window_ms=255,
    field_memory_mib=1,
)
