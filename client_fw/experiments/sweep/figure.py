#!/usr/bin/env python3
"""Figures of the sweeps: one parameter at a time (laws-sweep.csv).

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "deploy/pictures"))

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402

LAWS = {"differential (gain 1)": (style.SKY, "^"), "differential (tuned)": (style.BLUE, "o"),
        "fuzzy (tuned)": (style.ORANGE, "D")}
LABELS = {"cell": "cell size a, m", "core": "core c, m", "sigma": "slope σ, m",
          "speed": "speed K, mm/s", "period": "period, ms", "latency": "server's delay, ms",
          "loss": "frames lost, %", "drift": "odometry: right wheel, %"}
MAX_ERROR_MM = 200  # beyond it a robot has lost the path, and the value is meaningless


def draw_sweep(rows):
    sweeps = style.groups(rows, "parameter")
    columns = -(-len(sweeps) // 2)
    figure, panels = pyplot.subplots(4, columns, figsize=(3 * columns, 10), squeeze=False)
    for panel in panels.flat[len(sweeps) * 2:]:
        panel.set_visible(False)
    for i, (name, points) in enumerate(sweeps.items()):
        error, progress = panels[2 * (i // columns):2 * (i // columns) + 2, i % columns]
        for law, of_law in style.groups(points, "law").items():
            colour, mark = LAWS[law]
            on_path = [row for row in of_law if row["mean_error_mm"] <= MAX_ERROR_MM]
            for axes, shown, mean, deviation in ((error, on_path, "mean_error_mm", "error_deviation_mm"),
                                                 (progress, of_law, "progress_mm_s", "progress_deviation_mm_s")):
                axes.errorbar(style.column(shown, "value"), style.column(shown, mean),
                              style.column(shown, deviation), color=colour, marker=mark, capsize=2,
                              elinewidth=0.8, label=law)
            lost = [row["value"] for row in of_law if row["mean_error_mm"] > MAX_ERROR_MM]
            error.plot(lost, [MAX_ERROR_MM] * len(lost), linestyle="", marker=mark, color=colour,
                       markersize=7, fillstyle="none", label="hollow: beyond the axis" if lost else None)
        error.set_ylim(0, 1.06 * MAX_ERROR_MM)
        progress.set_ylim(0)
        progress.set_xlabel(LABELS[name])
        error.set_xlabel(LABELS[name])
        if i % columns == 0:
            error.set_ylabel("mean error, mm")
            progress.set_ylabel("progress, mm/s")
    figure.suptitle("Following a curve, one parameter at a time: mean and standard deviation over seeds")
    style.legend_below(figure, panels.flat)
    return figure


FIGURES = {"laws-sweep": (draw_sweep, "laws-sweep.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
