#!/usr/bin/env python3
"""pheromonectl and pheromoned when what they print is not taken, and when files are not what they
should be.

    failure_test.py BIN_DIR
"""

import os
import pathlib
import pty
import select
import signal
import subprocess
import sys
import tempfile
import termios
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "server/daemon"))
import running_daemon  # noqa: E402

BIN = pathlib.Path()
PATIENCE_S = 60


class Folder(unittest.TestCase):
    """A folder with a configuration, an array and a recording, and perhaps a server."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        (self.folder / "test.toml").write_text(
            running_daemon.CONFIG + running_daemon.PTY + '[journal]\nfolder = "state"\n')
        self.good("map", "export", "a.npy")

    def serve(self):
        server = running_daemon.Running(self.folder, "--config", "test.toml")
        self.addCleanup(server.__exit__)
        server.await_log("control: ")
        return server

    def run_tool(self, *arguments, program="pheromonectl", **kwargs):
        return subprocess.run([BIN / program, *(str(it) for it in arguments)], cwd=self.folder,
                              text=True, check=False, timeout=PATIENCE_S,
                              stdin=subprocess.DEVNULL,
                              **{"stderr": subprocess.PIPE, "stdout": subprocess.PIPE, **kwargs})

    def good(self, *arguments, **kwargs):
        result = self.run_tool(*arguments, **kwargs)
        self.assertEqual((result.returncode, result.stderr), (0, ""), arguments)
        return result.stdout

    def record(self):
        self.good("capture", "start")
        self.good("capture", "stop")
        return next((self.folder / "captures").iterdir())


class OutputTest(Folder):
    def not_taken(self, *arguments, program="pheromonectl"):
        with self.subTest(arguments=arguments, program=program), open("/dev/full", "wb") as full:
            result = self.run_tool(*arguments, program=program, stdout=full)
            self.assertEqual((result.returncode, result.stderr),
                             (1, f"{program}: standard output cannot be written: "
                                 "No space left on device\n"))

    def test_what_asks_a_server_does_not_end_well_on_a_full_device(self):
        self.serve()
        for words in ("status", "status --hash", "status --json", "links", "clients", "laws",
                      "sense trail 1 1", "config show", "version", "watch --once", "watch",
                      "deposit trail 1 1", "paint trail 1 1", "erase trail --all", "halt",
                      "reload", "snapshot", "capture start", "capture status", "capture stop",
                      "replay --help"):
            self.not_taken(*words.split())

    def test_what_needs_no_server_does_not_end_well_on_a_full_device(self):
        server = self.serve()
        recording = self.record()
        self.assertEqual(server.stop(), 0)
        for words in ("--version", "--help", "map info --help", "config check test.toml",
                      "journal check state", "journal dump state", "journal export state",
                      "map draw a.png", "map export b.npy", "map convert a.npy a.csv",
                      "map info a.npy", f"replay {recording}"):
            self.not_taken(*words.split())

    def test_the_server_does_not_end_well_on_a_full_device(self):
        for words in ("--check", "--check --config test.toml", "--default-config", "--version",
                      "--help"):
            self.not_taken(*words.split(), program="pheromoned")

    def test_a_damaged_journal_stays_one_on_a_full_device(self):
        self.assertEqual(self.serve().stop(), 0)
        segment = self.folder / "state" / "00000001.segment"
        data = bytearray(segment.read_bytes())
        data[len(data) // 2] ^= 1
        segment.write_bytes(data)
        with open("/dev/full", "wb") as full:
            self.assertEqual(self.run_tool("journal", "check", "state", stdout=full).returncode, 4)

    def test_a_reader_that_goes_away_ends_it_without_a_word(self):
        self.serve()
        for words in ("laws", "status --json", "journal export state", "watch", "map draw a.png"):
            with self.subTest(words):
                reading, writing = os.pipe()
                os.close(reading)
                result = self.run_tool(*words.split(), stdout=writing)
                os.close(writing)
                self.assertEqual((result.returncode, result.stderr), (-signal.SIGPIPE, ""))

    def test_watch_gives_the_keyboard_back_when_its_reader_goes_away(self):
        self.serve()
        keyboard, theirs = pty.openpty()
        self.addCleanup(os.close, keyboard)
        self.addCleanup(os.close, theirs)
        before = termios.tcgetattr(theirs)
        reading, writing = os.pipe()
        watch = subprocess.Popen([BIN / "pheromonectl", "watch"], cwd=self.folder, stdin=theirs,
                                 stdout=writing, stderr=subprocess.PIPE)
        os.close(writing)
        self.assertTrue(select.select([reading], [], [], PATIENCE_S)[0])
        os.close(reading)
        self.assertEqual(watch.communicate(timeout=PATIENCE_S)[1], b"")
        self.assertEqual(watch.returncode, -signal.SIGPIPE)
        self.assertEqual(termios.tcgetattr(theirs), before)


class NumbersTest(Folder):
    def test_a_number_that_is_none_is_told_with_what_was_expected(self):
        far = "a number from -1000000 to 1000000"
        for words, key, expected in (
                ("paint trail 1 1 --radius {}", "--radius", "a number from 0 to 1000"),
                ("erase trail 1 1 --radius {}", "--radius", "a number from 0 to 1000"),
                ("paint trail 1 {}", "POINTS", far), ("erase trail 1 1 {} 2", "POINTS", far),
                ("paint trail --area 0 0 {} 1", "--area", far),
                ("paint trail 1 1 --units {}", "--units", "a number from 0 to 1000000000"),
                ("deposit trail {} 1", "X", far), ("deposit trail 1 {}", "Y", far),
                ("deposit trail 1 1 --quanta {}", "--quanta", "a whole number from 1 to 65535"),
                ("sense trail {} 1", "X", far), ("sense trail 1 {}", "Y", far),
                ("sense trail 1 1 {}", "HEADING", "a number from -360 to 360"),
                ("watch --columns {}", "--columns", "a whole number from 20 to 1000"),
                ("command a {} halt", "ID", "a whole number from 1 to 254"),
                ("map draw --area 0 {} 1 1 x.png", "--area", far),
                ("map draw --pixels-per-cell {} x.png", "--pixels-per-cell",
                 "a whole number from 1 to 1000"),
                ("map convert --white {} a.npy x.png", "--white",
                 "a number from 1e-12 to 1000000000000"),
                ("map convert --cell {} a.npy x.yaml", "--cell", "a number from 1e-06 to 1000000"),
                ("replay --to x --speed {} x", "--speed", "a number from 0 to 1000000")):
            for value in ("nan", "inf", "1e400", "1m"):
                with self.subTest(words=words, value=value):
                    result = self.run_tool(*words.format(value).split())
                    self.assertEqual((result.returncode, result.stdout), (2, ""))
                    self.assertEqual(result.stderr.splitlines()[0],
                                     f'pheromonectl: {key}: found "{value}", expected {expected}')
        self.assertFalse((self.folder / "x.png").exists())


class FilesTest(Folder):
    def refused(self, status, words, *arguments):
        with self.subTest(arguments=arguments):
            result = self.run_tool(*arguments)
            self.assertEqual((result.returncode, result.stdout), (status, ""), result.stderr)
            # What is wrong in a configuration is told as pheromoned --check does.
            self.assertEqual(result.stderr.startswith("pheromonectl: "),
                             arguments[0] != "config", result.stderr)
            self.assertIn(words, result.stderr)

    def test_a_file_that_is_not_there_is_told_in_one_line(self):
        told = "/nope: cannot be opened: No such file or directory\n"
        for words in ("replay /nope", "replay --answers /nope", "replay --to a.pty /nope",
                      "map info /nope", "journal check /nope", "journal dump /nope",
                      "journal export /nope", "journal resample --config test.toml /nope",
                      "map draw --field /nope x.png", "map export --field /nope x.npy",
                      "map resample --config test.toml /nope x"):
            self.refused(1, told, *words.split())
        for ending in ("png", "pgm", "npy", "csv", "yaml"):
            for words in ("map info /nope.{}", "map convert /nope.{} x.csv"):
                self.refused(1, f"/nope.{ending}: cannot be opened: No such file or directory\n",
                             *words.format(ending).split())
        for words in ("config check /nope", "map draw --config /nope x.png",
                      "map export --config /nope x.npy", "map resample --config /nope a b",
                      "journal resample --config /nope state"):
            self.refused(2, told, *words.split())

    def test_a_folder_in_the_place_of_a_file_is_told_in_one_line(self):
        told = "folder: cannot be read: Is a directory\n"
        (self.folder / "folder").mkdir()
        for words in ("replay folder", "replay --answers folder", "replay --to a.pty folder",
                      "map info folder", "map draw --field folder x.png",
                      "map resample --config test.toml folder x"):
            self.refused(1, told, *words.split())
        for words in ("config check folder", "map draw --config folder x.png"):
            self.refused(2, told, *words.split())
        for words in ("journal check folder", "journal dump folder", "journal export folder",
                      "journal resample --config test.toml folder"):
            self.refused(1, "folder: contains no journal\n", *words.split())
        for command, out in (("draw", "x.png"), ("export", "x.npy")):
            (self.folder / out).mkdir()
            self.refused(1, f"{out}: cannot be written: Is a directory\n", "map", command, out)

    def test_an_empty_file_is_told_in_one_line(self):
        (self.folder / "empty").touch()
        for words in ("replay empty", "replay --answers empty", "replay --to a.pty empty"):
            self.refused(1, "empty: block 1, at byte 0: the file is empty\n", *words.split())
        self.refused(1, "empty:1:1: found the end of the file", "map", "info", "empty")
        for words in ("journal check empty", "journal dump empty", "journal export empty"):
            self.refused(1, "empty: cannot be opened: Not a directory\n", *words.split())
        self.refused(2, "empty:1:1: map.width_m: missing", "config", "check", "empty")
        for ending in ("png", "pgm", "npy", "csv", "yaml"):
            (self.folder / f"empty.{ending}").touch()
            self.refused(1, f"empty.{ending}:", "map", "info", f"empty.{ending}")

    def test_a_device_is_neither_read_nor_replaced(self):
        self.refused(1, "/dev/null: is not a regular file\n", "map", "info", "/dev/null")
        self.refused(2, "/dev/null: is not a regular file\n", "config", "check", "/dev/null")
        (self.folder / "device.png").symlink_to("/dev/full")
        self.refused(1, "device.png: cannot be written: is not a regular file\n", "map", "draw",
                     "device.png")

    def test_a_socket_that_is_none_is_no_server(self):
        (self.folder / "empty").touch()
        for path in ("/nope", "empty", str(self.folder)):
            self.refused(3, f"no server at {path}: ", "--socket", path, "status")


def main():
    global BIN
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    running_daemon.PHEROMONED = BIN / "pheromoned"
    unittest.main()


if __name__ == "__main__":
    main()
