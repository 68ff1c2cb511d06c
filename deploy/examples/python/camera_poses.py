#!/usr/bin/env python3
"""Tells the server where robots are, as an overhead camera sees them by ArUco markers.

    camera_poses.py --tracker 127.0.0.1:4960 --link radio-a --corners 0,0,4,3

The configuration needs a port for it:

    [[tracker]]
    name = "camera"
    listen = "127.0.0.1:4960"

A robot carries the marker whose number is its ID, with the marker's upper edge to the front. The
camera looks straight down; its picture's lower left and upper right corners are at --corners on the
map (metres). Replace `Camera` if yours hangs askew: what the rest needs are marker numbers and their
four corners on the map. Needs python3-opencv; --demo drives a marker in a circle without a camera.
"""

import argparse
import math
import pathlib
import sys
import time

try:
    import pheromone
except ImportError:  # in the source tree, where it is not installed
    sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python"))
    import pheromone


class Camera:
    """Finds markers in the pictures of a camera."""

    def __init__(self, number, corners):
        import cv2  # only here: the rest works without
        self.corners = corners
        self.video = cv2.VideoCapture(number)
        markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
        if hasattr(cv2.aruco, "ArucoDetector"):  # OpenCV 4.7 and newer
            self.detect = cv2.aruco.ArucoDetector(markers).detectMarkers
        else:
            self.detect = lambda picture: cv2.aruco.detectMarkers(picture, markers)

    def markers(self):
        """The number of each marker in the next picture, and its corners on the map: upper left,
        upper right, lower right, lower left."""
        good, picture = self.video.read()
        if not good:
            raise SystemExit("the camera gives no picture")
        height, width = picture.shape[:2]
        x0, y0, x1, y1 = self.corners
        found, numbers, _ = self.detect(picture)
        for number, corners in zip([] if numbers is None else numbers.flatten(), found):
            yield int(number), [(x0 + (x1 - x0) * x / width, y1 - (y1 - y0) * y / height)
                                for x, y in corners[0]]


class Demo:
    """One marker, which goes round the middle once in ten seconds."""

    def __init__(self, corners):
        self.centre = ((corners[0] + corners[2]) / 2, (corners[1] + corners[3]) / 2)
        self.start = time.monotonic()

    def markers(self):
        time.sleep(0.1)  # a camera's pace
        angle = (time.monotonic() - self.start) / 10 * math.tau
        x, y = self.centre[0] + math.cos(angle), self.centre[1] + math.sin(angle)
        heading = angle + math.pi / 2
        turned = (math.cos(heading), math.sin(heading))
        yield 7, [(x + 0.05 * (ahead * turned[0] - left * turned[1]),
                   y + 0.05 * (ahead * turned[1] + left * turned[0]))
                  for ahead, left in ((1, 1), (1, -1), (-1, -1), (-1, 1))]


def pose_of(corners):
    """The middle of a marker, and the direction from its lower to its upper edge, in degrees."""
    x = sum(it[0] for it in corners) / 4
    y = sum(it[1] for it in corners) / 4
    (a, b, c, d) = corners
    ahead = (a[0] + b[0] - c[0] - d[0], a[1] + b[1] - c[1] - d[1])
    return x, y, math.degrees(math.atan2(ahead[1], ahead[0]))


def main():
    parser = argparse.ArgumentParser(description="Report robots' poses as a camera sees them.")
    parser.add_argument("--tracker", default="127.0.0.1:4960", help="`listen` of the [[tracker]]")
    parser.add_argument("--link", default="radio-a", help="the link of the robots")
    parser.add_argument("--corners", default="0,0,4,3", help="x,y,x,y of the picture on the map")
    parser.add_argument("--camera", type=int, default=0, help="its number")
    parser.add_argument("--demo", action="store_true", help="without a camera")
    parser.add_argument("--pictures", type=int, default=0, help="stop after so many")
    options = parser.parse_args()
    corners = [float(it) for it in options.corners.split(",")]
    source = Demo(corners) if options.demo else Camera(options.camera, corners)
    with pheromone.Tracker(options.tracker) as tracker:
        count = 0
        while not options.pictures or count < options.pictures:
            tracker.poses([(options.link, number, *pose_of(found))
                           for number, found in source.markers() if 1 <= number <= 254])
            count += 1


if __name__ == "__main__":
    main()
