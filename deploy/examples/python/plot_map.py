#!/usr/bin/env python3
"""Shows the map of a pheromone with the robots on it, as it is now.

    plot_map.py trail                       in a window; needs python3-matplotlib
    plot_map.py trail --output map.png      as a file
    plot_map.py trail --text                in the terminal, without NumPy and matplotlib
"""

import argparse
import math
import pathlib
import sys

try:
    import pheromone
except ImportError:  # in the source tree, where it is not installed
    sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python"))
    import pheromone

SHADES = " .:-=+*#"


def show_text(found):
    for row in found.values:
        print("".join("X" if math.isnan(level) else
                      SHADES[math.ceil(level / found.maximum * (len(SHADES) - 1))]
                      for level in row).rstrip())


def plot(found, clients, output):
    import matplotlib  # only here: the rest works without
    if output:
        matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots()
    picture = axes.imshow(found.values, extent=found.extent, vmin=0, vmax=found.maximum,
                          cmap="viridis", interpolation="nearest")
    figure.colorbar(picture, label=found.pheromone + ", units")
    for client in clients:
        pose = client["pose"]
        if pose is not None:
            heading = math.radians(pose["heading_deg"])
            axes.quiver(pose["x_m"], pose["y_m"], math.cos(heading), math.sin(heading), color="white")
            axes.annotate(str(client["id"]), (pose["x_m"], pose["y_m"]), color="white")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    if output:
        figure.savefig(output)
    else:
        pyplot.show()


def main():
    parser = argparse.ArgumentParser(description="Show the map of a pheromone.")
    parser.add_argument("pheromone", help="its name or number")
    parser.add_argument("--server", default=pheromone.DEFAULT_ADDRESS,
                        help="http://HOST:PORT or the path of a Unix socket")
    parser.add_argument("--output", help="a .png, .pdf or .svg file instead of a window")
    parser.add_argument("--text", action="store_true", help="letters instead of a picture")
    options = parser.parse_args()
    server = pheromone.Server(options.server)
    found = server.map_as_array(options.pheromone)
    if options.text:
        show_text(found)
    else:
        plot(found, server.clients(), options.output)


if __name__ == "__main__":
    main()
