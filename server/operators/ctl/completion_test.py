#!/usr/bin/env python3
"""Bash completes everything that pheromonectl has: its commands and options are read out of --help.

    completion_test.py build/release/bin/pheromonectl
"""

import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
SCRIPT = ROOT / "deploy" / "completion" / "pheromonectl"
PHEROMONECTL = ""

# Sources the script and prints what it offers for the words given, the last of which is unfinished.
DRIVER = """source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _pheromonectl
printf '%s\\n' "${COMPREPLY[@]}"
"""


def offered(*words):
    result = subprocess.run(["bash", "-c", DRIVER, "bash", str(SCRIPT), PHEROMONECTL, *words],
                            text=True, capture_output=True, check=True,
                            env={"PATH": "/usr/bin:/bin", "PHEROMONE_SOCKET": "/nowhere"})
    assert result.stderr == "", result.stderr
    return set(result.stdout.split())


def help_of(*command):
    return subprocess.run([PHEROMONECTL, *command, "--help"], text=True, capture_output=True,
                          check=True).stdout


def commands_of(*command):
    """The names under "Subcommands:"."""
    parts = help_of(*command).split("Subcommands:\n")
    return re.findall(r"^  ([a-z]+)", parts[1], re.M) if len(parts) == 2 else []


def options_of(*command):
    return set(re.findall(r"^  (?:-\w,)?(--[a-z-]+)", help_of(*command), re.M))


class CompletionTest(unittest.TestCase):
    def test_every_command_and_option_is_offered(self):
        commands = commands_of()
        self.assertGreater(len(commands), 14)
        self.assertEqual(offered(""), set(commands))
        self.assertLessEqual(options_of(), offered("--"))
        seen = 0
        for command in commands:
            below = commands_of(command)
            if below:
                self.assertEqual(offered(command, ""), set(below))
            for words in [(command, it) for it in below] or [(command,)]:
                options = options_of(*words)
                self.assertEqual(offered(*words, "--") - {"--socket", "--instance", "--json"}, options, words)
                seen += len(options)
        self.assertGreater(seen, 40)

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
        nets = str(ROOT / "deploy" / "examples" / "nets")
        self.assertEqual(offered("net", "check", "--set", "robots=2", nets + "/mot"),
                         {nets + "/motion.toml"})

    def test_a_format_is_one_of_its_command(self):
        self.assertEqual(offered("net", "export", "--format", ""), {"pnml", "promela", "4ti2"})
        self.assertEqual(offered("tags", "export", "--format", "r"), {"rdfxml"})
        self.assertEqual(offered("journal", "export", "--format", ""), {"csv", "jsonl"})


if __name__ == "__main__":
    PHEROMONECTL = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
