#!/usr/bin/env python3
"""Figure of the congestion experiment: what ants carry, by their number, with a trail and without.

    figure.py [RESULTS] [--out FOLDER] [--pdf]

Also prints the table of README.md.
"""

import pathlib
import sys

EXPERIMENTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(EXPERIMENTS), str(EXPERIMENTS.parents[1] / "deploy/pictures")]

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402
from sweeps import interval  # noqa: E402

COUNT, QUANTA = "robots[1].count", "robots[1].parameters.quanta"
CASES = {0: ("without a trail", style.VERMILION, "s"), 2: ("with a trail", style.BLUE, "o")}
PANELS = (("deliveries_per_robot_hour", "loads a robot and hour", 1),
          ("deliveries_per_robot_hour", "loads an hour, of all robots", None),
          ("robot_contacts_per_robot_hour", "robots met, a robot and hour", 1))


def differences(rows):
    """For each number of robots: what a trail adds, seed by seed (the same starts)."""
    for count, of_count in sorted(style.groups(rows, COUNT).items()):
        by_seed = {quanta: {row["seed"]: row["deliveries_per_robot_hour"] for row in of_case}
                   for quanta, of_case in style.groups(of_count, QUANTA).items()}
        yield count, by_seed, [by_seed[2][seed] - by_seed[0][seed] for seed in sorted(by_seed[0])]


def draw(rows):
    figure, panels = pyplot.subplots(1, len(PANELS), figsize=(10, 3.4))
    for axes, (measure, label, factor) in zip(panels, PANELS):
        for quanta, (name, colour, mark) in CASES.items():
            counts = sorted(style.groups(rows, COUNT))
            found = [interval([row[measure] * (factor or row[COUNT]) for row in rows
                               if row[COUNT] == count and row[QUANTA] == quanta]) for count in counts]
            axes.errorbar(counts, [mean for mean, _ in found], [half for _, half in found], color=colour,
                          marker=mark, capsize=2.5, elinewidth=0.9, label=name)
        axes.set_xscale("log")
        axes.set_xticks(counts, [f"{count:.0f}" for count in counts], minor=False)
        axes.minorticks_off()
        axes.set_ylim(0)
        axes.set_xlabel("robots on 20 m x 20 m")
        axes.set_ylabel(label)
    for robots, seeds, added in differences(rows):
        cells = [interval(list(seeds[quanta].values())) for quanta in (0, 2)] + [interval(added)]
        print(f"| {robots:.0f} | " + " | ".join(f"{mean:.2f} ± {half:.2f}" for mean, half in cells) + " |")
    figure.suptitle("Foraging: means and 95 % confidence intervals of 30 seeds")
    style.legend_below(figure, panels)
    return figure


FIGURES = {"congestion": (draw, "congestion.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
