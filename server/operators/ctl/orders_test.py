#!/usr/bin/env python3
"""Orders to robots through a running pheromoned: commands, goals and halts.

    orders_test.py build/release/bin
"""

import itertools
import struct
import subprocess
import threading
import time

import operated_server  # which knows where proto_tests is
from operated_server import OperatedServer
from operated_daemon import PATIENCE_S, await_that
from stranger import wire
from stranger.client import open_terminal
from stranger.client import Client


class OrdersTest(OperatedServer):
    def test_a_command_waits_for_the_robots_word(self):
        robot = self.robot(24)
        with subprocess.Popen([operated_server.BIN / "pheromonectl", "command", "radio-a", "24", "speed", "250"],
                              cwd=self.folder, stdout=subprocess.PIPE, text=True) as ctl:
            message = self.receive(robot, 24)
            self.assertEqual(message[3:], bytes([3, 250, 0]))  # code, i16
            robot.line.send(wire.encode(bytes([24, 0x51, message[2], 3, 0, 0])))
            self.assertEqual(ctl.communicate(timeout=PATIENCE_S)[0], "speed: accepted\n")
            self.assertEqual(ctl.returncode, 0)

    def test_get_prints_the_value_with_its_name_and_unit(self):
        robot = self.robot(26)
        for seq, number, value, words in ((41, 136, 125, "battery: 12.5 V"),
                                          (42, 136, 125, "battery: 12.5 V"),
                                          (43, 7, 250, "speed_mm_s: 250 mm/s"),
                                          (44, 133, 6, "why it stands: 6 (fail-safe, halted)")):
            with subprocess.Popen([operated_server.BIN / "pheromonectl", "command", "radio-a", "26", "get", str(number)],
                                  cwd=self.folder, stdout=subprocess.PIPE, text=True) as ctl:
                message = self.receive(robot, 26)
                self.assertEqual(message[3:], bytes([9, number]))
                robot.line.send(wire.encode(bytes([26, 0x51, message[2], 9, 0, 0])))
                robot.line.send(wire.encode(bytes([26, 0x52, seq, 8, value, 0])))
                self.assertEqual(ctl.communicate(timeout=PATIENCE_S)[0], words + "\n")
                self.assertEqual(ctl.returncode, 0)

    def test_a_goal_is_shown_and_ends_with_a_halt(self):
        robot = self.robot(28)
        self.assertIn("robot 28 has not reported its position yet",
                      self.ctl("goto", "radio-a", 28, 2, 1, status=1))
        self.ctl("capture", "start")
        robot.sense(1, 1000, 1000, 0)
        self.assertEqual(self.ctl("goto", "radio-a", 28, 2, 1, "--tolerance", 0.05),
                         "robot 28 on link radio-a: goal (2, 1) m\n")
        self.assertEqual([it["goal"] for it in self.view("clients")["clients"] if it["id"] == 28],
                         [{"x_m": 2, "y_m": 1, "tolerance_m": 0.05}])
        self.assertRegex(self.ctl("clients"), r"\nradio-a +28 .* 2\.00 1\.00 m ")
        strength = int(4096 * (1.0 / 1.4) ** 2)  # a metre before the goal
        self.assertEqual(tuple(robot.sense(1, 1000, 1000, 0)), (strength, strength))
        self.assertEqual(tuple(robot.sense(1, 1000, 1000, 16384)), (strength - 8192, strength))
        self.assertEqual(tuple(robot.sense(1, 1960, 1000, 0)), (0, 0))
        message = self.receive(robot, 28)
        self.assertEqual(message[3], 1)  # halt
        robot.line.send(wire.encode(bytes([28, 0x51, message[2], 1, 0, 0])))
        self.assertEqual([it["goal"] for it in self.view("clients")["clients"] if it["id"] == 28],
                         [None])
        self.assertRegex(self.ctl("goto", "radio-a", 28, 2, 2), "goal")
        self.assertEqual(self.ctl("goto", "radio-a", 28, "--cancel"),
                         "robot 28 on link radio-a: goal cancelled\n")
        file = self.folder / self.view("capture", "stop")["file"]
        self.assertRegex(self.ctl("replay", file), r"[1-9]\d* answers")

    def test_a_goal_that_cannot_be_is_refused_with_the_reason(self):
        self.robot(29).sense(1, 1000, 1000, 0)
        for arguments, words in (
                (("radio-a", 29, 50, 1), "(50, 1) m is off the map"),
                (("radio-a", 30, 1, 1), 'no robot 30 has said HELLO on link "radio-a", expected one of '),
                (("nowhere", 29, 1, 1), 'unknown link "nowhere"'),
                (("radio-a", 29, "--cancel"), "robot 29 has no goal")):
            self.assertIn(words, self.ctl("goto", *arguments, status=1))
        for arguments in (("radio-a", 29), ("radio-a", 29, 1), ("radio-a", 29, 1, 1, "--cancel"),
                          ("radio-a", 0, 1, 1), ("radio-a", 29, 1, 1, "--tolerance", 0)):
            self.ctl("goto", *arguments, status=2)

    def test_halt_reaches_all_robots(self):
        robot = self.robot(25)
        self.halt()
        self.assertEqual(self.receive(robot, 0xFF)[3], 1)

    def test_halt_names_the_dead_link_and_who_moves_on_or_is_silent(self):
        line = open_terminal(self.folder / "radio-a.pty")
        self.addCleanup(line.close)
        for identifier in (51, 52, 53):
            client = Client(line, identifier, timeout=PATIENCE_S, tries=1)
            client.hello(nonce=1)
        client.sense(1, 1500, 1500, 0)
        over = threading.Event()

        def drive():  # 51 stands, 52 moves on, 53 is silent
            for step in itertools.count():
                if over.wait(0.03):
                    return
                x_mm = 1000 + abs(step % 400 - 200) * 5  # there and back
                for identifier, x in ((51, 1000), (52, x_mm)):
                    line.send(wire.encode(bytes([identifier, 0x01])
                                          + struct.pack("<hhH", x, 1000, 0)))

        robots = threading.Thread(target=drive)
        robots.start()
        try:
            await_that(lambda: self.state(53)["is"] == "silent", "robot 53 is silent")
            self.assertTrue(self.state(52)["moves"])
            self.assertFalse(self.state(51)["moves"])
            status, told = self.halt()
            self.assertEqual(self.state(51)["is"], "halted")
            self.assertEqual((self.state(52)["is"], self.state(52)["reason"]),
                             ("alarm", "it was told to halt, and moves"))
        finally:
            over.set()
            robots.join()
        self.assertEqual(status, 1)
        self.assertIn("halt sent on 1 of 2 links\n  modem is down: ./unplugged: No such file or "
                      "directory; its robots were not told\n", told)
        self.assertIn("  robot 52 on radio-a was not seen to stand\n", told)
        self.assertIn("  robot 53 on radio-a has been silent for ", told)
        self.assertNotIn("robot 51", told)
        sent = subprocess.run([operated_server.BIN / "pheromonectl", "goto", "radio-a", "53", "2", "2"], cwd=self.folder,
                              text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertRegex(sent.stderr, r"^pheromonectl: robot 53 on radio-a has been silent for .*"
                         r"; it goes there once it is heard again\n$")
        sent = subprocess.run([operated_server.BIN / "pheromonectl", "command", "radio-a", "53", "halt", "--no-wait"],
                              cwd=self.folder, text=True, capture_output=True, timeout=PATIENCE_S,
                              check=False)
        self.assertRegex(sent.stderr, r"^pheromonectl: robot 53 on radio-a has been silent for .*"
                         r"; it may not receive this\n$")
        self.assertEqual(sent.stdout, "halt: sent\n")

    def state(self, identifier):
        return next(client["state"] for client in self.view("clients")["clients"]
                    if client["id"] == identifier)

    def receive(self, robot, identifier):
        """The next COMMAND for an ID: ID, opcode, seq, code, arguments."""
        deadline = time.monotonic() + PATIENCE_S
        while (body := robot.line.receive(deadline)) is not None:
            if body[:2] == bytes([identifier, 0xD1]):
                return body
        raise AssertionError("no command came")


if __name__ == "__main__":
    operated_server.main()
