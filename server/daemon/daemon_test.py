#!/usr/bin/env python3
"""The pheromoned program from outside: command line, exit status, signals, links that fail.

    daemon_test.py --pheromoned build/release/bin/pheromoned
                   --shim build/release/tests/libpty_as_serial_shim.so
"""

import argparse
import http.client
import os
import pathlib
import pwd
import re
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
import tty
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto_tests"))
from stranger.client import Client, open_terminal  # noqa: E402
from test_config import map_of, pheromone, pty  # noqa: E402

PHEROMONED = ""
SHIM = ""
PATIENCE_S = 30  # of a busy machine; nothing waits this long when things are well

CONFIG = map_of() + pheromone(1, "trail", tau_s=30.0, maximum=0.25)
PTY = pty("radio-a")


def crc16(body):
    crc = 0
    for byte in body:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return crc


def frame(client, opcode, data):
    body = bytes([client, opcode]) + data
    body += crc16(body).to_bytes(2, "little")
    return b"\x10\x02" + body.replace(b"\x10", b"\x10\x10") + b"\x10\x03"


PING = frame(3, 0x72, b"\x2a")
ECHO = frame(3, 0xF2, b"\x2a")


class Running:
    """A pheromoned in a folder of its own, and what it says. `before`: a command that starts it."""

    def __init__(self, folder, *arguments, before=(), **kwargs):
        environment = {key: value for key, value in os.environ.items()
                       if key not in ("JOURNAL_STREAM", "INVOCATION_ID")}
        environment.update(kwargs)
        self.process = subprocess.Popen([*before, PHEROMONED, *arguments], cwd=folder,
                                        env=environment, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.PIPE)
        self.log = ""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stderr.close()

    def _read(self):
        data = os.read(self.process.stderr.fileno(), 65536)
        self.log += data.decode()
        return data != b""

    def await_log(self, text, times=1):
        deadline = time.monotonic() + PATIENCE_S
        while self.log.count(text) < times:
            left = deadline - time.monotonic()
            if not select.select([self.process.stderr], [], [], max(left, 0))[0] or not self._read():
                raise AssertionError(f"waited for {text!r} in\n{self.log}")

    def end(self):
        """The exit status, once the process has ended by itself."""
        while self._read():
            pass
        return self.process.wait(PATIENCE_S)

    def stop(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        return self.end()


def ask(descriptor, request, answer_size):
    os.write(descriptor, request)
    answer = b""
    while len(answer) < answer_size:
        if not select.select([descriptor], [], [], PATIENCE_S)[0]:
            raise AssertionError(f"no answer; so far {answer!r}")
        answer += os.read(descriptor, answer_size - len(answer))
    return answer


class DaemonTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)
        self.config = self.folder / "test.toml"
        self.config.write_text(CONFIG + PTY)

    def call(self, *arguments):
        return subprocess.run([PHEROMONED, *arguments], cwd=self.folder, text=True,
                              capture_output=True, timeout=PATIENCE_S, check=False)

    def start(self, *arguments, **kwargs):
        return Running(self.folder, *arguments, **kwargs)

    def test_check_accepts_a_good_file(self):
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        lines = result.stdout.splitlines()
        self.assertEqual(lines[0], "test.toml: ok")
        self.assertIn("loses one quantum every 30 s", lines[2])

    def test_check_refuses_a_bad_file_with_every_mistake(self):
        self.config.write_text(CONFIG.replace("cell_m = 0.1", "cel_m = 0.1")
                               .replace("sigma_m = 0.4", 'sigma_m = "wide"') + PTY)
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual(result.returncode, 2)
        self.assertEqual(result.stdout, "")
        self.assertIn("test.toml:4:1: map.cel_m: unknown key, expected cell_m?\n", result.stderr)
        self.assertIn("test.toml:11:11: pheromone[1].sigma_m: found the string \"wide\", expected "
                      "a number", result.stderr)

    def test_check_refuses_a_journal_whose_folder_cannot_be_made_by_anybody(self):
        self.config.write_text(CONFIG + PTY + '[journal]\nfolder = "none/state"\n')
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual((result.returncode, result.stdout), (2, ""))
        self.assertEqual(result.stderr, f"test.toml: journal.folder: {self.folder}/none: No such "
                         "file or directory, expected a writable folder\n")

    def test_check_says_whether_the_folders_can_be_used_and_leaves_them_alone(self):
        self.config.write_text(CONFIG + PTY + '[journal]\nfolder = "state"\n')
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn(f"  journal: {self.folder}/state, to be created\n"
                      f"  recordings: {self.folder}/captures, to be created\n",
                      result.stdout)
        self.assertEqual(os.listdir(self.folder), ["test.toml"])
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            result = self.call("--check", "--config", "test.toml")  # beside the one that owns it
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertIn(f"  journal: {self.folder}/state\n", result.stdout)
            self.assertEqual(server.stop(), 0)
        # Root may write everywhere, so another user asks.
        (self.folder / "state" / "lock").chmod(0o600)
        self.folder.chmod(0o555)
        (self.folder / "state").chmod(0o777)
        other = {"user": 65534} if os.geteuid() == 0 else {}
        result = subprocess.run([PHEROMONED, "--check", "--config", "test.toml"], cwd=self.folder,
                                text=True, capture_output=True, check=False, **other)
        self.folder.chmod(0o755)
        warnings = result.stderr.splitlines()
        self.assertEqual(result.returncode, 0)
        self.assertIn(f"warning: capture.folder: {self.folder}: Permission denied, expected a "
                      "writable folder", warnings)
        self.assertEqual(bool(other), f"warning: journal.folder: {self.folder}/state/lock: "
                         "Permission denied, "
                         "expected a file owned by the server's user" in warnings)

    def test_a_bad_file_ends_the_start_with_the_same_words(self):
        self.config.write_text("[map\n")
        checked = self.call("--check", "--config", "test.toml")
        started = self.call("--config", "test.toml")
        self.assertEqual((started.returncode, started.stderr), (2, checked.stderr))
        self.assertTrue(started.stderr.startswith("test.toml:1:"))

    def test_a_file_that_is_not_there(self):
        result = self.call("--config", "none.toml")
        self.assertEqual((result.returncode, result.stderr),
                         (2, "none.toml: cannot be opened: No such file or directory\n"))

    def test_the_default_configuration_can_be_copied(self):
        printed = self.call("--default-config")
        self.assertEqual(printed.returncode, 0)
        self.config.write_text(printed.stdout)
        self.assertEqual(self.call("--check", "--config", "test.toml").returncode, 0)
        result = self.call("--check")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertNotIn("note: ", result.stdout)  # or notes are not read any more

    def test_command_line_mistakes_and_help(self):
        for arguments in (["--confg", "x"], ["--log-level", "loud"], ["stray"], ["--config"],
                          ["--config", ""], ["--config="], ["--check", "--config", ""]):
            self.assertEqual(self.call(*arguments).returncode, 2, arguments)
        self.assertIn("--config", self.call("--help").stdout)
        self.assertRegex(self.call("--version").stdout, r"^pheromoned \d+\.\d+\.\d+\n$")

    def test_the_default_serves_a_pty_and_sigterm_ends_it_cleanly(self):
        with self.start() as server:
            server.await_log("ready: 1 of 1 links up")
            port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
            self.assertEqual(ask(port, PING, len(ECHO)), ECHO)
            self.assertEqual(server.stop(), 0)
            os.close(port)
            self.assertFalse(os.path.lexists(self.folder / "radio-a.pty"))
            self.assertIn("requests 1, answers 1", server.log)
            self.assertIn("state hash", server.log)
            self.assertTrue(server.log.endswith("stopped\n"))

    def test_sigint_ends_it_cleanly_too(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            self.assertEqual(server.stop(signal.SIGINT), 0)

    def test_two_stop_signals_close_together_are_one(self):
        for pause_s in (0, 0, 0.0005, 0.001, 0.002, 0.003, 0.005, 0.01, 0.02):
            with self.start("--config", "test.toml") as server:
                server.await_log("ready")
                server.process.send_signal(signal.SIGTERM)
                time.sleep(pause_s)
                self.assertEqual(server.stop(), 0, pause_s)
                self.assertIn("state hash", server.log)
                self.assertTrue(server.log.endswith("stopped\n"), server.log)
                self.assertFalse(os.path.lexists(self.folder / "radio-a.pty"))

    def test_a_later_stop_signal_ends_a_stop_that_is_stuck(self):
        reading, writing = os.pipe()  # nobody reads the log, and it is full
        with subprocess.Popen([PHEROMONED, "--config", "test.toml"], cwd=self.folder,
                              stderr=writing) as process:
            self.addCleanup(os.close, reading)
            log = b""
            while b"ready" not in log:
                log += os.read(reading, 4096)
            os.set_blocking(writing, False)
            with self.assertRaises(BlockingIOError):
                while True:
                    os.write(writing, b"x")
            os.set_blocking(writing, True)
            os.close(writing)
            process.send_signal(signal.SIGTERM)
            deadline = time.monotonic() + PATIENCE_S
            while process.poll() is None and time.monotonic() < deadline:
                time.sleep(1.1)
                process.send_signal(signal.SIGTERM)
            process.kill()
            self.assertEqual(process.wait(), 128 + signal.SIGTERM)

    def test_two_robots_under_one_id_are_warned_of_and_in_the_summary(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
            for nonce in (1, 2, 1):
                os.write(port, frame(3, 0x71, bytes([nonce, 0, 1, 0])))
            trouble = "ID conflicts (two robots under one ID) 1\n"
            server.await_log("so far: " + trouble)
            self.assertEqual(server.stop(), 0)
            self.assertEqual(server.log.count("so far"), 1)
            self.assertEqual(server.log.count(trouble), 2)
            os.close(port)

    def test_a_stop_with_clients_connected_and_talking(self):
        self.config.write_text(CONFIG + '[[link]]\nname = "t"\nkind = "tcp"\n'
                               'listen = "127.0.0.1:0"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            address = server.log.split("up, tcp ")[1].split()[0].split(":")
            clients = [socket.create_connection((address[0], int(address[1]))) for _ in range(5)]
            for client in clients:
                self.assertEqual(ask(client.fileno(), PING, len(ECHO)), ECHO)
                client.sendall(PING * 100 + PING[:5])
            self.assertEqual(server.stop(), 0)
            for client in clients:
                client.close()

    def test_a_port_that_does_not_exist_does_not_stop_the_others(self):
        self.config.write_text(CONFIG + PTY + '[[link]]\nname = "radio-b"\nkind = "serial"\n'
                               'port = "/dev/ttyNONE7"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("ready: 1 of 2 links up")
            self.assertIn("link radio-b: down, /dev/ttyNONE7: No such file or directory; "
                          "retrying", server.log)
            port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
            self.assertEqual(ask(port, PING, len(ECHO)), ECHO)
            os.close(port)
            self.assertEqual(server.stop(), 0)

    def test_a_serial_port_serves_and_survives_being_unplugged(self):
        if not SHIM:
            self.skipTest("no --shim to let libserialport open a pseudo-terminal")
        self.config.write_text(CONFIG + '[[link]]\nname = "radio-b"\nkind = "serial"\n'
                               'port = "./modem"\nresponse_window_ms = 255\n')

        def plug_in():
            master, slave = os.openpty()
            tty.setraw(slave)
            os.symlink(os.ttyname(slave), self.folder / "modem")
            os.close(slave)
            return master

        # The sanitizers want to be loaded first, and say so unless told not to.
        options = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
        master = plug_in()
        with self.start("--config", "test.toml", LD_PRELOAD=SHIM, ASAN_OPTIONS=options) as server:
            server.await_log("ready: 1 of 1 links up")
            self.assertEqual(ask(master, PING, len(ECHO)), ECHO)
            os.unlink(self.folder / "modem")
            os.close(master)
            server.await_log("the other side hung up; retrying")
            master = plug_in()
            server.await_log("link radio-b: up, serial ./modem at 9600 baud", 2)
            self.assertEqual(ask(master, PING, len(ECHO)), ECHO)
            self.assertEqual(server.stop(), 0)
            self.assertIn("opened 2 times", server.log)
        os.close(master)

    def test_a_required_port_that_does_not_exist_ends_the_start(self):
        self.config.write_text(CONFIG + PTY + '[[link]]\nname = "radio-b"\nkind = "serial"\n'
                               'port = "/dev/ttyNONE7"\nrequired = true\n')
        with self.start("--config", "test.toml") as server:
            self.assertEqual(server.end(), 1)
            self.assertIn("link radio-b is required but could not be opened: /dev/ttyNONE7: No "
                          "such "
                          "file or directory", server.log)
        self.assertFalse(os.path.lexists(self.folder / "radio-a.pty"))

    def test_sighup_reads_the_configuration_again(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            self.config.write_text(CONFIG.replace("tau_s = 30.0", "tau_s = 5") + PTY)
            server.process.send_signal(signal.SIGHUP)
            server.await_log("configuration reread")
            self.assertIn("loses one quantum every 5 s", server.log)
            self.assertNotIn("require a restart", server.log)

            self.config.write_text(CONFIG + PTY.replace("radio-a.pty", "other.pty")
                                   + "[daemon]\nio_threads = 3\n")
            server.process.send_signal(signal.SIGHUP)
            server.await_log("configuration reread", 2)
            self.assertIn("changed links require a restart", server.log)
            self.assertIn("changed [daemon], [control] or [web] settings require a restart",
                          server.log)
            self.assertEqual(server.stop(), 0)

    def test_sighup_with_a_bad_file_changes_nothing(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            self.config.write_text(CONFIG.replace("tau_s = 30.0", "tau_s = -1") + PTY)
            server.process.send_signal(signal.SIGHUP)
            server.await_log("test.toml:12:9: pheromone[1].tau_s")
            self.config.write_text(CONFIG.replace("cell_m = 0.1", "cell_m = 0.2") + PTY)
            server.process.send_signal(signal.SIGHUP)
            server.await_log("the configuration is unchanged", 2)
            port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
            self.assertEqual(ask(port, PING, len(ECHO)), ECHO)
            os.close(port)
            self.assertEqual(server.stop(), 0)

    def smells(self, robot):
        """The intensities at many positions, by type."""
        return {(kind, x, y): robot.sense(kind, x, y, 0)
                for kind in (1, 2) for x in range(500, 9500, 450) for y in (800, 1000, 5000)}

    def test_the_dashboard_of_a_folder_is_served_instead_of_the_built_in_one(self):
        (self.folder / "page").mkdir()
        (self.folder / "page/index.html").write_text("mine")
        self.config.write_text(CONFIG + PTY + '[web]\nlisten = "127.0.0.1:0"\n')
        with self.start("--config", "test.toml", "--web-root", "page") as server:
            server.await_log("web: http")
            address = re.search(r"web: (http://[^/]+/)", server.log)[1]
            with urllib.request.urlopen(address, timeout=PATIENCE_S) as page:
                self.assertEqual(page.read(), b"mine")
            self.assertEqual(server.stop(), 0)

    def start_to_save(self, *arguments):
        """A server whose trails last for longer than any test, and a robot."""
        slow = CONFIG.replace("tau_s = 30.0", "tau_s = 3000")
        never = slow[slow.index("[[pheromone]]"):].replace("type = 1", "type = 2")
        self.config.write_text(slow + never.replace('"trail"', '"path"')
                               .replace("tau_s = 3000", "tau_s = 0") + PTY)
        server = self.start("--config", "test.toml", *arguments)
        server.await_log("ready")
        robot = Client(open_terminal(self.folder / "radio-a.pty"), 7, timeout=PATIENCE_S)
        robot.hello(1)
        return server, robot

    def test_a_field_saved_at_the_end_gives_the_same_answers_when_it_is_loaded(self):
        server, robot = self.start_to_save("--save-field", "lab.field")
        with server, robot.line:
            for i in range(40):
                robot.deposit(1 + i % 2, 600 + 200 * i, 900 + 10 * i, 1 + i % 2)
            before = self.smells(robot)
            self.assertFalse((self.folder / "lab.field").exists())
            self.assertEqual(server.stop(), 0)
            self.assertIn(f"field saved to {self.folder}/lab.field: 40 nodes", server.log)
        nodes = [line.split(",") for line in (self.folder / "lab.field").read_text().splitlines()
                 if line[0] != "#"]
        self.assertEqual(sorted((int(kind), int(column), int(row), int(level))
                                for kind, column, row, level in nodes),
                         sorted((1 + i % 2, 6 + 2 * i, (950 + 10 * i) // 100, 64 * (1 + i % 2))
                                for i in range(40)))
        self.assertGreater(len(set(before.values())), 20)
        server, robot = self.start_to_save("--load-field", "lab.field", "--save-field", "lab.field")
        with server, robot.line:
            self.assertEqual(self.smells(robot), before)
            self.assertIn("initial raster of type 2: 20 nodes", server.log)
            # A configuration that is read again leaves on the map what was loaded.
            self.config.write_text(self.config.read_text().replace("tau_s = 3000", "tau_s = 4000"))
            server.process.send_signal(signal.SIGHUP)
            server.await_log("configuration reread")
            self.assertEqual(self.smells(robot), before)
            whole = self.config.read_text()
            self.config.write_text(whole[:whole.rindex("[[pheromone]]")] + PTY)
            server.process.send_signal(signal.SIGHUP)
            server.await_log("the configuration is unchanged:\n"
                             f"the field loaded from {self.folder}/lab.field has pheromone "
                             "type 2, which is no longer configured")
            self.assertEqual(self.smells(robot), before)
            self.assertEqual(server.stop(), 0)
            self.assertIn(f"field saved to {self.folder}/lab.field: 40 nodes", server.log)

    def test_sigusr1_saves_the_field_while_robots_are_served(self):
        server, robot = self.start_to_save("--save-field", "lab.field")
        with server, robot.line:
            robot.deposit(2, 1000, 1000, 2)
            before = self.smells(robot)
            server.process.send_signal(signal.SIGUSR1)
            server.await_log(f"field saved to {self.folder}/lab.field: 1 nodes")
            saved = (self.folder / "lab.field").read_text()
            self.assertIn("\n2,10,10,128\n", saved)
            robot.deposit(2, 2000, 1000, 1)
            server.process.send_signal(signal.SIGUSR1)
            server.await_log(f"field saved to {self.folder}/lab.field: 2 nodes")
            self.assertIn("\n2,10,10,128\n2,20,10,64\n",
                          (self.folder / "lab.field").read_text())
            server.process.kill()  # even then, what was saved is there
        (self.folder / "lab.field").write_text(saved)
        server, robot = self.start_to_save("--load-field", "lab.field")
        with server, robot.line:
            self.assertEqual(self.smells(robot), before)
            server.process.send_signal(signal.SIGUSR1)
            server.await_log("SIGUSR1 ignored: the server was started without --save-field")
            self.assertEqual(server.stop(), 0)
        self.assertEqual((self.folder / "lab.field").read_text(), saved)

    def test_a_save_counts_the_time_since_the_last_event(self):
        self.config.write_text(CONFIG.replace("tau_s = 30.0", "tau_s = 0.05") + PTY)
        with self.start("--config", "test.toml", "--save-field", "lab.field") as server:
            server.await_log("ready")
            with open_terminal(self.folder / "radio-a.pty") as line:
                robot = Client(line, 7, timeout=PATIENCE_S)
                robot.hello(1)
                robot.deposit(1, 1000, 1000, 2)
            saves = 0
            while f"field saved to {self.folder}/lab.field: 0 nodes" not in server.log:
                server.process.send_signal(signal.SIGUSR1)
                saves += 1
                server.await_log("field saved", saves)
            self.assertEqual(server.stop(), 0)

    def test_a_file_that_does_not_fit_ends_the_start_with_words(self):
        server, robot = self.start_to_save("--save-field", "lab.field")
        with server, robot.line:
            robot.deposit(2, 1000, 1000, 2)
            self.assertEqual(server.stop(), 0)
        saved = (self.folder / "lab.field").read_bytes()
        load = ("--config", "test.toml", "--load-field", "lab.field")
        self.assertEqual(self.call(*load, "--check").returncode, 0)
        self.config.write_text(CONFIG + PTY)
        for arguments in (load, (*load, "--check")):
            result = self.call(*arguments)
            self.assertEqual((result.returncode, result.stderr),
                             (2, f"{self.folder}/lab.field does not match the configuration: "
                              "pheromone type 2 (\"path\") is not configured\n"))
        (self.folder / "lab.field").write_bytes(saved[:-1])
        result = self.call(*load)
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, r"^\S+/lab\.field:7:25: found the end of the file, "
                                        r"expected "
                         "a whole line: the file is truncated\n$")
        result = self.call("--load-field", "none.field")
        self.assertEqual((result.returncode, result.stderr),
                         (2, f"{self.folder}/none.field: cannot be opened: No such file or "
                              "directory\n"))
        self.assertEqual(self.call("--load-field", "").returncode, 2)

    def test_where_nothing_can_be_saved_is_told_at_the_start(self):
        for path, why in (("none/lab.field", "No such file"), (".", "is a folder"),
                          ("/dev/null", "is not a regular file")):
            result = self.call("--save-field", path)
            self.assertEqual(result.returncode, 2)
            self.assertIn(f"{os.path.normpath(self.folder / path)}: ", result.stderr)
            self.assertIn(why, result.stderr)

    def test_a_field_that_cannot_be_saved_at_the_end_shows_in_the_exit_status(self):
        (self.folder / "kept").mkdir()
        server, robot = self.start_to_save("--save-field", "kept/lab.field")
        with server, robot.line:
            (self.folder / "kept").rmdir()
            self.assertEqual(server.stop(), 1)
            self.assertIn(f"the field was not saved: {self.folder}/kept/lab.field", server.log)
            self.assertTrue(server.log.endswith("stopped\n"), server.log)

    def test_a_start_that_fails_leaves_what_was_saved(self):
        (self.folder / "lab.field").write_text("of yesterday")
        self.config.write_text(CONFIG + '[[link]]\nname = "radio-b"\nkind = "serial"\n'
                               'port = "/dev/ttyNONE7"\nrequired = true\n')
        with self.start("--config", "test.toml", "--save-field", "lab.field") as server:
            self.assertEqual(server.end(), 1)
        self.assertEqual((self.folder / "lab.field").read_text(), "of yesterday")

    def test_the_journal_gets_no_time_of_ours(self):
        with self.start("--config", "test.toml", JOURNAL_STREAM="8:1") as server:
            server.await_log("ready")
            self.assertTrue(server.log.startswith("info: pheromoned "), server.log)
            self.assertEqual(server.stop(), 0)

    def token(self, mode):
        """A configuration whose token is in a file of that mode."""
        token = self.folder / "token"
        token.write_text("0123456789abcdef")
        token.chmod(mode)
        self.config.write_text(CONFIG + PTY + '[web]\ntoken_file = "token"\n')

    def test_a_token_that_everyone_can_read_is_warned_of_in_the_log(self):
        for mode, warned in ((0o644, True), (0o640, False)):
            self.token(mode)
            with self.start("--config", "test.toml") as server:
                server.await_log("ready")
                self.assertEqual(server.stop(), 0)
                self.assertEqual("token is readable by all users" in server.log, warned)

    def test_a_token_that_the_server_cannot_read_is_told_with_the_user(self):
        self.token(0o000)
        self.folder.chmod(0o755)
        other = {"user": 65534, "extra_groups": []} if os.geteuid() == 0 else {}
        result = subprocess.run([PHEROMONED, "--config", "test.toml"], cwd=self.folder, text=True,
                                capture_output=True, check=False, **other)
        user = pwd.getpwuid(other.get("user", os.geteuid())).pw_name
        self.assertEqual(result.returncode, 2)
        self.assertIn("web.token_file: ", result.stderr)
        self.assertIn(f"Permission denied for the user {user}, as which the server runs; give the "
                      "file to that user's group (chgrp) with mode 0640", result.stderr)

    def test_a_token_is_made_where_there_is_none_and_kept(self):
        token = self.folder / "web-token"
        configuration = self.call("--default-config").stdout.replace("127.0.0.1:8377", "127.0.0.1:0")
        self.config.write_text(configuration)
        self.assertIn(f"changes require the token in {token}, to be created\n",
                      self.call("--check", "--config", "test.toml").stdout)
        self.assertFalse(token.exists())
        made = []
        for _ in range(2):
            with self.start("--config", "test.toml") as server:
                server.await_log("ready")
                made.append(token.read_text())
                port = int(re.search(r"web: http://127.0.0.1:(\d+)/, changes require the token in "
                                     + re.escape(str(token)) + "\n", server.log)[1])
                self.assertEqual(self.unlock(port, made[0].strip()), 200)
                self.assertEqual(self.unlock(port, "0" * 32), 401)
                self.assertEqual(f"web: made a token, {token}\n" in server.log, len(made) == 1)
                self.assertEqual(server.stop(), 0)
        self.assertRegex(made[0], "^[0-9a-f]{32}\n$")
        self.assertEqual(made[1], made[0])
        self.assertEqual(token.stat().st_mode & 0o777, 0o600)

    def unlock(self, port, token):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
        connection.request("POST", "/api/v1/unlock", "{}", {"Authorization": "Bearer " + token})
        status = connection.getresponse().status
        connection.close()
        return status

    def test_without_a_token_the_log_says_how_to_get_one(self):
        self.config.write_text(CONFIG + PTY + '[web]\nlisten = "127.0.0.1:0"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("/, read-only; with token_file in [web] the server makes a token for "
                             "changes\n")
            self.assertEqual(server.stop(), 0)

    def test_where_no_token_can_be_made_robots_are_served_all_the_same(self):
        (self.folder / "web-token").symlink_to("/nonexistent/token")
        self.config.write_text(CONFIG + PTY
                               + '[web]\nlisten = "127.0.0.1:0"\ntoken_file = "web-token"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("ready: 1 of 1 links up")
            self.assertIn(
                "web-token: cannot be created: File exists; until somebody writes a token there, "
                "such as by `openssl rand -hex 32`, nothing can be changed over the network\n",
                server.log)
            self.assertRegex(server.log, r"web: http://127.0.0.1:\d+/, read-only\n")
            self.assertEqual(server.stop(), 0)

    def test_a_token_that_cannot_be_written_leaves_no_file_that_stops_the_next_start(self):
        self.config.write_text(CONFIG + PTY
                               + '[web]\nlisten = "127.0.0.1:0"\ntoken_file = "web-token"\n')
        no_file_takes_a_byte = ["sh", "-c", "trap '' XFSZ; ulimit -f 0; exec \"$@\"", "sh"]
        with self.start("--config", "test.toml", before=no_file_takes_a_byte) as server:
            server.await_log("web-token: cannot be created: File too large; until somebody")
            server.await_log("ready: 1 of 1 links up")
            self.assertEqual(server.stop(), 0)
        self.assertFalse((self.folder / "web-token").exists())

    def test_a_control_socket_that_somebody_removes_comes_back(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            path = self.folder / "pheromoned.sock"
            path.unlink()
            server.await_log("control: pheromoned.sock: lost, nobody can connect; trying to "
                             "listen again\n")
            server.await_log("control: pheromoned.sock: listening again\n")
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control:
                control.connect(str(path))
                control.sendall(b"GET /healthz HTTP/1.0\r\nHost: localhost\r\n\r\n")
                self.assertEqual(control.recv(64).split()[1], b"200")
            self.assertEqual(server.stop(), 0)
            self.assertFalse(path.exists())

    def test_log_level_silences(self):
        with self.start("--config", "test.toml", "--log-level", "warn") as server:
            deadline = time.monotonic() + PATIENCE_S
            while not os.path.lexists(self.folder / "radio-a.pty"):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.01)
            self.assertEqual(server.stop(), 0)
            self.assertEqual(server.log, "")


def main():
    global PHEROMONED, SHIM
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pheromoned", required=True)
    parser.add_argument("--shim", default="")
    arguments, rest = parser.parse_known_args()
    PHEROMONED = str(pathlib.Path(arguments.pheromoned).resolve())
    SHIM = str(pathlib.Path(arguments.shim).resolve()) if arguments.shim else ""
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
