"""A small server of a signed link, for signing_test.py: its end of section 18 of the protocol, with the
CMAC of python3-cryptography. It runs in a thread on one end of a socket pair.

    with SignedServer(key) as server, Line(server.robots_end()) as line: ...
"""

import os
import socket
import threading

from cryptography.hazmat.primitives.ciphers import algorithms
from cryptography.hazmat.primitives.cmac import CMAC
from pheromone import wire
from pheromone.wire import build, parse


def cmac(key, data):
    mac = CMAC(algorithms.AES(key))
    mac.update(data)
    return mac.finalize()


def mac(key, use, counter, body):
    return cmac(key, bytes([use]) + counter.to_bytes(4, "little") + body)


class Session:
    def __init__(self, key, nonce):
        self.key = key
        self.nonce = nonce
        self.sent = self.heard = 0

    def read(self, body):
        """Without what is added, or None."""
        low, tag = body[-5], body[-4:]
        counter = self.heard + 1
        while counter & 0xFF != low:
            counter += 1
        if mac(self.key, 1, counter, body[:-5])[:4] != tag:
            return None
        self.heard = counter
        return body[:-5]

    def signed(self, body):
        self.sent += 1
        return body + bytes([self.sent & 0xFF]) + mac(self.key, 2, self.sent, body)[:4]


class SignedServer:
    """`lose(body)` says whether the answer to a request is lost. `executed` has each change, `sent` each
    frame on the wire, `heard` what robots sent."""

    def __init__(self, key, signs_to_all=True):
        self.key = key
        self.epoch = 1
        self.group = os.urandom(16)
        self.group_counter = 0xFFF0 if signs_to_all else 0xFFFFFFFF
        self.lose = lambda body: False
        self.executed, self.sent, self.heard, self.ignored, self.acknowledged = [], [], [], [], []
        self.greeted = 0
        self.session = self.next_session = None
        self.last_seq, self.last_request, self.last_answer = 0, None, None
        self.nonce = None  # of the last HELLO in a session
        self.asked_nonce, self.hello_number = None, -1
        self.ours, self.theirs = socket.socketpair()
        self.lock = threading.Lock()
        self.thread = threading.Thread(target=self.run)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.ours.shutdown(socket.SHUT_RDWR)
        self.thread.join()
        self.ours.close()

    def robots_end(self):
        return self.theirs.detach()

    def restart(self):
        with self.lock:
            self.session = self.next_session = None
            self.hello_number = -1

    def transmit(self, body):
        """As it is."""
        self.sent.append(body)
        self.ours.sendall(wire.encode(body))

    def tell(self, body):
        """To the robot, in its session."""
        with self.lock:
            self.transmit(self.session.signed(body))

    def tell_all(self, body):
        with self.lock:
            if self.group_counter != 0xFFFFFFFF:
                self.group_counter += 1
                tag = mac(self.group, 3, self.group_counter, body)[:4]
                body += (self.group_counter & 0xFFFF).to_bytes(2, "little") + tag
            self.transmit(body)

    def run(self):
        decoder = wire.Decoder()
        while data := self.ours.recv(4096):
            for body in decoder.feed(data):
                with self.lock:
                    self.heard.append(body)
                    self.accept(body)

    def accept(self, body):
        if body[1] == 0x71 and len(body) == 2 + 10:
            self.greet(body)
            return
        for session in filter(None, (self.session, self.next_session)):
            if (request := session.read(body)) is not None:
                self.session = session
                if session is self.next_session:
                    self.next_session = None
                self.answer(request)
                return
        self.ignored.append(body)

    def greet(self, body):
        request, number, tag = body[:-6], int.from_bytes(body[-6:-4], "little"), body[-4:]
        nonce = request[2:4]
        old = nonce == self.asked_nonce and number <= self.hello_number
        if mac(self.key, 4, number, request)[:4] != tag or old:
            self.ignored.append(body)
            return
        self.asked_nonce, self.hello_number = nonce, number
        if self.lose(request):
            return
        self.greeted += 1
        server_nonce = os.urandom(8)
        both = request[:2] + nonce + server_nonce
        self.next_session = Session(mac(self.key, 6, number, both), nonce)
        mask = mac(self.key, 7, number, both)
        masked = bytes(a ^ b for a, b in zip(self.group, mask))
        greeting = (bytes([request[0], 0xF1]) + nonce + server_nonce + masked +
                    self.group_counter.to_bytes(4, "little"))
        self.transmit(greeting + mac(self.key, 5, number, greeting)[:4])

    def hello_answer(self, robot, nonce):
        if nonce != self.nonce:
            self.last_seq = (self.last_seq + 1) % 256
            self.nonce = nonce
        return build("HELLO_ANSWER", robot, nonce=nonce, protocol_version=1, epoch=self.epoch,
                     pose_unit_10um=100, antenna_distance_mm=300, type_mask=6, slot_ms=2,
                     response_window_ms=10, last_opcode=0, last_seq=self.last_seq)

    def answer(self, request):
        message = parse(request)
        name, robot, fields = message
        if name == "COMMAND_ACK":
            self.acknowledged.append(fields)
            return
        if name == "HELLO":
            answer = self.hello_answer(robot, fields["nonce"])
        elif name == "PING":
            answer = build("PING_ANSWER", robot, payload=fields["payload"])
        elif name == "SENSE":
            answer = build("SENSE_ANSWER", robot, type=fields["type"], left=4096, right=2560)
        elif request == self.last_request:
            answer = self.last_answer
        else:
            self.executed.append(message)
            self.last_seq, self.last_request = fields["seq"], request
            kind = {"TRACE": dict(type=fields.get("type"), left=1, right=2),
                    "DEPOSIT": dict(type=fields.get("type")), "EVENT": {}}[name]
            reply = "EVENT_ACK" if name == "EVENT" else name + "_ANSWER"
            answer = self.last_answer = build(reply, robot, seq=fields["seq"], **kind)
        if not self.lose(request):
            self.transmit(self.session.signed(answer))
