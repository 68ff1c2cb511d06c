#!/usr/bin/env python3
"""client_fw/attach/own_robot.cc: it stands until it may drive, follows the server's path, obeys, and
stops its wheels when it ends.

    own_robot_test.py BIN_DIR
"""

import contextlib
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

from operated_daemon import OperatedDaemon, default_config, write_config
from test_config import link

BIN = pathlib.Path(sys.argv.pop(1)).resolve()


class OwnRobotTest(unittest.TestCase):
    def test_it_follows_the_path_and_obeys(self):
        self.drive({}, [])

    def test_with_a_key_it_does_so_on_a_signed_link(self):
        self.drive({"security": "require", "keys": "robots.keys"}, ["robot-7.key"])

    def drive(self, security, more):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        folder = pathlib.Path(temporary.name)
        write_config(folder, default_config(BIN) + link("udp", "udp", listen="127.0.0.1:0",
                                                         **security))
        for words in (("new", "7"), ("export", "7", "--robot", "robot-7.key")):
            subprocess.run([BIN / "pheromonectl", "keys", *words, "--file", "robots.keys"],
                           cwd=folder, capture_output=True, check=True)
        daemon = OperatedDaemon(BIN, folder)
        self.addCleanup(daemon.kill)
        robot = subprocess.Popen(
            [BIN / "own_robot", f"udp:127.0.0.1:{daemon.udp_port()}", "7", *more],
            cwd=folder, stdout=subprocess.PIPE, text=True)
        self.addCleanup(robot.wait)
        self.addCleanup(robot.stdout.close)
        self.addCleanup(robot.kill)
        limit = threading.Timer(200, robot.kill)  # so that reading its lines ends
        limit.start()
        self.addCleanup(limit.cancel)

        def place_mm():
            return [int(it) for it in re.findall(r"-?\d+(?= )", robot.stdout.readline().partition(" s ")[2])[:2]]

        def drives_to(x_mm):
            while place_mm()[0] < x_mm:
                pass

        def resume():
            done = subprocess.run([BIN / "pheromonectl", "command", "udp", "7", "resume"], cwd=folder,
                                  text=True, capture_output=True, check=False)
            self.assertEqual(done.returncode, 0, done)

        self.assertEqual(place_mm(), [0, 0])
        resume()
        drives_to(600)
        self.assertEqual(daemon.call("POST", "/api/v1/halt", {})[0], 200)
        before, now = place_mm(), place_mm()
        while now != before:
            before, now = now, place_mm()
        resume()
        drives_to(now[0] + 200)
        robot.send_signal(signal.SIGINT)
        last = robot.stdout.read().splitlines()[-1]
        self.assertEqual((robot.wait(), last[last.index("rad"):]), (0, "rad, 0 0 mm/s"))

    def test_it_ends_although_nobody_reads_what_it_says(self):
        robot = subprocess.Popen([BIN / "own_robot"], stdout=subprocess.PIPE, text=True)
        self.addCleanup(robot.wait)
        self.addCleanup(robot.stdout.close)
        self.addCleanup(robot.kill)
        robot.stdout.readline()
        pipe = os.open(f"/proc/{robot.pid}/fd/1", os.O_WRONLY | os.O_NONBLOCK)
        self.addCleanup(os.close, pipe)
        for size in (1 << 16, 1):
            with contextlib.suppress(BlockingIOError):
                while True:
                    os.write(pipe, b"\n" * size)
        robot.send_signal(signal.SIGINT)
        self.assertEqual(robot.wait(timeout=20), 0)

    def test_what_is_no_address_id_or_key_is_told(self):
        for arguments in (["udp:nowhere"], ["udp:127.0.0.1:4951", "0"], ["udp:127.0.0.1:4951", "300"],
                          ["udp:127.0.0.1:4951", "7", "nowhere.key"]):
            done = subprocess.run([BIN / "own_robot", *arguments], text=True, capture_output=True,
                                  check=False, timeout=60)
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertIn("own_robot: ", done.stderr)


if __name__ == "__main__":
    unittest.main()
