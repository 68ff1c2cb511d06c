#!/usr/bin/env python3
"""A client of the pheromone protocol, version 1, by somebody who has read the specification only.

Nothing here comes from the server's source: protocol/README.md and the vectors are all that was
used. "Section n" below is a section of that page. Python 3.11, standard library only.

As a library:

    with open_terminal("radio-a.pty") as line:
        robot = Client(line, client_id=7)
        server = robot.hello(nonce=42)
        robot.deposit(pheromone=1, x=1000, y=600, quanta=1)
        print(robot.sense(pheromone=1, x=1000, y=500, heading=0))

As a program:

    stranger.py radio-a.pty hello
    stranger.py radio-a.pty ping DEADBEEF
    stranger.py radio-a.pty deposit 1 1000 600 1
    stranger.py radio-a.pty sense 1 1000 500 0
    stranger.py radio-a.pty trace --wide 1 40000 500 16384
    stranger.py --self-test
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import os
import secrets
import select
import struct
import sys
import termios
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Final, NamedTuple, Self

# ---------------------------------------------------------------- section 1: the frame

DLE: Final = 0x10
STX: Final = 0x02
ETX: Final = 0x03
START: Final = bytes((DLE, STX))
END: Final = bytes((DLE, ETX))
MOST_DATA: Final = 64
MOST_UNSTUFFED: Final = MOST_DATA + 4
PAD: Final = b"\x00"
"""Sent before a frame when nobody can know what stood before it (section 2)."""


def crc16(data: bytes) -> int:
    """CRC-16/ARC."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc


def encode(body: bytes) -> bytes:
    """The frame of a body, that is of CLIENT_ID, OPCODE and DATA, as it goes onto the wire."""
    if not 2 <= len(body) <= 2 + MOST_DATA:
        raise ValueError(f"a body has 2 to {2 + MOST_DATA} bytes, this one {len(body)}")
    checked = body + crc16(body).to_bytes(2, "little")
    return START + checked.replace(bytes((DLE,)), bytes((DLE, DLE))) + END


# ---------------------------------------------------------------- section 2: receiving


class Decoder:
    """Finds frames in a stream of bytes, and drops everything else.

    There is no gap timeout: a pseudo-terminal has none. `dropped` counts what was thrown away
    inside of frames, by the names that the vectors use; `ignored` counts bytes outside of frames.
    """

    def __init__(self) -> None:
        self.dropped: Counter[str] = Counter()
        self.ignored = 0
        self._body: bytearray | None = None  # None outside of a frame
        self._after_dle = False

    def feed(self, data: bytes) -> list[bytes]:
        """Takes some bytes, gives the bodies of the frames that they complete."""
        found = []
        for byte in data:
            body = self._take(byte)
            if body is not None:
                found.append(body)
        return found

    def _take(self, byte: int) -> bytes | None:
        if self._body is None:
            if self._after_dle and byte == STX:
                self._body = bytearray()
                self._after_dle = False
                self.ignored -= 1  # the DLE did belong to a frame
            else:
                self._after_dle = byte == DLE
                self.ignored += 1
            return None
        if not self._after_dle:
            if byte == DLE:
                self._after_dle = True
            else:
                self._append(byte)
            return None
        self._after_dle = False
        if byte == DLE:
            self._append(byte)
        elif byte == STX:
            self.dropped["begun-again"] += 1
            self._body = bytearray()
        elif byte == ETX:
            complete, self._body = bytes(self._body), None
            return self._judge(complete)
        else:
            self._drop("bad-escape")
        return None

    def _append(self, byte: int) -> None:
        assert self._body is not None
        if len(self._body) == MOST_UNSTUFFED:
            self._drop("oversize")
        else:
            self._body.append(byte)

    def _drop(self, why: str) -> None:
        self.dropped[why] += 1
        self._body = None

    def _judge(self, complete: bytes) -> bytes | None:
        if len(complete) < 4:
            self.dropped["runt"] += 1
        elif crc16(complete) != 0:
            self.dropped["bad-crc"] += 1
        elif complete[0] == 0 or complete[1] == 0:
            self.dropped["refused"] += 1
        else:
            return complete[:-2]
        return None


# ---------------------------------------------------------------- section 4: messages

Value = int | bytes


class NotAMessage(ValueError):
    """A good frame that is no message."""


class UnknownOpcode(NotAMessage):
    pass


class BadLength(NotAMessage):
    pass


@dataclasses.dataclass(frozen=True)
class Layout:
    """How a message is laid out: its opcode, whether that holds a pheromone type, its fields."""

    name: str
    opcode: int
    typed: bool
    format: str
    fields: tuple[str, ...]

    @property
    def length(self) -> int:
        return struct.calcsize(self.format)


def _layout(name: str, opcode: int, typed: bool, format: str, fields: str) -> Layout:
    return Layout(name, opcode, typed, "<" + format, tuple(fields.split()))


LAYOUTS: Final = (
    _layout("SENSE", 0x00, True, "hhH", "x y heading"),
    _layout("SENSE_WIDE", 0x10, True, "iiH", "x y heading"),
    _layout("DEPOSIT", 0x20, True, "BhhB", "seq x y quanta"),
    _layout("TRACE", 0x30, True, "BhhH", "seq x y heading"),
    _layout("TRACE_WIDE", 0x60, True, "BiiH", "seq x y heading"),
    _layout("COMMAND_ACK", 0x51, False, "BBh", "seq code result"),
    _layout("EVENT", 0x52, False, "BBh", "seq code argument"),
    _layout("HELLO", 0x71, False, "HBB", "nonce firmware_version capabilities"),
    _layout("PING", 0x72, False, "", ""),
    _layout("SENSE_ANSWER", 0x80, True, "hh", "left right"),
    _layout("SENSE_WIDE_ANSWER", 0x90, True, "hh", "left right"),
    _layout("DEPOSIT_ANSWER", 0xA0, True, "B", "seq"),
    _layout("TRACE_ANSWER", 0xB0, True, "Bhh", "seq left right"),
    _layout("TRACE_WIDE_ANSWER", 0xE0, True, "Bhh", "seq left right"),
    _layout("COMMAND", 0xD1, False, "BB", "seq code"),
    _layout("EVENT_ACK", 0xD2, False, "B", "seq"),
    _layout(
        "HELLO_ANSWER",
        0xF1,
        False,
        "HBHHHHBBBB",
        "nonce protocol_version epoch pose_unit_10um antenna_distance_mm type_mask slot_ms"
        " response_window_ms last_opcode last_seq",
    ),
    _layout("PING_ANSWER", 0xF2, False, "", ""),
    _layout("ERROR", 0xFE, False, "BBB", "refused_opcode reason seq"),
)

BY_NAME: Final = {layout.name: layout for layout in LAYOUTS}
MOST_PAYLOAD: Final = 16
HALT: Final = 1
EVERYBODY: Final = 0xFF

COMMAND_ARGUMENTS: Final = {
    1: _layout("halt", 0xD1, False, "", ""),
    2: _layout("resume", 0xD1, False, "", ""),
    3: _layout("speed", 0xD1, False, "h", "speed_mm_s"),
    4: _layout("go to", 0xD1, False, "hh", "x y"),
    5: _layout("follow type", 0xD1, False, "B", "type_to_follow"),
    6: _layout("pick the load", 0xD1, False, "", ""),
    7: _layout("drop the load", 0xD1, False, "", ""),
    8: _layout("set parameter", 0xD1, False, "Bi", "parameter value"),
    9: _layout("get parameter", 0xD1, False, "B", "parameter"),
}

REASONS: Final = {
    1: "unknown opcode",
    2: "bad length",
    3: "off the map",
    4: "unknown pheromone",
    5: "sequence reused",
    6: "say hello",
    7: "busy",
    8: "read-only",
    9: "map full",
    10: "not permitted",
    11: "bad value",
    12: "blocked by obstacle",
    16: "no tag in range",
    17: "tag protected",
    18: "tag full",
    19: "generation changed",
    20: "unknown symbol",
}
BUSY: Final = 7
LEAVE_NO_TRACE: Final = (1, 2, 6, 7, 8)
"""Reasons after which the server has not taken the sequence number. (After 5 somebody has.)"""


@dataclasses.dataclass(frozen=True)
class Message:
    """What a frame says: the message's name, who sent it or is to get it, and its fields."""

    name: str
    client_id: int
    fields: Mapping[str, Value]

    def number(self, field: str) -> int:
        value = self.fields[field]
        assert isinstance(value, int)
        return value

    def __str__(self) -> str:
        shown = (
            f"{key}={value.hex().upper() or '-' if isinstance(value, bytes) else value}"
            for key, value in self.fields.items()
        )
        return " ".join((self.name, f"id={self.client_id}", *shown))


def layout_of(opcode: int) -> Layout:
    """The layout of the messages with this opcode; UnknownOpcode where there are none."""
    for layout in LAYOUTS:
        if layout.typed:
            if layout.opcode == opcode & 0xF0 and opcode & 0x0F:
                return layout
        elif layout.opcode == opcode:
            return layout
    raise UnknownOpcode(f"there is no opcode {opcode:02X}")


def parse(body: bytes) -> Message:
    """The message that a frame's body holds; NotAMessage if it holds none."""
    client_id, opcode, data = body[0], body[1], body[2:]
    layout = layout_of(opcode)
    fields: dict[str, Value] = {"type": opcode & 0x0F} if layout.typed else {}
    if layout.name in ("PING", "PING_ANSWER"):
        if len(data) > MOST_PAYLOAD:
            raise BadLength(f"{layout.name} with {len(data)} bytes")
        fields["payload"] = data
        return Message(layout.name, client_id, fields)
    arguments = b""
    if layout.name == "COMMAND":
        data, arguments = data[: layout.length], data[layout.length :]
    if len(data) != layout.length:
        raise BadLength(f"{layout.name} with {len(data)} bytes instead of {layout.length}")
    fields.update(zip(layout.fields, struct.unpack(layout.format, data)))
    if layout.name == "COMMAND":
        what = COMMAND_ARGUMENTS.get(data[1])
        if what is None or len(arguments) != what.length:
            raise BadLength(f"COMMAND {data[1]} with {len(arguments)} bytes of arguments")
        fields.update(zip(what.fields, struct.unpack(what.format, arguments)))
    return Message(layout.name, client_id, fields)


def build(name: str, client_id: int, **fields: Value) -> bytes:
    """The body of a message; the opposite of `parse`. Values that do not fit raise struct.error."""
    layout = BY_NAME[name]
    opcode = layout.opcode
    if layout.typed:
        pheromone = fields["type"]
        if not isinstance(pheromone, int) or not 1 <= pheromone <= 15:
            raise ValueError(f"pheromone types are 1 to 15, not {pheromone!r}")
        opcode |= pheromone
    if name in ("PING", "PING_ANSWER"):
        payload = fields["payload"]
        if not isinstance(payload, bytes) or len(payload) > MOST_PAYLOAD:
            raise ValueError(f"a PING carries up to {MOST_PAYLOAD} bytes, not {payload!r}")
        return bytes((client_id, opcode)) + payload
    data = struct.pack(layout.format, *(fields[field] for field in layout.fields))
    if name == "COMMAND":
        code = fields["code"]
        assert isinstance(code, int)
        what = COMMAND_ARGUMENTS[code]
        data += struct.pack(what.format, *(fields[field] for field in what.fields))
    return bytes((client_id, opcode)) + data


# ---------------------------------------------------------------- section 8: conversation


class NoAnswer(Exception):
    """The server kept silent."""


class Refused(Exception):
    """The server answered with an ERROR."""

    def __init__(self, refused_opcode: int, reason: int, seq: int) -> None:
        self.refused_opcode = refused_opcode
        self.reason = reason
        self.seq = seq
        name = REASONS.get(reason, "not permitted")
        super().__init__(f"opcode {refused_opcode:02X} refused: {reason}, {name} (seq {seq})")


class Smell(NamedTuple):
    """Intensities at the two antennas, in 1/4096 of a pheromone unit."""

    left: int
    right: int


@dataclasses.dataclass(frozen=True)
class HelloAnswer:
    """What the server tells about itself."""

    nonce: int
    protocol_version: int
    epoch: int
    pose_unit_10um: int
    antenna_distance_mm: int
    type_mask: int
    slot_ms: int
    response_window_ms: int
    last_opcode: int
    last_seq: int

    @property
    def types(self) -> list[int]:
        """The pheromone types that exist."""
        return [t for t in range(1, 16) if self.type_mask >> t & 1]


class Line:
    """A stream of bytes in both directions, with frames in it. Owns its file descriptor.

    `writing` is the descriptor to write to, where it is another than the one to read from.
    """

    def __init__(self, fd: int, writing: int | None = None) -> None:
        self.fd = fd
        self._writing = fd if writing is None else writing
        self.decoder = Decoder()
        self._frames: deque[bytes] = deque()

    def send(self, data: bytes) -> None:
        """Writes all of it."""
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._writing, rest) :]

    def receive(self, deadline: float) -> bytes | None:
        """The body of the next frame, or None at the deadline (a time.monotonic())."""
        while not self._frames:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select((self.fd,), (), (), left)[0]:
                return None
            data = os.read(self.fd, 4096)
            if not data:
                raise ConnectionError("the other end has gone")
            self._frames.extend(self.decoder.feed(data))
        return self._frames.popleft()

    def close(self) -> None:
        for fd in {self.fd, self._writing} - {-1}:
            os.close(fd)
        self.fd = self._writing = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def open_terminal(path: str | os.PathLike[str]) -> Line:
    """Opens a terminal, real or pseudo, and makes it pass all bytes as they are."""
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_CLOEXEC)
    try:
        settings = termios.tcgetattr(fd)
        settings[0] &= ~(
            termios.IGNBRK
            | termios.BRKINT
            | termios.PARMRK
            | termios.INPCK
            | termios.ISTRIP
            | termios.INLCR
            | termios.IGNCR
            | termios.ICRNL
            | termios.IXON
            | termios.IXOFF
            | termios.IXANY
        )
        settings[1] &= ~termios.OPOST
        settings[2] &= ~(termios.CSIZE | termios.PARENB)
        settings[2] |= termios.CS8 | termios.CLOCAL | termios.CREAD
        settings[3] &= ~(
            termios.ECHO | termios.ECHONL | termios.ICANON | termios.ISIG | termios.IEXTEN
        )
        settings[6][termios.VMIN] = 1
        settings[6][termios.VTIME] = 0
        termios.tcsetattr(fd, termios.TCSANOW, settings)
        termios.tcflush(fd, termios.TCIFLUSH)  # answers that somebody before us did not fetch
    except BaseException:
        os.close(fd)
        raise
    return Line(fd)


CommandHandler = Callable[[Message], int]
"""Called once for each COMMAND; gives the result for the ACK, 0 for accepted."""


class Client:
    """One robot on a line: asks, waits, takes the right answer, repeats what must not be lost.

    Methods raise Refused for an ERROR and NoAnswer for silence. Each request is sent up to `tries`
    times, `timeout` seconds apart. A mutating request is repeated byte for byte, so the server
    carries it out once however often it is sent.
    """

    def __init__(
        self,
        line: Line,
        client_id: int,
        timeout: float = 0.5,
        tries: int = 4,
        on_command: CommandHandler | None = None,
    ) -> None:
        if not 1 <= client_id <= 254:
            raise ValueError(f"CLIENT_ID is 1 to 254, not {client_id}")
        self.line = line
        self.client_id = client_id
        self.timeout = timeout
        self.tries = tries
        self.on_command = on_command
        self.server: HelloAnswer | None = None
        self.next_seq = 0
        self._pad = True  # just connected: who knows what stood before
        self._last_command: tuple[int, int, int] | None = None  # seq, code, result
        self._said_hello = False
        self._ping_count = 0
        self._ping_tag = secrets.token_bytes(4)

    # -- requests

    def hello(
        self, nonce: int, firmware_version: int = 1, capabilities: int = 0
    ) -> HelloAnswer:
        """Says HELLO. The next seq follows the one that the server remembers."""
        body = build(
            "HELLO",
            self.client_id,
            nonce=nonce,
            firmware_version=firmware_version,
            capabilities=capabilities,
        )
        answer = self._ask(body)
        told = HelloAnswer(**{key: answer.number(key) for key in answer.fields})
        before = self.server
        if before is None or (before.nonce, before.epoch) != (told.nonce, told.epoch):
            self._last_command = None
        self.server = told
        if told.last_opcode:
            self.next_seq = (told.last_seq + 1) % 256
        return told

    def ping(self, payload: bytes = b"") -> bytes:
        """Sends a PING and gives its echo."""
        body = build("PING", self.client_id, payload=payload)
        echo = self._ask(body).fields["payload"]
        assert isinstance(echo, bytes)
        return echo

    def sense(self, pheromone: int, x: int, y: int, heading: int) -> Smell:
        """What the robot smells at this pose."""
        return self._sense("SENSE", pheromone, x, y, heading)

    def sense_wide(self, pheromone: int, x: int, y: int, heading: int) -> Smell:
        """The same, for coordinates that do not fit into 16 bits."""
        return self._sense("SENSE_WIDE", pheromone, x, y, heading)

    def deposit(self, pheromone: int, x: int, y: int, quanta: int = 1) -> None:
        """Leaves some quanta at a position."""
        self._change("DEPOSIT", type=pheromone, x=x, y=y, quanta=quanta)

    def trace(self, pheromone: int, x: int, y: int, heading: int) -> Smell:
        """Smells, and leaves one quantum."""
        return _smell(self._change("TRACE", type=pheromone, x=x, y=y, heading=heading))

    def trace_wide(self, pheromone: int, x: int, y: int, heading: int) -> Smell:
        """The same, for coordinates that do not fit into 16 bits."""
        return _smell(self._change("TRACE_WIDE", type=pheromone, x=x, y=y, heading=heading))

    def event(self, code: int, argument: int = 0) -> None:
        """Reports an event."""
        self._change("EVENT", code=code, argument=argument)

    def resynchronise(self) -> list[bytes]:
        """Sends a PING never sent before and waits for its echo; gives all that came before it."""
        self._pad = True
        for _ in range(self.tries):
            self._ping_count += 1
            payload = self._ping_tag + self._ping_count.to_bytes(8, "little")
            self._send(build("PING", self.client_id, payload=payload))
            echo = build("PING_ANSWER", self.client_id, payload=payload)
            heard: list[bytes] = []
            deadline = time.monotonic() + self.timeout
            while (body := self.line.receive(deadline)) is not None:
                if body == echo:
                    return heard
                heard.append(body)
            self._pad = True
        raise NoAnswer("no echo of a PING")

    def listen(self, seconds: float) -> None:
        """Serves commands for a while."""
        deadline = time.monotonic() + seconds
        while (body := self.line.receive(deadline)) is not None:
            self._overhear(body)

    # -- one exchange

    def exchange(self, body: bytes) -> Message | None:
        """Sends a request once and gives its answer, an ERROR perhaps; None if none came."""
        self._send(body)
        deadline = time.monotonic() + self.timeout
        while (heard := self.line.receive(deadline)) is not None:
            if (answer := answers(heard, body)) is not None:
                return answer
            self._overhear(heard)
        self._pad = True
        return None

    def _send(self, body: bytes) -> None:
        pad, self._pad = PAD if self._pad else b"", False
        self.line.send(pad + encode(body))

    def _ask(self, body: bytes) -> Message:
        busy = None
        for attempt in range(self.tries):
            if attempt:
                self.resynchronise()
            answer = self.exchange(body)
            if answer is None:
                continue
            if answer.name != "ERROR":
                return answer
            busy = Refused(*(answer.number(key) for key in answer.fields))
            if busy.reason != BUSY:
                raise busy
            time.sleep(self.timeout / 4)
        if busy is not None:
            raise busy
        raise NoAnswer(f"no answer to {parse(body)}")

    def _sense(self, name: str, pheromone: int, x: int, y: int, heading: int) -> Smell:
        body = build(name, self.client_id, type=pheromone, x=x, y=y, heading=heading)
        return _smell(self._ask(body))

    def _change(self, name: str, **fields: Value) -> Message:
        body = build(name, self.client_id, seq=self.next_seq, **fields)
        taken = True
        try:
            return self._ask(body)
        except Refused as refused:
            taken = refused.reason not in LEAVE_NO_TRACE
            raise
        finally:
            if taken:
                self.next_seq = (self.next_seq + 1) % 256

    # -- commands

    def _overhear(self, body: bytes) -> None:
        """Looks at a frame that is no answer: a COMMAND for this robot is obeyed and acknowledged,
        everything else is ignored."""
        if self.on_command is None or body[0] not in (self.client_id, EVERYBODY):
            return
        try:
            command = parse(body)
        except NotAMessage:
            return
        if command.name != "COMMAND":
            return
        seq, code = command.number("seq"), command.number("code")
        if command.client_id == EVERYBODY:
            if code == HALT:
                self.on_command(command)
            return
        if self._last_command is None or self._last_command[0] != seq:
            self._last_command = (seq, code, self.on_command(command))
        _, known_code, result = self._last_command
        self._send(
            build("COMMAND_ACK", self.client_id, seq=seq, code=known_code, result=result)
        )


def _smell(answer: Message) -> Smell:
    return Smell(answer.number("left"), answer.number("right"))


def answers(heard: bytes, request: bytes) -> Message | None:
    """The message in `heard`, if that is an answer to this request; else None (section 8)."""
    if heard[0] != request[0]:
        return None
    try:
        answer = parse(heard)
    except NotAMessage:
        return None
    opcode, data = request[1], request[2:]
    if answer.name == "ERROR":
        same = (answer.fields["refused_opcode"], answer.fields["seq"]) == (opcode, seq_of(request))
        return answer if same else None
    if heard[1] != opcode | 0x80:
        return None
    if "seq" in answer.fields and answer.fields["seq"] != seq_of(request):
        return None
    if answer.name == "HELLO_ANSWER" and heard[2:4] != data[:2]:
        return None
    if answer.name == "PING_ANSWER" and heard[2:] != data:
        return None
    return answer


def seq_of(request: bytes) -> int:
    """The seq that an ERROR to this request carries: its first DATA byte if it is mutating by its
    service, whatever else is wrong with it; else 0."""
    opcode, data = request[1], request[2:]
    mutating = opcode >> 4 in (0x2, 0x3, 0x6) or opcode == 0x52
    return data[0] if mutating and data else 0


# ---------------------------------------------------------------- sections 5 and 10: arithmetic


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


@dataclasses.dataclass(frozen=True)
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


@dataclasses.dataclass(frozen=True)
class Model:
    """The field, as section 10 tells it, with no thought of speed. Coordinates are pose units."""

    width_um: int
    height_um: int
    cell_um: int
    pose_unit_um: int
    antenna_distance_um: int
    pheromones: Mapping[int, Pheromone]
    origin_x_um: int = 0
    origin_y_um: int = 0
    nodes: dict[tuple[int, int, int], tuple[int, int]] = dataclasses.field(default_factory=dict)
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
        """How many quanta a node holds now."""
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

    def sense(self, pheromone: int, x: int, y: int, heading: int, now_ms: int = 0) -> Smell:
        """What the server should answer."""
        kind = self.pheromones[pheromone]
        px, py = self.position(x, y)
        cos, sin = cosine_q14(heading), sine_q14(heading)
        near = [
            (qx, qy, count)
            for qx, qy, count in self.sources(pheromone, now_ms)
            if not kind.directional or (qx - px) * cos + (qy - py) * sin >= 0
        ]
        left, right = (_intensity(kind, near, at) for at in self.antennas(x, y, heading))
        return fit_to_wire(left, right)


def weight_q16(kind: Pheromone, dx: int, dy: int) -> int:
    """How much of a source arrives at a distance, in 1/65536."""
    distance = math.sqrt(dx * dx + dy * dy)
    k = 65536 / kind.sigma_um
    value = math.floor((kind.core_um + kind.sigma_um - distance) * k + 0.5)
    return max(0, min(65536, value))


def _intensity(
    kind: Pheromone, sources: Iterable[tuple[int, int, int]], at: tuple[int, int]
) -> int:
    total = sum(count * weight_q16(kind, qx - at[0], qy - at[1]) for qx, qy, count in sources)
    return round_half_away(4096 * kind.quantum_millionths * total, 65536 * 1_000_000)


def fit_to_wire(left: int, right: int) -> Smell:
    """Scales two intensities down together if one of them does not fit."""
    most = max(abs(left), abs(right))
    if most <= 32767:
        return Smell(left, right)
    small = [abs(p) * 32767 // most for p in (left, right)]
    return Smell(small[0] if left >= 0 else -small[0], small[1] if right >= 0 else -small[1])


# ---------------------------------------------------------------- section 14: vectors

VECTORS: Final = Path(__file__).resolve().parent.parent / "protocol" / "vectors"


def read_vectors(path: Path) -> list[list[str]]:
    """The lines of a vectors file, each as its columns."""
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            rows.append([column.strip() for column in line.split("|")])
    return rows


def from_hex(text: str) -> bytes:
    return b"" if text == "-" else bytes.fromhex(text)


def verdict_of(body: bytes | None, decoder: Decoder) -> str:
    """What the vectors call the fate of the only frame that a decoder was given."""
    if body is None:
        reasons = [reason for reason in decoder.dropped if reason != "begun-again"]
        assert len(reasons) == 1, f"expected one dropped frame, not {dict(decoder.dropped)}"
        return reasons[0]
    try:
        parse(body)
    except UnknownOpcode:
        return "unknown-opcode"
    except BadLength:
        return "bad-length"
    return "ok"


def check_crc(rows: list[list[str]]) -> None:
    for data, number in rows:
        got = crc16(from_hex(data))
        assert got == int(number, 16), f"CRC of {data} is {number}, not {got:04X}"


def check_frames(rows: list[list[str]]) -> None:
    for name, unstuffed, wire, verdict in rows:
        if unstuffed != "-":
            got = encode(from_hex(unstuffed))
            assert got == from_hex(wire), f"{name}: encoded as {got.hex(' ')}"
        decoder = Decoder()
        found = decoder.feed(from_hex(wire))
        assert len(found) <= 1, f"{name}: {len(found)} frames"
        if found:
            assert found[0] == from_hex(unstuffed), f"{name}: read as {found[0].hex(' ')}"
        got_verdict = verdict_of(found[0] if found else None, decoder)
        assert got_verdict == verdict, f"{name}: {got_verdict}, not {verdict}"


def parse_fields(text: str) -> dict[str, Value]:
    fields: dict[str, Value] = {}
    for pair in text.split():
        key, value = pair.split("=")
        fields[key] = from_hex(value) if key == "payload" else int(value)
    return fields


def check_fields(rows: list[list[str]], frames: Mapping[str, list[str]]) -> None:
    for name, message_name, text in rows:
        body = from_hex(frames[name][1])
        expected = parse_fields(text)
        message = parse(body)
        got = {"id": message.client_id, **message.fields}
        assert (message.name, got) == (message_name, expected), f"{name}: read as {message}"
        client_id = expected.pop("id")
        assert isinstance(client_id, int)
        again = build(message_name, client_id, **expected)
        assert again == body, f"{name}: built as {again.hex(' ')}"
    good = {name for name, row in frames.items() if row[3] == "ok"}
    missing = good - {row[0] for row in rows}
    assert not missing, f"good frames without fields: {missing}"


def check_streams(rows: list[list[str]]) -> None:
    for name, data, delivered in rows:
        expected = [] if delivered == "-" else [from_hex(part) for part in delivered.split(";")]
        at_once = Decoder().feed(from_hex(data))
        assert at_once == expected, f"{name}: {[body.hex(' ') for body in at_once]}"
        one_by_one = Decoder()
        dribbled = [body for byte in from_hex(data) for body in one_by_one.feed(bytes((byte,)))]
        assert dribbled == expected, f"{name}, byte by byte"


def check_model() -> None:
    """The worked example, and what section 10 says in so many words."""
    example = Pheromone(1, 100_000, 400_000, 1000, 1_000_000, 3)
    model = Model(2_000_000, 2_000_000, 100_000, 1000, 300_000, {1: example})
    model.deposit(1, 1000, 600)
    assert model.sense(1, 1000, 500, 0) == (4096, 2560), "the worked example"
    assert model.sense(1, 1000, 500, 32768) == (2560, 4096), "the worked example, turned round"
    model.deposit(1, 1000, 600, 200)
    assert model.quanta(1, 10, 6, 0) == 3, "quanta are capped"
    levels = [model.quanta(1, 10, 6, t) for t in (0, 999, 1000, 1999, 2000, 3000, 99999)]
    assert levels == [3, 3, 2, 2, 1, 0, 0], "evaporation"
    assert model.node(50, 149) == (1, 1), "a tie goes to the larger coordinate"
    assert model.node(2000, 2000) == (20, 20), "the last node is on the edge"
    assert (sine_q14(16384), cosine_q14(16384)) == (16384, 0), "exact on the axes"
    assert sine_q14(8192) == cosine_q14(8192) == 11585, "equal at 45 degrees"
    assert all(sine_q14(-h) == -sine_q14(h) for h in range(0, 65536, 7)), "the sine is odd"
    assert fit_to_wire(65534, -32767) == (32767, -16383), "both are scaled alike"
    assert round_half_away(-5, 2) == -3 and round_half_away(5, 2) == 3, "halves away from zero"


def check_commands() -> None:
    """A COMMAND is obeyed once, acknowledged every time, and halt to all is not acknowledged."""
    server_reads, client_writes = os.pipe()
    client_reads, server_writes = os.pipe()
    obeyed: list[str] = []

    def obey(command: Message) -> int:
        obeyed.append(str(command))
        return 11

    server = Line(server_reads, server_writes)
    with server, Line(client_reads, client_writes) as line:
        robot = Client(line, 16, on_command=obey)
        go = encode(build("COMMAND", 16, seq=16, code=4, x=528, y=784))
        for_another = encode(build("COMMAND", 17, seq=1, code=2))
        halt = encode(build("COMMAND", EVERYBODY, seq=1, code=HALT))
        server.send(go + for_another + halt + go)
        robot.listen(0)  # at the deadline already: nothing is read
        assert not obeyed
        robot.listen(0.05)
        heard = [server.receive(time.monotonic() + 1) for _ in range(2)]
    ack = build("COMMAND_ACK", 16, seq=16, code=4, result=11)
    assert heard == [ack, ack], f"acknowledged with {heard}"
    assert obeyed == [
        "COMMAND id=16 seq=16 code=4 x=528 y=784",
        "COMMAND id=255 seq=1 code=1",
    ], f"obeyed {obeyed}"


def self_test(vectors: Path = VECTORS) -> str:
    """Checks this file against the vectors; gives a line to print, or raises AssertionError."""
    crcs = read_vectors(vectors / "crc.txt")
    frames = read_vectors(vectors / "frames.txt")
    fields = read_vectors(vectors / "fields.txt")
    streams = read_vectors(vectors / "streams.txt")
    for what in (crcs, frames, fields, streams):
        assert what, "a vectors file is empty"
    check_crc(crcs)
    check_frames(frames)
    check_fields(fields, {row[0]: row for row in frames})
    check_streams(streams)
    check_model()
    check_commands()
    return (
        f"{len(crcs)} CRCs, {len(frames)} frames, {len(fields)} messages, {len(streams)} streams,"
        " the model and the handling of commands agree with the specification"
    )


# ---------------------------------------------------------------- the program


def integer(text: str) -> int:
    return int(text, 0)


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description="Talks the pheromone protocol to a server on a terminal.",
        epilog="Coordinates are pose units, headings binary angles (65536 to a turn).",
    )
    parser.add_argument("path", nargs="?", help="the terminal, radio-a.pty for instance")
    parser.add_argument("--self-test", action="store_true", help="check against the vectors")
    parser.add_argument("--vectors", type=Path, default=VECTORS, help="where the vectors are")
    parser.add_argument("--id", type=integer, default=1, help="CLIENT_ID, 1 to 254 (default 1)")
    parser.add_argument(
        "--nonce", type=integer, default=1, help="boot counter for HELLO (default 1)"
    )
    parser.add_argument("--timeout", type=float, default=0.5, help="seconds to wait for an answer")
    requests = parser.add_subparsers(dest="request", metavar="REQUEST")
    requests.add_parser("hello", help="say HELLO and show what the server tells")
    ping = requests.add_parser("ping", help="ask for an echo")
    ping.add_argument("payload", nargs="?", default="", help="up to 16 bytes, hexadecimal")
    for name, what in (("sense", "what is smelled at a pose"), ("trace", "the same, then leave 1")):
        pose = requests.add_parser(name, help=what)
        pose.add_argument("--wide", action="store_true", help="coordinates of 32 bits")
        for field in ("type", "x", "y", "heading"):
            pose.add_argument(field, type=integer)
    deposit = requests.add_parser("deposit", help="leave pheromone")
    for field in ("type", "x", "y"):
        deposit.add_argument(field, type=integer)
    deposit.add_argument("quanta", type=integer, nargs="?", default=1)
    event = requests.add_parser("event", help="report an event")
    event.add_argument("code", type=integer)
    event.add_argument("argument", type=integer, nargs="?", default=0)
    return parser


def carry_out(options: argparse.Namespace, robot: Client) -> str:
    """Makes the request and gives the answer as text."""
    if options.request == "ping":
        started = time.monotonic()
        echo = robot.ping(bytes.fromhex(options.payload))
        return f"echo {echo.hex(' ').upper() or '-'} after {time.monotonic() - started:.4f} s"
    if options.request == "sense":
        sense = robot.sense_wide if options.wide else robot.sense
        return _shown(sense(options.type, options.x, options.y, options.heading))
    # What changes something needs a HELLO. The nonce stays the same, so the server remembers the
    # last seq of the run before, and this one goes on from there.
    told = robot.hello(options.nonce)
    if options.request == "hello":
        lines = [f"{field.name} {getattr(told, field.name)}" for field in dataclasses.fields(told)]
        return "\n".join((*lines, "types " + " ".join(map(str, told.types))))
    if options.request == "trace":
        trace = robot.trace_wide if options.wide else robot.trace
        return _shown(trace(options.type, options.x, options.y, options.heading))
    if options.request == "deposit":
        robot.deposit(options.type, options.x, options.y, options.quanta)
        return "deposited"
    robot.event(options.code, options.argument)
    return "acknowledged"


def _shown(smell: Smell) -> str:
    return (
        f"left {smell.left} right {smell.right}"
        f" (units: {smell.left / 4096:g} {smell.right / 4096:g})"
    )


def main() -> int:
    parser = arguments()
    options = parser.parse_args()
    if options.self_test:
        print(self_test(options.vectors))
        return 0
    if options.path is None or options.request is None:
        parser.error("PATH and a request are needed, or --self-test")
    try:
        with open_terminal(options.path) as line:
            print(carry_out(options, Client(line, options.id, options.timeout)))
    except (Refused, NoAnswer, OSError, ValueError, struct.error, termios.error) as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
