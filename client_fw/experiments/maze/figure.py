#!/usr/bin/env python3
"""Figure of the maze experiment: paths of ants beside those of A*, before and after a gate moved.

    figure.py [RESULTS] [--out FOLDER] [--pdf]

Also prints the table of README.md.
"""

import pathlib
import statistics
import sys

EXPERIMENTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(EXPERIMENTS), str(EXPERIMENTS.parents[1] / "deploy/pictures")]

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402
from sweeps import interval, wilson  # noqa: E402

PANELS = {0: "constant deposits", 2: "deposits by 1/length²"}
CLOSED_MIN = (30, 60)


def draw(rows, times):
    table(rows)
    figure, panels = pyplot.subplots(1, len(PANELS), figsize=(10, 4), sharey=True)
    for axes, (exponent, title) in zip(panels, PANELS.items()):
        lives = style.groups([row for row in times if row["exponent"] == exponent or row["quanta"] == 0],
                             "quanta", "half_life_s")
        for ((quanta, half_life), of), colour, mark in zip(lives.items(), style.COLOURS[::-1], style.MARKS):
            known = [row for row in of if row["path_m"] is not None]
            axes.errorbar(style.column(known, "minute"), [row["path_m"] / row["a_star_m"] for row in known],
                          [row["half_interval_m"] / row["a_star_m"] for row in known], color=colour, marker=mark,
                          markersize=3, capsize=2, elinewidth=0.8,
                          label=f"half-life {half_life:.0f} s" if quanta else "without a trail")
        best = [(row["minute"], row["best_m"] / row["a_star_m"]) for row in of]
        axes.step([minute for minute, _ in best], [ratio for _, ratio in best], where="mid", color=style.BLACK,
                  linewidth=1, marker="", label="the best way from cell to cell")
        axes.axvspan(*CLOSED_MIN, color=style.PALE, alpha=0.6, linewidth=0, label="the gate is closed")
        axes.set_title(title)
        axes.set_xlabel("time, min")
    panels[0].set_ylim(0)
    panels[0].set_ylabel("length of paths found, over A*'s")
    figure.suptitle("Ants in a maze whose gate moves: means and 95 % confidence intervals of 30 mazes")
    style.legend_below(figure, panels)
    return figure


def table(rows):
    """Of each phase: its last paths over A*'s, and the mazes in which the best way was found again, and when."""
    for (half_life, quanta, exponent), of in style.groups(rows, "half_life_s", "quanta", "exponent").items():
        cells = []
        for phase, of_phase in sorted(style.groups(of, "phase").items()):
            ratios = [row["late_path_m"] / row["a_star_m"] for row in of_phase if row["late_path_m"] is not None]
            mean, half = interval(ratios)
            found = [row["recovery_s"] for row in of_phase if row["recovery_s"] is not None]
            low, high = wilson(len(found), len(of_phase))
            cells.append(f"{mean:.2f} ± {half:.2f} | {len(found)} ({100 * low:.0f}–{100 * high:.0f} %), "
                         + (f"{statistics.median(found) / 60:.0f} min" if found else "–"))
        print(f"| {PANELS[exponent] if quanta else 'none'} | {half_life:.0f} | " + " | ".join(cells) + " |")


FIGURES = {"maze": (draw, "maze.csv", "maze-time.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
