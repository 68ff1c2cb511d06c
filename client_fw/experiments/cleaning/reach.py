#!/usr/bin/env python3
"""Where an explicit search ends: states, processor time and memory of proofs by zones and robots.

    reach.py PATH/pheromone-experiments >results/cleaning-reach.csv      # some minutes

Grids of zones that soil by 5 %, cleaned in 5 units by robots that start in the first zone, the last
and the middle one. Each query has MEMORY_MIB; what needs more is unknown, with the states until then.
"""

import csv
import pathlib
import resource
import subprocess
import sys
import tempfile

GRIDS = ((2, 2), (3, 2), (4, 2), (3, 3), (4, 3), (5, 3), (4, 4), (5, 4), (6, 4))
QUERIES = ("clean", "bounded", "forgotten", "crash")
MEMORY_MIB = 64
LONG_S = 10  # after a proof that takes longer no larger floor is tried


def run(program, columns, rows, robots, query):
    zones = columns * rows
    start = (1, zones, zones // 2 + 1)[:robots]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "floor.toml").write_text(
            f"[floor]\ncolumns = {columns}\nrows = {rows}\n[robots]\ncount = {robots}\n"
            f"starts = [{list(start)}]\n[soil]\nlimit_percent = 100\n", encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([program, "cleaning", "--prove", folder / "floor.toml", "--query", query,
                        "--memory-mib", str(MEMORY_MIB), "--out", folder],
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        with open(folder / "cleaning-proof.csv", encoding="utf-8") as file:
            answer = next(csv.DictReader(file))
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return (zones, columns, rows, robots, query, answer["verdict"], answer["units"], answer["states"],
            answer["bytes"], f"{cpu_s:.2f}")


def main():
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow("zones columns rows robots query verdict units states bytes cpu_s".split())
    for robots in (1, 2, 3):
        for query in QUERIES if robots > 1 else QUERIES[:-1]:
            unknown = 0
            for columns, rows in GRIDS:
                row = run(sys.argv[1], columns, rows, robots, query)
                out.writerow(row)
                sys.stdout.flush()
                unknown += row[5] == "unknown"
                if unknown == 2 or float(row[-1]) > LONG_S:  # larger floors have more states
                    break


if __name__ == "__main__":
    main()
