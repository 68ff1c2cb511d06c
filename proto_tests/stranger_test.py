#!/usr/bin/env python3
"""Talks to a real daemon over a pseudo-terminal, knowing the specification only.

Usage: stranger_test.py BIN_DIR [--seed N]

Starts BIN_DIR/pheromoned twice, each time in a directory of its own, and plays robots with the
client in stranger/. What the daemon answers is compared with protocol/README.md and the vectors,
and the field with a naive model made from section 10. Ends with exit status 0, or with an
AssertionError.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
from stranger.client import open_terminal  # noqa: E402
from stranger.testing import (  # noqa: E402
    checks_bytes,
    checks_errors,
    checks_field,
    checks_once,
    checks_terminal,
)
from stranger.testing.daemon import Daemon  # noqa: E402
from stranger.testing.report import check_equal, log  # noqa: E402
from stranger.testing.robot import Robot, report_errors  # noqa: E402
from stranger.testing.selftest import self_test  # noqa: E402
from stranger.testing.setups import (  # noqa: E402
    AHEAD,
    AHEAD_SLOW,
    FAINT,
    PERMANENT,
    SMALL_MEMORY,
    WIDE_MAP,
)


def play(program: Path, seed: random.Random) -> None:
    with tempfile.TemporaryDirectory(prefix="stranger-") as directory:
        setup, model = WIDE_MAP, WIDE_MAP.model
        with Daemon(program, Path(directory), setup) as daemon:
            path_a, path_b = (daemon.wait_for(link) for link in setup.links)
            log(f"the daemon is up: {path_a.name}, {path_b.name}")
            with open_terminal(path_a) as a, open_terminal(path_b) as b:
                robot = Robot(a, 7)
                checks_field.check_hello(daemon, setup, "radio-a", robot)
                checks_field.check_ping(robot, seed)
                checks_field.check_worked_example(robot, model)
                checks_field.check_field(robot, model, seed, 500)
                checks_field.check_nearest_node(robot, model)
                checks_field.check_evaporation(robot, model)
                checks_once.check_exactly_once(Robot(a, 40), b, model)
                checks_errors.check_errors(Robot(a, 253), model)
                checks_bytes.check_bad_input(daemon, b, seed)
                checks_bytes.check_every_vector(b)
                checks_bytes.check_odd_pieces(daemon, "radio-b", b)
                before = a.decoder.dropped.total() + b.decoder.dropped.total()
                check_equal(before, 0, "broken frames from the daemon")
                # All that noise on the other link has left no trace in the field.
                places = [(1000, 500), (100, 200), (4112, -2992), (528, 784), (0, 0), (5000, 5000)]
                for x, y in places:
                    for kind in (PERMANENT, AHEAD, FAINT, AHEAD_SLOW):
                        checks_field.check_sense(robot, model, kind, x, y, 4112)
                b.close()
                checks_terminal.check_reopening(daemon, "radio-b")
                checks_terminal.check_deaf_client(daemon, "radio-b", robot)
            checks_terminal.check_program(daemon, "radio-a")
            daemon.stop(setup)
            log("SIGTERM: exit status 0, the terminals are gone")

    with tempfile.TemporaryDirectory(prefix="stranger-") as directory:
        setup, model = SMALL_MEMORY, SMALL_MEMORY.model
        with Daemon(program, Path(directory), setup) as daemon:
            with open_terminal(daemon.wait_for("radio-c")) as c:
                robot = Robot(c, 254)
                checks_field.check_hello(daemon, setup, "radio-c", robot)
                checks_field.check_field(robot, model, seed, 100)
                checks_field.check_map_full(robot, model)
            daemon.stop(setup)


def main() -> int:
    parser = argparse.ArgumentParser(description="Tests pheromoned over a pseudo-terminal.")
    parser.add_argument("bin_dir", type=Path, metavar="BIN_DIR", help="holds pheromoned")
    parser.add_argument("--seed", type=int, default=20090317, help="of the random numbers")
    options = parser.parse_args()
    program = options.bin_dir.resolve() / "pheromoned"
    assert program.is_file(), f"there is no {program}"
    log(f"self-test: {self_test()}")
    log(f"seed {options.seed}")
    play(program, random.Random(options.seed))
    report_errors()
    log("all good")
    return 0


if __name__ == "__main__":
    sys.exit(main())
