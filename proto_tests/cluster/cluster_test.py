#!/usr/bin/env python3
"""Two servers with one log: a robot at either of them, and what remains when one is gone.

    cluster_test.py BIN_DIR
"""

import pathlib
import signal
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from cluster.machines import Machines  # noqa: E402
from operated_daemon import await_that  # noqa: E402
from stranger.client import Client, Refused  # noqa: E402
from stranger.servers import Servers  # noqa: E402

BIN = pathlib.Path(sys.argv.pop(1)).resolve() if len(sys.argv) > 1 else None


class ClusterTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.machines = Machines(BIN, pathlib.Path(temporary.name))
        self.addCleanup(self.machines.close)
        self.leader = self.machines.leader()
        self.follower = next(it for it in self.machines.nodes if it != self.leader)

    def robot(self, number, *nodes):
        line = Servers([self.machines.address(node) for node in nodes])
        self.addCleanup(line.close)
        return Client(line, number, timeout=0.075, tries=200)

    def test_what_a_robot_lays_at_one_server_is_sensed_at_the_other(self):
        at_leader, at_follower = self.robot(1, self.leader), self.robot(2, self.follower)
        epochs = {robot.hello(7).epoch for robot in (at_leader, at_follower)}
        self.assertEqual(len(epochs), 1)
        for layer, other in ((at_leader, at_follower), (at_follower, at_leader)):
            layer.deposit(1, 5000, 5000, 8)
            self.machines.await_equal()
            here, there = (robot.sense(1, 5000, 5000, 0) for robot in (layer, other))
            self.assertGreater(there.left + there.right, 0)
            self.assertAlmostEqual(here.left, there.left, delta=4)  # a moment later

    def test_the_other_server_goes_on_when_the_leader_is_killed(self):
        robot = self.robot(3, self.leader, self.follower)
        epoch = robot.hello(7).epoch
        robot.deposit(1, 5000, 5000, 8)
        self.machines.kill(self.leader)
        robot.deposit(1, 5000, 5000, 8)
        self.assertEqual(self.machines.leader(), self.follower)
        status = self.machines.status(self.follower)
        self.assertEqual(status["epoch"], epoch)
        self.machines.start(self.leader)
        sequence, _ = self.machines.await_equal()
        self.assertEqual(self.machines.role(self.leader), "follows")
        self.assertGreaterEqual(sequence, 4)

    def test_a_leader_that_was_stopped_for_long_begins_again_from_its_journal(self):
        robot = self.robot(3, self.follower)
        robot.hello(7)
        stopped = self.machines.daemons[self.leader]
        at_stopped = self.robot(4, self.leader)
        at_stopped.hello(7)
        stopped.process.send_signal(signal.SIGSTOP)
        at_stopped.line.send(b"")  # it will find something to do
        robot.deposit(1, 5000, 5000, 8)
        self.assertEqual(self.machines.role(self.follower), "leads")
        stopped.process.send_signal(signal.SIGCONT)

        def has_noticed():
            try:
                return (stopped.process.poll() is not None
                        or self.machines.role(self.leader) == "follows")
            except OSError:  # it is ending
                return False
        await_that(has_noticed, "it notices")
        if stopped.process.poll() is not None:
            self.assertEqual(stopped.process.returncode, 1, stopped.log())
            self.machines.start(self.leader)
        self.machines.await_equal()

    def test_an_operator_at_the_follower_changes_the_map_and_halts_all(self):
        daemon = self.machines.daemons[self.follower]
        status, text = daemon.call("POST", "/api/v1/paint", {
            "pheromone": "trail", "area_m": [1, 1, 3, 3]})
        self.assertEqual(status, 200, text)
        self.assertIn('"nodes"', text)
        self.machines.await_equal()
        status, text = daemon.call("POST", "/api/v1/undo", {})
        self.assertEqual(status, 200, text)
        self.machines.await_equal()
        halted = []
        robot = self.robot(5, self.leader)
        robot.on_command = lambda message: halted.append(message) or 0
        robot.hello(7)
        robot.sense(1, 5000, 5000, 0)
        status, text = daemon.call("POST", "/api/v1/halt", {})
        self.assertEqual(status, 200, text)
        await_that(lambda: robot.sense(1, 5000, 5000, 0) and halted, "the halt comes")

    def test_without_a_majority_changes_are_refused_and_queries_answered(self):
        robot = self.robot(6, self.leader)
        robot.hello(7)
        for member in (1, 2):
            self.machines.etcd.kill(member)
        robot.tries = 1
        refused = []

        def ask():
            try:
                robot.deposit(1, 5000, 5000, 1)
            except Refused as error:
                refused.append(error.reason)
            except Exception:  # noqa: BLE001: silence until then
                pass
            return refused
        await_that(ask, "a change is refused")
        self.assertEqual(refused[0], 7)
        robot.sense(1, 5000, 5000, 0)


if __name__ == "__main__":
    unittest.main()
