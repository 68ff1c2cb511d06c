"""What experiments share: confidence intervals of their tables and figures, and, for those that run in
Python, a sweep of cases.

    mean, half = sweeps.interval(values)                  # Student's t
    low, high = sweeps.wilson(successes, runs)            # a share, from 0 to 1

    if __name__ == "__main__":
        sweeps.main(__doc__, cases, run, ("arms.csv", "arms-time.csv"))
"""

import argparse
import concurrent.futures
import csv
import math
import os
import pathlib
import statistics
import sys
import time

# Student's t, two-sided 95 %, of 1 to 29 degrees of freedom.
T = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131,
     2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045)
Z = 1.95996  # of the normal distribution


def interval(values):
    """The mean of 2 to 30 values, and half of its 95 % confidence interval."""
    return (statistics.fmean(values),
            T[len(values) - 2] * statistics.stdev(values) / math.sqrt(len(values)))


def wilson(successes, runs):
    """Wilson's 95 % interval of a probability."""
    share = successes / runs
    centre = (share + Z * Z / (2 * runs)) / (1 + Z * Z / runs)
    half = Z / (1 + Z * Z / runs) * math.sqrt(share * (1 - share) / runs + Z * Z / (4 * runs * runs))
    return max(0.0, centre - half), min(1.0, centre + half)


def write(path, rows):
    """Rows of the same keys as CSV, with six digits; None is empty."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: f"{value:.6g}" if isinstance(value, float) else value
                          for key, value in row.items()} for row in rows)


def main(description, cases, run, files):
    """The program of an experiment: `run` gets the arguments of a case, a tuple of `cases`, and returns a list of rows
    for each of `files`. Cases are independent of each other, and written in their order."""
    parser = argparse.ArgumentParser(description=description.strip().split("\n")[0])
    parser.add_argument("--processes", type=int, default=os.cpu_count(), metavar="N",
                        help="that share the cases; the results are the same (default: all cores)")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path(sys.argv[0]).resolve().parent / "results",
                        metavar="FOLDER", help="for the CSV files (default: the committed ones)")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    found = [[] for _ in files]
    with concurrent.futures.ProcessPoolExecutor(options.processes) as pool:
        for number, rows in enumerate(pool.map(run, *zip(*cases)), 1):
            for all_rows, more in zip(found, rows):
                all_rows.extend(more)
            print(f"\r{number} of {len(cases)} cases, {time.monotonic() - began:.0f} s", end="", file=sys.stderr)
    print(file=sys.stderr)
    for name, rows in zip(files, found):
        write(options.out / name, rows)
