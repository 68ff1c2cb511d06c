#!/usr/bin/env python3
"""Figures of the two trails: the bench, concentrations, shares, trips and lock-in.

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

EXPERIMENTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(EXPERIMENTS), str(EXPERIMENTS.parents[1] / "deploy/pictures")]

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402
from sweeps import wilson  # noqa: E402

import re  # noqa: E402

COLOURS = {"nest": style.GREEN, "a": style.BLUE, "b": style.VERMILION}
ADVICE = {0: style.PALE, 1: style.BLUE, 10: style.VERMILION}  # as its two bits are written
ROBOTS = (style.SKY, style.ORANGE, style.VERMILION)


def draw_bench(rows):
    figure, axes = pyplot.subplots(figsize=(10, 7.6))
    for of in style.groups([row for row in rows if row["what"] == "area"], "number").values():
        axes.plot(style.column(of, "x_m"), style.column(of, "y_m"), color="#f3ead0", marker="",
                  linewidth=26, solid_capstyle="round", zorder=1)
    for (_, name), of in style.groups([row for row in rows if row["what"] == "line"], "number",
                                      "name").items():
        x, y = style.column(of, "x_m"), style.column(of, "y_m")
        axes.plot(x, y, color=COLOURS[name], marker="", linewidth=2, zorder=2,
                  label=name if name == "nest" else f"trail {name.upper()}")
        for i in range(24, len(of) - 1, 36):  # where it leads
            axes.annotate("", (x[i + 1], y[i + 1]), (x[i], y[i]), zorder=2,
                          arrowprops={"arrowstyle": "-|>", "color": COLOURS[name]})
    for row in rows:
        at = (row["x_m"], row["y_m"])
        if row["what"] == "robot":
            axes.add_patch(pyplot.Circle(at, row["value"], facecolor=style.GREY, alpha=0.85, zorder=3))
            axes.text(*at, f"{row['number']:g}", color="white", ha="center", va="center", zorder=4)
        elif row["what"] in ("entrance", "exit", "tag"):
            axes.plot(*at, marker="s" if row["what"] == "entrance" else "o", zorder=4,
                      color=style.YELLOW if row["what"] == "tag" else "white",
                      markersize=10 if row["what"] == "tag" else 7, markeredgecolor=style.BLACK)
            axes.annotate(row["name"], at, (6, 6), textcoords="offset points", weight="bold")
    style.map_axes(axes)
    axes.set_title("The two-trail bench; squares: entrances, where robots wait for green; circles: exits;\n"
                   "shaded: one robot at a time; discs: robots")
    style.legend_below(figure, [axes])
    return figure


def draw_concentrations(samples, marks=()):
    figure, (axes, advice) = pyplot.subplots(2, 1, figsize=(10, 4.4 + 0.12 * len(marks)), sharex=True,
                                             gridspec_kw={"height_ratios": [14, 1]})
    times = style.column(samples, "time_s")
    for trail, key, line in (("A, short; advice 01", "a", "-"), ("B, long; advice 10", "b", "--")):
        axes.plot(times, style.column(samples, f"concentration_{key}"), line, color=COLOURS[key],
                  marker="", label=f"trail {trail}")
    most = max(max(style.column(samples, f"concentration_{key}")) for key in "ab")
    steps = [mark for mark in marks if not re.fullmatch(r"T\d+", mark["what"])]
    for mark in marks:
        if mark in steps:  # what a robot does, a line of text each
            y = most * (1.08 + 0.08 * (len(steps) - steps.index(mark)))
            axes.plot([mark["time_s"]] * 2, [0, y], ":", color=style.GREY, marker="", linewidth=0.8)
            axes.text(mark["time_s"] + 0.005 * times[-1], y, mark["what"], va="center", fontsize=8)
        else:  # the advice changes
            axes.axvline(mark["time_s"], ymax=0.6, color=style.BLACK, linestyle="--", linewidth=0.8)
            axes.text(mark["time_s"] + 0.005 * times[-1], most, mark["what"], weight="bold")
    begin = 0
    for end in range(1, len(samples) + 1):
        if end == len(samples) or samples[end]["advice"] != samples[begin]["advice"]:
            code = int(samples[begin]["advice"])
            until = times[min(end, len(samples) - 1)]
            advice.barh(0, until - times[begin], 1, times[begin], color=ADVICE[code],
                        hatch="//" if code == 10 else None, edgecolor="white", linewidth=0)
            begin = end
    advice.set_yticks([])
    advice.set_ylabel("advice", rotation=0, ha="right", va="center")
    advice.set_ylim(-0.5, 0.5)
    advice.set_xlim(0, times[-1])
    advice.set_xlabel("time, s")
    axes.set_ylabel("concentration, units of energy")
    axes.set_ylim(0)
    axes.set_title("Concentrations of both trails and the advice on tag P (pale: 00)")
    style.legend_below(figure, [axes])
    return figure


def draw_shares(samples):
    """Where robots were, means over a minute; the rest of them is in the nest or on the way home."""
    figure, axes = pyplot.subplots(figsize=(10, 3.2))
    minutes = {}
    for row in samples:
        minutes.setdefault(int(row["time_s"] // 60), []).append(row)
    below = [0] * len(minutes)
    for trail, label, hatch in (("a", "on trail A, short", None), ("b", "on trail B, long", "//")):
        means = [sum(style.column(rows, f"robots_on_{trail}")) / len(rows) for rows in minutes.values()]
        axes.bar([minute + 0.5 for minute in minutes], means, 1, below, color=COLOURS[trail],
                 hatch=hatch, edgecolor="white", linewidth=0, label=label)
        below = [low + mean for low, mean in zip(below, means)]
    axes.set_xlim(0, max(minutes) + 1)
    axes.set_xlabel("time, min")
    axes.set_ylabel("robots")
    axes.set_title("Where the robots were, means over a minute; all others: in the nest or on their way home")
    style.legend_below(figure, [axes])
    return figure


def draw_trips(rows):
    figure, axes = pyplot.subplots(figsize=(6.4, 3.8))
    for trail in "ab":
        for how, line in (("driven", "-"), ("timetable", "--")):
            axes.plot(style.column(rows, "robots"), style.column(rows, f"{how}_{trail}_per_hour"), line,
                      color=COLOURS[trail], marker="o" if trail == "a" else "s",
                      fillstyle="full" if how == "driven" else "none",
                      label=f"trail {trail.upper()}, {'driven' if how == 'driven' else 'by timetable'}")
    axes.set_ylim(0)
    axes.set_xlabel("robots")
    axes.set_ylabel("round trips an hour")
    axes.set_title("Round trips of robots that have locked in on a trail, means")
    style.legend_below(figure, [axes], columns=2)
    return figure


def draw_lock_in(rows):
    cases = style.groups(rows, "deposit", "explore_percent")
    figure, panels = pyplot.subplots(-(-len(cases) // 2), 2, figsize=(10, 3 * -(-len(cases) // 2)),
                                     squeeze=False, sharey=True)
    for axes, ((deposit, explored), of_case) in zip(panels.flat, cases.items()):
        laws = list(style.groups(of_case, "law"))
        for i, (robots, of_robots) in enumerate(style.groups(of_case, "robots").items()):
            places, shares, spans = [], [], []
            for law, of_law in style.groups(of_robots, "law").items():
                on_long = sum(style.column(of_law, "locked_on_long"))
                runs = sum(style.column(of_law, "runs"))
                places.append(laws.index(law) + 0.26 * (i - 1))
                shares.append(100 * on_long / runs)
                spans.append([100 * share for share in wilson(on_long, runs)])
            axes.bar(places, shares, 0.24, color=ROBOTS[i], hatch=(None, "//", "..")[i],
                     edgecolor="white", linewidth=0, label=f"{robots:g} robots")
            axes.errorbar(places, shares, fmt="none", ecolor=style.BLACK, elinewidth=0.8, capsize=2,
                          yerr=[[share - low for share, (low, _) in zip(shares, spans)],
                                [high - share for share, (_, high) in zip(shares, spans)]])
        axes.set_xticks(range(len(laws)), laws)
        axes.set_title(f"{deposit} deposits, {explored:g} % exploration")
    for axes in panels[:, 0]:
        axes.set_ylabel("locked in on the long trail, % of runs")
    figure.suptitle("Locked in on the long trail, with Wilson's 95 % intervals: runs of two hours, "
                    "trails of 20 s and 40 s,\nlifetimes of one deposit 30 to 300 s")
    style.legend_below(figure, panels.flat)
    return figure


FIGURES = {"trails-bench": (draw_bench, "trails-bench.csv"),
           "trails-concentration": (draw_concentrations, "trails-samples.csv"),
           "trails-shares": (draw_shares, "trails-samples.csv"),
           "trails-story": (draw_concentrations, "trails-story.csv", "trails-story-marks.csv"),
           "trails-trips": (draw_trips, "trails-trips.csv"),
           "trails-lock-in": (draw_lock_in, "trails-lock-in.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
