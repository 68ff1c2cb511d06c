"""What a server has recorded (server/store/capture/README.md), as messages and as arrays.

    recording = Recording("captures/lab.pcapng")
    sensed = recording.sensed()             # an array with a row for each answer to SENSE and TRACE
    pyplot.plot(sensed["x_m"], sensed["y_m"])
    for entry in recording:                 # or all messages, one by one
        print(entry.time_ns, entry.link, entry.message)

The file is read into memory. What is damaged, or missing at the end, is left out, and `problem` says
why; empty: the recording is complete. What happened inside of the server (the map at some moment,
exact replay) pheromonectl tells: replay, export, map.
"""

from __future__ import annotations

import os
import re
import struct
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

from . import arrays
from ._answers import ProtocolError
from .wire import ANSWER, NO_INTENSITIES, UNIT, Decoder, Message, NotAMessage, parse

_SECTION, _INTERFACE, _PACKET, _LOCAL = 0x0A0D0D0A, 1, 6, 0x80504800
_START, _PARTIAL_FRAME, _GAP, _END = 0, 3, 9, 10  # kinds of blocks for local use
_PACKET_OPTIONS = 8 + 12 + 12 + 4  # bytes at the end of a packet's block: flags, number, clock, end
_POSE_UNIT = re.compile(r"^\s*pose_unit_mm\s*=\s*([\d.]+)", re.MULTILINE)


class Entry(NamedTuple):
    """A message. `time_ns` since 1970; `robot` is None in one to all robots of the link."""

    time_ns: int
    link: str
    robot: int | None
    message: Message


class _Damaged(Exception):
    pass


class _Fields:
    """Reads a record from its beginning."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def take(self, layout: str) -> tuple[Any, ...]:
        values = struct.unpack_from("<" + layout, self._data, self._at)
        self._at += struct.calcsize("<" + layout)
        return values

    def bytes(self) -> bytes:
        size, = self.take("I")
        data = self._data[self._at:self._at + size]
        if len(data) < size:
            raise struct.error("too short")
        self._at += size
        return data

    def text(self) -> str:
        return self.bytes().decode(errors="replace")


class _Link(NamedTuple):
    name: str
    gap_ms: int
    is_datagrams: bool


class Recording:
    """One file. Raises OSError, and ProtocolError for a file that is no recording."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        with open(path, "rb") as file:
            self._data = file.read()
        self.problem = ""  # as far as it was read
        self.links: list[str] = []
        self.config = ""  # the server's configuration file
        self.begin_ns = 0
        self._links: list[_Link] = []
        try:
            _, kind, body = next(self._records())
            self._start(kind, body)
        except (_Damaged, StopIteration, struct.error):
            raise ProtocolError(f"{os.fspath(path)}: not a recording of pheromoned") from None

    @property
    def pose_unit_10um(self) -> int:
        """Of the robots' coordinates."""
        found = _POSE_UNIT.search(self.config)
        return round(float(found[1]) * 100) if found else 100

    def __iter__(self) -> Iterator[Entry]:
        """All valid messages from and to robots."""
        decoders: dict[tuple[int, int, int], Decoder] = {}
        clocks: dict[tuple[int, int, int], int] = {}
        self.problem = "the recording has no end"
        try:
            for _, kind, body in self._records():
                if kind == _PARTIAL_FRAME:
                    fields = _Fields(body)
                    number, connection, clock = fields.take("HII")
                    key = number, connection, 1
                    decoders[key], clocks[key] = Decoder(), clock
                    decoders[key].feed(fields.bytes())
                elif kind == _GAP:
                    raise _Damaged("records are missing")
                elif kind == _END:
                    self.problem = ""
                elif kind is None:
                    yield from self._packet(body, decoders, clocks)
        except (_Damaged, struct.error) as damage:
            self.problem = str(damage)

    def sensed(self) -> Any:
        """A row for each answer with intensities: time_ns, link, robot, pheromone (its number), x_m,
        y_m, heading_deg as the robot reported them, left and right in units, and `deposits`, whether
        it left a quantum (TRACE)."""
        unit = self.pose_unit_10um
        return arrays.table(
            "time_ns link robot pheromone x_m y_m heading_deg left right deposits", "iUiiddddd?",
            [(time_ns, link, robot, asked.fields["type"], asked.fields["x"] * unit / 1e5,
              asked.fields["y"] * unit / 1e5, asked.fields["heading"] * 360 / 65536, left / UNIT,
              right / UNIT, "seq" in asked.fields)
             for time_ns, link, robot, asked, left, right in self._answered()
             if left is not None and right is not None])

    def deposited(self) -> Any:
        """A row for each deposit of a robot that was acknowledged: time_ns, link, robot, pheromone,
        x_m, y_m, quanta."""
        unit = self.pose_unit_10um
        rows = []
        last: dict[tuple[str, int], Message] = {}  # an acknowledgement may come twice
        for time_ns, link, robot, asked, _, _ in self._answered():
            if "seq" in asked.fields and last.get((link, robot)) != asked:
                last[link, robot] = asked
                rows.append((time_ns, link, robot, asked.fields["type"],
                             asked.fields["x"] * unit / 1e5, asked.fields["y"] * unit / 1e5,
                             asked.fields.get("quanta", 1)))
        return arrays.table("time_ns link robot pheromone x_m y_m quanta", "iUiiddi", rows)

    def reported(self) -> Any:
        """A row for each EVENT that a robot sent, repetitions included: time_ns, link, robot, code,
        argument, seq."""
        return arrays.table("time_ns link robot code argument seq", "iUiiii", [
            (it.time_ns, it.link, it.robot, it.message.fields["code"],
             it.message.fields["argument"], it.message.fields["seq"])
            for it in self if it.message.name == "EVENT"])

    def _answered(self) -> Iterator[tuple[int, str, int, Message, int | None, int | None]]:
        """The requests of SENSE, TRACE and DEPOSIT that were answered, with the intensities."""
        asked: dict[tuple[str, int], Message] = {}  # the last ones
        waiting: dict[tuple[str, int, str], list[tuple[int, Message]]] = {}  # and those by service
        rounds: dict[str, Message] = {}
        for time_ns, link, robot, message in self:
            name, fields = message.name, message.fields
            if name in ("SENSE", "SENSE_WIDE", "TRACE", "TRACE_WIDE", "DEPOSIT") and robot:
                asked[link, robot] = message
                queue = waiting.setdefault((link, robot, name), [])
                # Several may have come at once. Without a number, an earlier one is not answered.
                if queue and ("seq" not in fields and queue[0][0] != time_ns or len(queue) == 16):
                    queue.clear()
                queue.append((time_ns, message))
            elif name == "ROUND":
                before = rounds.get(link)
                rounds[link] = message
                if before and (before.fields["number"] + 1) % 256 == fields["number"]:
                    for turn, (left, right) in zip(before.fields["turns"], fields["answers"]):
                        request = asked.get((link, turn))
                        if left != NO_INTENSITIES and request:
                            yield time_ns, link, turn, request, left, right
            elif name.endswith("_ANSWER") and robot:
                queue = waiting.get((link, robot, name[:-len("_ANSWER")]), [])
                for i, (_, request) in enumerate(queue):
                    if all(request.fields.get(key, fields[key]) == fields[key]
                           for key in ("type", "seq") if key in fields):
                        yield time_ns, link, robot, request, fields.get("left"), fields.get("right")
                        del queue[:min(i + 1, len(queue) - 1)]  # an answer may come twice
                        break

    def _start(self, kind: int | None, body: bytes) -> None:
        fields = _Fields(body)
        if kind != _START or fields.text() != "pheromone capture":
            raise _Damaged
        version, self.begin_ns, _, _ = fields.take("BQQI")
        if version != 1:
            raise ProtocolError(f"a recording of version {version}, expected 1")
        fields.text()  # of the program
        self.config = fields.text()
        for _ in range(fields.take("I")[0]):
            name = fields.text()
            self._links.append(_Link(name, *fields.take("H?")))
        self.links = [it.name for it in self._links]

    def _records(self) -> Iterator[tuple[int, int | None, bytes]]:
        """Number, kind (None: a packet) and content of each."""
        expected = 1
        for kind, body in self._blocks():
            if kind == _PACKET:
                if len(body) < 20 + 12 + _PACKET_OPTIONS:
                    raise _Damaged("a packet is too short")
                options = len(body) - _PACKET_OPTIONS
                number, = struct.unpack_from("<Q", body, options + 12)
                crc, = struct.unpack_from("<I", body, options + 28)
                checked = body[:options + 20] + body[options + 24:options + 28]
                if zlib.crc32(checked) != crc:
                    raise _Damaged(f"record {expected}: its checksum is wrong")
                record: tuple[int, int | None, bytes] = number, None, body
            elif kind & ~0xFF == _LOCAL:
                crc, size = struct.unpack_from("<II", body)
                sealed = body[8:8 + size]
                if len(sealed) < max(size, 8) or zlib.crc32(sealed) != crc:
                    raise _Damaged(f"record {expected}: its checksum is wrong")
                number, = struct.unpack_from("<Q", sealed)
                record = number, kind & 0xFF, sealed[8:]
            elif kind in (_SECTION, _INTERFACE):
                continue
            else:
                raise _Damaged(f"an unknown block {kind:#x}")
            if number != expected:
                raise _Damaged(f"record {number} instead of {expected}")
            expected += 1
            yield record

    def _blocks(self) -> Iterator[tuple[int, bytes]]:
        at, data = 0, self._data
        while at < len(data):
            kind, size = struct.unpack_from("<II", data, at)
            if size < 12 or size % 4 or at + size > len(data):
                raise _Damaged(f"byte {at}: a block is cut off")
            if struct.unpack_from("<I", data, at + size - 4)[0] != size:
                raise _Damaged(f"byte {at}: block length fields differ")
            yield kind, data[at + 8:at + size - 4]
            at += size

    def _packet(self, body: bytes, decoders: dict[tuple[int, int, int], Decoder],
                clocks: dict[tuple[int, int, int], int]) -> Iterator[Entry]:
        _, high, low, size, _, number, connection, direction = struct.unpack_from("<IIIIIHIB", body)
        raw = body[28:20 + size]
        link = self._links[number]
        clock, = struct.unpack_from("<I", body, len(body) - _PACKET_OPTIONS + 24)
        key = number, connection, direction
        decoder = decoders.get(key)
        silence_ms = (clock - clocks.get(key, clock)) % (1 << 32)
        if (decoder is None or link.is_datagrams
                or direction == 1 and link.gap_ms and silence_ms > link.gap_ms):
            decoder = decoders[key] = Decoder()
        clocks[key] = clock
        for frame in decoder.feed(raw):
            if (frame[1] & ANSWER != 0) != (direction == 2):
                continue  # an echo
            try:
                yield Entry(high << 32 | low, link.name, None if frame[0] == 255 else frame[0],
                            parse(frame))
            except NotAMessage:
                pass
