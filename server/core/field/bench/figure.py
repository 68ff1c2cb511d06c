#!/usr/bin/env python3
"""Figures of the field's benchmark: what a robot-step costs, against one number at a time.

    figure.py [RESULTS] [--out FOLDER] [--pdf]
"""

import pathlib
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parents[3] / "deploy/pictures"))

import figure_style as style  # noqa: E402  (after the path)
from figure_style import pyplot  # noqa: E402

VARIANTS = {"field": "this field", "literal scan": "the paper's scan, literally",
            "SIMD scan": "one-pass SIMD scan of the map",
            "SIMD scan, skipping": "the same, skipping what is out of reach",
            "dense sweep": "dense sweep a frame, stamped cones"}
UNITS = ((1e9, "s"), (1e6, "ms"), (1e3, "µs"), (1, "ns"))


def tick(ns, _):
    size, unit = next((it for it in UNITS if ns >= 0.9995 * it[0]), UNITS[-1])
    return f"{ns / size:g} {unit}"


def figure_of(key, title, x_label, wanted):
    def draw(rows):
        figure, axes = pyplot.subplots(figsize=(8, 5))
        steps = [row for row in rows if row["group"] == "robot-step" and wanted(row)]
        for i, (variant, of) in enumerate(style.groups(steps, "variant").items()):
            of = sorted(of, key=lambda row: row[key])
            style.whiskers(axes, key, of, "median_ns", "p10_ns", "p90_ns", color=style.COLOURS[i],
                           marker=style.MARKS[i], label=VARIANTS.get(variant, variant))
        axes.set_xscale("log")
        axes.set_yscale("log")
        values = sorted({row[key] for row in steps})
        axes.set_xticks(values, [f"{value:g}" for value in values])
        axes.set_xticks([], minor=True)
        axes.yaxis.set_major_formatter(tick)
        axes.set_xlabel(x_label)
        axes.set_ylabel("time of one robot-step")
        axes.set_title(title + ": medians, whiskers from the 10th to the 90th percentile")
        style.legend_below(figure, [axes], columns=2)
        return figure
    return draw


def case(row, **values):
    return all(row[key] == value for key, value in values.items())


FIGURES = {
    "step_over_map_size": (figure_of(
        "nodes", "Robot-step against the size of the map",
        "nodes along a side (100 robots, r = 10)",
        lambda row: case(row, density_percent=0, reach_cells=10, robots=100)), "field_bench.csv"),
    "step_over_density": (figure_of(
        "density_percent", "Robot-step against density",
        "nodes with pheromone, % (1000 x 1000 nodes, 100 robots, r = 10)",
        lambda row: case(row, nodes=1000, reach_cells=10, robots=100) and row["density_percent"] > 0),
        "field_bench.csv"),
    "step_over_reach": (figure_of(
        "reach_cells", "Robot-step against reach",
        "r = c + σ, cells (1000 x 1000 nodes, 100 robots)",
        lambda row: case(row, nodes=1000, density_percent=0, robots=100)), "field_bench.csv"),
    "step_over_robots": (figure_of(
        "robots", "Robot-step against the number of robots",
        "robots, each taking one step a frame (1000 x 1000 nodes, r = 10)",
        lambda row: case(row, nodes=1000, density_percent=0, reach_cells=10)), "field_bench.csv"),
}

if __name__ == "__main__":
    style.main(FIGURES, __doc__, FOLDER.parent / "results")
