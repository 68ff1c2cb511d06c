"""A mutating request is executed exactly once (section 7)."""

from __future__ import annotations

from ..client import Line
from ..wire import build
from .model import Model
from .report import check_equal, log
from .robot import Robot
from .setups import PERMANENT


def check_exactly_once(robot: Robot, other_link: Line, model: Model) -> None:
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
    answer = robot.answer_to(trace)
    check_equal((answer.fields["left"], answer.fields["right"]), (3584, 3584), "TRACE")
    check_quanta(2, "after a TRACE")
    check_equal(robot.answer_to(trace), answer, "repeated TRACE tells what it told first")
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
    check_equal((new.last_opcode, new.last_seq), (0x52, 141), "HELLO with a new nonce")
    again = robot.hello(nonce + 1)
    check_equal((again.last_opcode, again.last_seq), (0x52, 141), "the same HELLO again")
    late = robot.hello(nonce)
    check_equal((late.last_opcode, late.last_seq), (0x52, 141), "a late HELLO of before")
    robot.expect_silence(event, "a request of before the boot, arriving after HELLO")
    robot.expect_error(deposit(141), 5, 141, "the next one of before the boot")
    check_equal(robot.answer_to(deposit(142)).name, "DEPOSIT_ANSWER", "the first of the new boot")
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
    twin.expect_error(deposit(1), 6, 1, "DEPOSIT on a link where HELLO was not said")
    told = twin.hello(nonce + 1)
    check_equal((told.last_opcode, told.last_seq), (0, 0), "HELLO on the other link")
    check_equal(twin.answer_to(deposit(1)).name, "DEPOSIT_ANSWER", "on the other link")
    check_equal(robot.answer_to(deposit(152)).name, "DEPOSIT_ANSWER", "on the first link")
    check_quanta(6, "after a DEPOSIT on the other link")
    model.deposit(PERMANENT, x, y, 6)

    robot.hello(nonce + 2)
    for _ in range(300):  # round the whole circle of sequence numbers
        robot.event(2, 1)
    log("exactly once: repeated, reused, stale, far ahead, new nonce, stored refusals, wrap-around")
