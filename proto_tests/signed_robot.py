"""A robot on a signed link, after protocol/README.md, section 18, with python3-cryptography's AES.

    robot = SignedRobot(line, 7, key)       # a stranger.client.Line
    robot.hello(nonce=1)
    robot.sense(1, 1000, 500)               # (P_L, P_R)
    robot.said                              # all frames that it sent, for whoever repeats them

Each method that asks takes the next frame that is heard for the answer, and asserts that its tag is
right.
"""

import struct
import time

from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC

from stranger import wire

PATIENCE_S = 60  # of a busy machine; nothing waits this long when things are well
FROM_CLIENT, FROM_SERVER, TO_ALL, FIRST_HELLO, GREETING, SESSION_KEY, GROUP_MASK = range(1, 8)
HELLO, PING, SENSE, DEPOSIT, COMMAND, EVERYBODY = 0x71, 0x72, 0x00, 0x20, 0xD1, 0xFF


def mac_of(key, use, counter, robot, opcode, data):
    mac = CMAC(AES(key))
    mac.update(struct.pack("<BIBB", use, counter, robot, opcode) + data)
    return mac.finalize()


def plain(robot, opcode, data=b""):
    """An unsigned frame."""
    return wire.encode(bytes([robot, opcode]) + data)


class SignedRobot:
    def __init__(self, line, number, key):
        self.line, self.number, self.key = line, number, key
        self.hellos = 0
        self.sequence = 0
        self.session = self.group = None
        self.sent = self.heard = self.heard_to_all = 0
        self.said = []

    def say(self, frame):
        self.said.append(frame)
        self.line.send(frame)

    def next_frame(self):
        body = self.line.receive(time.monotonic() + PATIENCE_S)
        assert body is not None, "nothing was heard"
        return body[0], body[1], body[2:]

    def sealed(self, opcode, data):
        """The frame of a message in the session."""
        self.sent += 1
        mac = mac_of(self.session, FROM_CLIENT, self.sent, self.number, opcode, data)
        return plain(self.number, opcode, data + bytes([self.sent % 256]) + mac[:4])

    def ask(self, opcode, data):
        """DATA of the answer."""
        self.say(self.sealed(opcode, data))
        return self.next_answer(opcode | 0x80)

    def next_answer(self, opcode):
        robot, found, data = self.next_frame()
        assert (robot, found) == (self.number, opcode), (robot, found, data)
        data, low, tag = data[:-5], data[-5], data[-4:]
        counter = self.heard + 1 + (low - self.heard - 1) % 256
        assert tag == mac_of(self.session, FROM_SERVER, counter, robot, opcode, data)[:4]
        self.heard = counter
        return data

    def next_to_all(self, opcode):
        robot, found, data = self.next_frame()
        assert (robot, found) == (EVERYBODY, opcode), (robot, found, data)
        data, low, tag = data[:-6], int.from_bytes(data[-6:-4], "little"), data[-4:]
        counter = self.heard_to_all + 1 + (low - self.heard_to_all - 1) % 65536
        assert tag == mac_of(self.group, TO_ALL, counter, robot, opcode, data)[:4]
        self.heard_to_all = counter
        return data

    def first_hello(self, nonce):
        """Its frame."""
        number, self.hellos = self.hellos, self.hellos + 1
        data = struct.pack("<HBB", nonce, 1, 0)
        mac = mac_of(self.key, FIRST_HELLO, number, self.number, HELLO, data)
        return plain(self.number, HELLO, data + struct.pack("<H", number) + mac[:4])

    def take_greeting(self, nonce):
        """The answer to the last first HELLO: a session, if it is right."""
        number = self.hellos - 1
        robot, opcode, answer = self.next_frame()
        assert (robot, opcode, len(answer)) == (self.number, HELLO | 0x80, 34), answer
        nonces, masked, counter, tag = answer[:10], answer[10:26], answer[26:30], answer[30:]
        assert nonces[:2] == struct.pack("<H", nonce)
        assert tag == mac_of(self.key, GREETING, number, robot, opcode, answer[:30])[:4]
        mask = mac_of(self.key, GROUP_MASK, number, robot, HELLO, nonces)
        self.group = bytes(one ^ other for one, other in zip(masked, mask))
        self.session = mac_of(self.key, SESSION_KEY, number, robot, HELLO, nonces)
        self.sent = self.heard = 0
        self.heard_to_all = int.from_bytes(counter, "little")

    def hello(self, nonce):
        """Both HELLOs; DATA of the second one's answer."""
        self.say(self.first_hello(nonce))
        self.take_greeting(nonce)
        answer = self.ask(HELLO, struct.pack("<HBB", nonce, 1, 0))
        assert len(answer) == 15 and answer[:2] == struct.pack("<H", nonce), answer
        self.sequence = answer[14]
        return answer

    def ping(self, data):
        assert self.ask(PING, data) == data

    def sense(self, kind, x_mm, y_mm):
        return struct.unpack("<hh", self.ask(SENSE | kind, struct.pack("<hhH", x_mm, y_mm, 0)))

    def deposit(self, kind, x_mm, y_mm):
        self.sequence = (self.sequence + 1) % 256
        data = struct.pack("<BhhB", self.sequence, x_mm, y_mm, 1)
        assert self.ask(DEPOSIT | kind, data) == bytes([self.sequence])
