#!/usr/bin/env python3
"""pheromone-experiments cleaning --daemon: robots on tags of the real daemon, with and without keys.

    cleaning_live_test.py BIN_DIR
"""

import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from operated_daemon import OperatedDaemon

BIN = pathlib.Path()
PATIENCE_S = 120
FLOOR = ["--columns", "2", "--rows", "2", "--cleaning-s", "2", "--seconds", "20"]
SIGNED = 'security = "require"\nkeys = "robots.keys"\n'


class CleaningLiveTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def call(self, program, *arguments, status=0):
        done = subprocess.run([BIN / program, *arguments], cwd=self.folder, text=True,
                              capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stderr if status else done.stdout

    def serve(self, security):
        text = self.call("pheromone-experiments", "cleaning", *FLOOR, "--server-config")
        self.port = re.search(r'path = "(.*\.pty)"', text)[1]
        text = text.replace('kind = "pty"\n', 'kind = "pty"\n' + security)
        (self.folder / "test.toml").write_text(text)
        self.daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(self.daemon.kill)

    def clean(self, *options, status=0):
        return self.call("pheromone-experiments", "cleaning", *FLOOR, "--daemon", self.port,
                         "--out", "out", *options, status=status)

    def assert_both_robots_cleaned(self):
        with open(self.folder / "out" / "cleaning-cleanings.csv", encoding="ascii") as file:
            robots = {row["robot"] for row in csv.DictReader(file)}
        self.assertEqual(robots, {"1", "2"})

    def test_robots_clean_without_keys(self):
        self.serve("")
        self.clean()
        self.assert_both_robots_cleaned()

    def test_robots_clean_with_keys(self):
        self.call("pheromonectl", "keys", "new", "1", "2", "--file", "robots.keys")
        self.serve(SIGNED)
        self.clean("--keys", "robots.keys")
        self.assert_both_robots_cleaned()
        (counters,) = [it["counters"] for it in
                       json.loads(self.daemon.call("GET", "/api/v1/links")[1])["links"]]
        self.assertEqual([counters[name] for name in
                          ("unsigned_frames", "wrong_signatures", "unknown_robots")], [0, 0, 0])

    def test_a_robot_without_a_key_does_not_start(self):
        self.call("pheromonectl", "keys", "new", "1", "--file", "robots.keys")
        self.serve(SIGNED.replace("require", "accept"))
        self.assertIn("--keys: robots.keys: robot 2 has no key",
                      self.clean("--keys", "robots.keys", status=1))


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
