#!/usr/bin/env python3
"""pheromone-swarm run --robots N: a swarm on one's own running server, in one line.

    own_swarm_test.py BIN_DIR
"""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from operated_daemon import OperatedDaemon, default_config, write_config

SOURCE = pathlib.Path(__file__).resolve().parent.parent
BIN = pathlib.Path()
PATIENCE_S = 120
ROUNDS = """medium_access = true
turnaround_ms = 2
server_delay_ms = 20
adapter_latency_ms = 0
"""


class OwnSwarmTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.config = default_config(BIN)

    def serve(self, config):
        write_config(self.folder, config)
        daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(daemon.kill)

    def run_swarm(self, *arguments, folder=None, status=0):
        result = subprocess.run([BIN / "pheromone-swarm", "run", *map(str, arguments)],
                                cwd=folder or self.folder, text=True, capture_output=True,
                                timeout=PATIENCE_S, check=False)
        if status is None:  # whom contention leaves without any answer is chance, and told
            status = 1 if "received no answer" in result.stderr else 0
        self.assertEqual(result.returncode, status, result)
        return result

    def assert_all_drive(self, result, robots, answers_at_least=3):
        driven = re.findall(r"robot \d+: ([0-9.]+) m along .* (\d+) answers", result.stdout)
        self.assertEqual(len(driven), robots, result.stdout)
        for along, answers in driven:
            self.assertGreater(float(along), 0.3)
            self.assertGreaterEqual(int(answers), answers_at_least)

    def test_robots_with_keys_drive_where_they_are_required(self):
        subprocess.run([BIN / "pheromonectl", "keys", "new", *"123456", "--file", "robots.keys"],
                       cwd=self.folder, check=True, capture_output=True)
        signed = ROUNDS + 'security = "require"\nkeys = "robots.keys"\n'
        self.serve(self.config.replace('path = "radio-a.pty"', signed + 'path = "radio-a.pty"', 1))
        keys = ("--keys", "robots.keys")
        self.assert_all_drive(self.run_swarm("--robots", 6, "--seconds", 8, *keys), 6)
        live = [BIN / "pheromone-swarm", "live", "--modem", "radio-a.pty", "--medium-access",
                "--config", "test.toml", "--seconds", "3", "--out", "live"]
        for words, status in (([], 1), (["--id", "6", *keys], 0), (["--id", "7", *keys], 2)):
            result = subprocess.run([*live, *words], cwd=self.folder, text=True,
                                    capture_output=True, timeout=PATIENCE_S, check=False)
            self.assertEqual(result.returncode, status, result)
        self.assertIn("--keys: robots.keys: robot 7 has no key", result.stderr)
        self.assertEqual((self.folder / "robots.keys.starts").read_text(), "2\n")
        self.assertIn("expected --daemon or --robots",
                      self.run_swarm("x.toml", *keys, status=2).stderr)
        self.assertIn("received no answer",
                      self.run_swarm("--robots", 2, "--seconds", 3, status=1).stderr)

    def test_robots_drive_on_the_servers_path_in_rounds(self):
        self.serve(self.config.replace('path = "radio-a.pty"', ROUNDS + 'path = "radio-a.pty"', 1))
        result = self.run_swarm("--robots", 6, "--seconds", 8, "--out", "out")
        self.assertIn("6 robots on radio-a, in rounds, asking every 0.20 s\n", result.stderr)
        self.assertNotIn("are answered every", result.stderr)
        self.assert_all_drive(result, 6)
        clients = subprocess.run([BIN / "pheromonectl", "clients"], cwd=self.folder, text=True,
                                 capture_output=True, check=True).stdout
        self.assertEqual(len(re.findall(r"\nradio-a +\d+ ", clients)), 6)
        self.assertTrue((self.folder / "out" / "map.svg").exists())

    def test_too_many_robots_for_a_plain_link_ask_less_often_and_say_why(self):
        self.serve(self.config)
        result = self.run_swarm("--robots", 12, "--seconds", 8)
        self.assertIn("12 robots on radio-a, by contention, asking every 1.60 s\n"
                      "At 0.2 s, they would stop: 12 robots on a channel of 9600 baud with a response "
                      "window of 100 ms are answered every 1.56 s each", result.stderr)
        self.assertIn("medium_access = true", result.stderr)
        self.assertEqual(result.stdout.count(" 0 fail-safe stops"), 12, result)
        # About five in eight seconds, but contention shares a channel by chance.
        self.assert_all_drive(result, 12, answers_at_least=1)

    def test_a_swarm_that_cannot_work_says_why_and_what_helps(self):
        self.serve(self.config)
        with tempfile.TemporaryDirectory() as elsewhere:
            result = self.run_swarm("--robots", 12, "--seconds", 6, "--period", 0.2, "--socket",
                                    self.folder / "pheromoned.sock", folder=elsewhere, status=None)
        at_first, end, at_the_end = result.stderr.partition(" robots had no answer for 0.48 s and stopped")
        self.assertTrue(end, result)
        self.assertRegex(at_first, r"\n\d+ of 12$")
        for part in (at_first, at_the_end):
            self.assertIn("are answered every 1.56 s each", part)
            self.assertIn("they stop if they are not answered for 0.48 s (fail-safe)", part)
            self.assertIn("medium_access = true", part)

    def test_a_scenario_with_too_many_robots_for_the_link_says_why(self):
        self.serve(self.config)
        text = (SOURCE / "client_fw/swarm/examples/live.toml").read_text(encoding="utf-8")
        self.assertIn("duration_s = 30\n", text)
        (self.folder / "many.toml").write_text(
            text.replace("duration_s = 30\n", "duration_s = 6\n").replace(
                "[[robots]]\n", "[[robots]]\ncount = 6\n"), encoding="utf-8")
        result = self.run_swarm("many.toml", "--daemon", "radio-a.pty", status=None)
        at_first, end, at_the_end = result.stderr.partition(" had no answer for 0.48 s and stopped")
        self.assertTrue(end, result)
        for part in (at_first, at_the_end):
            self.assertIn("12 robots on a channel of 9600 baud with a response window of 100 ms are "
                          "answered every 1.56 s each", part)

    def test_a_terminal_that_another_program_drives_is_not_taken(self):
        self.serve(self.config)
        first = subprocess.Popen([BIN / "pheromone-swarm", "live", "--modem", "radio-a.pty"],
                                 cwd=self.folder, text=True, stdout=subprocess.PIPE)
        self.addCleanup(first.communicate)
        self.addCleanup(first.kill)
        first.stdout.readline()  # it drives
        self.assertRegex(self.run_swarm("--robots", 2, status=1).stderr,
                         rf"/radio-a\.pty: in use by pheromone-swarm \(process {first.pid}, since ")

    def test_without_a_server_or_with_both_it_says_what_it_needs(self):
        self.assertIn("no server at none.sock: No such file or directory; start pheromoned",
                      self.run_swarm("--robots", 2, "--socket", "none.sock", status=1).stderr)
        self.assertIn("found neither a scenario nor --robots, expected one of them",
                      self.run_swarm(status=2).stderr)
        self.assertIn("found a scenario and --robots, expected one of them",
                      self.run_swarm("x.toml", "--robots", 2, status=2).stderr)

    def test_a_server_without_virtual_modem_is_told_what_to_add(self):
        pty = '[[link]]\nname = "radio-a"\nkind = "pty"\npath = "radio-a.pty"'
        self.assertIn(pty, self.config)
        self.serve(self.config.replace(
            pty, '[[link]]\nname = "wifi"\nkind = "udp"\nlisten = "127.0.0.1:0"'))
        self.assertIn("found the links wifi, expected one that is a virtual modem (kind = \"pty\") and up",
                      self.run_swarm("--robots", 2, status=1).stderr)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
