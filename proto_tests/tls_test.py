#!/usr/bin/env python3
"""HTTPS of the real daemon, judged by clients that are not ours: Python's ssl, curl and openssl.

    tls_test.py BIN_DIR

The certificates are made by the program openssl, as the manual says.
"""

import http.client
import json
import pathlib
import signal
import socket
import ssl
import subprocess
import sys
import unittest

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "deploy/python"))
import pheromone  # noqa: E402
from operated_daemon import ROOM, TOKEN, await_that, serve_class  # noqa: E402

BIN = pathlib.Path()
CONFIG = ROOM + """[web]
listen = "127.0.0.1:0"
token_file = "token"
tls_certificate = "lab.pem"
tls_key = "lab.key"
"""


def make_certificate(folder, name="lab"):
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                    "ec_paramgen_curve:P-256", "-noenc", "-days", "365", "-subj", "/CN=lab.local",
                    "-addext", "subjectAltName=DNS:lab.local,DNS:localhost,IP:127.0.0.1",
                    "-keyout", f"{name}.key", "-out", f"{name}.pem"],
                   cwd=folder, check=True, capture_output=True)


class TlsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        serve_class(cls, BIN, CONFIG, make_certificate)
        cls.port = cls.daemon.web_port()

    def pem(self, name="lab"):
        return str(self.folder / f"{name}.pem")

    def client(self, cafile=None):
        context = ssl.create_default_context(cafile=cafile or self.pem())
        return http.client.HTTPSConnection("localhost", self.port, timeout=60, context=context)

    def curl(self, *arguments, address="https://localhost"):
        return subprocess.run(["curl", "-sS", "--cacert", self.pem(), *arguments[:-1],
                               f"{address}:{self.port}{arguments[-1]}"],
                              capture_output=True, text=True, timeout=60)

    def test_the_page_is_there_and_knows_that_it_came_by_https(self):
        page = self.curl("/")
        self.assertEqual(page.returncode, 0, page.stderr)
        self.assertIn("<!doctype html>", page.stdout.lower())
        script = self.curl("--compressed", "/dashboard/main.js").stdout
        self.assertIn("location.protocol === 'https:' ? 'wss' : 'ws'", script)

    def test_a_client_without_the_certificate_does_not_trust_it(self):
        make_certificate(self.folder, "other")
        with self.assertRaises(ssl.SSLCertVerificationError):
            self.client(self.pem("other")).request("GET", "/api/v1/status")
        self.assertEqual(subprocess.run(["curl", "-sS", f"https://localhost:{self.port}/"],
                                        capture_output=True, timeout=60).returncode, 60)

    def test_changes_need_the_token_and_a_page_of_this_server(self):
        def halt(**headers):
            connection = self.client()
            connection.request("POST", "/api/v1/halt", "{}", headers)
            answer = connection.getresponse()
            answer.read()
            connection.close()
            return answer.status
        bearer = {"Authorization": "Bearer " + TOKEN}
        self.assertEqual(halt(), 401)
        self.assertEqual(halt(**bearer), 200)
        self.assertEqual(halt(**bearer, Origin=f"https://localhost:{self.port}"), 200)
        self.assertEqual(halt(**bearer, Origin=f"http://localhost:{self.port}"), 403)
        self.assertEqual(halt(**bearer, Origin="https://evil.example"), 403)
        curl = self.curl("-H", "Authorization: Bearer " + TOKEN, "-X", "POST", "-d", "{}",
                         "/api/v1/halt")
        self.assertEqual(json.loads(curl.stdout)["links"], ["radio-a"])

    def test_one_connection_serves_many_requests(self):
        connection = self.client()
        for _ in range(20):
            connection.request("GET", "/api/v1/status")
            self.assertEqual(connection.getresponse().read()[:1], b"{")
        connection.close()
        self.assertRegex(self.curl("/metrics").stdout, r"(?m)^pheromone_tls_handshakes_total \d+$")

    def test_the_python_module_reads_changes_and_watches(self):
        server = pheromone.Server(f"https://localhost:{self.port}", token=TOKEN, cafile=self.pem())
        self.assertGreater(server.paint("path", [(1, 1), (2, 1)], radius_m=0.01), 0)
        self.assertEqual(server.map_as_array("path").at(1, 1), 1)
        for message in server.watch("/clients", timeout_s=60):
            self.assertEqual(message.topic, "/clients")
            break
        with self.assertRaises(ssl.SSLCertVerificationError):
            pheromone.Server(f"https://localhost:{self.port}").status()

    def test_old_versions_of_tls_are_refused(self):
        for option, accepted in (("-tls1_1", False), ("-tls1_2", True), ("-tls1_3", True)):
            found = subprocess.run(["openssl", "s_client", "-connect", f"localhost:{self.port}",
                                    "-CAfile", self.pem(), "-verify_return_error", option],
                                   input=b"", capture_output=True, timeout=60)
            self.assertEqual(found.returncode == 0, accepted, found.stderr)

    def test_plain_http_is_told_what_to_speak(self):
        found = self.curl("-i", "/", address="http://localhost")
        self.assertTrue(found.stdout.startswith("HTTP/1.1 400 "), found.stdout)
        self.assertIn("https://", found.stdout)

    def test_a_hundred_connections_that_do_nothing_do_not_keep_others_out(self):
        idle = []
        for number in range(100):
            connection = socket.create_connection(("localhost", self.port), timeout=60)
            self.addCleanup(connection.close)
            idle.append(connection)
            if number % 2 == 0:
                connection.sendall(b"\x16\x03\x01\x02\x00\x01")  # and no more of its handshake
        self.assertEqual(self.curl("-o", "/dev/null", "-w", "%{http_code}", "/").stdout, "200")

    def test_reload_takes_another_certificate_and_keeps_connections(self):
        before = self.client()
        before.request("GET", "/healthz")
        before.getresponse().read()
        (self.folder / "lab.key").write_text("none")  # a broken one changes nothing
        self.daemon.process.send_signal(signal.SIGHUP)
        await_that(lambda: "lab.key: found no private key" in self.daemon.log(), "the refusal")
        self.assertEqual(self.curl("-o", "/dev/null", "-w", "%{http_code}", "/").stdout, "200")
        make_certificate(self.folder)
        count = self.daemon.log().count("web: certificate valid until")
        self.daemon.process.send_signal(signal.SIGHUP)
        await_that(lambda: self.daemon.log().count("web: certificate valid until") > count,
                   "the new certificate")
        self.assertEqual(self.curl("-o", "/dev/null", "-w", "%{http_code}", "/").stdout, "200")
        before.request("GET", "/healthz")
        self.assertEqual(before.getresponse().status, 200)
        self.assertNotIn("require a restart", self.daemon.log())
        before.close()


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1))
    unittest.main()
