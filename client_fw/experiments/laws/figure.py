#!/usr/bin/env python3
"""Figures of the steering laws: laws.csv, laws-search.csv, laws-tracks.csv.

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "deploy/pictures"))

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402

LAWS = {"paper": (style.VERMILION, "s"), "differential (gain 1)": (style.SKY, "^"),
        "differential (tuned)": (style.BLUE, "o"), "fuzzy (tuned)": (style.ORANGE, "D")}
SEARCHED = {"differential": "differential (tuned)", "fuzzy": "fuzzy (tuned)"}


def draw_laws(rows):
    figure, panels = pyplot.subplots(1, 2, figsize=(10, 4))
    curves = list(style.groups(rows, "curve"))
    for law, of_law in style.groups(rows, "law").items():
        colour, mark = LAWS[law]
        places = [curves.index(row["curve"]) + 0.18 * (list(LAWS).index(law) - 1.5)
                  for row in of_law]
        for axes, mean, deviation in ((panels[0], "mean_error_mm", "error_deviation_mm"),
                                      (panels[1], "progress_mm_s", "progress_deviation_mm_s")):
            axes.errorbar(places, style.column(of_law, mean), style.column(of_law, deviation),
                          color=colour, fmt=mark, capsize=2.5, label=law)
    for axes, label in zip(panels, ("mean error, mm", "progress along the curve, mm/s")):
        axes.set_xticks(range(len(curves)), curves, rotation=20)
        axes.set_ylabel(label)
        axes.set_ylim(0)
    figure.suptitle("Steering laws on curves: mean and standard deviation over seeds")
    style.legend_below(figure, panels)
    return figure


def draw_search(rows):
    figure, axes = pyplot.subplots(figsize=(6, 4))
    for law, tried in style.groups(rows, "law").items():
        colour, mark = LAWS[SEARCHED[law]]
        axes.plot(style.column(tried, "progress_mm_s"), style.column(tried, "mean_error_mm"), mark,
                  color=colour, alpha=0.3, markersize=3, markeredgewidth=0, label=law)
        best = [row for row in tried if row["best"] == 1]
        axes.plot(style.column(best, "progress_mm_s"), style.column(best, "mean_error_mm"), mark,
                  color=colour, markeredgecolor=style.BLACK, markersize=8, label=f"{law}, best")
    axes.set_ylim(0, 150)
    axes.set_xlabel("progress, mm/s")
    axes.set_ylabel("mean error, mm")
    axes.set_title("Tried by the searches")
    style.legend_below(figure, [axes])
    return figure


def draw_tracks(rows):
    figure, axes = pyplot.subplots(figsize=(7, 4.5))
    for law, of_law in style.groups(rows, "law").items():
        for seed, track in style.groups(of_law, "seed").items():
            x, y = style.column(track, "x_m"), style.column(track, "y_m")
            if law == "path":
                axes.plot(x, y, "--", color=style.BLACK, marker="", linewidth=1, label="the curve")
            else:
                colour, mark = LAWS[law]
                axes.plot(x, y, color=colour, marker=mark, markevery=40, linewidth=1, label=law)
    style.map_axes(axes)
    axes.set_title("Two runs of each law on a curve not used for tuning")
    style.legend_below(figure, [axes], columns=3)
    return figure


FIGURES = {"laws": (draw_laws, "laws.csv"),
           "laws-search": (draw_search, "laws-search.csv"),
           "laws-eight": (draw_tracks, "laws-tracks.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
