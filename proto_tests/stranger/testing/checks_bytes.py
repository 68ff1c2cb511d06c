"""Bytes good and bad: vectors, damaged frames, garbage, frames in odd pieces."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Iterator

from ..client import Line, answer_in
from ..wire import (
    ANSWER,
    DLE,
    EVERYBODY,
    PAD,
    Decoder,
    Message,
    NotAMessage,
    build,
    encode,
    parse,
)
from . import vectors
from .daemon import Daemon
from .report import check_equal, log
from .robot import Robot, rebuilt


def calls_for_an_answer(body: bytes) -> bool:
    """Whether the server answers this good frame (section 8)."""
    return body[0] != EVERYBODY and not body[1] & ANSWER and body[1] != 0x51


def check_every_vector(line: Line) -> None:
    """Each vector's bytes go to the daemon; what comes back is what the vector's verdict allows."""
    robot = Robot(line, 77)
    frames = vectors.frames()
    for name, body, wire, verdict in frames.values():
        said = robot.say(wire)
        what = f"vector {name}"
        if body is None or verdict == "refused" or not calls_for_an_answer(body):
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
            matched = answer_in(rebuilt(answer), body)
            assert matched is not None, f"{answer} is no answer to {what}"
    streams = vectors.streams()
    for name, data, bodies in streams:
        said = robot.say(data)
        asked = [body for body in bodies if calls_for_an_answer(body)]
        check_equal(len(said), len(asked), f"answers to stream {name}")
        for answer, body in zip(said, asked):
            same = (answer.client_id, rebuilt(answer)[1]) == (body[0], body[1] | ANSWER)
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


def send_bad_input(robot: Robot, wire: bytes) -> int:
    """What a strict decoder finds in these bytes is answered, all else is not; gives how often."""
    said = robot.say(wire)
    found = Decoder().feed(wire)
    to_answer = [body for body in found if calls_for_an_answer(body)]
    what = f"answers to {wire.hex(' ')} ({[str(message) for message in said]})"
    check_equal(len(said), len(to_answer), what)
    for message, body in zip(said, to_answer):
        assert answer_in(rebuilt(message), body), f"{message} is none of the {what}"
        try:
            parse(body)
        except NotAMessage as error:
            check_equal(message.fields.get("reason"), error.reason, what)
    return len(said)


def check_bad_input(daemon: Daemon, line: Line, seed: random.Random) -> None:
    robot = Robot(line, 78)
    frames = vectors.frames()
    sent = answered = 0
    for name in DAMAGED:
        check_equal(frames[name].verdict, "ok", f"the verdict of vector {name}")
        for wire in damaged(frames[name].wire):
            sent += 1
            answered += send_bad_input(robot, wire)
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
        answered += send_bad_input(robot, garbage)
    daemon.check_alive("after garbage")
    log(f"bad input: {bursts} bursts of garbage, {total} bytes, {answered} answers, a PING each")


def check_odd_pieces(daemon: Daemon, link: str, line: Line) -> None:
    robot = Robot(line, 16)
    ping = build("PING", 16, payload=bytes((DLE,)) * 16)
    echo = build("PING_ANSWER", 16, payload=bytes((DLE,)) * 16)
    wire = encode(ping)

    def check_echoes(count: int, said: list[Message], what: str) -> None:
        check_equal([rebuilt(message) for message in said], [echo] * count, what)

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
    with Line(os.open(daemon.path(link), os.O_RDWR | os.O_NOCTTY)) as second:
        second.send(wire[20:])
        check_echoes(1, robot.say(b""), "a frame sent through two openings of the terminal")
    log("odd pieces: dribbled, two in one write, from the middle, cut short")
