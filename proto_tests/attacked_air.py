"""A link that an attacker without a key listens to, adds to and takes from, for attacker_test.py.

    air = Air(chance, frames=3000)
    channel = Channel(air, "udp", lambda: connected_socket)
    robot = Client(AttackedLine(channel), 7, key=key)
    ...                                             # until air.left is 0

One thread: what the attacker does follows each frame of a robot or of the server, and from `chance`.
"""

import os
import select
import time
from collections import Counter

from pheromone import wire
from pheromone._line import Line
from pheromone.wire import build

LOSS = 0.02  # of what robots and the server send
FORGED_SPEED = -4321  # which no operator asks for
FORGED_EVENT = 8
HALT = bytes((wire.EVERYBODY, 0xD1))  # how one begins


def signature_of(chance, size=5):
    return chance.randbytes(size)


class Air:
    """All links together. `frames`: how many the attacker sends in all."""

    def __init__(self, chance, frames):
        self.chance = chance
        self.left = frames
        self.to_server, self.to_robots = [], []  # bodies that were heard
        self.lost = 0
        self.sent = Counter()

    def loses(self):
        lost = self.chance.random() < LOSS
        self.lost += lost
        return lost

    def attack(self, channel):
        """Up to two frames to the server, and one to robots; now and then a session."""
        for _ in range(self.chance.randrange(3)):
            self.send(self.chance.choice(TO_SERVER), self.to_server, channel.intrude)
        if self.chance.random() < 0.5:
            self.send(self.chance.choice(TO_ROBOTS), self.to_robots, channel.deliver)
        if self.chance.random() < 0.01:
            self.replay_session(self.to_server, channel.intrude)
        if self.chance.random() < 0.02:
            self.replay_session(self.to_robots, channel.deliver)

    def send(self, way, heard, transmit):
        body = way(self.chance, heard)
        if body and self.left:
            self.left -= 1
            self.sent[way.__name__] += 1
            transmit(body)

    def replay_session(self, heard, transmit):
        """Its beginning, in order: HELLO, or the greeting, and what that robot sent or got then."""
        begins = [at for at, body in enumerate(heard)
                  if body[1] & 0x7F == wire.HELLO and len(body) in (12, 36)]
        if begins:
            # The last one is likely to be that which is still going on.
            first = self.chance.choice(begins[-3:] + [self.chance.choice(begins)])
            session = [it for it in heard[first:first + 60] if it[0] == heard[first][0]]
            for body in session[:20]:
                self.send(of_a_session(body), heard, transmit)


def of_a_session(body):
    def replayed_session(chance, heard):
        return body
    return replayed_session


def replayed(chance, heard):
    return chance.choice(heard) if heard else None


def replayed_at_once(chance, heard):
    return heard[-1] if heard else None


def in_anothers_name(chance, heard):
    return bytes([chance.randrange(1, 255)]) + chance.choice(heard)[1:] if heard else None


def damaged(chance, heard):
    if not heard:
        return None
    body = bytearray(chance.choice(heard))
    body[chance.randrange(len(body))] ^= 1 << chance.randrange(8)
    return bytes(body) if body[0] and body[1] else None


def forged_request(chance, heard):
    """Half of them with a tag that is guessed."""
    robot = chance.choice((7, 8, 9, chance.randrange(1, 255)))
    pose = dict(type=1, x=100 * chance.randrange(30), y=100 * chance.randrange(20))
    seq = chance.randrange(256)
    body = chance.choice((
        wire.build_hello(robot, nonce=chance.randrange(1 << 16)),
        build("SENSE", robot, heading=0, **pose),
        build("TRACE", robot, heading=0, seq=seq, **pose),
        build("DEPOSIT", robot, quanta=255, seq=seq, **pose),
        build("EVENT", robot, seq=seq, code=FORGED_EVENT, argument=-1),
        build("COMMAND_ACK", robot, seq=seq, code=wire.HALT, result=0),
        build("ROUND", wire.EVERYBODY, number=seq, turn_ms=9, turn_bytes=9, slot_ms=9, open_slots=9,
              answers=[], turns=[robot]),
        build("COMMAND", robot, seq=seq, code=wire.RESUME)))
    return body + signature_of(chance, chance.choice((0, 5, 6)))


def forged_answer(chance, heard):
    robot = chance.choice((7, 8, 9, wire.EVERYBODY))
    seq = chance.randrange(256)
    body = chance.choice((
        build("COMMAND", robot, seq=seq, code=wire.RESUME),
        build("COMMAND", robot, seq=seq, code=wire.HALT),
        build("COMMAND", robot, seq=seq, code=wire.SPEED, speed_mm_s=FORGED_SPEED),
        build("SENSE_ANSWER", robot, type=1, left=-1, right=-1),
        build("DEPOSIT_ANSWER", robot, type=1, seq=seq),
        build("TRACE_ANSWER", robot, type=1, seq=seq, left=-1, right=-1),
        build("EVENT_ACK", robot, seq=seq),
        build("ERROR", robot, refused_opcode=0x21, reason=chance.randrange(1, 13), seq=seq),
        build("ROUND", wire.EVERYBODY, number=seq, turn_ms=9, turn_bytes=9, slot_ms=9, open_slots=9,
              answers=[(-1, -1)], turns=[7]),
        bytes([robot, wire.HELLO_ANSWER]) + chance.randbytes(34)))
    return body + signature_of(chance, chance.choice((0, 5, 6)))


TO_SERVER = (replayed, replayed_at_once, in_anothers_name, damaged, forged_request)
TO_ROBOTS = (replayed, replayed_at_once, damaged, forged_answer)


class Channel:
    """A connection to the server, with the robots on it. `connect` gives a file descriptor; so does
    `intruder`, of another address, if there is such a thing."""

    def __init__(self, air, connect, intruder=None):
        self.air = air
        self.connect = connect
        self.intruder = intruder
        self.lines = []
        self.halts = []  # that the server has sent: their bodies
        self.fd = self.other_fd = -1
        self.open()

    def open(self):
        """Again, if the server was started again."""
        self.close()
        self.decoder = wire.Decoder()
        self.fd = self.connect()
        self.other_fd = self.intruder() if self.intruder else -1

    def close(self):
        for fd in (self.fd, self.other_fd):
            if fd >= 0:
                os.close(fd)
        self.fd = self.other_fd = -1

    def write(self, data, fd=None):
        while data:
            try:
                data = data[os.write(self.fd if fd is None else fd, data):]
            except ConnectionRefusedError:  # what an earlier datagram met: there is no server now
                return

    def transmit(self, data):
        """Of a robot."""
        bodies = wire.Decoder().feed(data)
        self.air.to_server += bodies
        if not self.air.loses():
            self.write(data)
        self.air.attack(self)

    def intrude(self, body):
        """To the server, in the robot's place or from an address of its own."""
        other = self.other_fd >= 0 and self.air.chance.random() < 0.5
        self.write(wire.PAD + wire.encode(body), self.other_fd if other else self.fd)

    def deliver(self, body):
        for line in self.lines:
            line.inbox.append(body)

    def pump(self, deadline):
        """Whether something arrived."""
        left = deadline - time.monotonic()
        if left <= 0 or not select.select((self.fd,), (), (), left)[0]:
            return False
        try:
            data = os.read(self.fd, 4096)
        except ConnectionRefusedError:
            return True
        for body in self.decoder.feed(data):
            self.air.to_robots.append(body)
            if body[:2] == HALT:
                self.halts.append(body)
            # All three copies of a halt could be lost: that is jamming, which no signature prevents.
            if body[0] == wire.EVERYBODY or not self.air.loses():
                self.deliver(body)
            self.air.attack(self)
        return True


class AttackedLine(Line):
    """A robot's."""

    def __init__(self, channel):
        super().__init__(-1)
        self.channel = channel
        self.inbox = []
        channel.lines.append(self)

    def send(self, data):
        self.channel.transmit(data)

    def receive(self, deadline):
        while not self.inbox:
            if not self.channel.pump(deadline):
                return None
        return self.inbox.pop(0)

    def forget(self):
        self.inbox.clear()
