#!/usr/bin/env python3
"""Bash completes what pheromonectl and pheromoned have: commands and options as --help lists them.
(clients_manual_test.py looks at the other programs.)

    completion_test.py build/release/bin
"""

import functools
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
SCRIPT = ROOT / "deploy" / "completion" / "pheromone"
BIN = pathlib.Path()

# Sources the script and prints what it offers for the words given, the last of which is unfinished.
DRIVER = """source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _pheromone
printf '%s\\n' "${COMPREPLY[@]}"
"""


def offered(*words, program="pheromonectl"):
    result = subprocess.run(["bash", "-c", DRIVER, "bash", str(SCRIPT), BIN / program, *words],
                            text=True, capture_output=True, check=True,
                            env={"PATH": "/usr/bin:/bin", "PHEROMONE_SOCKET": "/nowhere"})
    assert result.stderr == "", result.stderr
    return set(result.stdout.split())


@functools.cache
def help_of(*command):
    return subprocess.run([BIN / command[0], *command[1:], "--help"], text=True, capture_output=True,
                          check=True).stdout


def commands_of(*command):
    """The names under "Subcommands:"."""
    parts = help_of(*command).split("Subcommands:\n")
    return re.findall(r"^  ([a-z-]+)", parts[1], re.M) if len(parts) == 2 else []


def options_of(*command):
    return set(re.findall(r"^  (?:-\w,)?(--[a-z0-9-]+)", help_of(*command), re.M))


class CompletionTest(unittest.TestCase):
    def walk(self, *command):
        """How many options it has, and its commands."""
        general = options_of(command[0]) - {"--help", "--version"}
        options = options_of(*command)
        self.assertEqual(offered(*command[1:], "--", program=command[0]), options | general, command)
        below = commands_of(*command)
        if below:
            self.assertEqual(offered(*command[1:], "", program=command[0]), set(below))
        return len(options) + sum(self.walk(*command, it) for it in below)

    def test_every_command_and_option_is_offered(self):
        self.assertGreater(len(commands_of("pheromonectl")), 14)
        self.assertGreater(self.walk("pheromonectl"), 80)
        self.walk("pheromoned")

    def test_beginnings_are_completed(self):
        self.assertEqual(offered("st"), {"status"})
        self.assertEqual(offered("--socket", "/x", "--json", "cli"), {"clients"})
        self.assertEqual(offered("paint", "1", "--u"), {"--units"})

    def test_a_robots_commands_are_offered_in_their_place(self):
        manual = (ROOT / "deploy" / "man" / "pheromonectl.1").read_text(encoding="utf-8")
        commands = offered("command", "radio-a", "7", "")
        self.assertEqual(len(commands), 9)
        for name in commands:
            self.assertTrue(re.search(rf"(?m)^\.It Cm (.* )?{name}\b", manual), name)
        self.assertEqual(offered("command", ""), set())  # no server to name its links

    def test_files_are_offered_where_files_are_named(self):
        folder = str(ROOT / "deploy" / "examples") + "/all"
        self.assertEqual(offered("config", "check", folder),
                         {str(ROOT / "deploy" / "examples" / "all-laws.toml")})
        self.assertEqual(offered("map", "draw", "--config", folder),
                         {str(ROOT / "deploy" / "examples" / "all-laws.toml")})
        self.assertEqual(offered("cluster", "leave", "--new-epoch", folder),
                         {str(ROOT / "deploy" / "examples" / "all-laws.toml")})
        nets = str(ROOT / "deploy" / "examples" / "nets")
        for setting in (["robots=2"], ["robots", "=", "2"]):  # the second as bash reads it
            self.assertEqual(offered("net", "check", "--set", *setting, nets + "/mot"),
                             {nets + "/motion.toml"})
        self.assertEqual(offered("run", "--daemon", folder, program="pheromone-swarm"),
                         {str(ROOT / "deploy" / "examples" / "all-laws.toml")})

    def test_a_format_is_one_of_its_command(self):
        self.assertEqual(offered("net", "export", "--format", ""), {"pnml", "promela", "4ti2"})
        self.assertEqual(offered("tags", "export", "--format", "r"), {"rdfxml"})
        self.assertEqual(offered("journal", "export", "--format", ""), {"csv", "jsonl"})
        self.assertEqual(offered("path", "--client", "", program="pheromone-swarm"), {"core", "avr"})
        self.assertEqual(offered("--log-level", "t", program="pheromoned"), {"trace"})
        self.assertIn("38400", offered("--robot-baud", "", program="pheromone-robot"))

    def test_nothing_is_offered_for_a_number(self):
        self.assertEqual(offered("deposit", "trail", "--quanta", ""), set())
        self.assertEqual(offered("keys", "new", ""), set())
        self.assertEqual(offered("watch", "--columns", ""), set())


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
