"""The look of all figures of experiments and benchmarks, and the command line of the scripts.

    FIGURES = {"bridge-share": (draw_share, "bridge-share.csv", "bridge-runs.csv")}

    if __name__ == "__main__":
        figure_style.main(FIGURES, __doc__)

A function gets the rows of its CSV files and returns a matplotlib figure. The same rows give the
same bytes of SVG: no date, no random ids. Colours are those of Okabe and Ito, which people who are
colour-blind tell apart; marks or dashes say the same again. Needs Debian's python3-matplotlib.
"""

import argparse
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")  # no display

from matplotlib import pyplot  # noqa: E402  (after the choice of the backend)

BLACK, GREY, PALE = "#000000", "#777777", "#dddddd"
BLUE, SKY, GREEN = "#0072b2", "#56b4e9", "#009e73"
ORANGE, VERMILION, PURPLE, YELLOW = "#e69f00", "#d55e00", "#cc79a7", "#f0e442"
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, SKY, PURPLE, GREY)
MARKS = ("o", "s", "D", "^", "v", "P", "X")

pyplot.rcParams.update({
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.prop_cycle": matplotlib.cycler(color=COLOURS, marker=MARKS),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": "medium",
    "figure.constrained_layout.use": True,
    "figure.titlesize": "large",
    "font.family": ["DejaVu Sans"],
    "font.size": 9,
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "lines.markersize": 4,
    "path.simplify": True,
    "pdf.fonttype": 42,
    "savefig.facecolor": "white",
    "svg.fonttype": "none",
    "svg.hashsalt": "pheromone",
})


def read(path):
    """The rows of a CSV file, as dictionaries: numbers where they are, None where it is empty."""
    def value(text):
        try:
            return float(text) if text else None
        except ValueError:
            return text
    with open(path, encoding="utf-8", newline="") as file:
        return [{key: value(text) for key, text in row.items()} for row in csv.DictReader(file)]


def groups(rows, *keys):
    """Rows with the same values of these columns, in the order in which these first appear."""
    found = {}
    for row in rows:
        of = tuple(row[key] for key in keys)
        found.setdefault(of[0] if len(keys) == 1 else of, []).append(row)
    return found


def column(rows, key):
    return [row[key] for row in rows]


def whiskers(axes, x, rows, mean, least, most, **style):
    """Marks at the means, with bars from the least to the most; either may be a column or numbers."""
    def of(what):
        return [row[what] for row in rows] if isinstance(what, str) else what
    middle, low, high = of(mean), of(least), of(most)
    return axes.errorbar(of(x), middle, capsize=2.5, elinewidth=0.9, **style,
                         yerr=[[m - l for m, l in zip(middle, low)],
                               [h - m for m, h in zip(middle, high)]])


def map_axes(axes):
    """A map in metres, seen from above."""
    axes.set_aspect("equal")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")


def legend_below(figure, axes, columns=4):
    """One legend for all panels, each label once, below them."""
    found = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels()):
            found.setdefault(label, handle)
    rows = -(-len(found) // columns)
    below = (0.1 + 0.18 * rows) / figure.get_figheight()  # inches
    figure.get_layout_engine().set(rect=(0, below, 1, 1 - below))
    figure.legend(found.values(), found.keys(), loc="lower center", ncol=columns)


def save(figure, path):
    """As SVG or PDF, by the path's suffix."""
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg"
                   else {"CreationDate": None})


def draw(figures, results, out, suffixes=(".svg",)):
    """Draws the figures whose CSV files are in the folder `results`; returns the paths written."""
    written = []
    for name, (function, *inputs) in figures.items():
        files = [results / file for file in inputs]
        if not all(file.is_file() for file in files):
            continue
        figure = function(*(read(file) for file in files))
        for suffix in suffixes:
            written.append(out / (name + suffix))
            save(figure, written[-1])
        pyplot.close(figure)
    return written


def main(figures, description, results=None):
    """The program of a script beside which `results` is, unless told otherwise."""
    results = results or pathlib.Path(sys.argv[0]).resolve().parent / "results"
    parser = argparse.ArgumentParser(description=description.strip().split("\n")[0])
    parser.add_argument("results", nargs="?", type=pathlib.Path, default=results,
                        help="folder with the CSV files (default: the committed ones)")
    parser.add_argument("--out", type=pathlib.Path, help="folder for the figures (default: the same)")
    parser.add_argument("--pdf", action="store_true", help="write PDF beside the SVG")
    options = parser.parse_args()
    out = options.out or options.results
    out.mkdir(parents=True, exist_ok=True)
    written = draw(figures, options.results, out, (".svg", ".pdf") if options.pdf else (".svg",))
    if not written:
        needed = sorted({file for _, *inputs in figures.values() for file in inputs})
        parser.error(f"{options.results}: no results to draw, expected some of {', '.join(needed)}")
    for path in written:
        print(path)
