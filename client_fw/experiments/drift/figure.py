#!/usr/bin/env python3
"""Figure of the drift experiment: what ants carry, by their odometry's error and the source of their positions; paths and
stops at each level of the lab, by the radio's loss.

    figure.py [RESULTS] [--out FOLDER] [--pdf]

Also prints the tables of README.md; what collapsed is bold.
"""

import pathlib
import statistics
import sys

EXPERIMENTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(EXPERIMENTS), str(EXPERIMENTS.parents[1] / "deploy/pictures")]

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402
from sweeps import interval  # noqa: E402

LEVELS = {"radio": (style.BLACK, "o"), "firmware": (style.PURPLE, "s"), "field": (style.SKY, "D")}
PATHS = (("path_error_mm", "distance from the path, mm"), ("fail_safe_stops", "fail-safe stops of ten robots in 30 s"))


def found(rows, key, measure):
    return {of: interval(style.column(group, measure)) for of, group in style.groups(rows, key).items()}


def bars(axes, places, values, **look):
    axes.errorbar(places, [mean for mean, _ in values], [half for _, half in values], capsize=2.5, elinewidth=0.9, **look)


def draw_forage(axes, rows):
    measure = "loads_per_robot_minute"
    bare, rows = ([row for row in rows if (row["quanta"] > 0) == trail] for trail in (False, True))
    ideal, half = interval([row[measure] for row in rows if (row["source"], row["bias"], row["lost"]) == ("odometry", 0, 0)])
    print(f"\nideal {ideal:.4f} ± {half:.4f}; without a trail:")
    for (source, bias), of in style.groups(bare, "source", "bias").items():
        print("{} {:g} %: {:.4f} ± {:.4f}".format(source, 100 * bias, *interval(style.column(of, measure))))
    alone, _ = interval([row[measure] for row in bare if row["bias"] == 0])
    biases = sorted(style.groups(rows, "bias"))
    for number, (source, of_source) in enumerate(style.groups(rows, "source").items()):
        for lost, of_lost in style.groups(of_source, "lost").items():
            values = found(of_lost, "bias", measure)
            if source == "tracker":  # at any error
                values = {bias: values[0] for bias in biases}
            places = [biases.index(bias) + 0.06 * number - 0.09 for bias in values]
            bars(axes, places, values.values(), color=style.COLOURS[number], marker=style.MARKS[number],
                 linestyle="--" if lost else "-", markerfacecolor="white" if lost else None,
                 label="dashed: 5 % lost" if lost else source)
            cells = {bias: ("**{:.3f} ± {:.3f}**" if mean < ideal / 2 else "{:.3f} ± {:.3f}").format(mean, half)
                     for bias, (mean, half) in values.items()}
            print(f"| {source} | {100 * lost:.0f} % | " + " | ".join(cells.get(bias, "") for bias in biases) + " |")
    axes.axhline(ideal / 2, color=style.BLACK, linewidth=1, linestyle=":", label="half of the ideal's")
    axes.axhline(alone, color=style.GREY, linewidth=1, linestyle="-.", label="ideal, without a trail")
    axes.set_xticks(range(len(biases)), [f"{100 * bias:g}" for bias in biases])
    axes.set_ylim(0)
    axes.set_xlabel("odometry's error, % of a wheel's length")
    axes.set_ylabel("loads a robot and minute")


def draw_levels(axes, rows, measure):
    print(f"\n{measure}")
    for bias, of_bias in sorted(style.groups(rows, "bias").items()):
        if measure == "fail_safe_stops" and bias:
            continue  # the same as without an error: the radio does not know of it
        for level, (colour, mark) in LEVELS.items():
            of_level = [row for row in of_bias if row["level"] == level]
            if not of_level:
                continue
            values = found(of_level, "lost", measure)
            places = [place + 0.08 * list(LEVELS).index(level) - 0.08 for place in range(len(values))]
            bars(axes, places, values.values(), color=colour, marker=mark, label=f"level {level}")
            print(f"| {100 * bias:g} % | {level} | "
                  + " | ".join(f"{mean:.1f} ± {half:.1f}" for mean, half in values.values()) + " |")
    axes.set_xticks(range(len(values)), [f"{100 * lost:.0f}" for lost in values])
    axes.set_xlabel("frames lost, %")


def draw(forage, levels):
    figure, panels = pyplot.subplots(1, 3, figsize=(10, 4.2), width_ratios=(1.6, 1, 1))
    draw_forage(panels[0], forage)
    for axes, (measure, label) in zip(panels[1:], PATHS):
        draw_levels(axes, levels, measure)
        axes.set_ylabel(label)
    panels[1].set_yscale("log")
    panels[1].set_ylim(10, 1000)
    for bias, of in style.groups(levels, "bias").items():
        at = 1.2 * statistics.fmean(style.column(of, "path_error_mm"))
        panels[1].annotate(f"odometry's error {100 * bias:g} %", (0.5, at), ha="center", va="bottom")
    figure.suptitle("Drift and radio: means and 95 % confidence intervals of 30 seeds")
    style.legend_below(figure, panels, 5)
    return figure


FIGURES = {"drift": (draw, "forage.csv", "levels.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
