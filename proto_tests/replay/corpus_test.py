#!/usr/bin/env python3
"""Each capture of the corpus is replayed, and its answers are compared.

Usage: corpus_test.py BIN_DIR
"""

import pathlib
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from stranger import wire  # noqa: E402

BIN = pathlib.Path()


def replay(*arguments):
    return subprocess.run([BIN / "pheromonectl", "replay", *arguments], text=True,
                          capture_output=True, timeout=60, check=False)


class CorpusTest(unittest.TestCase):
    def test_there_is_a_corpus(self):
        captures = {it.stem for it in HERE.glob("*.pcapng")}
        self.assertGreaterEqual(len(captures), 8)
        self.assertEqual(captures, {it.stem for it in HERE.glob("*.answers")})

    def test_all_messages_of_tags_are_answered_and_refused(self):
        answered, reasons = set(), set()
        for line in (HERE / "tags.answers").read_text(encoding="ascii").splitlines():
            if line.startswith("#"):
                continue
            [body] = wire.Decoder().feed(bytes.fromhex(line.split()[2]))
            message = wire.parse(body)
            answered.add(message.name)
            reasons.add(wire.REASONS[message.fields["reason"]] if message.name == "ERROR" else "")
        self.assertLessEqual({"SCAN_ANSWER", "READ_ANSWER", "WRITE_ANSWER", "ERASE_ANSWER",
                              "SYMBOL_ANSWER", "RESOLVE_ANSWER"}, answered)
        self.assertLessEqual({"no tag in range", "tag protected", "tag full", "generation changed",
                              "unknown symbol", "bad value", "not permitted", "sequence reused"},
                             reasons)

    def test_every_answer_is_the_one_that_was_written_to_the_robots(self):
        result = replay(*sorted(HERE.glob("*.pcapng")))
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_every_answer_is_the_one_that_is_written_down(self):
        for capture in sorted(HERE.glob("*.pcapng")):
            with self.subTest(capture.stem):
                expected = capture.with_suffix(".answers").read_text(encoding="ascii")
                lines = [it for it in expected.splitlines() if not it.startswith("#")]
                self.assertGreaterEqual(len(lines), 10)
                self.assertEqual(replay("--answers", capture).stdout.splitlines(), lines)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv[1]).resolve()
    unittest.main(argv=sys.argv[:1], verbosity=2)
