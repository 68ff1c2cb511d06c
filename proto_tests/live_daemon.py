"""Shared by the live tests: pheromoned in a folder of its own, and waiting with timeouts.

    daemon = Daemon(bin_dir, folder, [os.path.join(folder, "radio-a.pty")])
    wait_until(lambda: ..., "the robot got an answer")
    daemon.stop()
"""

import os
import signal
import subprocess
import time

DEADLINE_S = 60.0


def check(holds, otherwise):
    if not holds:
        raise AssertionError(otherwise)


def wait_until(holds, what):
    end = time.monotonic() + DEADLINE_S
    while not holds():
        check(time.monotonic() < end, f"gave up waiting until {what}")
        time.sleep(0.02)


def default_config(bin_dir):
    """With any free port: other tests have servers, too, and one that does not get its port ends."""
    text = subprocess.run([os.path.join(bin_dir, "pheromoned"), "--default-config"], check=True,
                          capture_output=True, text=True).stdout
    check('"127.0.0.1:8377"' in text, "the default configuration has another port")
    return text.replace('"127.0.0.1:8377"', '"127.0.0.1:0"')


class Daemon:
    """pheromoned with its default configuration, unless `arguments` name another. `ports` are the
    virtual modems that it makes."""

    def __init__(self, bin_dir, folder, ports, arguments=()):
        self.ports = ports
        self.log = open(os.path.join(folder, "pheromoned.log"), "ab")
        if not arguments:
            with open(os.path.join(folder, "default.toml"), "w", encoding="utf-8") as file:
                file.write(default_config(bin_dir))
            arguments = ("--config", "default.toml")
        self.process = subprocess.Popen(
            [os.path.join(bin_dir, "pheromoned"), *arguments], cwd=folder, stdout=self.log,
            stderr=self.log)
        wait_until(lambda: all(os.path.exists(port) for port in ports), "the ports appear")

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(DEADLINE_S)
        check(status == 0, f"pheromoned ended with status {status}")
        check(not any(os.path.lexists(port) for port in self.ports), "pheromoned left a port behind")
        self.log.close()
