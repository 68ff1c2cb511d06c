#!/usr/bin/env python3
"""The AVR's signed image on a simulated chip, in real time, on a terminal of the daemon; between
them an attacker without a key, who jams for three of every eight seconds, and forges and repeats
all the time.

    attacked_image_test.py BIN_DIR AVR_LIVE IMAGE [--seconds N] [--csv FILE]

It needs a machine on which the simulated chip keeps up with the clock: answers that are late by
more than a response window begin no session. The robot drives on a circle and leaves a trail, until
it is halted, and stands until the operator lets it go. The daemon is killed, the robot loses power.
At the end the map has what the robot left there, and each ACK was of a command that the daemon had
sent. attacker_test.py has more robots, attacked_channel/ has one radio channel for all.
"""

import argparse
import csv
import datetime
import math
import os
import pathlib
import random
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty
import unittest
from collections import Counter

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "proto_tests"), str(ROOT / "deploy/python")]
from attacked_air import TO_ROBOTS, TO_SERVER  # noqa: E402
from operated_daemon import OperatedDaemon, await_that, write_config  # noqa: E402
from pheromone import Server, wire  # noqa: E402
from pheromone.robot import open_terminal  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

ID, KEY = 7, "603DEB1015CA71BE2B73AEF0857D7781"
QUANTUM, RADIUS_M = 0.01, 1.5
BYTES_A_SECOND = 960
PERIOD_S, JAMMING_S = 8, 3
ADDED = 5  # bytes behind the DATA of a signed frame (protocol/README.md, section 18)
MUTATING = range(0x10, 0x50)
CONFIG = (map_of(8.0, 8.0, origin_x_m=-4.0, origin_y_m=-3.0)
          + pheromone(1, "path", quantum=QUANTUM, maximum=600.0)
          + table("[path]", name="circle", pheromone="path", shape="circle",
                  center_m=[0.0, RADIUS_M], radius_m=RADIUS_M, intensity=1.0)
          + link("radio-a", "pty", path="radio-a.pty", security="require", keys="keys")
          + table("journal", folder="journal"))
OPTIONS = argparse.Namespace()


class Attacker:
    """A terminal for the robot; what it sends there goes to the daemon's, if there is one."""

    def __init__(self, seed):
        self.chance = random.Random(seed)
        self.robot_fd, slave = os.openpty()
        tty.setraw(slave)
        self.slave = slave  # stays open, so that the robot may come and go
        self.path = os.ttyname(slave)
        os.set_blocking(self.robot_fd, False)
        self.daemon_fd = -1
        self.decoders = {}
        self.heard = {TO_SERVER: [], TO_ROBOTS: []}
        self.robot_free_at = self.server_free_at = 0.0
        self.sent = Counter()
        self.changes, self.acknowledged = Counter(), Counter()  # by column and row
        self.last, self.said_hello = None, False
        self.commands, self.acks = [], []  # sequence number and code
        self.lock = threading.Lock()
        self.attacks = self.ending = False
        self.failure = None
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def connect(self, path):
        line = open_terminal(path)
        with self.lock:
            if self.daemon_fd >= 0:
                os.close(self.daemon_fd)
            self.daemon_fd, line.fd = line.fd, -1
            os.set_blocking(self.daemon_fd, False)
            self.decoders = {TO_SERVER: wire.Decoder(), TO_ROBOTS: wire.Decoder()}

    def run(self):
        try:
            while not self.ending:
                time.sleep(0.002)
                with self.lock:
                    ends = [self.robot_fd] + ([self.daemon_fd] if self.daemon_fd >= 0 else [])
                    for fd in select.select(ends, (), (), 0)[0]:
                        self.forward(fd)
                    if self.attacks and self.daemon_fd >= 0:
                        self.attack(time.monotonic())
        except Exception as failure:  # told by the test
            self.failure = failure

    def forward(self, fd):
        of_robot = fd == self.robot_fd
        try:
            data = os.read(fd, 4096)
        except OSError:  # the daemon is gone
            os.close(self.daemon_fd)
            self.daemon_fd = -1
            return
        way = TO_SERVER if of_robot else TO_ROBOTS
        if of_robot:
            self.write(self.daemon_fd, data)
        else:
            begin = max(self.robot_free_at, time.monotonic())
            self.robot_free_at = begin + len(data) / BYTES_A_SECOND
            self.write(self.robot_fd, data)
        for body in self.decoders[way].feed(data):
            self.heard[way].append(body)
            (self.note_request if of_robot else self.note_answer)(body)

    @staticmethod
    def write(fd, data):
        try:
            os.write(fd, data)
        except OSError:
            pass  # nobody is there: the bytes are lost, as on the air

    def note_answer(self, body):
        if body[:2] == bytes((ID, 0xD1)):
            self.commands.append((body[2], body[3]))

    # A change is acknowledged if the next one has the next number, and there was no HELLO between.
    def note_request(self, body):
        if body[1] == wire.HELLO:
            self.said_hello = True
            return
        bare = body[:-ADDED]
        if bare[1] == 0x51:
            ack = (bare[2], bare[3])
            if not self.acks or self.acks[-1] != ack:
                self.acks.append(ack)
        elif bare[1] in MUTATING or bare[1] == 0x52:
            if self.last is not None and self.last != bare and not self.said_hello and (
                    bare[2] == (self.last[2] + 1) % 256):
                self.acknowledged += self.place(self.last)
            if self.last != bare:
                self.changes += self.place(bare)
            self.last, self.said_hello = bare, False

    @staticmethod
    def place(body):
        message = wire.parse(body)
        if message.name != "TRACE":
            return Counter()
        return Counter([tuple(math.floor(message.fields[it] / 100 + 0.5) for it in "xy")])

    def attack(self, now):
        jams = now % PERIOD_S < JAMMING_S
        if self.server_free_at <= now:
            self.server_free_at = now + self.chance.random() * (0.04 if jams else 0.6)
            self.forge(TO_SERVER, self.daemon_fd)
        # To the robot at the rate of its line; beyond it, everything would come too late for ever.
        if self.robot_free_at <= now + (0.3 if jams else 0) and (
                jams or self.chance.random() < 0.02):
            self.robot_free_at = max(self.robot_free_at, now) + self.forge(
                TO_ROBOTS, self.robot_fd) / BYTES_A_SECOND

    def forge(self, ways, fd):
        heard = self.heard[ways]
        commands = [it for it in heard[-2000:] if it[1] == 0xD1]
        if ways is TO_ROBOTS and commands and self.chance.random() < 0.3:
            name, body = "recorded command", self.chance.choice(commands)
        else:
            way = self.chance.choice(ways)
            name, body = way.__name__, way(self.chance, heard)
        if not body:
            return 0
        self.sent[name] += 1
        data = wire.encode(body)
        self.write(fd, data)
        return len(data)

    def end(self):
        self.ending = True
        self.thread.join()
        for fd in (self.robot_fd, self.slave, self.daemon_fd):
            if fd >= 0:
                os.close(fd)


class Robot:
    """avr_live; knows where it was each half second."""

    def __init__(self, path, key):
        # It stands until it is released, leaves a trail, and its trail may be lost.
        settings = ("12=0", "3=1", "7=250", "10=0")
        self.process = subprocess.Popen(
            [OPTIONS.avr_live, OPTIONS.image, path, str(ID), "-", *settings, f"key={key}"],
            stdout=subprocess.PIPE, text=True)
        self.places = []
        self.thread = threading.Thread(target=self.read)
        self.thread.start()

    def read(self):
        for line in self.process.stdout:
            self.places.append(tuple(line.split()[:3]))

    def next_places(self, count):
        """`count` half seconds from now on."""
        first = len(self.places)
        await_that(lambda: len(self.places) >= first + count or self.process.poll() is not None,
                   "the robot tells where it is")
        return self.places[first:]

    def stands(self):
        return len(set(self.next_places(3))) == 1

    def drives(self):
        return len(set(self.next_places(3))) == 3

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.thread.join()
        self.process.stdout.close()


class AttackedImageTest(unittest.TestCase):
    def start_daemon(self):
        self.daemon = OperatedDaemon(OPTIONS.bin, self.folder)
        self.addCleanup(self.daemon.kill)
        self.server = Server(str(self.folder / "pheromoned.sock"))
        self.attacker.connect(self.folder / "radio-a.pty")

    def restart(self):
        self.count_rejected()
        self.daemon.kill()
        self.start_daemon()

    def count_rejected(self):
        counters = self.server.links()[0]["counters"]
        for name in ("unsigned_frames", "wrong_signatures", "unknown_robots"):
            self.rejected[name] += counters[name]

    def order(self, what, reached):
        """The operator does, and again as long as that has not happened: it may be jammed."""
        def happens():
            self.assertIsNone(self.attacker.failure)
            told = self.server.clients()
            if any(it["id"] == ID and it["known"] for it in told):
                self.server.command("radio-a", ID, what)
                self.orders[what] += 1
            return reached()
        await_that(happens, lambda: f"the robot obeys: {what}; it was at "
                   f"{self.robot.places[-5:]}, the server has {self.server.clients()}")

    def halt(self):
        self.server.halt()
        self.order("halt", self.robot.stands)

    def level_map(self):
        field = self.server.map_as_array("path", nodes_per_cell=1)
        return {(column, row): round(field.at(column / 10, row / 10) / QUANTUM)
                for column in range(-40, 41) for row in range(-30, 51)}

    def test_changes_nothing_and_does_not_move_it(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.rejected, self.orders = Counter(), Counter()
        write_config(self.folder, CONFIG)
        (self.folder / "keys").write_text(f"{ID} {KEY}\n")
        (self.folder / "keys").chmod(0o600)
        self.attacker = Attacker(OPTIONS.seed)
        self.addCleanup(self.attacker.end)
        self.start_daemon()
        path = self.level_map()
        self.robot = Robot(self.attacker.path, KEY)
        self.addCleanup(self.robot.kill)
        end = time.monotonic() + OPTIONS.seconds
        self.attacker.attacks = True
        chance = random.Random(OPTIONS.seed)
        halts = 0
        while True:
            self.order("resume", self.robot.drives)
            self.robot.next_places(chance.randrange(4, 12))
            if halts % 4 == 1:
                self.restart()
            self.halt()
            halts += 1
            if halts % 4 == 3:
                self.restart()
            elif halts % 4 == 2:
                self.robot.process.send_signal(signal.SIGUSR2)
            # Half a second is from before it stood.
            stood = self.robot.next_places(2 * PERIOD_S + 4)[1:]
            self.assertEqual(len(set(stood)), 1, stood)
            if time.monotonic() > end and halts >= 3:
                break
        self.attacker.attacks = False
        self.count_rejected()
        self.check_map(path)
        self.check_acks()
        known = [it["id"] for it in self.server.clients() if it["known"]]
        self.assertEqual(known, [ID])
        self.assertIsNone(self.attacker.failure)
        for kind in ("unsigned_frames", "wrong_signatures", "unknown_robots"):
            self.assertGreater(self.rejected[kind], 5, self.rejected)
        made = sum(self.attacker.changes.values())
        self.assertGreater(made, 20)
        print(f"{dict(self.attacker.sent)}; {dict(self.rejected)}; {halts} halts, "
              f"{dict(self.orders)} sent; {made} changes")
        self.write_csv(halts, made)

    def check_map(self, path):
        attacker = self.attacker
        for node, level in self.level_map().items():
            left = level - path[node]
            self.assertLessEqual(left, attacker.changes[node], node)
            self.assertGreaterEqual(left, attacker.acknowledged[node], node)

    def check_acks(self):
        """Each is of a command that the daemon had sent, in that order."""
        commands = iter(self.attacker.commands)
        for ack in self.attacker.acks:
            self.assertIn(ack, commands)

    def write_csv(self, halts, made):
        if OPTIONS.csv is None:
            return
        is_new = not OPTIONS.csv.exists()
        with open(OPTIONS.csv, "a", encoding="ascii", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            if is_new:
                rows.writerow((
                    "date", "channel", "seconds", "frames_of_attacker", "refused_by_server",
                    "changes", "forged_changes", "halts", "lost_halts", "forged_moves"))
            # There is a row only if all of this holds.
            rows.writerow((datetime.date.today(), "pty", OPTIONS.seconds,
                           sum(self.attacker.sent.values()), sum(self.rejected.values()), made, 0,
                           halts, 0, 0))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("avr_live", type=pathlib.Path)
    parser.add_argument("image", type=pathlib.Path)
    parser.add_argument("--seconds", type=int, default=20)
    parser.add_argument("--seed", type=int, default=18)
    parser.add_argument("--csv", type=pathlib.Path)
    OPTIONS, rest = parser.parse_known_args()
    OPTIONS.bin = OPTIONS.bin.resolve()
    unittest.main(argv=[sys.argv[0], *rest])
