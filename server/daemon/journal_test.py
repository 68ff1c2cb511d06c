#!/usr/bin/env python3
"""pheromoned with a journal, from outside: what it was told survives its end, however it ended.

    journal_test.py --pheromoned build/release/bin/pheromoned
"""

import argparse
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

import running_daemon
from running_daemon import CONFIG, PATIENCE_S, PTY, Running, ask, frame

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto_tests"))
from stranger.client import Client, open_terminal  # noqa: E402

PERMANENT = CONFIG.replace("tau_s = 30.0", "tau_s = 0")
JOURNAL = '[journal]\nfolder = "state"\n'
TRACE = frame(7, 0x31, b"\x05" + (5000).to_bytes(2, "little") * 2 + b"\x00\x00")


class OverSocket(http.client.HTTPConnection):
    """HTTP over the control socket."""

    def __init__(self, path):
        super().__init__("localhost", timeout=PATIENCE_S)
        self.path = str(path)

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.settimeout(PATIENCE_S)
        self.sock.connect(self.path)


class JournalTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)
        self.config = self.folder / "test.toml"
        self.config.write_text(PERMANENT + PTY + JOURNAL)

    def start(self, **environment):
        server = Running(self.folder, "--config", "test.toml", **environment)
        self.addCleanup(server.__exit__)
        server.await_log("ready")
        return server

    def robot(self):
        return Client(open_terminal(self.folder / "radio-a.pty"), 7, timeout=PATIENCE_S)

    def smells(self, robot):
        return {(x, y): robot.sense(1, x, y, 0)
                for x in range(4500, 5600, 100) for y in range(4500, 5600, 100)}

    def test_an_orderly_end_keeps_all(self):
        self.end_and_find_all(signal.SIGTERM)

    def test_a_killed_server_keeps_what_it_acknowledged(self):
        self.end_and_find_all(signal.SIGKILL)

    def end_and_find_all(self, number):
        server = self.start()
        server.await_log(f"journal: {self.folder}/state is new")
        robot = self.robot()
        epoch = robot.hello(1).epoch
        for i in range(40):
            robot.deposit(1, 5000 + 20 * i, 5000 + 7 * i)
        before = self.smells(robot)
        self.assertGreater(len(set(before.values())), 10)
        server.stop(number)
        again = self.start()
        again.await_log(f"journal: {self.folder}/state resumed after sequence 42")
        after = self.robot()
        self.assertEqual(self.smells(after), before)
        self.assertEqual(after.hello(1).epoch, epoch)
        self.assertEqual(again.stop(), 0)

    def test_a_robot_goes_on_without_noticing_and_its_repeat_is_answered_as_before(self):
        server = self.start()
        robot = self.robot()
        robot.hello(1)
        port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
        first = ask(port, TRACE, 13)
        os.close(port)
        server.stop(signal.SIGKILL)
        again = self.start()
        port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
        self.assertEqual(ask(port, TRACE, len(first)), first)
        os.close(port)
        self.assertEqual(again.stop(), 0)
        self.assertIn("1 repeated", again.log)

    def ask(self, method, target, body=None):
        connection = OverSocket(self.folder / "pheromoned.sock")
        self.addCleanup(connection.close)
        connection.request(method, target, body)
        answer = connection.getresponse()
        return answer.status, json.loads(answer.read())

    def test_a_snapshot_that_is_asked_for_is_there_and_named(self):
        server = self.start()
        server.await_log("control: ")
        robot = self.robot()
        robot.hello(1)
        robot.deposit(1, 5000, 5000)
        before = self.ask("GET", "/api/v1/status?hash=1")[1]
        status, made = self.ask("POST", "/api/v1/snapshot", "{}")
        self.assertEqual((status, made["done"]), (200, True), made)
        snapshot = pathlib.Path(made["snapshot"])
        self.assertEqual(snapshot.parent, self.folder / "state")
        self.assertGreater(snapshot.stat().st_size, 0)
        server.stop(signal.SIGKILL)
        again = self.start()
        again.await_log("control: ")
        after = self.ask("GET", "/api/v1/status?hash=1")[1]
        self.assertEqual((after["sequence"], after["state_hash"]),
                         (before["sequence"], before["state_hash"]))
        self.assertEqual(again.stop(), 0)

    def test_edits_are_undone_and_redone_after_restarts(self):
        server = self.start()
        server.await_log("control: ")
        robot = self.robot()
        robot.hello(1)
        for i in range(5):
            robot.deposit(1, 5000 + 100 * i, 5000)
        before = self.smells(robot)
        status, made = self.ask("POST", "/api/v1/erase",
                                '{"pheromone": 1, "area_m": [4.5, 4.5, 5.2, 5.5]}')
        self.assertEqual((status, made["changed"]), (200, 3), made)
        erased = self.smells(robot)
        self.assertNotEqual(erased, before)
        server.stop(signal.SIGKILL)  # the journal has the edit
        server = self.start()
        server.await_log("control: ")
        status, undone = self.ask("POST", "/api/v1/undo", "{}")
        self.assertEqual((status, undone["edit"], undone["changed"]), (200, made["edit"], 3))
        self.assertEqual(self.smells(self.robot()), before)  # on a new terminal
        self.assertEqual(self.ask("POST", "/api/v1/snapshot", "{}")[0], 200)
        server.stop(signal.SIGKILL)  # the snapshot has what was undone
        server = self.start()
        server.await_log("control: ")
        robot = self.robot()
        self.assertEqual(self.ask("POST", "/api/v1/redo", "{}")[0], 200)
        self.assertEqual(self.smells(robot), erased)
        self.assertEqual(self.ask("POST", "/api/v1/undo", "{}")[0], 200)
        self.assertEqual(self.smells(robot), before)
        status, nothing = self.ask("POST", "/api/v1/undo", "{}")
        self.assertEqual((status, nothing["error"]["what"]), (409, "nothing to undo"))
        self.assertEqual(server.stop(), 0)

    def test_two_servers_cannot_share_a_folder(self):
        server = self.start()
        second = subprocess.run([running_daemon.PHEROMONED, "--config", "test.toml"], cwd=self.folder,
                                text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(second.returncode, 1)
        self.assertIn(f"journal: {self.folder}/state: in use by another server", second.stderr)
        self.assertEqual(server.stop(), 0)

    def test_another_law_is_followed_and_another_geometry_refused(self):
        server = self.start()
        robot = self.robot()
        robot.hello(1)
        robot.deposit(1, 5000, 5000)
        self.assertEqual(server.stop(), 0)
        text = self.config.read_text()
        self.config.write_text(text.replace("tau_s = 0", "tau_s = 3000"))
        server = self.start()
        self.assertEqual(server.stop(), 0)
        self.config.write_text(text.replace("cell_m = 0.1", "cell_m = 0.2"))
        refused = subprocess.run([running_daemon.PHEROMONED, "--config", "test.toml"],
                                 cwd=self.folder, text=True, capture_output=True,
                                 timeout=PATIENCE_S, check=False)
        self.assertEqual(refused.returncode, 2)
        extent = "the map: x from 0 to 10 m, y from 0 to 10 m, cells of"
        self.assertIn(f"the state is of {extent} 0.1 m; the configuration has {extent} 0.2 m\n",
                      refused.stderr)
        self.assertIn("pheromonectl journal resample --config FILE", refused.stderr)
        self.assertIn(f"the state in {self.folder}/state is unchanged", refused.stderr)
        self.config.write_text(text)
        self.assertEqual(self.start().stop(), 0)

    def test_without_a_folder_the_log_says_that_nothing_is_kept(self):
        for text, environment in ((PERMANENT + PTY, {}),
                                  (PERMANENT + PTY + '[journal]\ndurability = "none"\n',
                                   {"STATE_DIRECTORY": str(self.folder)})):
            self.config.write_text(text)
            server = self.start(**environment)
            self.assertIn("journal: none; the state is lost when this process ends", server.log)
            self.assertEqual(server.stop(), 0)
            self.assertFalse((self.folder / "journal").exists())

    def test_systemd_s_state_directory_is_used_by_itself(self):
        self.config.write_text(PERMANENT + PTY)
        server = self.start(STATE_DIRECTORY=f"{self.folder}:/elsewhere")
        self.assertEqual(server.stop(), 0)
        self.assertTrue((self.folder / "journal" / "00000001.segment").exists())

    def test_what_is_kept_begins_at_systemd_s_state_directory_and_not_where_the_server_runs(self):
        kept, runs = self.folder / "kept", self.folder / "runs"
        kept.mkdir()
        runs.mkdir()
        self.config.write_text(PERMANENT + PTY + JOURNAL + "[capture]\nstart = true\n")
        service = {"STATE_DIRECTORY": str(kept), "RUNTIME_DIRECTORY": str(runs)}
        saved = []
        for arguments in (("--save-field",), ("--load-field",)):
            server = Running(runs, "--config", "../test.toml", *arguments, "lab.field", **service)
            self.addCleanup(server.__exit__)
            server.await_log("ready")
            self.assertIn(f"recording into {kept}/captures", server.log)
            self.assertNotIn("systemd removes", server.log)
            self.assertEqual(server.stop(), 0)
            saved.append((kept / "lab.field").read_bytes())
        self.assertEqual(saved[0], saved[1])
        self.assertIn(f"journal: {kept}/state resumed", server.log)
        self.assertEqual(sorted(path.name for path in kept.iterdir()),
                         ["captures", "lab.field", "state"])
        self.assertEqual(list(runs.iterdir()), [])

    def test_a_folder_that_systemd_empties_is_warned_of(self):
        self.config.write_text(PERMANENT + PTY + f'[journal]\nfolder = "{self.folder}/state"\n')
        server = self.start(RUNTIME_DIRECTORY=str(self.folder))
        self.assertIn(f"{self.folder}/state: is in {self.folder}, which systemd removes when the "
                      "service stops", server.log)
        self.assertEqual(server.stop(), 0)

    def test_a_folder_outside_of_what_a_service_may_write_to_is_told_with_the_way_out(self):
        kept, closed = self.folder / "kept", self.folder / "closed"
        for folder, mode in ((kept, 0o777), (closed, 0o555), (self.folder, 0o777)):
            folder.mkdir(exist_ok=True)
            folder.chmod(mode)
        other = {"user": 65534, "extra_groups": []} if os.geteuid() == 0 else {}
        for text, path in ((f'[journal]\nfolder = "{closed}/state"\n', closed / "state"),
                           (f'[capture]\nfolder = "{closed}"\nstart = true\n', closed)):
            self.config.write_text(PERMANENT + PTY + text)
            result = subprocess.run(
                [running_daemon.PHEROMONED, "--config", "test.toml"], cwd=self.folder, text=True,
                capture_output=True, timeout=PATIENCE_S, check=False,
                env={"STATE_DIRECTORY": str(kept)}, **other)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(f"{closed}: Permission denied, expected a writable folder; "
                          f"as a service, the server may only write to {kept}; to permit more, "
                          f"add ReadWritePaths={path} in a drop-in (systemctl edit)", result.stderr)

    def test_relaxed_says_what_it_risks_and_a_kill_begins_an_epoch(self):
        self.config.write_text(PERMANENT + PTY + JOURNAL + 'durability = "relaxed"\nsync_s = 60\n')
        server = self.start()
        self.assertIn("a crash may lose up to 60000 ms of acknowledged changes", server.log)
        epoch = self.robot().hello(1).epoch
        self.assertEqual(server.stop(), 0)
        server = self.start()
        self.assertEqual(self.robot().hello(1).epoch, epoch)
        server.stop(signal.SIGKILL)
        server = self.start()
        self.assertIn("a new epoch begins", server.log)
        self.assertNotEqual(self.robot().hello(1).epoch, epoch)
        self.assertEqual(server.stop(), 0)

    def test_a_start_that_fails_after_the_journal_was_opened_closes_it_in_order(self):
        text = PERMANENT + PTY + JOURNAL + 'durability = "relaxed"\nsync_s = 60\n'
        self.config.write_text(text)
        server = self.start()
        epoch = self.robot().hello(1).epoch
        self.assertEqual(server.stop(), 0)
        (self.folder / "file").touch()
        self.config.write_text(text + '[capture]\nstart = true\nfolder = "file"\n')
        refused = Running(self.folder, "--config", "test.toml")
        self.addCleanup(refused.__exit__)
        self.assertEqual(refused.end(), 2)
        self.assertIn("cannot record", refused.log)
        self.config.write_text(text)
        server = self.start()
        self.assertEqual(self.robot().hello(1).epoch, epoch)
        self.assertEqual(server.stop(), 0)

    def test_damage_is_told_with_its_byte_and_kept(self):
        server = self.start()
        robot = self.robot()
        epoch = robot.hello(1).epoch
        for i in range(20):
            robot.deposit(1, 5000 + 20 * i, 5000)
        server.stop(signal.SIGKILL)
        segment = self.folder / "state" / "00000001.segment"
        whole = segment.read_bytes()
        damaged = bytearray(whole)
        damaged[len(whole) // 2] ^= 1
        segment.write_bytes(damaged)
        server = self.start()
        told = re.search(r"damaged: \S+/state/00000001.segment: byte (\d+): ", server.log)
        self.assertLessEqual(int(told[1]), len(whole) // 2)
        self.assertNotEqual(self.robot().hello(1).epoch, epoch)
        self.assertEqual(server.stop(), 0)
        self.assertEqual((self.folder / "state" / "00000001.segment.damaged").read_bytes(),
                         damaged)

    def test_pheromone_evaporates_while_the_server_is_down_unless_told_otherwise(self):
        # A start whose clock says that an hour has passed would need a clock of its own; the
        # other direction shows by itself: with the key, field time goes on where it was.
        self.config.write_text(PERMANENT + PTY + JOURNAL + "evaporate_while_down = false\n")
        self.assertEqual(self.start().stop(), 0)
        server = self.start()
        self.assertIn(", 0 s of field time later", server.log)
        self.assertEqual(server.stop(), 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pheromoned", required=True)
    arguments, rest = parser.parse_known_args()
    running_daemon.PHEROMONED = str(pathlib.Path(arguments.pheromoned).resolve())
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
