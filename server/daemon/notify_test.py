#!/usr/bin/env python3
"""What pheromoned tells systemd (sd_notify(3)), with this test in systemd's place."""
import argparse
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

PHEROMONED = ""
PATIENCE_S = 30  # of a busy machine; nothing waits this long when things are well

ABSENT = '\n[[link]]\nname = "spare"\nkind = "serial"\nport = "/dev/not-there"\n'


def default_config():
    """With any free port, since a server that does not get its own ends."""
    return subprocess.run([PHEROMONED, "--default-config"], capture_output=True, text=True,
                          check=True).stdout.replace("127.0.0.1:8377", "127.0.0.1:0")


class Manager:
    """A service manager that started one pheromoned, and hears what it says."""

    def __init__(self, folder, watchdog_ms, config):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(folder / "notify"))
        self.socket.settimeout(PATIENCE_S)
        environment = dict(os.environ, NOTIFY_SOCKET=str(folder / "notify"))
        environment.pop("WATCHDOG_PID", None)
        environment.pop("WATCHDOG_USEC", None)
        if watchdog_ms:
            environment["WATCHDOG_USEC"] = str(1000 * watchdog_ms)
        self.log = open(folder / "log", "w", encoding="utf-8")
        self.process = subprocess.Popen([PHEROMONED, *config], cwd=folder, env=environment,
                                        stdout=subprocess.DEVNULL, stderr=self.log)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.socket.close()
        self.log.close()

    def hear(self):
        """The next message, as a dictionary."""
        lines = self.socket.recv(65536).decode().splitlines()
        return dict(line.split("=", 1) for line in lines)

    def await_key(self, key):
        while True:
            message = self.hear()
            if key in message:
                return message


class NotifyTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def start(self, watchdog_ms=0, config=()):
        if not config:
            (self.folder / "default.toml").write_text(default_config())
        return Manager(self.folder, watchdog_ms, config or ("--config", "default.toml"))

    def test_ready_comes_with_a_status(self):
        with self.start() as manager:
            self.assertEqual(manager.await_key("READY"),
                             {"READY": "1", "STATUS": "1 of 1 links up, robots 0"})

    def test_a_link_that_is_not_required_does_not_hold_up_the_start(self):
        config = self.folder / "test.toml"
        default = default_config()
        config.write_text(default + ABSENT)
        with self.start(config=("--config", "test.toml")) as manager:
            self.assertEqual(manager.await_key("READY")["STATUS"], "1 of 2 links up, robots 0")

    def test_a_required_link_that_is_missing_means_never_ready(self):
        config = self.folder / "test.toml"
        default = default_config()
        config.write_text(default + ABSENT + "required = true\n")
        with self.start(config=("--config", "test.toml")) as manager:
            self.assertEqual(manager.process.wait(PATIENCE_S), 1)
            manager.socket.setblocking(False)
            said = []
            try:
                while True:
                    said.append(manager.hear())
            except BlockingIOError:
                pass
            self.assertFalse([message for message in said if "READY" in message], said)

    def test_a_start_that_reads_a_journal_asks_for_time(self):
        config = self.folder / "test.toml"
        default = default_config()
        config.write_text(default + '\n[journal]\nfolder = "state"\n')
        with self.start(config=("--config", "test.toml")) as manager:
            manager.await_key("READY")
            manager.process.send_signal(signal.SIGTERM)
            self.assertEqual(manager.process.wait(PATIENCE_S), 0)
        (self.folder / "notify").unlink()
        with self.start(config=("--config", "test.toml")) as manager:
            starting = manager.hear()
            self.assertEqual(starting["EXTEND_TIMEOUT_USEC"], "30000000")
            self.assertRegex(starting["STATUS"], r"reading the journal: [\d.]+ of [\d.]+ MiB, \d+ changes")
            manager.await_key("READY")

    def test_a_reload_is_announced_and_ended(self):
        with self.start() as manager:
            manager.await_key("READY")
            manager.process.send_signal(signal.SIGHUP)
            reloading = manager.await_key("RELOADING")
            self.assertEqual(reloading["RELOADING"], "1")
            self.assertGreater(int(reloading["MONOTONIC_USEC"]), 0)
            self.assertIn("links up", manager.await_key("READY")["STATUS"])

    def test_a_stop_is_announced(self):
        with self.start() as manager:
            manager.await_key("READY")
            manager.process.send_signal(signal.SIGTERM)
            self.assertEqual(manager.await_key("STOPPING"), {"STOPPING": "1"})
            self.assertEqual(manager.process.wait(PATIENCE_S), 0)

    def test_the_watchdog_is_fed_from_the_start_on(self):
        with self.start(watchdog_ms=20) as manager:
            manager.await_key("READY")
            for _ in range(5):
                self.assertEqual(manager.await_key("WATCHDOG"), {"WATCHDOG": "1"})

    def test_the_watchdog_of_a_server_with_a_journal_is_fed(self):
        config = self.folder / "test.toml"
        default = default_config()
        config.write_text(default + '\n[journal]\nfolder = "state"\n')
        with self.start(watchdog_ms=20, config=("--config", "test.toml")) as manager:
            manager.await_key("READY")
            for _ in range(5):
                self.assertEqual(manager.await_key("WATCHDOG"), {"WATCHDOG": "1"})
            self.assertTrue(list((self.folder / "state").glob("*.segment")))

    def test_who_did_not_ask_for_a_watchdog_gets_none(self):
        with self.start() as manager:
            manager.await_key("READY")
            manager.process.send_signal(signal.SIGTERM)
            message = manager.hear()
            while "STOPPING" not in message:
                self.assertNotIn("WATCHDOG", message)
                message = manager.hear()


def main():
    global PHEROMONED
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pheromoned", required=True)
    arguments, rest = parser.parse_known_args()
    PHEROMONED = arguments.pheromoned
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
