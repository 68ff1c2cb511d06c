#!/usr/bin/env python3
"""Each figure script draws valid SVG from the committed CSV files, the same bytes each time.

    figures_test.py
"""

import importlib.util
import pathlib
import sys
import tempfile
import unittest
import xml.etree.ElementTree

FOLDER = pathlib.Path(__file__).resolve().parent
ROOT = next(folder for folder in FOLDER.parents if (folder / "CMakePresets.json").exists())
sys.path.insert(0, str(ROOT / "deploy/pictures"))

import figure_style  # noqa: E402  (after the path)

SVG = "{http://www.w3.org/2000/svg}"


def scripts():
    """Each script, and the folder of its committed results."""
    for script in sorted(FOLDER.glob("*/figure.py")):
        yield script, script.parent / "results"
    for script in sorted(ROOT.glob("server/**/bench/figure.py")):
        yield script, script.parent.parent / "results"


def figures_of(script):
    spec = importlib.util.spec_from_file_location("figure", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.FIGURES


class FiguresTest(unittest.TestCase):
    def test_every_figure_is_drawn_from_committed_results(self):
        self.assertGreaterEqual(len(list(scripts())), 9)
        for script, results in scripts():
            figures = figures_of(script)
            with self.subTest(script=script), tempfile.TemporaryDirectory() as folder:
                written = figure_style.draw(figures, results, pathlib.Path(folder))
                self.assertEqual([path.stem for path in written], list(figures))
                for path in written:
                    root = xml.etree.ElementTree.parse(path).getroot()
                    self.assertEqual(root.tag, SVG + "svg")
                    self.assertGreater(len(list(root.iter(SVG + "text"))), 5, path.name)
                    self.assertTrue((results / path.name).is_file(), f"{path.name} is not committed")

    def test_the_same_results_give_the_same_bytes(self):
        figures = figures_of(FOLDER / "trails" / "figure.py")
        one = {"trails-trips": figures["trails-trips"]}
        with tempfile.TemporaryDirectory() as first, tempfile.TemporaryDirectory() as second:
            for folder in (first, second):
                figure_style.draw(one, FOLDER / "trails" / "results", pathlib.Path(folder))
            self.assertEqual(*((pathlib.Path(folder) / "trails-trips.svg").read_bytes()
                               for folder in (first, second)))

    def test_pdf_is_written_on_request(self):
        figures = {"path-errors": figures_of(FOLDER / "path" / "figure.py")["path-errors"]}
        with tempfile.TemporaryDirectory() as folder:
            written = figure_style.draw(figures, FOLDER / "path" / "results", pathlib.Path(folder),
                                        (".svg", ".pdf"))
            self.assertEqual([path.suffix for path in written], [".svg", ".pdf"])
            self.assertEqual(written[1].read_bytes()[:5], b"%PDF-")


if __name__ == "__main__":
    unittest.main()
