#!/usr/bin/python3
"""Our rasters and those of other programs are the same, value by value: NumPy reads and writes
.npy and CSV, netpbm reads and writes PGM and PNG, pngcheck and netpbm look at our PNG.

Usage: foreign_tools_test.py build/release/tests/maps_convert
"""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy

CONVERT = ""


def run(*command, stdin=None):
    """Standard output of a program that must succeed."""
    done = subprocess.run([str(word) for word in command], input=stdin, capture_output=True)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.stderr.decode(errors='replace')}")
    return done.stdout


def plain_values(picture):
    """The pixels of a PGM or PPM, as netpbm prints them: maxval and an array, RGB one axis more."""
    words = run("pnmtoplainpnm", stdin=picture).split()
    width, height, maximum = (int(word) for word in words[1:4])
    shape = {b"P2": (height, width), b"P3": (height, width, 3)}[words[0]]
    return maximum, numpy.array([int(word) for word in words[4:]]).reshape(shape)


def plain_pgm(levels, maximum):
    """A P2 that netpbm will turn into what it likes."""
    rows = "\n".join("\n".join(str(level) for level in row) for row in levels)
    return f"P2\n{levels.shape[1]} {levels.shape[0]}\n{maximum}\n{rows}\n".encode()


class ForeignTools(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.random = numpy.random.default_rng(7)

    def convert(self, source, target, white=None):
        """Through maps_convert; the new file's path."""
        run(CONVERT, self.folder / source, self.folder / target, *([] if white is None else [white]))
        return self.folder / target

    def levels(self, maximum, shape=(23, 17)):
        return self.random.integers(0, maximum + 1, shape)

    def test_numpy_arrays_of_every_type_and_order_are_read(self):
        for name in "|b1 |u1 |i1 <u2 >u2 <i2 >i2 <u4 >u4 <i4 >i4 <u8 >i8 <f4 >f4 <f8 >f8".split():
            kind = numpy.dtype(name)
            values = self.random.integers(0, 2 ** 60, (13, 7)).astype(kind)
            if kind.kind == "f":
                values = self.random.normal(0, 1e6, (13, 7)).astype(kind)
                values[0, 0] = numpy.nan
            if kind.itemsize == 8 and kind.kind != "f":
                values = values >> 8  # what a double holds
            for order in "CF":
                for version in ((1, 0), (2, 0)):
                    with self.subTest(type=name, order=order, version=version):
                        with open(self.folder / "a.npy", "wb") as file:
                            numpy.lib.format.write_array(
                                file, numpy.asarray(values, order=order), version)
                        got = numpy.load(self.convert("a.npy", "b.npy"))
                        self.assertEqual(got.dtype, numpy.dtype("<f8"))
                        numpy.testing.assert_array_equal(got, values.astype("<f8"))

    def test_npy_is_byte_for_byte_what_numpy_saves(self):
        for shape in ((1, 1), (3, 500), (20, 2)):
            numpy.save(self.folder / "a.npy", self.random.normal(size=shape))
            again = self.convert("a.npy", "b.npy")
            self.assertEqual(again.read_bytes(), (self.folder / "a.npy").read_bytes())

    def test_csv_goes_both_ways(self):
        values = self.random.normal(size=(11, 6))
        values[3, 2] = numpy.nan
        numpy.savetxt(self.folder / "a.csv", values, delimiter=",", header="from NumPy")
        numpy.testing.assert_array_equal(numpy.load(self.convert("a.csv", "a.npy")), values)
        again = numpy.loadtxt(self.convert("a.npy", "b.csv"), delimiter=",")
        numpy.testing.assert_array_equal(again, values)

    def test_our_pgm_is_read_by_netpbm(self):
        for maximum in (255, 65535):
            levels = self.levels(maximum)
            numpy.save(self.folder / "a.npy", levels)
            pgm = self.convert("a.npy", "a.pgm", maximum)
            self.assertIn(b"PGM raw, 17 by 23  maxval %d" % maximum, run("pamfile", pgm))
            got_maximum, got = plain_values(run("pamtopnm", pgm))
            self.assertEqual(got_maximum, maximum)
            numpy.testing.assert_array_equal(got, levels)

    def test_netpbms_pgm_is_read(self):
        for maximum in (3, 15, 255, 256, 4095, 65535):
            levels = self.levels(maximum)
            plain = plain_pgm(levels, maximum)
            for picture in (plain, run("pamtopnm", stdin=plain), run("pnmtoplainpnm", stdin=plain)):
                with self.subTest(maximum=maximum, magic=picture[:2]):
                    (self.folder / "a.pgm").write_bytes(picture)
                    got = numpy.load(self.convert("a.pgm", "a.npy"))
                    numpy.testing.assert_array_equal(got, levels)

    def test_a_pgm_is_scaled_so_that_white_is_the_maximum(self):
        levels = self.levels(1000)
        (self.folder / "a.pgm").write_bytes(plain_pgm(levels, 1000))
        got = numpy.load(self.convert("a.pgm", "a.npy", 12.5))
        numpy.testing.assert_allclose(got, levels * 12.5 / 1000, rtol=1e-15)

    def test_our_gray_png_is_sound_and_read_by_netpbm(self):
        for maximum in (255, 65535):
            levels = self.levels(maximum)
            numpy.save(self.folder / "a.npy", levels)
            png = self.convert("a.npy", "a.png", maximum)
            self.assertIn(b"OK: ", run("pngcheck", png))
            got_maximum, got = plain_values(run("pngtopnm", png))
            self.assertEqual(got_maximum, maximum)
            numpy.testing.assert_array_equal(got, levels)

    def test_netpbms_png_is_read(self):
        for maximum, arguments in ((255, []), (65535, []), (255, ["-interlace"]), (1, []), (15, []),
                                   (65535, ["-interlace"])):
            with self.subTest(maximum=maximum, arguments=arguments):
                levels = self.levels(maximum)
                png = run("pnmtopng", *arguments, stdin=plain_pgm(levels, maximum))
                (self.folder / "a.png").write_bytes(png)
                white = 65535 if maximum > 255 else 255
                got = numpy.load(self.convert("a.png", "a.npy"))
                numpy.testing.assert_array_equal(got, levels * (white // maximum))

    def test_netpbms_coloured_and_transparent_png_is_read(self):
        for colours in (8, 256):  # with few, netpbm writes a palette
            rgb = self.random.integers(0, 256, (colours, 3))[
                self.random.integers(0, colours, (20, 19))]
            ppm = b"P6 19 20 255\n" + rgb.astype("|u1").tobytes()
            opaque = self.random.integers(0, 2, (20, 19))
            (self.folder / "alpha.pgm").write_bytes(plain_pgm(opaque * 255, 255))
            (self.folder / "a.png").write_bytes(run("pnmtopng", stdin=ppm))
            got = numpy.load(self.convert("a.png", "a.npy"))
            numpy.testing.assert_allclose(got, rgb.mean(axis=2), rtol=1e-15)
            alpha = f"-alpha={self.folder / 'alpha.pgm'}"
            (self.folder / "a.png").write_bytes(run("pnmtopng", alpha, stdin=ppm))
            got = numpy.load(self.convert("a.png", "a.npy"))
            expected = numpy.where(opaque == 1, rgb.mean(axis=2), numpy.nan)
            numpy.testing.assert_allclose(got, expected, rtol=1e-15)

    def test_a_picture_in_colours_has_viridis_in_each_cell(self):
        source = (pathlib.Path(__file__).parent / "colour_map.cc").read_text(encoding="ascii")
        table = [int(word, 16) for word in re.findall(r"0x([0-9a-f]{6})", source)]
        viridis = numpy.array([[c >> 16, c >> 8 & 255, c & 255] for c in table])
        self.assertEqual(len(viridis), 256)
        values = self.random.uniform(-0.1, 1.1, (9, 12)) * 3
        values[4, 5] = numpy.nan
        numpy.save(self.folder / "a.npy", values)
        png = self.convert("a.npy", "a.viridis.png", 3)
        self.assertIn(b"OK: ", run("pngcheck", png))
        _, got = plain_values(run("pngtopnm", png))
        known = numpy.nan_to_num(values)
        expected = viridis[numpy.clip(numpy.floor(known / 3 * 256), 0, 255).astype(int)]
        expected[4, 5] = 255
        expected = expected.repeat(2, axis=0).repeat(2, axis=1)
        numpy.testing.assert_array_equal(got, expected)

    def test_a_ros_map_means_what_its_documentation_says(self):
        """wiki.ros.org/map_server, "Value interpretation", in NumPy."""
        levels = numpy.arange(256).reshape(16, 16)
        for mode in ("trinary", "scale", "raw"):
            for negate in (0, 1):
                with self.subTest(mode=mode, negate=negate):
                    (self.folder / "lab.pgm").write_bytes(plain_pgm(levels, 255))
                    (self.folder / "lab.yaml").write_text(
                        f"image: lab.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nmode: {mode}\n"
                        f"negate: {negate}\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
                    p = levels / 255.0 if negate else (255 - levels) / 255.0
                    expected = numpy.full(levels.shape, numpy.nan)
                    if mode == "scale":
                        expected = numpy.floor(99 * (p - 0.196) / (0.65 - 0.196))
                    expected[p > 0.65] = 100
                    expected[p < 0.196] = 0
                    if mode == "raw":
                        expected = numpy.where(levels <= 100, levels, numpy.nan)
                    got = numpy.load(self.convert("lab.yaml", "lab.npy"))
                    numpy.testing.assert_array_equal(got, expected)

    def test_our_ros_map_is_a_yaml_and_a_pgm(self):
        values = numpy.array([[0, 100, numpy.nan], [100, 0, 0]])
        numpy.save(self.folder / "a.npy", values)
        yaml = self.convert("a.npy", "lab.yaml").read_text().splitlines()
        self.assertEqual(yaml[:3], ["image: lab.pgm", "resolution: 0.05", "origin: [0, 0, 0]"])
        _, levels = plain_values((self.folder / "lab.pgm").read_bytes())
        numpy.testing.assert_array_equal(levels, [[254, 0, 205], [0, 254, 254]])


if __name__ == "__main__":
    CONVERT = sys.argv.pop(1)
    unittest.main()
