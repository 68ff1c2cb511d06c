#!/usr/bin/env python3
"""Your own robot. This one is simulated: let MyRobot ask your odometry and set your motors instead.

    my_robot.py radio-a.pty --start 5 3 0          or udp:HOST:PORT, HOST:PORT, /dev/ttyUSB0
"""
from __future__ import annotations

import argparse
import math
import time

from pheromone.drive import Follower
from pheromone.servers import open_line

TRACK_M = 0.33  # between the wheels


class MyRobot:
    def __init__(self, x_m: float, y_m: float, heading_deg: float) -> None:
        self.x, self.y, self.heading = x_m, y_m, math.radians(heading_deg)
        self.left = self.right = 0.0  # m/s
        self.at = time.monotonic()

    def pose(self) -> tuple[float, float, float]:
        now = time.monotonic()
        elapsed, self.at = min(now - self.at, 0.5), now  # motors without a command soon stop
        ahead = (self.left + self.right) / 2 * elapsed
        self.heading += (self.right - self.left) / TRACK_M * elapsed
        self.x += ahead * math.cos(self.heading)
        self.y += ahead * math.sin(self.heading)
        return self.x, self.y, math.degrees(self.heading)

    def wheels(self, left_mm_s: float, right_mm_s: float) -> None:
        self.pose()  # so far with the speeds of before
        self.left, self.right = left_mm_s / 1000, right_mm_s / 1000


parser = argparse.ArgumentParser(description="Drive a robot along a pheromone path.")
parser.add_argument("line", help="the server: a terminal, HOST:PORT or udp:HOST:PORT")
parser.add_argument("--start", type=float, nargs=3, default=(5, 3, 0), help="x and y in m, degrees")
parser.add_argument("--seconds", type=float, default=math.inf, help="default: until Ctrl-C")
options = parser.parse_args()
robot = MyRobot(*options.start)
with open_line(options.line, baud=9600) as line:
    Follower(line, client_id=7, drive=robot, pheromone=2, released=True).run(options.seconds)
print("stands at x {:.2f} m, y {:.2f} m, heading {:.0f} deg".format(*robot.pose()))
