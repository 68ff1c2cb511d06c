#!/usr/bin/env python3
"""How far each robot drove in a recording, and how well it kept to its trail. Needs python3-numpy.

    recording.py captures/lab.pcapng
"""
import sys

import numpy
from pheromone.recordings import Recording

recording = Recording(sys.argv[1])
sensed = recording.sensed()
print("link       robot  answers  distance_m  mean_units")
for link, robot in sorted({(str(it["link"]), int(it["robot"])) for it in sensed}):
    rows = sensed[(sensed["link"] == link) & (sensed["robot"] == robot)]
    distance_m = numpy.hypot(numpy.diff(rows["x_m"]), numpy.diff(rows["y_m"])).sum()
    mean = (rows["left"] + rows["right"]).mean() / 2
    print(f"{link:10} {robot:5}  {len(rows):7}  {distance_m:10.3f}  {mean:10.4f}")
if recording.problem:
    sys.exit(f"{sys.argv[1]}: {recording.problem}")
