#!/usr/bin/env python3
"""pheromoned saves the field, and loads what was saved: --save-field, --load-field.

    saved_field_test.py --pheromoned build/release/bin/pheromoned
"""

import os
import pathlib
import signal
import sys

import running_daemon
from running_daemon import CONFIG, DaemonTest, PATIENCE_S, PTY

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto_tests"))
from stranger.client import Client, open_terminal  # noqa: E402


class SavedFieldTest(DaemonTest):
    def smells(self, robot):
        """The intensities at many positions, by type."""
        return {(kind, x, y): robot.sense(kind, x, y, 0)
                for kind in (1, 2) for x in range(500, 9500, 450) for y in (800, 1000, 5000)}

    def start_to_save(self, *arguments):
        """A server whose trails last for longer than any test, and a robot."""
        slow = CONFIG.replace("tau_s = 30.0", "tau_s = 3000")
        never = slow[slow.index("[[pheromone]]"):].replace("type = 1", "type = 2")
        self.config.write_text(slow + never.replace('"trail"', '"path"')
                               .replace("tau_s = 3000", "tau_s = 0") + PTY)
        server = self.start("--config", "test.toml", *arguments)
        server.await_log("ready")
        robot = Client(open_terminal(self.folder / "radio-a.pty"), 7, timeout=PATIENCE_S)
        robot.hello(1)
        return server, robot

    def test_a_field_saved_at_the_end_gives_the_same_answers_when_it_is_loaded(self):
        server, robot = self.start_to_save("--save-field", "lab.field")
        with server, robot.line:
            for i in range(40):
                robot.deposit(1 + i % 2, 600 + 200 * i, 900 + 10 * i, 1 + i % 2)
            before = self.smells(robot)
            self.assertFalse((self.folder / "lab.field").exists())
            self.assertEqual(server.stop(), 0)
            self.assertIn(f"field saved to {self.folder}/lab.field: 40 nodes", server.log)
        nodes = [line.split(",") for line in (self.folder / "lab.field").read_text().splitlines()
                 if line[0] != "#"]
        self.assertEqual(sorted((int(kind), int(column), int(row), int(level))
                                for kind, column, row, level in nodes),
                         sorted((1 + i % 2, 6 + 2 * i, (950 + 10 * i) // 100, 64 * (1 + i % 2))
                                for i in range(40)))
        self.assertGreater(len(set(before.values())), 20)
        server, robot = self.start_to_save("--load-field", "lab.field", "--save-field", "lab.field")
        with server, robot.line:
            self.assertEqual(self.smells(robot), before)
            self.assertIn("initial raster of type 2: 20 nodes", server.log)
            # A configuration that is read again leaves on the map what was loaded.
            self.config.write_text(self.config.read_text().replace("tau_s = 3000", "tau_s = 4000"))
            server.process.send_signal(signal.SIGHUP)
            server.await_log("configuration reread")
            self.assertEqual(self.smells(robot), before)
            whole = self.config.read_text()
            self.config.write_text(whole[:whole.rindex("[[pheromone]]")] + PTY)
            server.process.send_signal(signal.SIGHUP)
            server.await_log("the configuration is unchanged:\n"
                             f"  the field loaded from {self.folder}/lab.field has pheromone "
                             "type 2, which is no longer configured")
            self.assertEqual(self.smells(robot), before)
            self.assertEqual(server.stop(), 0)
            self.assertIn(f"field saved to {self.folder}/lab.field: 40 nodes", server.log)

    def test_sigusr1_saves_the_field_while_robots_are_served(self):
        server, robot = self.start_to_save("--save-field", "lab.field")
        with server, robot.line:
            robot.deposit(2, 1000, 1000, 2)
            before = self.smells(robot)
            server.process.send_signal(signal.SIGUSR1)
            server.await_log(f"field saved to {self.folder}/lab.field: 1 nodes")
            saved = (self.folder / "lab.field").read_text()
            self.assertIn("\n2,10,10,128\n", saved)
            robot.deposit(2, 2000, 1000, 1)
            server.process.send_signal(signal.SIGUSR1)
            server.await_log(f"field saved to {self.folder}/lab.field: 2 nodes")
            self.assertIn("\n2,10,10,128\n2,20,10,64\n",
                          (self.folder / "lab.field").read_text())
            server.process.kill()  # even then, what was saved is there
        (self.folder / "lab.field").write_text(saved)
        server, robot = self.start_to_save("--load-field", "lab.field")
        with server, robot.line:
            self.assertEqual(self.smells(robot), before)
            server.process.send_signal(signal.SIGUSR1)
            server.await_log("SIGUSR1 ignored: the server was started without --save-field")
            self.assertEqual(server.stop(), 0)
        self.assertEqual((self.folder / "lab.field").read_text(), saved)

    def test_a_save_counts_the_time_since_the_last_event(self):
        self.config.write_text(CONFIG.replace("tau_s = 30.0", "tau_s = 0.05") + PTY)
        with self.start("--config", "test.toml", "--save-field", "lab.field") as server:
            server.await_log("ready")
            with open_terminal(self.folder / "radio-a.pty") as line:
                robot = Client(line, 7, timeout=PATIENCE_S)
                robot.hello(1)
                robot.deposit(1, 1000, 1000, 2)
            saves = 0
            while f"field saved to {self.folder}/lab.field: 0 nodes" not in server.log:
                server.process.send_signal(signal.SIGUSR1)
                saves += 1
                server.await_log("field saved", saves)
            self.assertEqual(server.stop(), 0)

    def test_a_file_that_does_not_fit_ends_the_start_with_words(self):
        server, robot = self.start_to_save("--save-field", "lab.field")
        with server, robot.line:
            robot.deposit(2, 1000, 1000, 2)
            self.assertEqual(server.stop(), 0)
        saved = (self.folder / "lab.field").read_bytes()
        load = ("--config", "test.toml", "--load-field", "lab.field")
        self.assertEqual(self.call(*load, "--check").returncode, 0)
        self.config.write_text(CONFIG + PTY)
        for arguments in (load, (*load, "--check")):
            result = self.call(*arguments)
            self.assertEqual((result.returncode, result.stderr),
                             (2, f"{self.folder}/lab.field does not match the configuration: "
                              "pheromone type 2 (\"path\") is not configured\n"))
        (self.folder / "lab.field").write_bytes(saved[:-1])
        result = self.call(*load)
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, r"^\S+/lab\.field:7:25: found the end of the file, "
                                        r"expected "
                         "a whole line: the file is truncated\n$")
        result = self.call("--load-field", "none.field")
        self.assertEqual((result.returncode, result.stderr),
                         (2, f"{self.folder}/none.field: cannot be opened: No such file or "
                              "directory\n"))
        self.assertEqual(self.call("--load-field", "").returncode, 2)

    def test_where_nothing_can_be_saved_is_told_at_the_start(self):
        for path, why in (("none/lab.field", "No such file"), (".", "is a folder"),
                          ("/dev/null", "is not a regular file")):
            result = self.call("--save-field", path)
            self.assertEqual(result.returncode, 2)
            self.assertIn(f"{os.path.normpath(self.folder / path)}: ", result.stderr)
            self.assertIn(why, result.stderr)

    def test_a_field_that_cannot_be_saved_at_the_end_shows_in_the_exit_status(self):
        (self.folder / "kept").mkdir()
        server, robot = self.start_to_save("--save-field", "kept/lab.field")
        with server, robot.line:
            (self.folder / "kept").rmdir()
            self.assertEqual(server.stop(), 1)
            self.assertIn(f"the field was not saved: {self.folder}/kept/lab.field", server.log)
            self.assertTrue(server.log.endswith("stopped\n"), server.log)

    def test_a_start_that_fails_leaves_what_was_saved(self):
        (self.folder / "lab.field").write_text("# pheromone-field of yesterday")
        self.config.write_text(CONFIG + '[[link]]\nname = "radio-b"\nkind = "serial"\n'
                               'port = "/dev/ttyNONE7"\nrequired = true\n')
        with self.start("--config", "test.toml", "--save-field", "lab.field") as server:
            self.assertEqual(server.end(), 1)
        self.assertEqual((self.folder / "lab.field").read_text(), "# pheromone-field of yesterday")

    def test_only_a_saved_field_is_replaced(self):
        self.config.write_text(CONFIG + PTY)
        keys = self.folder / "robots.keys"
        keys.write_text("7 " + "0" * 32 + "\n")
        short = self.folder / "short"
        short.write_text("# pher")
        for file in (self.config, keys, short):
            before = file.read_bytes()
            for check in ((), ("--check",)):
                result = self.call("--config", "test.toml", "--save-field", file.name, *check)
                self.assertEqual((result.returncode, result.stdout, result.stderr),
                                 (2, "", f"{self.folder}/{file.name}: is not a saved field, expected "
                                  "the name of one, or of no file, to save the field to\n"))
            self.assertEqual(file.read_bytes(), before)
        (self.folder / "empty").touch()
        self.assertEqual(self.call("--config", "test.toml", "--save-field", "empty",
                                   "--check").returncode, 0)


if __name__ == "__main__":
    running_daemon.main(__doc__)
