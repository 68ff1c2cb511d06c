#!/usr/bin/env python3
"""pheromonectl journal: what it says of a journal that pheromoned has written, in use and damaged.

Usage: journal_test.py BIN_DIR
"""

import csv
import io
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "server/daemon"), str(ROOT / "proto_tests")]
import running_daemon  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402

BIN = pathlib.Path()
DEPOSITS = [(5000 + 10 * i, 4000 - 5 * i) for i in range(12)]


class JournalTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)
        (self.folder / "test.toml").write_text(
            running_daemon.CONFIG.replace("tau_s = 30.0", "tau_s = 0") + running_daemon.PTY
            + '[journal]\nfolder = "state"\n')
        self.server = running_daemon.Running(self.folder, "--config", "test.toml")
        self.addCleanup(self.server.__exit__)
        self.server.await_log("ready")
        robot = Client(open_terminal(self.folder / "radio-a.pty"), 7, timeout=30)
        robot.hello(1)
        for x, y in DEPOSITS:
            robot.deposit(1, x, y)

    def call(self, *arguments, status=0):
        result = subprocess.run([BIN / "pheromonectl", "journal", *arguments], cwd=self.folder,
                                text=True, capture_output=True, check=False, timeout=60)
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return result

    def test_a_folder_in_use_is_exported(self):
        rows = list(csv.DictReader(io.StringIO(self.call("export", "state").stdout)))
        deposits = [row for row in rows if row["event"] == "deposit"]
        self.assertEqual([(int(row["x"]), int(row["y"])) for row in deposits], DEPOSITS)
        self.assertEqual({row["robot"] for row in deposits}, {"7"})
        self.assertEqual([int(row["sequence"]) for row in rows], list(range(1, len(rows) + 1)))
        self.assertEqual([row["event"] for row in rows[:2]], ["configuration", "hello"])
        lines = self.call("export", "--format", "jsonl", "state").stdout.splitlines()
        self.assertEqual(len(lines), len(rows))
        for line, row in zip(lines, rows):
            told = {key: str(value) for key, value in json.loads(line).items()}
            self.assertEqual(told, {key: value for key, value in row.items() if value != ""})

    def test_check_tells_the_state_and_its_hash(self):
        self.server.stop(signal.SIGTERM)
        state_hash = re.search(r"state hash ([0-9a-f]{16})", self.server.log)[1]
        told = self.call("check", "state").stdout
        self.assertIn(f"hash {state_hash}, from the beginning\n", told)
        self.assertTrue(told.endswith("no acknowledged change is missing: the log was closed in "
                                      "an orderly way\n"))

    def test_check_tells_what_a_log_that_was_not_closed_cannot_show(self):
        self.server.stop(signal.SIGKILL)
        told = self.call("check", "state").stdout
        self.assertRegex(told, r"durable: sequence \d+ was durable at \d{4}-\d\d-\d\dT")
        self.assertRegex(told, r"no acknowledged change up to sequence \d+ is missing; the log "
                               r"was not closed in an orderly way")

    def test_check_finds_an_end_that_was_cut_off_between_two_records(self):
        self.server.stop(signal.SIGTERM)
        places = [line.split()[:2] for line in self.call("dump", "state").stdout.splitlines()]
        name, byte = places[len(places) // 2]
        os.truncate(self.folder / "state" / name, int(byte))
        told = self.call("check", "state", status=4).stdout
        self.assertRegex(told, r"damaged: state/durable: byte \d+: the log ends at sequence \d+, "
                               r"but "
                               r"\d+ was durable at \S+: a segment or the end of one is")

    def test_check_reads_a_segment_with_a_huge_sparse_tail_in_little_memory(self):
        self.server.stop(signal.SIGKILL)
        segment = self.folder / "state" / "00000001.segment"
        size = segment.stat().st_size
        os.truncate(segment, size + (1 << 30))
        with tempfile.TemporaryFile("w+") as told:
            check = subprocess.Popen([BIN / "pheromonectl", "journal", "check", "state"],
                                     cwd=self.folder, stdout=told, stderr=subprocess.STDOUT)
            _, status, usage = os.wait4(check.pid, 0)
            check.returncode = os.waitstatus_to_exitcode(status)
            told.seek(0)
            text = told.read()
        self.assertEqual(check.returncode, 0, text)
        self.assertIn(f"byte {size}: record checksum mismatch", text)
        self.assertLess(usage.ru_maxrss, 512 << 10, "KiB of memory")

    def test_check_names_a_folder_in_the_place_of_a_segment(self):
        self.server.stop(signal.SIGTERM)
        (self.folder / "state" / "00000009.segment").mkdir()
        told = self.call("check", "state", status=4).stdout
        self.assertIn("damaged: state/00000009.segment: byte 0: is a folder, a link or a device, "
                      "expected a regular file", told)

    def test_dump_names_every_record_with_its_byte(self):
        self.server.stop(signal.SIGTERM)
        lines = self.call("dump", "state").stdout.splitlines()
        self.assertEqual(lines[0], "00000001.segment 0 segment first=1")
        self.assertTrue(lines[1].startswith("00000001.segment 36 group durable=0"))
        self.assertRegex(lines[-1], r"^00000001.segment \d+ end sequence=")
        self.assertEqual(sum(" deposit " in line for line in lines), len(DEPOSITS))

    def test_damage_is_told_with_its_byte_and_status_4(self):
        self.server.stop(signal.SIGTERM)
        lines = self.call("dump", "state").stdout.splitlines()
        byte = int(next(line for line in lines if " deposit " in line).split()[1])
        segment = self.folder / "state" / "00000001.segment"
        damaged = bytearray(segment.read_bytes())
        damaged[byte + 20] ^= 1
        segment.write_bytes(damaged)
        told = self.call("check", "state", status=4).stdout
        self.assertIn(f"damaged: state/00000001.segment: byte {byte}: record checksum mismatch",
                      told)
        export = self.call("export", "state", status=4)
        self.assertEqual(len(export.stdout.splitlines()), 3)
        self.assertIn(f"00000001.segment: byte {byte}: ", export.stderr)
        self.assertIn(f"00000001.segment: byte {byte}: ", self.call("dump", "state", status=4).stderr)
        self.assertEqual(segment.read_bytes(), damaged)

    def test_a_journal_without_its_beginning_is_damaged(self):
        self.server.stop(signal.SIGTERM)
        with running_daemon.Running(self.folder, "--config", "test.toml") as server:
            server.await_log("ready")
            self.assertEqual(server.stop(signal.SIGTERM), 0)
        self.assertGreater(len(self.call("export", "state").stdout.splitlines()), len(DEPOSITS))
        for snapshot in (self.folder / "state").glob("*.snapshot"):
            snapshot.unlink()
        segment = self.folder / "state" / "00000001.segment"
        data = segment.read_bytes()
        segment.write_bytes(b"p" + data[1:])
        told = "00000001.segment: byte 0: is not a segment"
        self.assertIn(told, self.call("export", "state", status=4).stderr)
        self.assertIn(told, self.call("dump", "state", status=4).stderr)
        replay = subprocess.run([BIN / "pheromonectl", "net", "replay", "state"], cwd=self.folder,
                                text=True, capture_output=True, check=False, timeout=60)
        self.assertEqual(replay.returncode, 4, replay)
        self.assertIn(told, replay.stderr)
        segment.unlink()
        self.assertIn("00000002.segment: byte 0: the sequence jumps from 0 to ",
                      self.call("export", "state", status=4).stderr)

    def field_of(self, config):
        """What lies on the map at a start with this configuration: sorted (column, row, level)."""
        with running_daemon.Running(self.folder, "--config", config, "--save-field",
                                 str(self.folder / "saved.field")) as server:
            server.await_log("ready")
            self.assertEqual(server.stop(signal.SIGTERM), 0)
        return sorted(tuple(int(it) for it in line.split(",")[1:])
                      for line in (self.folder / "saved.field").read_text().splitlines()
                      if not line.startswith("#"))

    def test_a_state_is_moved_to_the_map_of_another_configuration(self):
        text = (self.folder / "test.toml").read_text()
        path = """[[path]]
pheromone = "trail"
shape = "polyline"
points_m = [[1.0, 1.0], [1.0, 1.0]]
intensity = 0.125
"""
        text = text.replace("[[link]]", path + "[[link]]", 1)
        (self.folder / "test.toml").write_text(text)
        (self.folder / "fine.toml").write_text(text.replace("cell_m = 0.1", "cell_m = 0.05"))
        refused = self.call("resample", "--config", "fine.toml", "state", status=1)
        self.assertIn("in use by another server", refused.stderr)
        self.server.stop(signal.SIGTERM)
        coarse = self.field_of("test.toml")
        self.assertIn((10, 10, 64), coarse)
        self.assertGreater(len(coarse), 2)
        with running_daemon.Running(self.folder, "--config", "fine.toml") as server:
            self.assertEqual(server.end(), 2)
            self.assertIn("pheromonectl journal resample", server.log)
        told = self.call("resample", "--config", "fine.toml", "state").stdout
        self.assertIn(f"state: {len(coarse) - 1} nodes with pheromone, 0 dropped off the map", told)
        self.assertEqual(self.field_of("fine.toml"),
                         [(2 * column, 2 * row, level) for column, row, level in coarse])
        with running_daemon.Running(self.folder, "--config", "fine.toml") as server:
            server.await_log("ready")
            undone = subprocess.run([BIN / "pheromonectl", "--socket", "pheromoned.sock", "undo"],
                                    cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(undone.stderr, "pheromonectl: nothing to undo\n")
            self.assertEqual(server.stop(signal.SIGTERM), 0)
        again = self.call("resample", "--config", "test.toml", "state", status=1)
        self.assertIn("state.before: already exists", again.stderr)
        for folder in ("state.before", "state"):
            self.assertIn("\nno acknowledged change ", self.call("check", folder).stdout)

    def test_a_state_that_has_left_its_cluster_is_moved_with_what_it_left(self):
        self.server.stop(signal.SIGTERM)
        membership = self.folder / "state" / "cluster"
        head = "pheromone journal of a cluster, version 1\n"
        membership.write_text(head + "cluster lab\nid 8f2c60aa91d2b7e3\nend\n")
        text = (self.folder / "test.toml").read_text()
        (self.folder / "fine.toml").write_text(text.replace("cell_m = 0.1", "cell_m = 0.05"))
        refused = self.call("resample", "--config", "fine.toml", "state", status=1)
        self.assertIn("state: belongs to a cluster", refused.stderr)
        left = head + "new_epoch 1\nfield_less_utc_ms -1700000000000\nend\n"
        membership.write_text(left)
        self.call("resample", "--config", "fine.toml", "state")
        self.assertEqual(membership.read_text(), left)

    def test_what_is_no_journal_is_said(self):
        self.assertIn("state/x: cannot be opened", self.call("check", "state/x", status=1).stderr)
        (self.folder / "empty").mkdir()
        for command in ("check", "dump", "export"):
            self.assertEqual(self.call(command, "empty", status=1).stderr,
                             "pheromonectl: empty: contains no journal\n")
        self.call("check", status=2)
        self.call("export", "--format", "xml", "state", status=2)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    running_daemon.PHEROMONED = str(BIN / "pheromoned")
    unittest.main()
