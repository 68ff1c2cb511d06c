#!/usr/bin/env python3
"""pheromonectl net: what it says of the bench and of what breaks it, and what it writes.

    net_test.py build/release/bin/pheromonectl

The numbers are those that deploy/examples/nets/README.md has from an independent model.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

NETS = pathlib.Path(__file__).resolve().parents[4] / "deploy" / "examples" / "nets"
BROKEN = NETS / "broken"
PHEROMONECTL = ""

# Two users of one resource. Reachable: idle idle, busy idle, idle busy.
MUTEX = """net = { name = "mutex" }
place = [
  { id = "free", tokens = 1 },
  { id = "idle_a", tokens = 1 }, { id = "busy_a" },
  { id = "idle_b", tokens = 1 }, { id = "busy_b" },
]
transition = [
  { id = "enter_a", takes = ["idle_a", "free"], gives = ["busy_a"] },
  { id = "leave_a", takes = ["busy_a"], gives = ["idle_a", "free"] },
  { id = "enter_b", takes = ["idle_b", "free"], gives = ["busy_b"] },
  { id = "leave_b", takes = ["busy_b"], gives = ["idle_b", "free"] },
]
"""


class NetTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "mutex.toml").write_text(MUTEX)

    def call(self, *arguments):
        return subprocess.run([PHEROMONECTL, "net", *(str(it) for it in arguments)],
                              cwd=self.folder, text=True, capture_output=True, check=False)

    def written(self, *arguments):
        result = self.call(*arguments)
        self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))

    def check(self, status, *arguments):
        """The report, with its properties by name."""
        result = self.call("check", "--json", *arguments)
        self.assertEqual((result.returncode, result.stderr), (status, ""), arguments)
        report = json.loads(result.stdout)
        report["properties"] = {it["id"]: it for it in report["properties"]}
        return report

    def refused(self, words, *arguments):
        """By one line, which says where."""
        result = self.call(*arguments)
        self.assertEqual((result.returncode, result.stdout), (2, ""), result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertIn(words, result.stderr)

    def test_the_bench_has_the_markings_of_an_independent_model(self):
        report = self.check(0, NETS / "motion.toml", "--set", "robots=2")
        self.assertEqual((report["net"], report["states"]),
                         ({"places": 71, "transitions": 53}, 179664))
        self.assertEqual((report["deadlock"], report["safe"], report["method"]),
                         (False, False, "exhaustive"))
        self.assertGreater(report["transitions"], report["states"])
        self.assertGreater(report["seconds"], 0)
        self.assertGreater(report["bytes_per_state"], 4)
        verdicts = {name: it["verdict"] for name, it in report["properties"].items()}
        self.assertEqual([name for name, it in verdicts.items() if it != "proved"], ["safe"])
        self.assertIn("Semaphore1.S2_overtaken_once", verdicts)
        self.assertEqual(report["bounds"]["nest"], 2)

    def test_exclusion_is_proved_for_any_number_of_robots(self):
        claims = {}
        for robots in (1, 3):
            report = self.check(0, NETS / "motion.toml", "--reduce", "--set", f"robots={robots}")
            claims[robots] = [report["properties"][name] for name in
                              ("one_robot_at_P", "one_robot_at_source", "right_to_P")]
            self.assertEqual(report["method"], "reduced")
        self.assertEqual(claims[1], claims[3])
        for claim in claims[1]:
            self.assertEqual((claim["verdict"], claim["method"]), ("proved", "structural"))
        self.assertIn("Semaphore2.Free", claims[1][0]["because"])

    def test_robots_with_names_are_safe(self):
        report = self.check(0, NETS / "identity.toml", "--reduce", "--set", "robots=2")
        self.assertEqual((report["safe"], report["deadlock"]), (True, False))

    def test_what_breaks_the_bench_is_refuted_by_a_shortest_trace(self):
        def trace(name, report):
            claim = report["properties"][name]
            self.assertEqual((claim["verdict"], claim["shortest"]), ("refuted", True))
            return claim["trace"]

        report = self.check(1, BROKEN / "red_by_timer.toml")
        self.assertTrue(report["deadlock"])
        self.assertEqual(trace("deadlock-free", report),
                         ["N1.arrive", "N1.present", "N1.sense", "Semaphore2.WriteGreenN1",
                          "N1.timer"])
        some = ("--states", 300000)
        report = self.check(1, BROKEN / "stale_green.toml", *some)
        self.assertEqual(len(trace("one_robot_at_P", report)), 8)
        self.assertEqual((report["method"], report["deadlock"]), ("partial", None))
        report = self.check(1, BROKEN / "green_before_busy.toml", *some)
        self.assertEqual(len(trace("one_robot_at_P", report)), 11)
        report = self.check(1, BROKEN / "stop_in_area.toml", "--set", "robots=1")
        self.assertEqual(len(trace("deadlock-free", report)), 7)

    def test_who_is_overtaken_without_a_bound_is_shown_the_cycle(self):
        report = self.check(1, BROKEN / "static_priority.toml", "--set", "robots=2", "--quick")
        claim = report["properties"]["Semaphore1.S2_overtaken_once"]
        self.assertEqual((claim["verdict"], claim["because"]), ("refuted", "without bound"))
        self.assertIn("Semaphore1.WriteGreenS1", claim["cycle"])
        self.assertNotIn("Semaphore1.WriteGreenS2", claim["cycle"])
        self.assertEqual(report["properties"]["N3_overtaken"]["verdict"], "proved")

    def test_finite_lanes_deadlock_only_where_a_trail_can_hold_all_robots(self):
        def deadlock(robots, *arguments):
            report = self.check(0, BROKEN / "finite_lanes.toml", "--reduce", "--quick",
                                "--no-claims", "--states", 300000, "--set", f"robots={robots}",
                                *arguments)
            self.assertEqual(report["method"], "reduced")
            return report["deadlock"]

        self.assertTrue(deadlock(6))
        self.assertFalse(deadlock(5))

    def test_claims_of_the_command_line_decide_the_exit_status(self):
        names = [f"--claim {i}" for i in range(1, 4)]
        report = self.check(0, "mutex.toml", "--claim", "never busy_a + busy_b > 1", "--claim",
                            "reachable busy_b = 1", "--claim", "live enter_a enter_b")
        self.assertEqual([report["properties"][it]["verdict"] for it in names], 3 * ["proved"])
        self.assertEqual((report["states"], report["transitions"]), (3, 4))
        self.assertEqual(report["properties"]["--claim 2"]["trace"], ["enter_b"])
        report = self.check(1, "mutex.toml", "--claim", "always free = 1")
        self.assertEqual(report["properties"]["--claim 1"]["verdict"], "refuted")
        report = self.check(1, "mutex.toml", "--claim",
                            "overtaken at most 3 by enter_a while idle_b = 1")
        self.assertEqual(report["properties"]["--claim 1"]["because"], "without bound")
        self.assertEqual(self.check(1, "mutex.toml", "--states", 1, "--claim", "reversible")
                         ["properties"]["--claim 1"]["verdict"], "unknown")
        # What nobody claims does not matter, nor what is left out.
        self.check(0, BROKEN / "red_by_timer.toml", "--no-claims")
        self.check(1, BROKEN / "red_by_timer.toml", "--no-claims", "--claim", "deadlock-free")

    def test_people_read_the_same(self):
        result = self.call("check", "mutex.toml", "--claim", "always free = 1")
        self.assertEqual((result.returncode, result.stderr), (1, ""))
        text = re.sub(r", [0-9.e-]+ s, [0-9.e+]+ bytes a state", "", result.stdout)
        self.assertEqual(text.splitlines()[:2],
                         ["mutex: 5 places, 4 transitions", "3 states, 4 edges; exhaustive"])
        self.assertIn("refuted  --claim 1: always free = 1 (exhaustive)\n"
                      "    shortest trace, 1 step: enter_a\n", text)
        self.assertIn("  free + busy_a + busy_b = 1\n", text)
        self.assertEqual(text.splitlines()[-1], "1 of 1 claim refuted: --claim 1; " + self.ALL_WELL)

    ALL_WELL = "bounded, safe, deadlock-free, quasi-live, live, reversible"

    def last_line(self, status, *arguments):
        result = self.call("check", *arguments)
        self.assertEqual((result.returncode, result.stderr), (status, ""), arguments)
        lines = result.stdout.splitlines()
        self.assertLessEqual(max(len(line) for line in lines), 100)
        summary = self.check(status, *arguments)["summary"]
        self.assertTrue(summary.replace(" ", "").endswith(lines[-1].replace(" ", "")), lines[-1])
        return summary

    def test_it_ends_with_a_sentence_that_fits_the_exit_status(self):
        self.assertEqual(self.last_line(0, "mutex.toml"), "no claims; " + self.ALL_WELL)
        self.assertEqual(self.last_line(0, "mutex.toml", "--claim", "always free <= 1"),
                         "the claim proved; " + self.ALL_WELL)
        claims = len(self.check(0, NETS / "motion.toml")["properties"]) - 6
        self.assertEqual(self.last_line(0, NETS / "motion.toml", "--set", "robots=2", "--reduce"),
                         f"all {claims} claims proved; not safe: place nest can have 2 tokens")
        self.assertTrue(self.last_line(1, BROKEN / "red_by_timer.toml").endswith(
            "; not deadlock-free: stuck after 5 steps; not live: read_A, read_B, store_A and 55 more; "
            "not reversible"))
        self.assertEqual(
            self.last_line(1, "mutex.toml", "--states", 1, "--claim", "reversible", "--claim",
                           "never free = 1"),
            "1 of 2 claims refuted: --claim 2; 1 of 2 claims unknown: --claim 1; bounded, safe; "
            "unknown: deadlock-free, quasi-live, live, reversible")

    def test_an_option_takes_one_value(self):
        for arguments in (("--set", "robots=1", NETS / "motion.toml"),
                          ("--claim", "reachable nest = 0", "--set", "robots=1", NETS / "motion.toml"),
                          ("--set", "robots=1", "--no-claims", NETS / "motion.toml")):
            self.check(0, *arguments)
        self.refused_at_the_command_line("check", "--set", "robots=1", "robots=2",
                                         NETS / "motion.toml")

    def test_arcs_with_the_same_id_are_warned_of(self):
        (self.folder / "woped.pnml").write_text(
            '<pnml><net id="n" type="http://www.pnml.org/version-2009/grammar/ptnet">'
            '<place id="p"/><transition id="t"/><arc id="a" source="p" target="t"/>'
            '<arc id="a" source="t" target="p"/></net></pnml>')
        result = self.call("check", "woped.pnml")
        self.assertEqual(result.returncode, 0)
        self.assertEqual(result.stderr, "pheromonectl: warning: woped.pnml: 1 arc has the ID of another "
                                        'element, such as "a": each is an arc of its own\n')

    def test_an_output_does_not_replace_the_net(self):
        robot = (NETS / "robot.toml").read_text()
        (self.folder / "robot.toml").write_text(robot)
        for command in ("draw", "tables", "export --format pnml", "export --format promela"):
            self.refused("robot.toml: the output is the input ./robot.toml, expected another name\n",
                         *command.split(), "--output", "robot.toml", "./robot.toml")
        self.assertEqual((self.folder / "robot.toml").read_text(), robot)

    def test_an_exported_net_has_the_same_counts(self):
        def counts(path, *arguments):
            report = self.check(0, path, *arguments)
            return [report[it] for it in ("states", "transitions", "components", "bounds", "net")]

        for name, *arguments in (("motion", "--set", "robots=1"), ("pheromone", "--set", "robots=1"),
                                 ("robot",)):
            self.written("export", NETS / f"{name}.toml", *arguments, "--format", "pnml",
                         "--output", "out.pnml")
            self.assertEqual(counts("out.pnml", "--no-claims"),
                             counts(NETS / f"{name}.toml", "--no-claims", *arguments))
        self.assertEqual(len(self.check(0, "out.pnml")["properties"]), 6 + 2)  # with its claims

    def test_the_core_of_a_net_has_its_markings(self):
        self.written("export", NETS / "motion.toml", "--set", "robots=2", "--core", "--format",
                     "pnml", "--output", "core.pnml")
        text = (self.folder / "core.pnml").read_text(encoding="utf-8")
        self.assertNotIn("inhibitor", text)
        self.assertNotIn('value="read"', text)
        found = self.check(0, "core.pnml", "--quick", "--no-claims")
        self.assertEqual((found["states"], found["deadlock"]), (179664, False))

    def test_models_for_spin_and_4ti2_are_written(self):
        self.written("export", "mutex.toml", "--format", "promela", "--output", "out.pml")
        self.assertRegex((self.folder / "out.pml").read_text(), "byte p0 = 1; .*\"free\"")
        self.assertEqual(self.call("export", "mutex.toml", "--format", "promela").stdout,
                         (self.folder / "out.pml").read_text())
        self.written("export", "mutex.toml", "--format", "4ti2", "--output", "out")
        self.assertEqual((self.folder / "out.mat").read_text().split()[:2], ["4", "5"])
        self.assertEqual((self.folder / "out.sign").read_text().split(), "1 5 1 1 1 1 1".split())
        self.assertTrue((self.folder / "out.rel").exists())
        self.refused("expected --output NAME", "export", "mutex.toml", "--format", "4ti2")
        self.refused_at_the_command_line("export", "mutex.toml", "--format", "svg")

    def test_nets_and_traces_are_drawn(self):
        self.written("draw", "mutex.toml", "--output", "net.dot")
        drawn = (self.folder / "net.dot").read_text()
        for name in ("digraph", "idle_a", "enter_b"):
            self.assertIn(name, drawn)
        self.written("draw", "mutex.toml", "--claim", "never busy_b = 1", "--trace", "--claim 1",
                     "--output", "trace.dot")
        drawn = (self.folder / "trace.dot").read_text()
        self.assertIn("enter_b", drawn)
        self.assertNotIn("enter_a", drawn)
        self.refused('--trace: found "nothing"', "draw", "mutex.toml", "--trace", "nothing")
        result = self.call("draw", "mutex.toml", "--trace", "deadlock-free")
        self.assertEqual((result.returncode, result.stdout), (1, ""))
        self.assertIn('mutex.toml: there is no trace of "deadlock-free"', result.stderr)

    def test_a_robot_gets_its_net_as_tables(self):
        root = NETS.parents[2]
        self.written("tables", NETS / "robot.toml", "--output", "robot_net.h")
        self.assertEqual((self.folder / "robot_net.h").read_text(),
                         (root / "client_fw/core/tasks/robot_net.h").read_text())
        self.assertIn("kRobotNet", self.call("tables", NETS / "robot.toml").stdout)
        self.refused("found 71 places, expected 1 to 32", "tables", NETS / "motion.toml")
        self.refused('mutex.toml: transition "enter_a": expected a tag', "tables", "mutex.toml")

    def test_mistakes_are_told_in_a_line_that_says_where(self):
        def file(name, text):
            (self.folder / name).write_text(text)
            return name

        self.refused("none.toml: cannot be opened", "check", "none.toml")
        self.refused("none.pnml: cannot be opened", "export", "none.pnml", "--format", "pnml")
        self.refused("bad.toml:1:8: syntax:", "check", file("bad.toml", "net = {\n"))
        self.refused("empty.toml:1:1: net: missing, expected a table [net]", "check",
                     file("empty.toml", ""))
        self.refused("key.toml:2:19: place[1].colour: unknown key, expected one of id", "check",
                     file("key.toml", 'net = { name = "n" }\nplace = [{id="a", colour="red"}]\n'))
        self.refused("expected XML", "check", file("bad.pnml", "<pnml"))
        self.refused('arc.pnml:1: found arc "x" with the target "b", expected the ID', "check",
                     file("arc.pnml", '<pnml><net id="n" type="http://www.pnml.org/version-2009/'
                          'grammar/ptnet"><page id="p"><place id="a"/><arc id="x" source="a" '
                          'target="b"/></page></net></pnml>'))
        for claim, found in (("always nowhere = 1", 'column 8: found "nowhere", expected the ID'),
                             ("live nowhere", 'column 6: found "nowhere", expected the ID'),
                             ("always free =", "column 14: found the end, expected"),
                             ("sometimes free = 1", "column 1: found "),
                             ("", "column 1: found the end, expected always, never")):
            self.refused(f'mutex.toml: net "mutex": claim "--claim 1", {found}', "check",
                         "mutex.toml", "--claim", claim)
        motion = NETS / "motion.toml"
        self.refused('motion.toml:4:1: parameters: "ants" is chosen as 3, expected one of robots',
                     "check", motion, "--set", "ants=3")
        for value in ("robots", "robots=", "robots=two", "robots=99999999999999999999"):
            self.refused(f'--set: found "{value}", expected NAME=NUMBER', "check", motion, "--set",
                         value)
        result = self.call("check", motion, "--set", "robots=0")
        self.assertEqual(result.returncode, 2)
        self.assertIn("parameters.robots: chosen as 0, expected 1 to 1000", result.stderr)
        self.written("export", "mutex.toml", "--format", "pnml", "--output", "out.pnml")
        self.refused("out.pnml: --set: PNML has no parameters", "check", "out.pnml", "--set", "a=1")
        for arguments in ((), ("check",), ("paint", "mutex.toml"), ("export", "mutex.toml"),
                          ("check", "mutex.toml", "--states", 0),
                          ("check", "mutex.toml", "--memory", 0)):
            self.refused_at_the_command_line(*arguments)
        result = self.call("export", "mutex.toml", "--format", "pnml", "--output", "none/out.pnml")
        self.assertEqual((result.returncode, result.stdout), (1, ""))
        self.assertIn("none/out.pnml", result.stderr)

    def refused_at_the_command_line(self, *arguments):
        result = self.call(*arguments)
        self.assertEqual((result.returncode, result.stdout), (2, ""), arguments)
        self.assertIn("--help", result.stderr)


if __name__ == "__main__":
    PHEROMONECTL = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
