"""A pheromoned with a web port and a Unix socket for a class of tests, and pheromonectl beside it.

    class OrdersTest(OperatedServer): ...
    if __name__ == "__main__":
        operated_server.main()      # BIN_DIR
"""

import http.client
import json
import pathlib
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "proto_tests"))
from operated_daemon import PATIENCE_S, serve_class  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402
import test_config  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

BIN = pathlib.Path()

CONFIG = (map_of(4.0, 3.0, bias_m=0.2) + pheromone(1, "trail", tau_s=3000, sigma_m=0.3)
          + pheromone(2, "path", sigma_m=0.3) + test_config.pty("radio-a")
          + link("modem", "serial", port="./unplugged")
          + table("[tracker]", name="ceiling", listen="127.0.0.1:0")
          + table("web", listen="127.0.0.1:0", token_file="token", hosts=["lab.local"]))


class OperatedServer(unittest.TestCase):
    """One pheromoned for the tests of a class."""

    @classmethod
    def setUpClass(cls):
        serve_class(cls, BIN, CONFIG)
        cls.port = cls.daemon.web_port()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def ctl(self, *arguments, status=0):
        result = subprocess.run([BIN / "pheromonectl", *(str(it) for it in arguments)], cwd=self.folder,
                                text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.returncode, status, (arguments, result.stdout, result.stderr))
        if status == 0:
            self.assertEqual(result.stderr, "")
            return result.stdout
        self.assertEqual(result.stdout, "")
        return result.stderr

    def halt(self):
        """Its exit status, and what it tells: the modem is unplugged."""
        result = subprocess.run([BIN / "pheromonectl", "halt"], cwd=self.folder, text=True,
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


def main():
    global BIN
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main("__main__")
