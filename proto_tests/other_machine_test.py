#!/usr/bin/env python3
"""A journal written on one machine has the same state on another kind of machine.

    other_machine_test.py BIN_DIR OTHER_BIN_DIR      what ./deploy/arm64 calls

pheromoned of BIN_DIR serves what the robots of the replay corpus sent, with evaporation in between,
and pheromonectl of both folders reads its journal: each segment and the state, with its hash, in the
same words. That answers are the same is proto_tests/replay/corpus_test.py's to say.
"""

import pathlib
import re
import subprocess
import sys
import tempfile

from operated_daemon import OperatedDaemon, check, default_config, write_config
from test_config import table

CORPUS = pathlib.Path(__file__).resolve().parent / "replay"


def pheromonectl(bin_dir, *arguments):
    result = subprocess.run([bin_dir / "pheromonectl", *arguments], text=True, capture_output=True,
                            timeout=300, check=False)
    check(result.returncode == 0, f"{bin_dir}: pheromonectl {arguments[0]}: exit status "
                                  f"{result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout


def run(bin_dir, other_bin_dir, folder):
    port, journal = folder / "radio-a.pty", folder / "journal"
    default = default_config(bin_dir)
    check("\ntau_s = 30.0 " in default, "the default configuration has another tau")
    write_config(folder, default.replace("\ntau_s = 30.0 ", "\ntau_s = 0.05 ")
                 + table("journal", folder="journal"))
    before = None
    for _ in range(2):  # the second goes on from what the first has left
        daemon = OperatedDaemon(bin_dir, folder)
        for capture in sorted(CORPUS.glob("*.pcapng")):
            if capture.stem != "damaged":
                pheromonectl(bin_dir, "replay", "--to", port, "--speed", "10", capture)
        daemon.stop()
        here, there = (pheromonectl(it, "journal", "check", journal) for it in (bin_dir,
                                                                                other_bin_dir))
        check(here == there, f"here:\n{here}on the other machine:\n{there}")
        state = re.search(r"^state: sequence (\d+), .* hash ([0-9a-f]{16})", here, re.MULTILINE)
        check(state and int(state[1]) > 20 and state[2] != before, f"too little happened:\n{here}")
        before = state[2]
        print(state[0], flush=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        run(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(),
            pathlib.Path(temporary))
    print("ok")
