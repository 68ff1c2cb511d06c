#!/usr/bin/env python3
"""Robots of a cluster, which keep what they have sent, and what was acknowledged, in a file.

    robots.py SEED HISTORY LINK:ID:ADDRESS,ADDRESS...       until "end" is read from standard input

LINK is the link's index in the configuration. An ADDRESS is udp:HOST:PORT, tcp:HOST:PORT, or the path
of a terminal. Each robot repeats a change until it is answered, with SENSE between the repetitions, and
goes on to its next server by the rules of protocol/README.md, section 8. After "end" no change is
begun, and the program ends when none waits. Lines of the history are JSON:

    {"t": s, "robot": "LINK:ID", "what": "sent",   "body": HEX}            a change, for the first time
    {"t": s, "robot": "LINK:ID", "what": "answer", "body": HEX, "answer": HEX, "server": n}
    {"t": s, "robot": "LINK:ID", "what": "hello",  "epoch": n, "last_seq": n}
    {"t": s, "robot": "LINK:ID", "what": "halt",   "server": n}
    {"t": s, "robot": "LINK:ID", "what": "silence", "s": s}                between answers, from 0.2 s
    {"t": s, "robot": "LINK:ID", "what": "moved",  "server": n, "why": text}
    {"t": s, "robot": "LINK:ID", "what": "wrong",  "why": text}
    {"t": s, "robot": "-",       "what": "stall",  "s": s}                 this program did not run

where t is time.monotonic(), which all processes of a machine share.
"""

import contextlib
import json
import os
import pathlib
import random
import select
import socket
import struct
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from stranger.client import InUse, answer_in, mutates, open_terminal  # noqa: E402
from stranger.wire import (BUSY, EVERYBODY, HALT, PAD, READ_ONLY, SAY_HELLO, Decoder,  # noqa: E402
                           NotAMessage, build, build_hello, encode, parse)

REPEAT_S, QUERY_EVERY_S, THINK_S = 0.2, 0.1, 0.12
SILENT_S, QUERY_SILENT_S, STUCK_S, INQUIRY_S = 0.15, 0.04, 1.0, 1.0
LISTED_SILENCE_S = 0.2
TICK_S, LISTED_STALL_S = 0.01, 0.05
TAG, TRAIL = 0, 1
CENTRE = 5000  # of the map, in mm


class Robot:
    def __init__(self, link, number, addresses, seed, tell):
        self.name, self.number, self.addresses = f"{link}:{number}", number, addresses
        self.random = random.Random(f"{seed}/{self.name}")
        self._tell = tell
        self.fd, self.server, self.connecting = -1, 0, False
        self.decoder = Decoder()
        self.nonce = self.random.randrange(1, 65536)
        self.epoch, self.next_seq, self.count = None, 0, 0
        self.hello_due = 0.0
        self.change, self.change_since, self.change_at, self.change_due = None, 0.0, 0.0, 0.0
        self.query, self.query_at = None, 0.0
        self.unanswered = None     # the last request, while nothing has come since
        self.unanswered_at = None  # the first request without a frame after it
        self.asked_at = None       # the same, of queries and HELLO
        self.moves = 0             # since a frame came
        self.arrived_at = 0.0
        self.gone = ""             # why the server is
        self.heard = False         # from this server
        self.doubtful = False      # whether it has the same state
        self.answered_at = None
        self.retry_at = 0.0
        self.is_registered = False
        self.ends = False

    def tell(self, what, **more):
        self._tell({"t": round(time.monotonic(), 4), "robot": self.name, "what": what, **more})

    # --- The line

    def connect(self, now):
        address = self.addresses[self.server]
        self.decoder = Decoder()
        self.connecting = False
        try:
            if not address.startswith(("udp:", "tcp:")):
                self.fd = open_terminal(address).fd
                os.set_blocking(self.fd, False)
            else:
                kind, host, port = address.split(":")
                one = socket.socket(type=socket.SOCK_DGRAM if kind == "udp" else socket.SOCK_STREAM)
                one.setblocking(False)
                if kind == "tcp":
                    one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                with contextlib.suppress(BlockingIOError):
                    one.connect((host, int(port)))
                self.connecting = kind == "tcp"
                self.fd = one.detach()
            if not self.connecting and self.unanswered:
                self.write(self.unanswered, now)
        except (OSError, InUse) as error:
            self.lose(now, str(error))

    def close(self):
        if self.fd >= 0:
            os.close(self.fd)
        self.fd = -1

    def lose(self, now, why):
        self.close()
        self.retry_at = now + 0.05
        self.gone = why

    def why_leave(self, now):
        """The rules of section 8, "Several servers"; empty: it stays."""
        rounds = self.moves // len(self.addresses)
        longer = 1 << min(rounds, 2)
        if self.gone and (rounds == 0 or now - self.arrived_at >= SILENT_S * longer):
            return self.gone
        if self.unanswered_at is not None and self.asked_at is not None and (
                now - self.unanswered_at >= SILENT_S * longer
                and now - self.asked_at >= QUERY_SILENT_S * longer):
            return "silent"
        return "stuck" if self.change and self.change_at - self.change_since >= STUCK_S else ""

    def go_on(self, now, why):
        self.close()
        self.server = (self.server + 1) % len(self.addresses)
        self.moves += 1
        self.arrived_at, self.gone, self.heard = now, "", False
        self.doubtful = self.epoch is not None
        self.unanswered_at = now if self.unanswered else None
        self.asked_at = now if self.unanswered and not mutates(self.unanswered) else None
        self.change_since = now
        self.change_due = self.hello_due = 0.0  # at once
        self.tell("moved", server=self.server, why=why)
        self.connect(now)

    def send(self, body, now):
        """A request; it waits for a connection."""
        self.unanswered = body
        if self.unanswered_at is None:
            self.unanswered_at = now
        if self.asked_at is None and not mutates(body):
            self.asked_at = now
        if not self.connecting:
            self.write(body, now)

    def write(self, body, now):
        try:
            if self.fd >= 0:
                os.write(self.fd, PAD + encode(body))
        except BlockingIOError:
            pass
        except OSError as error:
            self.lose(now, str(error))

    def is_ready(self):
        """Something can be read, or the connection was made."""
        now = time.monotonic()
        if self.connecting:
            with socket.socket(fileno=os.dup(self.fd)) as one:
                error = one.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if error:
                self.lose(now, os.strerror(error))
                return
            self.connecting = False
            if self.unanswered:
                self.write(self.unanswered, now)
            return
        try:
            data = os.read(self.fd, 4096)
        except BlockingIOError:
            return
        except OSError as error:
            self.lose(now, str(error))
            return
        if not data:
            self.lose(now, "closed")
            return
        for body in self.decoder.feed(data):
            self.hear(body, now)

    # --- The conversation

    def hear(self, body, now):
        if body[0] not in (self.number, EVERYBODY):
            return
        self.unanswered = self.unanswered_at = self.asked_at = None
        self.moves, self.gone, self.heard = 0, "", True
        try:
            message = parse(body)
        except NotAMessage as error:
            self.tell("wrong", why=f"no message: {error}")
            return
        if message.name == "COMMAND":
            if message.fields["code"] == HALT:
                self.tell("halt", server=self.server)
            if body[0] == self.number:
                self.write(build("COMMAND_ACK", self.number, seq=message.fields["seq"],
                                 code=message.fields["code"], result=0), now)
            return
        if self.query and answer_in(body, self.query):
            self.query = None
            self.answered(now)
        elif message.name == "HELLO_ANSWER" and message.fields["nonce"] == self.nonce:
            self.greeted(message.fields, now)
        elif self.change and answer_in(body, self.change):
            self.change_answered(body, message, now)

    def answered(self, now):
        if self.answered_at is not None and now - self.answered_at >= LISTED_SILENCE_S:
            self.tell("silence", s=round(now - self.answered_at, 4))
        self.answered_at = now

    def greeted(self, fields, now):
        self.doubtful = False
        self.tell("hello", epoch=fields["epoch"], last_seq=fields["last_seq"])
        if self.epoch is None:
            self.next_seq = (fields["last_seq"] + 1) % 256
        elif self.epoch != fields["epoch"]:
            self.tell("wrong", why=f"epoch {fields['epoch']} after {self.epoch}")
        elif self.change is None and 0 < (fields["last_seq"] + 1 - self.next_seq) % 256 < 128:
            self.tell("wrong", why=f"the server has seq {fields['last_seq']} as the last one of this "
                                   f"robot, which goes on with {self.next_seq}")
        self.epoch = fields["epoch"]

    def change_answered(self, body, message, now):
        if message.name == "ERROR":
            reason = message.fields["reason"]
            if reason in (BUSY, READ_ONLY):
                self.change_due = now + REPEAT_S / 2
                return
            if reason == SAY_HELLO:
                self.tell("wrong", why=f"has to say hello, {self.change.hex()}")
                self.change, self.doubtful = None, True
                return
        self.tell("answer", body=self.change.hex(), answer=body.hex(), server=self.server)
        if message.name == "SYMBOL_ANSWER":
            self.is_registered = True
        if message.name != "ERROR":
            self.answered(now)
        self.change = None
        self.change_due = now + THINK_S * (0.5 + self.random.random())

    def next_change(self):
        """Each is another one, also where seq is the same."""
        self.count += 1
        x, y = 500 + self.count % 9000, 500 + self.random.randrange(9000)
        kind = self.random.randrange(10)
        common = {"client_id": self.number, "seq": self.next_seq}
        self.next_seq = (self.next_seq + 1) % 256
        if not self.is_registered:
            return build("SYMBOL", **common, kind=1, number=0, text=f"robot {self.name}".encode())
        if kind < 5:
            return build("TRACE", **common, type=TRAIL, x=x, y=y, heading=self.count % 65536)
        if kind < 7:
            return build("DEPOSIT", **common, type=TRAIL, x=x, y=y, quanta=1)
        if kind < 9:
            return build("WRITE", **common, x=CENTRE, y=CENTRE, tag=TAG, slot=255,
                         flags=self.random.randrange(2), expected=0, lease_s=self.random.randrange(3),
                         time=0, subject_namespace=0, subject=self.number, predicate_namespace=0,
                         predicate=self.random.randrange(1, 3), object_namespace=0, object=self.count)
        return build("EVENT", **common, code=self.random.randrange(1, 3),
                     argument=self.count % 30000)

    def step(self, now):
        if len(self.addresses) > 1:
            if why := self.why_leave(now):
                self.go_on(now, why)
        elif self.unanswered_at is not None and now - self.unanswered_at > 2.0 and \
                not self.addresses[0].startswith("udp:"):
            self.unanswered_at = None
            self.lose(now, "silent")  # the terminal may be another one by now
        if self.fd < 0 and (not self.gone or len(self.addresses) == 1 and now >= self.retry_at):
            self.gone = ""
            self.connect(now)
        if self.fd < 0:
            return
        if self.epoch is None:
            if now >= self.hello_due:
                self.hello_due = now + REPEAT_S
                self.send(build_hello(self.number, self.nonce), now)
            return
        if self.doubtful and self.heard and not self.unanswered and not self.change and \
                now >= self.hello_due:
            self.hello_due = now + INQUIRY_S
            self.write(build_hello(self.number, self.nonce), now)  # it is not waited for
        if now - self.query_at >= QUERY_EVERY_S:
            self.query = build("SENSE", self.number, type=TRAIL, x=CENTRE, y=CENTRE, heading=0)
            self.query_at = now
            self.send(self.query, now)
        if now < self.change_due:
            return
        if self.change is None:
            if self.ends:
                return
            self.change = self.next_change()
            self.change_since = now
            self.tell("sent", body=self.change.hex())
        self.change_at, self.change_due = now, now + REPEAT_S
        self.send(self.change, now)


def main():
    seed, path, *what = sys.argv[1:]
    with open(path, "w", encoding="ascii", buffering=1) as history:
        def tell(line):
            history.write(json.dumps(line) + "\n")
        robots = []
        for text in what:
            link, number, addresses = text.split(":", 2)
            robots.append(Robot(int(link), int(number), addresses.split(","), seed, tell))
        ends, before = False, time.monotonic()
        while not ends or any(robot.change for robot in robots):
            lines = {robot.fd: robot for robot in robots if robot.fd >= 0}
            reading = [fd for fd, robot in lines.items() if not robot.connecting]
            writing = [fd for fd, robot in lines.items() if robot.connecting]
            readable, writable, _ = select.select(reading + ([0] if not ends else []), writing, [], TICK_S)
            now = time.monotonic()
            if now - before > LISTED_STALL_S:
                tell({"t": round(now, 4), "robot": "-", "what": "stall", "s": round(now - before, 4)})
            before = now
            if 0 in readable:
                readable.remove(0)
                ends = True
                for robot in robots:
                    robot.ends = True
            for fd in readable + writable:
                if lines[fd].fd == fd:
                    lines[fd].is_ready()
            now = time.monotonic()
            for robot in robots:
                robot.step(now)
        for robot in robots:
            robot.close()


if __name__ == "__main__":
    main()
