#!/usr/bin/env python3
"""Laws that are changed while the server runs: what is refused, and what a replay makes of it.

    law_change_test.py BIN_DIR
"""

import json
import pathlib
import subprocess
import sys
import unittest

from operated_daemon import ROOM, await_that, serve_class
from stranger.client import Client, open_terminal

BIN_DIR = pathlib.Path(sys.argv.pop()).resolve() if len(sys.argv) > 1 else None
FADING = """[[pheromone]]
type = {}
name = "{}"
core_m = 0.1
sigma_m = 0.3
quantum = 0.125
maximum = 1.0
evaporation = "exponential"
half_life_s = 100
"""
CONFIG = ROOM + FADING.format(2, "fading") + FADING.format(3, "scent") + """diffusion = {coefficient_m2_per_s = 0.001, step_s = 0.2, cutoff = 0.01}
[[pheromone]]
type = 4
name = "both"
blend = [{pheromone = "path"}, {pheromone = "fading"}]
[capture]
folder = "captures"
"""


class LawChange(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        serve_class(cls, BIN_DIR, CONFIG)

    def call(self, method, target, body=None, status=200):
        found, text = self.daemon.call(method, target, body)
        self.assertEqual(found, status, text)
        return json.loads(text)

    def change(self, pheromone, tau_s, status=200):
        return self.call("POST", "/api/v1/laws", {"pheromone": pheromone, "tau_s": tau_s}, status)

    def taus(self):
        return {law["name"]: law.get("tau_s") for law in
                self.call("GET", "/api/v1/laws")["pheromones"]}

    def level(self, pheromone):
        return self.call("GET", f"/api/v1/field?pheromone={pheromone}&nodes_per_cell=1"
                         )["values"][10][10]

    def test_what_cannot_be_changed_is_refused_and_named(self):
        before = self.taus()
        for pheromone, tau_s, status, named in (
                ("fading", 0, 409, "tau of pheromone fading: expected 1 to "),
                ("scent", 50, 409, "pheromone scent diffuses in steps"),
                ("both", 50, 400, "both"),
                ("none", 50, 400, "none"),
                ("path", -1, 400, "tau_s"),
                ("path", 0.0001, 400, "at least 0.001, or 0"),
                ("path", 1e18, 400, "tau_s"),
                ("path", "long", 400, "tau_s")):
            with self.subTest(pheromone=pheromone, tau_s=tau_s):
                self.assertIn(named, json.dumps(self.change(pheromone, tau_s, status)))
        self.assertEqual(self.taus(), before)

    def test_a_recording_has_the_change_and_is_replayed_with_it(self):
        with open_terminal(self.folder / "radio-a.pty") as line:
            robot = Client(line, 7, timeout=60)
            robot.hello(nonce=1)
            self.call("POST", "/api/v1/capture", {"action": "start"})
            for name in ("path", "fading"):
                self.call("POST", "/api/v1/paint", {"pheromone": name, "points_m": [[1, 2], [2, 2]],
                                                    "radius_m": 0.01, "units": 1})
            self.change("path", 1e6)
            self.change("fading", 0.05)
            self.assertEqual(self.level("path"), 1)
            await_that(lambda: self.level("fading") < 0.01, "it fades within a second, not minutes")
            robot.sense(2, 1500, 2000, 0)  # its answer is compared with that of the replay
            self.call("POST", "/api/v1/capture", {"action": "stop"})
        capture, = (self.folder / "captures").iterdir()
        replay = subprocess.run([BIN_DIR / "pheromonectl", "replay", capture], text=True,
                                capture_output=True, check=False, timeout=60)
        self.assertEqual(replay.returncode, 0, replay)


if __name__ == "__main__":
    unittest.main()
