#!/usr/bin/python3
"""pheromonectl map: what it writes, as NumPy and netpbm read it.

Usage: map_test.py build/release/bin/pheromonectl
"""

import base64
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "proto_tests"))
from test_config import map_of, pheromone, table  # noqa: E402

PHEROMONECTL = ""

CONFIG = (map_of(1.2, 0.8, origin_x_m=-0.2) + pheromone(1, "trail", tau_s=30.0)
          + pheromone(2, "path", quantum=0.25, maximum=2.0)
          + table("[pheromone]", type=3, name="guide", blend=[{"pheromone": "path"}])
          + table("[path]", pheromone="path", shape="polyline", points_m=[[0.0, 0.2], [0.5, 0.2]],
                  intensity=1.5)
          + table("obstacles", walls=[{"points_m": [[0.4, 0.5], [0.6, 0.5]], "thickness_m": 0.02}]))
SAVED = """# pheromone-field 1
# map origin_um -200000 0 size_um 1200000 800000 cell_um 100000
# type 1 quantum_micro 125000 law counter:30000ms name "trail"
# nodes type,column,row,level
1,0,0,64
1,12,8,512
# end nodes 2 levels 576
"""
# As an array, its first row the top: 9 rows of 13 nodes.
PATH = numpy.zeros((9, 13))
PATH[8 - 2, 2:8] = 1.5
TRAIL = numpy.zeros((9, 13))
TRAIL[8, 0] = 0.125
TRAIL[0, 12] = 1.0
WALL = numpy.zeros((9, 13), dtype=bool)
WALL[8 - 5, 6:9] = True


def netpbm(path):
    """The pixels of a PNG or PGM, as netpbm reads them."""
    data = path.read_bytes()
    if path.suffix == ".png":
        data = subprocess.run(["pngtopnm"], input=data, capture_output=True, check=True).stdout
    plain = subprocess.run(["pnmtoplainpnm"], input=data, capture_output=True, check=True)
    words = plain.stdout.split()
    width, height = int(words[1]), int(words[2])
    shape = {b"P2": (height, width), b"P3": (height, width, 3)}[words[0]]
    return numpy.array([int(word) for word in words[4:]]).reshape(shape)


class MapTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "lab.toml").write_text(
            CONFIG + '[[link]]\nname = "a"\nkind = "pty"\npath = "a.pty"\n')
        (self.folder / "lab.field").write_text(SAVED)

    def call(self, *arguments, **environment):
        return subprocess.run([PHEROMONECTL, "map", *(str(it) for it in arguments)],
                              cwd=self.folder, text=True, capture_output=True, check=False,
                              env={**os.environ, **environment})

    def good(self, *arguments):
        result = self.call(*arguments)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return result.stdout

    def refused(self, status, words, *arguments, **environment):
        result = self.call(*arguments, **environment)
        self.assertEqual((result.returncode, result.stdout), (status, ""), result.stderr)
        self.assertIn(words, result.stderr)

    def test_a_saved_field_is_moved_to_cells_of_half_the_size(self):
        coarse = (self.folder / "lab.toml").read_text()
        (self.folder / "fine.toml").write_text(coarse.replace("cell_m = 0.1", "cell_m = 0.05"))
        self.refused(2, "does not match", "export", "--config", "fine.toml", "--field", "lab.field",
                     "out.npy")
        self.assertEqual(self.good("resample", "--config", "fine.toml", "--type", "trail",
                                   "lab.field", "fine.field"),
                         "fine.field: 2 nodes with pheromone, 0 dropped off the map, "
                         "0 quanta dropped above a maximum\n")
        self.good("export", "--config", "fine.toml", "--field", "fine.field", "--type", "trail",
                  "out.csv")
        fine = numpy.genfromtxt(self.folder / "out.csv", delimiter=",")
        expected = numpy.zeros((17, 25))
        expected[::2, ::2] = TRAIL
        numpy.testing.assert_array_equal(numpy.nan_to_num(fine), expected)
        self.refused(2, 'the field has no pheromone "scent"', "resample", "--config", "fine.toml",
                     "--type", "scent", "lab.field", "fine.field")

    def test_numpy_reads_what_lies_on_the_map(self):
        with_wall = numpy.where(WALL, numpy.nan, PATH)
        self.assertEqual(self.good("export", "--config", "lab.toml", "a.npy"),
                         'a.npy: pheromone 2 "path", 13 x 9 cells\n')
        numpy.testing.assert_array_equal(numpy.load(self.folder / "a.npy"), with_wall)
        self.good("export", "--config", "lab.toml", "--type", "path", "a.csv")
        numpy.testing.assert_array_equal(
            numpy.loadtxt(self.folder / "a.csv", delimiter=","), with_wall)
        for name in ("1", "trail"):
            self.good("export", "--config", "lab.toml", "--field", "lab.field", "--type", name,
                      "b.npy")
            numpy.testing.assert_array_equal(numpy.load(self.folder / "b.npy"),
                                             numpy.where(WALL, numpy.nan, TRAIL))

    def test_an_area_and_fewer_cells(self):
        self.good("export", "--config", "lab.toml", "--area", "-0.2", "0.1", "0.35", "0.4",
                  "--nodes-per-cell", "2", "a.npy")
        area = PATH[8 - 4:8 - 1 + 1, 0:6]
        halved = numpy.array([[area[r:r + 2, c:c + 2].max() for c in range(0, 6, 2)]
                              for r in range(0, 4, 2)])
        numpy.testing.assert_array_equal(numpy.load(self.folder / "a.npy"), halved)

    def test_a_picture_has_gray_obstacles_and_brighter_colours_for_more(self):
        self.assertIn("13 x 9 cells of 4 pixels, from 0 to 2",
                      self.good("draw", "--config", "lab.toml", "--pixels-per-cell", "4", "a.png"))
        pixels = netpbm(self.folder / "a.png")
        self.assertEqual(pixels.shape, (36, 52, 3))
        cells = pixels[::4, ::4]
        numpy.testing.assert_array_equal(pixels, cells.repeat(4, axis=0).repeat(4, axis=1))
        self.assertTrue((cells[WALL] == 128).all())
        self.assertEqual(len(numpy.unique(cells[(PATH == 0) & ~WALL], axis=0)), 1)
        self.assertEqual(len(numpy.unique(cells[PATH > 0], axis=0)), 1)
        self.assertGreater(cells[PATH > 0][0].sum(), cells[8, 0].sum())
        self.good("draw", "big.png")
        self.assertEqual(netpbm(self.folder / "big.png").shape, (909, 909, 3))

    def test_a_figure_has_axes_in_metres_and_a_scale(self):
        options = ("--config", "lab.toml", "--pixels-per-cell", "4")
        self.good("draw", *options, "a.png")
        self.good("draw", *options, "a.svg")
        root = xml.etree.ElementTree.parse(self.folder / "a.svg").getroot()
        spaced = "{http://www.w3.org/2000/svg}"
        image = root.find(spaced + "image")
        kind, _, data = image.get("href").partition(",")
        self.assertEqual(kind, "data:image/png;base64")
        self.assertEqual(base64.b64decode(data), (self.folder / "a.png").read_bytes())
        box = {it: float(image.get(it)) for it in ("x", "y", "width", "height")}
        self.assertAlmostEqual(box["height"] / box["width"], 9 / 13, 3)  # square cells
        texts = [(it.text, it) for it in root.iter(spaced + "text")]
        self.assertLessEqual({'Pheromone "path"', "x in m", "y in m", "content of a node in units",
                              "obstacle"}, {it for it, _ in texts})
        # The left edge of the cells is half a cell before the map's: of the ROS map below, -0.25 m.
        scale = box["width"] / 1.3
        ticks = [(float(text), float(it.get("x"))) for text, it in texts
                 if it.get("text-anchor") == "middle" and re.fullmatch(r"-?[0-9.]+", text)]
        self.assertGreater(len(ticks), 3)
        for metres, at in ticks:
            self.assertAlmostEqual(at, box["x"] + (metres + 0.25) * scale, delta=0.1)
        ticks = [(float(text), float(it.get("y")) - 4) for text, it in texts
                 if it.get("text-anchor") == "end"]
        self.assertGreater(len(ticks), 3)
        for metres, at in ticks:
            self.assertAlmostEqual(at, box["y"] + box["height"] - (metres + 0.05) * scale, delta=0.1)
        marks = [float(text) for text, it in texts
                 if it.get("text-anchor") == "start" and text != "obstacle"]
        self.assertEqual((min(marks), max(marks)), (0, 2))  # the maximum of the law

    def test_the_figure_as_a_pdf_has_lines_and_text_around_the_cells(self):
        draw = ("draw", "--config", "lab.toml", "--pixels-per-cell", "4")
        self.good(*draw, "a.svg")
        self.assertIn("a.pdf: pheromone 2", self.good(*draw, "a.pdf"))

        def poppler(*command):
            return subprocess.run(command, cwd=self.folder, text=True, capture_output=True,
                                  check=True).stdout
        page = re.search(r"Page size: +([0-9.]+) x ([0-9.]+) pts", poppler("pdfinfo", "a.pdf"))
        root = xml.etree.ElementTree.parse(self.folder / "a.svg").getroot()
        for points, name in zip(page.groups(), ("width", "height")):
            pixels = float(root.get(name))  # of 1/96 inch, as CSS defines them
            self.assertAlmostEqual(float(points), pixels * 72 / 96, delta=0.1)
        words = poppler("pdftotext", "-layout", "a.pdf", "-")
        for text in ('Pheromone "path"', "x in m", "y in m", "content of a node in units",
                     "obstacle", "0.8", "2.0"):
            self.assertIn(text, words)
        images = [it.split() for it in poppler("pdfimages", "-list", "a.pdf").splitlines()[2:]]
        self.assertEqual([(it[3], it[4]) for it in images], [("52", "36")])  # the cells, no more
        self.assertNotIn("Type 3", poppler("pdffonts", "a.pdf"))

    def test_without_rsvg_convert_a_pdf_names_its_package_and_nothing_is_written(self):
        draw = ("draw", "--config", "lab.toml", "a.pdf")
        self.refused(1, "sudo apt install librsvg2-bin", *draw, PATH=str(self.folder))
        program = self.folder / "rsvg-convert"
        program.write_text("#!/bin/sh\necho half of a page\nexit 1\n")
        program.chmod(0o755)
        self.refused(1, "rsvg-convert failed", *draw, PATH=str(self.folder))
        self.assertFalse((self.folder / "a.pdf").exists())

    def test_the_obstacles_as_a_ros_map(self):
        self.good("export", "--config", "lab.toml", "lab.yaml")
        info = dict(line.split(": ", 1)
                    for line in (self.folder / "lab.yaml").read_text().splitlines())
        self.assertEqual((info["image"], float(info["resolution"])), ("lab.pgm", 0.1))
        self.assertEqual([float(it) for it in info["origin"].strip("[]").split(",")],
                         [-0.25, -0.05, 0])
        numpy.testing.assert_array_equal(netpbm(self.folder / "lab.pgm") < 100, WALL)
        self.assertEqual(self.good("info", "lab.yaml"),
                         "raster: 13 x 9 cells of 0.1 m from (-0.25, -0.05), values from 0 to 100, "
                         "0 unknown\n")

    def test_conversions_keep_every_value_or_are_refused(self):
        levels = numpy.random.default_rng(5).integers(0, 256, (7, 11))
        numpy.save(self.folder / "a.npy", levels)
        for name in ("a.pgm", "a.png", "a.csv"):
            self.good("convert", "a.npy", name)
            self.good("convert", name, "back.npy")
            numpy.testing.assert_array_equal(numpy.load(self.folder / "back.npy"), levels)
        for name in ("a.pgm", "a.png"):
            numpy.testing.assert_array_equal(netpbm(self.folder / name), levels)
        numpy.save(self.folder / "wide.npy", levels * 256)
        self.good("convert", "wide.npy", "wide.pgm")
        numpy.testing.assert_array_equal(netpbm(self.folder / "wide.pgm"), levels * 256)
        numpy.save(self.folder / "half.npy", levels / 255)
        self.refused(1, "expected whole numbers from 0 to 65535, or --white", "convert",
                     "half.npy", "half.png")
        self.good("convert", "--white", "1", "half.npy", "half.png")
        numpy.testing.assert_array_equal(netpbm(self.folder / "half.png"), levels)
        occupied = numpy.where(levels > 127, 100, 0)
        numpy.save(self.folder / "map.npy", occupied)
        self.refused(1, "expected --cell", "convert", "map.npy", "map.yaml")
        self.good("convert", "--cell", "0.05", "map.npy", "map.yaml")
        self.good("convert", "map.yaml", "map.csv")
        numpy.testing.assert_array_equal(
            numpy.loadtxt(self.folder / "map.csv", delimiter=","), occupied)

    def test_info_says_what_a_saved_field_holds(self):
        self.assertEqual(
            self.good("info", "lab.field"),
            "saved field: 1.2 x 0.8 m from (-0.2, 0), cells of 0.1 m, 13 x 9 nodes\n"
            'pheromone 1 "trail", counter:30000ms: 2 nodes, at most 1\n')

    def test_no_output_replaces_its_input(self):
        told = ": the output is the input ./lab.{}, expected another name\n"
        config = (self.folder / "lab.toml").read_text()
        for name in ("lab.field", "lab.toml"):
            self.refused(2, name + told.format(name[4:]), "resample", "--config", "./lab.toml",
                         "./lab.field", name)
        self.good("export", "--config", "lab.toml", "lab.csv")
        table = (self.folder / "lab.csv").read_text()
        self.refused(2, "lab.csv" + told.format("csv"), "convert", "./lab.csv", "lab.csv")
        self.assertEqual([(self.folder / it).read_text() for it in ("lab.field", "lab.toml", "lab.csv")],
                         [SAVED, config, table])

    def test_mistakes_are_told_and_leave_no_file(self):
        config = ("--config", "lab.toml")
        self.refused(2, "unknown ending, expected .pdf, .svg or .png", "draw", *config, "out.gif")
        self.refused(2, "expected .npy, .csv or .yaml", "export", *config, "out.png")
        self.refused(2, "expected no --type or --field", "export", "--type", 1, *config, "out.yaml")
        self.refused(2, 'found "9", expected one of 1 ("trail"), 2 ("path"), 3 ("guide")', "draw",
                     "--type", 9, *config, "out.png")
        self.refused(2, "is a blend", "draw", "--type", "guide", *config, "out.png")
        self.refused(2, "the area contains no node of the map", "draw", *config, "--area",
                     5, 5, 6, 6, "out.png")
        self.refused(2, "none.toml: cannot be opened", "draw", "--config", "none.toml", "out.png")
        self.refused(2, "does not match the configuration: the map was saved with", "draw",
                     "--field", "lab.field", "out.png")
        (self.folder / "cut.field").write_text(SAVED[:-3])
        self.refused(1, "cut.field:7:", "draw", *config, "--field", "cut.field", "out.png")
        self.refused(1, "cut.field:7:", "info", "cut.field")
        self.refused(1, "none.npy: cannot be opened", "convert", "none.npy", "out.csv")
        self.refused(1, "none/out.png", "draw", *config, "none/out.png")
        self.refused(2, "unknown ending", "convert", "lab.toml", "out.csv")
        for arguments in ((), ("draw",), ("paint", "out.png"), ("draw", "--area", 1, 2, "out.png"),
                          ("draw", "--pixels-per-cell", 0, "out.png"),
                          ("convert", "--white", 0, "a.npy", "out.png")):
            self.assertEqual(self.call(*arguments).returncode, 2, arguments)
        self.assertEqual(list(self.folder.glob("out*")), [])
        self.assertEqual(self.call("draw", "--help").returncode, 0)


if __name__ == "__main__":
    PHEROMONECTL = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
