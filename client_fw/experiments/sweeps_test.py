#!/usr/bin/env python3
"""Confidence intervals against published values, and what a sweep writes.

    sweeps_test.py
"""

import contextlib
import io
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

import sweeps


def squares(base, case):
    return [{"base": base, "case": case, "square": base * base / 3}], [{"base": base}]


class IntervalsTest(unittest.TestCase):
    def test_of_a_mean(self):
        # 1 to n: s^2 = n (n + 1) / 12; t of 1, 9 and 29 degrees of freedom from printed tables.
        for count, t in ((2, 12.706), (10, 2.262), (30, 2.045)):
            mean, half = sweeps.interval(range(1, count + 1))
            self.assertEqual(mean, (count + 1) / 2)
            self.assertAlmostEqual(half, t * ((count + 1) / 12) ** 0.5, places=9)

    def test_wilsons(self):
        # Newcombe 1998, table I, method 3.
        for successes, runs, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0, 0.1611),
                                           (1, 29, 0.0061, 0.1718)):
            with self.subTest(successes=successes):
                found = sweeps.wilson(successes, runs)
                self.assertAlmostEqual(found[0], low, places=4)
                self.assertAlmostEqual(found[1], high, places=4)


class SweepTest(unittest.TestCase):
    def test_rows_are_in_the_order_of_the_cases_for_any_number_of_processes(self):
        written = []
        for processes in ("1", "3"):
            with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()), \
                    mock.patch.object(sys, "argv", ["x", "--processes", processes, "--out", folder]):
                sweeps.main("Squares.", [(base, "a") for base in range(5)], squares, ("squares.csv", "bases.csv"))
                written.append([(pathlib.Path(folder) / name).read_bytes() for name in ("squares.csv", "bases.csv")])
        self.assertEqual(written[0], written[1])
        self.assertEqual(written[0][0], b"base,case,square\n0,a,0\n1,a,0.333333\n2,a,1.33333\n3,a,3\n4,a,5.33333\n")


if __name__ == "__main__":
    unittest.main()
