#!/usr/bin/env python3
"""The lines that we read out of drawings are those that librsvg draws.

    svg_render_test.py build/release/tests/maps_lines

Each drawing is rendered by rsvg-convert with thin strokes. Then every point along our lines must
lie on ink, and every pixel of ink near one of our lines. Where both hold there is no line too many,
none missing, and none in another place than in the drawing.
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

MAPS_LINES = ""
PIXELS_PER_UNIT = 8
WIDTH, HEIGHT = 120, 90  # user units
TOLERANCE_UNITS = 0.05
NEAR_PIXELS = 1.8  # half a stroke of one pixel scaled by 2, half a pixel's diagonal, and a little

# name: (root's attributes, content). All of it lies inside of the picture.
BOX = f'viewBox="0 0 {WIDTH} {HEIGHT}"'
DRAWINGS = {
    "cubic and smooth": (BOX, '<path d="M10,60 C10,10 50,10 50,60 S100,80 100,30 s-20-20-30 10"/>'),
    "quadratic and smooth": (BOX, '<path d="M5 45Q20 0 35 45T65 45t30 0q10-50 20 0"/>'),
    "arcs with every flag": (
        BOX,
        '<path d="M30 40A20 12 30 0 0 50 50"/><path d="M30 40A20 12 30 0 1 50 50"/>'
        '<path d="M30 40A20 12 30 1 0 50 50"/><path d="M30 40A20 12 30 1 1 50 50"/>'
        '<path d="M70 70a25 5-30 0140-25a5 9 0 10 5.5-20.5z"/><path d="M80 20A1 2 20 0 0 110 15"/>'),
    "straight commands": (
        BOX, '<path d="m10,10h20v20h-20zm5 5h10v10H15V15M60 10 70 20 80 10l5.5.5-3e0+7ZL60 50"/>'),
    "shapes": (
        BOX,
        '<line x1="5" y1="5" x2="40" y2="20"/><polyline points="5,30 20 40,5e0,50"/>'
        '<polygon points="30 30 50 35 40 55"/><rect x="60" y="5" width="40" height="20" rx="6"/>'
        '<rect x="60" y="30" width="30" height="10" rx="4" ry="99"/><circle cx="20" cy="70" r="15"/>'
        '<ellipse cx="80" cy="65" rx="30" ry="12"/><rect x="100" y="30" width="9" height="9"/>'),
    "transforms": (
        BOX,
        '<g transform="translate(60,45)"><g transform="rotate(30) scale(2 1)">'
        '<circle r="15"/><path transform="skewX(20)" d="M-15-15H15V15z"/></g>'
        '<path transform="matrix(1 .5 -.5 1 10 5)" d="M0 0C0 20 20 20 20 0"/>'
        '<ellipse transform="rotate(-40,30,0),skewY(10)" cx="30" rx="12" ry="5"/></g>'),
    "viewBox with an origin": (
        f'viewBox="-60 -45 {WIDTH} {HEIGHT}"',
        '<path d="M-50-40L50 40"/><circle cx="10" cy="-20" r="15"/>'),
    "no viewBox": (
        f'width="{WIDTH}" height="{HEIGHT}"',
        '<path d="M10 80C10 10 100 10 100 60"/><path d="M10 85h20"/>'),
    "hidden and not drawn": (
        BOX,
        '<defs><path d="M0 0L120 90"/></defs><g style="display:none"><path d="M0 90L120 0"/></g>'
        '<symbol><path d="M60 0V90"/></symbol><path display="none" d="M0 45H120"/>'
        '<path d="M10 10Q60 90 110 10"/>'),
    "units of length": (
        BOX, '<circle cx="10mm" cy=".5in" r="15pt"/><line x1="2cm" x2="110px" y2="5pc"/>'),
}


def ink(svg, folder):
    """The dark pixels of the drawing, as rows of booleans."""
    path = folder / "render.svg"
    path.write_text(svg)
    width, height = WIDTH * PIXELS_PER_UNIT, HEIGHT * PIXELS_PER_UNIT
    png = subprocess.run(
        ["rsvg-convert", "--background-color=white", f"--width={width}", f"--height={height}", path],
        check=True, capture_output=True).stdout
    ppm = subprocess.run(["pngtopnm"], input=png, check=True, capture_output=True).stdout
    magic, size, maximum, pixels = ppm.split(b"\n", 3)
    assert (magic, size, maximum) == (b"P6", b"%d %d" % (width, height), b"255"), ppm[:20]
    red = pixels[::3]
    return [[value < 200 for value in red[row * width:(row + 1) * width]] for row in range(height)]


def our_lines(svg, folder):
    """The lines as lists of points, in pixels from the picture's upper left corner."""
    path = folder / "drawing.svg"
    path.write_text(svg)
    csv = subprocess.run([MAPS_LINES, path, "1", str(round(TOLERANCE_UNITS * 1e6))],
                         check=True, capture_output=True, text=True).stdout
    blocks = csv.removeprefix("x_m,y_m\n").strip().split("\n\n")
    lines = [[tuple(map(float, row.split(","))) for row in block.split("\n")] for block in blocks]
    return [[(x * PIXELS_PER_UNIT, (HEIGHT - y) * PIXELS_PER_UNIT) for x, y in line]
            for line in lines]


def along(line):
    """Points on the line, at most half a pixel apart."""
    for (ax, ay), (bx, by) in zip(line, line[1:]):
        steps = int(2 * max(abs(bx - ax), abs(by - ay))) + 1
        for i in range(steps + 1):
            yield ax + (bx - ax) * i / steps, ay + (by - ay) * i / steps


def near(x, y):
    """The pixels whose centres are not far from a point."""
    for row in range(int(y - 2.5), int(y + 3)):
        for column in range(int(x - 2.5), int(x + 3)):
            if (column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2 <= NEAR_PIXELS ** 2:
                yield row, column


class SvgRenderTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def compare(self, root, content):
        """How many of our points lie off the ink, and how many pixels of ink off our lines."""
        svg = f'<svg xmlns="http://www.w3.org/2000/svg" {root}>%s{content}</svg>'
        # Strokes of one pixel; round joins, so that no spike sticks out.
        style = ("<style>* { fill: none; stroke: black; stroke-linejoin: round;"
                 f" stroke-width: {1 / PIXELS_PER_UNIT}px }}</style>")
        folder = pathlib.Path(self.folder.name)
        dark = ink(svg % style, folder)
        covered = set()
        points = off_ink = 0
        for line in our_lines(svg % "", folder):
            for x, y in along(line):
                around = list(near(x, y))
                points += 1
                off_ink += not any(dark[row][column] for row, column in around
                                   if 0 <= row < len(dark) and 0 <= column < len(dark[0]))
                covered.update(around)
        pixels = {(row, column) for row, line in enumerate(dark)
                  for column, is_dark in enumerate(line) if is_dark}
        self.assertGreater(points, 100)
        self.assertGreater(len(pixels), 100)
        return off_ink, len(pixels - covered)

    def test_our_lines_are_on_ink_and_ink_is_on_our_lines(self):
        for name, (root, content) in DRAWINGS.items():
            with self.subTest(name):
                self.assertEqual(self.compare(root, content), (0, 0))

    def test_the_comparison_notices_a_line_that_is_missing_or_moved(self):
        # We do not ask what a line looks like: gaps are lines too many, and a thick one is too few.
        off_ink, off_lines = self.compare(BOX, '<path d="M10 10H60" style="stroke-dasharray:20"/>')
        self.assertTrue(off_ink > 0 and off_lines == 0)
        off_ink, off_lines = self.compare(BOX, '<path d="M10 10H60" style="stroke-width:2px"/>')
        self.assertTrue(off_ink == 0 and off_lines > 0)


if __name__ == "__main__":
    MAPS_LINES = sys.argv.pop(1)
    unittest.main()
