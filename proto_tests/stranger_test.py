#!/usr/bin/env python3
"""Talks to a real daemon over a pseudo-terminal, knowing the specification only.

Usage: stranger_test.py BIN_DIR [--seed N]

Starts BIN_DIR/pheromoned twice, each time in a directory of its own, and plays robots with
stranger.py. What the daemon answers is compared with protocol/README.md and the vectors, and the
field with a naive model made from section 10. Ends with exit status 0, or with an AssertionError.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.dont_write_bytecode = True
import stranger  # noqa: E402
from stranger import (  # noqa: E402
    DLE,
    PAD,
    START,
    Client,
    HelloAnswer,
    Line,
    Message,
    Model,
    NoAnswer,
    NotAMessage,
    OffTheMap,
    Pheromone,
    Refused,
    Smell,
    build,
    encode,
    open_terminal,
    parse,
)

PATIENCE = 10.0
"""Seconds until the daemon is given up; only ever waited for if something is wrong."""

TIMEOUT = 3.0
"""Seconds to wait for an answer."""

STARTED = time.monotonic()


def log(text: str) -> None:
    print(f"{time.monotonic() - STARTED:6.2f} s  {text}", flush=True)


def check_equal(got: object, expected: object, what: str) -> None:
    assert got == expected, f"{what}: got {got}, expected {expected}"


# ---------------------------------------------------------------- configurations


@dataclasses.dataclass(frozen=True)
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


# ---------------------------------------------------------------- the daemon


class Daemon:
    """pheromoned in a directory of its own; ends with the `with` block, whatever happens."""

    def __init__(self, program: Path, directory: Path, setup: Setup) -> None:
        self.directory = directory
        config = directory / "pheromoned.toml"
        config.write_text(setup.toml(), encoding="utf-8")
        self._log = directory / "pheromoned.log"
        with self._log.open("wb") as output:
            self.process = subprocess.Popen(
                (str(program), "--config", str(config)),
                cwd=directory,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def path(self, link: str) -> Path:
        return self.directory / f"{link}.pty"

    def check_alive(self, when: str) -> None:
        status = self.process.poll()
        assert status is None, f"the daemon ended with status {status} {when}\n{self.output()}"

    def output(self) -> str:
        text = self._log.read_text(encoding="utf-8", errors="replace")
        return "the daemon wrote:\n" + "\n".join(text.splitlines()[-30:])

    def wait_for(self, link: str) -> Path:
        """Waits until the link's terminal is there."""
        path = self.path(link)
        deadline = time.monotonic() + PATIENCE
        while not path.exists():
            self.check_alive(f"before {path.name} was there")
            assert time.monotonic() < deadline, f"no {path.name}\n{self.output()}"
            time.sleep(0.01)
        assert path.is_symlink(), f"{path.name} is no symbolic link"
        return path

    def stop(self, setup: Setup) -> None:
        """SIGTERM: exit status 0, and the terminals' names are gone."""
        self.check_alive("before it was told to")
        self.process.send_signal(signal.SIGTERM)
        try:
            status = self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"SIGTERM does not end the daemon\n{self.output()}") from None
        assert status == 0, f"exit status {status} after SIGTERM\n{self.output()}"
        for link in setup.links:
            assert not self.path(link).is_symlink(), f"{link}.pty is still there after the end"

    def __enter__(self) -> Daemon:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        if isinstance(error, NoAnswer | OSError | AssertionError):
            print(self.output(), file=sys.stderr)


class Robot(Client):
    """A client that also says improper things, and looks closely at what comes back."""

    def __init__(self, line: Line, client_id: int) -> None:
        super().__init__(line, client_id, timeout=TIMEOUT, tries=1)

    def say(self, wire: bytes) -> list[Message]:
        """Sends some bytes, then a PING with a fresh payload; gives the messages that the daemon
        sent before the echo. All bytes must have been proper frames of the server."""
        before = self.line.decoder.dropped.total()
        self.line.send(wire)
        said = []
        try:
            heard = self.resynchronise()
        except NoAnswer:
            raise AssertionError(f"no echo of a PING after {wire.hex(' ')}") from None
        for body in heard:
            try:
                message = parse(body)
            except NotAMessage as error:
                raise AssertionError(f"the daemon sent {body.hex(' ')}: {error}") from None
            assert body[1] & 0x80, f"the daemon says what only clients say: {message}"
            said.append(message)
        dropped = self.line.decoder.dropped
        assert dropped.total() == before, f"the daemon sent broken frames: {dict(dropped)}"
        return said

    def say_body(self, body: bytes) -> list[Message]:
        return self.say(encode(body))

    def answer_to(self, body: bytes) -> Message:
        """The only answer to a request."""
        said = self.say_body(body)
        check_equal(len(said), 1, f"answers to {body.hex(' ')} ({[str(m) for m in said]})")
        answer = stranger.answers(build_again(said[0]), body)
        assert answer is not None, f"{said[0]} is no answer to {body.hex(' ')}"
        return answer

    def expect_silence(self, body: bytes, why: str) -> None:
        said = self.say_body(body)
        assert not said, f"{why}: must not be answered, but {[str(m) for m in said]}"

    def expect_error(self, body: bytes, reason: int, seq: int, how: str) -> None:
        """The answer is this ERROR and nothing else; enters it into the table."""
        answer = self.answer_to(body)
        expected = Message(
            "ERROR",
            body[0],
            {"refused_opcode": body[1], "reason": reason, "seq": seq},
        )
        check_equal(str(answer), str(expected), how)
        RAISED.setdefault(reason, how)


RAISED: dict[int, str] = {}
"""How each reason was raised over the wire first."""


def build_again(message: Message) -> bytes:
    return build(message.name, message.client_id, **message.fields)


# ---------------------------------------------------------------- what is tested


def test_hello(daemon: Daemon, setup: Setup, link: str, robot: Robot) -> HelloAnswer:
    model = setup.model
    mask = sum(1 << kind for kind in model.pheromones)
    first = robot.hello(nonce=0x1002, firmware_version=0x10, capabilities=0)
    expected = HelloAnswer(
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


def test_ping(robot: Robot, seed: random.Random) -> None:
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


def check_sense(robot: Robot, model: Model, kind: int, x: int, y: int, heading: int) -> Smell:
    expected = model.sense(kind, x, y, heading)
    fits = -32768 <= x <= 32767 and -32768 <= y <= 32767
    where = f"type {kind} at ({x}, {y}) heading {heading}"
    got = robot.sense_wide(kind, x, y, heading)
    check_equal(got, expected, f"SENSE_WIDE {where}")
    if fits:
        check_equal(robot.sense(kind, x, y, heading), expected, f"SENSE {where}")
    return got


def test_worked_example(robot: Robot, model: Model) -> None:
    robot.deposit(PERMANENT, 1000, 600, 1)
    model.deposit(PERMANENT, 1000, 600, 1)
    check_equal(robot.sense(PERMANENT, 1000, 500, 0), (4096, 2560), "the worked example")
    check_sense(robot, model, PERMANENT, 1000, 500, 0)
    log("the worked example of section 13 comes out as printed")


def test_field(robot: Robot, model: Model, seed: random.Random, turns: int) -> None:
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

    sensed = nonzero = scaled = deposits = traces = 0
    for _ in range(turns):
        kind = seed.choice(kinds)
        x, y = somewhere()
        heading = seed.choice((seed.randrange(65536), 8192 * seed.randrange(8)))
        narrow = -32768 <= x <= 32767 and -32768 <= y <= 32767
        if narrow and seed.random() < 0.6:
            quanta = seed.choice((1, 1, 2, 3, seed.randint(1, 255)))
            robot.deposit(kind, x, y, quanta)
            model.deposit(kind, x, y, quanta)
            deposits += 1
        else:
            trace = robot.trace if narrow and seed.random() < 0.7 else robot.trace_wide
            expected = model.sense(kind, x, y, heading)
            got = trace(kind, x, y, heading)
            check_equal(got, expected, f"TRACE type {kind} at ({x}, {y}) heading {heading}")
            model.deposit(kind, x, y, 1)
            traces += 1
        kind = seed.choice(kinds)
        x, y = somewhere()
        heading = seed.choice((seed.randrange(65536), 8192 * seed.randrange(8)))
        smell = check_sense(robot, model, kind, x, y, heading)
        sensed += 1
        nonzero += smell != (0, 0)
        scaled += 32767 in (abs(smell.left), abs(smell.right))
    assert nonzero > sensed / 2, f"only {nonzero} of {sensed} poses smelled anything"
    assert scaled, "no intensity was scaled to fit the wire"
    log(
        f"field: {deposits} DEPOSIT and {traces} TRACE; {sensed} poses sensed, {nonzero} not zero,"
        f" {scaled} scaled to the wire: all as the model says, to the bit"
    )


def test_nearest_node(robot: Robot, model: Model) -> None:
    """Ties go to the larger coordinate; what is on the upper edge goes to the last node."""
    unit, cell = model.pose_unit_um, model.cell_um
    middle = cell // 2 // unit
    base = 10 * cell // unit
    for dx, dy in itertools.product((middle - 1, middle, middle + 1), repeat=2):
        for side in (-1, 1):
            x, y = side * base + dx, base + dy
            robot.deposit(AHEAD, x, y, 1)
            model.deposit(AHEAD, x, y, 1)
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
        check_equal(robot.trace_wide(PERMANENT, x, y, 8192), before, f"TRACE_WIDE ({x}, {y})")
        model.deposit(PERMANENT, x, y, 1)
        check_sense(robot, model, PERMANENT, x, y, 24576)
    log("nodes: ties and all four corners of the map as section 10 says")


def test_evaporation(robot: Robot, model: Model) -> None:
    """Intensity steps down by whole quanta, never up, and ends at nothing."""
    kind = model.pheromones[FLEETING]
    quanta = 8
    per_quantum = 4096 * kind.quantum_millionths // 1_000_000
    robot.deposit(FLEETING, 2000, 2000, quanta)
    seen = [quanta * per_quantum]
    samples = 0
    deadline = time.monotonic() + PATIENCE
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


def test_exactly_once(robot: Robot, other_link: Line, model: Model) -> None:
    me = robot.client_id
    other_id = 200
    x, y = 5000, 5000

    def deposit(seq: int, quanta: int = 1, client_id: int = me) -> bytes:
        return build("DEPOSIT", client_id, type=PERMANENT, seq=seq, x=x, y=y, quanta=quanta)

    def check_quanta(expected: int, when: str) -> None:
        got = robot.sense(PERMANENT, x, y, 0)
        # 150 mm from the node: (500 - 150) / 400 of each quantum
        check_equal(got, (expected * 3584, expected * 3584), f"intensity {when}")

    stranger_robot = Robot(robot.line, other_id)
    how = "DEPOSIT before HELLO"
    stranger_robot.expect_error(deposit(77, client_id=other_id), 6, 77, how)
    check_quanta(0, "after a DEPOSIT that was refused")
    for name in ("TRACE", "TRACE_WIDE"):
        body = build(name, other_id, type=PERMANENT, seq=16, x=x, y=y, heading=0)
        stranger_robot.expect_error(body, 6, 16, f"{name} before HELLO")
    body = build("EVENT", other_id, seq=16, code=1, argument=0)
    stranger_robot.expect_error(body, 6, 16, "EVENT before HELLO")

    nonce = 500
    robot.hello(nonce)
    first = deposit(10)
    accepted = robot.answer_to(first)
    check_equal((accepted.name, accepted.fields["seq"]), ("DEPOSIT_ANSWER", 10), "DEPOSIT")
    check_quanta(1, "after a DEPOSIT")
    for _ in range(3):
        check_equal(robot.answer_to(first), accepted, "repeated DEPOSIT")
    check_quanta(1, "after three repetitions")

    robot.expect_error(deposit(10, quanta=2), 5, 10, "DEPOSIT of other content, same seq")
    body = build("EVENT", me, seq=10, code=3, argument=7)
    robot.expect_error(body, 5, 10, "EVENT under the seq of a DEPOSIT")
    check_equal(robot.answer_to(first), accepted, "repeated after a reused seq")
    check_quanta(1, "after a reused seq")

    for behind in (1, 2, 127):
        body = deposit((10 - behind) % 256)
        robot.expect_silence(body, f"DEPOSIT {behind} behind")
    check_quanta(1, "after stale requests")

    trace = build("TRACE", me, type=PERMANENT, seq=11, x=x, y=y, heading=0)
    smell = robot.answer_to(trace)
    check_equal((smell.fields["left"], smell.fields["right"]), (3584, 3584), "TRACE")
    check_quanta(2, "after a TRACE")
    check_equal(robot.answer_to(trace), smell, "repeated TRACE tells what it told first")
    check_quanta(2, "after a repeated TRACE")
    robot.expect_silence(first, "the DEPOSIT before the TRACE")

    far_ahead = deposit((11 + 128) % 256)
    check_equal(robot.answer_to(far_ahead).name, "DEPOSIT_ANSWER", "seq 128 ahead")
    check_quanta(3, "after a DEPOSIT 128 ahead")
    robot.expect_silence(deposit((11 + 128 + 129) % 256), "seq 129 ahead, that is 127 behind")

    event = build("EVENT", me, seq=140, code=9, argument=-32768)
    ack = robot.answer_to(event)
    check_equal((ack.name, ack.fields["seq"]), ("EVENT_ACK", 140), "EVENT")
    check_equal(robot.answer_to(event), ack, "repeated EVENT")

    same = robot.hello(nonce)
    check_equal((same.last_opcode, same.last_seq), (0x52, 140), "HELLO with the same nonce")
    check_equal(robot.answer_to(event), ack, "repetition after HELLO with the same nonce")
    robot.expect_silence(deposit(139), "stale after HELLO with the same nonce")
    new = robot.hello(nonce + 1)
    check_equal((new.last_opcode, new.last_seq), (0x52, 140), "HELLO with a new nonce")
    again = robot.hello(nonce + 1)
    check_equal((again.last_opcode, again.last_seq), (0, 0), "the same HELLO again")
    check_equal(robot.answer_to(deposit(139)).name, "DEPOSIT_ANSWER", "any seq after a new nonce")
    check_quanta(4, "after a DEPOSIT under a new nonce")

    # A stored ERROR is repeated; one that is not stored leaves no trace.
    nothing = deposit(150, quanta=0)
    robot.expect_error(nothing, 11, 150, "DEPOSIT of 0 quanta")
    robot.expect_error(nothing, 11, 150, "DEPOSIT of 0 quanta, repeated")
    told = robot.hello(nonce + 1)
    check_equal((told.last_opcode, told.last_seq), (0x21, 150), "a refusal is remembered")
    robot.expect_error(deposit(150), 5, 150, "DEPOSIT under the seq of a refused one")
    robot.expect_error(deposit(151, quanta=0), 11, 151, "DEPOSIT of 0 quanta, next seq")
    robot.expect_error(deposit(152)[:-1], 2, 152, "DEPOSIT one byte short")
    check_equal(robot.answer_to(deposit(152)).name, "DEPOSIT_ANSWER", "seq after ERROR 2")
    check_quanta(5, "at the end")

    # The same ID on another link is another robot.
    twin = Robot(other_link, me)
    twin.expect_error(deposit(153), 6, 153, "DEPOSIT on a link where HELLO was not said")
    told = twin.hello(nonce + 1)
    check_equal((told.last_opcode, told.last_seq), (0, 0), "HELLO on the other link")
    check_equal(twin.answer_to(deposit(153)).name, "DEPOSIT_ANSWER", "on the other link")
    check_equal(robot.answer_to(deposit(152)).name, "DEPOSIT_ANSWER", "on the first link")
    check_quanta(6, "after a DEPOSIT on the other link")
    model.deposit(PERMANENT, x, y, 6)

    robot.hello(nonce + 2)
    for _ in range(300):  # round the whole circle of sequence numbers
        robot.event(2, 1)
    log("exactly once: repeated, reused, stale, far ahead, new nonce, stored refusals, wrap-around")


def test_errors(robot: Robot, model: Model) -> None:
    me = robot.client_id
    robot.hello(9000)
    for opcode in (0x10, 0x41, 0x45, 0x40, 0x4F, 0x50, 0x53, 0x5F, 0x70, 0x73, 0x7E, 0x7F):
        body = bytes((me, opcode, 0xA5, 0, 0, 0, 0, 0))
        robot.expect_error(body, 1, 0, f"opcode {opcode:02X}")
    for opcode in (0x20, 0x30, 0x60):
        body = bytes((me, opcode, 0xA5, 0, 0, 0, 0))
        robot.expect_error(body, 1, 0xA5, f"opcode {opcode:02X}, a type 0")
        robot.expect_error(body[:2], 1, 0, f"opcode {opcode:02X} without DATA")
    whole = {
        "SENSE": {"type": 1, "x": 0, "y": 0, "heading": 0},
        "SENSE_WIDE": {"type": 1, "x": 0, "y": 0, "heading": 0},
        "DEPOSIT": {"type": 1, "seq": 99, "x": 0, "y": 0, "quanta": 1},
        "TRACE": {"type": 1, "seq": 99, "x": 0, "y": 0, "heading": 0},
        "TRACE_WIDE": {"type": 1, "seq": 99, "x": 0, "y": 0, "heading": 0},
        "EVENT": {"seq": 99, "code": 1, "argument": 0},
        "HELLO": {"nonce": 9000, "firmware_version": 1, "capabilities": 0},
    }
    for name, fields in whole.items():
        body = build(name, me, **fields)
        seq = 99 if "seq" in fields else 0
        for length in (*range(2, len(body)), len(body) + 1, 66):
            wrong = (body + b"\x01" * 64)[:length]
            expected = seq if length > 2 else 0
            robot.expect_error(wrong, 2, expected, f"{name} with {length - 2} bytes of DATA")
    robot.expect_error(bytes((me, 0x72)) + b"x" * 17, 2, 0, "PING with 17 bytes")
    unknown = build("DEPOSIT", me, type=NOT_CONFIGURED, seq=99, x=0, y=0, quanta=1)
    robot.expect_error(unknown[:-1], 2, 99, "DEPOSIT of an unknown type, too short")

    outside = [
        (x, y)
        for x in (model.origin_x_um // 1000, 0, (model.origin_x_um + model.width_um) // 1000)
        for y in (
            model.origin_y_um // 1000 - 1,
            (model.origin_y_um + model.height_um) // 1000 + 1,
        )
    ]
    outside += [
        (model.origin_x_um // 1000 - 1, 0),
        ((model.origin_x_um + model.width_um) // 1000 + 1, 0),
        (2**31 - 1, 2**31 - 1),
        (-(2**31), -(2**31)),
    ]
    for x, y in outside:
        try:
            model.position(x, y)
        except OffTheMap:
            pass
        else:
            raise AssertionError(f"({x}, {y}) is on the map; the test is wrong")
        body = build("SENSE_WIDE", me, type=PERMANENT, x=x, y=y, heading=0)
        robot.expect_error(body, 3, 0, "SENSE_WIDE beyond the edge")
        seq = robot.next_seq
        refused_as(3, lambda: robot.trace_wide(PERMANENT, x, y, 0))
        check_equal(robot.next_seq, (seq + 1) % 256, "a stored refusal takes its seq")
        if x == 0:
            body = build("SENSE", me, type=PERMANENT, x=x, y=y, heading=0)
            robot.expect_error(body, 3, 0, "SENSE beyond the edge")
            refused_as(3, lambda: robot.deposit(PERMANENT, x, y, 1))
            refused_as(3, lambda: robot.trace(PERMANENT, x, y, 0))
    body = build("DEPOSIT", me, type=PERMANENT, seq=robot.next_seq, x=0, y=-3001, quanta=1)
    robot.expect_error(body, 3, robot.next_seq, "DEPOSIT beyond the edge")
    robot.next_seq = (robot.next_seq + 1) % 256
    # Which check comes first: the type, then the position, then the values.
    refused_as(4, lambda: robot.deposit(NOT_CONFIGURED, 0, -32768, 0))
    refused_as(3, lambda: robot.deposit(PERMANENT, 0, -32768, 0))

    body = build("SENSE", me, type=NOT_CONFIGURED, x=0, y=0, heading=0)
    robot.expect_error(body, 4, 0, "SENSE of a type that is not configured")
    refused_as(4, lambda: robot.sense_wide(NOT_CONFIGURED, 0, 0, 0))
    refused_as(4, lambda: robot.deposit(NOT_CONFIGURED, 0, 0, 1))
    refused_as(4, lambda: robot.trace(NOT_CONFIGURED, 0, 0, 0))
    refused_as(4, lambda: robot.trace_wide(NOT_CONFIGURED, 0, 0, 0))
    for code in (0, 10, 255):
        refused_as(11, lambda: robot.event(code))
    for code in range(1, 10):
        robot.event(code, -code)

    silent = {
        "a frame of the server": build("PING_ANSWER", me, payload=b"echo"),
        "an unknown opcode with bit 7": bytes((me, 0xFF)),
        "an ERROR": build("ERROR", me, refused_opcode=1, reason=1, seq=0),
        "a COMMAND": build("COMMAND", me, seq=1, code=1),
        "ID FF": bytes((0xFF, 0x72)) + b"anybody?",
        "an unknown opcode from ID FF": bytes((0xFF, 0x41)),
        "ID 00": bytes((0x00, 0x72)) + b"nobody",
        "opcode 00": bytes((me, 0x00)),
        "an ACK of nothing": build("COMMAND_ACK", me, seq=1, code=1, result=0),
        "an ACK without DATA": bytes((me, 0x51)),
        "an ACK too long": bytes((me, 0x51, 1, 2, 3, 4, 5)),
    }
    for what, body in silent.items():
        robot.expect_silence(body, what)
    log("errors: reasons, their order, the seq in them, and what is never answered")


def refused_as(reason: int, request: Callable[[], object]) -> None:
    try:
        got = request()
    except Refused as refused:
        check_equal(refused.reason, reason, str(refused))
    else:
        raise AssertionError(f"{got} instead of ERROR {reason}")


def test_every_vector(line: Line) -> None:
    """Each vector's bytes go to the daemon; what comes back is what the vector's verdict allows."""
    robot = Robot(line, 77)
    frames = stranger.read_vectors(stranger.VECTORS / "frames.txt")
    for name, unstuffed, wire, verdict in frames:
        said = robot.say(stranger.from_hex(wire))
        body = stranger.from_hex(unstuffed)
        what = f"vector {name}"
        if unstuffed == "-" or verdict == "refused" or body[1] & 0x80 or body[1] == 0x51:
            assert not said, f"{what} must not be answered, but {[str(m) for m in said]}"
            continue
        check_equal(len(said), 1, f"answers to {what}")
        answer = said[0]
        if verdict in ("unknown-opcode", "bad-length"):
            reason = 1 if verdict == "unknown-opcode" else 2
            got = (answer.name, answer.client_id, answer.fields.get("refused_opcode"))
            check_equal(got, ("ERROR", body[0], body[1]), what)
            check_equal(answer.fields["reason"], reason, what)
        else:
            matched = stranger.answers(build_again(answer), body)
            assert matched is not None, f"{answer} is no answer to {what}"
    streams = stranger.read_vectors(stranger.VECTORS / "streams.txt")
    for name, data, delivered in streams:
        said = robot.say(stranger.from_hex(data))
        parts = [] if delivered == "-" else delivered.split(";")
        bodies = [stranger.from_hex(part) for part in parts]
        check_equal(len(said), len(bodies), f"answers to stream {name}")
        for answer, body in zip(said, bodies):
            same = (answer.client_id, build_again(answer)[1]) == (body[0], body[1] | 0x80)
            is_error = (answer.name, answer.fields.get("refused_opcode")) == ("ERROR", body[1])
            assert same or is_error, f"stream {name}: {answer} is no answer to {body.hex(' ')}"
    log(f"vectors: {len(frames)} frames and {len(streams)} streams, each met as it should")


# Those that change something come first: nobody has said HELLO for them yet, so nothing may change.
DAMAGED = (
    "deposit_one",
    "deposit_dle",
    "trace_dle",
    "trace_wide_dle",
    "event_dle",
    "sense_of_the_worked_example",
    "sense_id_is_dle",
    "sense_crc_is_dle_etx",
    "sense_wide_dle",
    "ping_nonce",
    "command_ack_dle",
    "hello_dle",
)


def damaged(wire: bytes) -> Iterator[bytes]:
    """A frame with a byte less, a byte or an escape more, or a bit turned."""
    for at in range(len(wire)):
        yield wire[:at] + wire[at + 1 :]
    for at in range(len(wire) + 1):
        for value in (0x00, 0x02, 0x03, 0x10, 0xFF):
            yield wire[:at] + bytes((value,)) + wire[at:]
            yield wire[:at] + bytes((DLE, value)) + wire[at:]
    for at in range(len(wire)):
        for bit in range(8):
            yield wire[:at] + bytes((wire[at] ^ (1 << bit),)) + wire[at + 1 :]


def check_bad_input(robot: Robot, wire: bytes) -> int:
    """What a strict decoder finds in these bytes is answered, all else is not; gives how often."""
    said = robot.say(wire)
    found = stranger.Decoder().feed(wire)
    to_answer = [
        body for body in found if body[0] != 0xFF and body[1] & 0x80 == 0 and body[1] != 0x51
    ]
    what = f"answers to {wire.hex(' ')} ({[str(message) for message in said]})"
    check_equal(len(said), len(to_answer), what)
    for message, body in zip(said, to_answer):
        assert stranger.answers(build_again(message), body), f"{message} is none of the {what}"
        try:
            parse(body)
        except NotAMessage as error:
            reason = 1 if isinstance(error, stranger.UnknownOpcode) else 2
            check_equal(message.fields.get("reason"), reason, what)
    return len(said)


def test_bad_input(daemon: Daemon, line: Line, seed: random.Random) -> None:
    robot = Robot(line, 78)
    frames = {row[0]: row for row in stranger.read_vectors(stranger.VECTORS / "frames.txt")}
    sent = answered = 0
    for name in DAMAGED:
        check_equal(frames[name][3], "ok", f"the verdict of vector {name}")
        for wire in damaged(stranger.from_hex(frames[name][2])):
            sent += 1
            answered += check_bad_input(robot, wire)
        daemon.check_alive(f"after damaged {name}")
    log(f"bad input: {sent} damaged frames, {answered} of them answered, a PING after each")

    bursts = 400
    total = answered = 0
    for _ in range(bursts):
        length = seed.choice((1, 2, 3, 10, 100, 1000))
        if seed.random() < 0.5:
            garbage = seed.randbytes(length)
        else:
            garbage = bytes(seed.choices((0x10, 0x02, 0x03, 0x00, 0x72, 0xFF), k=length))
        total += length
        answered += check_bad_input(robot, garbage)
    daemon.check_alive("after garbage")
    log(f"bad input: {bursts} bursts of garbage, {total} bytes, {answered} answers, a PING each")


def test_odd_pieces(daemon: Daemon, link: str, line: Line) -> None:
    robot = Robot(line, 16)
    ping = build("PING", 16, payload=bytes((DLE,)) * 16)
    echo = build("PING_ANSWER", 16, payload=bytes((DLE,)) * 16)
    wire = encode(ping)

    def check_echoes(count: int, said: list[Message], what: str) -> None:
        check_equal([build_again(message) for message in said], [echo] * count, what)

    for byte in wire:
        line.send(bytes((byte,)))
    check_echoes(1, robot.say(b""), "a PING byte by byte")
    for byte in wire:
        line.send(bytes((byte,)))
        time.sleep(0.001)  # so that the daemon reads them one by one
    check_echoes(1, robot.say(b""), "a PING dribbled")
    check_echoes(2, robot.say(wire + wire), "two frames in one write")
    check_echoes(20, robot.say(wire * 20), "twenty frames in one write")
    for cut in range(1, len(wire)):
        # A tail may hold a false beginning, so a pad and the next frame must follow.
        check_echoes(1, robot.say(wire[cut:] + PAD + wire), f"a frame from byte {cut} on")
        check_echoes(1, robot.say(wire[:cut] + PAD + wire), f"a frame up to byte {cut}")
    line.send(wire[:20])
    with open_terminal(daemon.path(link)) as second:
        second.send(wire[20:])
        check_echoes(1, robot.say(b""), "a frame sent through two openings of the terminal")
    log("odd pieces: dribbled, two in one write, from the middle, cut short")


def test_reopening(daemon: Daemon, link: str) -> None:
    for turn in range(20):
        with open_terminal(daemon.path(link)) as line:
            check_equal(Robot(line, 5).ping(bytes((turn,))), bytes((turn,)), "PING after opening")
            line.send(START + bytes((5, DLE)))  # and break off after an odd DLE
    daemon.check_alive("after the terminal was closed")
    log("reopening: 20 clients came, broke off and went")


def test_program(daemon: Daemon, link: str) -> None:
    """stranger.py as a program."""

    def run(*words: str) -> str:
        command = (sys.executable, "-B", stranger.__file__, "--id", "9", str(daemon.path(link)))
        done = subprocess.run(
            (*command, *words), capture_output=True, text=True, timeout=PATIENCE, check=False
        )
        assert done.returncode == 0, f"stranger.py {words}: {done.stderr}"
        return done.stdout

    assert "protocol_version 1\n" in run("hello"), "hello"
    assert run("ping", "1002").startswith("echo 10 02 after "), "ping"
    assert run("deposit", "1", "-7000", "600", "2") == "deposited\n", "deposit"
    expected = "left 8192 right 5120 (units: 2 1.25)\n"
    check_equal(run("sense", "1", "-7000", "500", "0"), expected, "sense")
    check_equal(run("trace", "1", "-7000", "500", "0"), expected, "trace")
    log("the program: hello, ping, deposit, sense, trace")


def test_map_full(robot: Robot, model: Model) -> None:
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
        except Refused as refused:
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
    refused_as(9, lambda: robot.trace_wide(4, x, y, 0))
    told = robot.hello(1)
    check_equal((told.last_opcode, told.last_seq), (0x64, (seq + 2) % 256), "map full is stored")
    x, y = used[0]
    robot.deposit(4, x, y, 1)
    model.deposit(4, x, y, 1)
    check_equal(robot.ping(b"still there"), b"still there", "PING with a full map")
    random_pose = random.Random(9)
    nonzero = 0
    for _ in range(50):
        x, y = random_pose.choice(used)
        x, y = x + random_pose.randint(-30, 30), y + random_pose.randint(-30, 30)
        nonzero += check_sense(robot, model, 4, x, y, random_pose.randrange(65536)) != (0, 0)
    assert nonzero > 25, f"{nonzero} poses of 50 smelled anything"
    log(f"map full: after {len(used)} tiles in 1 MiB; stored; old tiles still take and smell")


def report_errors() -> None:
    elsewhere = {
        7: "needs a journal that refuses changes; covered by unit tests",
        8: "needs a journal that refuses changes; covered by unit tests",
        10: "not raised in this version",
        12: "not raised in this version",
    }
    print("\nreason  name                 how it was raised over the wire")
    for reason in range(1, 13):
        how = RAISED.get(reason) or f"({elsewhere.get(reason, 'NOT RAISED')})"
        print(f"{reason:6}  {stranger.REASONS[reason]:<19}  {how}")
    missing = {1, 2, 3, 4, 5, 6, 9, 11} - RAISED.keys()
    assert not missing, f"never raised: {missing}"
    unexpected = RAISED.keys() & {7, 8, 10, 12}
    assert not unexpected, f"raised although they should not be: {unexpected}"
    print()


# ---------------------------------------------------------------- all of it


def play(program: Path, seed: random.Random) -> None:
    with tempfile.TemporaryDirectory(prefix="stranger-") as directory:
        setup, model = WIDE_MAP, WIDE_MAP.model
        with Daemon(program, Path(directory), setup) as daemon:
            path_a, path_b = (daemon.wait_for(link) for link in setup.links)
            log(f"the daemon is up: {path_a.name}, {path_b.name}")
            with open_terminal(path_a) as a, open_terminal(path_b) as b:
                robot = Robot(a, 7)
                test_hello(daemon, setup, "radio-a", robot)
                test_ping(robot, seed)
                test_worked_example(robot, model)
                test_field(robot, model, seed, 500)
                test_nearest_node(robot, model)
                test_evaporation(robot, model)
                test_exactly_once(Robot(a, 40), b, model)
                test_errors(Robot(a, 253), model)
                test_bad_input(daemon, b, seed)
                test_every_vector(b)
                test_odd_pieces(daemon, "radio-b", b)
                before = a.decoder.dropped.total() + b.decoder.dropped.total()
                check_equal(before, 0, "broken frames from the daemon")
                # All that noise on the other link has left no trace in the field.
                places = [(1000, 500), (100, 200), (4112, -2992), (528, 784), (0, 0), (5000, 5000)]
                for x, y in places:
                    for kind in (PERMANENT, AHEAD, FAINT, AHEAD_SLOW):
                        check_sense(robot, model, kind, x, y, 4112)
                check_equal(robot.hello(0x1002).last_opcode & 0xC0, 0, "robot 7 of radio-a")
            test_reopening(daemon, "radio-b")
            test_program(daemon, "radio-a")
            daemon.stop(setup)
            log("SIGTERM: exit status 0, the terminals are gone")

    with tempfile.TemporaryDirectory(prefix="stranger-") as directory:
        setup, model = SMALL_MEMORY, SMALL_MEMORY.model
        with Daemon(program, Path(directory), setup) as daemon:
            with open_terminal(daemon.wait_for("radio-c")) as c:
                robot = Robot(c, 254)
                test_hello(daemon, setup, "radio-c", robot)
                test_field(robot, model, seed, 100)
                test_map_full(robot, model)
            daemon.stop(setup)


def main() -> int:
    parser = argparse.ArgumentParser(description="Tests pheromoned over a pseudo-terminal.")
    parser.add_argument("bin_dir", type=Path, metavar="BIN_DIR", help="holds pheromoned")
    parser.add_argument("--seed", type=int, default=20090317, help="of the random numbers")
    options = parser.parse_args()
    program = options.bin_dir.resolve() / "pheromoned"
    assert program.is_file(), f"there is no {program}"
    log(f"self-test: {stranger.self_test()}")
    log(f"seed {options.seed}")
    play(program, random.Random(options.seed))
    report_errors()
    log("all good")
    return 0


if __name__ == "__main__":
    sys.exit(main())
