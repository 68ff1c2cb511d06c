#!/usr/bin/env python3
"""pheromone-swarm lab: sweeps that are killed and resumed, plug-ins that are compiled apart.

    lab_test.py BIN_DIR
"""

import pathlib
import shlex
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parent.parent
EXAMPLES = SOURCE / "client_fw" / "lab" / "examples"
BIN = pathlib.Path()
SWEEP = """
[sweep]
seeds = 3
"robots.count" = [10, 20]
"run.duration_s" = [5, 10]
"""
PLUGIN = """#include "client_fw/lab/behaviour_abi.h"
int NAME(const struct PheromoneView* view, const struct PheromoneActions* actions, size_t first,
         size_t count) {
  (void)view;
  (void)first;
  (void)count;
  (void)actions;
  BODY
  return 0;
}
"""


class LabTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def run_lab(self, *arguments, status=0):
        result = subprocess.run([BIN / "pheromone-swarm", "lab", *arguments], cwd=self.folder,
                                text=True, capture_output=True, timeout=120, check=False)
        self.assertEqual(result.returncode, status, result.stderr)
        return result.stdout if status == 0 else result.stderr

    def compile(self, source, to):
        subprocess.run(["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC",
                        "-I", SOURCE, "-o", self.folder / to, source, "-lm"], check=True)

    def compile_text(self, name, body):
        source = self.folder / "plugin.c"
        source.write_text(PLUGIN.replace("NAME", name).replace("BODY", body), encoding="utf-8")
        self.compile(source, "flee.so")

    def commands(self, summary):
        scenario = (EXAMPLES / "ants.toml").read_text(encoding="utf-8")
        (self.folder / "ants.toml").write_text(scenario[:scenario.index("[sweep]")] + SWEEP,
                                               encoding="utf-8")
        lines = self.run_lab("list", "ants.toml", "--summary", summary).splitlines()
        self.assertEqual(len(lines), 12)
        return [[BIN / words[0], *words[1:]] for words in map(shlex.split, lines)]

    def run_all(self, commands):
        for command in commands:
            subprocess.run(command, cwd=self.folder, stdout=subprocess.DEVNULL, timeout=120,
                           check=True)

    def test_a_sweep_that_was_killed_and_resumed_has_each_row_once(self):
        self.run_all(self.commands("whole.csv"))
        commands = self.commands("resumed.csv")
        begun = [subprocess.Popen(command, cwd=self.folder, stdout=subprocess.DEVNULL)
                 for command in commands[:7]]
        begun[0].wait(120)
        for process in begun:  # wherever they are
            process.kill()
            process.wait()
        self.run_all(reversed(commands))  # with those that were finished, as without a job log
        whole = (self.folder / "whole.csv").read_text(encoding="utf-8").splitlines()
        resumed = (self.folder / "resumed.csv").read_text(encoding="utf-8").splitlines()
        self.assertEqual(whole[0], resumed[0])
        self.assertEqual(len(whole), 13)
        self.assertEqual(sorted(whole), sorted(resumed))
        self.assertEqual(len({line.split(",")[-1] for line in whole[1:]}), 12)  # hashes

    def test_threads_do_not_change_a_row(self):
        for threads in ("1", "2"):
            self.run_lab("run", EXAMPLES / "ants.toml", "--set", "run.duration_s=10", "--set",
                         "robots.count=600", "--threads", threads, "--summary", "threads.csv")
        lines = (self.folder / "threads.csv").read_text(encoding="utf-8").splitlines()
        self.assertEqual(len(lines), 2)

    def test_a_mistake_in_the_sweep_is_told_before_a_run_is_begun(self):
        text = (EXAMPLES / "ants.toml").read_text(encoding="utf-8")
        (self.folder / "ants.toml").write_text(text.replace("[25, 50, 100, 200]", "[25, -1]"),
                                               encoding="utf-8")
        self.assertIn("robots[1].count: found -1, expected a whole number from 1",
                      self.run_lab("list", "ants.toml", status=2))

    def test_the_example_of_a_plug_in_is_built_by_one_command_and_runs(self):
        (self.folder / "plugin.toml").write_bytes((EXAMPLES / "plugin" / "plugin.toml").read_bytes())
        self.compile(EXAMPLES / "plugin" / "flee.c", "flee.so")
        first = self.run_lab("run", "plugin.toml")
        measures = dict(line.split() for line in first.splitlines())
        self.assertLess(float(measures["standing_share"]), 0.5)
        self.assertEqual(float(measures["deposited_quanta"]), 20 * 600)
        self.assertNotEqual(first, self.run_lab(
            "run", "plugin.toml", "--set", "robots.parameters.speed_m_per_s=0.1"))

    def test_a_plug_in_that_cannot_be_meant_is_refused_by_name(self):
        (self.folder / "plugin.toml").write_bytes((EXAMPLES / "plugin" / "plugin.toml").read_bytes())
        self.assertIn("robots[1].plugin: flee.so: No such file",
                      self.run_lab("run", "plugin.toml", status=2))
        for name, body, told in (
                ("pheromone_behaviour_v2", "",
                 "flee.so: found pheromone_behaviour_v2, expected pheromone_behaviour_v1"),
                ("fly", "", "flee.so: found no behaviour, expected pheromone_behaviour_v1"),
                ("pheromone_behaviour_v1", "return 7;",
                 "flee.so: pheromone_behaviour_v1 returned 7 for the robots 1 to 20"),
                ("pheromone_behaviour_v1", "actions->right_m_s[4] = 0.0 / 0.0;",
                 'robot 5 (index 4) of "shy", step 0: right_m_s is '),
                ("pheromone_behaviour_v1", "actions->sense[19] = 2;",
                 'robot 20 (index 19) of "shy", step 0: sense is 2, expected 0 to 1')):
            with self.subTest(told):
                self.compile_text(name, body)
                self.assertIn(told, self.run_lab("run", "plugin.toml", status=1))


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop()).resolve()
    unittest.main()
