#!/usr/bin/env python3
"""Figures of cleaning: soil, floor, how long zones wait on larger floors, and the reach of proofs.

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "deploy/pictures"))

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402

ROBOTS = style.COLOURS
THRESHOLD_PERCENT = 51  # of soil, the default of --threshold
MAX_CURVES = 24  # beyond, a heat map
MAX_TRACKS = 4


def steps_of(rows, end_s):
    times = style.column(rows, "time_s") + [end_s]
    return times, style.column(rows, "percent") + [rows[-1]["percent"]]


def draw_soil(soil, cleanings, zones):
    end_s = max(style.column(soil, "time_s") + style.column(cleanings, "end_s"))
    by_zone = style.groups(soil, "zone")
    if len(by_zone) > MAX_CURVES:
        return draw_heat(by_zone, end_s)
    most = max(THRESHOLD_PERCENT, max(style.column(soil, "percent")))
    figure, panels = pyplot.subplots(len(by_zone), 1, figsize=(10, 0.62 * len(by_zone) + 1.2),
                                     sharex=True, squeeze=False)
    rates = {row["zone"]: row["rate_percent"] for row in zones}
    for axes, (zone, rows) in zip(panels.flat, by_zone.items()):
        times, percents = steps_of(rows, end_s)
        axes.fill_between(times, percents, step="post", linewidth=0,
                          color=style.GREY if rates[zone] > 5 else style.PALE)
        axes.axhline(THRESHOLD_PERCENT, color=style.VERMILION, linestyle="--", linewidth=0.8)
        for row in cleanings:
            if row["zone"] == zone:
                robot = int(row["robot"]) - 1
                axes.barh(-0.16 * most, row["end_s"] - row["begin_s"], 0.2 * most, row["begin_s"],
                          color=ROBOTS[robot % len(ROBOTS)], alpha=1 if row["done"] else 0.35,
                          hatch="//" if robot % 2 else None, edgecolor="white", linewidth=0.3,
                          label=f"cleaned by robot {robot + 1}")
        axes.set_ylim(-0.28 * most, most)
        axes.set_yticks((0, THRESHOLD_PERCENT))
        axes.set_ylabel(f"zone {zone:g}\n%", rotation=0, labelpad=18, va="center")
        axes.set_xlim(0, end_s)
    axes.set_xlabel("time, s")
    figure.suptitle(f"Soil of each zone; dashed: the threshold, {THRESHOLD_PERCENT} %; "
                    "dark: zones that soil twice as fast")
    style.legend_below(figure, panels.flat)
    return figure


def draw_heat(by_zone, end_s):
    figure, axes = pyplot.subplots(figsize=(10, 6))
    for zone, rows in by_zone.items():
        times, percents = steps_of(rows, end_s)
        shown = axes.pcolormesh(times, [zone - 0.5, zone + 0.5], [percents[:-1]], vmin=0, vmax=100,
                                cmap="cividis_r", rasterized=True)
    axes.invert_yaxis()
    axes.set_xlabel("time, s")
    axes.set_ylabel("zone")
    figure.colorbar(shown, label=f"soil, % (threshold: {THRESHOLD_PERCENT} %)")
    axes.set_title("Soil of each zone")
    return figure


def draw_floor(zones, tracks):
    side = min(abs(a["x_m"] - b["x_m"]) + abs(a["y_m"] - b["y_m"])
               for a in zones for b in zones if a is not b) if len(zones) > 1 else 1
    width = (max(style.column(zones, "x_m")) - min(style.column(zones, "x_m"))) / side + 1
    height = (max(style.column(zones, "y_m")) - min(style.column(zones, "y_m"))) / side + 1
    inches = max(6, min(11, 1.7 * width))
    figure, axes = pyplot.subplots(figsize=(inches, inches * height / width + 1))
    gaps = style.column(zones, "longest_gap_s")
    shades = pyplot.Normalize(min(0.75 * max(gaps), min(gaps)), 2.5 * max(gaps))
    for row in zones:
        axes.add_patch(pyplot.Rectangle(
            (row["x_m"] - side / 2, row["y_m"] - side / 2), side, side, edgecolor=style.GREY,
            facecolor=pyplot.get_cmap("Greys")(shades(row["longest_gap_s"]))))
        few = len(zones) <= 100
        axes.text(row["x_m"] - 0.45 * side, row["y_m"] + 0.43 * side, va="top", weight="bold",
                  fontsize=8, s=f"{row['zone']:g}" + (" (10 %)" if row["rate_percent"] > 5 else ""))
        if few:
            axes.text(row["x_m"] - 0.45 * side, row["y_m"] - 0.45 * side, fontsize=7,
                      s=f"{row['cleanings']:g} times\ngap {row['longest_gap_s']:.0f} s")
    robots = style.groups(tracks, "robot")
    if len(robots) <= MAX_TRACKS:
        for robot, track in robots.items():
            aside = 0.03 * side * (robot - (len(robots) + 1) / 2)  # ways that are the same
            axes.plot([x + aside for x in style.column(track, "x_m")],
                      [y + aside for y in style.column(track, "y_m")], marker="", alpha=0.6,
                      linewidth=0.9, linestyle="-" if robot % 2 else "--",
                      color=ROBOTS[int(robot - 1) % len(ROBOTS)], label=f"robot {robot:g}")
    axes.autoscale_view()
    axes.grid(False)
    style.map_axes(axes)
    axes.set_title("Zone, cleanings, longest time without one: the darker, the longer")
    style.legend_below(figure, [axes])
    return figure


def draw_sweep(rows):
    figure, axes = pyplot.subplots(figsize=(8, 4.4))
    sizes = style.groups(rows, "columns", "rows", "robots")
    for i, (key, label) in enumerate((("by_ideal_cycle", "firmware, in ideal cycles"),
                                      ("by_cycle", "firmware, in its own cycles"),
                                      ("model_by_ideal_cycle", "decision alone, in ideal cycles"))):
        values = [[row[key] for row in runs] for runs in sizes.values()]
        x = [place + 0.08 * (i - 1) for place in range(len(values))]
        style.whiskers(axes, x, values, [sum(of) / len(of) for of in values], [min(of) for of in values],
                       [max(of) for of in values], color=style.COLOURS[i], marker=style.MARKS[i],
                       label=label)
    axes.set_xticks(range(len(sizes)), [f"{c:g}×{r:g}\n{n:g} robots" for c, r, n in sizes])
    axes.set_ylim(0)
    axes.set_xlabel("zones")
    axes.set_ylabel("worst gap, cycles")
    axes.set_title("The longest time without a cleaning: mean, least and most over seeds")
    style.legend_below(figure, [axes])
    return figure


def draw_reach(rows):
    queries = style.groups(rows, "query")
    figure, panels = pyplot.subplots(1, len(queries), figsize=(11, 4), sharey=True, squeeze=False)
    for axes, (query, of_query) in zip(panels.flat, queries.items()):
        for robots, of_robots in style.groups(of_query, "robots").items():
            i = int(robots) - 1
            axes.plot(style.column(of_robots, "zones"), style.column(of_robots, "states"),
                      color=style.COLOURS[i], marker=style.MARKS[i],
                      label=f"{robots:g} robot" + ("s" if robots > 1 else ""))
            unknown = [row for row in of_robots if row["verdict"] == "unknown"]
            axes.scatter(style.column(unknown, "zones"), style.column(unknown, "states"), s=130,
                         facecolors="none", edgecolors=style.VERMILION, zorder=4,
                         label="the memory was not enough" if unknown else None)
        axes.set_yscale("log")
        axes.set_title(query)
        axes.set_xlabel("zones")
    panels.flat[0].set_ylabel("states")
    figure.suptitle("States of a proof, by zones and robots, in 64 MiB")
    style.legend_below(figure, panels.flat)
    return figure


FIGURES = {"cleaning-soil": (draw_soil, "cleaning-soil.csv", "cleaning-cleanings.csv",
                             "cleaning-zones.csv"),
           "cleaning-floor": (draw_floor, "cleaning-zones.csv", "cleaning-tracks.csv"),
           "cleaning-sweep": (draw_sweep, "cleaning-sweep.csv"),
           "cleaning-reach": (draw_reach, "cleaning-reach.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
