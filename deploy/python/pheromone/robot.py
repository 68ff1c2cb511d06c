"""A robot's conversation with the server (sections 3, 7 and 8), over a terminal or servers.Servers.

    with open_line("udp:127.0.0.1:4951") as line:          # of servers.py
        robot = Client(line, client_id=7)
        robot.hello(nonce=42)                               # a boot counter
        print(robot.sense(pheromone=1, x=1000, y=500, heading=0))

Coordinates are pose units, millimetres unless the server says otherwise; headings are binary angles,
65536 to a turn. For a line without other talkers: the listening and the random delays of section 9
are not here. One thread at a time; aio.AsyncClient is the same for asyncio.

On a link that signs its frames (section 18), a robot has a key of 16 bytes, and counts its boots in a
file, since no nonce may come twice with a key:

        robot = Client(line, client_id=7, key=bytes.fromhex("603DEB10..."))
        robot.hello(nonce=next_boot("robot-7.boots"))
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from . import wire
from ._line import InUse, Line, open_terminal
from ._signing import NonceUsedUp, Signer, next_boot
from .wire import Message, NotAMessage, build, build_hello, parse


__all__ = ["Client", "ErrorAnswer", "InUse", "Intensities", "Line", "NewEpoch", "NoAnswer",
           "NonceUsedUp", "ServerInfo", "answer_in", "mutates", "next_boot", "open_terminal"]

PUT_OFF = (wire.BUSY, wire.READ_ONLY)  # reasons to try another server
MAX_AHEAD = 128  # numbers that may follow the last one accepted
STUCK_S = 1.0  # without a change that is taken
NO_SLOT = 255  # READ: there is none; WRITE: the tag's drop policy chooses


class NoAnswer(Exception):
    """The server kept silent."""


class NewEpoch(NoAnswer):
    """The server has another epoch (section 7): what waits for an answer is dropped, and hello() is
    to be called, since what it tells may be new. Only with a key."""


class ErrorAnswer(Exception):
    """The server answered with an ERROR."""

    def __init__(self, refused_opcode: int, reason: int, seq: int) -> None:
        self.reason = reason
        name = wire.REASONS.get(reason, "not permitted")
        super().__init__(f"opcode {refused_opcode:02X} refused: {reason}, {name} (seq {seq})")


class Intensities(NamedTuple):
    """Intensities at the two antennas, in 1/4096 of a pheromone unit."""

    left: int
    right: int


class ServerInfo(NamedTuple):
    """The contents of HELLO's answer."""

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
        return [t for t in range(1, wire.MAX_TYPE + 1) if self.type_mask >> t & 1]


class Client:
    """One robot on a line: asks, waits, takes the right answer, repeats what must not be lost.

    Its requests raise ErrorAnswer for an ERROR and NoAnswer for silence. They are sent up to `tries`
    times, `timeout` seconds apart, byte for byte the same: the server carries them out once.
    `on_command` is called once for each COMMAND and gives the ACK's result, 0 for accepted.

    With a `key` of 16 bytes, frames are signed, and what is not signed is ignored (section 18). Then
    hello() comes before any other request, with a nonce that the key has not had: next_boot. After
    silence a new session begins, with the same nonce, 65536 times at most (NonceUsedUp).
    """

    def __init__(
        self,
        line: Line,
        client_id: int,
        timeout: float = 0.5,
        tries: int = 4,
        on_command: Callable[[Message], int] | None = None,
        key: bytes | None = None,
    ) -> None:
        if not 1 <= client_id <= 254:
            raise ValueError(f"CLIENT_ID is 1 to 254, not {client_id}")
        self.line = line
        self.client_id = client_id
        self.timeout = timeout
        self.tries = tries
        self.on_command = on_command
        self.next_seq = 0
        self._not_accepted = 0  # numbers since the last one that the server accepted
        self._nonce: int | None = None  # of the last HELLO that was answered
        self._hello = b""  # that HELLO
        self._epoch: int | None = None  # of that answer
        self._last_command: tuple[int, bytes] | None = None  # its seq and its ACK
        self._put_off_since: float | None = None  # the first change since one was taken
        self._changed_at = 0.0  # when one was sent last
        self._in_step = False  # False: who knows what is under way, or was left half said
        self._signer = None if key is None else Signer(key, client_id)
        self._ping_tag = secrets.token_bytes(8)
        self._ping_count = 0

    def hello(self, nonce: int, **fields: int) -> ServerInfo:
        """Sends HELLO; required before any change. `fields` as in wire.build_hello."""
        new = nonce != self._nonce
        if new:
            self._last_command = None
        request = build_hello(self.client_id, nonce, **fields)
        if self._signer is None:
            told = ServerInfo(**self._ask(request, self.tries))
        else:
            told = self._begin_session(request)
        self.line.moved = False
        if told.protocol_version != 1:
            raise ValueError(f"the server speaks version {told.protocol_version}, not 1")
        self._hello = request
        self._take(nonce, told)
        return told

    def _take(self, nonce: int, told: ServerInfo) -> None:
        """The server's epoch, and which number comes next."""
        new = nonce != self._nonce
        if self._epoch not in (None, told.epoch):
            self._last_command = None
        goes_on_from = (told.last_seq + 1) % 256
        behind = self._not_accepted >= MAX_AHEAD
        if new or behind or 1 <= (goes_on_from - self.next_seq) % 256 <= 127:  # else never back
            self.next_seq = goes_on_from
            self._not_accepted = 0
        self._nonce, self._epoch = nonce, told.epoch

    def _look_about(self) -> None:
        """Whether a server that the line has gone to has the same state as the one before: HELLO
        under the same nonce, once, since it may have to wait; with the next request again."""
        if self.line.moved and self._nonce is not None:
            answer = self._exchange(self._hello)
            if answer is not None and answer.name == "HELLO_ANSWER":
                self.line.moved = False
                self._take(self._nonce, ServerInfo(**answer.fields))

    def ping(self, payload: bytes = b"") -> bytes:
        """Gives the echo."""
        request = build("PING", self.client_id, payload=payload)
        return bytes(self._ask(request, self.tries)["payload"])

    def sense(self, pheromone: int, x: int, y: int, heading: int, wide: bool = False) -> Intensities:
        """What the robot senses at this pose; `wide` if x or y does not fit into 16 bits.

        Sent once only: after NoAnswer, come again with a fresh pose.
        """
        name = "SENSE_WIDE" if wide else "SENSE"
        request = build(name, self.client_id, type=pheromone, x=x, y=y, heading=heading)
        answer = self._ask(request, tries=1)
        return Intensities(answer["left"], answer["right"])

    def trace(self, pheromone: int, x: int, y: int, heading: int, wide: bool = False) -> Intensities:
        """Senses, and deposits one quantum."""
        name = "TRACE_WIDE" if wide else "TRACE"
        answer = self._change(name, type=pheromone, x=x, y=y, heading=heading)
        return Intensities(answer["left"], answer["right"])

    def deposit(self, pheromone: int, x: int, y: int, quanta: int = 1) -> None:
        self._change("DEPOSIT", type=pheromone, x=x, y=y, quanta=quanta)

    def event(self, code: int, argument: int = 0) -> None:
        self._change("EVENT", code=code, argument=argument)

    def scan(self, x: int, y: int, after: int = 0) -> list[tuple[int, int, int, int]]:
        """The tags in range: tag, dx, dy and generation of each."""
        found: list[tuple[int, int, int, int]] = []
        while True:
            request = build("SCAN", self.client_id, x=x, y=y, after=after)
            answer = self._ask(request, self.tries)
            found += answer["rows"]
            if not answer["more"] or not answer["rows"]:
                return found
            after = answer["rows"][-1][0]

    def read(self, x: int, y: int, tag: int) -> list[dict[str, Any]]:
        """What is written on a tag: the fields of READ's answer for each slot in use."""
        blocks, slot = [], 0
        while slot != NO_SLOT:
            request = build("READ", self.client_id, x=x, y=y, tag=tag, slot=slot)
            answer = self._ask(request, self.tries)
            if answer["slot"] == NO_SLOT:
                break
            blocks.append(answer)
            slot = answer["next"]
        return blocks

    def write(
        self, x: int, y: int, tag: int, statement: dict[str, int], **more: int
    ) -> dict[str, Any]:
        """Writes a statement, with WRITE's fields of these names; by default the server's clock and
        the tag's drop policy, without conditions."""
        fields = dict(slot=NO_SLOT, flags=0, expected=0, lease_s=0, time=0) | statement | more
        return self._change("WRITE", x=x, y=y, tag=tag, **fields)

    def erase(self, x: int, y: int, tag: int, slot: int) -> None:
        self._change("ERASE", x=x, y=y, tag=tag, slot=slot, flags=0, expected=0)

    def register(self, unique_id: str, number: int = 0) -> int:
        """Tells who this robot is, as an author; gives its number."""
        told = self._change("SYMBOL", kind=1, number=number, text=unique_id.encode())
        return int(told["number"])

    def define(self, number: int, text: str) -> None:
        """Defines a string of this robot."""
        self._change("SYMBOL", kind=2, number=number, text=text.encode())

    def resolve(self, robot: int, number: int) -> str:
        """What a number means in blocks of a robot."""
        text = b""
        while True:
            request = build("RESOLVE", self.client_id, kind=2, robot=robot, number=number,
                            offset=len(text))
            answer = self._ask(request, self.tries)
            text += answer["text"]
            if len(text) >= answer["text_length"] or not answer["text"]:
                return text.decode()

    def listen(self, seconds: float) -> None:
        """Serves commands for a while."""
        deadline = time.monotonic() + seconds
        while (body := self._receive(deadline)) is not None:
            self._overhear(body)

    def resynchronise(self) -> list[bytes]:
        """Sends a PING with a new payload and waits for its echo; returns what came before it, of
        which it obeys the commands."""
        self._in_step = False
        heard: list[bytes]
        if self._signer is not None:
            self._greet_again()
            return []
        for _ in range(self.tries):
            self._ping_count += 1
            payload = self._ping_tag + self._ping_count.to_bytes(8, "little")
            echo = build("PING_ANSWER", self.client_id, payload=payload)
            self._send(build("PING", self.client_id, payload=payload))
            heard = []
            deadline = time.monotonic() + self.timeout * self.line.slowness
            while (body := self.line.receive(deadline)) is not None:
                if body == echo:
                    self._in_step = True
                    self.line.unanswered = b""
                    return heard
                heard.append(body)
                self._overhear(body)
            self.line.go_on()
        raise NoAnswer("no echo of a PING")

    def _begin_session(self, hello: bytes) -> ServerInfo:
        """Asks for a session, and says HELLO in it. With a key, this does what a PING does without:
        nothing of the session before is taken any more. And a server that was started again has
        none."""
        for left in reversed(range(self.tries)):
            answer = self._exchange(hello) if self._is_greeted(hello) else None
            if answer is None:
                self.line.go_on()
            elif answer.name == "HELLO_ANSWER":
                return ServerInfo(**answer.fields)
            elif answer.fields["reason"] != wire.BUSY or not left:
                raise ErrorAnswer(**answer.fields)
            else:
                time.sleep(self.timeout / 4)
        raise NoAnswer("no answer to HELLO")

    def _is_greeted(self, hello: bytes) -> bool:
        assert self._signer is not None
        self._in_step = False
        self.line.send(wire.PAD + wire.encode(self._signer.ask(hello)))
        deadline = time.monotonic() + self.timeout * self.line.slowness
        while (heard := self._receive(deadline)) is not None:
            self._overhear(heard)
        self._in_step = not self._signer.awaits_greeting
        return self._in_step

    def _greet_again(self) -> None:
        """A session that the caller did not ask for."""
        if self._nonce is None:
            raise ValueError("with a key, hello() comes first")
        told = self._begin_session(self._hello)
        if told.epoch != self._epoch:
            self._in_step = False
            raise NewEpoch("the server has another epoch")
        self.line.moved = False
        self._take(self._nonce, told)

    def _change(self, name: str, **fields: Any) -> dict[str, Any]:
        """Makes a mutating request. The next one takes the next number, whatever becomes of
        this one."""
        if self._not_accepted >= MAX_AHEAD and self._nonce is not None:
            self.hello(self._nonce)  # otherwise it would take us for being behind
        build(name, self.client_id, seq=self.next_seq, **fields)  # raises if a value does not fit
        if not self._in_step:
            self.resynchronise()  # what has not been sent at all does not use its number
        request = build(name, self.client_id, seq=self.next_seq, **fields)
        self.next_seq = (self.next_seq + 1) % 256
        self._not_accepted += 1
        answer = self._ask(request, self.tries)
        self._not_accepted = 0
        return answer

    def _ask(self, request: bytes, tries: int) -> dict[str, Any]:
        """Repeats a request until it is answered, and returns the fields of the answer."""
        for left in reversed(range(tries)):
            if not self._in_step:
                self.resynchronise()
            answer = self._exchange(request)
            if answer is None:
                continue
            if answer.name != "ERROR":
                if answer.name != "HELLO_ANSWER":
                    self._look_about()
                return answer.fields
            if answer.fields["reason"] != wire.BUSY or not left:
                raise ErrorAnswer(**answer.fields)
            time.sleep(self.timeout / 4)
        raise NoAnswer(f"no answer to {parse(request)}")

    def _exchange(self, request: bytes) -> Message | None:
        """Sends a request once and returns its answer, perhaps an ERROR; None if there was none."""
        self._send(request)
        if mutates(request) and self._is_stuck():
            self.line.go_on()
        deadline = time.monotonic() + self.timeout * self.line.slowness
        while (heard := self._receive(deadline)) is not None:
            if (answer := answer_in(heard, request)) is not None:
                self.line.unanswered = b""
                if mutates(request) and answer.fields.get("reason") not in PUT_OFF:
                    self._put_off_since = None
                return answer
            self._overhear(heard)
        self._in_step = False
        return None

    def _is_stuck(self) -> bool:
        """Whether all that came in answer to changes for a while, and another one is sent, was that
        they cannot be made now. One that was given up earlier tells nothing."""
        now = time.monotonic()
        if self._put_off_since is None or now - self._changed_at >= STUCK_S:
            self._put_off_since = now
        self._changed_at = now
        stuck = now - self._put_off_since >= STUCK_S
        if stuck:
            self._put_off_since = now
        return stuck

    def _receive(self, deadline: float) -> bytes | None:
        """As Line.receive, without what is to be ignored. None also if the server greets."""
        signer = self._signer
        while (body := self.line.receive(deadline)) is not None and signer is not None:
            awaited = signer.awaits_greeting
            verified = signer.verify(body)
            if verified is not None or awaited != signer.awaits_greeting:
                return verified
        return body

    def _send(self, body: bytes) -> None:
        """A request."""
        framed = self._framed(body)
        # Another server has no session with us, and what is signed is sent once.
        self.line.unanswered = framed if self._signer is None else b""
        self.line.send(framed)

    def _framed(self, body: bytes) -> bytes:
        if self._signer is not None:
            body = self._signer.sign(body)
        return (b"" if self._in_step else wire.PAD) + wire.encode(body)

    def _overhear(self, body: bytes) -> None:
        """Looks at a frame that is no answer: obeys a COMMAND once and acknowledges it each time;
        to everybody there is only *halt*, obeyed each time and never acknowledged."""
        if self.on_command is None or body[0] not in (self.client_id, wire.EVERYBODY):
            return
        try:
            command = parse(body)
        except NotAMessage:
            return
        if command.name != "COMMAND":
            return
        seq, code = command.fields["seq"], command.fields["code"]
        if command.client_id == wire.EVERYBODY:
            if code == wire.HALT:
                self.on_command(command)
            return
        if self._last_command is None or self._last_command[0] != seq:
            result = self.on_command(command)
            ack = build("COMMAND_ACK", self.client_id, seq=seq, code=code, result=result)
            self._last_command = seq, ack
        self.line.send(self._framed(self._last_command[1]))


def mutates(request: bytes) -> bool:
    return request[1] >> 4 in (0x2, 0x3, 0x6) or request[1] in (0x43, 0x44, 0x45, 0x52)


def answer_in(heard: bytes, request: bytes) -> Message | None:
    """The message in `heard`, if that is an answer to this request; else None (section 8)."""
    try:
        answer = parse(heard)
    except NotAMessage:
        return None
    client_id, opcode, data = request[0], request[1], request[2:]
    seq = data[0] if mutates(request) and data else 0
    if answer.name == "ERROR":
        same = answer.fields["refused_opcode"] == opcode and answer.fields["seq"] == seq
    else:
        same = (
            heard[1] == opcode | wire.ANSWER
            and answer.fields.get("seq", seq) == seq
            and (answer.name != "HELLO_ANSWER" or heard[2:4] == data[:2])
            and (answer.name != "PING_ANSWER" or heard[2:] == data)
            and (answer.name != "READ_ANSWER" or heard[2:4] == data[8:10])
            and (answer.name != "RESOLVE_ANSWER" or _resolves(answer, data))
        )
    return answer if same and answer.client_id == client_id else None


def _resolves(answer: Message, asked: bytes) -> bool:
    """Whether this is what a RESOLVE with this DATA asks for, and all of the text that it can be."""
    fields, offset = answer.fields, asked[9]
    kind, robot, number = asked[0], asked[1:5], asked[5:9]
    same: bool = kind == 4 or (
        fields["kind"] == kind
        and fields["robot"].to_bytes(4, "little", signed=True) == robot
        and (kind != 2 or fields["number"].to_bytes(4, "little", signed=True) == number)
    )
    rest = max(0, fields["text_length"] - offset)
    return same and len(fields["text"]) == min(rest, wire.MAX_TEXT["RESOLVE_ANSWER"])
