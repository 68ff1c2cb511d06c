#!/usr/bin/env python3
"""The Python module of the lab, installed by pip into an environment of its own, beside pheromone-swarm.

    lab_python_test.py BUILD_DIR BIN_DIR [UNITTEST ARGUMENT...]
"""

import contextlib
import csv
import gc
import importlib.util
import io
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest
import warnings
import weakref
from unittest import mock

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
BIN = pathlib.Path()
INSTALLED = "PHEROMONE_LAB_TEST_IS_INSTALLED"
if INSTALLED in os.environ:
    import numpy as np
    import pheromone_lab as lab

TRAIL = {"type": 1, "name": "trail", "core_m": 0.1, "sigma_m": 0.4, "tau_s": 0.0, "quantum": 0.125, "maximum": 1.0,
         "directional": True}
MAP = {"map": {"width_m": 10.0, "height_m": 10.0, "cell_m": 0.1}, "antennas": {"bias_m": 0.33}}


def small(*groups, **more):
    return {**MAP, "pheromone": [TRAIL, {**TRAIL, "type": 2, "name": "home"}], "robots": list(groups), **more}


def apart(count, name="ants", y=1.0, **more):
    """So many robots, a metre from each other, that head along +x."""
    return {"name": name, "starts": [[1.0 + i, y, 0.0] for i in range(count)], "radius_m": 0.1, **more}


def driven(count=3, **more):
    world = lab.World(small(apart(count, **more)), drive="ants")
    return world, world.groups["ants"]


def run(*command, **options):
    done = subprocess.run(command, text=True, capture_output=True, check=False, timeout=300, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done}")
    return done.stdout


class ViewsTest(unittest.TestCase):
    def test_arrays_are_the_worlds_own_and_change_with_it(self):
        world, ants = driven()
        self.assertTrue(np.shares_memory(world.robots.x_m, ants.x_m))
        x, y = ants.x_m, ants.y_m
        np.testing.assert_array_equal(x, [1, 2, 3])
        for _ in range(10):
            world.step(0.3, 0.3)
        self.assertTrue((x > [1.3, 2.3, 3.3]).all())
        np.testing.assert_array_equal(y, [1, 1, 1])
        self.assertIs(ants.x_m, x)

    def test_they_cannot_be_written_to(self):
        world = lab.World(small(apart(3), site=[{"name": "nest", "kind": "nest", "at_m": [2.0, 1.0]}]), drive="ants")
        ants = world.groups["ants"]
        arrays = {name: it for name, it in {**vars(ants), "sites": world.sites}.items() if isinstance(it, np.ndarray)}
        self.assertGreaterEqual(len(arrays), 15)
        for name, array in [*arrays.items(), ("p_left", ants.p_left[0]), ("p_right", ants.p_right[0])]:
            with self.subTest(name):
                with self.assertRaises(ValueError):
                    array[...] = array
                with self.assertRaises(ValueError):
                    array.setflags(write=True)

    def test_they_outlive_their_world(self):
        world, ants = driven()
        world.step(0.2, 0.2)
        core, x, expected = weakref.ref(world._core), ants.x_m[1:], ants.x_m[1:].copy()
        del world, ants
        gc.collect()
        self.assertIsNotNone(core())
        others = [driven() for _ in range(20)]  # what was freed would be theirs
        np.testing.assert_array_equal(x, expected)
        del x, others
        gc.collect()
        self.assertIsNone(core())

    def test_groups_are_parts_of_the_whole(self):
        world = lab.World(small(apart(2), apart(3, "bees", y=3.0, senses=["home", "trail"])), drive=["bees"])
        self.assertEqual([(it.first, it.count, it.driven, it.senses) for it in world.groups.values()],
                         [(0, 2, False, ("trail",)), (2, 3, True, ("home", "trail"))])
        np.testing.assert_array_equal(world.robots.y_m, [1, 1, 3, 3, 3])
        bees = world.groups["bees"]
        self.assertEqual((len(bees.p_left), len(world.groups["ants"].p_left)), (2, 1))
        self.assertIs(bees.sensed("trail")[1], bees.p_right[1])


class SensesTest(unittest.TestCase):
    def test_robots_sense_what_others_deposited(self):
        # The second robot deposits half a unit on its node, 0.3 m ahead of the first.
        world = lab.World(small({"name": "ants", "starts": [[5.0, 5.0, 0.0], [5.3, 5.0, 0.0]], "radius_m": 0.1}),
                          drive="ants")
        world.step(deposit=[0, 4])
        # Eq. (1) at the antennas, half of 0.33 m aside, and eq. (4).
        distance = math.hypot(0.3, 0.165)
        expected = 0.5 * (1 - (distance - 0.1) / 0.4) * 4096
        ants = world.groups["ants"]
        for side in (ants.p_left[0][0], ants.p_right[0][0]):
            self.assertAlmostEqual(side, expected, delta=1)
        levels = world.levels("trail")
        self.assertEqual((levels.shape, levels.sum(), levels[100 - 50][53]), ((101, 101), 0.5, 0.5))
        self.assertEqual(world.levels("home").sum(), 0)
        self.assertEqual(world.extent, (-0.05, 10.05, -0.05, 10.05))

    def test_deposits_may_be_of_another_kind_for_each_robot(self):
        world, ants = driven()
        world.step(deposit=[1, 2, 4], pheromone=[1, 2, 2])
        world.step(deposit=1, pheromone="home")
        self.assertEqual((world.levels("trail").sum(), world.levels("home").sum()), (1 / 8, 9 / 8))
        np.testing.assert_array_equal(ants.x_m, [1, 2, 3])

    def test_obstacles_are_nan(self):
        world = lab.World(small(apart(2), wall=[{"name": "wall", "points_m": [[0.0, 5.0], [10.0, 5.0]],
                                                 "thickness_m": 0.3}]))
        blocked = np.isnan(world.levels("trail"))
        self.assertTrue(blocked[50].all() and not blocked[:45].any() and not blocked[56:].any())

    def test_a_route_goes_around_the_wall_and_straight_on_when_it_is_open(self):
        world = lab.World(small(apart(1), wall=[{"name": "gate", "points_m": [[5.0, 0.0], [5.0, 6.0]]}],
                                event=[{"at_s": 1, "wall": "gate"}]), drive="ants")
        route = world.route((4.0, 3.0), (6.0, 3.0))
        np.testing.assert_array_equal(route[[0, -1]], [[4, 3], [6, 3]])
        length = np.hypot(*np.diff(route, axis=0).T).sum()
        # Around the two upper corners of the wall, or a cell beyond.
        least = 2 * math.hypot(0.95, 3.05) + 0.1
        self.assertTrue(least <= length < 1.05 * least, length)
        world.run(6)
        np.testing.assert_array_equal(world.route((4.0, 3.0), (6.0, 3.0)), [[4, 3], [6, 3]])
        for start, goal, clearance_m, said in (((4, 3), (11, 3), 0, r"goal: found \(11, 3\)"),
                                               ((math.nan, 3), (6, 3), 0, "start: found"),
                                               ((4, 3), (6, 3), -1, "clearance_m: found -1")):
            with self.subTest(said), self.assertRaisesRegex(lab.LabError, said):
                world.route(start, goal, clearance_m)

    def test_loads_are_picked_up_and_delivered(self):
        sites = [{"name": "nest", "kind": "nest", "at_m": [2.0, 1.0], "radius_m": 0.3},
                 {"name": "food", "kind": "food", "at_m": [1.0, 1.0], "radius_m": 0.3, "amount": 2}]
        world = lab.World(small(apart(1), site=sites), drive="ants")
        ants = world.groups["ants"]
        self.assertEqual((ants.site[0], world.sites["amount"].tolist()), (2, [0, 2]))
        world.step(load=1)
        self.assertEqual((ants.load[0], world.sites["amount"][1]), (2, 1))
        world.move_site("nest", 1.0, 1.5)
        world.set_amount("food", 7)
        while ants.site[0] != 0:
            world.step(0.3, 0.3)
        world.move_site(0, *map(float, (ants.x_m[0], ants.y_m[0])))
        world.step()
        self.assertEqual(ants.site[0], 1)
        world.step(load=-1)
        self.assertEqual((ants.load[0], world.sites["amount"].tolist(), world.measures()["deliveries"]),
                         (0, [1, 7], 1))

    def test_what_failed_stands(self):
        world, ants = driven()
        world.fail(1)
        world.step(0.2, 0.2)
        np.testing.assert_array_equal(ants.x_m > [1, 2, 3], [True, False, True])
        with self.assertRaisesRegex(lab.LabError, "robot: found 3, expected 0 to 2"):
            world.fail(3)

    def test_what_is_not_given_is_not_what_was_given_before(self):
        world, ants = driven()
        ants.act(0.2, 0.2)
        ants.act(deposit=1)
        world.step()
        np.testing.assert_array_equal(ants.x_m, [1, 2, 3])


class ErrorsTest(unittest.TestCase):
    def refused(self, message, **actions):
        """By act and by step, with no action set and nothing moved."""
        world, ants = driven()
        world.step(0.1, 0.1, 1)
        before = world.hash()
        for act in (world.step, ants.act):
            with self.assertRaises(lab.LabError) as caught:
                act(**actions)
            self.assertEqual(str(caught.exception), message)
            self.assertEqual((world.hash(), world.steps), (before, 1))
        world.step()
        self.assertEqual(world.levels("trail").sum(), 3 / 8)

    def test_shapes_and_kinds_are_refused_by_group_and_field(self):
        for found, value in (("shape (2,)", [0, 0]), ("shape (3, 1)", np.zeros((3, 1))), ("dtype <U4", "fast"),
                             ("dtype complex128", [1j, 0, 0]), ("dtype object", [None, 0, 0]), ("shape (0,)", [])):
            with self.subTest(found), warnings.catch_warnings():
                self.refused(f'group "ants", step 1: left: found {found}, expected one of these numbers for all '
                             "robots, or an array of 3", left=value)
        self.refused('group "ants", step 1: deposit: found dtype float64, expected one of these integers for all '
                     "robots, or an array of 3", right=[0.1] * 3, deposit=[1.0, 1, 1])

    def test_integers_out_of_range_are_refused_by_robot_and_field(self):
        for field, value, most, least in (("deposit", 65536, 65535, 0), ("deposit", -1, 65535, 0),
                                          ("load", 128, 127, -128), ("pheromone", 256, 255, 0),
                                          ("sense", np.uint64(2**64 - 1), 255, 0)):
            with self.subTest(field, value=value):
                self.refused(f'robot 2 (index 1) of "ants", step 1: {field} is {value}, expected {least} to {most}',
                             left=0.1, **{field: np.array([0, value, 0], dtype=np.asarray(value).dtype)})

    def test_nan_and_what_cannot_be_is_refused_by_robot_and_field_and_moves_nothing(self):
        for actions, message in (
                ({"left": [0, math.nan, 0]}, "robot 2 (index 1) of \"ants\", step 1: left_m_s is nan, expected -1.2 to 1.2"),
                ({"right": math.inf}, "robot 1 (index 0) of \"ants\", step 1: right_m_s is inf, expected -1.2 to 1.2"),
                ({"left": -1.3}, "robot 1 (index 0) of \"ants\", step 1: left_m_s is -1.3, expected -1.2 to 1.2"),
                ({"load": [0, 0, 2]}, "robot 3 (index 2) of \"ants\", step 1: load is 2, expected -1, 0 or 1"),
                ({"deposit": 1, "pheromone": 9}, "robot 1 (index 0) of \"ants\", step 1: pheromone is 9, expected one "
                 "of the map that is no blend, since it deposits 1 quanta")):
            with self.subTest(message):
                world, ants = driven()
                world.step(0.1, 0.1, 1)
                before = world.hash()
                with self.assertRaises(lab.LabError) as caught:
                    world.step(**actions)
                self.assertEqual(str(caught.exception), message)
                self.assertEqual((world.hash(), world.steps), (before, 1))
                world.step(0.1, 0.1)  # goes on
                self.assertEqual(world.steps, 2)

    def test_what_a_behaviour_raises_is_told_with_its_group_and_step(self):
        world = lab.World(small(apart(2)), drive={"ants": lambda group: 1 / 0})
        with self.assertRaisesRegex(lab.LabError, 'behaviour of group "ants", step 0: ZeroDivisionError') as caught:
            world.step()
        self.assertIsInstance(caught.exception.__cause__, ZeroDivisionError)
        for returned, message in ((7, "found 7, expected"), ((1,), r"found \(1,\), expected"),
                                  ({"speed": 1}, "unexpected keyword argument 'speed'"),
                                  ((0, math.nan), r'robot 1 \(index 0\) of "ants", step 0: right_m_s is nan'),
                                  (([0], 0), 'group "ants", step 0: left: found shape')):
            world = lab.World(small(apart(2)), drive={"ants": lambda group, it=returned: it})
            with self.subTest(returned), self.assertRaisesRegex(lab.LabError, message):
                world.step()

    def test_actions_without_a_group_that_waits_for_them(self):
        for drive, found in (((), 0), (["ants", "bees"], 2), ({"ants": lambda group: None}, 0)):
            world = lab.World(small(apart(2), apart(2, "bees", y=2.0)), drive=drive)
            with self.subTest(drive), self.assertRaisesRegex(lab.LabError, f"step: found actions, but {found} groups"):
                world.step(0.1, 0.1)
        core = lab.World(small(apart(2)))._core
        for group in (0, 1, 99):
            with self.assertRaisesRegex(lab.LabError, "not driven"):
                core.set_actions(group, 0, 0, 0, None, None, None)

    def test_names_that_are_not_there(self):
        with self.assertRaisesRegex(lab.LabError, 'drive: found "bees", expected one of "ants"'):
            lab.World(small(apart(1)), drive="bees")
        world, ants = driven()
        for call, message in ((lambda: world.levels("x"), "levels: found"), (lambda: ants.sensed("home"), "senses"),
                              (lambda: ants.act(pheromone="x"), "pheromone: found \"x\", expected one of"),
                              (lambda: world.move_site("x", 0, 0), "site: found \"x\""),
                              (lambda: world.move_site(0, 1.0, 1.0), "site: found 0, but there are 0"),
                              (lambda: world._core.levels(3), "pheromone: found 3"),
                              (lambda: world._core.arrays(2, 2), "there are 3"),
                              (lambda: lab.World(small(apart(1)), threads=0), "threads: found 0, expected 1 to 256")):
            with self.subTest(message), self.assertRaisesRegex(lab.LabError, message):
                call()

    def test_errors_of_a_scenario_name_the_key(self):
        for change, key in (({"map": {"width_m": 10.0, "height_m": 10.0, "cell_m": -1.0}}, r"map\.cell_m"),
                            ({"robots": [apart(1, behaviour="dance")]}, r"robots\[1\]\.behaviour"),
                            ({"robots": [apart(1, colour="red")]}, r"robots\[1\]\.colour"),
                            ({"robot": [apart(1)]}, "robot:")):
            with self.subTest(key), self.assertRaisesRegex(lab.LabError, rf"^scenario:\d+:\d+: {key}"):
                lab.World({**small(apart(1)), **change})
        with self.assertRaisesRegex(lab.LabError, r"run\.sed: unknown key"):
            lab.World(small(apart(1)), settings={"run.sed": 1})
        with self.assertRaisesRegex(TypeError, "a scenario cannot have a object"):
            lab.World(small({"name": object()}))

    def test_arrays_of_the_law_have_to_fit(self):
        p = np.zeros(3, np.int16)
        for left, right, speed, gain in ((p, p[:2], 0.2, 1), (p, p, -0.1, 1), (p, p, math.nan, 1), (p, p, 0.2, 99)):
            with self.assertRaises(lab.LabError):
                lab.differential(left, right, speed, gain)
        with self.assertRaises(TypeError):
            lab.differential(p.astype(float), p, 0.2)
        left, right = lab.differential(np.int16([0, 2048, -8192]), np.int16([0, 0, 8192]), 0.1)
        self.assertEqual((left.tolist(), right.tolist()), ([0.1, 0.05, 0.1], [0.1, 0.1, -0.1]))


class EndTest(unittest.TestCase):
    PLUGIN = """#include "client_fw/lab/behaviour_abi.h"
        int pheromone_behaviour_v1(const struct PheromoneView* view, const struct PheromoneActions* actions,
                                   size_t first, size_t count) {
          (void)actions; (void)first; (void)count;
          return view->step == 2 ? 7 : 0;
        }"""

    def test_an_error_of_the_world_ends_it_but_not_its_arrays(self):
        with tempfile.TemporaryDirectory() as folder:
            library = pathlib.Path(folder) / "seven.so"
            run("cc", "-shared", "-fPIC", "-I", ROOT, "-x", "c", "-", "-o", library, input=self.PLUGIN)
            scenario = pathlib.Path(folder) / "seven.toml"
            scenario.write_text(lab.to_toml(small(apart(2), apart(2, "bees", y=2.0, plugin="seven.so"))))
            world = lab.World(scenario, drive="ants")
            world.step(0.2, 0.2)
            with self.assertRaisesRegex(lab.LabError, "7"):
                world.step(0.2, 0.2)
            x = world.groups["ants"].x_m
            before = x.copy()
            for use in (world.step, world.hash, world.measures, world.result, lambda: world.levels("trail"),
                        lambda: world.groups["ants"].act(0.1), lambda: world.fail(0)):
                with self.assertRaisesRegex(lab.LabError, "the world has ended, make another one: .*7"):
                    use()
            np.testing.assert_array_equal(x, before)


class ThreadsTest(unittest.TestCase):
    def test_others_run_during_a_step_but_do_not_look_at_its_world(self):
        world = lab.World(small({"name": "ants", "count": 400, "radius_m": 0.0, "behaviour": "explore"}))
        seen = threading.Event()
        errors = []

        def step():
            try:
                while not seen.is_set():
                    world.step()
            except lab.LabError as error:
                errors.append(error)
        stepping = threading.Thread(target=step)
        stepping.start()
        end = time.monotonic() + 60
        message = ""
        while stepping.is_alive() and not message and time.monotonic() < end:
            try:
                world.measures()
            except lab.LabError as error:  # only while the other thread is within a step
                message = str(error)
        seen.set()
        stepping.join()
        self.assertEqual((message, errors), ("another thread is using this world, expected one at a time", []))
        self.assertGreater(world.steps, 0)


class SameTest(unittest.TestCase):
    """The same scenario has the same hash, whoever runs it."""
    LIVELY = {
        "run": {"duration_s": 60, "seed": 5}, **MAP,
        "pheromone": [{**TRAIL, "tau_s": 20.0}, {**TRAIL, "type": 2, "name": "home", "tau_s": 40.0}],
        "site": [{"name": "nest", "kind": "nest", "at_m": [2.0, 2.0], "radius_m": 1.0},
                 {"name": "food", "kind": "food", "at_m": [6.0, 3.0], "radius_m": 0.7, "amount": 5, "refill_s": 4.0}],
        "wall": [{"name": "gate", "points_m": [[4.0, 0.0], [4.0, 5.0]], "thickness_m": 0.2}],
        "event": [{"at_s": 10.0, "wall": "gate", "open": True}, {"at_s": 30.0, "site": "food", "to_m": [7.0, 7.0]},
                  {"at_s": 40.0, "robots": "ants", "fail": 0.2}, {"at_s": 60.0, "robots": "ants", "fail": 1.0}],
        "robots": [{"name": "ants", "behaviour": "forage", "count": 60, "radius_m": 0.1, "slip": 0.05,
                    "odometry_noise": 0.02, "fix_period_s": 2.0, "fix_sigma_m": 0.05},
                   {"name": "wanderers", "behaviour": "explore", "count": 10, "radius_m": 0.2}]}

    def test_pheromone_swarm_has_the_same_hash_and_measures(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "lively.toml"
            path.write_text(lab.to_toml(self.LIVELY))
            row = swarm_row(path, folder)
            for threads in (1, 2):
                for scenario in (self.LIVELY, path):
                    world = lab.World(scenario, threads=threads)
                    self.assertIsNone(world.result())
                    world.run()
                    result = world.result()
                    self.assertEqual(result.pop("hash"), int(row["hash"], 16))
                    for name, value in result.items():
                        self.assertAlmostEqual(float(row[name]), value, delta=1e-6 * max(1, abs(value)), msg=name)
            self.assertGreater(result["deliveries"], 0)
            world = lab.World(path, settings={"run.seed": 6})
            world.run()
            self.assertNotEqual(world.result()["hash"], int(row["hash"], 16))

    def test_python_that_does_the_same_makes_the_same_world(self):
        # Robots that meet nothing and do not wander go straight on.
        straight = {"behaviour": "explore", "senses": ["trail"],
                    "parameters": {"speed_m_per_s": 0.3, "quanta": 2, "wander_deg": 0}}
        scenario = small(apart(4, **straight), apart(4, "bees", y=2.0, **straight))
        built_in = lab.World(scenario)
        built_in.run(20)
        for drive in (["ants"], ["bees"], ["ants", "bees"], {"bees": lambda group: (0.3, 0.3, 2)}):
            with self.subTest(drive):
                world = lab.World(scenario, drive=drive)
                for _ in range(20):
                    for name in drive if isinstance(drive, list) else ():
                        count = len(world.groups[name])
                        world.groups[name].act(np.full(count, 0.3), [0.3] * count, np.full(count, 2, np.uint8))
                    world.step()
                self.assertEqual(world.hash(), built_in.hash())
        self.assertGreater(built_in.levels("trail").sum(), 4)

    def test_chance_is_that_of_compiled_behaviours(self):
        world, ants = driven()

        def draw(seed, robot, step, use):  # behaviour_abi.h
            z, mask = 0, 2**64 - 1
            for word in (seed, robot, step, use):
                z = (z + word + 0x9E3779B97F4A7C15) & mask
                z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
                z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
                z ^= z >> 31
            return (z >> 12) / 2**52
        for step in range(2):
            self.assertEqual(ants.uniform(7).tolist(), [draw(1, robot, step, 7) for robot in range(3)])
            world.step()


def swarm_row(path, folder):
    """The summary of pheromone-swarm lab run."""
    summary = pathlib.Path(folder) / "summary.csv"
    run(BIN / "pheromone-swarm", "lab", "run", path, "--summary", summary)
    (row,) = csv.DictReader(io.StringIO(summary.read_text()))
    return row


class EnvironmentsTest(unittest.TestCase):
    SCENARIO = SameTest.LIVELY

    def made(self):
        from pheromone_lab import observations
        world = lab.World(self.SCENARIO, drive="ants")
        return observations, world, world.groups["ants"]

    def test_a_robot_is_a_row(self):
        observations, world, ants = self.made()
        seen = observations.observe(world, ants)
        names = observations.columns(ants)
        self.assertEqual((seen.shape, seen.dtype), ((60, len(names)), np.float32))
        np.testing.assert_allclose(seen[:, names.index("x_m")], ants.x_m, rtol=1e-6)
        self.assertTrue((np.abs(seen[:, names.index("heading_rad")]) <= np.float32(math.pi)).all())
        delivered = observations.act(world, ants, np.tile([9.0, 9.0, 9.0], (60, 1)), 2)  # as fast as can be
        self.assertEqual((delivered.sum(), world.steps), (0, 1))
        self.assertEqual(np.nanmax(world.levels("trail")), 0.25)

    def test_wrong_actions_are_refused_by_robot(self):
        observations, world, ants = self.made()
        with self.assertRaisesRegex(lab.LabError, r"found shape \(60, 2\), expected \(60, 3\)"):
            observations.act(world, ants, np.zeros((60, 2)), 8)
        actions = np.zeros((60, 3))
        actions[4][1] = math.nan
        with self.assertRaisesRegex(lab.LabError, r'robot 5 of group "ants", step 0: actions: found \[0.0, nan, 0.0\]'):
            observations.act(world, ants, actions, 8)

    def test_what_is_missing_is_told(self):
        for module, name in (("pheromone_lab.gym", "gymnasium"), ("pheromone_lab.zoo", "pettingzoo")):
            with mock.patch.dict(sys.modules, {"gymnasium": None, "pettingzoo": None}), \
                    self.assertRaisesRegex(ImportError, f"pip install {name}"):
                sys.modules.pop(module, None)
                importlib.import_module(module)

    # Those who have the libraries get their own checks.
    @unittest.skipUnless(importlib.util.find_spec("gymnasium"), "Debian 12 has no Gymnasium")
    def test_gymnasium_accepts_it(self):
        from gymnasium.utils.env_checker import check_env
        from pheromone_lab.gym import SwarmEnv
        check_env(SwarmEnv(self.SCENARIO, "ants"), skip_render_check=True)

    @unittest.skipUnless(importlib.util.find_spec("pettingzoo"), "Debian 12 has no PettingZoo")
    def test_pettingzoo_accepts_it(self):
        from pettingzoo.test import parallel_api_test
        from pheromone_lab.zoo import SwarmParallelEnv
        parallel_api_test(SwarmParallelEnv(self.SCENARIO, "ants"), num_cycles=400)

    def with_stand_ins(self, module):
        """The module, with as much of the two libraries as it uses."""
        class Box:
            def __init__(self, low, high, shape=None):
                self.shape = np.shape(low) if shape is None else shape
                self.low, self.high = np.broadcast_to(low, self.shape), np.broadcast_to(high, self.shape)

        class Env:
            np_random = np.random.default_rng(1)

            def reset(self, *, seed=None, options=None):
                pass
        stand_ins = {"gymnasium": types.SimpleNamespace(Env=Env, spaces=types.SimpleNamespace(Box=Box)),
                     "pettingzoo": types.SimpleNamespace(ParallelEnv=object)}
        with mock.patch.dict(sys.modules, stand_ins):
            sys.modules.pop(module, None)
            return importlib.import_module(module)

    def fits(self, space, value):
        self.assertEqual((space.shape, np.float32), (value.shape, value.dtype))
        self.assertTrue(((space.low <= value) & (value <= space.high)).all())

    def test_an_episode_of_one_environment(self):
        env = self.with_stand_ins("pheromone_lab.gym").SwarmEnv(self.SCENARIO, "ants", settings={"run.duration_s": 1.0})
        self.assertEqual(env.action_space.shape, (60, 3))
        first, _ = env.reset(seed=3)
        again, _ = env.reset(seed=3)
        other, _ = env.reset(seed=4)
        self.fits(env.observation_space, first)
        np.testing.assert_array_equal(first, again)
        self.assertTrue((first != other).any())
        self.assertTrue((env.reset()[0] != env.reset()[0]).any(), "each episode begins alike")
        for step in range(5):
            seen, reward, terminated, truncated, _ = env.step(env.action_space.high)
            self.fits(env.observation_space, seen)
            self.assertEqual((reward, terminated, truncated), (0, False, step == 4))

    def test_an_episode_of_many_agents(self):
        env = self.with_stand_ins("pheromone_lab.zoo").SwarmParallelEnv(self.SCENARIO, "ants",
                                                                        settings={"run.duration_s": 1.0})
        seen, infos = env.reset(seed=3)
        self.assertEqual((len(seen), list(seen), list(infos)), (60, env.possible_agents, env.agents))
        self.fits(env.observation_space("ants_59"), seen["ants_59"])
        self.assertIs(env.action_space("ants_0"), env.action_space("ants_0"))
        for step in range(5):
            told = env.step({agent: env.action_space(agent).low for agent in env.agents})
            self.assertEqual([list(it) for it in told], [env.possible_agents] * 5)
            self.assertEqual((set(told[2].values()), set(told[3].values())), ({False}, {step == 4}))
        self.assertEqual(env.agents, [])

    def test_who_delivers_is_rewarded(self):
        env = self.with_stand_ins("pheromone_lab.gym").SwarmEnv(small(apart(2, y=2.0), site=[
            {"name": "food", "kind": "food", "at_m": [1.0, 2.0], "radius_m": 0.4},
            {"name": "nest", "kind": "nest", "at_m": [1.0, 2.4], "radius_m": 0.3}]), "ants")
        env.reset()
        stay = np.zeros((2, 3), np.float32)
        env.step(stay)
        self.assertEqual(env.world.groups["ants"].load.tolist(), [1, 0])
        env.world.move_site("food", 8.0, 8.0)
        env.world.move_site("nest", 1.0, 2.0)
        env.step(stay)
        self.assertEqual(env.step(stay)[1], 1)
        self.assertEqual((env.step(stay)[1], env.world.measures()["deliveries"]), (0, 1))


class ExperimentsTest(unittest.TestCase):
    """Those of client_fw/experiments that are in Python."""

    @classmethod
    def setUpClass(cls):
        experiments = ROOT / "client_fw" / "experiments"
        sys.path[:0] = [str(experiments), *(str(experiments / name) for name in ("arms", "maze", "synapses"))]
        global arms, maze, road_ants, synapses
        import arms
        import maze
        import road_ants
        import synapses

    def test_ants_choose_roads_in_proportion_to_the_square(self):
        looks = road_ants.Looks(30_000, 3)
        looks.seen[:] = (0.2, 0.6, 5.0)
        is_open = np.array([True, True, False])  # of the third, whatever is seen there
        roads = looks.choose((np.arange(30_000) + 0.5) / 30_000, np.arange(30_000), is_open)
        np.testing.assert_array_equal(np.bincount(roads), [6_000, 24_000])  # 0.4^2 : 0.8^2
        self.assertTrue(np.isnan(looks.seen).all())

    def test_branches_have_their_lengths_and_do_not_cross(self):
        for count in range(2, 6):
            corners = list(arms.branches(count))
            lengths = [np.hypot(*np.diff(branch, axis=0).T).sum() for branch in corners]
            np.testing.assert_allclose(lengths, np.linspace(6.6, 13.2, count))
            # From the outermost on one side to that on the other, at the stub and in the middle.
            sides = [[branch[1][1], branch[2][1]] for branch in corners]
            for one, other in zip(sorted(sides), sorted(sides)[1:]):
                self.assertTrue((np.array(one) < other).all())

    def test_each_choice_at_the_nest_is_counted(self):
        # While the short branch is closed, only the long one brings ants home with a trail.
        with mock.patch.multiple(arms, BRIDGES=2, TILES_A_ROW=4, DURATION_S={"late": 600}):
            choices = arms.simulate(2, "late")
        self.assertEqual(choices.shape, (4, 4, 2, 2))
        short, long = choices[-1].sum(axis=(0, 1))
        self.assertGreater(long, 2 * short)
        # Ten ants, at 0.3 m/s: 13.2 m a way and some turns, or 3.3 m to the wall.
        of_bridge = choices[1:].sum(axis=(0, 3))
        least, most = (10 * 450 / trip_s for trip_s in (2 * 13.2 / 0.3 + 40, 2 * 3.3 / 0.3))
        self.assertTrue(((of_bridge >= least) & (of_bridge <= most)).all(), of_bridge)

    def test_ants_that_a_wall_cuts_off_come_home_by_another_branch(self):
        with mock.patch.multiple(arms, BRIDGES=4, TILES_A_ROW=4, EVENTS={"again": [(150, False)]},
                                 DURATION_S={"again": 750}):
            choices = arms.simulate(3, "again")
        of_bridge = choices[2:].sum(axis=(0, 3))
        self.assertTrue((of_bridge >= 10 * 450 / (2 * 13.2 / 0.3 + 60)).all(), of_bridge)

    def test_the_maze_is_the_drawn_one(self):
        for gate_open, shortest in ((True, 10), (False, 18)):
            ways = maze.openings(gate_open)
            neighbours = np.zeros((36, 36), int)
            for cell, direction in zip(*np.nonzero(ways)):
                neighbours[cell, cell + maze.STEPS[direction] @ (1, 6)] = 1
            np.testing.assert_array_equal(neighbours, neighbours.T)
            reached, steps = np.eye(36, dtype=int)[0], 0
            while not reached[35]:
                reached, steps = np.minimum(1, reached + reached @ neighbours), steps + 1
            self.assertEqual(steps, shortest)

    def test_ants_find_the_goal_and_keep_out_of_walls(self):
        with mock.patch.object(maze, "ROBOTS", 4):
            tiles = np.array([(0.5, 0.5), (7.5, 0.5)])
            world = lab.World(maze.scenario(200, tiles), drive="ants")
            ants = maze.Ants([maze.CONSTANT, maze.SCALED], tiles)
            ways = maze.openings(True)
            while world.time_s < 600:
                world.step(**ants.decide(world.groups["ants"], world.steps, ways))
        self.assertEqual(world.measures()["wall_contacts_per_robot_hour"], 0)
        cells = np.concatenate([found for _, _, found in ants.found])
        self.assertGreater(len(cells), 4)
        self.assertTrue((cells >= 10).all())
        for robot in range(8):  # a path is from cell to cell, without loops
            path = ants.path[robot, :ants.last[robot] + 1]
            self.assertEqual(len(set(path)), len(path))
            self.assertTrue(all(abs(a % 6 - b % 6) + abs(a // 6 - b // 6) == 1 for a, b in zip(path, path[1:])))

    def test_maps_of_synapses_are_read_where_they_were_printed_and_halve(self):
        random = np.random.default_rng(1)
        levels = random.uniform(0, 1, (30, 13, 13)) * synapses.free_nodes()
        world = synapses.world_of(levels, synapses.starts(random, 30, 1), half_life_s=10)
        np.testing.assert_allclose(synapses.levels_of(world, 30), levels, atol=2e-5)  # a node has 1/64 quantum
        for _ in range(20):
            world.step(0, 0)
        np.testing.assert_allclose(synapses.levels_of(world, 30), levels / 2, atol=2e-5)

    def test_the_way_to_the_goal_is_about_that_of_a_star(self):
        world = synapses.world_of(np.zeros((1, 13, 13)), np.zeros((1, 1, 3)))
        at = synapses.origins(1)[0]
        for place in ((1, 1), (5, 0.5), (3, 2), (5.5, 4), (0, 5.5), (0, 3.5)):
            way = np.hypot(*np.diff(world.route(tuple(at + place), tuple(at + synapses.GOAL_M)), axis=0).T).sum()
            self.assertAlmostEqual(synapses.left_to_go_m(np.array(place)), way, delta=0.5)  # the wall is half a metre thick

    def test_the_networks_weights_are_those_of_the_difference(self):
        seen = types.SimpleNamespace(p_left=[np.array([2048, 2048], np.int16)], p_right=[np.array([1024, 1024], np.int16)])
        left, right = synapses.steer(seen, np.array([(1.0, -1.0), (0.5, -2.0)]))
        # D = (2048 - 1024) / 4096, (1024 - 2048) / 4096; the stronger side's wheel turns at 0.3 m/s (1 - |D|).
        np.testing.assert_allclose((left, right), [(0.225, 0.3), (0.3, 0.225)])

    def test_ants_lay_ways_to_the_goal_and_learning_finds_one(self):
        with mock.patch.multiple(synapses, SEEDS=2, TESTED_S=(900,), GENERATIONS=15, SHOWN=(15,), FRESH=50):
            (_, levels, _), = synapses.lay(0)
            self.assertTrue((levels[:, ~synapses.free_nodes()] == 0).all())
            self.assertTrue((levels[:, 10, 3] > 0.2).all(), levels[:, 10, 3])  # at the goal
            even = np.full((2, 13, 13), 0.5) * synapses.free_nodes()
            poses = synapses.starts(np.random.default_rng(5), 2, 50)
            (_, learnt, _), = synapses.learn(0.0)
            came = [np.isfinite(synapses.roll_out(them, poses)[0]).mean() for them in (even, learnt)]
            self.assertGreater(came[1], 1.5 * came[0])

    def test_paths_of_ants_go_from_node_to_node_without_loops(self):
        ants = synapses.Ants(0, np.repeat(synapses.origins(2), 12, axis=0))
        world = synapses.world_of(np.zeros((2, 13, 13)), synapses.starts(np.random.default_rng(6), 2, 12), 300)
        for _ in range(600):
            world.step(**ants.decide(world.groups["ants"]))
            for path, last in zip(ants.path, ants.last):
                path = path[:last + 1]
                self.assertEqual(len(set(path)), len(path))
                across, up = np.abs(np.diff(path % 13)), np.abs(np.diff(path // 13))
                self.assertTrue((np.maximum(across, up)[:-1] == 1).all())  # the last may be from the goal's edge


class PackageTest(unittest.TestCase):
    def test_everything_has_types_that_are_right(self):
        with tempfile.TemporaryDirectory() as cache:
            run("/usr/bin/python3", "-m", "mypy", "--cache-dir", cache, "--config-file", HERE / "pyproject.toml", "pheromone_lab", cwd=HERE / "src")

    def test_the_stub_is_of_what_was_compiled(self):
        stub = (HERE / "src" / "pheromone_lab" / "_core.pyi").read_text()
        simulation = stub[stub.index("class Simulation"):]
        self.assertEqual(set(re.findall(r"def (\w+)", simulation)) - {"__init__"},
                         {it for it in vars(lab._core.Simulation) if not it.startswith("_")})

    def test_a_scenario_of_python_is_the_same_in_toml(self):
        import tomllib
        scenario = {**SameTest.LIVELY, "robots": [{"name": 'a "quoted" \\ name\n', "count": 3, "on": True, "a.key": "é\x7f",
                                                   "numbers": [1, 2.5, 1e-7], "parameters": {"a": 1.0}}]}
        self.assertEqual(tomllib.loads(lab.to_toml(scenario)), scenario)
        self.assertEqual(tomllib.loads(lab.to_toml({"a": {"b": np.float32(0.5), "c": np.arange(2)}})),
                         {"a": {"b": 0.5, "c": [0, 1]}})

    def test_each_of_many_robots_may_have_its_start(self):
        starts = np.stack([np.arange(20_000) % 200 * 0.3 + 1, np.arange(20_000) // 200 * 0.3 + 1, np.full(20_000, 90.0)],
                          axis=1)
        world = lab.World(small({"name": "ants", "starts": starts, "radius_m": 0.1},
                                map={"width_m": 80.0, "height_m": 80.0, "cell_m": 0.1, "wide": True}))
        np.testing.assert_allclose(world.robots.x_m, starts[:, 0])
        np.testing.assert_allclose(world.robots.heading_rad, math.pi / 2)

    def test_the_programs_of_the_page_run(self):
        programs = re.findall(r"^```python\n(.*?)^```", (HERE / "README.md").read_text(), re.M | re.S)
        self.assertEqual(len(programs), 2)
        with contextlib.chdir(HERE.parent / "examples"), contextlib.redirect_stdout(io.StringIO()) as told:
            for program in programs:
                exec(program, {"pheromone_lab": lab})
        self.assertIn("'deliveries': 0.0", told.getvalue())

    def test_ants_of_forty_lines_find_more_with_a_trail(self):
        example = HERE / "examples" / "forage.py"
        self.assertLessEqual(len(example.read_text().splitlines()), 40)
        rates = [sum(float(run(sys.executable, example, quanta, seed).split()[0]) for seed in ("1", "2"))
                 for quanta in ("0", "1")]
        self.assertGreater(rates[1], 1.3 * rates[0])
        self.assertGreater(rates[0], 0)


def install(build):
    """A Python with the module, in a folder of its own: without a network, with Debian's packages."""
    folder = pathlib.Path(tempfile.mkdtemp(dir=build / "python"))
    run(sys.executable, "-m", "venv", "--system-site-packages", folder)
    run(folder / "bin/pip", "install", "--no-build-isolation", "--no-deps", "--no-index", HERE,
        env={**os.environ, "PHEROMONE_BUILD": str(build)})
    return folder


if __name__ == "__main__":
    if INSTALLED in os.environ:
        BIN = pathlib.Path(sys.argv[2]).resolve()
        unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
    import shutil
    where = install(pathlib.Path(sys.argv[1]).resolve())
    try:
        status = subprocess.run([where / "bin/python3", *sys.argv], env={**os.environ, INSTALLED: "1"}, check=False)
    finally:
        shutil.rmtree(where)
    sys.exit(status.returncode)
