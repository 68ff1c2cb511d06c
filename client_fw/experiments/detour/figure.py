#!/usr/bin/env python3
"""Figures of the detour: tracks of the robots around the repellent (detour-tracks.csv).

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "deploy/pictures"))

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402


def draw_tracks(tracks, plan):
    figure, axes = pyplot.subplots(figsize=(9, 5))
    path = [row for row in plan if row["what"] == "path"]
    axes.plot(style.column(path, "x_m"), style.column(path, "y_m"), "--", color=style.BLACK,
              marker="", label="path", zorder=3)
    for row in plan:
        if row["what"] == "repellent":
            axes.add_patch(pyplot.Circle((row["x_m"], row["y_m"]), row["radius_m"], alpha=0.6,
                                         facecolor=style.PURPLE, label="core of the repellent"))
    for senses, runs in style.groups(tracks, "senses").items():
        seeds = style.groups(runs, "seed")
        label = (f"{len(seeds)} runs that sense the path alone" if senses == "path" else
                 f"{len(seeds)} runs that sense path − {runs[0]['weight']:g} · repellent")
        for track in seeds.values():
            axes.plot(style.column(track, "x_m"), style.column(track, "y_m"), marker="",
                      color=style.VERMILION if senses == "path" else style.BLUE, linewidth=0.8,
                      linestyle="--" if senses == "path" else "-", label=label,
                      zorder=2.5 if senses == "path" else 2)
    style.map_axes(axes)
    axes.set_title("Around a repellent and back to the path")
    style.legend_below(figure, [axes], columns=2)
    return figure


FIGURES = {"detour": (draw_tracks, "detour-tracks.csv", "detour-map.csv")}

if __name__ == "__main__":
    style.main(FIGURES, __doc__)
