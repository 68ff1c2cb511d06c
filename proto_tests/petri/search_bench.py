#!/usr/bin/env python3
"""The search of pheromonectl net check against Spin's verifier, on the same nets in turn.

    search_bench.py build/release/bin/pheromonectl [--runs 5] [--output server/core/petri/results/DATE.csv]

Prints for each net the median states per second and the bytes per state of both, and our ratios to
Spin's. Spin verifies what net export writes for it: compiled with -O2, all reachable markings, no
partial-order reduction, and a hash table that it does not have to enlarge; once with its plain
states, and once with its compressed ones (COLLAPSE).
"""

import argparse
import csv
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
NETS = [("kanban", 3), ("kanban", 4), ("kanban", 5), ("philosophers", 12), ("fms", 4),
        ("motion.toml", 2), ("motion.toml", 3)]


def run(command, **options):
    return subprocess.run(command, check=True, text=True, capture_output=True, **options).stdout


def file_and_options(name, size, folder):
    if name.endswith(".toml"):
        return str(ROOT / "deploy/examples/nets" / name), ["--set", f"robots={size}"]
    path = folder / f"{name}-{size}.pnml"
    path.write_text(run([sys.executable, str(ROOT / "proto_tests/petri/make_nets.py"), name,
                         str(size)]))
    return str(path), []


def ours(program, file, options):
    result = json.loads(subprocess.run([program, "net", "check", file, *options, "--no-claims", "--quick", "--json"],
                                       text=True, capture_output=True).stdout)
    return result["states"], result["seconds"], result["bytes_per_state"]


def compile_spin(program, file, options, folder):
    run([program, "net", "export", file, *options, "--format", "promela", "--output",
         str(folder / "net.pml")])
    run(["spin", "-a", "net.pml"], cwd=folder)
    for name, flags in [("plain", []), ("collapse", ["-DCOLLAPSE"])]:
        run(["cc", "-w", "-O2", "-DSAFETY", "-DNOREDUCE", "-DMEMLIM=16000", *flags, "-o", name,
             "pan.c"], cwd=folder)


def spins(verifier, folder):
    start = time.monotonic()
    out = run([str(folder / verifier), "-E", "-n", "-m20000000", "-w25"], cwd=folder)
    seconds = time.monotonic() - start
    states = int(re.search(r"(\d+) states, stored", out).group(1))
    memory = float(re.search(r"([\d.]+)\s+actual memory usage for states", out).group(1)) * 2**20
    elapsed = re.search(r"pan: elapsed time ([\d.]+) seconds", out)
    return states, float(elapsed.group(1)) if elapsed else seconds, memory / states


def measure(program, name, size, runs):
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        file, options = file_and_options(name, size, folder)
        compile_spin(program, file, options, folder)
        found = {"ours": [], "plain": [], "collapse": []}
        for _ in range(runs):
            found["ours"].append(ours(program, file, options))
            for verifier in ("plain", "collapse"):
                found[verifier].append(spins(verifier, folder))
    counts = {states for results in found.values() for states, _, _ in results}
    assert len(counts) == 1, f"{name} {size}: different numbers of states: {counts}"
    row = {"net": name, "size": size, "states": counts.pop(), "runs": runs}
    for who, results in found.items():
        row[f"{who}_states_per_s"] = round(statistics.median(n / max(s, 1e-3) for n, s, _ in results))
        row[f"{who}_bytes_per_state"] = round(statistics.median(b for _, _, b in results), 1)
    row["speed_ratio"] = round(row["ours_states_per_s"] / max(row["plain_states_per_s"],
                                                              row["collapse_states_per_s"]), 2)
    row["bytes_ratio"] = round(row["ours_bytes_per_state"] / min(row["plain_bytes_per_state"],
                                                                 row["collapse_bytes_per_state"]), 3)
    return row


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("pheromonectl")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--output")
    arguments = parser.parse_args()
    rows = []
    for name, size in NETS:
        rows.append(measure(str(pathlib.Path(arguments.pheromonectl).resolve()), name, size,
                            arguments.runs))
        print(", ".join(f"{key} {value}" for key, value in rows[-1].items()), flush=True)
    if arguments.output:
        with open(arguments.output, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
