#!/usr/bin/env python3
"""An independent ARCOS client drives the simulated Pioneer over a pty and over TCP, in real time.

The client is written from the protocol's description (ARIA's, P2OS drivers' and the manuals') and
shares no code with the robot. It connects as ARIA does over a serial line, drives with both
encodings of VEL2, by distances and by headings, sends rubbish and damaged packets, hangs up, and
connects again. What the robot reports is compared with what was commanded; nothing is asserted about
how fast it does anything. A wall, the STOP button and the battery are tried as well.

Clients that are killed while they drive are replaced by new ones, ROUNDS times on each kind of port.

Usage: arcos_client_test.py BIN_DIR [ROUNDS]
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

from checks import PATIENCE_S, check

OPEN, CLOSE, ENABLE, SETV, SETO, MOVE, VEL, HEAD, DHEAD = 1, 2, 4, 6, 7, 8, 11, 12, 13
CONFIG, ENCODER, RVEL, SONAR, STOP, VEL2, IOREQUEST = 18, 19, 21, 28, 29, 32, 40


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
        self.x, self.y, self.heading = word(1), word(3), signed(5)
        self.left, self.right = signed(7), signed(9)
        self.battery = body[11]
        self.stall = word(12)
        self.motors = bool(word(16) & 1)
        self.stop_pressed = bool(word(16) & 0x20)
        self.ranges = {body[20 + 3 * i]: word(21 + 3 * i) for i in range(body[19])}
        self.sonars = body[19]


class Client:
    """One end of a line: a descriptor, and the received bytes split into packets."""

    def __init__(self, descriptor):
        self.descriptor = descriptor
        self.unread = b""

    def send(self, data):
        os.write(self.descriptor, data)

    def receive(self, patience_s=PATIENCE_S):
        """The body (id and data) of the next packet."""
        end = time.monotonic() + patience_s
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
        end = time.monotonic() + PATIENCE_S
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

    def connect_as_aria(self):
        """SYNC by SYNC: CLOSE only for a SIP of type 0x32, and no more than 50 attempts."""
        state = 0
        for _ in range(50):
            self.send(command(state))
            body = self.receive()
            if body[0] == state:
                state += 1
                if state == 3:
                    return
            else:
                if body[0] == 0x32:
                    self.send(command(CLOSE, 1))
                state = 0
        raise AssertionError("50 attempts did not connect")

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
    client.receive_until(lambda sip: -2048 < sip.heading < -6, "the heading has gone below 0")
    client.send(command(STOP))
    client.receive_until(lambda sip: not sip.moving, "the robot stands")

    client.send(command(HEAD, 45))
    client.receive_until(lambda sip: not sip.moving and sip.heading == 512, "HEAD 45 is reached")
    client.send(command(DHEAD, -45))
    client.receive_until(lambda sip: not sip.moving and sip.heading == 0, "DHEAD -45 is reached")
    client.send(command(SETO))
    client.receive_until(lambda sip: (sip.x, sip.y, sip.heading) == (0, 0, 0), "odometry is zeroed")
    client.send(command(MOVE, 150))
    client.receive_until(lambda sip: not sip.moving and (sip.x, sip.y) == (150, 0), "MOVE 150")

    for number, packet_id, size in ((ENCODER, 0x90, 9), (IOREQUEST, 0xF0, 27)):
        client.send(command(number, 1))
        body = b""
        while body[:1] != bytes([packet_id]):
            body = client.receive()
        check(len(body) == size, f"packet {packet_id:#x} was {body.hex()}")

    client.send(command(CONFIG, 1))
    body = b""
    while body[:1] != b"\x20":
        body = client.receive()
    check(body[1:].startswith(b"Pioneer\0p3dx-sh\0"), f"CONFIG was answered with {body!r}")


class Robot:
    """pheromone-swarm pioneer."""

    def __init__(self, bin_dir, *arguments, stderr=None):
        self.process = subprocess.Popen(
            [os.path.join(bin_dir, "pheromone-swarm"), "pioneer", "--model", "p3dx-sh", *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr, text=True)
        self.greeting = self.process.stdout.readline()
        check("Ctrl-C ends it" in self.greeting, f"the robot did not start: {self.greeting}")

    def tell(self, line):
        """On its standard input."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def stop(self, sent):
        self.process.send_signal(sent)
        summary, _ = self.process.communicate(timeout=PATIENCE_S)
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
        client.send(command(VEL, 200))
        client.receive_until(lambda sip: sip.left == 200, "VEL 200 is driven")
        os.close(descriptor)  # and say nothing: that ends the session

        client = Client(os.open(link, os.O_RDWR | os.O_NOCTTY))
        client.connect_as_aria()
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
            with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as connection:
                client = Client(connection.fileno())
                client.synchronise()  # at once: the connection's end has ended the session
                client.open_session()
                client.send(vel2_of_aria(200, 240))
                client.receive_until(lambda sip: near(sip.left, 200) and near(sip.right, 240),
                                     "VEL2 is driven")
        return robot.stop(signal.SIGINT)
    finally:
        robot.kill()


def port_of(robot):
    return int(re.search(r"127\.0\.0\.1:(\d+)", robot.greeting)[1])


def in_a_room(bin_dir, *surroundings):
    """A wall is seen, then felt; then the STOP button and the battery. The true pose is printed."""
    robot = Robot(bin_dir, "--tcp", "0", "--start", "-0.6", "2", "0", "--battery", "12.1",
                  "--poses", "0.1", *surroundings)
    try:
        with socket.create_connection(("127.0.0.1", port_of(robot)), PATIENCE_S) as connection:
            client = Client(connection.fileno())
            client.synchronise()
            client.send(command(OPEN) + command(ENABLE, 1))
            # Sonar 3 is 166 mm before the centre and looks 10 degrees to the left; the wall begins
            # at -0.05 m or, as the map's cells cover it, up to 50 mm nearer.
            sip = client.receive_until(lambda sip: sip.motors, "the motors are on")
            check(sip.battery == 121, f"the battery was reported as {sip.battery / 10} V")
            check(339 <= sip.ranges[3] <= 391, f"the wall was seen at {sip.ranges[3]} mm")
            check(sip.ranges[11] == 5000, "something was seen behind the robot")
            client.send(command(VEL, 200))
            sip = client.receive_until(lambda sip: sip.stall & 0x0101 == 0x0101, "the wheels stall")
            check(sip.stall & 1 << 11, f"no bumper in front is pressed: {sip.stall:#x}")
            check(0 < sip.x <= 300, f"the robot drove {sip.x} mm to a wall 300 mm ahead")
            client.send(command(MOVE, -200))
            client.receive_until(lambda sip: sip.stall == 0, "the robot has left the wall")
            robot.tell("stop")
            client.receive_until(lambda sip: sip.stop_pressed and not sip.motors and not sip.moving,
                                 "STOP is pressed")
            robot.tell("release")
            robot.tell("battery 10.9")
            client.receive_until(lambda sip: not sip.stop_pressed and sip.battery == 109,
                                 "STOP is released and the battery is lower")
        summary = robot.stop(signal.SIGINT)
        poses = [(float(x), float(y)) for x, y in
                 re.findall(r"^ +[\d.]+ s  true pose (\S+) (\S+) m ", summary, re.MULTILINE)]
        check(poses[0] == (-0.6, 2.0), f"the first true pose printed was {poses[0]}")
        check(max(x for x, _ in poses) > -0.4, "no pose at the wall was printed")
        for state in ("stalled, bumper in front", "STOP pressed"):
            check(state in summary, f'"{state}" was not printed:\n{summary}')
        return summary.splitlines()[-1]
    finally:
        robot.kill()


def refuse(bin_dir):
    """What cannot be meant: the command line's errors, and a line on standard input."""
    for arguments, words in (
            (("--wall", "1", "2", "3"), "--wall: found 3 numbers, expected four"),
            (("--wall", "0", "1", "2", "x"), "x"),
            (("--wall", "0.2", "-1", "0.2", "1"), "--start: a p3dx-sh at 0 0 m touches an obstacle"),
            (("--config", "/nonexistent.toml"), "/nonexistent.toml"),
            (("--start", "1", "2"), "--start"),
            (("--start", "nan", "0", "0"), "--start"),
            (("--battery", "26"), "--battery"),
            (("--model", "p4dx"), "unknown model p4dx")):
        done = subprocess.run(
            [os.path.join(bin_dir, "pheromone-swarm"), "pioneer", "--model", "p3dx-sh", "--tcp", "0",
             *arguments], stdin=subprocess.DEVNULL, capture_output=True, text=True,
            timeout=PATIENCE_S, check=False)
        check(done.returncode not in (0, 1), f"{arguments} ended with {done.returncode}")
        check(words in done.stderr + done.stdout, f"{arguments} were answered with {done.stderr}")

    robot = Robot(bin_dir, "--tcp", "0", stderr=subprocess.PIPE)
    try:
        for line in ("go", "battery", "battery x", "battery 26", "battery nan", "x" * 1000, ""):
            robot.tell(line)
            answer = robot.process.stderr.readline()
            check(f'found "{line[:80]}"' in answer and "expected" in answer,
                  f"{line} was answered with {answer}")
        robot.stop(signal.SIGTERM)
    finally:
        robot.kill()


def drive_until_killed(connect):
    """A client in a process of its own, killed as soon as the robot moves."""
    told, tells = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            client = Client(connect())
            client.connect_as_aria()
            client.open_session()
            client.send(command(VEL, 300))
            client.receive_until(lambda sip: sip.moving, "the robot moves")
            os.write(tells, b"!")
            time.sleep(PATIENCE_S)
        finally:
            os._exit(1)
    os.close(tells)
    moves = os.read(told, 1)
    os.close(told)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    check(moves, "a client could not connect and drive")


def killed_while_driving(bin_dir, folder, rounds):
    link = os.path.join(folder, "pioneer.pty")
    kept = []

    def open_tcp():
        kept.append(socket.create_connection(("127.0.0.1", port_of(robot)), PATIENCE_S))
        return kept[-1].fileno()

    def open_pty():
        return os.open(link, os.O_RDWR | os.O_NOCTTY)

    for arguments, connect in ((("--tcp", "0"), open_tcp), (("--pty", link), open_pty)):
        robot = Robot(bin_dir, *arguments)
        try:
            for _ in range(rounds):
                drive_until_killed(connect)
            client = Client(connect())
            client.connect_as_aria()
            client.open_session()
            client.receive_until(lambda sip: not sip.moving, "the robot stands")
            summary = robot.stop(signal.SIGINT)
            check(f"{rounds + 1} sessions;" in summary, f"sessions are missing:\n{summary}")
        finally:
            robot.kill()


def main():
    bin_dir = sys.argv[1]
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    with tempfile.TemporaryDirectory() as folder:
        if rounds > 0:
            killed_while_driving(bin_dir, folder, rounds)
            print(f"killed while driving and replaced {rounds} times, over TCP and a pty")
            return
        print(over_a_pty(bin_dir, folder))
        print(over_tcp(bin_dir))
        # The same wall twice: thin ones, which are 50 mm thick, and one of a server's map.
        print(in_a_room(bin_dir, "--wall", "-0.025", "-3", "-0.025", "5",
                        "--wall", "5", "5", "6", "5"))
        default = os.path.join(os.path.dirname(__file__), "..", "server", "config", "default.toml")
        room = os.path.join(folder, "room.toml")
        with open(default, encoding="utf-8") as source, open(room, "w", encoding="utf-8") as file:
            file.write(source.read() + "\n[obstacles]\n"
                       "walls = [{points_m = [[0.0, 0.0], [0.0, 5.0]], thickness_m = 0.1}]\n")
        print(in_a_room(bin_dir, "--config", room))
        killed_while_driving(bin_dir, folder, 3)
    refuse(bin_dir)


if __name__ == "__main__":
    main()
