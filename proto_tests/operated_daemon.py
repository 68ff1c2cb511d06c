"""pheromoned as an operator has it: with a Unix socket and, if it is configured, a web port.

    write_config(folder, default_config(bin_dir))
    with OperatedDaemon(bin_dir, folder, LD_PRELOAD=...) as daemon:
        status, text = daemon.call("POST", "/api/v1/halt", {})
        daemon.stop()

A class of tests has one with a token, in setUpClass: serve_class(cls, bin_dir, config).
"""

import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import time

from checks import PATIENCE_S, await_that, check
from test_config import map_of, pheromone, pty, table

# A configuration, to which more may be added: a small map with a wall, a pheromone that stays, a tag and
# a link.
ROOM = (map_of(4.0, 3.0, bias_m=0.2)
        + table("obstacles", walls=[{"points_m": [[3.5, 2.5], [3.5, 2.9]], "thickness_m": 0.1}])
        + pheromone(1, "path", sigma_m=0.3) + table("[tag]", name="door", x_m=1.0, y_m=1.0)
        + pty("radio-a"))
# Of a web port, with token_file = "token".
TOKEN = "0123456789abcdef0123456789abcdef"


def exchange(connection, method, target, body=None):
    """An operator's request on a new connection: the status and what came with it; status 0 if the
    server hangs up."""
    content = b"" if body is None else json.dumps(body).encode()
    try:
        connection.sendall(f"{method} {target} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
                           f"Content-Length: {len(content)}\r\n\r\n".encode() + content)
        answer = b"".join(iter(lambda: connection.recv(65536), b""))
    except ConnectionError:
        return 0, ""
    head, _, rest = answer.partition(b"\r\n\r\n")
    return (int(head.split()[1]), rest.decode()) if head else (0, "")


def write_config(folder, config):
    """test.toml, and the file "token"."""
    (folder / "test.toml").write_text(config)
    (folder / "token").write_text(TOKEN + "\n")
    (folder / "token").chmod(0o600)


def default_config(bin_dir):
    """With any free port: other tests have servers, too, and one that does not get its port ends."""
    text = subprocess.run([bin_dir / "pheromoned", "--default-config"], check=True,
                          capture_output=True, text=True).stdout
    check('"127.0.0.1:8377"' in text, "the default configuration has another port")
    return text.replace('"127.0.0.1:8377"', '"127.0.0.1:0"')


def serve_class(test_class, bin_dir, config, prepare=lambda folder: None):
    """Gives a class of tests `folder` and `daemon`, which end with it. `prepare` adds files."""
    folder = tempfile.TemporaryDirectory()
    test_class.addClassCleanup(folder.cleanup)
    test_class.folder = pathlib.Path(folder.name)
    write_config(test_class.folder, config)
    prepare(test_class.folder)
    test_class.daemon = OperatedDaemon(bin_dir, test_class.folder)
    test_class.addClassCleanup(test_class.daemon.kill)


class OperatedDaemon:
    """Starts when it is made, with folder/test.toml. `before`: a command that starts it. `environment`
    comes beside that of this process."""

    def __init__(self, bin_dir, folder, patience_s=PATIENCE_S, before=(), **environment):
        self.folder = folder
        self.log_file = folder / "pheromoned.log"
        if self.log_file.exists():  # of an earlier one, for whoever looks at the folder
            self.log_file.rename(folder / f"pheromoned-{time.monotonic_ns()}.log")
        program = bin_dir / "pheromoned"
        # A sanitizer wants to be loaded first, says so unless told not to, and keeps freed memory.
        self.keeps_memory = b"__asan_init" in program.read_bytes()
        environment = {**os.environ, **environment, "ASAN_OPTIONS": os.environ.get(
            "ASAN_OPTIONS", "") + ":verify_asan_link_order=0"}
        environment.pop("JOURNAL_STREAM", None)
        self.patience_s = patience_s
        with open(self.log_file, "wb") as log:
            self.process = subprocess.Popen([*before, program, "--config", "test.toml"], cwd=folder,
                                            env=environment, stdout=log, stderr=log)
        try:
            await_that(self.ready, "the daemon starts", patience_s)
        except BaseException:
            self.kill()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.kill()

    def ready(self):
        check(self.process.poll() is None, f"the daemon ended:\n{self.log()}")
        return "ready: " in self.log() and "control: " in self.log()

    def log(self):
        return self.log_file.read_text()

    def udp_port(self):
        return int(re.search(r"link udp: up, udp 127\.0\.0\.1:(\d+)", self.log())[1])

    def web_port(self):
        listens = re.compile(r"web: https?://127\.0\.0\.1:(\d+)")
        await_that(lambda: listens.search(self.log()), "the web port listens", self.patience_s)
        return int(listens.search(self.log())[1])

    def rss_kib(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+) kB", status)[1])

    def call(self, method, target, body=None, web=False):
        """An operator's request, over the Unix socket unless over the web's port: the status and
        what came with it; status 0 if the server hangs up."""
        connection = socket.socket(socket.AF_INET if web else socket.AF_UNIX, socket.SOCK_STREAM)
        with connection:
            connection.settimeout(self.patience_s)
            connection.connect(("127.0.0.1", self.web_port()) if web
                               else str(self.folder / "pheromoned.sock"))
            return exchange(connection, method, target, body)

    def healthy(self):
        return self.call("GET", "/healthz")[0] == 200

    def kill(self):
        self.process.kill()
        self.process.wait()

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(PATIENCE_S)
        check(status == 0, f"the daemon ended with {status}:\n{self.log()}")
        left = [it.name for it in self.folder.iterdir() if it.suffix == ".pty" or it.name == "pheromoned.sock"]
        check(not left, f"the daemon left behind: {left}")
