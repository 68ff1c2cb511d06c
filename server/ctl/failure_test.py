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

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "server/daemon"))
import daemon_test  # noqa: E402

BIN = pathlib.Path()
PATIENCE_S = 60


class Folder(unittest.TestCase):
    """A folder with a configuration, an array and a recording, and perhaps a server."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        (self.folder / "test.toml").write_text(
            daemon_test.CONFIG + daemon_test.PTY + '[journal]\nfolder = "state"\n')
        self.good("map", "export", "a.npy")

    def serve(self):
        server = daemon_test.Running(self.folder, "--config", "test.toml")
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


def main():
    global BIN
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    daemon_test.PHEROMONED = BIN / "pheromoned"
    unittest.main()


if __name__ == "__main__":
    main()
