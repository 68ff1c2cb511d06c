#!/usr/bin/env python3
"""A running pheromoned looked after from outside: pheromonectl, and HTTP as others speak it.

    control_test.py --pheromoned build/release/bin/pheromoned
                    --pheromonectl build/release/bin/pheromonectl
"""

import argparse
import http.client
import json
import os
import pathlib
import pty
import re
import select
import shutil
import socket
import stat
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "proto_tests"))
from operated_daemon import await_that  # noqa: E402
from stranger import wire  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402
import test_config  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

PHEROMONED = ""
PHEROMONECTL = ""
PATIENCE_S = 30
TOKEN = "0123456789abcdef0123456789abcdef"

CONFIG = (map_of(4.0, 3.0, bias_m=0.2) + pheromone(1, "trail", tau_s=3000, sigma_m=0.3)
          + pheromone(2, "path", sigma_m=0.3) + test_config.pty("radio-a")
          + link("modem", "serial", port="./unplugged")
          + table("[tracker]", name="ceiling", listen="127.0.0.1:0")
          + table("web", listen="127.0.0.1:0", token_file="token", hosts=["lab.local"]))


class Server(unittest.TestCase):
    """One pheromoned for the tests of a class."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        (cls.folder / "lab.toml").write_text(CONFIG)
        (cls.folder / "token").write_text(TOKEN + "\n")
        (cls.folder / "token").chmod(0o600)
        cls.process = subprocess.Popen([PHEROMONED, "--config", "lab.toml"], cwd=cls.folder,
                                       stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)
        log = b""
        while b"ready: " not in log:
            if not select.select([cls.process.stderr], [], [], PATIENCE_S)[0]:
                raise AssertionError(log.decode())
            log += os.read(cls.process.stderr.fileno(), 65536)
        cls.port = int(re.search(rb"web: http://127\.0\.0\.1:(\d+)", log)[1])
        cls.drain = threading.Thread(target=cls.process.stderr.read)
        cls.drain.start()

    @classmethod
    def tearDownClass(cls):
        cls.process.terminate()
        status = cls.process.wait(PATIENCE_S)
        cls.drain.join()
        cls.process.stderr.close()
        left = (cls.folder / "pheromoned.sock").exists()
        cls.temporary.cleanup()
        assert status == 0, status
        assert not left, "the socket was left behind"

    def ctl(self, *arguments, status=0):
        result = subprocess.run([PHEROMONECTL, *(str(it) for it in arguments)], cwd=self.folder,
                                text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.returncode, status, (arguments, result.stdout, result.stderr))
        if status == 0:
            self.assertEqual(result.stderr, "")
            return result.stdout
        self.assertEqual(result.stdout, "")
        return result.stderr

    def halt(self):
        """Its exit status, and what it tells: the modem is unplugged."""
        result = subprocess.run([PHEROMONECTL, "halt"], cwd=self.folder, text=True,
                                capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.stderr, "")
        return result.returncode, result.stdout

    def view(self, *arguments):
        return json.loads(self.ctl(*arguments, "--json"))

    def request(self, method, path, body=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.request(method, path, body, {key.replace("_", "-"): value
                                                for key, value in headers.items()})
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer, data

    def robot(self, identifier):
        """A robot on the link that has said HELLO. One at a time: they would share the terminal."""
        line = open_terminal(self.folder / "radio-a.pty")
        self.addCleanup(line.close)
        client = Client(line, identifier, timeout=PATIENCE_S, tries=1)
        client.hello(nonce=1)
        return client


class StatusTest(Server):
    """On a server of its own: where nothing lies and nobody is commanded, nothing falls due, and the
    log grows by what robots do alone."""

    def test_status_counts_what_robots_do(self):
        start = self.view("status")
        robot = self.robot(21)
        before = self.view("status")
        self.assertEqual(before["sequence"], start["sequence"] + 1)  # HELLO is an event
        robot.line.send(wire.encode(bytes([21, 0x72, 1])))  # PING
        self.assertIsNotNone(robot.line.receive(time.monotonic() + PATIENCE_S))
        after = self.view("status")
        self.assertEqual(after["counters"]["requests"] - before["counters"]["requests"], 1)
        self.assertEqual(after["sequence"], before["sequence"])  # PING is none
        self.assertIsNone(after["durable_sequence"])  # there is no journal
        self.assertIn("links     1 of 2 up\n", self.ctl("status"))
        self.assertIn(f"event {after['sequence']}, not kept: no journal; ", self.ctl("status"))
        self.assertRegex(self.ctl("status", "--hash"), r"hash [0-9a-f]{16}\n")
        self.assertGreater(after["process"]["resident_bytes"], 1 << 20)

    def test_links_and_status_tell_of_refused_poses(self):
        host, port = re.search(r"\nceiling +up .* udp ([0-9.]+):(\d+) ", self.ctl("links")).groups()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(b"pose radio-a 8 1 1 0", (host, int(port)))
        await_that(lambda: "the robot has not said HELLO" in self.ctl("links"), "the pose arrives")
        self.assertRegex(self.ctl("links"),
                         r"\nceiling +up +1 +0 +1 +udp 127\.0\.0\.1:\d+ +the robot has not said "
                         r'HELLO: "pose radio-a 8 1 1 0"\n')
        self.assertIn("WARNING   1 poses of trackers were refused: pheromonectl links",
                      self.ctl("status"))


class ControlTest(Server):
    def raster(self, pheromone):
        _, data = self.request("GET", f"/api/v1/field?pheromone={pheromone}&nodes_per_cell=1")
        return json.loads(data)

    def test_links_and_clients_are_listed(self):
        self.robot(22).sense(1, 1500, 500, 16384)
        links = self.ctl("links")
        self.assertRegex(links, r"\nradio-a +pty +up +\S+ \S+ +\S+ s ago ")
        self.assertRegex(links, r"\nmodem +serial +down +\S+ \S+ +- .*No such file or directory; "
                         r"\d+ failed attempts?(, next in \S+ s)?\n")
        client = [it for it in self.view("clients")["clients"] if it["id"] == 22][0]
        self.assertEqual(client["pose"],
                         {"x_m": 1.5, "y_m": 0.5, "heading_deg": 90, "source": "robot"})
        self.assertTrue(client["known"])
        self.assertGreaterEqual(client["requests"], 2)
        self.assertLess(client["silent_s"], PATIENCE_S)
        self.assertRegex(self.ctl("clients", "--link", "radio-a"), r"\nradio-a +22 ")
        self.assertNotIn("radio-a", self.ctl("clients", "--link", "modem"))

    def test_what_is_painted_is_smelled_by_operator_and_robot_alike(self):
        self.ctl("erase", "path", "--all")
        self.ctl("paint", "path", 1, 1, 3, 1, "--radius", 0.01)
        raster = self.raster("path")
        row = raster["values"][raster["rows"] - 1 - 10]
        self.assertEqual(row, [1 if 10 <= c <= 30 else 0 for c in range(41)])
        robot = self.robot(23)
        smelled = robot.sense(2, 2000, 1050, 0)
        view = self.view("sense", "path", 2, 1.05, 0)
        self.assertEqual([view[it]["intensity"] * 4096 for it in ("left", "right")], list(smelled))
        self.assertIn("left ", self.ctl("sense", "2", 2, 1.05))
        self.ctl("erase", "path", "--all")
        self.assertEqual(sum(map(sum, self.raster("path")["values"])), 0)

    def test_paint_and_erase_say_what_they_touched(self):
        self.assertEqual(self.ctl("paint", "path", "--area", 0, 0, 0.1, 0.1),
                         'painted "path": 4 nodes changed\n')
        self.assertEqual(self.ctl("paint", "path", "--area", 0, 0, 0.1, 0.2),
                         'painted "path": 2 of 6 nodes changed\n')
        self.assertEqual(self.ctl("paint", "path", "--area", 0, 0, 0.1, 0.2),
                         'painted "path": 0 of 6 nodes changed\n')
        self.assertEqual(self.ctl("erase", "path", 4, 3, "--radius", 0.05),
                         'erased "path": 0 of 1 node changed; part of the shape is off the map\n')
        self.assertIn("the shape contains no node of the map",
                      self.ctl("paint", "path", "--area", 5, 5, 6, 6, status=1))
        self.assertIn("the shape contains no node of the map",
                      self.ctl("erase", "path", 1.05, 1.05, "--radius", 0.01, status=1))
        self.ctl("erase", "path", "--all")

    def test_edits_are_undone_and_redone_also_after_deposits(self):
        self.ctl("erase", "path", "--all")
        self.ctl("paint", "path", 1, 1, 1.2, 1, "--radius", 0.02, "--units", 0.5)
        painted = self.raster("path")["values"]
        self.ctl("erase", "path", "--area", 0, 0, 4, 3)
        self.assertRegex(self.ctl("undo"), r'^undid: erasure of "path" in an area, made at '
                                           r'[0-2]\d:[0-5]\d:[0-5]\d: 3 nodes changed\n$')
        self.assertEqual(self.raster("path")["values"], painted)
        # What a robot deposits stays, with and without the stroke.
        self.robot(29).deposit(2, 1000, 1000)
        with_both = self.raster("path")["values"]
        self.assertIn('undid: stroke of "path", made at', self.ctl("undo"))
        left = [value for row in self.raster("path")["values"] for value in row if value]
        self.assertEqual(len(left), 1)
        self.assertIn(': 3 nodes changed', self.ctl("redo"))
        self.assertEqual(self.raster("path")["values"], with_both)
        self.assertIn("redid: erasure", self.ctl("redo"))
        self.assertIn("nothing to redo", self.ctl("redo", status=1))
        self.ctl("undo")
        self.assertEqual(json.loads(self.ctl("--json", "undo"))["what"], 'stroke of "path"')
        self.ctl("erase", "path", "--all")

    def test_idle_connections_lock_nobody_out(self):
        idle = []
        for _ in range(300):
            idle.append(socket.create_connection(("127.0.0.1", self.port), PATIENCE_S))
        for _ in range(200):
            it = socket.socket(socket.AF_UNIX)
            it.connect(str(self.folder / "pheromoned.sock"))
            idle.append(it)
        self.assertIn("halt sent", self.halt()[1])
        self.assertEqual(self.request("GET", "/healthz")[0].status, 200)
        for it in idle:
            it.close()

    def test_a_header_or_a_key_that_comes_twice_is_refused(self):
        with socket.create_connection(("127.0.0.1", self.port), PATIENCE_S) as line:
            line.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n")
            self.assertTrue(line.recv(65536).startswith(b"HTTP/1.1 400 "))
        answer, data = self.request("POST", "/api/v1/deposit",
                                    '{"pheromone": 1, "x_m": 1, "y_m": 1, "x_m": 2}',
                                    Authorization=f"Bearer {TOKEN}")
        self.assertEqual((answer.status, json.loads(data)["error"]["where"]), (400, "x_m"))

    def test_a_deposit_is_one_quantum_at_the_nearest_node(self):
        self.ctl("erase", "1", "--all")
        self.ctl("deposit", "trail", 0.52, 0.48)
        self.ctl("deposit", "1", 0.52, 0.48, "--quanta", 2)
        raster = self.raster("trail")
        self.assertEqual(raster["values"][raster["rows"] - 1 - 5][5], 0.375)
        self.assertEqual(sum(map(sum, raster["values"])), 0.375)
        self.ctl("erase", "trail", "--area", 0, 0, 1, 1)
        self.assertEqual(sum(map(sum, self.raster("trail")["values"])), 0)

    def test_what_is_wrong_is_told_with_its_status(self):
        self.assertIn('found "moss", expected one of 1 (trail), 2 (path)',
                      self.ctl("sense", "moss", 1, 1, status=2))
        extent = "the map: x from 0 to 4 m, y from 0 to 3 m"
        for arguments, words in (
                (("deposit", "trail", -1, 1),
                 f"x_m, y_m: the position is off the map, expected a position on {extent}"),
                (("sense", "trail", 4.1, 1),
                 f"x_m, y_m: the pose is off the map, expected a position on {extent}"),
                (("paint", "path", 2000, 1500, 3000, 1500),
                 f"the shape contains no node of {extent}"),
                (("paint", "path", 2000, 1500, 4001, 1500),
                 f"a stroke that spans more than 2 km: coordinates are in metres; {extent}"),
                (("clients", "--link", "radio-z"),
                 'unknown link "radio-z", expected one of radio-a, modem'),
                (("command", "radio-z", 1, "halt"),
                 'unknown link "radio-z", expected one of radio-a, modem')):
            self.assertEqual(self.ctl(*arguments, status=1), f"pheromonectl: {words}\n")
        self.robot(23)
        self.assertRegex(self.ctl("command", "radio-a", 250, "halt", status=1),
                         r'no robot 250 has said HELLO on link "radio-a", expected one of [0-9, ]*23')
        self.assertIn("expected 1 argument: mm_per_s from",
                      self.ctl("command", "radio-a", 1, "speed", status=2))
        self.assertEqual(self.ctl("command", "radio-a", 1, "speed", 0.3, status=2),
                         'pheromonectl: speed: found "0.3" for mm_per_s, expected a whole number '
                         "from 0 to 1000\n")
        self.assertIn("keeps no journal", self.ctl("snapshot", status=1))
        for arguments in ((), ("nothing",), ("erase", "trail"), ("erase", "trail", 1, 2, 3),
                          ("command", "radio-a", 0, "halt"), ("deposit", "trail", 1),
                          ("paint", "trail", "--all", "--area", 1, 1, 2, 2)):
            self.assertEqual(subprocess.run([PHEROMONECTL, *map(str, arguments)], check=False,
                                            capture_output=True).returncode, 2, arguments)

    def test_without_a_server_it_says_where_it_looked_and_what_to_do(self):
        words = self.ctl("status", "--socket", "none.sock", status=3)
        self.assertEqual(words, "pheromonectl: no server at none.sock: No such file or directory; "
                                "start pheromoned, or name the socket of a running server with "
                                "--socket\n")
        dead = socket.socket(socket.AF_UNIX)
        dead.bind(str(self.folder / "dead.sock"))
        dead.close()
        self.assertIn("Connection refused", self.ctl("halt", "--socket", "dead.sock", status=3))

    def test_an_instance_is_the_socket_of_its_service(self):
        self.assertIn("no server at /run/pheromone/no-such-lab/pheromoned.sock: ",
                      self.ctl("status", "--instance", "no-such-lab", status=3))
        self.assertIn("expected the name of a service",
                      self.ctl("status", "--instance", "../lab2", status=2))
        self.ctl("status", "--instance", "lab2", "--socket", "x.sock", status=2)

    def test_an_unknown_command_is_told_with_those_that_there_are(self):
        words = self.ctl("stat", status=2)
        self.assertTrue(words.startswith('pheromonectl: unknown command "stat", expected one of '
                                         'status, links, '), words)
        self.assertIn('unknown command "map paint", expected one of draw, export, convert, ',
                      self.ctl("map", "paint", status=2))
        self.assertTrue(self.ctl("status", "--bogus", status=2).startswith("pheromonectl: "))

    def test_a_command_with_too_few_arguments_says_which_it_needs(self):
        self.assertIn("arguments: found [1], expected 2 arguments: ",
                      self.ctl("command", "radio-a", 1, "go-to", 1, status=2))

    def test_a_command_waits_for_the_robots_word(self):
        robot = self.robot(24)
        with subprocess.Popen([PHEROMONECTL, "command", "radio-a", "24", "speed", "250"],
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
            with subprocess.Popen([PHEROMONECTL, "command", "radio-a", "26", "get", str(number)],
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
            x_mm = 1000
            while not over.wait(0.03):
                x_mm += 5
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
        sent = subprocess.run([PHEROMONECTL, "goto", "radio-a", "53", "2", "2"], cwd=self.folder,
                              text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertRegex(sent.stderr, r"^pheromonectl: robot 53 on radio-a has been silent for .*"
                         r"; it goes there once it is heard again\n$")
        sent = subprocess.run([PHEROMONECTL, "command", "radio-a", "53", "halt", "--no-wait"],
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

    def test_reload_says_what_waits_for_a_restart(self):
        file = self.folder / "lab.toml"
        self.addCleanup(file.write_text, CONFIG)
        file.write_text(CONFIG.replace("tau_s = 3000", "tau_s = 2000") + "[daemon]\nio_threads = "
                                                                         "2\n")
        self.assertEqual(self.ctl("reload"), "configuration reread\n  changed [daemon], "
                         "[control] or [web] settings require a restart\n")
        self.assertIn("loses one quantum every 2000 s", self.ctl("config", "show"))
        file.write_text(CONFIG.replace("cell_m = 0.1", "cell_m = 0.2"))
        extent = "the map: x from 0 to 4 m, y from 0 to 3 m, cells of"
        self.assertEqual(self.ctl("reload", status=1),
                         f"pheromonectl: the state is of {extent} 0.1 m; the configuration has "
                         f"{extent} 0.2 m; a running server keeps its map: restart it, with a "
                         "journal after pheromonectl journal resample\n")
        file.write_text(CONFIG)
        self.ctl("reload")

    def test_a_recording_is_started_looked_at_and_stopped(self):
        self.assertFalse(self.view("status")["capture"]["recording"])
        self.assertIn("no recording is in progress", self.ctl("capture", "stop", status=1))
        self.assertEqual(self.view("capture", "status")["folder"],
                         str(self.folder / "captures"))
        self.assertRegex(self.ctl("capture", "start"),
                         r"^recording into \S+/captures/pheromone-\S+\.pcapng: \S+ KiB in 1 "
                         r"file\n$")
        self.assertIn("a recording is already in progress", self.ctl("capture", "start", status=1))
        self.assertIn(f"capture   recording into {self.folder}/captures/", self.ctl("status"))
        self.assertIn(b"\npheromone_capture_recording 1\n", self.request("GET", "/metrics")[1])
        self.robot(27).sense(1, 1500, 500, 0)
        view = self.view("capture", "stop")
        self.assertEqual((view["recording"], view["error"], view["lost"]), (False, None, 0))
        file = self.folder / view["file"]
        self.assertLess(view["bytes"], file.stat().st_size)  # the header is not counted
        self.assertRegex(self.ctl("replay", file), r"[1-9]\d* answers")
        self.assertRegex(self.ctl("capture", "status"), r"^not recording; the last into "
                                                        r"\S+/captures/")
        for arguments in (("capture",), ("capture", "pause"), ("capture", "start", "here")):
            self.assertEqual(subprocess.run([PHEROMONECTL, *arguments], check=False,
                                            capture_output=True).returncode, 2, arguments)

    def test_config_check_says_what_the_daemon_says(self):
        (self.folder / "bad.toml").write_text(CONFIG.replace("tau_s = 0", "tau_s = -1"))
        for name in ("lab.toml", "bad.toml"):
            of_daemon = subprocess.run([PHEROMONED, "--check", "--config", name], cwd=self.folder,
                                       text=True, capture_output=True, check=False)
            of_ctl = subprocess.run([PHEROMONECTL, "config", "check", name], cwd=self.folder,
                                    text=True, capture_output=True, check=False)
            self.assertEqual((of_ctl.returncode, of_ctl.stdout, of_ctl.stderr),
                             (of_daemon.returncode, of_daemon.stdout, of_daemon.stderr))

    def test_version_is_that_of_both(self):
        self.assertRegex(self.ctl("version"), r"^pheromonectl (\S+)\npheromoned \1\n$")

    def test_over_the_network_reading_is_free_and_changing_needs_the_token(self):
        answer, data = self.request("GET", "/api/v1/status")
        self.assertEqual((answer.status, answer.getheader("Content-Type")),
                         (200, "application/json"))
        json.loads(data)
        halt = ("POST", "/api/v1/halt", "{}")
        for status, headers in ((401, {}), (401, {"Authorization": "Bearer x"}),
                                (403, {"Authorization": f"Bearer {TOKEN}",
                                       "Origin": "http://evil.example"}),
                                (200, {"Authorization": f"Bearer {TOKEN}"}),
                                (200, {"Authorization": f"Bearer {TOKEN}",
                                       "Origin": f"http://127.0.0.1:{self.port}"})):
            answer, data = self.request(*halt, **headers)
            self.assertEqual(answer.status, status, (headers, data))
        for status, host in ((421, "evil.example"), (200, "lab.local:80"), (200, "localhost")):
            answer, data = self.request("GET", "/api/v1/status", Host=host)
            self.assertEqual(answer.status, status, (host, data))
        answer, data = self.request("GET", "/api/v1/halt")
        self.assertEqual((answer.status, answer.getheader("Allow")), (405, "POST"))
        self.assertEqual(set(json.loads(data)["error"]), {"what", "where", "expected"})
        self.assertEqual(self.request("GET", "/healthz")[0].status, 200)

    def test_the_socket_is_for_its_user_and_group(self):
        mode = (self.folder / "pheromoned.sock").stat().st_mode
        self.assertTrue(stat.S_ISSOCK(mode))
        self.assertEqual(stat.S_IMODE(mode), 0o660)

    @unittest.skipIf(os.geteuid() != 0, "only root can become somebody else")
    def test_who_may_not_use_the_socket_is_told_of_the_group(self):
        self.folder.chmod(0o755)
        result = subprocess.run([PHEROMONECTL, "status"], cwd=self.folder, text=True, user=65534,
                                group=65534, extra_groups=[], capture_output=True,
                                timeout=PATIENCE_S, check=False)
        self.assertEqual((result.returncode, result.stdout), (3, ""))
        self.assertEqual(result.stderr, "pheromonectl: pheromoned.sock: Permission denied; the "
                         "server may be used by members of its group, of the service: pheromone. "
                         "Join it (sudo adduser $USER pheromone, then log in again), or use sudo\n")

    def second(self, config):
        """What a server beside this one says, which ends with status 1."""
        (self.folder / "second.toml").write_text(config)
        result = subprocess.run([PHEROMONED, "--config", "second.toml"], cwd=self.folder, text=True,
                                capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertNotIn("ready: ", result.stderr)
        self.ctl("status")  # the first one was left alone
        return result.stderr

    def test_a_second_server_beside_it_ends_and_says_who_has_socket_and_port(self):
        holder = rf"pheromoned \(process {self.process.pid}, since \d+-\d+-\d+ \d+:\d+:\d+\)"
        config = CONFIG.replace("radio-a.pty", "second.pty")
        self.assertRegex(self.second(config), "control: pheromoned.sock: in use by " + holder
                         + "; a server that pheromonectl cannot reach does not start")
        self.assertFalse((self.folder / "second.pty").is_symlink())
        config = config.replace("127.0.0.1:0", f"127.0.0.1:{self.port}") + table(
            "control", socket="second.sock")
        self.assertRegex(self.second(config),
                         f"web: cannot listen on 127.0.0.1 port {self.port}: Address already in use "
                         f"by {holder}; choose another one")
        self.assertFalse((self.folder / "second.sock").exists())

    def test_promtool_has_nothing_to_say_about_the_metrics(self):
        promtool = shutil.which("promtool")
        if promtool is None:
            self.skipTest("promtool is not installed")
        self.robot(26)
        answer, data = self.request("GET", "/metrics")
        self.assertEqual(answer.getheader("Content-Type"),
                         "text/plain; version=0.0.4; charset=utf-8")
        result = subprocess.run([promtool, "check", "metrics"], input=data, capture_output=True,
                                check=False)
        self.assertEqual((result.returncode, result.stdout + result.stderr), (0, b""))

    def test_watch_once_draws_what_lies_on_the_map(self):
        self.ctl("erase", "path", "--all")
        self.ctl("paint", "path", "--area", 0, 0, 4, 1.5)
        lines = self.ctl("watch", "path", "--once", "--columns", 60, "--rows", 30).splitlines()
        self.assertEqual(len(lines), 17)  # 31 rows of nodes, two in a line, and what it is
        self.assertEqual({it for it in lines[0][:41]}, {" "})
        self.assertEqual(lines[9], "@" * 41)
        self.assertIn("path up to 1", lines[16])
        self.ctl("erase", "path", "--all")

    def test_watch_in_a_terminal_ends_with_q_and_gives_it_back(self):
        child, terminal = pty.fork()
        if child == 0:
            os.chdir(self.folder)
            os.environ["TERM"] = "xterm"
            os.execv(PHEROMONECTL, [PHEROMONECTL, "watch", "path"])
        shown = b""
        deadline = time.monotonic() + PATIENCE_S
        asked = False
        while True:
            self.assertTrue(select.select([terminal], [], [], deadline - time.monotonic())[0])
            try:
                data = os.read(terminal, 65536)
            except OSError:  # the other side has gone
                break
            if not data:
                break
            shown += data
            if not asked and b"q quits" in shown:
                os.write(terminal, b"q")
                asked = True
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
        os.close(terminal)
        self.assertTrue(shown.startswith(b"\x1b[?1049h"), shown[:40])
        self.assertTrue(shown.endswith(b"\x1b[?25h\x1b[?1049l"), shown[-40:])
        self.assertIn("\u2580".encode(), shown)


def main():
    global PHEROMONED, PHEROMONECTL
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pheromoned", required=True)
    parser.add_argument("--pheromonectl", required=True)
    arguments, rest = parser.parse_known_args()
    PHEROMONED = str(pathlib.Path(arguments.pheromoned).resolve())
    PHEROMONECTL = str(pathlib.Path(arguments.pheromonectl).resolve())
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
