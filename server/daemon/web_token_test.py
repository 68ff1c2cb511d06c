#!/usr/bin/env python3
"""The token that pheromoned demands for changes over HTTP: where it comes from, and who may read it.

    web_token_test.py --pheromoned build/release/bin/pheromoned
"""

import http.client
import json
import os
import pwd
import re
import subprocess
import urllib.request

import running_daemon
from running_daemon import CONFIG, DaemonTest, PATIENCE_S, PTY


class TokenTest(DaemonTest):
    def token(self, mode):
        """A configuration whose token is in a file of that mode."""
        token = self.folder / "token"
        token.write_text("0123456789abcdef")
        token.chmod(mode)
        self.config.write_text(CONFIG + PTY + '[web]\ntoken_file = "token"\n')

    def test_a_token_that_everyone_can_read_is_warned_of_in_the_log(self):
        for mode, warned in ((0o644, True), (0o640, False)):
            self.token(mode)
            with self.start("--config", "test.toml") as server:
                server.await_log("ready")
                self.assertEqual(server.stop(), 0)
                self.assertEqual("token is readable by all users" in server.log, warned)

    def test_a_token_that_the_server_cannot_read_is_told_with_the_user(self):
        self.token(0o000)
        self.folder.chmod(0o755)
        other = {"user": 65534, "extra_groups": []} if os.geteuid() == 0 else {}
        result = subprocess.run([running_daemon.PHEROMONED, "--config", "test.toml"],
                                cwd=self.folder, text=True, capture_output=True, check=False,
                                **other)
        user = pwd.getpwuid(other.get("user", os.geteuid())).pw_name
        self.assertEqual(result.returncode, 2)
        self.assertIn("web.token_file: ", result.stderr)
        self.assertIn(f"Permission denied for the user {user}, as which the server runs; give the "
                      "file to that user's group (chgrp) with mode 0640", result.stderr)

    def test_a_token_is_made_where_there_is_none_and_kept(self):
        token = self.folder / "web-token"
        configuration = self.call("--default-config").stdout.replace("127.0.0.1:8377", "127.0.0.1:0")
        self.config.write_text(configuration)
        self.assertIn(f"changes require the token in {token}, to be created\n",
                      self.call("--check", "--config", "test.toml").stdout)
        self.assertFalse(token.exists())
        made = []
        for _ in range(2):
            with self.start("--config", "test.toml") as server:
                server.await_log("ready")
                made.append(token.read_text())
                port = int(re.search(r"web: http://127.0.0.1:(\d+)/, changes require the token in "
                                     + re.escape(str(token)) + "\n", server.log)[1])
                self.assertEqual(self.unlock(port, made[0].strip()), 200)
                self.assertEqual(self.unlock(port, "0" * 32), 401)
                self.assertEqual(f"web: made a token, {token}\n" in server.log, len(made) == 1)
                self.assertEqual(server.stop(), 0)
        self.assertRegex(made[0], "^[0-9a-f]{32}\n$")
        self.assertEqual(made[1], made[0])
        self.assertEqual(token.stat().st_mode & 0o777, 0o600)

    def unlock(self, port, token, client="127.0.0.1"):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S,
                                                source_address=(client, 0))
        connection.request("POST", "/api/v1/unlock", "{}", {"Authorization": "Bearer " + token})
        status = connection.getresponse().status
        connection.close()
        return status

    def get(self, port, target):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}{target}", timeout=PATIENCE_S) as answer:
            return answer.read().decode()

    def test_a_wrong_token_shows_in_log_events_metric_and_beside_the_journal_with_its_address(self):
        self.token(0o600)
        with self.config.open("a") as config:
            config.write('listen = "127.0.0.1:0"\n[journal]\nfolder = "state"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            port = int(re.search(r"web: http://127.0.0.1:(\d+)/", server.log)[1])
            self.assertEqual(self.unlock(port, "a-wrong-token-of-somebody", "127.0.0.9"), 401)
            self.assertEqual(self.unlock(port, "0123456789abcdef", "127.0.0.8"), 200)
            who, what = "web 127.0.0.9", "unlock: refused, found an invalid token"
            server.await_log(f"warning: {who}: {what}\n")
            events = json.loads(self.get(port, "/api/v1/events"))["events"]
            self.assertEqual([(it["subject"], it["text"], it["on"]) for it in events
                              if it["topic"] == "operator"], [(who, what, False)])
            self.assertIn("\npheromone_unauthorized_total 1\n", self.get(port, "/metrics"))
            self.assertEqual(server.stop(), 0)
        kept = [json.loads(line) for line in (self.folder / "state/audit.jsonl").read_text().splitlines()]
        self.assertEqual([(it["who"], it["what"], it["done"]) for it in kept], [(who, what, False)])
        self.assertNotIn("a-wrong-token", server.log)

    def test_without_a_token_the_log_says_how_to_get_one(self):
        self.config.write_text(CONFIG + PTY + '[web]\nlisten = "127.0.0.1:0"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("/, read-only; with token_file in [web] the server makes a token for "
                             "changes\n")
            self.assertEqual(server.stop(), 0)

    def test_where_no_token_can_be_made_robots_are_served_all_the_same(self):
        (self.folder / "web-token").symlink_to("/nonexistent/token")
        self.config.write_text(CONFIG + PTY
                               + '[web]\nlisten = "127.0.0.1:0"\ntoken_file = "web-token"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("ready: 1 of 1 links up")
            self.assertIn(
                "web-token: cannot be created: File exists; until somebody writes a token there, "
                "such as by `openssl rand -hex 32`, nothing can be changed over the network\n",
                server.log)
            self.assertRegex(server.log, r"web: http://127.0.0.1:\d+/, read-only\n")
            self.assertEqual(server.stop(), 0)

    def test_a_token_that_cannot_be_written_leaves_no_file_that_stops_the_next_start(self):
        self.config.write_text(CONFIG + PTY
                               + '[web]\nlisten = "127.0.0.1:0"\ntoken_file = "web-token"\n')
        no_file_takes_a_byte = ["sh", "-c", "trap '' XFSZ; ulimit -f 0; exec \"$@\"", "sh"]
        with self.start("--config", "test.toml", before=no_file_takes_a_byte) as server:
            server.await_log("web-token: cannot be created: File too large; until somebody")
            server.await_log("ready: 1 of 1 links up")
            self.assertEqual(server.stop(), 0)
        self.assertFalse((self.folder / "web-token").exists())


if __name__ == "__main__":
    running_daemon.main(__doc__)
