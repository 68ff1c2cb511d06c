"""A pheromoned with a web port and a Unix socket for a class of tests, and pheromonectl beside it.

    class OrdersTest(OperatedServer): ...
    if __name__ == "__main__":
        operated_server.main(__doc__)      # --pheromoned and --pheromonectl
"""

import argparse
import http.client
import json
import os
import pathlib
import re
import select
import subprocess
import sys
import tempfile
import threading
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "proto_tests"))
from stranger.client import Client, open_terminal  # noqa: E402
import test_config  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

PHEROMONED = ""
PHEROMONECTL = ""
PATIENCE_S = 30
TOKEN = "0123456789abcdef0123456789abcdef"

CONFIG = (map_of(4.0, 3.0, bias_m=0.2) + pheromone(1, "trail", tau_s=3000, sigma_m=0.3)
          + pheromone(2, "path", sigma_m=0.3) + test_config.pty("radio-a")
          + link("modem", "serial", port="./unplugged")
          + table("[tracker]", name="ceiling", listen="127.0.0.1:0")
          + table("web", listen="127.0.0.1:0", token_file="token", hosts=["lab.local"]))


class OperatedServer(unittest.TestCase):
    """One pheromoned for the tests of a class."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        (cls.folder / "lab.toml").write_text(CONFIG)
        (cls.folder / "token").write_text(TOKEN + "\n")
        (cls.folder / "token").chmod(0o600)
        cls.process = subprocess.Popen([PHEROMONED, "--config", "lab.toml"], cwd=cls.folder,
                                       stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)
        cls.addClassCleanup(cls.process.kill)  # of none, if it has ended
        log = b""
        while b"ready: " not in log:
            readable = select.select([cls.process.stderr], [], [], PATIENCE_S)[0]
            text = os.read(cls.process.stderr.fileno(), 65536) if readable else b""
            if not text:
                raise AssertionError(log.decode())
            log += text
        cls.port = int(re.search(rb"web: http://127\.0\.0\.1:(\d+)", log)[1])
        cls.drain = threading.Thread(target=cls.process.stderr.read, daemon=True)
        cls.drain.start()

    @classmethod
    def tearDownClass(cls):
        cls.process.terminate()
        status = cls.process.wait(PATIENCE_S)
        cls.drain.join()
        cls.process.stderr.close()
        left = (cls.folder / "pheromoned.sock").exists()
        cls.temporary.cleanup()
        assert status == 0, status
        assert not left, "the socket was left behind"

    def ctl(self, *arguments, status=0):
        result = subprocess.run([PHEROMONECTL, *(str(it) for it in arguments)], cwd=self.folder,
                                text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.returncode, status, (arguments, result.stdout, result.stderr))
        if status == 0:
            self.assertEqual(result.stderr, "")
            return result.stdout
        self.assertEqual(result.stdout, "")
        return result.stderr

    def halt(self):
        """Its exit status, and what it tells: the modem is unplugged."""
        result = subprocess.run([PHEROMONECTL, "halt"], cwd=self.folder, text=True,
                                capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.stderr, "")
        return result.returncode, result.stdout

    def view(self, *arguments):
        return json.loads(self.ctl(*arguments, "--json"))

    def request(self, method, path, body=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.request(method, path, body, {key.replace("_", "-"): value
                                                for key, value in headers.items()})
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer, data

    def robot(self, identifier):
        """A robot on the link that has said HELLO. One at a time: they would share the terminal."""
        line = open_terminal(self.folder / "radio-a.pty")
        self.addCleanup(line.close)
        client = Client(line, identifier, timeout=PATIENCE_S, tries=1)
        client.hello(nonce=1)
        return client


def main(doc):
    global PHEROMONED, PHEROMONECTL
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--pheromoned", required=True)
    parser.add_argument("--pheromonectl", required=True)
    arguments, rest = parser.parse_known_args()
    PHEROMONED = str(pathlib.Path(arguments.pheromoned).resolve())
    PHEROMONECTL = str(pathlib.Path(arguments.pheromonectl).resolve())
    unittest.main(argv=[sys.argv[0], *rest])
