#!/usr/bin/env python3
"""Drift, fixes and radio: where does foraging collapse, and do the levels of the lab agree on a path?

    drift.py [--processes N] [--out FOLDER]

Writes results/forage.csv and results/levels.csv, which figure.py draws. A case is 30 runs of `pheromone-swarm lab`,
which has to be on the PATH.
"""

import itertools
import pathlib
import subprocess
import sys
import tomllib

FOLDER = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parent))

import sweeps  # noqa: E402  (after the path)

SEEDS = range(1, 31)
FORAGE = FOLDER / "forage.toml"
CIRCUIT = FOLDER.parents[1] / "lab/examples/levels.toml"
STARTS = tomllib.loads(CIRCUIT.read_text())["robots"][0]["starts"][:10]  # a channel's
# Of a wheel's length, the standard deviation.
BIASES = (0, 0.0005, 0.001, 0.002, 0.005)
# Where a robot's position comes from: odometry, and fixes every so many seconds with a standard deviation in metres.
SOURCES = {"odometry": None, "GPS 1 m": (1, 1), "GPS 0.1 m": (1, 0.1)}
TRACKER = {"tracker": (0.2, 0.02)}  # which replaces the heading, too: no error of odometry counts
QUANTA = 2  # of a deposit; 0: no trail


def measures(scenario, seed, settings):
    """What one run printed: numbers by their names."""
    command = ["pheromone-swarm", "lab", "run", str(scenario), "--seed", str(seed)]
    for key, value in settings.items():
        command += ["--set", f"{key}={value}"]
    ran = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return dict(map(str.split, ran.stdout.splitlines()))


def forage(source, bias, lost, quanta):
    settings = {"robots.odometry_bias": bias, "radio.lost": lost, "robots.parameters.quanta": quanta}
    if fix := (SOURCES | TRACKER)[source]:
        settings |= dict(zip(("robots.fix_period_s", "robots.fix_sigma_m"), fix))
    for seed in SEEDS:
        found = measures(FORAGE, seed, settings)
        yield {"source": source, "bias": bias, "lost": lost, "quanta": quanta, "seed": seed,
               "loads_per_robot_minute": float(found["deliveries_per_robot_hour"]) / 60,
               "fail_safe_stops": found["fail_safe_stops"]}


def follow(level, bias, lost):
    settings = {"run.level": f'"{level}"', "run.duration_s": 40, "radio.lost": lost, "robots.starts": STARTS}
    if bias:
        settings["robots.odometry_bias"] = bias
    for seed in SEEDS:
        found = measures(CIRCUIT, seed, settings)
        yield {"level": level, "bias": bias, "lost": lost, "seed": seed, "path_error_mm": float(found["path_error_mm"]),
               "answers_per_s": float(found["answers_per_s"]), "fail_safe_stops": found["fail_safe_stops"]}


def run(experiment, case):
    return (list(forage(*case)), []) if experiment == "forage" else ([], list(follow(*case)))


CASES = [("forage", (source, bias, lost, QUANTA)) for source, bias, lost in itertools.product(SOURCES, BIASES, (0, 0.05))
         if not lost or bias in (0, 0.001)]
CASES += [("forage", ("tracker", 0, lost, QUANTA)) for lost in (0, 0.05)]
# Without a trail: the ideal, and a small error with fixes.
CASES += [("forage", ("odometry", 0, 0, 0)), ("forage", ("GPS 0.1 m", 0.001, 0, 0))]
CASES += [("follow", case) for case in itertools.product(("firmware", "field"), (0, 0.005), (0, 0.05))]
# What drifts is not known to level "radio".
CASES += [("follow", ("radio", 0, lost)) for lost in (0, 0.05)]

if __name__ == "__main__":
    sweeps.main(__doc__, CASES, run, ("forage.csv", "levels.csv"))
