#!/usr/bin/env python3
"""pheromone-swarm lab run --daemon: 300 robots on two UDP links of a real daemon, and what is refused.

The daemon is asked what it knows of the robots, and that is compared with where they say that they are.

    lab_daemon_test.py BIN_DIR
"""

import csv
import json
import math
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

from operated_daemon import PATIENCE_S, OperatedDaemon, await_that, write_config

SCENARIO = pathlib.Path(__file__).resolve().parent.parent / "client_fw/lab/examples/live.toml"
BIN = pathlib.Path()
ROBOTS = 300
ON_A_LINK = 150


class LabDaemonTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def call(self, program, *arguments, status=0):
        result = subprocess.run([BIN / program, *arguments], cwd=self.folder, text=True,
                                capture_output=True, timeout=120, check=False)
        self.assertEqual(result.returncode, status, result.stderr)
        return result.stdout if status == 0 else result.stderr

    def refused(self, *arguments, status=2):
        return self.call("pheromone-swarm", "lab", *arguments, status=status)

    def serve(self, *settings):
        """The daemon of `lab config`, with any free ports. Returns the addresses of its links."""
        text = self.call("pheromone-swarm", "lab", "config", SCENARIO, "--daemon",
                         "127.0.0.1:5001-5002", *settings)
        text, replaced = re.subn(r'listen = "127\.0\.0\.1:\d+"', 'listen = "127.0.0.1:0"', text)
        self.assertEqual(replaced, 3)
        write_config(self.folder, text)
        self.addCleanup(OperatedDaemon(BIN, self.folder).stop)
        links = json.loads(self.call("pheromonectl", "links", "--json"))["links"]
        self.assertEqual([link["name"] for link in links], ["lab-1", "lab-2"])
        return ",".join(link["address"] for link in links)

    def make_keys(self, robots):
        self.call("pheromonectl", "keys", "new", *map(str, range(1, robots + 1)), "--file",
                  "robots.keys")
        return ["--keys", "robots.keys"]

    def ignored(self):
        """Frames that the daemon ignores on all its links together: (unsigned, badly signed or of
        robots without a key)."""
        links = [it["counters"] for it in
                 json.loads(self.call("pheromonectl", "links", "--json"))["links"]]
        return (sum(it["unsigned_frames"] for it in links),
                sum(it["wrong_signatures"] + it["unknown_robots"] for it in links))

    def poses(self):
        """(link, id) -> (x, y) of all robots that the daemon knows and has a pose of."""
        clients = json.loads(self.call("pheromonectl", "clients", "--json"))["clients"]
        return {(it["link"], it["id"]): (it["pose"]["x_m"], it["pose"]["y_m"])
                for it in clients if it.get("pose")}

    def test_the_daemon_knows_where_all_robots_are(self):
        addresses = self.serve()
        with subprocess.Popen(
                [BIN / "pheromone-swarm", "lab", "run", SCENARIO, "--daemon", addresses, "--set",
                 "robots.radius_m=0", "--set", "robots.area_m=[5, 5, 25, 25]", "--tracks",
                 "tracks.csv", "--every", "0.02"],
                cwd=self.folder, text=True, stdout=subprocess.PIPE) as run:
            try:
                await_that(lambda: len(self.poses()) == ROBOTS, "the daemon knows all robots")
                first = self.poses()
                self.assertEqual(set(first), {(f"lab-{1 + i // ON_A_LINK}", 1 + i % ON_A_LINK)
                                              for i in range(ROBOTS)})
                moved = set()
                def all_moved():
                    moved.update(robot for robot, at in self.poses().items()
                                 if math.dist(at, first[robot]) > 0.1)
                    return len(moved) == ROBOTS
                await_that(all_moved, "all robots have moved")
                self.call("pheromonectl", "command", "lab-2", "7", "halt")   # and its ACK
            finally:
                run.send_signal(signal.SIGINT)
            output, _ = run.communicate(timeout=PATIENCE_S)
        self.assertEqual(run.returncode, 0)
        measures = dict(line.split() for line in output.splitlines())
        self.assertEqual(int(measures["robots"]), ROBOTS)
        self.assertGreater(float(measures["answers_per_s"]), 0)
        self.assertIn("lag_s", measures)
        self.assertNotIn("hash", measures)
        tracks = {}
        with open(self.folder / "tracks.csv", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                tracks.setdefault(int(row["robot"]), []).append((float(row["x_m"]), float(row["y_m"])))
        # What the daemon had last is a place where the robot was, but for the millimetre of the wire.
        for (link, number), at in self.poses().items():
            robot = (int(link[-1]) - 1) * ON_A_LINK + number - 1
            self.assertLess(min(math.dist(at, place) for place in tracks[robot]), 0.002, robot)

    def test_signed_robots_are_served_and_unsigned_ones_are_not(self):
        keys = self.make_keys(ON_A_LINK)
        addresses = self.serve(*keys)
        with subprocess.Popen(
                [BIN / "pheromone-swarm", "lab", "run", SCENARIO, "--daemon", addresses, *keys],
                cwd=self.folder, text=True, stdout=subprocess.PIPE) as run:
            try:
                await_that(lambda: len(self.poses()) == ROBOTS, "the daemon knows all robots")
                self.call("pheromonectl", "command", "lab-2", "7", "halt")   # and its ACK
                # To all, with the groups' keys; 1 if some of them were not seen to stand in time.
                halt = subprocess.run([BIN / "pheromonectl", "halt"], cwd=self.folder, text=True,
                                      capture_output=True, timeout=120, check=False)
                self.assertIn(halt.returncode, (0, 1), halt.stderr)
                await_that(lambda: self.halted() == ROBOTS, "all robots halt")
            finally:
                run.send_signal(signal.SIGINT)
            output, _ = run.communicate(timeout=PATIENCE_S)
        self.assertEqual(run.returncode, 0)
        measures = dict(line.split() for line in output.splitlines())
        self.assertGreater(float(measures["answers_per_s"]), 0)
        self.assertEqual(self.ignored(), (0, 0))
        # Robots of two links have the same key, and not the same nonce.
        self.assertEqual((self.folder / "robots.keys.starts").read_text(), "2\n")
        arguments = ["run", SCENARIO, "--daemon", addresses, "--set", "run.duration_s=2"]
        self.assertIn("300 of 300 robots received no answer", self.refused(*arguments, status=1))
        self.assertGreater(self.ignored()[0], 0)
        # With other keys.
        (self.folder / "robots.keys").unlink()
        self.make_keys(ON_A_LINK)
        self.assertIn("300 of 300 robots received no answer",
                      self.refused(*arguments, *keys, status=1))
        self.assertGreater(self.ignored()[1], 0)

    def halted(self):
        clients = json.loads(self.call("pheromonectl", "clients", "--json"))["clients"]
        return sum(it["state"]["is"] == "halted" for it in clients)

    def test_keys_that_do_not_fit_are_told(self):
        keys = self.make_keys(ON_A_LINK - 1)
        self.assertIn("--keys: robots.keys: robot 150 has no key", self.refused(
            "run", SCENARIO, "--daemon", "127.0.0.1:5001-5002", *keys))
        self.assertIn("--keys requires --daemon", self.refused("run", SCENARIO, *keys))
        self.assertFalse((self.folder / "robots.keys.starts").exists())
        (self.folder / "robots.keys").unlink()
        keys = self.make_keys(ON_A_LINK)
        self.assertIn("the daemon does not sign, expected security", self.refused(
            "run", SCENARIO, "--daemon", self.serve(), *keys, status=1))

    def test_another_configuration_is_told(self):
        for setting, told in (("map.width_m=20", "another map, on which a robot is off it"),
                              ("antennas.bias_m=0.2", "antennas 330 mm apart, expected 200 mm"),
                              ("pheromone.type=2", "no pheromone of type 1")):
            with self.subTest(setting):
                run = ["run", SCENARIO, "--daemon"]
                of_daemon, of_run = [["--set", setting], []] if "mm" not in told else [[], ["--set", setting]]
                self.assertIn(told, self.refused(*run, self.serve(*of_daemon), *of_run, status=1))
                self.doCleanups()
                self.setUp()

    def test_what_has_no_effect_is_refused_by_name(self):
        daemon = ["--daemon", "127.0.0.1:5001-5002"]
        for arguments, told in (
                (["--daemon", "127.0.0.1:5001"],
                 "--daemon: found 1 link, expected 2 or more for 300 robots, 254 on each"),
                (["--daemon", "5001"], "--daemon 5001: expected HOST:PORT"),
                (["--daemon", "localhost:2-1"], 'found ports "2-1"'),
                ([*daemon, "--set", "run.level=field"],
                 '--daemon: found run.level = "field", expected "firmware"'),
                ([*daemon, "--set", "radio.model=rounds"],
                 '--daemon: found radio.model = "rounds", expected "ideal"'),
                ([*daemon, "--maps", "maps"], "--maps: with --daemon, the daemon has the pheromones"),
                ([*daemon, "--frames", "f"], "--frames: with --daemon"),
                ([*daemon, "--mcap", "f"], "--mcap: with --daemon"),
                ([*daemon, "--summary", "f"], "--summary: a run with --daemon cannot be repeated")):
            self.assertIn(told, self.refused("run", SCENARIO, *arguments))
        self.assertIn("expected 2 or more", self.refused("config", SCENARIO, "--daemon", "[::1]:9"))

    def test_nobody_listening_is_told_at_once(self):
        self.assertIn("127.0.0.1:9: nothing listens there", self.refused(
            "run", SCENARIO, "--daemon", "127.0.0.1:9-10", status=1))


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
