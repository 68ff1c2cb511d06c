#!/usr/bin/env python3
"""An attacker without a key on signed links, by UDP and on a terminal: it hears everything, replays it,
also of earlier sessions and from before restarts of the daemon, forges requests, answers and commands
of any robot, and takes frames away. At the end the map has what was acknowledged to the robots, each
robot has done what the operator told it and nothing else, and each halt has arrived.

    attacker_test.py BIN_DIR [--seed N] [--frames N]
"""

import argparse
import itertools
import pathlib
import random
import socket
import sys
import tempfile
import unittest
from collections import Counter

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "proto_tests"), str(ROOT / "deploy/python")]
from attacked_air import Air, AttackedLine, Channel  # noqa: E402
from free_numbers import free_port  # noqa: E402
from operated_daemon import OperatedDaemon, await_that, write_config  # noqa: E402
from pheromone import Server, wire  # noqa: E402
from pheromone.robot import Client, ErrorAnswer, NoAnswer, next_boot, open_terminal  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

BIN = pathlib.Path()
SEED, FRAMES = 18, 4000
UDP, RADIO = (7, 8, 9), (7, 8)
QUANTUM = 0.125
COLUMNS, ROWS = 30, 20  # nodes that robots deposit at, 100 mm apart
WORLD = (map_of(4.0, 3.0) + pheromone(1, "path", quantum=QUANTUM, maximum=30.0)
         + table("journal", folder="journal"))


class Robot:
    """Knows what was acknowledged to it and what it was told to do."""

    def __init__(self, channel, robot_id, key, boots, name):
        self.line = AttackedLine(channel)
        self.id, self.key, self.boots, self.name = robot_id, key, boots, name
        self.deposited = Counter()  # quanta, by column and row
        self.obeyed = []  # speeds, and "resume"
        self.halts = 0
        self.boot()

    def boot(self):
        self.client = Client(self.line, self.id, timeout=0.1, tries=100_000, on_command=self.obey,
                             key=self.key)
        self.client.hello(next_boot(self.boots))

    def obey(self, command):
        code = command.fields["code"]
        if code == wire.HALT:
            self.halts += 1
        else:
            resume = code == wire.RESUME
            self.obeyed.append("resume" if resume else command.fields.get("speed_mm_s"))
        return 0

    def change(self, chance):
        column, row = chance.randrange(COLUMNS), chance.randrange(ROWS)
        if chance.random() < 0.5:
            quanta = chance.randrange(1, 4)
            self.client.deposit(1, 100 * column, 100 * row, quanta)
        else:
            quanta = 1
            self.client.trace(1, 100 * column, 100 * row, 0)
        self.deposited[column, row] += quanta

    def sense(self):
        """Which is sent once only."""
        while True:
            try:
                return self.client.sense(1, 1000, 1000, 0)
            except NoAnswer:
                pass

    def act(self, chance):
        kind = chance.random()
        if kind < 0.6:
            self.change(chance)
        elif kind < 0.8:
            self.sense()
        elif kind < 0.97:
            self.client.event(5)
        else:
            self.boot()


class AttackerTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.port = free_port()

    def serve(self, **security):
        """Security: the keys of both links."""
        def link_of(name, kind, **more):
            return link(name, kind, **more, **{key: it.format(name) for key, it in security.items()})
        write_config(self.folder, WORLD + link_of("udp", "udp", listen=f"127.0.0.1:{self.port}")
                     + link_of("radio-a", "pty", path="radio-a.pty"))
        self.start()

    def start(self):
        self.daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(self.daemon.kill)
        self.server = Server(str(self.folder / "pheromoned.sock"))

    def connect(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.connect(("127.0.0.1", self.port))
            return udp.detach()

    def open_radio(self):
        line = open_terminal(self.folder / "radio-a.pty")
        fd, line.fd = line.fd, -1
        return fd

    def populate(self, chance, frames, signed):
        """The air, and all robots."""
        self.air = Air(chance, frames)
        radio = Channel(self.air, self.open_radio)
        places = [("udp", it, Channel(self.air, self.connect, self.connect)) for it in UDP]
        places += [("radio-a", it, radio) for it in RADIO]
        self.channels = {id(it): it for _, _, it in places}.values()
        for channel in self.channels:
            self.addCleanup(channel.close)
        return [Robot(channel, robot, self.keys[name, robot] if signed else None,
                      self.folder / f"{name}-{robot}.boots", name)
                for name, robot, channel in places]

    def make_keys(self, chance):
        self.keys = {}
        for name, robots in (("udp", UDP), ("radio-a", RADIO)):
            lines = ""
            for robot in robots:
                self.keys[name, robot] = chance.randbytes(16)
                lines += f"{robot} {self.keys[name, robot].hex()} a robot\n"
            file = self.folder / f"{name}.keys"
            file.write_text(lines)
            file.chmod(0o600)

    def level(self, column, row):
        return self.field.at(column / 10, row / 10) / QUANTUM

    def facts(self, robot):
        return next(it for it in self.server.clients()
                    if (it["link"], it["id"]) == (robot.name, robot.id))

    def order(self, robot, command, *arguments):
        """The operator does, and waits for what becomes of it."""
        self.server.command(robot.name, robot.id, command, *arguments)

        def accepted():
            robot.client.listen(0.01)
            return self.facts(robot)["last_command"]["outcome"] == "accepted"
        await_that(accepted, "a command is acknowledged")

    def halt(self, robots):
        before = [it.halts for it in robots]
        self.server.halt()
        for robot, count in zip(robots, before):
            def arrived(robot=robot, count=count):
                robot.client.listen(0.01)
                return robot.halts > count
            await_that(arrived, "a halt arrives")

    def restart(self, kill):
        if kill:
            self.daemon.kill()
        else:
            self.daemon.stop()
        self.start()
        for channel in self.channels:
            channel.open()

    def test_changes_nothing_and_moves_nobody(self):
        chance = random.Random(SEED)
        self.make_keys(chance)
        self.serve(security="require", keys="{}.keys")
        robots = self.populate(chance, FRAMES, signed=True)
        ordered = {id(it): [] for it in robots}
        speeds = itertools.count(100)
        halts = 0
        restarts = {FRAMES * 2 // 3: True, FRAMES // 3: False}  # by frames left: whether it is killed
        rejected = Counter()
        while self.air.left:
            robot = chance.choice(robots)
            robot.act(chance)
            kind = chance.random()
            if kind < 0.1:
                ordered[id(robot)].append(next(speeds))
                self.order(robot, "speed", ordered[id(robot)][-1])
            elif kind < 0.12:
                ordered[id(robot)].append("resume")
                self.order(robot, "resume")
            elif kind < 0.14:
                self.halt(robots)
                halts += 1
            if restarts and self.air.left <= max(restarts):
                rejected += self.rejected()
                self.restart(restarts.pop(max(restarts)))
                for robot in robots:
                    robot.sense()  # now it has a session
        rejected += self.rejected()
        self.field = self.server.map_as_array("path", nodes_per_cell=1)
        acknowledged = sum((it.deposited for it in robots), Counter())
        for column in range(41):
            for row in range(31):
                self.assertEqual(self.level(column, row), acknowledged[column, row], (column, row))
        for robot in robots:
            self.assertEqual(robot.obeyed, ordered[id(robot)], (robot.name, robot.id))
            # Three each, more if the disk was slow; none of them twice.
            self.assertLessEqual(halts, robot.halts)
            self.assertLessEqual(robot.halts, len(robot.line.channel.halts))
            self.assertNotEqual(self.facts(robot)["last_event"]["argument"], -1)
        # The same bytes went to each address: no robot obeys another one's copy as a halt of its own.
        self.assertTrue(set.intersection(*(set(it.line.channel.halts) for it in robots
                                           if it.name == "udp")))
        known = [(it["link"], it["id"]) for it in self.server.clients() if it["known"]]
        self.assertEqual(sorted(known), sorted((it.name, it.id) for it in robots))
        self.assertFalse(restarts)
        self.assertGreater(halts, FRAMES // 800)
        self.assertGreater(sum(map(len, ordered.values())), FRAMES // 200)
        self.assertGreater(sum(acknowledged.values()), FRAMES // 10)
        self.assertGreater(self.air.lost, FRAMES // 200)
        for kind in ("unsigned_frames", "wrong_signatures", "unknown_robots"):
            self.assertGreater(rejected[kind], 20, rejected)
        self.assertGreater(sum(rejected.values()), FRAMES // 3)
        print(f"{dict(self.air.sent)}; {self.air.lost} lost; {dict(rejected)}; {halts} halts, "
              f"{sum(acknowledged.values())} quanta")

    def rejected(self):
        counted = Counter()
        for one in self.server.links():
            counted += Counter({key: one["counters"][key] for key in (
                "unsigned_frames", "wrong_signatures", "unknown_robots")})
        return counted

    def test_would_succeed_without_signatures(self):
        chance = random.Random(18)
        self.serve()
        robots = self.populate(chance, 0, signed=False)
        self.air.left = 20_000
        for robot in robots:
            robot.client.tries = 2

        def is_another_map():
            self.field = self.server.map_as_array("path", nodes_per_cell=1)
            acknowledged = sum((it.deposited for it in robots), Counter())
            return any(self.level(*it) != acknowledged[it]
                       for it in itertools.product(range(COLUMNS), range(ROWS)))
        while not (is_another_map() and any(it.obeyed for it in robots)):
            self.assertGreater(self.air.left, 0)
            try:
                chance.choice(robots).change(chance)
            except (ErrorAnswer, NoAnswer):
                pass  # forged, or of a forged request


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--frames", type=int, default=FRAMES)
    options, rest = parser.parse_known_args()
    BIN, SEED, FRAMES = options.bin.resolve(), options.seed, options.frames
    unittest.main(argv=[sys.argv[0], *rest])
