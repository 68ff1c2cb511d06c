"""Holds the client and the model against the vectors and the specification's own words."""

from __future__ import annotations

import socket
import time
from types import SimpleNamespace
from typing import Any
from unittest import mock

from . import vectors
from .. import client
from ..client import Client, ErrorAnswer, Line, NoAnswer
from ..servers import Servers
from .model import Model, Pheromone, cosine_q14, fit_to_wire, round_half_away, sine_q14
from .report import PATIENCE_S
from ..wire import (
    BUSY,
    EVERYBODY,
    HALT,
    READ_ONLY,
    REASONS,
    Decoder,
    Message,
    NotAMessage,
    build,
    crc16,
    encode,
    parse,
)


def self_test() -> str:
    """Gives a line to print, or raises AssertionError."""
    return (
        f"{_check_crc()} CRCs, {_check_frames()} frames, {_check_fields()} messages,"
        f" {_check_streams()} streams, {_check_model()}, {_check_numbers()}, {_check_commands()} and"
        f" {_check_list()} agree with the specification"
    )


def _check_crc() -> int:
    rows = vectors.rows("crc.txt")
    for data, number in rows:
        got = crc16(vectors.from_hex(data))
        assert got == int(number, 16), f"CRC of {data} is {number}, not {got:04X}"
    return len(rows)


def _check_frames() -> int:
    frames = vectors.frames()
    for name, body, wire, verdict in frames.values():
        if body is not None:
            got = encode(body)
            assert got == wire, f"{name}: encoded as {got.hex(' ')}"
        decoder = Decoder()
        found = decoder.feed(wire)
        assert found in ([], [body]), f"{name}: read as {[one.hex(' ') for one in found]}"
        told = _verdict(found[0]) if found else " ".join(decoder.dropped.keys() - {"begun-again"})
        assert told == verdict, f"{name}: {told}, not {verdict}"
    return len(frames)


def _verdict(body: bytes) -> str:
    try:
        parse(body)
    except NotAMessage as error:
        return {1: "unknown-opcode", 2: "bad-length", 11: "bad-value"}[error.reason]
    return "ok"


def _check_fields() -> int:
    frames = vectors.frames()
    rows = vectors.rows("fields.txt")
    for name, message_name, text in rows:
        expected: dict[str, Any] = {}
        for pair in text.split():
            key, value = pair.split("=")
            expected[key] = vectors.value_of(message_name, key, value)
        if message_name == "ROUND":
            lists = expected.pop("left"), expected.pop("right")
            expected["answers"] = list(zip(*lists, strict=True))
        if message_name == "SCAN_ANSWER":
            columns = [expected.pop(name) for name in vectors.TAG_ROW]
            expected["rows"] = list(zip(*columns, strict=True))
        body = frames[name].body
        message = parse(body)
        got = {"id": message.client_id, **message.fields}
        assert (message.name, got) == (message_name, expected), f"{name}: read as {message}"
        again = build(message_name, expected.pop("id"), **expected)
        assert again == body, f"{name}: built as {again.hex(' ')}"
    good = {frame.name for frame in frames.values() if frame.verdict == "ok"}
    missing = good - {row[0] for row in rows}
    assert not missing, f"good frames without fields: {missing}"
    return len(rows)


def _check_streams() -> int:
    streams = vectors.streams()
    for name, data, delivered in streams:
        at_once = Decoder().feed(data)
        assert at_once == delivered, f"{name}: {[body.hex(' ') for body in at_once]}"
        decoder = Decoder()
        dribbled = [body for byte in data for body in decoder.feed(bytes((byte,)))]
        assert dribbled == delivered, f"{name}, byte by byte"
    return len(streams)


def _check_model() -> str:
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
    return "the model"


def _line_pair() -> tuple[Line, Line]:
    here, there = socket.socketpair()
    return Line(here.detach()), Line(there.detach())


def _hello_answer(client_id: int, nonce: int, last_seq: int) -> bytes:
    return build(
        "HELLO_ANSWER",
        client_id,
        nonce=nonce,
        protocol_version=1,
        epoch=1,
        pose_unit_10um=100,
        antenna_distance_mm=300,
        type_mask=2,
        slot_ms=1,
        response_window_ms=100,
        last_opcode=0x52,
        last_seq=last_seq,
    )


def _check_numbers() -> str:
    """No number is used twice, whatever becomes of a request; HELLO takes none back."""
    server, line = _line_pair()
    with server, line:
        robot = Client(line, 16, timeout=0.01, tries=1)
        for reason in (*REASONS, 0):  # 0: no answer at all
            before = robot.next_seq
            robot._in_step = True  # spares the server the echo of a PING
            if reason:
                refusal = build("ERROR", 16, refused_opcode=0x52, reason=reason, seq=before)
                server.send(encode(refusal))
            try:
                robot.event(1)
            except (ErrorAnswer, NoAnswer):
                pass
            assert robot.next_seq == before + 1, f"seq {robot.next_seq} after ERROR {reason}"
        robot.timeout = PATIENCE_S
        for nonce, last, expected in (
            (1, 200, 201),
            (1, 199, 201),
            (1, 72, 201),
            (1, 71, 72),
            (1, 75, 76),
            (1, 255, 76),
            (2, 3, 4),
        ):
            robot._in_step = True
            server.send(encode(_hello_answer(16, nonce, last)))
            robot.hello(nonce)
            assert robot.next_seq == expected, f"seq {robot.next_seq} after HELLO with {last}"
    return "sequence numbers"


def _check_commands() -> str:
    """A COMMAND is obeyed once, acknowledged every time, and halt to all is not acknowledged, also
    before the echo that a request waits for; a ROUND, in which a client without a period takes no
    part, is ignored."""
    server, line = _line_pair()
    obeyed: list[str] = []

    def obey(command: Message) -> int:
        obeyed.append(str(command))
        return 11

    with server, line:
        robot = Client(line, 16, on_command=obey)
        go = encode(build("COMMAND", 16, seq=16, code=4, x=528, y=784))
        for_another = encode(build("COMMAND", 17, seq=1, code=2))
        halt = encode(build("COMMAND", EVERYBODY, seq=1, code=HALT))
        a_round = encode(vectors.frames()["round_of_one_robot_twice"].body or b"")
        server.send(go + for_another + a_round + halt + go)
        robot.listen(0)  # at the deadline already: nothing is read
        assert not obeyed
        robot.listen(0.05)
        heard = [server.receive(time.monotonic() + 1) for _ in range(2)]
        echo = build("PING_ANSWER", 16, payload=robot._ping_tag + (1).to_bytes(8, "little"))
        server.send(halt + go + b"".join(map(encode, (echo, build("EVENT_ACK", 16, seq=0)))))
        robot.event(1)  # not in step: sends a PING before it
        heard += [server.receive(time.monotonic() + 1) for _ in range(3)]
    ack = build("COMMAND_ACK", 16, seq=16, code=4, result=11)
    ping = build("PING", 16, payload=echo[2:])
    event = build("EVENT", 16, seq=0, code=1, argument=0)
    assert heard == [ack, ack, ping, ack, event], f"sent {heard}"
    go_told, halt_told = "COMMAND id=16 seq=16 code=4 x=528 y=784", "COMMAND id=255 seq=1 code=1"
    assert obeyed == [go_told, halt_told, halt_told], f"obeyed {obeyed}"
    return "the handling of commands"


class _PutsOff(Line):
    """A server that makes no change; the next one does. In a time of its own."""

    def __init__(self, reason: int) -> None:
        super().__init__(-1)
        self.reason, self.now, self.left_at = reason, 0.0, 0.0

    def sleep(self, s: float) -> None:
        self.now += s

    def send(self, data: bytes) -> None:
        pass

    def go_on(self) -> None:
        self.left_at = self.now

    def receive(self, deadline: float) -> bytes | None:
        seq = self.decoder.feed(self.unanswered)[0][2]
        if self.left_at:
            return build("EVENT_ACK", 16, seq=seq)
        return build("ERROR", 16, refused_opcode=0x52, reason=self.reason, seq=seq)


def _check_list() -> str:
    """When a client leaves a server that puts changes off; that a list is tried more and more slowly,
    and that each server gets the request that is unanswered, but no acknowledgement."""
    for reason in (BUSY, READ_ONLY):
        line = _PutsOff(reason)
        clock = SimpleNamespace(monotonic=lambda: line.now, sleep=line.sleep)
        with mock.patch.object(client, "time", clock):
            robot = Client(line, 16, timeout=0.25, tries=20)
            robot._in_step = True
            while not line.left_at:
                try:
                    robot.event(1)
                except ErrorAnswer:
                    line.now += 0.0625
        assert line.left_at == 1.0, f"left after {line.left_at} s of {REASONS[reason]}"

    sockets = [socket.socket(type=socket.SOCK_DGRAM) for _ in range(2)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
        one.settimeout(10)
    first, second = sockets
    with first, second, Servers([f"udp:127.0.0.1:{one.getsockname()[1]}" for one in sockets]) as line:
        robot = Client(line, 16, timeout=0.01, tries=1, on_command=lambda _: 0)
        robot._in_step = True
        try:
            robot.sense(1, 2, 3, 4)
        except NoAnswer:
            pass
        request, address = first.recvfrom(99)
        first.sendto(encode(build("COMMAND", 16, seq=16, code=2)), address)
        robot.listen(0.01)
        found = []
        for _ in range(7):
            line.go_on()
            found.append(line.slowness)
        assert found == [1, 2, 2, 4, 4, 4, 4], f"{found} times as slow"
        for _ in range(4):
            heard, address = second.recvfrom(99)
            assert heard == request, f"the second server got {heard.hex(' ')}"
        second.sendto(encode(build("COMMAND", EVERYBODY, seq=1, code=HALT)), address)
        line.receive(time.monotonic() + 10)
        assert line.slowness == 1, "a server was heard"
    return "the list of servers"
