#!/usr/bin/env python3
"""Figures of the channel: contention (channel.csv), rounds (rounds.csv, rounds-gaps.csv) and bad air
(air.csv).

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "deploy/pictures"))

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402

MAX_LATENCY_MS = 1000
MAX_GAP_S = 3
CARRIER = {1: ("with carrier detect", style.BLUE, "o"), 0: ("without", style.VERMILION, "s")}
ACCESS = {"contention": (style.VERMILION, "s"), "rounds": (style.BLUE, "o")}


def draw_channel(rows):
    timings = style.groups([row for row in rows if row["period_ms"] > 0 and row["hidden_pairs"] == 0],
                           "turnaround_ms", "server_delay_ms")
    figure, panels = pyplot.subplots(2, len(timings), figsize=(3 * len(timings), 6), squeeze=False)
    for (rate, latency), ((turnaround, delay), shown) in zip(panels.T, timings.items()):
        for detect, of_detect in style.groups(shown, "carrier_detect").items():
            label, colour, mark = CARRIER[detect]
            robots = style.column(of_detect, "robots")
            rate.plot(robots, style.column(of_detect, "bound_per_s"), ":", color=colour, marker="",
                      label=f"bound {label}")
            style.whiskers(rate, robots, of_detect, "goodput_per_s", "worst_goodput_per_s",
                           "goodput_per_s", color=colour, marker=mark, label=label)
            latency.plot(robots, style.column(of_detect, "p50_ms"), color=colour, marker=mark,
                         label=label)
            latency.plot(robots, style.column(of_detect, "p99_ms"), "--", color=colour, marker=mark,
                         fillstyle="none", label=f"99th percentile {label}")
        rate.set_title(f"T_t {turnaround:g} ms, D_s {delay:g} ms; C_1 = {shown[0]['peak_per_s']:.1f}/s")
        rate.set_ylim(0)
        latency.set_ylim(0, MAX_LATENCY_MS)
        latency.set_xlabel("robots")
    panels[0][0].set_ylabel("answers a second (whisker: worst seed)")
    panels[1][0].set_ylabel("from due to answered, median, ms")
    figure.suptitle("How many robots a channel can serve: one request every 200 ms")
    style.legend_below(figure, panels.flat, columns=3)
    return figure


def draw_rounds(rows, gaps):
    plain = [row for row in rows if row["hidden_pairs"] == 0 and row["frame_loss_percent"] == 0 and
             row["simple"] == 0 and row["together"] == 0]
    timings = style.groups(plain, "turnaround_ms")
    figure, panels = pyplot.subplots(2, len(timings) + 1, figsize=(3.4 * (len(timings) + 1), 6),
                                     squeeze=False)
    for (rate, gap), (turnaround, shown) in zip(panels.T, timings.items()):
        for access, of_access in style.groups(shown, "access").items():
            colour, mark = ACCESS[access]
            robots = style.column(of_access, "robots")
            style.whiskers(rate, robots, of_access, "goodput_per_s", "worst_goodput_per_s",
                           "goodput_per_s", color=colour, marker=mark, label=access)
            gap.plot(robots, [ms / 1000 for ms in style.column(of_access, "longest_gap_ms")],
                     color=colour, marker=mark, label=access)
        rate.plot(robots, style.column(of_access, "peak_per_s"), "--", color=style.GREY, marker="",
                  label="C_1: one exchange after the other")
        rate.plot(robots, style.column(of_access, "bound_per_s"), ":", color=style.VERMILION,
                  marker="", label="bound of contention")
        rate.set_title(f"T_t = {turnaround:g} ms")
        rate.set_ylim(0)
        gap.set_ylim(0, MAX_GAP_S)
        gap.set_xlabel("robots")
    panels[0][0].set_ylabel("answers a second (whisker: worst seed)")
    panels[1][0].set_ylabel("longest gap between answers, s")
    share = panels[0][-1]
    for (access, loss), points in style.groups(gaps, "access", "frame_loss_percent").items():
        share.plot([ms / 1000 for ms in style.column(points, "gap_ms")],
                   style.column(points, "share"), marker="", color=ACCESS[access][0],
                   linestyle="--" if loss else "-",
                   label=f"{access}, {loss:g} % lost" if loss else access)
    share.set_title("16 robots")
    share.set_xlim(0, MAX_GAP_S)
    share.set_ylim(0, 1.02)
    share.set_xlabel("gap between a robot's answers, s")
    share.set_ylabel("share of gaps up to that")
    panels[1][-1].set_visible(False)
    figure.suptitle("Rounds and contention: one request every 200 ms from each robot")
    style.legend_below(figure, panels.flat)
    return figure


def draw_air(rows):
    independent = [row for row in rows if row["air"] == "-" or
                   row["air"] == f"{row['byte_error_percent']:g} %"]
    shown = [row for row in independent if row["robots"] == 8]
    timings = style.groups(shown, "turnaround_ms", "adapter_ms")
    figure, panels = pyplot.subplots(2, len(timings), figsize=(3 * len(timings), 6), squeeze=False)
    for (rate, gap), ((turnaround, adapter), of_timing) in zip(panels.T, timings.items()):
        for access, of_access in style.groups(of_timing, "access").items():
            colour, mark = ACCESS[access]
            damaged = style.column(of_access, "byte_error_percent")
            style.whiskers(rate, damaged, of_access, "goodput_per_s", "worst_goodput_per_s",
                           "goodput_per_s", color=colour, marker=mark, label=access)
            gap.plot(damaged, [ms / 1000 for ms in style.column(of_access, "longest_gap_ms")],
                     color=colour, marker=mark, label=access)
        rate.plot(damaged, style.column(of_access, "b1_per_s"), "--", color=style.GREY, marker="",
                  label="B_1: one exchange at a time, losses known at once")
        rate.set_title(f"T_t {turnaround:g} ms, adapter {adapter:g} ms")
        rate.set_ylim(0, 42)
        gap.set_ylim(0, 12)
        gap.set_xlabel("bytes damaged, %")
    panels[0][0].set_ylabel("answers a second (whisker: worst seed)")
    panels[1][0].set_ylabel("longest gap between answers, s")
    figure.suptitle("Eight robots in bad air: one request every 200 ms from each")
    style.legend_below(figure, panels.flat)
    return figure


FIGURES = {"air": (draw_air, "air.csv"),
           "channel": (draw_channel, "channel.csv"),
           "rounds": (draw_rounds, "rounds.csv", "rounds-gaps.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
