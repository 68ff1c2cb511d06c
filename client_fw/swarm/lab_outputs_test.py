#!/usr/bin/env python3
"""What pheromone-swarm lab run writes while it runs, read back by NumPy, csv and matplotlib.

    outputs_test.py BIN_DIR
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
import unittest

import matplotlib.image
import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto_tests"))
from mcap_reader import read_mcap  # noqa: E402

BIN = pathlib.Path()
QUANTUM, MAXIMUM, CELL_M = 0.015625, 2.0, 0.1
COLUMNS, ROWS, PIXELS = 81, 41, 7  # a node in each corner; pixels along the side of its square

PHEROMONES = "".join(f"""
[[pheromone]]
type = {number}
name = "{name}"
core_m = 0.1
sigma_m = 0.4
tau_s = 0
quantum = {QUANTUM}
maximum = {MAXIMUM}
""" for number, name in ((1, "trail"), (2, "other")))

# Two robots that lay a trail where there is none.
SCENARIO = f"""
[run]
duration_s = 4.4
[map]
width_m = {(COLUMNS - 1) * CELL_M}
height_m = {(ROWS - 1) * CELL_M}
cell_m = {CELL_M}
[antennas]
bias_m = 0.33
{PHEROMONES}[[robots]]
name = "ants"
behaviour = "follow"
starts = [[1.0, 3.0, 0.0], [5.0, 1.0, 0.0]]
senses = ["trail"]
deposits = "trail"
parameters = {{quanta = 1}}
radius_m = 0.0
"""
WALL = """
[[wall]]
name = "block"
points_m = [[7, 3], [7.5, 3]]
thickness_m = 0.3
"""


class OutputsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.write(SCENARIO)

    def write(self, text):
        (self.folder / "two.toml").write_text(text, encoding="utf-8")

    def lab(self, *arguments):
        return subprocess.run([BIN / "pheromone-swarm", "lab", "run", "two.toml", *arguments], cwd=self.folder,
                              text=True, capture_output=True, check=False, timeout=100)

    def table(self, name):
        with open(self.folder / name, encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def check(self, times, *level):
        done = self.lab("--series", "series.csv", "--tracks", "tracks.csv", "--maps", "maps", "--frames", "frames",
                        "--mcap", "two.mcap", "--every", "0.55", *level)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        series, tracks = self.table("series.csv"), self.table("tracks.csv")
        self.assertEqual([row["time_s"] for row in series], times)
        self.assertEqual([(row["time_s"], row["robot"]) for row in tracks],
                         [(time, robot) for time in times for robot in "01"])
        printed = dict(line.split() for line in done.stdout.splitlines())
        for name, value in series[-1].items():
            self.assertEqual(value == "", name not in printed, name)
            if value:
                self.assertAlmostEqual(float(value), float(printed[name]), delta=1e-5 * abs(float(value)))
        return series, tracks

    def pictures(self, series, tracks):
        trail, other = (np.load(self.folder / "maps" / f"{name}.npy") for name in ("trail", "other"))
        self.assertEqual((trail.dtype, trail.shape, other.shape), (np.float64, (9, ROWS, COLUMNS), (9, ROWS, COLUMNS)))
        self.assertEqual(np.nansum(other), 0)
        # Nothing evaporates, and no node is full: the map has what was laid.
        laid = [float(row["deposited_quanta"]) * QUANTUM for row in series]
        self.assertEqual(np.nansum(trail, axis=(1, 2)).tolist(), laid)
        self.assertGreater(laid[-1], laid[1])
        blocked = np.isnan(trail[0])
        # White where robots are, gray where obstacles are, the colours of 0 elsewhere.
        for moment, time in enumerate(row["time_s"] for row in series):
            picture = np.rint(255 * matplotlib.image.imread(self.folder / "frames" / f"other-{moment:05}.png"))[..., :3]
            self.assertEqual(picture.shape, (PIXELS * ROWS, PIXELS * COLUMNS, 3))
            expected = np.tile([68.0, 1.0, 84.0], (ROWS, COLUMNS, 1))
            expected[blocked] = 128
            for row in tracks:
                if row["time_s"] == time:
                    # The nearest node.
                    x, y = (int(np.floor(float(row[name]) / CELL_M + 0.5)) for name in ("x_m", "y_m"))
                    expected[ROWS - 1 - y, x] = 255
            np.testing.assert_array_equal(picture, expected.repeat(PIXELS, axis=0).repeat(PIXELS, axis=1))
        return blocked

    def messages(self):
        """Of the MCAP file, by topic, each read by the schema in the file."""
        file = read_mcap(self.folder / "two.mcap")
        read = {}
        for message in file.messages:
            name, encoding, schema = file.schemas[message.topic]
            self.assertEqual((encoding, file.encodings[message.topic]), ("protobuf", "protobuf"))
            pool = descriptor_pool.DescriptorPool()
            for one in descriptor_pb2.FileDescriptorSet.FromString(schema).file:
                pool.Add(one)
            kind = message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(name))
            read.setdefault(message.topic, []).append((message.time_ns, kind.FromString(message.data)))
        return read

    def viewers_file(self, series, tracks):
        read = self.messages()
        self.assertEqual(set(read), {"/pheromone/trail", "/pheromone/other", "/robots"})
        times = [round(1e9 * float(row["time_s"])) for row in series]
        maps = np.load(self.folder / "maps" / "trail.npy")
        for (time, grid), when, levels in zip(read["/pheromone/trail"], times, maps, strict=True):
            self.assertEqual((time, grid.column_count, grid.cell_size.x, grid.fields[0].name),
                             (when, COLUMNS, CELL_M, "trail"))
            # A node is in the middle of its cell.
            self.assertEqual((grid.pose.position.x, grid.pose.position.y), (-CELL_M / 2, -CELL_M / 2))
            bytes_ = np.ceil(254 * levels[::-1] / MAXIMUM)
            np.testing.assert_array_equal(np.frombuffer(grid.data, np.uint8).reshape(ROWS, COLUMNS),
                                          np.where(np.isnan(bytes_), 255, bytes_))
        rows = iter(tracks)
        for (time, update), when in zip(read["/robots"], times, strict=True):
            (line,) = update.entities[0].lines
            self.assertEqual((time, len(line.points)), (when, 4))
            for robot in (0, 1):
                begin, end = line.points[2 * robot:2 * robot + 2]
                row, turn = next(rows), np.degrees(np.arctan2(end.y - begin.y, end.x - begin.x))
                np.testing.assert_allclose((begin.x, begin.y), (float(row["x_m"]), float(row["y_m"])), atol=1e-4)
                self.assertLess(abs((turn - float(row["heading_deg"]) + 180) % 360 - 180), 0.01)

    def test_field(self):
        self.write(SCENARIO + WALL)
        # The first steps, of 0.2 s, that are not before 0, 0.55, 1.1 s and so on.
        series, tracks = self.check(["0", "0.6", "1.2", "1.8", "2.2", "2.8", "3.4", "4", "4.4"])
        self.assertEqual([(row["x_m"], row["y_m"], row["heading_deg"]) for row in tracks[:2]],
                         [("1.0000", "3.0000", "0.00"), ("5.0000", "1.0000", "0.00")])
        blocked = self.pictures(series, tracks)
        self.viewers_file(series, tracks)
        self.assertTrue(blocked[ROWS - 1 - 30, 72] and not blocked[30, 72])

    def test_firmware(self):
        times = ["0", "0.56", "1.1", "1.66", "2.2", "2.76", "3.3", "3.86", "4.4"]  # its step is 0.02 s
        blocked = self.pictures(*self.check(times, "--set", "run.level=firmware"))
        self.assertFalse(blocked.any())

    def test_what_a_level_cannot_write_is_refused(self):
        done = self.lab("--series", "series.csv", "--set", "run.level=radio")
        self.assertEqual(done.returncode, 2)
        self.assertIn('--series: run.level = "radio" has no such output, expected "field" or "firmware"', done.stderr)

    def test_what_has_no_effect_is_refused(self):
        done = self.lab("--every", "2")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--every 2: found no output, expected --series, --tracks, --maps, --frames or --mcap", done.stderr)

    def test_a_folder_that_cannot_be_made_is_told(self):
        (self.folder / "file").write_text("", encoding="utf-8")
        done = self.lab("--maps", "file/maps")
        self.assertEqual((done.returncode, "file/maps: " in done.stderr), (1, True), done)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main(verbosity=2)
