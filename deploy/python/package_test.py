#!/usr/bin/env python3
"""The Python package's robots, recordings, pictures and examples, against a real server, a broker of
MQTT, tshark, pheromonectl and netpbm.

    package_test.py BIN_DIR
"""

import asyncio
import contextlib
import csv
import json
import math
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import termios
import unittest
from unittest import mock

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / "proto_tests"), str(HERE)]
import paho.mqtt.client as mqtt  # noqa: E402
import pheromone  # noqa: E402
from free_numbers import free_port  # noqa: E402
from operated_daemon import ROOM, TOKEN, await_that, default_config, serve_class  # noqa: E402
from pheromone import aio, arrays, drive, servers, wire  # noqa: E402
from pheromone.recordings import Entry, Recording  # noqa: E402
from pheromone.robot import Client, Line  # noqa: E402
from pheromone.servers import open_line  # noqa: E402
from test_config import table  # noqa: E402

BIN = pathlib.Path()
CORPUS = ROOT / "proto_tests/replay"
UDP = '[[link]]\nname = "udp"\nkind = "udp"\nlisten = "127.0.0.1:0"\n'
WEB = '[web]\nlisten = "127.0.0.1:0"\ntoken_file = "token"\n'


def run(*command, status=0, **options):
    done = subprocess.run(command, text=True, capture_output=True, check=False, timeout=120, **options)
    if done.returncode != status:
        raise AssertionError(f"{command}: {done}")
    return done.stdout


@contextlib.contextmanager
def without_numpy():
    with mock.patch.object(arrays, "numpy", None):
        yield


class TypesTest(unittest.TestCase):
    def test_everything_has_types_that_are_right(self):
        with tempfile.TemporaryDirectory() as cache:
            run(sys.executable, "-m", "mypy", "--cache-dir", cache, "pheromone", "examples", cwd=HERE)


class PictureTest(unittest.TestCase):
    FACTS = {"pheromone": "path", "maximum": 2, "origin_m": [0, 0], "cell_m": 0.5, "field_time_s": 0}
    LEVELS = [[0.0, 2.0, math.nan], [1.0, 3.0, 0.0]]
    # The ends and the middle of viridis, and white.
    BLUE, YELLOW, GREEN, WHITE = (68, 1, 84), (253, 231, 37), (33, 145, 140), (255, 255, 255)

    def pixels(self, png):
        """By netpbm: the rows."""
        with tempfile.NamedTemporaryFile(suffix=".png") as file:
            file.write(png)
            file.flush()
            run("pngcheck", "-q", file.name)
            ppm = subprocess.run(["pngtopnm", "-plain", file.name], check=True, capture_output=True).stdout
        kind, columns, rows, depth, *values = ppm.split()
        self.assertEqual((kind, depth), (b"P3", b"255"))
        colours = list(zip(*[map(int, values)] * 3))
        self.assertEqual(len(colours), int(columns) * int(rows))
        return [colours[i:i + int(columns)] for i in range(0, len(colours), int(columns))]

    def test_a_map_is_a_picture(self):
        expected = [[self.BLUE, self.YELLOW, self.WHITE], [self.GREEN, self.YELLOW, self.BLUE]]
        for values in (self.LEVELS, arrays.numpy.array(self.LEVELS)):
            shown = pheromone.Map(values, self.FACTS)
            self.assertEqual(self.pixels(shown.png(pixels_per_cell=1)), expected)
            twice = self.pixels(shown.png(pixels_per_cell=2))
            self.assertEqual([row[::2] for row in twice[::2]], expected)
            self.assertEqual([row[1::2] for row in twice[1::2]], expected)
            self.assertEqual(len(self.pixels(shown._repr_png_())[0]), 3 * 133)


class RecordingTest(unittest.TestCase):
    def test_intensities_are_those_that_wireshark_shows(self):
        for name in ("traffic", "evaporation", "retries"):
            with self.subTest(name):
                path = CORPUS / f"{name}.pcapng"
                shown = run("tshark", "-X", f"lua_script:{ROOT}/protocol/wireshark/pheromone.lua", "-r", path,
                            "-Y", "pheromone.left", "-T", "fields", "-e", "pheromone.left",
                            "-e", "pheromone.right")
                expected = [pair for line in shown.splitlines()
                            for pair in zip(*(it.split(",") for it in line.split("\t")))]
                found = Recording(path).sensed()
                self.assertEqual([(str(round(it["left"] * 4096)), str(round(it["right"] * 4096)))
                                  for it in found], expected)

    def test_deposits_are_those_that_the_server_made(self):
        for name in ("traffic", "retries", "evaporation"):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                path = CORPUS / f"{name}.pcapng"
                run(BIN / "pheromonectl", "export", "--csv", folder, path)
                with open(f"{folder}/deposits.csv", newline="") as file:
                    expected = [(it["link"], int(it["robot"]), float(it["x_m"]), float(it["y_m"]),
                                 int(it["quanta"]))
                                for it in csv.DictReader(file) if it["by"] == "robot"]
                for numpy in (contextlib.nullcontext, without_numpy):
                    with numpy():
                        fields = ("link", "robot", "x_m", "y_m", "quanta")
                        found = [tuple(it[key] if numpy is not without_numpy else getattr(it, key)
                                       for key in fields) for it in Recording(path).deposited()]
                    self.assertEqual(found, expected)

    def test_damage_ends_it(self):
        whole = (CORPUS / "traffic.pcapng").read_bytes()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.pcapng"

            def read(data):
                path.write_bytes(data)
                recording = Recording(path)
                return list(recording), recording.problem
            entries, problem = read(whole)
            self.assertEqual((len(entries), problem), (88, ""))
            half = len(whole) // 2
            for damaged in (whole[:half], whole[:half] + bytes((whole[half] ^ 1,)) + whole[half + 1:]):
                found, problem = read(damaged)
                self.assertEqual(found, entries[:len(found)])
                self.assertTrue(0 < len(found) < 88 and problem, problem)
            end = whole.rindex((0x8050480A).to_bytes(4, "little"))
            self.assertEqual(read(whole[:end]), (entries, "the recording has no end"))
            for other in (b"", b"\n", whole[:100], (ROOT / "README.md").read_bytes()):
                with self.assertRaises(pheromone.ProtocolError):
                    read(other)

    def test_the_answers_of_rounds_are_those_of_the_turns_before(self):
        def entry(name, robot, **fields):
            return Entry(len(entries), "radio", robot, wire.Message(name, robot or 255, fields))

        def asks(robot, x):
            entries.append(entry("SENSE", robot, type=1, x=x, y=0, heading=16384))

        def round_of(number, turns, answers):
            entries.append(entry("ROUND", None, number=number, turns=turns, answers=answers))
        entries = []
        round_of(255, [7, 9], [])
        asks(7, 1000)
        asks(9, 2000)
        round_of(0, [9, 7], [(4096, 0), (wire.NO_INTENSITIES, 7)])
        asks(9, 2100)
        round_of(2, [], [(1, 2), (3, 4)])  # one was lost
        with mock.patch.object(Recording, "__init__", lambda it: None), \
                mock.patch.object(Recording, "__iter__", lambda it: iter(entries)), \
                mock.patch.object(Recording, "pose_unit_10um", 100), without_numpy():
            self.assertEqual([tuple(it) for it in Recording().sensed()],
                             [(3, "radio", 7, 1, 1.0, 0.0, 90.0, 1.0, 0.0, False)])


class Wheels:
    """A Drive that keeps what it was told."""

    def __init__(self, *pose):
        self.at = pose or None
        self.told = []

    def pose(self):
        return self.at

    def wheels(self, left_mm_s, right_mm_s):
        self.told.append((left_mm_s, right_mm_s))


class DriveTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        serve_class(cls, BIN, ROOM + UDP + WEB)
        cls.server = pheromone.Server(str(cls.folder / "pheromoned.sock"))
        cls.address = f"udp:127.0.0.1:{cls.daemon.udp_port()}"
        cls.server.paint("path", [(0.5, 1), (3.5, 1)], radius_m=0.01)

    def follower(self, number, robot, **options):
        line = open_line(self.address)
        self.addCleanup(line.close)
        follower = drive.Follower(line, number, robot, **options)
        follower.client.timeout = 60  # of a busy machine
        return follower

    def robot(self, number):
        return [it for it in self.server.clients() if it["id"] == number][0]

    def test_it_steers_by_the_law_of_the_specification(self):
        robot = Wheels(2, 1.1, 10)
        follower = self.follower(1, robot, released=True, speed_mm_s=250)
        follower.step()
        left, right = self.server.sense("path", 2, 1.1, 10)
        self.assertGreater(right, left)
        self.assertEqual(robot.told[-1][0], 250)  # the path is on its right
        self.assertAlmostEqual(robot.told[-1][1], 250 * (1 - (right - left) / max(1, left, right)), delta=0.2)
        self.assertEqual(drive.differential(2048, 0, 100), (50, 100))
        self.assertEqual(drive.differential(-8192, 8192, 100), (100, -100))

    def test_an_operator_halts_and_releases_it(self):
        robot = Wheels(2, 1, 0)
        follower = self.follower(2, robot)
        follower.step()
        self.assertEqual(robot.told, [(0, 0)])

        def command(name, *arguments):
            self.server.command("udp", 2, name, *arguments)
            await_that(lambda: follower.client.listen(0.05)
                       or self.robot(2)["last_command"]["outcome"] != "pending", f"{name} is acknowledged")
            return self.robot(2)["last_command"]["outcome"]
        self.assertEqual(command("resume"), "accepted")
        follower.step()
        self.assertNotEqual(robot.told[-1], (0, 0))
        self.assertEqual(command("speed", 100), "accepted")
        follower.step()
        self.assertEqual(max(robot.told[-1]), 100)
        self.assertEqual(command("pick"), "refused")
        self.assertEqual(command("halt"), "accepted")
        self.assertEqual(robot.told[-1], (0, 0))
        follower.step()
        self.assertEqual(robot.told[-1], (0, 0))

    def test_it_is_told_no_speed_that_is_too_much_for_it(self):
        for options, speed_mm_s, limit in (({}, 200, 1000), ({"max_speed_mm_s": 150}, 150, 150),
                                           ({"speed_mm_s": 100, "max_speed_mm_s": 150}, 100, 150)):
            follower = self.follower(5, Wheels(2, 1, 0), **options)
            self.assertEqual(follower.speed_mm_s, speed_mm_s)
            for speed, result in (limit, 0), (limit + 1, wire.BAD_VALUE), (-1, wire.BAD_VALUE):
                command = wire.build("COMMAND", 5, seq=1, code=3, speed_mm_s=speed)
                self.assertEqual(follower.client.on_command(wire.parse(command)), result)
            self.assertEqual(follower.speed_mm_s, limit)
        with self.assertRaisesRegex(ValueError, "speed_mm_s is 1500, expected 0 to 1000"):
            self.follower(5, Wheels(2, 1, 0), speed_mm_s=1500)

    def test_it_stands_where_nothing_is_sensed_and_without_a_pose_and_tells_that_once(self):
        robot = Wheels(2, 2.5, 0)
        follower = self.follower(3, robot, released=True)
        for _ in range(3):
            follower.step()
        self.assertEqual(set(robot.told), {(0, 0)})
        self.assertEqual((self.robot(3)["last_event"]["event"], self.robot(3)["last_event"]["seq"]),
                         ("trail lost", 1))
        robot.at = None
        for _ in range(2):
            follower.step()
        self.assertEqual((self.robot(3)["last_event"]["event"], self.robot(3)["last_event"]["seq"]),
                         ("pose lost", 2))
        robot.at = (2, 1, 0)
        follower.step()
        self.assertNotEqual(robot.told[-1], (0, 0))
        robot.at = (2, 9, 0)  # off the map
        follower.step()
        self.assertEqual(robot.told[-1], (0, 0))

    def test_it_stands_at_the_end(self):
        robot = Wheels(2, 1, 0)
        self.follower(4, robot, released=True).run(seconds=0.1)
        self.assertNotEqual(robot.told[0], (0, 0))
        self.assertEqual(robot.told[-1], (0, 0))

    def test_a_silent_server_stops_it_within_the_time_of_the_fail_safe(self):
        now = [100.0]
        wheels_at = []

        class SilentLine(Line):
            """Answers HELLO and so many requests; its time passes at once."""
            answers = 3

            def __init__(self):
                super().__init__(-1)
                self.waiting = []

            def send(self, data):
                (body,) = wire.Decoder().feed(data)
                request = wire.parse(body)
                if self.answers == 0:
                    return
                self.answers -= request.name == "SENSE"
                if request.name == "HELLO":
                    self.waiting.append(wire.build(
                        "HELLO_ANSWER", 7, nonce=request.fields["nonce"], protocol_version=1, epoch=1,
                        pose_unit_10um=100, antenna_distance_mm=330, type_mask=2, slot_ms=1,
                        response_window_ms=100, last_opcode=0, last_seq=0))
                elif request.name == "PING":
                    self.waiting.append(wire.build("PING_ANSWER", 7, **request.fields))
                else:
                    self.waiting.append(wire.build("SENSE_ANSWER", 7, type=1, left=4096, right=4096))

            def receive(self, deadline):
                if self.waiting:
                    now[0] += 0.08  # almost too late
                    nonlocal answered_at
                    answered_at = now[0]
                    return self.waiting.pop(0)
                now[0] = max(now[0], deadline)
                return None
        answered_at = 0.0
        robot = Wheels(2, 1, 0)
        told = robot.wheels
        robot.wheels = lambda left, right: (told(left, right), wheels_at.append(now[0]))
        with mock.patch("time.monotonic", lambda: now[0]):
            drive.Follower(SilentLine(), 7, robot, released=True).run(seconds=5)
        stopped = robot.told.index((0, 0))
        self.assertEqual(robot.told[:stopped], [(200, 200)] * 3)
        self.assertLessEqual(wheels_at[stopped], answered_at + 0.5)
        self.assertEqual(set(robot.told[stopped:]), {(0, 0)})

    def test_it_stands_while_it_waits_for_another_server(self):
        robot = Wheels(2, 1, 0)
        told_before = []

        def connect(place):
            told_before.append((place.where[1], robot.told[-1:]))
            here, there = socket.socketpair()
            self.addCleanup(there.close)
            return here.detach()
        for kind, expected in ("tcp", [(0, 0)]), ("udp", [(200, 200)]):
            with self.subTest(kind), mock.patch.object(servers, "connect", connect), \
                    open_line(f"{kind}:127.0.0.1:1,{kind}:127.0.0.1:2") as line:
                drive.Follower(line, 7, robot)
                robot.wheels(200, 200)
                told_before.clear()
                with mock.patch("socket.getaddrinfo", side_effect=AssertionError("a name is looked up")):
                    line.go_on()
                self.assertEqual(told_before[0], (2, expected))

    def test_a_server_whose_name_is_not_known_is_not_there(self):
        look_up = socket.getaddrinfo

        def known(host, *rest, **options):
            if host == "nobody":
                raise socket.gaierror
            return look_up(host, *rest, **options)
        with mock.patch("socket.getaddrinfo", known):
            with open_line(f"udp:nobody:1,{self.address}") as line:
                self.assertEqual(Client(line, 6, timeout=60).ping(b"!"), b"!")
            with self.assertRaisesRegex(ConnectionError, "none of the servers is there"):
                open_line("udp:nobody:1")

    def test_a_serial_port_has_a_rate(self):
        with open_line(str(self.folder / "radio-a.pty"), baud=19200) as line:
            self.assertEqual(termios.tcgetattr(line.fd)[4:6], [termios.B19200] * 2)
            self.assertEqual(Client(line, 5, timeout=60).ping(b"!"), b"!")
        with self.assertRaisesRegex(ValueError, "12345 baud"):
            open_line(str(self.folder / "radio-a.pty"), baud=12345)


class AsyncTest(unittest.IsolatedAsyncioTestCase):
    @classmethod
    def setUpClass(cls):
        DriveTest.setUpClass.__func__(cls)

    async def test_robots_ask_side_by_side_and_are_watched(self):
        server = aio.AsyncServer(str(self.folder / "pheromoned.sock"))

        async def ask(number):
            async with aio.AsyncClient(open_line(self.address), number, timeout=60) as robot:
                self.assertEqual((await robot.hello(nonce=number)).nonce, number)
                return await asyncio.gather(*(robot.sense(1, x, 1050, 0) for x in range(1000, 3000, 500)))
        answers = await asyncio.gather(*map(ask, range(11, 15)))
        sensed = [await server.sense("path", x / 1000, 1.05) for x in range(1000, 3000, 500)]
        self.assertEqual(answers, [[(left * 4096, right * 4096) for left, right in sensed]] * 4)

        async def first():
            async for message in server.watch("/clients"):
                return {it["id"] for it in message.value["clients"]}
        self.assertLessEqual({11, 12, 13, 14}, await first())
        self.assertEqual((await server.robots_as_array())["x_m"].max(), 2.5)

    async def test_who_is_cancelled_disturbs_nobody(self):
        server = aio.AsyncServer(str(self.folder / "pheromoned.sock"))

        async def forever():
            async for _ in server.watch("/nothing"):
                pass
        watching = asyncio.create_task(forever())
        async with aio.AsyncClient(open_line(self.address), 20, timeout=60) as robot:
            asking = asyncio.create_task(robot.listen(0.2))
            await asyncio.sleep(0)
            asking.cancel()
            self.assertEqual(await robot.ping(b"after"), b"after")
        watching.cancel()
        with self.assertRaises(asyncio.CancelledError):
            await watching


class ArraysTest(unittest.TestCase):
    NET = table("[net]", name="bench", file="nets/pheromone.toml", robot_file="nets/robot.toml",
                parameters={"robots": 2}) + "".join(
        table("[tag]", name=name, x_m=1, y_m=1)
        for name in "N1 N2 N3 N4 N5 N6 S1 S2 S3 S4 P Src".split())

    @classmethod
    def setUpClass(cls):
        serve_class(cls, BIN, ROOM + UDP + WEB + cls.NET, lambda folder: shutil.copytree(
            ROOT / "deploy/examples/nets", folder / "nets"))
        cls.server = pheromone.Server(str(cls.folder / "pheromoned.sock"))

    def test_views_are_arrays(self):
        with open_line(f"udp:127.0.0.1:{self.daemon.udp_port()}") as line:
            robot = Client(line, 7, timeout=60)
            robot.hello(nonce=1)
            robot.sense(1, 1500, 500, 16384)
            robot = Client(line, 8, timeout=60)
            robot.hello(nonce=1)
        robots = self.server.robots_as_array()
        self.assertEqual([it[:2] for it in robots.tolist()], [("udp", 7), ("udp", 8)])
        self.assertEqual((robots["x_m"][0], robots["y_m"][0], robots["heading_deg"][0]), (1.5, 0.5, 90))
        self.assertTrue(math.isnan(robots["x_m"][1]))
        tags = self.server.tags_as_array()
        self.assertEqual(len(tags), 13)
        self.assertEqual(tags[tags["name"] == "door"][["x_m", "y_m", "used"]].tolist(), [(1.0, 1.0, 0)])
        (net,) = self.server.nets_as_array()
        self.assertEqual((net["name"], net["robots"], net["a"]), ("bench", 0, 0))
        with without_numpy():
            self.assertEqual(self.server.robots_as_array()[0].x_m, 1.5)
            self.assertEqual(self.server.nets_as_array()[0].name, "bench")


class ExamplesTest(unittest.TestCase):
    """With the default configuration."""

    @classmethod
    def setUpClass(cls):
        config = default_config(BIN).replace('"web-token"', '"token"')
        serve_class(cls, BIN, config + UDP)
        cls.address = f"udp:127.0.0.1:{cls.daemon.udp_port()}"
        cls.web = f"http://127.0.0.1:{cls.daemon.web_port()}"
        cls.server = pheromone.Server(cls.web, token=TOKEN)
        cls.environment = {**os.environ, "PYTHONPATH": str(HERE), "PYTHONDONTWRITEBYTECODE": "1"}

    def begin(self, *command):
        process = subprocess.Popen(command, cwd=self.folder, env=self.environment, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def test_your_own_robot_in_fifty_lines_follows_the_path_until_it_is_halted(self):
        example = HERE / "examples/my_robot.py"
        self.assertLessEqual(len(example.read_text().splitlines()), 50)
        robot = self.begin(sys.executable, example, self.address, "--start", "5", "3.1", "0")

        def seen():
            return next((it for it in self.server.clients() if it["id"] == 7), {"pose": None})

        def pose():
            return seen()["pose"]
        await_that(lambda: (pose() or {"x_m": 0})["x_m"] > 5.5, "it has driven half a metre")
        at = pose()
        path = self.server.map_as_array("path", nodes_per_cell=1)
        nearest = min(math.hypot(x - at["x_m"], y - at["y_m"]) for row in range(path.rows)
                      for column in range(path.columns) if path.values[row][column] > 0
                      for x, y in [path.place(row, column)])
        self.assertLess(nearest, 0.15)
        self.server.halt()
        asked = seen()["requests"]
        # The next request may have left before the halt came; the one behind it has the last place.
        await_that(lambda: seen()["requests"] >= asked + 2, "it has asked again")
        self.assertEqual(seen()["state"]["is"], "halted")
        here = pose()
        robot.send_signal(signal.SIGINT)
        robot.wait()
        self.assertEqual((pose()["x_m"], pose()["y_m"]), (here["x_m"], here["y_m"]))
        done = run(sys.executable, example, self.address, "--seconds", "0.5", cwd=self.folder,
                   env=self.environment)
        self.assertRegex(done, r"stands at x 5\.\d\d m")

    def test_ants_leave_a_trail_that_a_recording_has(self):
        self.server.start_capture()
        text = run(sys.executable, HERE / "examples/ants.py", self.address, "--server", self.web,
                   "--robots", "3", "--steps", "5", cwd=self.folder, env=self.environment)
        self.server.stop_capture()
        self.assertRegex(text, r"<Map of trail: \d+ x \d+ cells of 0\.1 m> and the highest level is [01]\.")
        name = self.server.captures()[-1]["name"]
        self.server.download_capture(name, self.folder / "ants.pcapng")
        self.assertEqual(len(Recording(self.folder / "ants.pcapng").deposited()), 15)
        text = run(sys.executable, HERE / "examples/recording.py", self.folder / "ants.pcapng",
                   env=self.environment)
        self.assertEqual([it.split()[:3] for it in text.splitlines()[1:]],
                         [["udp", str(number), "5"] for number in (1, 2, 3)])

    def test_mqtt_in_fifty_lines(self):
        example = HERE / "examples/mqtt.py"
        self.assertLessEqual(len(example.read_text().splitlines()), 50)
        port, phone, heard = self.broker()
        bridge = self.begin(sys.executable, example, "--server", self.web, "--token-file", "token",
                            "--port", str(port))
        self.assertEqual(bridge.stdout.readline(), "begun\n")
        with open_line(self.address) as line:
            Client(line, 30, timeout=60).sense(1, 2500, 1500, 16384)
        topic = "pheromone/robots/udp/30"

        def told():
            return json.loads(heard.get(topic, "{}")).get("x_m") == 2.5
        await_that(told, "the pose by MQTT")
        self.assertEqual(json.loads(heard[topic])["heading_deg"], 90)
        deposit = json.dumps({"pheromone": "path", "x_m": 9, "y_m": 9, "quanta": 4})
        # A broker forgets what comes before somebody subscribes: it is sent until it has arrived.
        await_that(lambda: phone.publish("pheromone/deposit", deposit)
                   and self.server.map_as_array("path").at(9, 9) > 0, "the deposit")
        phone.publish("pheromone/deposit", '{"pheromone": "honey", "x_m": 1, "y_m": 1}')
        await_that(lambda: "pheromone/refused" in heard, "the refusal")
        self.assertIn(b"honey", heard["pheromone/refused"])
        heard.clear()
        phone.publish("pheromone/deposit", "[" * 100000)  # Python's parser raises RecursionError
        await_that(lambda: "pheromone/refused" in heard, "another refusal")
        _, since = self.server.events()
        await_that(lambda: phone.publish("pheromone/halt", "")
                   and any("halt" in json.dumps(it) for it in self.server.events(since)[0]), "the halt")
        again = json.dumps({"pheromone": "path", "x_m": 9.5, "y_m": 9, "quanta": 4})
        await_that(lambda: phone.publish("pheromone/deposit", again)
                   and self.server.map_as_array("path").at(9.5, 9) > 0, "deposits go on")
        self.assertIsNone(bridge.poll())

    def test_mqtt_outlives_its_server_and_a_halt_waits_for_no_deposit(self):
        port, phone, _ = self.broker()
        deposit = '{"pheromone": "path", "x_m": 9, "y_m": 9}'
        for topic, payload in ("deposit", deposit), ("halt", "now"):  # kept for who subscribes
            phone.publish(f"pheromone/{topic}", payload, qos=1, retain=True).wait_for_publish()
        asked = {b"/": 0}
        with socket.create_server(("127.0.0.1", 0)) as server:
            server.settimeout(60)
            self.begin(sys.executable, HERE / "examples/mqtt.py", "--port", str(port),
                       "--server", f"http://127.0.0.1:{server.getsockname()[1]}")
            while asked[b"/"] < 2 or not {b"/api/v1/halt", b"/api/v1/deposit"} <= asked.keys():
                connection, _ = server.accept()
                target = connection.recv(1000).split()[1]
                if target == b"/":
                    asked[target] += 1
                    connection.close()
                else:
                    self.addCleanup(connection.close)
                    asked[target] = connection
        for target in (b"/api/v1/deposit", b"/api/v1/halt"):
            asked[target].setblocking(False)
            with self.assertRaises(BlockingIOError):  # both still wait: neither came after the other
                while asked[target].recv(1000):
                    pass

    def broker(self):
        """The port of an MQTT broker, a client of it, and what that hears: the last by topic."""
        port = free_port()
        broker = self.begin("/usr/sbin/mosquitto", "-p", str(port))
        heard = {}
        phone = mqtt.Client()
        phone.on_message = lambda *it: heard.update({it[2].topic: it[2].payload})
        phone.on_connect = lambda *_: phone.subscribe("pheromone/#")

        def connects():
            self.assertIsNone(broker.poll())
            with contextlib.suppress(ConnectionRefusedError):
                phone.connect("127.0.0.1", port)
                return True
        await_that(connects, "the broker is up")
        phone.loop_start()
        self.addCleanup(phone.loop_stop)
        return port, phone, heard


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
