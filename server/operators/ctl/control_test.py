#!/usr/bin/env python3
"""A running pheromoned looked after from outside: pheromonectl, and HTTP as others speak it.

    control_test.py build/release/bin
"""

import json
import os
import pty
import re
import select
import socket
import subprocess
import time

import operated_server  # which knows where proto_tests is
from operated_server import OperatedServer
from operated_daemon import PATIENCE_S, await_that
from stranger import wire


class StatusTest(OperatedServer):
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


class ControlTest(OperatedServer):
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
            self.assertEqual(subprocess.run([operated_server.BIN / "pheromonectl", *map(str, arguments)], check=False,
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

    def test_reload_says_what_waits_for_a_restart(self):
        file = self.folder / "test.toml"
        self.addCleanup(file.write_text, operated_server.CONFIG)
        file.write_text(operated_server.CONFIG.replace("tau_s = 3000", "tau_s = 2000") + "[daemon]\nio_threads = "
                                                                         "2\n")
        self.assertEqual(self.ctl("reload"), "configuration reread\n  changed [daemon], "
                         "[control] or [web] settings require a restart\n")
        self.assertIn("loses one quantum every 2000 s", self.ctl("config", "show"))
        file.write_text(operated_server.CONFIG.replace("cell_m = 0.1", "cell_m = 0.2"))
        extent = "the map: x from 0 to 4 m, y from 0 to 3 m, cells of"
        self.assertEqual(self.ctl("reload", status=1),
                         f"pheromonectl: the state is of {extent} 0.1 m; the configuration has "
                         f"{extent} 0.2 m; a running server keeps its map: restart it, with a "
                         "journal after pheromonectl journal resample\n")
        file.write_text(operated_server.CONFIG.replace("cell_m = 0.1", "cell_m = -1\nunknown = 1"))
        first, *others = self.ctl("reload", status=1).splitlines()
        self.assertTrue(first.startswith("pheromonectl: test.toml:"), first)
        self.assertEqual(len(others), 1, others)
        self.assertTrue(others[0].startswith("  test.toml:"), others)
        file.write_text(operated_server.CONFIG)
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
            self.assertEqual(subprocess.run([operated_server.BIN / "pheromonectl", *arguments], check=False,
                                            capture_output=True).returncode, 2, arguments)

    def test_config_check_says_what_the_daemon_says(self):
        (self.folder / "bad.toml").write_text(operated_server.CONFIG.replace("tau_s = 0", "tau_s = -1"))
        for name in ("test.toml", "bad.toml"):
            of_daemon = subprocess.run([operated_server.BIN / "pheromoned", "--check", "--config", name], cwd=self.folder,
                                       text=True, capture_output=True, check=False)
            of_ctl = subprocess.run([operated_server.BIN / "pheromonectl", "config", "check", name], cwd=self.folder,
                                    text=True, capture_output=True, check=False)
            self.assertEqual((of_ctl.returncode, of_ctl.stdout, of_ctl.stderr),
                             (of_daemon.returncode, of_daemon.stdout, of_daemon.stderr))

    def test_version_is_that_of_both(self):
        self.assertRegex(self.ctl("version"), r"^pheromonectl (\S+)\npheromoned \1\n$")

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
            os.execv(operated_server.BIN / "pheromonectl", [operated_server.BIN / "pheromonectl", "watch", "path"])
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


if __name__ == "__main__":
    operated_server.main()
