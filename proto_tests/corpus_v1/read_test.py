#!/usr/bin/env python3
"""Files of version 1 of all formats can be read, with the same state hashes.

    read_test.py BIN_DIR
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
BIN = pathlib.Path()


def ctl(*arguments):
    return subprocess.run([BIN / "pheromonectl", *arguments], text=True, capture_output=True,
                          timeout=120, check=False)


def expected():
    """Name to sequence and hash, as recorded when the files were made."""
    lines = (HERE / "expected.txt").read_text(encoding="ascii").splitlines()
    return {name: rest for name, *rest in (it.split() for it in lines if not it.startswith("#"))}


class FirstVersionTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.journal = pathlib.Path(temporary.name) / "journal"
        shutil.copytree(HERE / "journal", self.journal)

    def check_state(self, beginning):
        sequence, state_hash = expected()["journal"]
        result = ctl("journal", "check", self.journal)
        self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)
        self.assertRegex(result.stdout, rf"state: sequence {sequence}, .* hash {state_hash}, "
                                        f"from {beginning}\n")

    def test_the_journal_gives_the_state_that_it_had(self):
        newest = max(it.name for it in self.journal.glob("*.snapshot"))
        self.check_state(newest)

    def test_so_do_the_events_since_the_older_snapshot(self):
        oldest, newest = sorted(self.journal.glob("*.snapshot"))
        newest.unlink()
        self.check_state(oldest.name)

    def test_each_snapshot_has_its_state(self):
        said = ctl("journal", "check", self.journal).stdout
        names = {it.name for it in self.journal.glob("*.snapshot")}
        self.assertEqual(names, {it for it in expected() if it.endswith(".snapshot")})
        for name in names:
            self.assertIn(f"{name}: state hash {expected()[name][1]}\n", said)

    def test_every_kind_of_event_is_among_them(self):
        result = ctl("journal", "export", "--format", "jsonl", self.journal)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        kinds = set(re.findall(r'"event":"(\w+)', result.stdout))
        self.assertEqual(kinds, {"advance", "command", "configuration", "deposit", "edit_add",
                                 "edit_erase", "hello", "observed", "report", "trace"})

    def test_the_recording_is_replayed_to_the_byte(self):
        result = ctl("replay", HERE / "recording.pcapng")
        self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)
        self.assertIn(f"state hash {expected()['recording'][1]}\n", result.stdout)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
