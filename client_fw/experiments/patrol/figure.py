#!/usr/bin/env python3
"""Figure of the patrol experiment: how long places wait for a robot, by the life of the marks and the number of robots.

    figure.py [RESULTS] [--out FOLDER] [--pdf]

Also prints the tables of README.md.
"""

import pathlib
import sys

EXPERIMENTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(EXPERIMENTS), str(EXPERIMENTS.parents[1] / "deploy/pictures")]

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402
from sweeps import interval  # noqa: E402

COUNT, HALF_LIFE = "robots[1].count", "pheromone[1].half_life_s"
NO_MARKS_S = 0.02  # a mark is gone before anyone can sense it


def round_s(row):
    """The bound: how long robots take that pass each place once, one behind the other, in rows of places."""
    return (row["map.width_m"] * row["map.height_m"]
            / (row["robots"] * row["robots[1].parameters.speed_m_per_s"] * row["measure.place_m"]))


# Name, column, and its bound as a share of a round: on average, a place waits half of one.
MEASURES = (("mean idleness", "idle_mean_s", 0.5), ("longest wait, at the end", "idle_most_s", 1))


def ratios(rows, column, bound):
    """Means and intervals over seeds of a measure over its bound, by half-life, without and with marks."""
    found = {}
    for half_life, of in sorted(style.groups(rows, HALF_LIFE).items()):
        found[half_life] = interval([row[column] / (bound * round_s(row)) for row in of])
    return found.pop(NO_MARKS_S), found


def draw(rows, mown):
    figure, panels = pyplot.subplots(1, 2, figsize=(10, 4))
    for axes, (name, column, bound) in zip(panels, MEASURES):
        driven = mown[0][column] / (bound * round_s(mown[0]))
        print(f"\n{name}; mown: {driven:.2f}")
        for (count, of), colour, mark in zip(sorted(style.groups(rows, COUNT).items()), style.COLOURS, style.MARKS):
            without, found = ratios(of, column, bound)
            lives = [half_life / round_s(of[0]) for half_life in found]
            axes.errorbar(lives, [mean for mean, _ in found.values()], [half for _, half in found.values()],
                          color=colour, marker=mark, capsize=2.5, elinewidth=0.9,
                          label=f"{count:.0f} robot" + "s" * (count > 1))
            axes.plot([min(lives), max(lives)], [without[0]] * 2, ":", color=colour, marker="", label="dotted: without marks")
            print(f"| {count:.0f} | {round_s(of[0]):.0f} s | " + " | ".join(
                f"{mean:.2f} ± {half:.2f}" for mean, half in (without, *found.values())) + " |")
        axes.axhline(1, color=style.BLACK, linewidth=1, label="the sweep's bound")
        axes.axhline(driven, color=style.GREY, linewidth=1, linestyle="--", label="rows laid on the map, driven")
        axes.set_xscale("log")
        axes.set_ylim(0)
        axes.set_xlabel("half-life of a mark, in rounds of the sweep")
        axes.set_ylabel(f"{name}, over the bound")
    figure.suptitle("Patrolling by anti-pheromone: means and 95 % confidence intervals of 30 seeds")
    style.legend_below(figure, panels)
    return figure


FIGURES = {"patrol": (draw, "patrol.csv", "mow.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
