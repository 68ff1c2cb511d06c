"""Which request is refused, why, and what is never answered (section 6)."""

from __future__ import annotations

from ..wire import build, build_hello
from .model import Model, OffTheMap
from .report import check_equal, log
from .robot import Robot, refused_as
from .setups import NOT_CONFIGURED, PERMANENT


def check_errors(robot: Robot, model: Model) -> None:
    me = robot.client_id
    robot.hello(9000)
    for opcode in (0x10, 0x40, 0x47, 0x4F, 0x50, 0x53, 0x5F, 0x70, 0x73, 0x7E, 0x7F):
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
        "SCAN": {"x": 0, "y": 0, "after": 0},
        "READ": {"x": 0, "y": 0, "tag": 1, "slot": 0},
        "WRITE": {
            **{"seq": 99, "x": 0, "y": 0, "tag": 1, "slot": 255, "flags": 0, "expected": 0},
            **{"lease_s": 0, "time": 0, "subject_namespace": 0, "subject": 1},
            **{"predicate_namespace": 0, "predicate": 2, "object_namespace": -3, "object": 4},
        },
        "ERASE": {"seq": 99, "x": 0, "y": 0, "tag": 1, "slot": 0, "flags": 0, "expected": 0},
        "RESOLVE": {"kind": 1, "robot": 1, "number": 1, "offset": 0},
    }
    bodies = [(name, build(name, me, **fields)) for name, fields in whole.items()]
    for name, body in [*bodies, ("HELLO", build_hello(me, nonce=9000))]:
        seq = 99 if "seq" in whole.get(name, {}) else 0
        for length in (*range(2, len(body)), len(body) + 1, 66):
            wrong = (body + b"\x01" * 64)[:length]
            expected = seq if length > 2 else 0
            robot.expect_error(wrong, 2, expected, f"{name} with {length - 2} bytes of DATA")
    robot.expect_error(bytes((me, 0x72)) + b"x" * 17, 2, 0, "PING with 17 bytes")
    symbol = build("SYMBOL", me, seq=99, kind=1, number=0, text=b"")
    for length in (*range(2, len(symbol)), 2 + 63):
        expected = 99 if length > 2 else 0
        wrong = (symbol + b"a" * 64)[:length]
        robot.expect_error(wrong, 2, expected, f"SYMBOL with {length - 2} bytes of DATA")
    unknown = build("DEPOSIT", me, type=NOT_CONFIGURED, seq=99, x=0, y=0, quanta=1)
    robot.expect_error(unknown[:-1], 2, 99, "DEPOSIT of an unknown type, too short")

    unit = model.pose_unit_um
    left, bottom = model.origin_x_um // unit, model.origin_y_um // unit
    right, top = left + model.width_um // unit, bottom + model.height_um // unit
    outside = [(x, y) for x in (left, 0, right) for y in (bottom - 1, top + 1)]
    outside += [(left - 1, 0), (right + 1, 0), (2**31 - 1, 2**31 - 1), (-(2**31), -(2**31))]
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
        refused_as(3, lambda: robot.trace(PERMANENT, x, y, 0, wide=True))
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
    refused_as(4, lambda: robot.sense(NOT_CONFIGURED, 0, -32768, 0))

    body = build("SENSE", me, type=NOT_CONFIGURED, x=0, y=0, heading=0)
    robot.expect_error(body, 4, 0, "SENSE of a type that is not configured")
    refused_as(4, lambda: robot.sense(NOT_CONFIGURED, 0, 0, 0, wide=True))
    refused_as(4, lambda: robot.deposit(NOT_CONFIGURED, 0, 0, 1))
    refused_as(4, lambda: robot.trace(NOT_CONFIGURED, 0, 0, 0))
    refused_as(4, lambda: robot.trace(NOT_CONFIGURED, 0, 0, 0, wide=True))
    for code in (0, 13, 255):
        refused_as(11, lambda: robot.event(code))
    for code in range(1, 13):
        robot.event(code, -code)

    silent = {
        "a frame of the server": build("PING_ANSWER", me, payload=b"echo"),
        "an unknown opcode with bit 7": bytes((me, 0xFF)),
        "an ERROR": build("ERROR", me, refused_opcode=1, reason=1, seq=0),
        "a COMMAND": build("COMMAND", me, seq=1, code=1),
        "ID FF": bytes((0xFF, 0x72)) + b"anybody?",
        "an unknown opcode from ID FF": bytes((0xFF, 0x47)),
        "ID 00": bytes((0x00, 0x72)) + b"nobody",
        "opcode 00": bytes((me, 0x00)),
        "an ACK of nothing": build("COMMAND_ACK", me, seq=1, code=1, result=0),
        "an ACK without DATA": bytes((me, 0x51)),
        "an ACK too long": bytes((me, 0x51, 1, 2, 3, 4, 5)),
    }
    for what, body in silent.items():
        robot.expect_silence(body, what)
    log("errors: reasons, their order, the seq in them, and what is never answered")
