#!/usr/bin/env python3
"""The experiments whose robots are in Python, in the lab.

    lab_experiments_test.py BUILD_DIR [UNITTEST ARGUMENT...]
"""

import csv
import pathlib
import sys
import types
import unittest
from unittest import mock

import numpy as np

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = map(str, (HERE, HERE / "arms", HERE / "bridge", HERE / "maze", HERE / "synapses", HERE.parent / "lab/python/testing"))

import built  # noqa: E402  (after the path)

lab = built.load(sys.argv.pop(1))

import arms  # noqa: E402  (after pheromone_lab)
import bridge_lab  # noqa: E402
import maze  # noqa: E402
import road_ants  # noqa: E402
import synapses  # noqa: E402


class ExperimentsTest(unittest.TestCase):
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

    def test_corridors_in_the_lab_are_those_of_the_bridge(self):
        corridors = bridge_lab.corridors(2)
        with open(HERE / "bridge/results/bridge-arena.csv", encoding="utf-8") as file:  # by arena.cc
            rows = [row for row in csv.DictReader(file) if row["what"] == "corridor"]
        first = [row for row in rows if (row["seed"], row["time_s"]) == (rows[0]["seed"], rows[0]["time_s"])]
        for number, line in enumerate(corridors):
            expected = [(float(row["x_m"]), float(row["y_m"])) for row in first if int(row["number"]) == number]
            np.testing.assert_allclose(line, expected, atol=0.00051)
        # Of bridges side by side no antenna, 0.165 m from its robot, is within 0.5 m of another's trail. Walls are 0.14 m
        # from the centre lines at most, and nodes half a cell's diagonal from the robots that deposit.
        extent = np.ptp(np.concatenate(corridors), axis=0)
        self.assertTrue((extent + 2 * 0.14 + 0.165 + 0.5 + 0.071 < bridge_lab.TILE_M).all(), extent)

    def test_branches_of_a_bridge_without_pheromone_are_chosen_evenly_and_fill_by_their_length(self):
        off = np.zeros(2)

        def compare(world, swarms):
            robots = world.groups["robots"]
            tile = np.repeat(np.arange(20), 8)
            x_m, y_m = robots.true_x_m - 7 * (tile % 14), robots.true_y_m - 5 * (tile // 14)
            aside = np.sin((robots.true_heading_rad - swarms.heading) / 2) * 2
            off[:] = np.maximum(off, (np.hypot(x_m - swarms.x_m, y_m - swarms.y_m).max(), np.abs(aside).max()))
            self.assertFalse(robots.p_left[0].any() or robots.p_right[0].any())

        _, swarms, choices = bridge_lab.simulate(1, 20, 300, quanta=0, on_sensed=compare)
        # Six choices in 300 s: 5.6 m and 2 s on the short way, 9.1 m on the long one.
        self.assertGreater(len(choices), 160 * (300 - 5) / 33)
        took_short = choices[:, 2].sum()
        self.assertLess(abs(took_short - len(choices) / 2), 2.58 * np.sqrt(len(choices)) / 2)  # 99 %
        self.assertAlmostEqual(swarms.steps_on[0].sum() / swarms.steps_on.sum(), 1 / 3, delta=0.03)
        # The lab's wheels roll multiples of 1 mm in a move: half of it along, and on the spot 1/0.33 mrad.
        np.testing.assert_array_less(off, (0.001, 0.0031))

    def test_robots_on_a_bridge_in_the_lab_take_the_branch_that_is_marked(self):
        scenario, (nest_stem, *branches, food_stem) = bridge_lab.scenario, bridge_lab.corridors(2)
        for marked, short_share in zip(branches, (1, 0)):
            def with_trail(*arguments, marked=marked):
                paths = [{"pheromone": "trail", "points_m": line.round(6).tolist()} for line in (nest_stem, marked, food_stem)]
                return {**scenario(*arguments), "path": paths}

            with mock.patch.object(bridge_lab, "scenario", with_trail):
                _, _, choices = bridge_lab.simulate(2, 1, 150, quanta=0, tau_s=0)
            self.assertGreater(len(choices), 20)
            self.assertLess(abs(choices[:, 2].mean() - short_share), 0.1)

    def test_each_period_of_a_robot_on_a_bridge_in_the_lab_leaves_one_quantum(self):
        moved, before = 0, None

        def count(world, _):
            nonlocal moved, before
            x_m = world.groups["robots"].true_x_m.copy()
            moved += 0 if before is None else int((x_m != before).sum())
            before = x_m

        # They drive all the time, and no node gets more than the 32 quanta that fill it.
        world, _, _ = bridge_lab.simulate(3, 2, 15, tau_s=0, on_sensed=count)
        count(world, None)
        self.assertGreater(moved, 16 * 10 / 0.2)
        self.assertEqual(world.levels("trail").sum() * 32, moved)

    def test_bridges_in_the_lab_can_be_repeated(self):
        runs = [bridge_lab.simulate(seed, 3, 60) for seed in (1, 1, 2)]
        rows = [bridge_lab.runs_of(swarms, choices, 60) for _, swarms, choices in runs]
        hashes = [world.hash() for world, _, _ in runs]
        self.assertEqual((hashes[0], rows[0]), (hashes[1], rows[1]))
        self.assertNotEqual(hashes[0], hashes[2])

    def test_a_swarm_on_a_bridge_in_the_lab_has_decided_by_its_last_quarter(self):
        late = [(900, 0, 1)] * 4 + [(1199, 0, 0)] + [(900, 1, 0)] * 9 + [(901, 1, 1)] + [(899, 2, 1)] * 9 + [(900, 2, 0)]
        choices = np.array(late + [(900, 2, 1)]) * (1000, 1, 1)
        runs = bridge_lab.runs_of(bridge_lab.Swarms(3 * 8), choices, 1200)
        self.assertEqual([(row["final_share"], row["outcome"]) for row in runs],
                         [(0.8, "short"), (0.1, "long"), (0.5, "undecided")])

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

    def test_an_ant_that_the_gate_stops_on_its_way_home_looks_in_the_middle_of_a_cell(self):
        with mock.patch.multiple(maze, CLOSES_S=300, OPENS_S=600):
            tiles = np.array([(0.5, 0.5), (7.5, 0.5)])
            world = lab.World(maze.scenario(200, tiles), drive="ants")
            ants = maze.Ants([maze.CONSTANT, maze.SCALED], tiles)
            robots, stopped = world.groups["ants"], 0
            while world.time_s < 600:
                stopped += ((robots.contact == lab.WALL_CONTACT) & (ants.state == maze.BACK)).sum()
                world.step(**ants.decide(robots, world.steps, maze.openings(world.time_s < 300)))
                aside = np.hypot((robots.x_m - 0.5) % 1 - 0.5, (robots.y_m - 0.5) % 1 - 0.5)
                self.assertTrue((aside[ants.state == maze.LOOK] < 0.1).all(), world.time_s)
        self.assertGreater(stopped, 0)

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


if __name__ == "__main__":
    unittest.main()
