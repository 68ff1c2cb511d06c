#!/usr/bin/env python3
"""Figures of path following: the errors of all runs (path-runs.csv).

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "deploy/pictures"))

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402

LAWS = {"differential": (style.BLUE, "o"), "paper": (style.VERMILION, "s"),
        "careful": (style.GREEN, "D")}


def draw_errors(rows):
    figure, (error, progress) = pyplot.subplots(1, 2, figsize=(9, 3.6))
    paths = list(style.groups(rows, "path"))
    laws = list(style.groups(rows, "law"))
    for (path, law), runs in style.groups(rows, "path", "law").items():
        place = paths.index(path) + 0.3 * (laws.index(law) - (len(laws) - 1) / 2)
        colour, mark = LAWS[law]
        label = f"law {law}" if path == paths[0] else None
        for axes, key in ((error, "late_mean_error_mm"), (progress, "progress_percent")):
            values = style.column(runs, key)
            spread = [place + 0.12 * (i / max(1, len(values) - 1) - 0.5) for i in range(len(values))]
            axes.plot(spread, values, mark, color=colour, markersize=3, alpha=0.6, label=label)
            axes.hlines(sum(values) / len(values), place - 0.1, place + 0.1, color=style.BLACK)
    for axes in (error, progress):
        axes.set_xticks(range(len(paths)), paths)
        axes.set_ylim(0)
    error.set_ylabel("mean error over the second half, mm")
    progress.set_ylabel("progress, % of K·t")
    figure.suptitle("Path following: each mark is a run, each bar the mean of its seeds")
    style.legend_below(figure, [error])
    return figure


FIGURES = {"path-errors": (draw_errors, "path-runs.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
