#!/usr/bin/env python3
"""What the clients' --help lists is in their manual pages, and bash completes it.

    clients_manual_test.py BIN_DIR
"""

import pathlib
import re
import subprocess
import sys
import unittest

DEPLOY = pathlib.Path(__file__).resolve().parents[1] / "deploy"
BIN_DIR = pathlib.Path()
SIMULATIONS = {"pheromone-swarm": 4, "pheromone-experiments": 7}  # and their commands, at least

# Sources the script and prints what it offers for the words given, the last of which is unfinished.
DRIVER = """source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _pheromone_clients
printf '%s\\n' "${COMPREPLY[@]}"
"""


def run(*words):
    return subprocess.run([str(word) for word in words], text=True, capture_output=True,
                          check=True).stdout


def help_of(*words):
    return run(BIN_DIR / words[0], *words[1:], "--help")


def options_of(*words):
    return set(re.findall(r"^ *(?:-\w,)?(--[a-z-]+)", help_of(*words), re.M))


def offered(*words):
    return set(run("bash", "-c", DRIVER, "bash", DEPLOY / "completion" / "pheromone-clients",
                   BIN_DIR / words[0], *words[1:]).split())


def commands_of(program):
    return set(re.findall(r"^  ([a-z]+)", help_of(program).split("Subcommands:\n")[1], re.M))


def manual_of(program):
    return (DEPLOY / "man" / f"{program}.1").read_text(encoding="utf-8")


class ClientsManualTest(unittest.TestCase):
    def test_every_option_of_the_robot_is_in_its_manual(self):
        options = options_of("pheromone-robot")
        self.assertGreater(len(options), 12)
        for option in options:
            self.assertRegex(manual_of("pheromone-robot"),
                             rf"(?m)^\.It Fl -(.* Fl -)?{option.removeprefix('--')}\b")

    def test_manual_names_no_option_that_the_robot_lacks(self):
        items = re.findall(r"^\.It (Fl .*)", manual_of("pheromone-robot"), re.M)
        named = {f"-{option}" for item in items for option in re.findall(r"Fl (-[a-z-]+)", item)}
        self.assertEqual(named, options_of("pheromone-robot"))

    def test_every_command_of_the_simulations_is_in_its_manual(self):
        for program, least in SIMULATIONS.items():
            commands = commands_of(program)
            self.assertGreaterEqual(len(commands), least)
            named = re.findall(r"^\.It Cm ([a-z]+)", manual_of(program), re.M)
            self.assertEqual(set(named), commands)

    def test_bash_completes_commands_and_options(self):
        for program in SIMULATIONS:
            self.assertEqual(offered(program, ""), commands_of(program))
        self.assertEqual(offered("pheromone-swarm", "pi"), {"pioneer"})
        for words in [("pheromone-robot",), *((program,) for program in SIMULATIONS),
                      *((program, command) for program in SIMULATIONS
                        for command in commands_of(program))]:
            self.assertEqual(offered(*words, "--"), options_of(*words), words)
        self.assertIn(str(DEPLOY / "man"), offered("pheromone-robot", "--robot",
                                                   str(DEPLOY / "m")))


if __name__ == "__main__":
    BIN_DIR = pathlib.Path(sys.argv.pop()).resolve()
    unittest.main()
