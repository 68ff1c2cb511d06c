"""Frames and messages: bytes to fields and back (sections 1, 2, 4 and 6)."""

from __future__ import annotations

import struct
from collections import Counter
from typing import Any, NamedTuple

# ---------------------------------------------------------------- frames: sections 1 and 2

DLE, STX, ETX = 0x10, 0x02, 0x03
START, END = bytes((DLE, STX)), bytes((DLE, ETX))
PAD = b"\x00"  # goes before a frame when nobody can know what stood before it
MAX_DATA = 64
EVERYBODY = 0xFF
HELLO, HELLO_ANSWER = 0x71, 0xF1
ANSWER = 0x80  # the bit by which an answer's opcode differs from its request's
ROUND = 0xF3
CODED_ROUND, CODED_HELLO = (0xF4, 0xF5), (0xF6, 0xF7)  # coded frames begin twice
MAX_CODED_ROWS = 8
CODED_HELLO_DATA = {5: 34, 3: 15 + 5}  # bytes by rows: the answers to the first and the second
ADDED_TO_ALL = 6  # bytes behind the DATA of a signed ROUND
MAX_PING = 16
MAX_TYPE = 15  # of pheromones: bits 3 to 0 of an opcode
UNIT = 4096  # of intensities


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
    if not 2 <= len(body) <= 2 + MAX_DATA:
        raise ValueError(f"a body has 2 to {2 + MAX_DATA} bytes, this one {len(body)}")
    checked = body + crc16(body).to_bytes(2, "little")
    return START + checked.replace(bytes((DLE,)), bytes((DLE, DLE))) + END


class Decoder:
    """Finds frames in a stream of bytes, and drops everything else.

    There is no gap timeout: a pseudo-terminal has none. `dropped` counts what was thrown away
    inside of frames, by the verdicts of the vectors.
    """

    def __init__(self) -> None:
        self.dropped: Counter[str] = Counter()
        self._open: bytearray | None = None  # what the frame holds so far; None outside of frames
        self._after_dle = False
        self._counted = 0  # bytes of a coded frame that are still to come
        self._rows = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Accepts some bytes and returns the bodies of the frames that they complete."""
        return [body for byte in data if (body := self._take(byte)) is not None]

    def _take(self, byte: int) -> bytes | None:
        if self._counted and self._open is not None:
            self._open.append(byte)
            self._counted -= 1
            if self._counted:
                return None
            code, self._open = self._open, None
            coded = bytes(code[-10 * (self._rows + 1):])
            return self._judge(decode_coded(code[0], coded, self._rows))
        after_dle, self._after_dle = self._after_dle, False
        if self._open is None:
            if after_dle and byte == STX:
                self._open = bytearray()
            else:
                self._after_dle = byte == DLE
        elif not after_dle and byte == DLE:
            self._after_dle = True
        elif not after_dle or byte == DLE:
            if len(self._open) == 2 + MAX_DATA + 2:
                self._drop("oversize")
            else:
                self._open.append(byte)
                self._count()
        elif byte == STX:
            self._drop("begun-again")
            self._open = bytearray()
        elif byte == ETX:
            complete, self._open = bytes(self._open), None
            return self._judge(complete)
        else:
            self._drop("bad-escape")
        return None

    def _count(self) -> None:
        if self._open is None or len(self._open) != 3:
            return
        client, opcode, counts = self._open
        rows = counts & 0x0F
        to_all = client == EVERYBODY
        opcodes = CODED_ROUND if to_all else CODED_HELLO
        possible = 1 <= rows <= MAX_CODED_ROWS if to_all else rows in CODED_HELLO_DATA
        if opcode in opcodes and counts >> 4 == 15 - rows and possible:
            self._rows = rows
            self._counted = 10 * (rows + 1) + (5 if opcode == opcodes[0] else 0)

    def _judge(self, complete: bytes) -> bytes | None:
        if len(complete) < 4:
            self._drop("runt")
        elif crc16(complete) != 0:
            self._drop("bad-crc")
        elif complete[0] == 0 or complete[1] == 0:
            self._drop("refused")
        else:
            return complete[:-2]
        return None

    def _drop(self, why: str) -> None:
        self.dropped[why] += 1
        self._open = None


def _double(value: int) -> int:
    return value << 1 if value < 0x80 else (value << 1 & 0xFF) ^ 0x1D


def decode_coded(client: int, code: bytes, rows: int) -> bytes:
    """What a coded frame stands for, its CRC included: sections 4 and 18."""
    lines = [list(code[row:8 * rows:rows]) for row in range(rows)]
    lines.append(list(code[8 * rows:8 * rows + 8]))
    all_p, all_q = code[8 * rows + 8:9 * rows + 9], code[9 * rows + 9:]
    lost = None
    for number, (line, p, q) in enumerate(zip(lines, all_p, all_q)):
        weighted = 0
        for byte in reversed(line):
            p ^= byte
            weighted = _double(weighted) ^ byte
        q ^= weighted
        if p and q:
            column, power = 0, p
            while column < 8 and power != q:
                column, power = column + 1, _double(power)
            if column < 8:
                line[column] ^= p
            else:
                lost = number
    if lost is not None:
        for column in range(8):
            lines[lost][column] = 0
            for number, line in enumerate(lines):
                if number != lost:
                    lines[lost][column] ^= line[column]
    data = [lines[i % rows][i // rows] for i in range(8 * rows)]
    if client != EVERYBODY:
        return bytes((client or DLE, HELLO_ANSWER, *data[: CODED_HELLO_DATA[rows] + 2]))
    size = 6 + 4 * (data[5] & 0x0F) + (data[5] >> 4) + 2
    frame = bytes((EVERYBODY, ROUND, *data))
    signed = crc16(frame[: 2 + size]) != 0 and crc16(frame[: 2 + size + ADDED_TO_ALL]) == 0
    return frame[: 2 + size + (ADDED_TO_ALL if signed else 0)]


# ---------------------------------------------------------------- messages: section 4


class Layout(NamedTuple):
    """How a kind of message is laid out; `typed` if bits 3 to 0 of its opcode are a type."""

    opcode: int
    name: str
    format: str
    fields: str
    typed: bool = False


_STATEMENT = (
    "subject_namespace subject predicate_namespace predicate object_namespace object"
)
_WRITTEN = "seq tag slot slot_generation tag_generation"
_LAYOUTS = (
    Layout(0x00, "SENSE", "hhH", "x y heading", typed=True),
    Layout(0x10, "SENSE_WIDE", "iiH", "x y heading", typed=True),
    Layout(0x20, "DEPOSIT", "BhhB", "seq x y quanta", typed=True),
    Layout(0x30, "TRACE", "BhhH", "seq x y heading", typed=True),
    Layout(0x60, "TRACE_WIDE", "BiiH", "seq x y heading", typed=True),
    Layout(0x41, "SCAN", "iiH", "x y after"),
    Layout(0x42, "READ", "iiHB", "x y tag slot"),
    Layout(
        0x43,
        "WRITE",
        "BiiHBBHHI6i",
        f"seq x y tag slot flags expected lease_s time {_STATEMENT}",
    ),
    Layout(0x44, "ERASE", "BiiHBBH", "seq x y tag slot flags expected"),
    Layout(0x45, "SYMBOL", "BBi", "seq kind number"),
    Layout(0x46, "RESOLVE", "BiiB", "kind robot number offset"),
    Layout(0xC1, "SCAN_ANSWER", "B", "more"),
    Layout(
        0xC2,
        "READ_ANSWER",
        "HBBBHHHBiI6i",
        "tag slot next slots tag_generation slot_generation lease_s flags author time"
        f" {_STATEMENT}",
    ),
    Layout(0xC3, "WRITE_ANSWER", "BHBHH", _WRITTEN),
    Layout(0xC4, "ERASE_ANSWER", "BHBHH", _WRITTEN),
    Layout(0xC5, "SYMBOL_ANSWER", "BBi", "seq kind number"),
    Layout(0xC6, "RESOLVE_ANSWER", "BiiIB", "kind robot number rows text_length"),
    Layout(0x51, "COMMAND_ACK", "BBh", "seq code result"),
    Layout(0x52, "EVENT", "BBh", "seq code argument"),
    Layout(0x71, "HELLO", "HBB", "nonce firmware_version round_period"),
    Layout(0x72, "PING", "", ""),
    Layout(0x80, "SENSE_ANSWER", "hh", "left right", typed=True),
    Layout(0x90, "SENSE_WIDE_ANSWER", "hh", "left right", typed=True),
    Layout(0xA0, "DEPOSIT_ANSWER", "B", "seq", typed=True),
    Layout(0xB0, "TRACE_ANSWER", "Bhh", "seq left right", typed=True),
    Layout(0xE0, "TRACE_WIDE_ANSWER", "Bhh", "seq left right", typed=True),
    Layout(0xD1, "COMMAND", "BB", "seq code"),
    Layout(0xD2, "EVENT_ACK", "B", "seq"),
    Layout(
        0xF1,
        "HELLO_ANSWER",
        "HBHHHHBBBB",
        "nonce protocol_version epoch pose_unit_10um antenna_distance_mm type_mask slot_ms"
        " response_window_ms last_opcode last_seq",
    ),
    Layout(0xF2, "PING_ANSWER", "", ""),
    Layout(ROUND, "ROUND", "BBBBB", "number turn_ms turn_bytes slot_ms open_slots"),
    Layout(0xFE, "ERROR", "BBB", "refused_opcode reason seq"),
)
_BY_NAME = {layout.name: layout for layout in _LAYOUTS}
_BY_OPCODE = {
    layout.opcode | kind: layout
    for layout in _LAYOUTS
    for kind in (range(1, MAX_TYPE + 1) if layout.typed else (0,))
}

HALT, RESUME, SPEED, GO_TO, FOLLOW = 1, 2, 3, 4, 5
_COMMANDS = {  # code: format and fields of the arguments
    HALT: ("", ""),
    RESUME: ("", ""),
    SPEED: ("h", "speed_mm_s"),
    GO_TO: ("hh", "x y"),
    FOLLOW: ("B", "type_to_follow"),
    6: ("", ""),  # pick the load
    7: ("", ""),  # drop the load
    8: ("Bi", "parameter value"),  # set parameter
    9: ("B", "parameter"),  # get parameter
}

TRAIL_LOST, POSE_LOST = 5, 11  # codes of EVENT

_REASONS = (
    "unknown opcode, bad length, off the map, unknown pheromone, sequence reused, say hello, busy,"
    " read-only, map full, not permitted, bad value, blocked by obstacle"
)
_TAG_REASONS = "no tag in range, tag protected, tag full, generation changed, unknown symbol"
REASONS = {
    **dict(enumerate(_REASONS.split(", "), start=1)),
    **dict(enumerate(_TAG_REASONS.split(", "), start=16)),
}
UNKNOWN_OPCODE, BAD_LENGTH, SAY_HELLO, BUSY, READ_ONLY = 1, 2, 6, 7, 8
NOT_PERMITTED, BAD_VALUE = 10, 11

MAX_TAG_ROWS = 7
MAX_TEXT = {"SYMBOL": 56, "RESOLVE_ANSWER": 50}
MAX_TURNS = 11
NO_INTENSITIES = -32768
"""P_L of an answer of a ROUND that is none: P_R is then a reason, or 0 for send it again."""


class NotAMessage(ValueError):
    """A valid frame that is not a message, for a reason of section 6: 1, 2 or 11."""

    def __init__(self, reason: int, body: bytes) -> None:
        self.reason = reason
        super().__init__(f"{REASONS[reason]}: {body.hex(' ')}")


class Message(NamedTuple):
    """What a frame says: the message's name, who sent it or is to get it, and its fields."""

    name: str
    client_id: int
    fields: dict[str, Any]  # integers, but for payload, texts (bytes) and lists

    def __str__(self) -> str:
        fields = (f"{key}={value}" for key, value in self.fields.items())
        return " ".join((self.name, f"id={self.client_id}", *fields))


def _shape(layout: Layout, code: int) -> tuple[struct.Struct, list[str]]:
    """How DATA is packed, and its fields; `code` is for a COMMAND's arguments."""
    more_format, more_fields = _COMMANDS[code] if layout.name == "COMMAND" else ("", "")
    names = layout.fields.split() + more_fields.split()
    return struct.Struct("<" + layout.format + more_format), names


def _parse_round(body: bytes) -> Message:
    data = body[2:]
    if len(data) < 6:
        raise NotAMessage(BAD_LENGTH, body)
    of_turns, of_answers = divmod(data[5], 16)
    values, turns = data[6 : 6 + 4 * of_answers], data[6 + 4 * of_answers :]
    right = len(values) == 4 * of_answers and len(turns) == of_turns
    if not right or max(of_turns, of_answers) > MAX_TURNS:
        raise NotAMessage(BAD_LENGTH, body)
    if body[0] != EVERYBODY or 0 in turns or EVERYBODY in turns:
        raise NotAMessage(BAD_VALUE, body)
    answers = list(struct.iter_unpack("<hh", values))
    fields = dict(zip(_BY_NAME["ROUND"].fields.split(), data))
    return Message("ROUND", body[0], {**fields, "answers": answers, "turns": list(turns)})


def _build_round(
    client_id: int, answers: list[tuple[int, int]], turns: list[int], **fields: int
) -> bytes:
    """The body of a ROUND: in `answers` P_L and P_R of each turn of the last round."""
    if len(answers) > MAX_TURNS or len(turns) > MAX_TURNS:
        raise ValueError(f"a ROUND has up to {MAX_TURNS} answers and turns")
    header = (fields[name] for name in _BY_NAME["ROUND"].fields.split())
    values = b"".join(struct.pack("<hh", *answer) for answer in answers)
    counts = 16 * len(turns) + len(answers)
    return bytes((client_id, ROUND, *header, counts)) + values + bytes(turns)


def _parse_scan_answer(body: bytes) -> Message:
    """`rows`: tag, dx, dy, generation of each."""
    rows, odd = divmod(len(body) - 3, 8)
    if odd or not 0 <= rows <= MAX_TAG_ROWS:
        raise NotAMessage(BAD_LENGTH, body)
    fields = {"more": body[2], "rows": list(struct.iter_unpack("<HhhH", body[3:]))}
    return Message("SCAN_ANSWER", body[0], fields)


def _parse_text(layout: Layout, body: bytes) -> Message:
    """A message that ends with a text."""
    packing, names = _shape(layout, 0)
    header, text = body[2 : 2 + packing.size], body[2 + packing.size :]
    if len(header) < packing.size or len(text) > MAX_TEXT[layout.name]:
        raise NotAMessage(BAD_LENGTH, body)
    fields = dict(zip(names, packing.unpack(header)))
    if len(text) > fields.get("text_length", MAX_DATA):
        raise NotAMessage(BAD_LENGTH, body)
    return Message(layout.name, body[0], {**fields, "text": text})


def parse(body: bytes) -> Message:
    """The message that a frame's body holds; NotAMessage if it holds none."""
    client_id, opcode, data = body[0], body[1], body[2:]
    layout = _BY_OPCODE.get(opcode)
    if layout is None:
        raise NotAMessage(UNKNOWN_OPCODE, body)
    if layout.name in ("PING", "PING_ANSWER"):
        if len(data) > MAX_PING:
            raise NotAMessage(BAD_LENGTH, body)
        return Message(layout.name, client_id, {"payload": data})
    if layout.name == "ROUND":
        return _parse_round(body)
    if layout.name == "SCAN_ANSWER":
        return _parse_scan_answer(body)
    if layout.name in MAX_TEXT:
        return _parse_text(layout, body)
    fields = {"type": opcode & 0x0F} if layout.typed else {}
    try:
        packing, names = _shape(layout, data[1] if len(data) > 1 else 0)
        fields.update(zip(names, packing.unpack(data)))
    except (KeyError, struct.error):
        raise NotAMessage(BAD_LENGTH, body) from None
    return Message(layout.name, client_id, fields)


def build(name: str, client_id: int, **fields: Any) -> bytes:
    """The body of a message, the opposite of `parse`; struct.error if a value does not fit."""
    layout = _BY_NAME[name]
    opcode = layout.opcode
    if layout.typed:
        if not 1 <= fields["type"] <= MAX_TYPE:
            raise ValueError(f"pheromone types are 1 to {MAX_TYPE}, not {fields['type']}")
        opcode |= fields["type"]
    if name == "ROUND":
        return _build_round(client_id, **fields)
    if name in ("PING", "PING_ANSWER"):
        if len(fields["payload"]) > MAX_PING:
            raise ValueError(f"a PING carries up to {MAX_PING} bytes, not {len(fields['payload'])}")
        return bytes((client_id, opcode, *fields["payload"]))
    packing, names = _shape(layout, fields.get("code", 0))
    body = bytes((client_id, opcode)) + packing.pack(*(fields[name] for name in names))
    if name == "SCAN_ANSWER":
        if len(fields["rows"]) > MAX_TAG_ROWS:
            raise ValueError(f"an answer to SCAN has up to {MAX_TAG_ROWS} rows")
        return body + b"".join(struct.pack("<HhhH", *row) for row in fields["rows"])
    if name in MAX_TEXT:
        if len(fields["text"]) > MAX_TEXT[name]:
            raise ValueError(f"{name} carries up to {MAX_TEXT[name]} bytes of text")
        return body + bytes(fields["text"])
    return body


def build_hello(
    client_id: int, nonce: int, firmware_version: int = 1, round_period: int = 0
) -> bytes:
    """HELLO of a client that does not ask for turns, unless told otherwise."""
    return build(
        "HELLO",
        client_id,
        nonce=nonce,
        firmware_version=firmware_version,
        round_period=round_period,
    )
