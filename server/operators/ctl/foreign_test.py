#!/usr/bin/env python3
"""What others put before pheromonectl: text with control characters in it, from a server, a robot or
a file, and a socket in the working directory.

    foreign_test.py BIN_DIR
"""

import contextlib
import http.server
import json
import os
import pathlib
import pty
import re
import select
import socket
import socketserver
import subprocess
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "server/daemon"), str(ROOT / "proto_tests")]
import operated_daemon  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402
import test_config  # noqa: E402

BIN = pathlib.Path()
PATIENCE_S = 60
NOBODY = 65534
BIDI = [0x061C, 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A)]
# Whatever a terminal obeys, but a newline; the sequences are none of pheromonectl's own.
CONTROLS = {chr(c) for c in [*range(0x20), *range(0x7F, 0xA0), *BIDI]} - {"\n"}
POISON = ("\x1b]0;mine\x07\x1b[5m" + "".join(sorted(CONTROLS)) + "\x9b5m\nrobot 9 stands\n")

CONFIG = (test_config.map_of(4, 3) + test_config.pheromone(1, "trail", tau_s=3000)
          + test_config.pty("radio-a")
          + test_config.link("modem", "serial", port="./unplugged")
          + test_config.table("[tracker]", name="ceiling", listen="127.0.0.1:0")
          + test_config.table("[tag]", name="door", x_m=1.5, y_m=2)
          + "".join(test_config.table("[tag]", name=name, x_m=2, y_m=2) for name in
                    ("N1", "N2", "N3", "N4", "N5", "N6", "S1", "S2", "S3", "S4", "P", "Src"))
          + test_config.table("[net]", name="bench", file="nets/pheromone.toml",
                              robot_file="nets/robot.toml", parameters={"robots": 2},
                              period_ms=20, law="e3", rate=0.001, source=100000))


def poisoned(value):
    """The same with each string, and each name of a number, longer. What pheromonectl compares stays:
    names on its command line, and symbols, which it takes as well-formed only."""
    if isinstance(value, str):
        return value if value in ("door", "bench") else value + POISON
    if isinstance(value, list):
        return [poisoned(it) for it in value]
    if isinstance(value, dict):
        changed = {key: it if key in ("kind", "rows") else poisoned(it)
                   for key, it in value.items()}
        if all(isinstance(it, int) for it in value.values()):
            changed["more" + POISON] = 7
        return changed
    return value


class FakeServer:
    """Answers at a Unix socket what `answer(method, target, body)` returns: a status and bytes."""

    def __init__(self, path, answer):
        self.requests = requests = []

        class Handler(http.server.BaseHTTPRequestHandler):
            def reply(self):
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                requests.append((self.command, self.path))
                status, content = answer(self.command, self.path, body)
                self.send_response(status)
                self.send_header("Content-Length", str(len(content)))
                self.end_headers()
                self.wfile.write(content)

            do_GET = do_POST = reply  # noqa: N815

            def address_string(self):
                return "-"

            def log_message(self, *_):
                pass

        self.server = socketserver.ThreadingUnixStreamServer(str(path), Handler)
        self.server.daemon_threads = True
        self.thread = threading.Thread(target=self.server.serve_forever, args=(0.01,))
        self.thread.start()

    def close(self):
        self.server.shutdown()
        self.thread.join()
        self.server.server_close()


class Folder(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def fake(self, answer, name="fake.sock"):
        server = FakeServer(self.folder / name, answer)
        self.addCleanup(server.close)
        return server

    def run_tool(self, *arguments, program="pheromonectl", **kwargs):
        environment = {key: it for key, it in os.environ.items() if key != "PHEROMONE_SOCKET"}
        return subprocess.run([BIN / program, *arguments], cwd=self.folder, check=False,
                              timeout=PATIENCE_S, env={**environment, **kwargs.pop("env", {})},
                              **{"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE,
                                 "stderr": subprocess.PIPE, **kwargs})

    def assert_harmless(self, printed, what):
        """`printed`, as text."""
        text = printed.decode()  # or it is not UTF-8
        found = sorted(CONTROLS & set(text))
        self.assertEqual(found, [], f"{what}: {printed!r}")
        return text


class TextOfServersTest(Folder):
    @classmethod
    def setUpClass(cls):
        operated_daemon.serve_class(
            cls, BIN, CONFIG,
            lambda folder: (folder / "nets").symlink_to(ROOT / "deploy/examples/nets"))
        cls.line = open_terminal(cls.folder / "radio-a.pty")
        cls.addClassCleanup(cls.line.close)
        cls.robot = Client(cls.line, 7, timeout=PATIENCE_S)
        cls.robot.hello(1)
        cls.robot.sense(1, 1500, 500, 16384)
        number = cls.robot.register("00:11:22:33:44:55")
        cls.robot.define(1, "http://example.org/ns#")
        cls.robot.define(2, "looking\u202efor\u009btag")  # which a server takes
        cls.robot.write(1500, 2000, 1, dict(
            subject_namespace=-17, subject=number, predicate_namespace=1, predicate=2,
            object_namespace=-3, object=244), time=1138458000)

    def answer(self, method, target, body):
        """That of a real server, poisoned."""
        status, text = self.daemon.call(method, target, json.loads(body) if body else None)
        with contextlib.suppress(json.JSONDecodeError):
            text = json.dumps(poisoned(json.loads(text)), ensure_ascii=False)
        return status, text.encode()

    # With what it shows of the server's strings; none: numbers alone.
    SHOWN = {
        "status": True, "status --hash": True, "links": True, "clients": True, "laws": True,
        "sense trail 1 1": False, "config show": True, "version": True, "doctor": True,
        "watch --once": True, "watch --once --columns 40 --rows 9": True, "net list": True,
        "net show bench": True, "net reset bench": False, "tags list": True, "tags show door": None,
        "tags find tag=door": None, "tags export": None, "capture start": True,
        "capture status": True, "capture stop": True, "deposit trail 1 1": None,
        "paint trail 1 1": None, "erase trail --all": None, "undo": None, "redo": None,
        "halt": True, "resume --all": None, "command radio-a 7 speed 100 --no-wait": None,
        "snapshot": None, "reload": None, "deposit none 1 1": True, "tags show none": None,
        "net show none": True, "clients --link none": None, "keys revoke 8": None,
    }

    def test_no_control_character_of_a_string_reaches_the_terminal(self):
        self.fake(self.answer)
        for command, shows in self.SHOWN.items():
            with self.subTest(command):
                result = self.run_tool(*command.split(), "--socket", "fake.sock")
                text = self.assert_harmless(result.stdout + result.stderr, command)
                if command in ("tags show door", "tags find tag=door"):
                    self.assertIn("#looking\\u202efor\\u009btag> 244", text)
                if shows is not None:
                    self.assertEqual("\\u001b]0;mine\\u0007" in text, shows, text)

    def test_a_newline_in_a_name_makes_no_row_of_a_table(self):
        self.fake(self.answer)
        for command in ("links", "clients", "laws", "net list", "tags list"):
            with self.subTest(command):
                printed = self.run_tool(*command.split(), "--socket", "fake.sock").stdout.decode()
                self.assertNotIn("\nrobot 9 stands", printed)

    def test_json_has_the_same_text(self):
        self.fake(self.answer)
        for command, what in (("laws", "laws"), ("links", "links"), ("net list", "nets"),
                              ("config show", "config")):
            with self.subTest(command):
                result = self.run_tool(*command.split(), "--json", "--socket", "fake.sock")
                self.assertEqual((result.returncode, result.stderr), (0, b""))
                text = self.assert_harmless(result.stdout, command)
                shown = json.loads(text)
                expected = json.loads(self.answer("GET", "/api/v1/" + what, b"")[1])
                self.assertEqual(set(re.findall(r'"[^"]*\\u001b', text)),
                                 set(re.findall(r'"[^"]*\\u001b', json.dumps(expected))))
                if command in ("laws", "config show"):  # the others tell the time
                    self.assertEqual(shown, expected)

    def test_what_is_no_answer_at_all(self):
        body = POISON.encode() + b"\x9b31m\xff\xfe \xe2\x80"
        error = json.dumps({"error": {"where": POISON, "what": POISON, "expected": POISON}},
                           ensure_ascii=False).encode()
        answers = {"not json": (200, body), "text": (500, body), "refused": (403, error),
                   "bad": (400, error), "a string": (200, json.dumps(POISON).encode())}
        current = []
        self.fake(lambda *_: current[0])
        for what, answer in answers.items():
            current[:] = [answer]
            for command in self.SHOWN:
                for json_too in ([], ["--json"]):
                    with self.subTest(command, what=what, json=json_too):
                        result = self.run_tool(*command.split(), *json_too, "--socket", "fake.sock")
                        printed = self.assert_harmless(result.stdout + result.stderr, command)
                        if what in ("refused", "bad"):
                            self.assertNotEqual(result.returncode, 0)
                            self.assertNotIn("\nrobot 9 stands", printed)

    def test_the_screen_has_no_sequences_but_its_own(self):
        self.fake(self.answer)
        own = re.compile(rb"\x1b\[(\?1049[hl]|\?25[hl]|2J|H|K|J|0m|[34]8;[25];[0-9;]+m)")
        for colours in ("none", "256", "24bit"):
            with self.subTest(colours):
                controller, terminal = pty.openpty()
                screen = subprocess.Popen(
                    [BIN / "pheromonectl", "--socket", "fake.sock", "watch", "--colours", colours,
                     "--columns", "200", "--rows", "12"],
                    cwd=self.folder, stdin=terminal, stdout=terminal, stderr=terminal)
                os.close(terminal)
                self.addCleanup(os.close, controller)
                shown = b""
                deadline = time.monotonic() + PATIENCE_S
                while select.select([controller], [], [], deadline - time.monotonic())[0]:
                    try:
                        shown += os.read(controller, 65536)
                    except OSError:  # it has ended
                        break
                    if shown.count(b"q quits") >= 2:
                        os.write(controller, b"q")
                self.assertEqual(screen.wait(PATIENCE_S), 0)
                self.assertIn(rb"trail\u0000", shown.replace(rb"\u001b]0;mine\u0007\u001b[5m", b""))
                self.assert_harmless(own.sub(b"", shown).replace(b"\r\n", b"\n")
                                     .replace(b"\r", b""), colours)


class CompletionTest(Folder):
    NAMES = ("$(touch${IFS}mine)", "`touch${IFS}mine`", "a;touch${IFS}mine", "plain-7", "*", "a'b")
    # Completes `pheromonectl clients --link ` and, as if the line were entered, reads each word again.
    DRIVER = """source "$1"; COMP_WORDS=("$2" clients --link ""); COMP_CWORD=3; _pheromone
eval "printf '%s\\n' ${COMPREPLY[*]}"
"""

    def test_a_name_runs_no_command(self):
        links = json.dumps({"links": [{"name": it} for it in self.NAMES]}).encode()
        self.fake(lambda *_: (200, links))
        result = subprocess.run(
            ["bash", "-c", self.DRIVER, "bash", ROOT / "deploy/completion/pheromone",
             BIN / "pheromonectl"], cwd=self.folder, text=True, capture_output=True, check=True,
            env={"PATH": "/usr/bin:/bin", "PHEROMONE_SOCKET": "fake.sock"})
        self.assertEqual(result.stderr, "")
        self.assertEqual(result.stdout.splitlines(), list(self.NAMES))
        self.assertFalse((self.folder / "mine").exists())


class TextOfFilesTest(Folder):
    def test_names_in_files_and_on_the_command_line(self):
        bad = b"\x1b]0;mine\x07\xc2\x9b5m\xe2\x80\xae\x9b\xff"
        name = os.fsdecode(bad)
        (self.folder / name).write_bytes(bad + b" = \"" + bad + b"\"\n")
        for program, *words in (("pheromonectl", "config", "check", name),
                                ("pheromonectl", "net", "check", name),
                                ("pheromonectl", "map", "info", name),
                                ("pheromonectl", "journal", "check", name),
                                ("pheromonectl", "replay", name),
                                ("pheromonectl", "status", "--socket", name),
                                ("pheromonectl", name),
                                ("pheromoned", "--config", name),
                                ("pheromoned", "--config", name, "--check"),
                                ("pheromone-swarm", "run", name),
                                ("pheromone-swarm", name),
                                ("pheromone-experiments", name),
                                ("pheromone-robot", "--robot", name, "--modem", name,
                                 "--start", "0", "0", "0", "--seconds", "0.1")):
            with self.subTest(program=program, words=words):
                result = self.run_tool(*words, program=program)
                self.assertIn("\\u001b]0;mine\\u0007",
                              self.assert_harmless(result.stdout + result.stderr, program))

    def test_the_log_of_a_server_quotes_names(self):
        (self.folder / "test.toml").write_text(
            test_config.map_of(4, 3) + test_config.pheromone(1, "trail\u202e\u009b5m", tau_s=30)
            + test_config.table("[link]", name="a", kind="udp", listen="127.0.0.1:0")
            + test_config.table("web", listen="127.0.0.1:0"))
        daemon = operated_daemon.OperatedDaemon(BIN, self.folder)
        self.addCleanup(daemon.kill)
        daemon.stop()
        text = self.assert_harmless((self.folder / "pheromoned.log").read_bytes(), "the log")
        self.assertIn('"trail\\u202e\\u009b5m"', text)


@unittest.skipIf(os.geteuid() != 0, "gives files to others, which only root may")
class ForeignSocketTest(Folder):
    SOCKET = "pheromoned.sock"

    def setUp(self):
        super().setUp()
        self.folder.chmod(0o777)

    @staticmethod
    def answer(*_):
        return 200, b'{"version":"fake"}'

    def serve(self, owner, mode=0o666):
        server = self.fake(self.answer, self.SOCKET)
        (self.folder / self.SOCKET).chmod(mode)
        os.chown(self.folder / self.SOCKET, owner, -1)
        return server

    def refused(self, server, reason, *arguments, **kwargs):
        for command in (("status",), ("halt",), ("status", "--json"), *arguments):
            result = self.run_tool(*command, **kwargs)
            self.assertEqual((result.returncode, result.stdout), (3, b""))
            self.assertEqual(result.stderr.decode(), f"pheromonectl: pheromoned.sock in the working "
                             f"directory {self.folder} {reason}; if that server is meant, use "
                             "--socket pheromoned.sock\n")
        if server is not None:
            self.assertEqual(server.requests, [])

    def used(self, *arguments, **kwargs):
        result = self.run_tool("version", *arguments, **kwargs)
        self.assertEqual((result.returncode, result.stderr), (0, b""))
        self.assertIn(b"pheromoned fake\n", result.stdout)

    def test_that_of_another_user_is_not_used_unless_it_is_named(self):
        server = self.serve(NOBODY)
        self.refused(server, "belongs to nobody, expected root")
        self.used("--socket", self.SOCKET)
        self.used(env={"PHEROMONE_SOCKET": self.SOCKET})

    def test_that_of_this_user_or_root_is_used(self):
        self.serve(0)
        self.used()
        self.used(user=NOBODY, group=NOBODY, extra_groups=[])

    def test_a_user_is_told_that_it_may_be_root_too(self):
        server = self.serve(4711)
        self.refused(server, "belongs to 4711, expected nobody or root", user=NOBODY, group=NOBODY,
                     extra_groups=[])

    def test_a_link_of_another_user_leads_nowhere(self):
        server = self.fake(self.answer, "mine.sock")
        (self.folder / self.SOCKET).symlink_to("mine.sock")
        self.used()
        server.requests.clear()
        os.chown(self.folder / self.SOCKET, NOBODY, -1, follow_symlinks=False)
        self.refused(server, "belongs to nobody, expected root")

    def test_a_file_of_root_that_another_user_serves(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listening:
            child = os.fork()
            if child == 0:
                os.setuid(NOBODY)  # who listens is whose server it is
                listening.bind(str(self.folder / self.SOCKET))
                listening.listen()
                os._exit(0)
            self.assertEqual(os.waitpid(child, 0)[1], 0)
            os.chown(self.folder / self.SOCKET, 0, 0)
            self.refused(None, "is served by nobody, expected root")
            listening.setblocking(False)
            for _ in range(3):  # connections, and nothing came over them
                with listening.accept()[0] as connection:
                    self.assertEqual(connection.recv(1), b"")

    def test_the_doctor_says_it(self):
        server = self.serve(NOBODY)
        findings = json.loads(self.run_tool("doctor", "--json").stdout)
        self.assertIn("belongs to nobody, expected root", json.dumps(
            [it for it in findings["findings"] if it["subject"] == "server"]))
        self.assertEqual(server.requests, [])


class WhichServerTest(Folder):
    def test_the_status_names_the_socket(self):
        self.fake(lambda *_: (200, b"{}"))
        status = self.run_tool("status", "--socket", "fake.sock").stdout.decode()
        self.assertIn("socket    fake.sock\n", status)

    def test_a_terminal_is_told_whose_server_is_changed_unless_it_is_named(self):
        self.fake(lambda *_: (200, b"{}"), "pheromoned.sock")
        told = f"pheromonectl: to the server at {self.folder}/pheromoned.sock\r\n".encode()
        for words, environment, expected in (
                (("snapshot",), {}, told), (("snapshot", "--json"), {}, told),
                (("snapshot",), {"PHEROMONE_SOCKET": "./pheromoned.sock"},
                 told.replace(b"/phero", b"/./phero")),
                (("snapshot", "--socket", "pheromoned.sock"), {}, b""), (("status",), {}, b"")):
            with self.subTest(words=words):
                controller, terminal = pty.openpty()
                result = self.run_tool(*words, stderr=terminal, env=environment)
                os.close(terminal)
                shown = b""
                with contextlib.suppress(OSError):  # at its end
                    while chunk := os.read(controller, 4096):
                        shown += chunk
                os.close(controller)
                self.assertEqual((result.returncode, shown), (0, expected))
        self.assertEqual(self.run_tool("snapshot").stderr, b"")


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
