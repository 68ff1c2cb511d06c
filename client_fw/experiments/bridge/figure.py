#!/usr/bin/env python3
"""Figures of the double bridge: where swarms ended, and how they came there.

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

EXPERIMENTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(EXPERIMENTS), str(EXPERIMENTS.parents[1] / "deploy/pictures")]

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402
from sweeps import Z, wilson  # noqa: E402

OUTCOMES = {"short": (style.BLUE, "o"), "undecided": (style.GREY, "D"), "long": (style.VERMILION, "s")}
CONTROLS = 6  # the base and the controls come first
BINS = 20
# Of the base case, by level of the lab: whether it is of bridge_lab.py, and its experiment.
LEVELS = {"field": (True, "base"), "firmware": (False, "base"), "radio": (False, "over the radio")}


def draw_shares(minutes, runs):
    """Mean and deviation over time, and at the right where the swarms ended."""
    ended = style.groups(runs, "experiment")
    shown = list(style.groups(minutes, "experiment").items())[:CONTROLS]
    figure, panels = pyplot.subplots(-(-len(shown) // 2), 4, figsize=(10, 3 * -(-len(shown) // 2)),
                                     squeeze=False, gridspec_kw={"width_ratios": [5, 1, 5, 1]})
    for panel in panels.flat[2 * len(shown):]:
        panel.set_visible(False)
    for i, (name, rows) in enumerate(shown):
        time, final = panels.flat[2 * i], panels.flat[2 * i + 1]
        x = [row["minute"] + 0.5 for row in rows]
        low = [100 * max(0, row["share"] - row["deviation"]) for row in rows]
        high = [100 * min(1, row["share"] + row["deviation"]) for row in rows]
        time.fill_between(x, low, high, color=style.SKY, alpha=0.4, linewidth=0)
        time.plot(x, [100 * row["share"] for row in rows], color=style.BLACK, marker="")
        counts = {key: len(of) for key, of in style.groups(ended[name], "outcome").items()}
        time.set_title(f"{name}: " + ", ".join(f"{counts.get(key, 0)} {key}" for key in OUTCOMES))
        final.hist([[100 * run["final_share"] for run in ended[name] if run["outcome"] == key]
                    for key in OUTCOMES], bins=BINS, range=(0, 100), stacked=True,
                   orientation="horizontal", color=[colour for colour, _ in OUTCOMES.values()],
                   label=list(OUTCOMES))
        for axes in (time, final):
            axes.set_ylim(0, 100)
            axes.set_yticks((0, 20, 50, 80, 100))
        final.set_yticklabels([])
        if i % 2 == 0:
            time.set_ylabel("short branch, % of choices")
        if i >= len(shown) - 2:
            time.set_xlabel("time, min")
            final.set_xlabel("swarms")
    figure.suptitle("Choices of the short branch: mean ± standard deviation over swarms; "
                    "right: each swarm's last quarter")
    style.legend_below(figure, panels.flat)
    return figure


def draw_outcomes(rows, runs):
    names = style.column(rows, "experiment")
    figure, (bars, dots) = pyplot.subplots(1, 2, figsize=(10, 1.4 + 0.28 * len(names)), sharey=True)
    left = [0] * len(rows)
    for key, (colour, _) in OUTCOMES.items():
        width = [100 * row[key] / row["runs"] for row in rows]
        bars.barh(names, width, left=left, color=colour, label=key)
        for y, (row, start, wide) in enumerate(zip(rows, left, width)):
            if wide >= 6:
                bars.text(start + wide / 2, y, f"{row[key]:g}", ha="center", va="center",
                          color="white", fontsize=8)
        left = [start + wide for start, wide in zip(left, width)]
    short = [100 * row["p_short"] for row in rows]
    bars.errorbar(short, names, fmt="none", ecolor=style.BLACK, capsize=2.5, elinewidth=0.9,
                  xerr=[[100 * (row["p_short"] - row["p_short_least"]) for row in rows],
                        [100 * (row["p_short_most"] - row["p_short"]) for row in rows]],
                  label="Wilson's 95 % interval of short")
    for y, name in enumerate(names):
        swarms = [run for run in runs if run["experiment"] == name]
        for key, (colour, mark) in OUTCOMES.items():
            of = [(100 * run["final_share"], y + 0.5 * (run["seed"] / len(swarms) - 0.5))
                  for run in swarms if run["outcome"] == key]
            dots.plot([x for x, _ in of], [at for _, at in of], mark, color=colour, markersize=1.5,
                      alpha=0.5, markeredgewidth=0)
    bars.set_ylim(len(names) - 0.4, -0.6)
    bars.set_xlim(0, 100)
    dots.set_xticks((0, 20, 50, 80, 100))
    bars.set_xlabel("swarms, %")
    dots.set_xlabel("each swarm's choices of the short branch in the last quarter, %")
    figure.suptitle("Where the swarms ended")
    style.legend_below(figure, [bars])
    return figure


def draw_choices(rows):
    figure, axes = pyplot.subplots(figsize=(5, 4.6))
    model = [i / 100 for i in range(101)]
    axes.plot([100 * a for a in model], [100 * a * a / (a * a + (1 - a) ** 2) for a in model], "--",
              color=style.GREY, marker="", label="A² / (A² + B²): Deneubourg et al. 1990")
    chosen = [row for row in rows if row["choices"] > 0]
    shares = [row["took_short"] / row["choices"] for row in chosen]
    x = [50 * (row["trail_from"] + row["trail_to"]) for row in chosen]
    errors = [196 * (share * (1 - share) / row["choices"]) ** 0.5
              for share, row in zip(shares, chosen)]
    axes.errorbar(x, [100 * share for share in shares], errors, fmt="none", ecolor=style.BLUE,
                  capsize=2.5, elinewidth=0.9)
    most = max(style.column(chosen, "choices"))
    axes.scatter(x, [100 * share for share in shares], marker="o", color=style.BLUE, alpha=0.7,
                 s=[10 + 150 * row["choices"] / most for row in chosen],
                 label="robots, 95 % interval; area: number of choices")
    axes.set_xlabel("share of the trail at the short branch's entry, %")
    axes.set_ylabel("choices of the short branch, %")
    axes.set_title("What a robot chooses")
    style.legend_below(figure, [axes], columns=1)
    return figure


def draw_arena(rows):
    moments = style.groups(rows, "seed", "time_s", "outcome")
    figure, panels = pyplot.subplots(-(-len(moments) // 2), 2, squeeze=False,
                                     figsize=(10, 3 * -(-len(moments) // 2)))
    for panel in panels.flat[len(moments):]:
        panel.set_visible(False)
    for axes, ((seed, time_s, outcome), at) in zip(panels.flat, moments.items()):
        for of in style.groups([row for row in at if row["what"] == "corridor"], "number").values():
            axes.plot(style.column(of, "x_m"), style.column(of, "y_m"), "--", color=style.GREY,
                      marker="", linewidth=0.8)
        nodes = [row for row in at if row["what"] == "node"]
        shown = axes.scatter(style.column(nodes, "x_m"), style.column(nodes, "y_m"), marker="s", s=14,
                             c=[100 * value for value in style.column(nodes, "value")],
                             cmap="cividis_r", vmin=0, vmax=100, linewidths=0)
        for row in at:
            if row["what"] == "robot":
                axes.plot(row["x_m"], row["y_m"], color=style.VERMILION, markersize=8,
                          marker=(3, 0, row["value"] - 90), markeredgecolor=style.BLACK)
            elif row["what"] in ("nest", "food"):
                axes.annotate(row["what"], (row["x_m"], row["y_m"]), (0, 10), ha="center",
                              textcoords="offset points", weight="bold")
        style.map_axes(axes)
        axes.set_title(f"seed {seed:g} after {time_s:g} s, ends on the {outcome} branch")
    figure.colorbar(shown, ax=panels, label="trail, % of a full node", shrink=0.7)
    figure.suptitle("The double bridge and its trails; triangles: robots")
    return figure


def draw_levels(minutes, rows, lab_minutes, lab_rows):
    """The base case at each level of the lab: choices over time, and where the swarms ended."""
    figure, (time, ended) = pyplot.subplots(1, 2, figsize=(10, 3.6), gridspec_kw={"width_ratios": [3, 2]})
    for (level, (in_lab, name)), colour, mark in zip(LEVELS.items(), style.COLOURS, style.MARKS):
        row, = (row for row in (lab_rows if in_lab else rows) if row["experiment"] == name)
        of = [it for it in (lab_minutes if in_lab else minutes) if it["experiment"] == name]
        x, share = [it["minute"] + 0.5 for it in of], [100 * it["share"] for it in of]
        half = [100 * Z * it["deviation"] / row["runs"] ** 0.5 for it in of]
        time.plot(x, share, color=colour, marker=mark, label=level)
        time.fill_between(x, [a - b for a, b in zip(share, half)], [a + b for a, b in zip(share, half)], color=colour,
                          alpha=0.15, linewidth=0)
        decided = row["short"] + row["long"]
        for y, (part, whole) in enumerate(((row["short"], decided), (row["short"], row["runs"]), (decided, row["runs"]))):
            low, high = wilson(part, whole)
            ended.errorbar(100 * part / whole, y + 0.2 * (list(LEVELS).index(level) - 1), color=colour, marker=mark,
                           capsize=2.5, xerr=[[100 * (part / whole - low)], [100 * (high - part / whole)]])
    time.set_ylim(40, 80)
    time.set_xticks(range(0, 21, 5))
    time.set_xlabel("time, min")
    time.set_ylabel("short branch, % of choices")
    time.set_title("choices: mean over swarms and its 95 % interval")
    ended.set_yticks((0, 1, 2), ("short,\nof decided", "short,\nof all", "decided,\nof all"))
    ended.set_ylim(2.5, -0.5)
    ended.set_xlim(0, 100)
    ended.set_xlabel("swarms, %")
    ended.set_title("where they ended, Wilson's 95 % interval")
    figure.suptitle("The base case at the levels of the lab")
    style.legend_below(figure, [time])
    return figure


FIGURES = {"bridge-share": (draw_shares, "bridge-share.csv", "bridge-runs.csv"),
           "bridge-outcomes": (draw_outcomes, "bridge.csv", "bridge-runs.csv"),
           "bridge-levels": (draw_levels, "bridge-share.csv", "bridge.csv", "bridge-lab-share.csv", "bridge-lab.csv"),
           "bridge-choices": (draw_choices, "bridge-choices.csv"),
           "bridge-arena": (draw_arena, "bridge-arena.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
