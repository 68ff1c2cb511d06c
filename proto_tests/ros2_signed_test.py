#!/usr/bin/env python3
"""pheromone-ros2 with keys, on links of the real daemon that require them.

Usage: ros2_signed_test.py BIN_DIR TESTS_DIR
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "client_fw" / "ros2" / "testing"))

from free_numbers import free_domain, free_port  # noqa: E402
from operated_daemon import PATIENCE_S, OperatedDaemon, await_that, default_config  # noqa: E402
from peer import Base, Bases, Peer  # noqa: E402
from ros2_live_test import Bridge, is_told_to_stand  # noqa: E402
from test_config import link  # noqa: E402

NAMES = ("tb1", "tb2")
STARTS = ((5.0, 3.0, -15.0), (5.0, 8.0, 180.0))  # on the default circuit
SENSED = tuple(f"rt/{name}/pheromone/sensed" for name in NAMES)


class SignedTest(unittest.TestCase):
    """Robots 1 and 2 have keys."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.keys = self.folder / "robots.keys"
        subprocess.run([BIN / "pheromonectl", "keys", "new", "1", "2", "--file", self.keys],
                       check=True, capture_output=True)
        self.ports = {"udp": free_port(), "tcp": free_port()}
        (self.folder / "test.toml").write_text(default_config(BIN) + "".join(
            link(kind, kind, listen=f"127.0.0.1:{port}", security="require", keys="robots.keys")
            for kind, port in self.ports.items()))
        self.daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(self.daemon.kill)
        self.domain = free_domain()
        self.peer = Peer(TESTS, self.domain)
        self.addCleanup(self.peer.close)
        self.robots = [Base(self.peer, name, start) for name, start in zip(NAMES, STARTS)]
        for topic in SENSED:
            self.peer.read(topic, "std_msgs/msg/Float32MultiArray")
        bases = Bases(self.robots)
        self.addCleanup(bases.stop)

    def bridge(self, kind, *options):
        address = f"{'udp:' if kind == 'udp' else ''}127.0.0.1:{self.ports[kind]}"
        bridge = Bridge(BIN, self.folder, self.domain, "--server", address, "--type", "2", *options,
                        *(word for i, (name, start) in enumerate(zip(NAMES, STARTS))
                          for word in ("--robot", f"{name}:{i + 1}:" + ",".join(map(str, start)))))
        self.addCleanup(lambda: (bridge.process.kill(), bridge.process.wait()))
        return bridge

    def wait_for_answers(self, bridge):
        before = [self.peer.count(topic) for topic in SENSED]
        await_that(lambda: bridge.log() and all(self.peer.count(topic) > count + 3
                                                for topic, count in zip(SENSED, before)),
                   "all robots are answered")

    def ignored(self, kind):
        """Frames that the daemon ignores: unsigned, wrongly signed, of robots without a key."""
        links = json.loads(self.daemon.call("GET", "/api/v1/links")[1])["links"]
        (counters,) = [it["counters"] for it in links if it["name"] == kind]
        return tuple(counters[name]
                     for name in ("unsigned_frames", "wrong_signatures", "unknown_robots"))

    def post(self, target, body):
        self.assertEqual(self.daemon.call("POST", target, body)[0], 200)

    def test_robots_with_keys_are_answered_and_take_orders(self):
        for start, kind in enumerate(self.ports, 1):
            with self.subTest(kind):
                bridge = self.bridge(kind, "--keys", self.keys)
                self.wait_for_answers(bridge)
                ways_m = [robot.way_m for robot in self.robots]
                for i, _ in enumerate(NAMES):
                    self.post("/api/v1/command", {"link": kind, "id": i + 1, "command": "resume"})
                await_that(lambda: all(robot.way_m > way_m + 0.1
                                       for robot, way_m in zip(self.robots, ways_m)),
                           "all robots drive")
                self.post("/api/v1/halt", {})  # to all, with the group's key
                await_that(lambda: all("halted" in bridge.state(name) for name in NAMES)
                           and all(map(is_told_to_stand, self.robots)), "all halt")
                bridge.stop()
                self.assertEqual(self.ignored(kind), (0, 0, 0))
                self.assertEqual((self.folder / "robots.keys.starts").read_text(), f"{start}\n")

    def test_a_restarted_daemon_is_greeted_anew(self):
        bridge = self.bridge("udp", "--keys", self.keys)
        self.wait_for_answers(bridge)
        self.daemon.kill()
        self.daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(self.daemon.kill)
        self.wait_for_answers(bridge)
        self.assertEqual((self.folder / "robots.keys.starts").read_text(), "1\n")

    def test_robots_without_keys_are_not_answered(self):
        bridge = self.bridge("udp")
        await_that(lambda: bridge.log() and self.ignored("udp")[0] > 10, "they ask")
        self.assertEqual([self.peer.count(topic) for topic in SENSED], [0, 0])
        bridge.stop()

    def test_a_robot_whose_id_has_no_key_does_not_start(self):
        ended = subprocess.run(
            [BIN / "pheromone-ros2", "--server", f"udp:127.0.0.1:{self.ports['udp']}", "--robot",
             "tb1:1:5,3,0", "--robot", "tb9:9:5,8,0", "--keys", self.keys],
            text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(ended.stderr, f"pheromone-ros2: --keys: {self.keys}: robot 9 has no key, "
                                       'expected a line "9 KEY"\n')
        self.assertEqual(ended.returncode, 2)


if __name__ == "__main__":
    TESTS = pathlib.Path(sys.argv.pop()).resolve()
    BIN = pathlib.Path(sys.argv.pop()).resolve()
    unittest.main()
