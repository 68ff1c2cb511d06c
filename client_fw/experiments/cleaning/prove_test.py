#!/usr/bin/env python3
"""`pheromone-experiments cleaning --prove` against a search that shares nothing with it: the same
verdicts and worst times of ten floors, the paper's own floor, a planted fault, and what ends a proof.

    prove_test.py PATH/pheromone-experiments
"""

import csv
import pathlib
import resource
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

import naive_floor

FOLDER = pathlib.Path(__file__).resolve().parent
PROVED, REFUTED, UNKNOWN, WRONG_FILE = 0, 1, 3, 2
RATES = [5, 10, 5, 8, 5, 3]


def toml(columns, rows, robots, time, more_robots="", soil=""):
    return (f"[floor]\ncolumns = {columns}\nrows = {rows}\nrates_percent = {RATES}\n"
            f"[robots]\ncount = {robots}\nclean_units = {time}\n{more_robots}\n[soil]\n{soil}\n")


# Where two robots may start anywhere, the naive search takes seconds for each floor.
TWO = "starts = [[1, 4], [3, 3]]"
TIGHT = "limit_percent = 41\nhorizon_units = 180"
TEN = {
    "2x3, 1 robot, 5": toml(2, 3, 1, 5),
    "2x3, 1 robot, 9": toml(2, 3, 1, 9, soil=TIGHT),
    "2x3, 1 robot, 16": toml(2, 3, 1, 16),
    "3x2, 1 robot, 7": toml(3, 2, 1, 7),
    "3x2, 1 robot, 12": toml(3, 2, 1, 12, soil="limit_percent = 61\nhorizon_units = 400"),
    "2x3, 2 robots, 6": toml(2, 3, 2, 6, TWO, "horizon_units = 120"),
    "2x3, 2 robots, 13": toml(2, 3, 2, 13, TWO, TIGHT),
    "3x2, 2 robots, 8": toml(3, 2, 2, 8, TWO, "step_units = 7\nhorizon_units = 100"),
    "3x2, 2 robots, 11": toml(3, 2, 2, 11, TWO, "clean_percent = 11"),
    "3x2, 2 robots, 16": toml(3, 2, 2, 16, TWO),
}
PROGRAM = None  # of the command line


class ProveTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def prove(self, text, *options, limit_bytes=resource.RLIM_INFINITY):
        """The exit status, the answers by query, and what was printed; of a program that may have so much memory."""
        path = self.folder / "floor.toml"
        path.write_text(text, encoding="utf-8")
        run = subprocess.run([PROGRAM, "cleaning", "--prove", path, "--out", self.folder, *options],
                             capture_output=True, text=True, check=False,
                             preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit_bytes, limit_bytes)))
        answers = {}
        if run.returncode in (PROVED, REFUTED, UNKNOWN):
            with open(self.folder / "cleaning-proof.csv", encoding="utf-8") as file:
                answers = {row["query"]: row for row in csv.DictReader(file)}
        return run.returncode, answers, run.stdout + run.stderr

    def test_ten_floors_have_the_verdicts_and_worst_times_of_a_naive_search(self):
        refuted = 0
        for name, text in TEN.items():
            status, answers, out = self.prove(text, "--query", "clean,bounded,forgotten,for-ever")
            naive = naive_floor.Search(naive_floor.Floor.parse(text))
            for query, (verdict, time) in (("clean", naive.clean()), ("bounded", naive.bounded()),
                                           ("forgotten", naive.forgotten()),
                                           ("for-ever", naive.for_ever())):
                with self.subTest(floor=name, query=query):
                    self.assertEqual(answers[query]["verdict"], verdict, out)
                    if time is not None:
                        self.assertEqual(answers[query]["units"], str(time), out)
                refuted += verdict == "refuted"
            is_good = all(row["verdict"] == "proved" for row in answers.values())
            self.assertEqual(status, PROVED if is_good else REFUTED)
        self.assertGreater(refuted, 3, "the floors are to tell a checker that proves everything")

    # The figures that client_fw/verify/README.md has of other programs.
    def test_the_papers_floor(self):
        text = (FOLDER / "floors/paper.toml").read_text(encoding="utf-8")
        status, answers, out = self.prove(text, "--query", "clean,bounded")
        self.assertEqual(status, PROVED, out)
        anywhere = text.replace("starts = [[6, 7]]\n", "")
        _, answers, out = self.prove(anywhere, "--query", "clean")
        self.assertEqual(answers["clean"]["units"], "101", out)
        later = text.replace("clean_units = 5", "clean_units = 8")
        status, answers, out = self.prove(later.replace("= 240", "= 360"), "--query", "bounded")
        self.assertEqual(status, REFUTED, out)
        self.assertTrue(300 <= int(answers["bounded"]["units"]) < 360, out)

    def test_a_planted_fault_gives_its_shortest_trace(self):
        text = toml(3, 2, 2, 5, 'policy = "claims-unconditionally"')
        status, answers, out = self.prove(text, "--query", "forgotten")
        self.assertEqual(status, REFUTED)
        self.assertEqual(answers["forgotten"]["verdict"], "refuted")
        self.assertEqual(naive_floor.Search(naive_floor.Floor.parse(text)).forgotten()[0], "refuted")
        # Two in one zone: both decide, both claim.
        self.assertRegex(out, r"0: A decides to clean zone (\d)\n0: B decides to clean zone \1\n"
                              r"0: . claims zone \1\n0: . claims zone \1\ntwo robots clean zone \1\n")
        drawn = xml.etree.ElementTree.parse(self.folder / "cleaning-trace-forgotten.svg").getroot()
        self.assertGreater(len(list(drawn.iter("{http://www.w3.org/2000/svg}rect"))), 6)

    def test_wandering_between_equals_forgets_a_zone_for_ever(self):
        status, _, out = self.prove(toml(3, 2, 1, 5, 'policy = "moves-between-equals"'), "--query",
                                    "forgotten")
        self.assertEqual(status, REFUTED)
        self.assertIn("for ever:\n", out)

    def test_memory_that_is_not_enough_is_no_verdict(self):
        text = (FOLDER / "floors/hall.toml").read_text(encoding="utf-8")
        status, answers, out = self.prove(text, "--query", "forgotten", "--memory-mib", "20")
        self.assertEqual(status, UNKNOWN)
        self.assertEqual(answers["forgotten"]["verdict"], "unknown")
        self.assertIn("used up 20 MiB", out)

    def test_a_floor_that_is_no_grid(self):
        zones = "".join(f"[[zone]]\nbeside = [{(i - 1) % 5 + 1}, {(i + 1) % 5 + 1}]\n" for i in range(5))
        status, answers, out = self.prove(zones + "[robots]\ncount = 1\nclean_units = 3\n")
        self.assertEqual(status, PROVED, out)
        # Round and round: four others are cleaned meanwhile, with a move before each and the own.
        self.assertEqual(answers["forgotten"]["units"], str(4 * (1 + 3) + 1), out)

    def test_options_of_the_simulation_are_refused_by_name(self):
        for option, value in (("--speed", "200"), ("--seed", "2"), ("--seconds", "60"), ("--slots", "4"),
                              ("--switch-off-s", "9"), ("--switched-off", "1"), ("--baud", "57600"),
                              ("--channels", "1"), ("--frame-loss-percent", "1"), ("--turnaround-ms", "2"),
                              ("--server-delay-ms", "2"), ("--period-ms", "100"), ("--robots", "1"),
                              ("--columns", "3"), ("--unit-s", "2"), ("--floor", "hall.toml")):
            with self.subTest(option):
                status, _, out = self.prove(toml(2, 2, 1, 5), option, value)
                self.assertEqual(status, WRONG_FILE, out)
                self.assertIn(option, out)
                self.assertIn("--prove", out)

    def test_five_robots_in_one_zone_use_no_more_than_their_memory(self):
        text = (f"[floor]\ncolumns = 6\nrows = 5\n[robots]\ncount = 5\nstarts = {[[8] * 5]}\nclean_units = [1, 250]\n"
                "move_units = [1, 250]\n")
        for query in ("clean", "bounded", "forgotten"):
            with self.subTest(query):
                status, answers, out = self.prove(text, "--query", query, "--memory-mib", "10",
                                                  limit_bytes=64 << 20)
                self.assertEqual(status, UNKNOWN, out)
                self.assertEqual(answers[query]["verdict"], "unknown")

    def test_what_is_wrong_in_a_file_is_said_with_its_line(self):
        status, _, out = self.prove("[floor]\ncolumns = 2\nrows = 2\nrates_percent = [1, 2, 3]\n"
                                    "[robots]\ncount = 2\nstarts = [[1, 5]]\n")
        self.assertEqual(status, WRONG_FILE)
        self.assertIn("floor.toml:4:17: floor.rates_percent: found 3 numbers, expected one for each of 4",
                      out)
        self.assertIn("floor.toml:7:15: robots.starts: ", out)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
