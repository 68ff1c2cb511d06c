#!/usr/bin/env python3
"""Figure of the n-armed bridge: the share of the short branch over time, by how ants scale their deposits.

    figure.py [RESULTS] [--out FOLDER] [--pdf]

Also prints the tables of README.md.
"""

import pathlib
import sys

EXPERIMENTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(EXPERIMENTS), str(EXPERIMENTS.parents[1] / "deploy/pictures")]

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402
from sweeps import interval, wilson  # noqa: E402

DEPOSITS = {(40, 0): "constant", (10, 0): "constant, a quarter", (40, 1): "by 1/cost", (40, 2): "by 1/cost²"}
CASES = {"late": ("opens late", ((0, 15),)), "again": ("closes, reopens", ((15, 30),))}  # closed, in minutes
DECIDED = 0.8  # this share of the choices is for one branch


def draw(rows, times):
    table(rows)
    counts = sorted(style.groups(times, "branches"))
    figure, panels = pyplot.subplots(2, len(counts), figsize=(10, 5.4), sharex=True, sharey=True)
    for line, (case, (name, closed)) in zip(panels, CASES.items()):
        for axes, count in zip(line, counts):
            for (deposits, label), colour in zip(DEPOSITS.items(), style.COLOURS):
                of = [row for row in times if (row["case"], row["branches"], (row["quanta"], row["exponent"]))
                      == (case, count, deposits)]
                minutes = style.column(of, "minute")
                axes.plot(minutes, style.column(of, "short_share"), color=colour, markersize=3, label=label)
                axes.fill_between(minutes, [row["short_share"] - row["half_interval"] for row in of],
                                  [row["short_share"] + row["half_interval"] for row in of],
                                  color=colour, alpha=0.2, linewidth=0)
            for begin, end in closed:
                axes.axvspan(begin, end, color=style.PALE, alpha=0.6, linewidth=0, label="the short branch is closed")
            axes.axhline(1 / count, color=style.GREY, linewidth=0.8, linestyle=":", label="chosen evenly")
            axes.set_title(f"{count:.0f} branches: {name}", fontsize=8)
            axes.set_ylim(0, 1)
    for axes in panels[:, 0]:
        axes.set_ylabel("share of the short branch")
    for axes in panels[1]:
        axes.set_xlabel("time, min")
    figure.suptitle("Choices of ants at the nest: means and 95 % confidence intervals of 30 bridges")
    style.legend_below(figure, panels.flat)
    return figure


def table(rows):
    """Of the last five minutes of each phase: the mean share of the short branch, and how many bridges had decided
    for it."""
    for case, phases in (("again", (15, 30, 45)), ("late", (15, 30))):
        print(f"\n{case}, minutes {phases}")
        for (count, quanta, exponent), of in style.groups(
                [row for row in rows if row["case"] == case], "branches", "quanta", "exponent").items():
            cells = []
            for until in phases:
                shares = [row["short_share"] for row in of if row["until_min"] == until]
                mean, half = interval(shares)
                decided = sum(share >= DECIDED for share in shares)
                low, high = wilson(decided, len(shares))
                cells.append(f"{mean:.2f} ± {half:.2f} | {decided} ({100 * low:.0f}–{100 * high:.0f} %)")
            print(f"| {count:.0f} | {DEPOSITS[quanta, exponent]} | " + " | ".join(cells) + " |")


FIGURES = {"arms": (draw, "arms.csv", "arms-time.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
