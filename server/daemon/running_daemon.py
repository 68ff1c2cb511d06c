"""A pheromoned started by a test, and what it says; and the frame of tests of that program.

    class StopTest(DaemonTest):
        def test_sigterm_ends_it(self):
            with self.start("--config", "test.toml") as server:
                server.await_log("ready")
                self.assertEqual(server.stop(), 0)

    if __name__ == "__main__":
        running_daemon.main(__doc__)
"""

import argparse
import os
import pathlib
import select
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto_tests"))
from stranger.wire import encode  # noqa: E402
from test_config import map_of, pheromone, pty  # noqa: E402

PHEROMONED = ""
SHIM = ""
SICK_DISK = ""
PATIENCE_S = 30  # of a busy machine; nothing waits this long when things are well

CONFIG = map_of() + pheromone(1, "trail", tau_s=30.0, maximum=0.25)
PTY = pty("radio-a")


def frame(client, opcode, data):
    return encode(bytes([client, opcode]) + data)


PING = frame(3, 0x72, b"\x2a")
ECHO = frame(3, 0xF2, b"\x2a")


class Running:
    """A pheromoned in a folder of its own, and what it says. `before`: a command that starts it."""

    def __init__(self, folder, *arguments, before=(), **kwargs):
        environment = {key: value for key, value in os.environ.items()
                       if key not in ("JOURNAL_STREAM", "INVOCATION_ID")}
        environment.update(kwargs)
        self.process = subprocess.Popen([*before, PHEROMONED, *arguments], cwd=folder,
                                        env=environment, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.PIPE)
        self.log = ""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stderr.close()

    def _read(self):
        data = os.read(self.process.stderr.fileno(), 65536)
        self.log += data.decode()
        return data != b""

    def await_log(self, text, times=1):
        deadline = time.monotonic() + PATIENCE_S
        while self.log.count(text) < times:
            left = deadline - time.monotonic()
            if not select.select([self.process.stderr], [], [], max(left, 0))[0] or not self._read():
                raise AssertionError(f"waited for {text!r} in\n{self.log}")

    def end(self):
        """The exit status, once the process has ended by itself."""
        while self._read():
            pass
        return self.process.wait(PATIENCE_S)

    def stop(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        return self.end()


def ask(descriptor, request, answer_size):
    os.write(descriptor, request)
    answer = b""
    while len(answer) < answer_size:
        if not select.select([descriptor], [], [], PATIENCE_S)[0]:
            raise AssertionError(f"no answer; so far {answer!r}")
        answer += os.read(descriptor, answer_size - len(answer))
    return answer


class DaemonTest(unittest.TestCase):
    """With a folder of its own, and a configuration there: test.toml."""

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)
        self.config = self.folder / "test.toml"
        self.config.write_text(CONFIG + PTY)

    def call(self, *arguments):
        return subprocess.run([PHEROMONED, *arguments], cwd=self.folder, text=True,
                              capture_output=True, timeout=PATIENCE_S, check=False)

    def start(self, *arguments, **kwargs):
        return Running(self.folder, *arguments, **kwargs)


def main(description):
    global PHEROMONED, SHIM, SICK_DISK
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--pheromoned", required=True)
    parser.add_argument("--shim", default="")
    parser.add_argument("--sick-disk", default="")
    arguments, rest = parser.parse_known_args()
    PHEROMONED = str(pathlib.Path(arguments.pheromoned).resolve())
    SHIM = str(pathlib.Path(arguments.shim).resolve()) if arguments.shim else ""
    SICK_DISK = str(pathlib.Path(arguments.sick_disk).resolve()) if arguments.sick_disk else ""
    unittest.main(argv=[sys.argv[0], *rest])
