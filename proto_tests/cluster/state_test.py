#!/usr/bin/env python3
"""Two servers with one log, and a journal that is not of it: new, left behind, of another log, wrong.

    state_test.py BIN_DIR
"""

import base64
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from cluster.machines import Machines  # noqa: E402
from operated_daemon import OperatedDaemon, await_that  # noqa: E402
from stranger.client import Client, ErrorAnswer  # noqa: E402
from stranger.servers import Servers  # noqa: E402

BIN = pathlib.Path(sys.argv.pop(1)).resolve() if len(sys.argv) > 1 else None
CLOCK_SHIM = BIN.parent / "tests/libclock_shim.so"
BUSY = 7


class StateTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.machines = Machines(BIN, pathlib.Path(temporary.name))
        self.addCleanup(self.machines.close)
        self.leader = self.machines.leader()
        self.follower = next(it for it in self.machines.nodes if it != self.leader)

    def robot(self, number, node):
        line = Servers([self.machines.address(node)])
        self.addCleanup(line.close)
        return Client(line, number, timeout=0.075, tries=200)

    def folder(self, node):
        return self.machines.folders[node]

    def etcd(self, request, **body):
        """A request to etcd; keys and values as text."""
        coded = {name: base64.b64encode(it.encode()).decode() if isinstance(it, str) else it
                 for name, it in body.items()}
        with urllib.request.urlopen(f"{self.machines.etcd.clients[0]}/v3/kv/{request}",
                                    json.dumps(coded).encode(), timeout=60) as answer:
            return json.load(answer)

    def trim_all(self, sequence):
        self.etcd("put", key="/pheromone/test/floor", value=f"{sequence + 1:016x}")
        self.etcd("deleterange", key="/pheromone/test/log/", range_end="/pheromone/test/log0")

    def begin(self, node):
        """Starts a server as systemd does, until it stays; the logs of those that ended."""
        logs = []
        while True:
            try:
                self.machines.start(node)
                return logs
            except Exception:  # noqa: BLE001: it ended; the log says why
                logs.append((self.folder(node) / "pheromoned.log").read_text())
                self.assertLess(len(logs), 5, logs)

    def run_pheromoned(self, node):
        """One that is expected to refuse to run."""
        return subprocess.run([BIN / "pheromoned", "--config", "test.toml"], text=True, check=False,
                              cwd=self.folder(node), capture_output=True, timeout=120)

    def ctl(self, node, *arguments, status=0, group="cluster"):
        result = subprocess.run([BIN / "pheromonectl", group, *arguments, "state"], text=True,
                                cwd=self.folder(node), capture_output=True, check=False, timeout=120)
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return result.stdout + result.stderr

    def configure_alone(self, node):
        """The file without [cluster]; returns what it was."""
        file = self.folder(node) / "test.toml"
        whole = file.read_text()
        file.write_text(whole[:whole.index("[cluster]")])
        return whole

    def await_end(self, node):
        process = self.machines.daemons[node].process
        await_that(lambda: process.poll() is not None, f"server {node} ends")
        return process.returncode

    def test_an_empty_server_takes_a_state_when_the_log_was_trimmed(self):
        robot = self.robot(1, self.leader)
        robot.hello(7)
        for _ in range(5):
            robot.deposit(1, 5000, 5000, 2)
        sequence, state_hash = self.machines.await_equal()
        self.machines.kill(self.follower)
        shutil.rmtree(self.folder(self.follower) / "state")
        self.trim_all(sequence)
        logs = self.begin(self.follower)
        self.assertEqual(len(logs), 1)
        self.assertIn(f"took the state after event {sequence} from {self.leader}", logs[0])
        self.assertEqual(self.machines.await_equal(), (sequence, state_hash))
        at_follower = self.robot(2, self.follower)
        at_follower.hello(7)
        at_follower.deposit(1, 5000, 5000, 2)
        self.assertGreater(self.machines.await_equal()[0], sequence)

    def test_a_journal_of_a_cluster_starts_alone_only_after_it_has_left(self):
        epoch = self.machines.status(self.leader)["epoch"]
        self.machines.await_equal()
        self.machines.kill(self.follower)
        whole = self.configure_alone(self.follower)
        refused = self.run_pheromoned(self.follower)
        self.assertEqual(refused.returncode, 2, refused.stdout)
        said = refused.stdout + refused.stderr
        self.assertIn('is the journal of a server of cluster "test"', said)
        self.assertIn("pheromonectl cluster leave --new-epoch", said)
        self.assertIn('cluster: of cluster "test", ID ', self.ctl(self.follower, "check", group="journal"))
        marker = self.folder(self.follower) / "state/cluster"
        text = marker.read_text()
        marker.write_text(text[:-1])
        self.assertIn('expected "end" in the last line',
                      self.ctl(self.follower, "check", group="journal", status=4))
        self.assertEqual(self.run_pheromoned(self.follower).returncode, 1)
        marker.write_text(text)
        self.ctl(self.follower, "leave", status=2)
        self.assertIn("begins an epoch", self.ctl(self.follower, "leave", "--new-epoch"))
        self.assertIn("belongs to no cluster", self.ctl(self.follower, "leave", "--new-epoch",
                                                        status=1))
        epochs = [epoch]
        for _ in range(2):
            alone = OperatedDaemon(BIN, self.folder(self.follower))
            self.addCleanup(alone.kill)
            epochs.append(json.loads(alone.call("GET", "/api/v1/status")[1])["epoch"])
            await_that(lambda: not marker.exists(), "the marker is removed")
            alone.stop()
        self.assertNotEqual(epochs[0], epochs[1])
        self.assertEqual(epochs[1], epochs[2], "an epoch is begun once")
        (self.folder(self.follower) / "test.toml").write_text(whole)
        refused = self.run_pheromoned(self.follower)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("has a map that is of no cluster", refused.stdout + refused.stderr)

    def test_a_wiped_log_is_not_followed_until_a_journal_is_to_begin_it(self):
        robot = self.robot(1, self.leader)
        robot.hello(7)
        robot.deposit(1, 5000, 5000, 8)
        self.machines.await_equal()
        epoch = self.machines.status(self.leader)["epoch"]
        for node in self.machines.nodes:
            self.machines.kill(node)
        self.etcd("deleterange", key="/pheromone/test/", range_end="/pheromone/test0")
        self.machines.start(*self.machines.nodes)
        for node in self.machines.nodes:
            self.assertIn("was wiped", self.machines.status(node)["cluster"]["gap"])
            self.assertEqual(self.machines.role(node), "follows")
        sensed = robot.sense(1, 5000, 5000, 0)
        self.assertGreater(sensed.left, 0)
        with self.assertRaises(ErrorAnswer) as refused:
            robot.deposit(1, 5000, 5000, 1)
        self.assertEqual(refused.exception.reason, BUSY)
        for node in self.machines.nodes:
            self.machines.daemons[node].stop()

        reset = ("reset", "--name", "test")
        self.assertIn("nothing was done", self.ctl(self.leader, *reset, status=1))
        self.assertIn("will begin with this map", self.ctl(self.leader, *reset, "--yes"))
        self.machines.start(self.leader)
        self.assertEqual(self.machines.role(self.leader), "leads")
        self.assertNotEqual(self.machines.status(self.leader)["epoch"], epoch)
        (self.folder(self.follower) / "state").rename(self.folder(self.follower) / "old")
        self.assertIn("took the state after event", self.begin(self.follower)[0])
        self.machines.await_equal()
        robot.hello(8)
        robot.deposit(1, 5000, 5000, 1)

    def test_a_server_whose_state_differs_takes_the_leaders(self):
        robot = self.robot(1, self.leader)
        robot.hello(7)
        self.machines.await_equal()
        self.machines.kill(self.follower)
        # Other events than the cluster's, in a journal that says that it is of the cluster.
        marker = self.folder(self.follower) / "state/cluster"
        text = marker.read_text()
        marker.unlink()
        whole = self.configure_alone(self.follower)
        alone = OperatedDaemon(BIN, self.folder(self.follower))
        self.addCleanup(alone.kill)
        other = self.robot(2, self.follower)
        other.hello(7)
        other.deposit(1, 2000, 2000, 8)
        alone.stop()
        (self.folder(self.follower) / "test.toml").write_text(whole)
        marker.write_text(text)
        for _ in range(5):
            robot.deposit(1, 5000, 5000, 1)
        self.machines.start(self.follower)

        def deposit_until_it_ends():  # hashes are of every ten seconds
            robot.deposit(1, 5000, 5000, 1)
            return self.machines.daemons[self.follower].process.poll() is not None
        await_that(deposit_until_it_ends, "the difference is noticed")
        self.assertEqual(self.await_end(self.follower), 1)
        log = self.machines.daemons[self.follower].log()
        self.assertIn(f"divergence: node {self.leader}, which leads, has another state", log)
        self.assertIn("took the state after event", log)
        self.assertEqual(self.begin(self.follower), [])
        self.machines.await_equal()
        status, text = self.machines.daemons[self.leader].call("GET", "/metrics")
        self.assertEqual(status, 200)
        self.assertIn("\npheromone_cluster_divergences_total 1\n", text)

    def test_field_time_goes_on_by_the_own_clock_after_all_were_down(self):
        if not CLOCK_SHIM.exists():
            self.skipTest(f"no {CLOCK_SHIM}")
        self.machines.kill(self.follower)
        self.machines.kill(self.leader)
        late, right = self.leader, self.follower
        (self.folder(late) / "ahead").write_text("-3600")
        self.machines.daemons[late] = OperatedDaemon(
            BIN, self.folder(late), LD_PRELOAD=str(CLOCK_SHIM), CLOCK_AHEAD="ahead")
        self.machines.start(right)
        self.assertEqual(self.machines.leader(), late)
        robot = self.robot(1, late)
        robot.hello(7)
        robot.deposit(1, 5000, 5000, 8)  # its stamp is an hour behind
        self.machines.await_equal()
        marker = self.folder(right) / "state/cluster"
        await_that(lambda: "field_less_utc_ms" in marker.read_text(), "the clock is noted")
        before = self.machines.status(right)["field_time_s"]
        began = time.monotonic()
        self.machines.kill(right)
        self.machines.kill(late)
        self.machines.start(right)
        self.assertEqual(self.machines.leader(), right)
        passed = self.machines.status(right)["field_time_s"] - before
        self.assertGreaterEqual(passed, 0)
        self.assertLess(passed, time.monotonic() - began + 10)


if __name__ == "__main__":
    unittest.main()
