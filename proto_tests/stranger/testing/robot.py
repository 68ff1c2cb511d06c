"""A client that also says improper things, and looks closely at what comes back."""

from __future__ import annotations

from collections.abc import Callable

from ..client import Client, ErrorAnswer, Line, NoAnswer, answer_in
from ..wire import ANSWER, REASONS, Message, NotAMessage, build, encode, parse
from .report import check_equal

TIMEOUT_S = 60.0  # no check waits for it: what follows a silence is an echo
RAISED: dict[int, str] = {}
"""How each reason was raised over the wire first."""


class Robot(Client):
    """Sends each request once, so that nothing is mended by repeating it."""

    def __init__(self, line: Line, client_id: int) -> None:
        super().__init__(line, client_id, timeout=TIMEOUT_S, tries=1)

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
            assert body[1] & ANSWER, f"the daemon says what only clients say: {message}"
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
        answer = answer_in(rebuilt(said[0]), body)
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


def rebuilt(message: Message) -> bytes:
    return build(message.name, message.client_id, **message.fields)


def refused_as(reason: int, request: Callable[[], object]) -> None:
    try:
        got = request()
    except ErrorAnswer as refused:
        check_equal(refused.reason, reason, str(refused))
    else:
        raise AssertionError(f"{got} instead of ERROR {reason}")


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
        print(f"{reason:6}  {REASONS[reason]:<19}  {how}")
    missing = {1, 2, 3, 4, 5, 6, 9, 11} - RAISED.keys()
    assert not missing, f"never raised: {missing}"
    unexpected = RAISED.keys() & {7, 8, 10, 12}
    assert not unexpected, f"raised although they should not be: {unexpected}"
    print()
