"""The server's intensities, compared with the model; the parameters that it reports."""

from __future__ import annotations

import itertools
import random
import time

from ..client import ErrorAnswer, Intensities, ServerInfo
from ..wire import DLE, START, build
from .daemon import Daemon
from .model import Model
from .report import PATIENCE_S, check_equal, log
from .robot import Robot, refused_as
from .setups import AHEAD, FLEETING, PERMANENT, Setup


def check_hello(daemon: Daemon, setup: Setup, link: str, robot: Robot) -> ServerInfo:
    model = setup.model
    mask = sum(1 << kind for kind in model.pheromones)
    first = robot.hello(nonce=0x1002, firmware_version=0x10)
    expected = ServerInfo(
        nonce=0x1002,
        protocol_version=1,
        epoch=first.epoch,
        pose_unit_10um=model.pose_unit_um // 10,
        antenna_distance_mm=model.antenna_distance_um // 1000,
        type_mask=mask,
        slot_ms=setup.slot_ms,
        response_window_ms=setup.response_window_ms,
        last_opcode=0,
        last_seq=0,
    )
    check_equal(first, expected, "HELLO")
    check_equal(robot.hello(nonce=0x1002), expected, "HELLO again")
    daemon.check_alive("after HELLO")
    log(f"{link}: HELLO tells all that is configured, types {first.types}, epoch {first.epoch}")
    return first


def check_ping(robot: Robot, seed: random.Random) -> None:
    count = 0
    for length in range(17):
        for payload in (
            bytes((DLE,)) * length,
            (START * 8)[:length],
            bytes(length),
            seed.randbytes(length),
        ):
            check_equal(robot.ping(payload), payload, "PING")
            count += 1
    log(f"PING: {count} payloads of 0 to 16 bytes, DLE among them, came back")


def narrow(x: int, y: int) -> bool:
    """Whether a position fits into narrow messages."""
    return -32768 <= x <= 32767 and -32768 <= y <= 32767


def leave(robot: Robot, model: Model, kind: int, x: int, y: int, quanta: int = 1) -> None:
    """A DEPOSIT in the server's field and in the model's."""
    robot.deposit(kind, x, y, quanta)
    model.deposit(kind, x, y, quanta)


def check_sense(robot: Robot, model: Model, kind: int, x: int, y: int, heading: int) -> Intensities:
    expected = model.sense(kind, x, y, heading)
    where = f"type {kind} at ({x}, {y}) heading {heading}"
    got = robot.sense(kind, x, y, heading, wide=True)
    check_equal(got, expected, f"SENSE_WIDE {where}")
    if narrow(x, y):
        check_equal(robot.sense(kind, x, y, heading), expected, f"SENSE {where}")
    return got


def check_worked_example(robot: Robot, model: Model) -> None:
    leave(robot, model, PERMANENT, 1000, 600, 1)
    check_equal(robot.sense(PERMANENT, 1000, 500, 0), (4096, 2560), "the worked example")
    check_sense(robot, model, PERMANENT, 1000, 500, 0)
    log("the worked example of section 13 comes out as printed")


def check_field(robot: Robot, model: Model, seed: random.Random, turns: int) -> None:
    """Random deposits and poses, narrow and wide, in the middle and at the edges of the map."""
    left = model.origin_x_um // model.pose_unit_um
    bottom = model.origin_y_um // model.pose_unit_um
    right = left + model.width_um // model.pose_unit_um
    top = bottom + model.height_um // model.pose_unit_um
    metre = 1_000_000 // model.pose_unit_um
    places = [((left + right) // 2, (bottom + top) // 2), (left, bottom), (right, top)]
    places += [(right, bottom), ((left + right) // 2, bottom), (0, 0)]
    kinds = [kind for kind in model.pheromones if kind != FLEETING]

    def somewhere() -> tuple[int, int]:
        x, y = seed.choice(places)
        x += round(seed.gauss(0, 0.6) * metre)
        y += round(seed.gauss(0, 0.6) * metre)
        return max(left, min(right, x)), max(bottom, min(top, y))

    answers: list[Intensities] = []
    deposits = traces = 0
    for _ in range(turns):
        kind = seed.choice(kinds)
        x, y = somewhere()
        heading = seed.choice((seed.randrange(65536), 8192 * seed.randrange(8)))
        if narrow(x, y) and seed.random() < 0.6:
            quanta = seed.choice((1, 1, 2, 3, seed.randint(1, 255)))
            leave(robot, model, kind, x, y, quanta)
            deposits += 1
        else:
            wide = not (narrow(x, y) and seed.random() < 0.7)
            expected = model.sense(kind, x, y, heading)
            got = robot.trace(kind, x, y, heading, wide)
            check_equal(got, expected, f"TRACE type {kind} at ({x}, {y}) heading {heading}")
            model.deposit(kind, x, y, 1)
            traces += 1
        kind = seed.choice(kinds)
        x, y = somewhere()
        heading = seed.choice((seed.randrange(65536), 8192 * seed.randrange(8)))
        answers.append(check_sense(robot, model, kind, x, y, heading))
    # Much in one place, so that it certainly does not fit the wire unscaled.
    x, y = places[0]
    for column, kind in itertools.product(range(3), kinds):
        leave(robot, model, kind, x + column * model.cell_um // model.pose_unit_um, y, 255)
        deposits += 1
    for heading, kind in itertools.product(range(0, 65536, 4999), kinds):
        answers.append(check_sense(robot, model, kind, x, y, heading))
    sensed, nonzero = len(answers), sum(it != (0, 0) for it in answers)
    scaled = sum(32767 in (abs(it.left), abs(it.right)) for it in answers)
    assert nonzero > sensed / 2, f"only {nonzero} of {sensed} poses sensed anything"
    assert scaled, "no intensity was scaled to fit the wire"
    log(
        f"field: {deposits} DEPOSIT and {traces} TRACE; {sensed} poses sensed, {nonzero} not zero,"
        f" {scaled} scaled to the wire: all as the model says, to the bit"
    )


def check_nearest_node(robot: Robot, model: Model) -> None:
    """Ties go to the larger coordinate; what is on the upper edge goes to the last node."""
    unit, cell = model.pose_unit_um, model.cell_um
    middle = cell // 2 // unit
    base = 10 * cell // unit
    for dx, dy in itertools.product((middle - 1, middle, middle + 1), repeat=2):
        for side in (-1, 1):
            x, y = side * base + dx, base + dy
            leave(robot, model, AHEAD, x, y, 1)
    for column, row in itertools.product(range(-1, 3), repeat=2):
        for side in (-1, 1):
            x = side * base + column * cell // unit
            y = base + row * cell // unit
            for heading in (0, 16384, 32768, 49152, 8192, 12345):
                check_sense(robot, model, AHEAD, x, y, heading)
    left, bottom = model.origin_x_um // unit, model.origin_y_um // unit
    right, top = left + model.width_um // unit, bottom + model.height_um // unit
    for x, y in itertools.product((left, right), (bottom, top)):
        before = model.sense(PERMANENT, x, y, 8192)
        check_equal(robot.trace(PERMANENT, x, y, 8192, wide=True), before, f"TRACE_WIDE ({x}, {y})")
        model.deposit(PERMANENT, x, y, 1)
        check_sense(robot, model, PERMANENT, x, y, 24576)
    log("nodes: ties and all four corners of the map as section 10 says")


def check_evaporation(robot: Robot, model: Model) -> None:
    """Intensity steps down by whole quanta, never up, and ends at nothing."""
    kind = model.pheromones[FLEETING]
    quanta = 8
    per_quantum = 4096 * kind.quantum_millionths // 1_000_000
    robot.deposit(FLEETING, 2000, 2000, quanta)
    seen = [quanta * per_quantum]
    samples = 0
    deadline = time.monotonic() + PATIENCE_S
    while seen[-1]:
        left, right = robot.sense(FLEETING, 2000, 2000, 0)
        samples += 1
        check_equal(left, right, "both antennas are within the core")
        assert left % per_quantum == 0, f"{left} is not a whole number of quanta"
        assert 0 <= left <= seen[-1], f"intensity rose from {seen[-1]} to {left}"
        assert time.monotonic() < deadline, f"{left} does not evaporate"
        if left != seen[-1]:
            seen.append(left)
        time.sleep(0.002)  # nothing depends on it; it spares the machine
    check_equal(robot.sense(FLEETING, 2000, 2000, 0), (0, 0), "what has evaporated stays away")
    levels = [level // per_quantum for level in seen]
    log(f"evaporation: {quanta} quanta went by {levels} in {samples} samples")


def check_map_full(robot: Robot, model: Model) -> None:
    """Deposits, one to a tile of 8 x 8 nodes, until the memory is used up."""
    robot.hello(1)
    tile = 8 * model.cell_um // model.pose_unit_um
    across = 100_000_000 // model.cell_um // 8
    used: list[tuple[int, int]] = []
    full_at: tuple[int, int] | None = None
    for row, column in itertools.product(range(across), repeat=2):
        x, y = column * tile + 30, row * tile + 30
        seq = robot.next_seq
        try:
            robot.deposit(4, x, y, 2)
        except ErrorAnswer as refused:
            check_equal(refused.reason, 9, str(refused))
            full_at = (x, y)
            break
        model.deposit(4, x, y, 2)
        used.append((x, y))
    assert full_at is not None, f"{len(used)} tiles and no end"
    assert len(used) > 100, f"the map is full after {len(used)} tiles only"
    x, y = full_at
    body = build("DEPOSIT", robot.client_id, type=4, seq=seq, x=x, y=y, quanta=2)
    how = "DEPOSIT on a map of 1 MiB, one to a tile"
    robot.expect_error(body, 9, seq, how)  # stored, so this is the repetition
    robot.expect_error(body, 9, seq, how)
    refused_as(9, lambda: robot.trace(4, x, y, 0))
    refused_as(9, lambda: robot.trace(4, x, y, 0, wide=True))
    told = robot.hello(1)
    check_equal((told.last_opcode, told.last_seq), (0x64, (seq + 2) % 256), "map full is stored")
    x, y = used[0]
    leave(robot, model, 4, x, y, 1)
    check_equal(robot.ping(b"still there"), b"still there", "PING with a full map")
    random_pose = random.Random(9)
    nonzero = 0
    for _ in range(50):
        x, y = random_pose.choice(used)
        x, y = x + random_pose.randint(-30, 30), y + random_pose.randint(-30, 30)
        nonzero += check_sense(robot, model, 4, x, y, random_pose.randrange(65536)) != (0, 0)
    assert nonzero > 25, f"{nonzero} poses of 50 sensed anything"
    log(f"map full: after {len(used)} tiles in 1 MiB; stored; old tiles still take and sense")
