#!/usr/bin/env python3
"""An independent ARCOS client drives the simulated Pioneer over a pty and over TCP, in real time.

The client is written from the protocol's description (ARIA's, P2OS drivers' and the manuals') and
shares no code with the robot. It connects as ARIA does over a serial line, drives with both
encodings of VEL2, sends rubbish and damaged packets, finds its old session again, and leaves. What
the robot reports is compared with what was commanded; nothing is asserted about how fast it does
anything.

Usage: arcos_client_test.py BIN_DIR
"""

import os
import re
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
import tty

DEADLINE_S = 60.0
OPEN, CLOSE, ENABLE, SETO, VEL, CONFIG, RVEL, SONAR, STOP, VEL2 = 1, 2, 4, 7, 11, 18, 21, 28, 29, 32


def check(holds, otherwise):
    if not holds:
        raise AssertionError(otherwise)


def checksum(body):
    total = 0
    for high, low in zip(body[0::2], body[1::2]):
        total = (total + (high << 8 | low)) & 0xFFFF
    return total ^ body[-1] if len(body) % 2 else total


def packet(*body):
    return bytes([0xFA, 0xFB, len(body) + 2, *body, *checksum(body).to_bytes(2, "big")])


def command(number, argument=None):
    if argument is None:
        return packet(number)
    sign = 0x1B if argument < 0 else 0x3B
    return packet(number, sign, *abs(argument).to_bytes(2, "little"))


def vel2_of_aria(left_mm_s, right_mm_s):
    """The wheels' bytes as one signed word, of which the magnitude is sent."""
    word = (left_mm_s // 20 << 8 | right_mm_s // 20 & 0xFF) & 0xFFFF
    return command(VEL2, word - 0x10000 if word >= 0x8000 else word)


def vel2_of_player(left_mm_s, right_mm_s):
    """The wheels' bytes as they are, always called positive."""
    return packet(VEL2, 0x3B, right_mm_s // 20 & 0xFF, left_mm_s // 20 & 0xFF)


assert packet(ENABLE, 0x3B, 1, 0).hex() == "fafb06043b0100053b"
assert vel2_of_aria(-100, 100).hex() == "fafb06201bfb041b1f"
assert vel2_of_player(200, 240).hex() == "fafb06203b0c0a2c45"


class Sip:
    """The fields that a client needs, by their offsets behind the count."""

    def __init__(self, body):
        def word(at):
            return int.from_bytes(body[at:at + 2], "little")

        def signed(at):
            return int.from_bytes(body[at:at + 2], "little", signed=True)

        self.moving = body[0] == 0x33
        self.x, self.y, self.heading = word(1), word(3), word(5)
        self.left, self.right = signed(7), signed(9)
        self.motors = bool(word(16) & 1)
        self.sonars = body[19]


class Client:
    """One end of a line: a descriptor, and the received bytes split into packets."""

    def __init__(self, descriptor):
        self.descriptor = descriptor
        self.unread = b""

    def send(self, data):
        os.write(self.descriptor, data)

    def receive(self):
        """The body (id and data) of the next packet."""
        end = time.monotonic() + DEADLINE_S
        while True:
            start = self.unread.find(b"\xFA\xFB")
            if start >= 0 and len(self.unread) > start + 2:
                size = self.unread[start + 2] + 3
                if len(self.unread) >= start + size:
                    body = self.unread[start + 3:start + size - 2]
                    sent = int.from_bytes(self.unread[start + size - 2:start + size], "big")
                    self.unread = self.unread[start + size:]
                    check(sent == checksum(body), f"bad checksum after {body.hex()}")
                    return body
            check(time.monotonic() < end, "the robot fell silent")
            if select.select([self.descriptor], [], [], 1.0)[0]:
                self.unread += os.read(self.descriptor, 4096)

    def receive_until(self, holds, what):
        """SIPs until one of which `holds` is true; a PULSE for each, and other packets skipped."""
        end = time.monotonic() + DEADLINE_S
        while True:
            body = self.receive()
            if body[0] in (0x32, 0x33):
                sip = Sip(body)
                if holds(sip):
                    return sip
                self.send(command(0))
            check(time.monotonic() < end, f"gave up waiting until {what}")

    def synchronise(self):
        """Returns name, class and subclass."""
        self.send(b"WMS2\r")  # ARIA looks for a radio modem first
        for sync in (0, 1, 2):
            self.send(command(sync))
            body = self.receive()
            check(body[0] == sync, f"SYNC{sync} was answered with {body.hex()}")
        names = body[1:].split(b"\0")
        check(len(names) == 4 and names[3] == b"", f"three names were expected, not {body!r}")
        return [name.decode() for name in names[:3]]

    def open_session(self):
        # As ARIA does: several commands in one write, one of them unknown here.
        self.send(command(OPEN, 1) + command(62, 1) + command(ENABLE, 1) + command(SONAR, 0))
        self.receive_until(lambda sip: sip.motors and sip.sonars == 0, "the motors are on")


def near(value, expected):
    return abs(value - expected) <= 1


def drive(client):
    for left, right in ((200, 200), (200, 240), (100, -100), (-100, 100), (-200, -200)):
        for vel2 in (vel2_of_aria, vel2_of_player):
            client.send(vel2(left, right))
            client.receive_until(lambda sip: near(sip.left, left) and near(sip.right, right),
                                 f"{vel2.__name__} {left} {right} is driven")
            client.send(command(STOP))
            client.receive_until(lambda sip: not sip.moving, "the robot stands")

    client.send(packet(SETO, 0x3B))  # as P2OS drivers send it
    client.receive_until(lambda sip: (sip.x, sip.y, sip.heading) == (0, 0, 0), "odometry is zeroed")

    # Damaged, cut and split packets: only the last one counts.
    damaged = bytearray(command(VEL, 500))
    damaged[-1] ^= 1
    whole = command(VEL, 150)
    client.send(bytes(damaged) + b"\xFA\xFA\xFB\x06\x0B" + whole[:5])
    time.sleep(0.01)  # two reads of the robot's, most likely; either way it is the same
    client.send(whole[5:])
    client.receive_until(lambda sip: sip.left == 150 and sip.right == 150, "VEL 150 is driven")
    client.receive_until(lambda sip: 50 <= sip.x < 16384, "x has grown")
    client.send(command(VEL, 0))
    client.receive_until(lambda sip: not sip.moving, "the robot stands")

    client.send(command(RVEL, -20))
    client.receive_until(lambda sip: 2048 < sip.heading < 4090, "the heading has gone below 0")
    client.send(command(STOP))
    client.receive_until(lambda sip: not sip.moving, "the robot stands")

    client.send(command(CONFIG, 1))
    body = b""
    while body[:1] != b"\x20":
        body = client.receive()
    check(body[1:].startswith(b"Pioneer\0p3dx-sh\0"), f"CONFIG was answered with {body!r}")


class Robot:
    """pheromone-swarm pioneer."""

    def __init__(self, bin_dir, *arguments):
        self.process = subprocess.Popen(
            [os.path.join(bin_dir, "pheromone-swarm"), "pioneer", "--model", "p3dx-sh", *arguments],
            stdout=subprocess.PIPE, text=True)
        self.greeting = self.process.stdout.readline()
        check("Ctrl-C ends it" in self.greeting, f"the robot did not start: {self.greeting}")

    def stop(self, sent):
        self.process.send_signal(sent)
        summary, _ = self.process.communicate(timeout=DEADLINE_S)
        check(self.process.returncode == 0, f"the robot ended with {self.process.returncode}")
        return summary

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


def over_a_pty(bin_dir, folder):
    link = os.path.join(folder, "pioneer.pty")
    robot = Robot(bin_dir, "--pty", link)
    try:
        descriptor = os.open(link, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(descriptor)
        client = Client(descriptor)
        names = client.synchronise()
        check(names == ["Simulated", "Pioneer", "p3dx-sh"], f"the robot is called {names}")
        client.open_session()
        drive(client)
        os.close(descriptor)  # and say nothing: the session stays open

        client = Client(os.open(link, os.O_RDWR | os.O_NOCTTY))
        old = client.receive_until(lambda sip: True, "the old session shows itself")
        check(old.motors, "the old session was closed by itself")
        client.send(command(CLOSE))
        end = time.monotonic() + DEADLINE_S
        client.send(command(0))
        while client.receive() != b"\0":  # the last SIPs may still be under way
            check(time.monotonic() < end, "CLOSE does not end the stream")
        client.synchronise()
        client.send(command(OPEN))  # without an argument, as P2OS drivers do
        sip = client.receive_until(lambda sip: True, "SIPs come again")
        check(not sip.motors, "the motors are on in a new session")
        client.send(command(CLOSE))
        os.close(client.descriptor)
        summary = robot.stop(signal.SIGTERM)
        check(not os.path.lexists(link), "the link was left behind")
        check(re.search(r"2 sessions;", summary), f"two sessions were expected:\n{summary}")
        return summary
    finally:
        robot.kill()


def over_tcp(bin_dir):
    robot = Robot(bin_dir, "--tcp", "0")
    try:
        port = int(re.search(r"127\.0\.0\.1:(\d+)", robot.greeting)[1])
        for _ in range(2):
            with socket.create_connection(("127.0.0.1", port), DEADLINE_S) as connection:
                client = Client(connection.fileno())
                client.synchronise()  # at once: the connection's end has ended the session
                client.open_session()
                client.send(vel2_of_aria(200, 240))
                client.receive_until(lambda sip: near(sip.left, 200) and near(sip.right, 240),
                                     "VEL2 is driven")
        return robot.stop(signal.SIGINT)
    finally:
        robot.kill()


def main():
    bin_dir = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        print(over_a_pty(bin_dir, folder))
    print(over_tcp(bin_dir))


if __name__ == "__main__":
    main()
