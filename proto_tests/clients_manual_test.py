#!/usr/bin/env python3
"""What the clients' --help lists is in their manual pages, and bash completes it.

    clients_manual_test.py BIN_DIR
"""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

DEPLOY = pathlib.Path(__file__).resolve().parents[1] / "deploy"
BIN_DIR = pathlib.Path()
ROBOTS = ["pheromone-robot"]
# And their commands, at least.
WITH_COMMANDS = {"pheromone-swarm": 5, "pheromone-experiments": 7, "pheromone-tracker": 5}

# Sources the script and prints what it offers for the words given, the last of which is unfinished.
DRIVER = """source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _pheromone
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
    return set(run("bash", "-c", DRIVER, "bash", DEPLOY / "completion" / "pheromone",
                   BIN_DIR / words[0], *words[1:]).split())


def commands_of(program):
    return set(re.findall(r"^  ([a-z]+)", help_of(program).split("Subcommands:\n")[1], re.M))


def manual_of(program):
    return (DEPLOY / "man" / f"{program}.1").read_text(encoding="utf-8")


class ClientsManualTest(unittest.TestCase):
    def test_every_option_of_a_robot_is_in_its_manual(self):
        for program in ROBOTS:
            options = options_of(program)
            self.assertGreater(len(options), 12)
            for option in options:
                self.assertRegex(manual_of(program),
                                 rf"(?m)^\.It Fl -(.* Fl -)?{option.removeprefix('--')}\b")

    def test_manual_names_no_option_that_a_robot_lacks(self):
        for program in ROBOTS:
            items = re.findall(r"^\.It (Fl .*)", manual_of(program), re.M)
            named = {f"-{option}" for item in items for option in re.findall(r"Fl (-[a-z-]+)", item)}
            self.assertEqual(named, options_of(program))

    def test_every_command_of_a_program_is_in_its_manual(self):
        for program, least in WITH_COMMANDS.items():
            commands = commands_of(program)
            self.assertGreaterEqual(len(commands), least)
            named = re.findall(r"^\.It Cm ([a-z]+)", manual_of(program), re.M)
            self.assertEqual(set(named), commands)

    def test_bash_completes_commands_and_options(self):
        for program in WITH_COMMANDS:
            self.assertEqual(offered(program, ""), commands_of(program))
        self.assertEqual(offered("pheromone-swarm", "pi"), {"pioneer"})
        self.assertEqual(offered("pheromone-swarm", "lab", ""), {"run", "list", "config"})
        self.assertEqual(offered("pheromone-swarm", "lab", "run", "--s"),
                         {"--set", "--seed", "--series", "--summary"})
        for words in [*((program,) for program in ROBOTS), *((program,) for program in WITH_COMMANDS),
                      *((program, command) for program in WITH_COMMANDS
                        for command in commands_of(program))]:
            self.assertEqual(offered(*words, "--"), options_of(*words), words)
        self.assertIn(str(DEPLOY / "man"), offered("pheromone-robot", "--robot",
                                                   str(DEPLOY / "m")))
    def test_mistakes_are_told_with_what_is_expected(self):
        for words, told in (
                ("pheromone-swarm simulate",
                 'unknown command "simulate", expected one of path, run, live, pioneer, lab'),
                ("pheromone-swarm live --modem udp://127.0.0.1:4951",
                 '--modem: found "udp://127.0.0.1:4951", expected the path of a terminal device'),
                ("pheromone-swarm run --medium-access x.toml",
                 "--medium-access requires --daemon"),
                ("pheromone-experiments", "a command is missing, expected one of detour, laws, "),
                ("pheromone-experiments trails",
                 "--bench is required: The server's configuration with floor, trails, tags and "
                 "nets, such as deploy/examples/bench.toml"),
                *((f"pheromone-experiments channel {option}",
                   f"{option.split()[0]} requires --json")
                  for option in ("--access rounds", "--simple 1", "--hidden-pairs 1",
                                 "--frame-loss-percent 1", "--byte-error-percent 1",
                                 "--period-ms 100", "--fail-safe-ms 400", "--together",
                                 "--seed 2")),
                ("pheromone-experiments channel --json --out x", "--json excludes --out"),
                ("pheromone-robot --start 0 0 0 --robot 127.0.0.1:1 --modem udp://127.0.0.1:4951",
                 "--modem: udp://127.0.0.1:4951: expected a serial port, HOST:PORT or "
                 "udp:HOST:PORT, without slashes")):
            with self.subTest(words):
                program, *arguments = words.split()
                result = subprocess.run([BIN_DIR / program, *arguments], text=True,
                                        capture_output=True, check=False)
                self.assertEqual((result.returncode, result.stdout), (2, ""))
                self.assertTrue(result.stderr.startswith(f"{program}: {told}"), result.stderr)

    def test_an_experiment_that_is_cut_off_leaves_the_rows_that_it_has_printed(self):
        with tempfile.TemporaryDirectory() as folder:
            with subprocess.Popen([BIN_DIR / "pheromone-experiments", "channel", "--seeds", "1",
                                   "--seconds", "2", "--out", folder], text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as run:
                lines = [run.stdout.readline() for _ in range(4)]
                run.kill()
            rows = (pathlib.Path(folder) / "channel.csv").read_text().splitlines()
            self.assertGreaterEqual(len(rows), 3, lines)  # the head, and all rows but the last

    def test_a_table_of_the_link_that_is_cut_off_leaves_the_one_that_was_there(self):
        with tempfile.TemporaryDirectory() as folder:
            table = pathlib.Path(folder) / "rounds.csv"
            table.write_text("whole\n")
            with subprocess.Popen([BIN_DIR / "pheromone-experiments", "channel", "--seeds", "1",
                                   "--seconds", "2", "--link-table", table], text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as run:
                lines = [run.stdout.readline() for _ in range(4)]
                run.kill()
            self.assertEqual(table.read_text(), "whole\n", lines)


if __name__ == "__main__":
    BIN_DIR = pathlib.Path(sys.argv.pop()).resolve()
    if (BIN_DIR / "pheromone-ros2").exists():  # it is not built where there is no DDS
        ROBOTS.append("pheromone-ros2")
    unittest.main()
