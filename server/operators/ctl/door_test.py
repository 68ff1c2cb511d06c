#!/usr/bin/env python3
"""Who gets in to a running pheromoned: its socket and its port, the token, a second server beside it.

    door_test.py build/release/bin
"""

import json
import os
import shutil
import socket
import stat
import subprocess
import unittest

import operated_server  # which knows where proto_tests is
from operated_server import OperatedServer
from operated_daemon import PATIENCE_S, TOKEN
from test_config import table


class DoorTest(OperatedServer):
    def test_idle_connections_lock_nobody_out(self):
        idle = []
        for _ in range(300):
            idle.append(socket.create_connection(("127.0.0.1", self.port), PATIENCE_S))
        for _ in range(200):
            it = socket.socket(socket.AF_UNIX)
            it.connect(str(self.folder / "pheromoned.sock"))
            idle.append(it)
        self.assertIn("halt sent", self.halt()[1])
        self.assertEqual(self.request("GET", "/healthz")[0].status, 200)
        for it in idle:
            it.close()

    def test_a_header_or_a_key_that_comes_twice_is_refused(self):
        with socket.create_connection(("127.0.0.1", self.port), PATIENCE_S) as line:
            line.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n")
            self.assertTrue(line.recv(65536).startswith(b"HTTP/1.1 400 "))
        answer, data = self.request("POST", "/api/v1/deposit",
                                    '{"pheromone": 1, "x_m": 1, "y_m": 1, "x_m": 2}',
                                    Authorization=f"Bearer {TOKEN}")
        self.assertEqual((answer.status, json.loads(data)["error"]["where"]), (400, "x_m"))

    def test_over_the_network_reading_is_free_and_changing_needs_the_token(self):
        answer, data = self.request("GET", "/api/v1/status")
        self.assertEqual((answer.status, answer.getheader("Content-Type")),
                         (200, "application/json"))
        json.loads(data)
        halt = ("POST", "/api/v1/halt", "{}")
        for status, headers in ((401, {}), (401, {"Authorization": "Bearer x"}),
                                (403, {"Authorization": f"Bearer {TOKEN}",
                                       "Origin": "http://evil.example"}),
                                (200, {"Authorization": f"Bearer {TOKEN}"}),
                                (200, {"Authorization": f"Bearer {TOKEN}",
                                       "Origin": f"http://127.0.0.1:{self.port}"})):
            answer, data = self.request(*halt, **headers)
            self.assertEqual(answer.status, status, (headers, data))
        for status, host in ((421, "evil.example"), (200, "lab.local:80"), (200, "localhost")):
            answer, data = self.request("GET", "/api/v1/status", Host=host)
            self.assertEqual(answer.status, status, (host, data))
        answer, data = self.request("GET", "/api/v1/halt")
        self.assertEqual((answer.status, answer.getheader("Allow")), (405, "POST"))
        self.assertEqual(set(json.loads(data)["error"]), {"what", "where", "expected"})
        self.assertEqual(self.request("GET", "/healthz")[0].status, 200)

    def test_the_socket_is_for_its_user_and_group(self):
        mode = (self.folder / "pheromoned.sock").stat().st_mode
        self.assertTrue(stat.S_ISSOCK(mode))
        self.assertEqual(stat.S_IMODE(mode), 0o660)

    @unittest.skipIf(os.geteuid() != 0, "only root can become somebody else")
    def test_who_may_not_use_the_socket_is_told_of_the_group(self):
        self.folder.chmod(0o755)
        result = subprocess.run([operated_server.BIN / "pheromonectl", "status"], cwd=self.folder, text=True, user=65534,
                                group=65534, extra_groups=[], capture_output=True,
                                timeout=PATIENCE_S, check=False)
        self.assertEqual((result.returncode, result.stdout), (3, ""))
        self.assertEqual(result.stderr, "pheromonectl: pheromoned.sock: Permission denied; the "
                         "server may be used by members of its group, of the service: pheromone. "
                         "Join it (sudo adduser $USER pheromone, then log in again), or use sudo\n")

    def second(self, config):
        """What a server beside this one says, which ends with status 1."""
        (self.folder / "second.toml").write_text(config)
        result = subprocess.run([operated_server.BIN / "pheromoned", "--config", "second.toml"], cwd=self.folder, text=True,
                                capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertNotIn("ready: ", result.stderr)
        self.ctl("status")  # the first one was left alone
        return result.stderr

    def test_a_second_server_beside_it_ends_and_says_who_has_socket_and_port(self):
        holder = rf"pheromoned \(process {self.daemon.process.pid}, since \d+-\d+-\d+ \d+:\d+:\d+\)"
        config = operated_server.CONFIG.replace("radio-a.pty", "second.pty")
        self.assertRegex(self.second(config), "control: pheromoned.sock: in use by " + holder
                         + "; a server that pheromonectl cannot reach does not start")
        self.assertFalse((self.folder / "second.pty").is_symlink())
        config = config.replace("127.0.0.1:0", f"127.0.0.1:{self.port}") + table(
            "control", socket="second.sock")
        self.assertRegex(self.second(config),
                         f"web: cannot listen on 127.0.0.1 port {self.port}: Address already in use "
                         f"by {holder}; choose another one")
        self.assertFalse((self.folder / "second.sock").exists())

    def test_promtool_has_nothing_to_say_about_the_metrics(self):
        promtool = shutil.which("promtool")
        if promtool is None:
            self.skipTest("promtool is not installed")
        self.robot(26)
        answer, data = self.request("GET", "/metrics")
        self.assertEqual(answer.getheader("Content-Type"),
                         "text/plain; version=0.0.4; charset=utf-8")
        result = subprocess.run([promtool, "check", "metrics"], input=data, capture_output=True,
                                check=False)
        self.assertEqual((result.returncode, result.stdout + result.stderr), (0, b""))


if __name__ == "__main__":
    operated_server.main()
