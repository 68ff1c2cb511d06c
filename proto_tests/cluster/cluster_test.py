#!/usr/bin/env python3
"""Two servers with one log: a robot at either of them, and what remains when one is gone.

    cluster_test.py BIN_DIR
"""

import contextlib
import json
import os
import pathlib
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from cluster.machines import Machines  # noqa: E402
from operated_daemon import PATIENCE_S, await_that  # noqa: E402
from signed_robot import SignedRobot  # noqa: E402
from stranger.client import Client, ErrorAnswer, Line, NoAnswer  # noqa: E402
from stranger.servers import Servers  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402
from tls_test import make_certificate  # noqa: E402

BIN = pathlib.Path(sys.argv.pop(1)).resolve() if len(sys.argv) > 1 else None

CONFIG = (map_of(10.0, 10.0) + pheromone(1, "trail", tau_s=60.0)
          + link("modem", "pty", path="modem.pty", on=["a"])
          + table("web", listen="127.0.0.1:0", tls_certificate="lab.pem", tls_key="lab.key"))


KEYS = {robot: bytes([robot] * 16) for robot in (7, 8, 9)}
SIGNED = CONFIG + link("signed", "udp", listen="127.0.0.1:0", security="require",
                       keys="robots.keys")


def write_keys(folder):
    make_certificate(folder)
    file = folder / "robots.keys"
    file.write_text("".join(f"{robot} {key.hex()}\n" for robot, key in KEYS.items()))
    file.chmod(0o600)


class TwoServers(unittest.TestCase):
    config, add_files = CONFIG, staticmethod(make_certificate)

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        # So that who leads goes on to do so if the machine is busy.
        self.machines = Machines(BIN, pathlib.Path(temporary.name), config=self.config,
                                 add_files=self.add_files, suspect_ms=3000)
        self.addCleanup(self.machines.close)
        self.leader = self.machines.leader()
        self.follower = next(it for it in self.machines.nodes if it != self.leader)

    def robot(self, number, *nodes):
        line = Servers([self.machines.address(node) for node in nodes])
        self.addCleanup(line.close)
        return Client(line, number, timeout=0.075, tries=2000)

    def ctl(self, node, *words):
        return subprocess.run([BIN / "pheromonectl", "--socket", "pheromoned.sock", *words], text=True,
                              cwd=self.machines.folders[node], capture_output=True, check=False)


class ClusterTest(TwoServers):
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

    def stop_leader(self):
        process = self.machines.daemons[self.leader].process
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        return process

    def test_a_leader_that_was_stopped_follows_if_it_has_nothing_uncommitted(self):
        robot = self.robot(3, self.follower)
        robot.hello(7)
        self.machines.await_equal()
        stopped = self.stop_leader()
        # Before that, the change would be forwarded to the one that is stopped, which would make it.
        await_that(lambda: self.machines.role(self.follower) == "leads", "the other one leads")
        robot.deposit(1, 5000, 5000, 8)
        stopped.send_signal(signal.SIGCONT)
        await_that(lambda: stopped.poll() is not None or self.machines.role(self.leader) == "follows",
                   "it notices")
        self.machines.await_equal()
        self.assertIsNone(stopped.poll(), self.machines.daemons[self.leader].log())

    def test_a_leader_that_was_stopped_with_an_uncommitted_change_ends(self):
        robot, at_leader = self.robot(3, self.follower), self.robot(4, self.leader)
        for it in (robot, at_leader):
            it.hello(7)
        self.machines.await_equal()
        members = range(len(self.machines.etcd.processes))
        for member in members:
            self.machines.etcd.kill(member)
        at_leader.tries = 1
        with contextlib.suppress(NoAnswer, ErrorAnswer):
            at_leader.deposit(1, 5000, 5000, 1)

        def has_uncommitted():
            status = self.machines.status(self.leader)
            return status["sequence"] > status["cluster"]["committed_sequence"]
        await_that(has_uncommitted, "the leader has a change that the log does not have")
        stopped = self.stop_leader()
        for member in members:
            self.machines.etcd.start(member)
        await_that(lambda: self.machines.role(self.follower) == "leads", "the other one leads")
        robot.deposit(1, 5000, 5000, 8)
        stopped.send_signal(signal.SIGCONT)
        self.assertEqual(stopped.wait(PATIENCE_S), 1, self.machines.daemons[self.leader].log())
        self.machines.start(self.leader)
        self.machines.await_equal()
        self.assertEqual(self.machines.role(self.leader), "follows")

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
        await_that(lambda: robot.sense(1, 5000, 5000, 0) and halted, "the halt reaches robot 5")

    def test_a_reload_at_the_follower_is_that_of_the_leader(self):
        for node in self.machines.nodes:
            file = self.machines.folders[node] / "test.toml"
            file.write_text(file.read_text().replace("tau_s = 60.0", "tau_s = 90.0"))
        follower = self.machines.daemons[self.follower]
        status, text = follower.call("POST", "/api/v1/reload", {})
        self.assertEqual(status, 200, text)
        follower.process.send_signal(signal.SIGHUP)
        told = "cluster: the server that leads has read its configuration again"
        await_that(lambda: follower.log().count(told) == 2, "the follower's log tells of both")

        def are_changed():
            return all(json.loads(daemon.call("GET", "/api/v1/laws")[1])["pheromones"][0]["tau_s"] == 90
                       for daemon in self.machines.daemons.values())
        await_that(are_changed, "tau_s is 90 at both")
        self.machines.await_equal()

    def test_a_reload_at_the_follower_takes_its_own_certificate(self):
        folder = self.machines.folders[self.follower]
        daemon = self.machines.daemons[self.follower]

        def served():
            return ssl.get_server_certificate(("127.0.0.1", daemon.web_port()))
        before = served()
        (folder / "lab.key").write_text("none")
        self.assertNotEqual(daemon.call("POST", "/api/v1/reload", {})[0], 200)
        self.assertEqual(served(), before)
        make_certificate(folder)
        daemon.process.send_signal(signal.SIGHUP)
        await_that(lambda: served() != before, "the new certificate is served")
        self.assertEqual(served(), (folder / "lab.pem").read_text())

    def test_a_leader_hands_over_when_it_is_asked_to_and_when_it_stops(self):
        robot = self.robot(7, self.follower, self.leader)
        robot.hello(7)

        def run(node, *words):
            return self.ctl(node, "cluster", *words)
        refused = run(self.follower, "step-down")
        self.assertEqual(refused.returncode, 1)
        self.assertIn(f"node {self.leader} does", refused.stderr)
        handed = run(self.leader, "step-down", "--to", self.follower)
        self.assertEqual((handed.returncode, handed.stdout), (0, f"{self.follower} leads\n"), handed)
        shown = run(self.leader, "status")
        self.assertEqual(shown.returncode, 0, shown)
        self.assertIn(f"leader    {self.follower}, term ", shown.stdout)
        robot.deposit(1, 5000, 5000, 1)
        self.machines.daemons[self.follower].stop()
        self.assertEqual(self.machines.leader(), self.leader)
        robot.deposit(1, 5000, 5000, 1)

    def test_a_link_of_another_node_is_elsewhere_and_not_down(self):
        shown = self.ctl("b", "links")
        self.assertRegex(shown.stdout, r"modem +pty +elsewhere .* at node a\n")
        self.assertRegex(self.ctl("a", "links").stdout, r"modem +pty +up ")
        halted = self.ctl("b", "halt")
        self.assertEqual(halted.returncode, 0, halted)
        self.assertIn("halt sent on 1 of 1 link\n"
                      "  modem is at node a, to which the halt was passed on\n", halted.stdout)
        examined = json.loads(self.ctl("b", "--json", "doctor").stdout)["findings"]
        self.assertEqual([it for it in examined if it["level"] == "fault"], [])
        found = {(it["subject"], it["looked_at"]): it["found"] for it in examined}
        self.assertEqual(found["links", "link modem, pty"], "elsewhere: at node a")
        self.assertNotIn(("channels", "link modem"), found)
        self.assertEqual(found["ports", f"node b, TCP 127.0.0.1:{self.machines.ports['b']}"],
                         "the server listens there")
        self.machines.kill("a")
        await_that(lambda: not self.machines.status("b")["cluster"]["peers"][0]["up"], "b notices")
        halted = self.ctl("b", "halt")
        self.assertEqual(halted.returncode, 1, halted)
        self.assertIn("  modem is at node a, which is not connected; its robots were not told\n",
                      halted.stdout)

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
            except ErrorAnswer as error:
                refused.append(error.reason)
            except Exception:  # noqa: BLE001: silence until then
                pass
            return refused
        await_that(ask, "a change is refused without a majority of etcd")
        self.assertEqual(refused[0], 7)
        for words in (("cluster", "status"), ("--json", "cluster", "status")):
            self.assertEqual(self.ctl(self.leader, *words).returncode, 1, words)
        robot.sense(1, 5000, 5000, 0)


class SignedLinkTest(TwoServers):
    config, add_files = SIGNED, staticmethod(write_keys)

    def signed(self, node, *robots):
        """Those robots at the node's link."""
        links = json.loads(self.machines.daemons[node].call("GET", "/api/v1/links")[1])["links"]
        (address,) = [it["address"] for it in links if it["name"] == "signed"]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            peer.connect(("127.0.0.1", int(address.rpartition(":")[2])))
            line = Line(os.dup(peer.fileno()))
        self.addCleanup(line.close)
        return [SignedRobot(line, robot, KEYS[robot]) for robot in robots]

    def revoke(self, node, robot):
        answer = self.ctl(node, "keys", "revoke", str(robot))
        self.assertEqual(answer.returncode, 0, answer)

        def is_dropped(daemon):
            return f"link signed: keys revoked {robot}\n" in daemon.log()
        for daemon in self.machines.daemons.values():
            await_that(lambda it=daemon: is_dropped(it), daemon.log)

    def assert_only_seven_is_heard(self, node):
        seven, eight, nine = self.signed(node, 7, 8, 9)
        for robot in (eight, nine):
            robot.line.send(robot.first_hello(nonce=2))
        seven.hello(nonce=2)  # nothing comes before its answer

    def test_a_key_that_is_revoked_at_one_server_is_taken_by_none(self):
        (eight,) = self.signed(self.follower, 8)
        eight.hello(nonce=1)
        self.revoke(self.follower, 8)
        self.revoke(self.leader, 9)
        self.machines.kill(self.leader)
        self.assertEqual(self.machines.leader(), self.follower)
        self.assert_only_seven_is_heard(self.follower)
        self.machines.start(self.leader)
        self.machines.await_equal()
        self.assert_only_seven_is_heard(self.leader)


if __name__ == "__main__":
    unittest.main()
