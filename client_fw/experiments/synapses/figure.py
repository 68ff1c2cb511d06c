#!/usr/bin/env python3
"""Figure of the synapses experiment: maps that were learnt, laid and drawn, what they cost, and what evaporation does.

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

SHOWN = ("levels learnt", "laid by ants", "drawn: the path", "levels and weights learnt", "laid by ants, 1/length²",
         "drawn: a slope")
NODES, CELL_M = 13, 0.5


def shares(rows, half_life_s):
    """Of each kind: mean and half interval of the share of robots that come to the goal."""
    return {kind: interval(style.column(of, "share"))
            for kind, of in style.groups([row for row in rows if row["half_life_s"] == half_life_s], "kind").items()}


def draw(rows, experience, nodes, tracks):
    table(rows)
    figure, axes = pyplot.subplots(2, 4, figsize=(12, 6.4), width_ratios=(1, 1, 1, 1.3))
    of_kind, lines = style.groups(nodes, "kind"), style.groups(tracks, "kind")
    for panel, kind in zip(axes[:, :3].flat, SHOWN):
        map_of(panel, of_kind[kind], lines[kind])
        panel.set_title(kind)
    learning, evaporating = axes[:, 3]
    for (kind, of), colour, mark in zip(style.groups(experience, "kind").items(), style.COLOURS, style.MARKS):
        if len(of) > 1:
            learning.errorbar(*(style.column(of, key) for key in ("robot_hours", "share", "half_interval")), label=kind,
                              color=colour, marker=mark, capsize=2, elinewidth=0.8)
    learning.set(xscale="log", ylim=(0, 1), xlabel="robot-hours driven for one map", ylabel="robots that come to the goal",
                 title="what a map costs")
    learning.legend(loc="lower right", fontsize=6)
    for half_life_s, mark in ((0, "o"), (60, "s")):
        found = shares(rows, half_life_s)
        evaporating.errorbar([mean for mean, _ in found.values()], range(len(found)), xerr=[half for _, half in found.values()],
                             linestyle="", marker=mark, capsize=2, elinewidth=0.8,
                             label="after a half-life, and on" if half_life_s else "as it was made")
    evaporating.set(yticks=range(len(found)), yticklabels=list(found), xlim=(0, 1), xlabel="robots that come to the goal",
                    title="what evaporation does")
    evaporating.tick_params(axis="y", labelsize=7)
    evaporating.invert_yaxis()
    evaporating.legend(loc="lower right", fontsize=7)
    figure.suptitle("Maps as exo-synapses: the first of 30 of each kind with eight robots; means and 95 % confidence intervals")
    return figure


def map_of(axes, nodes, tracks):
    levels = [[0.0] * NODES for _ in range(NODES)]
    for row in nodes:
        levels[round(row["y_m"] / CELL_M)][round(row["x_m"] / CELL_M)] = row["level"]
    most = (NODES - 0.5) * CELL_M
    axes.imshow(levels, cmap="Greens", vmin=0, vmax=1.25, origin="lower", extent=2 * (-CELL_M / 2, most))
    axes.add_patch(pyplot.Rectangle((-0.25, 2.75), 4.5, 0.5, color=style.GREY, linewidth=0))  # the wall
    axes.add_patch(pyplot.Circle((1.5, 5.0), 0.4, fill=False, color=style.BLACK))  # the goal
    for of in style.groups(tracks, "robot").values():
        axes.plot(style.column(of, "x_m"), style.column(of, "y_m"), color=style.BLUE, linewidth=0.8, marker="")
        axes.plot(of[0]["x_m"], of[0]["y_m"], color=style.VERMILION, marker="o", markersize=3)
    axes.set(xlim=(-0.5, 6.5), ylim=(-0.5, 6.5))
    axes.grid(False)
    style.map_axes(axes)


def table(rows):
    """Of each kind of map: who comes to the goal, when, and after a half-life."""
    fresh, late = shares(rows, 0), shares(rows, 60)
    for kind, of in style.groups([row for row in rows if row["half_life_s"] == 0], "kind").items():
        times = [row["time_s"] for row in of if row["time_s"] is not None]
        time = "{:.1f} ± {:.1f} s".format(*interval(times)) if len(times) > 1 else "–"
        weights = [interval(style.column(of, side + "_weight"))[0] for side in ("left", "right")]
        print(f"| {kind} | {fresh[kind][0]:.2f} ± {fresh[kind][1]:.2f} | {min(style.column(of, 'share')):.2f} | {time} | "
              f"{late[kind][0]:.2f} ± {late[kind][1]:.2f} | {weights[0]:+.2f}, {weights[1]:+.2f} |")


FIGURES = {"synapses": (draw, "synapses.csv", "synapses-experience.csv", "synapses-maps.csv", "synapses-tracks.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
