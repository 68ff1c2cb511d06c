#!/usr/bin/env python3
"""What `pheromoned --check` says of the configurations that we ship.

    examples_test.py --pheromoned PROGRAM

Each of them, and the default, is taken without a warning, and the laws are told in the words that
are written here.
"""

import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "deploy" / "examples"
PHEROMONED = ""
PATIENCE_S = 60

ALL_LAWS = """\
map: 12 m x 8 m from (0, 0), 121 x 81 nodes, one every 0.1 m; antennas 0.15 m from the centre at \
75.00 deg, 0.1 m ahead
pheromone 1 "counter": quantum 0.125, at most 0.875, loses one quantum every 30 s, full up to 0.1 \
m and sensed up to 0.3 m ahead
pheromone 2 "linear": quantum 0.125, at most 0.875, loses one quantum every 30 s in steps of \
1/64, full up to 0.1 m and sensed up to 0.3 m ahead
pheromone 3 "exponential": quantum 0.125, at most 0.875, halves every 20 s, full up to 0.1 m and \
sensed up to 0.3 m ahead
pheromone 4 "permanent": quantum 0.125, at most 0.875, never evaporates, full up to 0.1 m and \
sensed up to 0.3 m ahead
pheromone 5 "cone": quantum 0.125, at most 0.875, loses one quantum every 30 s, a cone sensed up \
to 0.3 m ahead
pheromone 6 "gaussian": quantum 0.125, at most 0.875, loses one quantum every 30 s, Gaussian of \
sigma 0.12 m sensed up to 0.4 m ahead
pheromone 7 "repellent": quantum 0.125, at most 0.25, halves every 60 s, a cone sensed up to 0.4 \
m, repels with weight -0.5
pheromone 8 "scent": quantum 0.5, at most 2, halves every 120 s, a cone sensed up to 0.2 m ahead, \
diffuses: 2.00 % of each difference every 0.2 s
pheromone 9 "guide": a blend of 0.5 x "counter", 0.25 x "permanent", -0.5 x "repellent"
""".splitlines()


def check(*arguments):
    return subprocess.run([PHEROMONED, "--check", *arguments], cwd=ROOT, text=True,
                          capture_output=True, timeout=PATIENCE_S, check=False)


class ExamplesTest(unittest.TestCase):
    def test_every_example_is_taken_without_a_warning(self):
        names = sorted(path.name for path in EXAMPLES.glob("*.toml"))
        self.assertEqual(names, ["all-laws.toml", "bench.toml", "links.toml", "outdoor-gps.toml",
                                 "repellent.toml", "tags.toml"])
        for name in names:
            result = check("--config", str(EXAMPLES / name))
            self.assertEqual((result.returncode, result.stderr), (0, ""), name)
            self.assertTrue(result.stdout.startswith(f"{EXAMPLES / name}: ok\n"), result.stdout)

    def test_the_default_is_taken_without_a_warning_or_a_note(self):
        for arguments in ((), ("--config", str(ROOT / "server" / "config" / "default.toml"))):
            result = check(*arguments)
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertNotIn("note: ", result.stdout)

    def test_each_law_is_told_in_words(self):
        result = check("--config", str(EXAMPLES / "all-laws.toml"))
        lines = [line.strip() for line in result.stdout.splitlines()]
        self.assertEqual(lines[1:11], ALL_LAWS)

    def test_what_lies_on_the_map_is_told(self):
        result = check("--config", str(EXAMPLES / "all-laws.toml"))
        self.assertIn("path of type 4: 5.0 m\n", result.stdout)  # 3 m and 2 m
        self.assertIn("path of type 4: 9.4 m, closed\n", result.stdout)  # 2 pi 1.5 m
        self.assertRegex(result.stdout, r"obstacles: \d+ nodes blocked\n")
        self.assertRegex(result.stdout, r"initial raster of type 4: \d+ nodes\n")
        self.assertIn("frame of robot 7 on link radio-a: origin (1, 1), turned by 90.00 deg\n",
                      result.stdout)
        outdoors = check("--config", str(EXAMPLES / "outdoor-gps.toml"))
        self.assertIn("datum: latitude 47.3769 deg, longitude 8.5417 deg, height 408 m\n",
                      outdoors.stdout)

    def test_every_key_is_in_the_manual_and_in_the_default(self):
        manual = (ROOT / "deploy" / "man" / "pheromoned.toml.5").read_text(encoding="utf-8")
        default = (ROOT / "server" / "config" / "default.toml").read_text(encoding="utf-8")
        known = keys_that_are_known()
        self.assertGreater(len(known), 50)
        for key in sorted(known):
            for text in (manual, default):
                self.assertTrue(re.search(rf"(?<![\w.]){key}\b", text), key)


def keys_that_are_known():
    """All keys, as the program lists them when it is given one that it does not know."""
    wrong = "zzzzzzzz = 1\n"
    texts = [wrong]
    for table in ("map", "antennas", "limits", "journal", "capture", "daemon", "control", "web",
                  "tags"):
        texts.append(f"[{table}]\n{wrong}")
    for table in ("pheromone", "frame", "tracker", "tag", "net"):
        texts.append(f"[[{table}]]\n{wrong}")
    texts += [f'[[link]]\nkind = "{kind}"\n{wrong}' for kind in ("pty", "serial", "tcp", "udp")]
    texts.append("[map]\nwidth_m = 1\nheight_m = 1\ncell_m = 1\ndatum = {zzzzzzzz = 1}\n[obstacles]\n"
                 f"{wrong}walls = [{{zzzzzzzz = 1}}]\n")
    field = ("[map]\nwidth_m = 1\nheight_m = 1\ncell_m = 1\n[antennas]\nbias_m = 0\n[[pheromone]]\n"
             'type = 1\nprofile = "cone"\nradius_m = 1\ntau_s = 0\nquantum = 1\nmaximum = 1\n')
    texts.append(field + "diffusion = {zzzzzzzz = 1}\n")
    texts.append(field + "[[pheromone]]\ntype = 2\nblend = [{zzzzzzzz = 1}]\n")
    texts.append(field + f"[[print]]\n{wrong}" + "".join(
        f"[[path]]\n{keys}{wrong}" for keys in ("", 'shape = "circle"\n', 'file = "x"\n')))
    known = set()
    with tempfile.TemporaryDirectory() as folder:
        for text in texts:
            path = pathlib.Path(folder) / "wrong.toml"
            path.write_text(text, encoding="utf-8")
            lists = re.findall(r"zzzzzzzz: unknown key, expected one of (.*)",
                               check("--config", str(path)).stderr)
            if not lists:
                raise AssertionError(f"no list of keys for\n{text}")
            known.update(key for line in lists for key in line.split(", "))
    return known


def main():
    global PHEROMONED
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pheromoned", required=True)
    arguments, rest = parser.parse_known_args()
    PHEROMONED = str(pathlib.Path(arguments.pheromoned).resolve())
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
