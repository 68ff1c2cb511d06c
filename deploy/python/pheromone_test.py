#!/usr/bin/env python3
"""The Python package against a real server; and its WebSocket against one made of the frames of
RFC 6455, for what a good server does not send. README.md's commands are run by ../commands_test.py.

    pheromone_test.py BIN_DIR
"""

import base64
import contextlib
import hashlib
import json
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import threading
import unittest

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "proto_tests"), str(ROOT / "deploy/python")]
import pheromone  # noqa: E402
from operated_daemon import ROOM, TOKEN, await_that, serve_class  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402

BIN = pathlib.Path()
CONFIG = ROOM + """[[link]]
name = "udp"
kind = "udp"
listen = "127.0.0.1:0"
[[tracker]]
name = "camera"
listen = "127.0.0.1:0"
valid_s = 3600
[capture]
folder = "captures"
[web]
listen = "127.0.0.1:0"
token_file = "token"
"""


def tracker_of(daemon):
    return re.search(r"camera: tracker: .*?(127\.0\.0\.1:\d+)", daemon.log())[1]


class WithServer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        serve_class(cls, BIN, CONFIG)
        cls.address = f"http://127.0.0.1:{cls.daemon.web_port()}"
        cls.server = pheromone.Server(cls.address, token=TOKEN)
        line = open_terminal(cls.folder / "radio-a.pty")
        cls.addClassCleanup(line.close)
        cls.robot = Client(line, 7, timeout=60)
        cls.robot.hello(nonce=1)
        cls.tracked = Client(line, 9, timeout=60)  # by a camera
        cls.tracked.hello(nonce=1)


class ServerTest(WithServer):
    def test_what_is_painted_is_sensed_and_on_the_map(self):
        self.server.erase("path", everything=True)
        self.assertEqual(self.server.paint("path", [(1, 1), (2, 1)], radius_m=0.01), 11)
        self.server.deposit("path", 3, 2, quanta=2)
        sensed = self.server.sense("path", 1.5, 1.05, heading_deg=0)
        self.assertEqual([it * 4096 for it in sensed], list(self.robot.sense(1, 1500, 1050, 0)))
        for numpy in (pheromone.arrays.numpy, None):
            with self.subTest(numpy=numpy), self.without(numpy):
                found = self.server.map_as_array("path", nodes_per_cell=1)
                self.assertEqual((found.rows, found.columns), (31, 41))
                self.assertEqual([found.at(x, 1) for x in (0.9, 1, 2, 2.1)], [0, 1, 1, 0])
                self.assertEqual(found.at(3, 2), 0.25)
                self.assertNotEqual(found.at(3.5, 2.7), found.at(3.5, 2.7))  # NaN: a wall
                x, y = found.place(found.rows - 1 - 20, 30)
                self.assertAlmostEqual(x, 3)
                self.assertAlmostEqual(y, 2)
                self.assertEqual(found.maximum, 1)
                left, right, bottom, top = found.extent
                self.assertAlmostEqual(left, -0.05)
                self.assertAlmostEqual(right, 4.05)
                self.assertAlmostEqual(bottom, -0.05)
                self.assertAlmostEqual(top, 3.05)
                with self.assertRaises(IndexError):
                    found.at(5, 1)
                part = self.server.map_as_array("path", area_m=(2, 1, 3, 2), nodes_per_cell=1)
                self.assertEqual((part.rows, part.columns, part.at(2, 1), part.at(3, 2)),
                                 (11, 11, 1, 0.25))
                walls = self.server.obstacles()
                self.assertTrue(walls[31 - 1 - 27][35])
                self.assertFalse(walls[0][0])
        self.assertTrue(self.server.picture("path").startswith(b"\x89PNG\r\n"))
        self.assertGreater(self.server.erase("path", area_m=(0, 0, 4, 3)), 1000)
        self.assertEqual(self.server.map_as_array("path").at(1, 1), 0)

    def test_evaporation_is_changed_until_the_configuration_is_reread(self):
        def tau_s():
            return self.server.laws()["pheromones"][0]["tau_s"]

        def level():
            return self.server.map_as_array("path").at(1, 2)
        self.server.paint("path", [(1, 2), (2, 2)], radius_m=0.01)
        self.server.change_law("path", 1e6)
        self.assertEqual((tau_s(), level()), (1e6, 1))
        self.server.change_law("path", 0.001)  # a quantum each millisecond
        await_that(lambda: level() == 0, "the path evaporates")
        self.server.post("reload")
        self.assertEqual(tau_s(), 0)
        self.server.paint("path", [(1, 2), (2, 2)], radius_m=0.01)
        self.assertEqual(level(), 1)
        self.server.erase("path", everything=True)

    @contextlib.contextmanager
    def without(self, numpy):
        self.assertIsNotNone(pheromone.arrays.numpy)  # both ways are to be tried
        before, pheromone.arrays.numpy = pheromone.arrays.numpy, numpy
        try:
            yield
        finally:
            pheromone.arrays.numpy = before

    def test_a_camera_tells_where_robots_are(self):
        self.tracked.sense(1, 500, 500, 0)
        with pheromone.Tracker(tracker_of(self.daemon)) as camera:
            camera.poses([("radio-a", 9, 2.35, 0.9, 450), ("radio-a", 8, 1, 1, 0)])

            def tracked():
                pose = self.client(9)["pose"]
                return pose["source"] == "tracker" and pose["x_m"] == 2.35
            await_that(tracked, "the pose that the camera reports")
        self.assertAlmostEqual(self.client(9)["pose"]["heading_deg"], 90, places=2)

    def test_a_robot_that_a_camera_sees_and_that_has_not_said_hello_is_told(self):
        def told_by(command):
            return subprocess.run([BIN / "pheromonectl", command], cwd=self.folder, text=True,
                                  capture_output=True, check=True, timeout=60).stdout

        with pheromone.Tracker(tracker_of(self.daemon)) as camera:
            camera.pose("radio-a", 88, 1, 1, 0)
            await_that(lambda: "poses of trackers were refused: pheromonectl links tells why"
                       in told_by("status"), "the status warns")
        self.assertIn("the robot has not said HELLO", told_by("links"))
        await_that(lambda: "the robot has not said HELLO" in self.daemon.log(), "the log tells it")

    def client(self, number=7):
        return [it for it in self.server.clients() if it["id"] == number][0]

    def test_robots_are_commanded(self):
        self.server.command("radio-a", 7, "speed", 250)
        self.assertEqual(self.client()["last_command"]["command"], "speed")
        self.robot.sense(1, 1000, 1000, 0)
        self.server.go_to("radio-a", 7, 2, 1)
        self.assertEqual(self.client()["goal"]["x_m"], 2)
        self.server.cancel_goal("radio-a", 7)
        self.assertIsNone(self.client()["goal"])
        self.assertEqual(self.server.halt(), ["radio-a", "udp"])

    def test_recordings_are_made_and_downloaded_even_in_two_attempts(self):
        self.server.start_capture()
        self.robot.sense(1, 1000, 1000, 0)
        self.server.stop_capture()
        name = self.server.captures()[-1]["name"]
        original = (self.folder / "captures" / name).read_bytes()
        copy = self.folder / "copy.pcapng"
        self.assertEqual(self.server.download_capture(name, copy), len(original))
        self.assertEqual(copy.read_bytes(), original)
        for begun in (1, len(original) - 1, len(original), len(original) + 5):
            (self.folder / "copy.pcapng.part").write_bytes((original + b"other")[:begun])
            self.server.download_capture(name, copy)
            self.assertEqual(copy.read_bytes(), original)
        events, following = self.server.events()
        self.assertEqual([it["on"] for it in events if it["topic"] == "capture"][-2:], [True, False])
        self.assertEqual(self.server.events(following)[0], [])
        with self.assertRaises(pheromone.Refused) as refused:
            self.server.download_capture("../test.toml", copy)
        self.assertEqual(refused.exception.status, 404)

    def test_views(self):
        self.assertEqual([it["name"] for it in self.server.links()], ["radio-a", "udp"])
        self.assertEqual(self.server.laws()["map"]["columns"], 41)
        self.assertEqual([it["name"] for it in self.server.tags()], ["door"])
        self.assertEqual(self.server.tags(with_contents=True)[0]["blocks"], [])
        self.assertEqual(self.server.nets(), [])
        self.assertIsNotNone(self.server.status(with_hash=True)["state_hash"])

    def test_refusals_say_what_and_where(self):
        with self.assertRaises(pheromone.Refused) as refused:
            self.server.sense("smell", 1, 1)
        self.assertEqual((refused.exception.status, refused.exception.where), (400, "pheromone"))
        self.assertEqual(str(refused.exception),
                         'pheromone: found "smell", expected one of 1 (path)')
        with self.assertRaises(pheromone.Refused) as refused:
            pheromone.Server(self.address).halt()
        self.assertEqual(refused.exception.status, 401)
        with self.assertRaises(pheromone.Refused) as refused:
            self.server.snapshot()
        self.assertEqual(refused.exception.status, 501)
        with self.assertRaises(ValueError):
            self.server.paint("path")

    def test_the_token_from_its_file_and_the_unix_socket(self):
        pheromone.Server(self.address, token_file=self.folder / "token").deposit("path", 1, 1)
        pheromone.Server(str(self.folder / "pheromoned.sock")).deposit("path", 1, 1)
        with self.assertRaises(OSError):
            pheromone.Server(str(self.folder / "none.sock")).status()

    def test_a_server_that_hangs_up_cannot_be_reached_and_one_that_talks_nonsense_is_another(self):
        for answer, error in ((b"", OSError), (b"HELLO\r\n", pheromone.ProtocolError)):
            with self.subTest(answer), socket.create_server(("127.0.0.1", 0)) as listener:
                def serve():
                    connection, _ = listener.accept()
                    with connection:
                        connection.recv(1000)
                        connection.sendall(answer)
                thread = threading.Thread(target=serve)
                thread.start()
                with self.assertRaises(error):
                    pheromone.Server(f"http://127.0.0.1:{listener.getsockname()[1]}").status()
                thread.join()


class FakeStream:
    """A server of one WebSocket. `frames` is sent after the handshake, or `answer` in place of all;
    what the client sends is kept, unmasked."""

    def __init__(self, *frames, accept=None, answer=None):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "http://127.0.0.1:{}".format(self.listener.getsockname()[1])
        self.frames = frames
        self.accept = accept
        self.answer = answer
        self.received = []
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        connection, _ = self.listener.accept()
        with connection, connection.makefile("rb") as lines:
            self.request = b"".join(iter(lines.readline, b"\r\n")).decode()
            key = re.search(r"Sec-WebSocket-Key: (\S+)", self.request)[1].encode()
            digest = hashlib.sha1(key + b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11").digest()
            accept = self.accept or base64.b64encode(digest).decode()
            shake_hands = (
                "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n"
                f"Sec-WebSocket-Accept: {accept}\r\n\r\n").encode()
            connection.sendall(b"".join((shake_hands, *self.frames))
                               if self.answer is None else self.answer)
            connection.shutdown(socket.SHUT_WR)
            while head := lines.read(2):
                size = head[1] & 0x7F
                size = struct.unpack(">H", lines.read(2))[0] if size == 126 else size
                mask = lines.read(4)
                self.received.append((head[0], bytes(
                    byte ^ mask[i % 4] for i, byte in enumerate(lines.read(size)))))

    def watch(self, *topics):
        try:
            return list(pheromone.Server(self.address, token=TOKEN).watch(*topics))
        finally:
            self.thread.join()
            self.listener.close()


def frame(opcode, payload, final=True):
    """As section 5.2 of RFC 6455 draws it."""
    head = bytes([(0x80 if final else 0) | opcode])
    if len(payload) < 126:
        return head + bytes([len(payload)]) + payload
    return head + bytes([126]) + struct.pack(">H", len(payload)) + payload


def data(subscription, payload):
    return b"\x01" + struct.pack("<IQ", subscription, 1234) + payload


ADVERTISE = frame(1, json.dumps({"op": "advertise", "channels": [
    {"id": 5, "topic": "/clients", "encoding": "json"},
    {"id": 6, "topic": "/robots", "encoding": "protobuf"}]}).encode())


class StreamTest(unittest.TestCase):
    def test_what_is_wanted_is_subscribed_to_and_told(self):
        stream = FakeStream(ADVERTISE, frame(2, data(1, b'{"clients":[]}')),
                            frame(2, data(2, b"\x0a\x00")), frame(2, data(9, b"{}")))
        self.assertEqual(stream.watch("/clients", "/robots"),
                         [("/clients", 1234, {"clients": []}), ("/robots", 1234, b"\x0a\x00")])
        self.assertEqual(json.loads(stream.received[0][1]), {"op": "subscribe", "subscriptions": [
            {"id": 1, "channelId": 5}, {"id": 2, "channelId": 6}]})
        self.assertIn("\r\nSec-WebSocket-Protocol: foxglove.websocket.v1\r\n", stream.request)
        self.assertIn("\r\nAuthorization: Bearer " + TOKEN + "\r\n", stream.request)
        self.assertEqual(stream.received[-1], (0x88, b"\x03\xe8"))  # it says goodbye

    def test_all_in_json_is_told_by_default(self):
        stream = FakeStream(ADVERTISE)
        stream.watch()
        self.assertEqual(json.loads(stream.received[0][1])["subscriptions"],
                         [{"id": 1, "channelId": 5}])

    def test_fragments_are_joined_around_a_ping_that_is_answered(self):
        message = data(1, json.dumps({"text": "x" * 300}).encode())
        stream = FakeStream(ADVERTISE, frame(2, message[:100], final=False), frame(9, b"are you?"),
                            frame(0, message[100:], final=False), frame(0, b""))
        self.assertEqual(stream.watch("/clients")[0].value, {"text": "x" * 300})
        self.assertIn((0x8A, b"are you?"), stream.received)

    def test_a_damaged_stream_is_an_error(self):
        for frames in ([frame(2, b"x" * 50)[:30]],            # ends in the middle
                       [b"\xc2\x01x"],                        # a reserved bit
                       [b"\x82\x81abcdx"],                    # masked by a server
                       [b"\x82\x7f" + struct.pack(">Q", 1 << 40)],
                       [frame(0, b"x")],                      # nothing to continue
                       [frame(2, b"x", final=False), frame(2, b"y")],
                       [ADVERTISE, frame(2, data(1, b"{"))],  # no JSON
                       [frame(1, b'{"op":"status","level":2,"message":"too many viewers"}')]):
            with self.subTest(frames=frames), self.assertRaises(pheromone.ProtocolError):
                FakeStream(*frames).watch("/clients")

    def test_what_is_no_websocket_server_is_an_error(self):
        with self.assertRaises(pheromone.ProtocolError):
            FakeStream(accept="wrong").watch()

    def test_a_server_that_closes_before_it_answers_has_gone(self):
        with self.assertRaisesRegex(ConnectionError, "closed the connection .* handshake"):
            FakeStream(answer=b"").watch()

    def test_what_is_no_http_answer_is_named(self):
        for answer, named in ((b"hello\r\n\r\n", "b'hello.*expected HTTP/1.1"),
                              (b"\r\n", "expected HTTP/1.1"),
                              (b"HTTP/1.1 many\r\n\r\n", "b'HTTP/1.1 many.*expected HTTP/1.1"),
                              (b"HTTP/1.0 101 Yes\r\n\r\n", "b'HTTP/1.0 101.*expected HTTP/1.1"),
                              (b"HTTP/2 503 Later\r\n\r\n", "b'HTTP/2 503.*expected HTTP/1.1"),
                              (b"HTTP/1.0 503 Later\r\n\r\n", "HTTP status 503"),
                              (b"HTTP/1.1 403 No\r\nContent-Length: long\r\n\r\n",
                               "Content-Length 'long', expected"),
                              (b"HTTP/1.1 403 No\r\nContent-Length: -5\r\n\r\n",
                               "Content-Length '-5', expected"),
                              (b"HTTP/1.1 101 Yes\r\n" + b"x" * 70_000, "headers")):
            with self.subTest(answer=answer[:50]), \
                    self.assertRaisesRegex(pheromone.ProtocolError, named):
                FakeStream(answer=answer).watch()


class LiveStreamTest(WithServer):
    def test_the_stream_of_a_server_tells_of_its_robots(self):
        self.robot.sense(1, 1500, 500, 0)
        for message in self.server.watch("/clients", timeout_s=60):
            found = [it for it in message.value["clients"] if it["id"] == 7]
            if found and found[0]["pose"]:
                self.assertEqual(found[0]["pose"]["x_m"], 1.5)
                return
        self.fail("the stream ended")


class ExamplesTest(WithServer):
    def test_the_map_is_plotted(self):
        self.server.paint("path", [(1, 1), (2, 1)], radius_m=0.01)
        result = subprocess.run(
            [sys.executable, ROOT / "deploy/examples/python/plot_map.py", "--server", self.address,
             "--text", "path"], text=True, capture_output=True, check=False, timeout=60)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual(result.stdout.count("#"), 11)
        self.assertEqual(result.stdout.splitlines()[31 - 1 - 10].find("#"), 10)

    def test_their_help_needs_nothing(self):
        for name in ("plot_map.py", "camera_poses.py"):
            result = subprocess.run([ROOT / "deploy/examples/python" / name, "--help"], text=True,
                                    capture_output=True, check=False, timeout=60, cwd="/",
                                    env={"PATH": os.environ["PATH"]})
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertTrue(result.stdout.startswith(f"usage: {name}"), result.stdout)

    def test_a_camera_without_a_camera(self):
        self.robot.sense(1, 500, 500, 0)
        result = subprocess.run(
            [sys.executable, ROOT / "deploy/examples/python/camera_poses.py", "--demo",
             "--tracker", tracker_of(self.daemon), "--pictures", "2"], text=True,
            capture_output=True, check=False, timeout=60)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        await_that(lambda: self.server.clients()[0]["pose"]["source"] == "tracker", "its pose")
        pose = self.server.clients()[0]["pose"]
        self.assertAlmostEqual((pose["x_m"] - 2) ** 2 + (pose["y_m"] - 1.5) ** 2, 1, places=4)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
