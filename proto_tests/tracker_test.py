#!/usr/bin/env python3
"""pheromone-tracker as it is shipped: a real server, rendered pictures, sheets, the commands of its
page. The board is photographed by this script, with formulas of its own; the camera is camera_shim.c.

    tracker_test.py BIN_DIR CAMERA_SHIM
"""

import json
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

import numpy

sys.dont_write_bytecode = True
from operated_daemon import ROOM, await_that, serve_class  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402

SOURCE = pathlib.Path(__file__).resolve().parents[1] / "client_fw/tracker"
EXAMPLE = SOURCE / "examples/ceiling.toml"
CAMERA = pathlib.Path("/dev/video0")
BIN = pathlib.Path()
SHIM = pathlib.Path()
CONFIG = ROOM + """[[tracker]]
name = "ceiling"
listen = "127.0.0.1:0"
valid_s = 3600
"""


def robots(numbers):
    return "".join(f'[[robot]]\ntag = {it}\nlink = "radio-a"\nheight_m = 0.25\n' for it in numbers)


class WithFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = pathlib.Path(folder.name)
        (self.work / "ceiling.toml").write_text(EXAMPLE.read_text())

    def tracker(self, *arguments, status=0, **environment):
        ended = subprocess.run([BIN / "pheromone-tracker", *arguments], cwd=self.work, text=True,
                               capture_output=True, timeout=300, env={**os.environ, **environment})
        self.assertEqual(ended.returncode, status, ended.stdout + ended.stderr)
        return ended.stdout if status == 0 else ended.stderr


class ServerTest(WithFolder):
    @classmethod
    def setUpClass(cls):
        serve_class(cls, BIN, CONFIG)
        cls.port = re.search(r"ceiling: tracker: .*?127\.0\.0\.1:(\d+)", cls.daemon.log())[1]
        line = open_terminal(cls.folder / "radio-a.pty")
        cls.addClassCleanup(line.close)
        for number in range(1, 13):
            robot = Client(line, number, timeout=60)
            robot.hello(nonce=number)
            robot.sense(1, 100, 100, 0)

    def setUp(self):
        super().setUp()
        text = EXAMPLE.read_text().replace("127.0.0.1:4960", f"127.0.0.1:{self.port}")
        text = text[:text.index("[[robot]]")] + robots(range(1, 13))
        (self.work / "ceiling.toml").write_text(text)

    def poses(self):
        """Of the robots that the tracker saw."""
        clients = json.loads(self.daemon.call("GET", "/api/v1/clients")[1])["clients"]
        return {it["id"]: it["pose"] for it in clients
                if it["pose"] and it["pose"]["source"] == "tracker"}

    def assert_on_the_ellipse(self):
        """Half axes 0.7 (3.6, 2.7) / 2 about (2, 1.5), one behind the other."""
        angles = {}
        for number, pose in self.poses().items():
            x, y = (pose["x_m"] - 2) / 1.26, (pose["y_m"] - 1.5) / 0.945
            self.assertAlmostEqual(math.hypot(x, y), 1, delta=0.005)
            angles[number] = math.atan2(y, x)
            heading = math.atan2(0.945 * x, -1.26 * y)
            self.assertLess(abs(math.remainder(math.radians(pose["heading_deg"]) - heading,
                                               math.tau)), math.radians(1))
        for number in range(2, 13):
            ahead = math.remainder(angles[number] - angles[number - 1], math.tau)
            self.assertAlmostEqual(ahead, math.tau / 12, delta=0.01)

    def test_the_server_knows_where_the_camera_sees_robots(self):
        said = self.tracker("run", "ceiling.toml", "--simulate", "--count", "4")
        await_that(lambda: len(self.poses()) == 12, lambda: f"poses of 12 robots: {said}")
        self.assert_on_the_ellipse()
        self.assertRegex(said, r"^ +[\d.]+ s  [\d.]+ pictures/s, \d+ ms each; a picture has 6\.0 of 6 "
                         r"floor tags, 12\.0 of 12 robots; camera 0\.\d+ px, robots 0\.\d+ px; errors: "
                         r"median [0-4]\.\d mm, 0\.\d+ degrees\n$")
        # And from a file, of the first moment: robot 1 is at the right end of the ellipse.
        self.tracker("take", "ceiling.toml", "one.png", "--simulate")
        self.tracker("run", "ceiling.toml", "--pictures", "one.png")
        await_that(lambda: abs(self.poses()[1]["x_m"] - 3.26) < 0.005
                   and abs(self.poses()[1]["y_m"] - 1.5) < 0.005, lambda: str(self.poses()[1]))

    def test_a_signal_ends_it_well(self):
        program = subprocess.Popen(
            [BIN / "pheromone-tracker", "run", "ceiling.toml", "--simulate", "--status", "0.1"],
            cwd=self.work, text=True, stdout=subprocess.PIPE)
        self.addCleanup(program.stdout.close)
        self.assertIn("pictures/s", program.stdout.readline())
        program.send_signal(signal.SIGTERM)
        self.assertEqual(program.wait(60), 0)


class ProgramTest(WithFolder):
    def test_tells_that_nobody_listens(self):
        # Port 9, discard, is nobody's on these machines.
        text = EXAMPLE.read_text().replace("127.0.0.1:4960", "127.0.0.1:9")
        (self.work / "ceiling.toml").write_text(text)
        self.assertIn("nobody listens at 127.0.0.1:9: expected a server with a [[tracker]] there",
                      self.tracker("run", "ceiling.toml", "--simulate", "--count", "3"))

    def test_checks_a_picture(self):
        self.tracker("take", "ceiling.toml", "one.png", "--simulate")
        said = self.tracker("check", "ceiling.toml", "one.png", "--svg", "check.svg")
        self.assertRegex(said, r"(?m)^camera  at x 2\.\d+, y 1\.\d+, 3\.\d+ m high; floor tags 6 of 6")
        self.assertRegex(said, r"(?m)^radio-a 7  x 3\.2[56]\d, y 1\.\d+, [89]\d\.\d degrees; edge 0\.1[12]")
        xml.etree.ElementTree.parse(self.work / "check.svg")
        self.assertEqual(re.findall(r"(?m)^floor (\d+)  [01] mm, 0\.[0-2] degrees from", said),
                         [str(tag) for tag in range(500, 506)])
        # A floor tag that is 10 cm from where it was measured stands out among the others.
        (self.work / "wrong.toml").write_text(EXAMPLE.read_text().replace("x_m = 3.8\ny_m = 2.85",
                                                                          "x_m = 3.7\ny_m = 2.85"))
        away = dict(re.findall(r"(?m)^floor (\d+)  (\d+) mm", self.tracker("check", "wrong.toml", "one.png")))
        self.assertEqual(max(away, key=lambda tag: int(away[tag])), "505")
        text = EXAMPLE.read_text().replace("tag = 8", "tag = 9").replace("height_m = 0.25", "height_m = 0.9")
        (self.work / "ceiling.toml").write_text(text)
        said = self.tracker("check", "ceiling.toml", "one.png")
        self.assertRegex(said, r"(?m)^radio-a 7  rejected: its edge seems to be 0\.0")
        self.assertIn("radio-a 9  tag 9 was not found\n", said)

    def test_says_what_is_wrong(self):
        self.tracker("take", "ceiling.toml", "one.png", "--simulate")
        for arguments, status, message in (
                (("check", "ceiling.toml", "nix.png"), 1, "nix.png: cannot be opened"),
                (("check", "ceiling.toml", "ceiling.toml"), 1, "found no picture, expected PNG"),
                (("run", "nix.toml", "--simulate"), 2, "nix.toml: cannot be opened"),
                (("calibrate", "one.png"), 2, "found 0 pictures with six tags of the board"),
                (("run", "ceiling.toml", "--noise", "3"), 2, "--noise requires --simulate"),
                (("check", "small.toml", "one.png"), 1, "found 1280 x 960 pixels, expected those of "
                 "[camera], 640 x 480"),
                (("check", "lensless.toml", "one.png"), 2, "camera.focal_px is missing"),
                (("print", "wrong.toml", "sheets"), 2, "wrong.toml:10:12: camera.width_px: found 12"),
        ):
            text = EXAMPLE.read_text()
            (self.work / "lensless.toml").write_text(re.sub("(?m)^focal_px.*$", "", text))
            (self.work / "wrong.toml").write_text(text.replace("1280", "12"))
            (self.work / "small.toml").write_text(text.replace("1280", "640").replace("= 960", "= 480"))
            with self.subTest(arguments=arguments):
                self.assertIn(message, self.tracker(*arguments, status=status))

    def photograph(self, board, dots_per_m, tilt, turn, height, shift):
        """The board's sheet, 297 mm x 210 mm, from a camera of 640 x 480, focal length 500, k1 -0.1,
        whose axis meets the board `shift` from its middle."""
        v, u = numpy.mgrid[0:480, 0:640] + 0.5
        bent_x, bent_y = (u - 322) / 500, (v - 238) / 500
        x, y = bent_x, bent_y
        for _ in range(30):
            bend = 1 - 0.1 * (x * x + y * y)
            x, y = bent_x / bend, bent_y / bend
        # About the camera's x axis, then about its own: the board's middle stays on the axis.
        ray = numpy.stack([x, y * math.cos(tilt) - math.sin(tilt),
                           y * math.sin(tilt) + math.cos(tilt)])
        ray = numpy.stack([ray[0] * math.cos(turn) - ray[1] * math.sin(turn),
                           ray[0] * math.sin(turn) + ray[1] * math.cos(turn), ray[2]])
        centre = numpy.array([math.sin(tilt) * -math.sin(turn), math.sin(tilt) * math.cos(turn),
                              -math.cos(tilt)]) * height
        down = -centre[2] / ray[2]
        column = (centre[0] + down * ray[0] + 0.1485 + shift[0]) * dots_per_m - 0.5
        row = (centre[1] + down * ray[1] + 0.105 + shift[1]) * dots_per_m - 0.5
        left, top = numpy.floor(column).astype(int), numpy.floor(row).astype(int)
        picture = numpy.full(u.shape, 128.0)
        inside = (left >= 0) & (top >= 0) & (left < board.shape[1] - 1) & (top < board.shape[0] - 1)
        part_x, part_y = (column - left)[inside], (row - top)[inside]
        left, top = left[inside], top[inside]
        picture[inside] = (
            (board[top, left] * (1 - part_x) + board[top, left + 1] * part_x) * (1 - part_y)
            + (board[top + 1, left] * (1 - part_x) + board[top + 1, left + 1] * part_x) * part_y)
        return picture

    def test_finds_the_lens_from_pictures_of_the_printed_board(self):
        self.tracker("print", "ceiling.toml", "sheets")
        for name in ("board", "tag-7", "tag-500"):
            xml.etree.ElementTree.parse(self.work / "sheets" / f"{name}.svg")
        self.assertEqual(len(list((self.work / "sheets").iterdir())), 1 + 6 + 2)
        drawn = subprocess.run("rsvg-convert --dpi-x 127 --dpi-y 127 --background-color=white sheets/board.svg"
                               " | pngtopnm | ppmtopgm", shell=True, cwd=self.work, check=True,
                               capture_output=True).stdout
        columns, rows = map(int, drawn.split()[1:3])
        board = numpy.frombuffer(drawn[-columns * rows:], dtype=numpy.uint8).reshape(rows, columns)
        names = []
        for tilt, turn, height, shift in ((0.02, 0, 0.33, (0, 0)), (0.5, 0, 0.33, (0, 0.03)),
                                          (0.5, 1.5, 0.36, (0.03, 0)), (0.5, 3.1, 0.33, (0, -0.03)),
                                          (0.5, 4.6, 0.36, (-0.03, 0)), (0.3, 0.7, 0.33, (0, 0))):
            names.append(f"board-{len(names) + 1}.pgm")
            picture = self.photograph(board, 5000, tilt, turn, height, shift)
            (self.work / names[-1]).write_bytes(b"P5 640 480 255\n" + picture.astype(numpy.uint8).tobytes())
        said = self.tracker("calibrate", *names)
        self.assertIn("6 of 6 pictures", said)
        found = {key: float(value) for key, value in re.findall(r"(\w+) = (\S+)", said)}
        self.assertEqual((found["width_px"], found["height_px"]), (640, 480))
        self.assertAlmostEqual(found["focal_px"], 500, delta=3)
        self.assertAlmostEqual(found["centre_x_px"], 322, delta=3)
        self.assertAlmostEqual(found["centre_y_px"], 238, delta=3)
        self.assertAlmostEqual(found["k1"], -0.1, delta=0.02)

    def test_the_commands_of_the_page_are_right(self):
        """Those that need a camera are understood, and say that there is none; calibrate has its own
        test."""
        page = (SOURCE / "README.md").read_text()
        commands = re.findall(r"(?m)^ *(pheromone-tracker .*)$", page)
        self.assertEqual(len(commands), 7)
        for command in commands:
            words = command.split()[1:]
            with self.subTest(command=command):
                if "--simulate" in words or words[0] == "print":
                    self.tracker(*words)
                elif words[0] == "calibrate":
                    self.assertIn("board-1.png: cannot be opened", self.tracker(*words, status=2))
                elif not CAMERA.exists():
                    self.assertIn(f"{CAMERA}: cannot be opened", self.tracker(*words, status=2))
        self.assertTrue((self.work / "sheets/tag-7.pdf").read_bytes().startswith(b"%PDF"))
        self.assertTrue((self.work / "check.svg").exists())


class CameraTest(WithFolder):
    """What the program asks of a driver, answered by camera_shim.c."""

    def setUp(self):
        super().setUp()
        self.with_camera = {"LD_PRELOAD": str(SHIM), "CAMERA": str(self.work)}
        self.tracker("take", "ceiling.toml", "one.png", "--simulate")
        self.picture = self.gray("one.png")

    def gray(self, name):
        pgm = subprocess.run(["pngtopnm", name], cwd=self.work, check=True, capture_output=True).stdout
        return numpy.frombuffer(pgm[-1280 * 960:], dtype=numpy.uint8).reshape(960, 1280)

    def deliver_yuyv(self, flagged=False):
        gray = numpy.full((960, 1280), 77, numpy.uint8)
        for name, picture in (("new", self.picture), ("old", gray), ("bad", gray))[:3 if flagged else 2]:
            frame = numpy.full((960, 2 * 1280 + 64), 128, numpy.uint8)
            frame[:, 0:2 * 1280:2] = picture
            (self.work / name).write_bytes(frame.tobytes())
        (self.work / "kind").write_text("YUYV")

    def test_takes_the_newest_picture_in_yuyv(self):
        self.deliver_yuyv()
        self.tracker("take", "ceiling.toml", "two.png", **self.with_camera)
        self.assertTrue(numpy.array_equal(self.gray("two.png"), self.picture))

    def test_skips_a_picture_that_the_driver_says_is_damaged(self):
        self.deliver_yuyv(flagged=True)
        (self.work / "flagged").write_text("x")
        self.tracker("take", "ceiling.toml", "two.png", **self.with_camera)
        self.assertTrue(numpy.array_equal(self.gray("two.png"), self.picture))

    def test_takes_mjpeg_and_skips_a_damaged_picture(self):
        jpeg = subprocess.run("pngtopnm one.png | pnmtojpeg --quality=95", shell=True, cwd=self.work,
                              check=True, capture_output=True).stdout
        (self.work / "new").write_bytes(jpeg)
        for name in ("old", "bad"):
            (self.work / name).write_bytes(jpeg[:5000])
        (self.work / "kind").write_text("MJPG")
        said = self.tracker("check", "ceiling.toml", **self.with_camera)
        self.assertIn("floor tags 6 of 6", said)
        self.assertRegex(said, r"(?m)^radio-a 7  x 3\.2[56]\d, y 1\.\d+")

    def test_says_what_the_camera_offers_instead(self):
        self.deliver_yuyv()
        text = EXAMPLE.read_text().replace("1280", "640").replace("= 960", "= 480")
        (self.work / "small.toml").write_text(text)
        self.assertIn("/dev/video0: offers 1280 x 960, expected 640 x 480 in YUYV or MJPEG",
                      self.tracker("check", "small.toml", status=2, **self.with_camera))

    def test_ends_when_the_camera_is_unplugged(self):
        self.deliver_yuyv()
        program = subprocess.Popen(
            [BIN / "pheromone-tracker", "run", "ceiling.toml", "--status", "0.1"], cwd=self.work,
            text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            env={**os.environ, **self.with_camera})
        self.addCleanup(program.stdout.close)
        self.addCleanup(program.stderr.close)
        self.assertIn("6.0 of 6 floor tags", program.stdout.readline())
        (self.work / "gone").write_text("x")
        self.assertIn("/dev/video0: delivers nothing: No such device", program.stderr.read())
        self.assertEqual(program.wait(60), 1)


if __name__ == "__main__":
    SHIM = pathlib.Path(sys.argv.pop()).resolve()
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
