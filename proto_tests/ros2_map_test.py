#!/usr/bin/env python3
"""What pheromone-ros2 publishes, as Fast DDS and Wireshark see it: maps, markers, diagnostics, frames,
the graph, type hashes; and what it takes: deposits, paths, goals, poses.

Usage: ros2_map_test.py BIN_DIR TESTS_DIR
"""

import contextlib
import json
import math
import pathlib
import shutil
import signal
import socket
import socketserver
import subprocess
import sys
import tempfile
import threading
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "client_fw" / "ros2" / "testing"))

from free_numbers import free_domain, free_port  # noqa: E402
from operated_daemon import OperatedDaemon, await_that, write_config  # noqa: E402
from peer import TYPES, Base, Bases, Peer, dds_type  # noqa: E402
from ros2_live_test import Bridge  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402


def config(udp_port, tracker_port):
    return (map_of(4.0, 3.0, bias_m=0.2)
            + table("obstacles", walls=[{"points_m": [[3.5, 2.5], [3.5, 2.9]], "thickness_m": 0.1}])
            + pheromone(1, "path", sigma_m=0.3) + pheromone(2, "no-go area", sigma_m=0.3)
            + table("[tag]", name="door", x_m=1.0, y_m=1.0)
            + link("udp", "udp", listen=f"127.0.0.1:{udp_port}")
            + table("[tracker]", name="camera", listen=f"127.0.0.1:{tracker_port}"))


def level(grid, x_m, y_m):
    """Of the cell around a point of the map."""
    info = grid["info"]
    column = math.floor((x_m - info["origin"]["position"]["x"]) / info["resolution"])
    row = math.floor((y_m - info["origin"]["position"]["y"]) / info["resolution"])
    return grid["data"][row * info["width"] + column]


MAP, NO_GO, WALLS = "rt/pheromone/path", "rt/pheromone/no_go_area", "rt/pheromone/obstacles"
GRID = "nav_msgs/msg/OccupancyGrid"
HALT = "rt/pheromone/halt"


class MapTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.domain = free_domain()
        cls.udp, cls.camera = free_port(), free_port()
        write_config(cls.folder, config(cls.udp, cls.camera))
        cls.daemon = OperatedDaemon(cls.bin_dir, cls.folder)
        cls.addClassCleanup(cls.daemon.kill)
        cls.capture = cls.start_capture()
        cls.peer = Peer(cls.tests_dir, cls.domain)
        cls.addClassCleanup(cls.peer.close)
        for topic in (MAP, WALLS):
            cls.peer.read(topic, GRID, latched=True)
        cls.peer.read("rt/pheromone/markers", "visualization_msgs/msg/MarkerArray")
        cls.peer.read("rt/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
        cls.peer.read("rt/tf", "tf2_msgs/msg/TFMessage")
        cls.peer.read("ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo", latched=True)
        cls.peer.make("rt/pheromone/path/deposit", "geometry_msgs/msg/PointStamped")
        cls.peer.make("rt/pheromone/path/paint", "nav_msgs/msg/Path")
        cls.peer.make(HALT, "std_msgs/msg/Empty")
        cls.peer.make("rt/tb1/goal_pose", "geometry_msgs/msg/PoseStamped")
        cls.base = Base(cls.peer, "tb1", (1.0, 2.0, 90.0), stamped=True)
        cls.bases = Bases([cls.base])
        cls.addClassCleanup(cls.bases.stop)
        cls.bridge = Bridge(cls.bin_dir, cls.folder, cls.domain, "--socket",
                            cls.folder / "pheromoned.sock", "--server", f"udp:127.0.0.1:{cls.udp}",
                            "--robot", "tb1:7:1,2,90", "--link", "udp", "--stamped", "--distro", "iron",
                            *(word for it in ("halt", "goal", "deposit", "paint")
                              for word in ("--allow", it)))
        cls.addClassCleanup(lambda: (cls.bridge.process.kill(), cls.bridge.process.wait()))
        await_that(lambda: cls.bridge.log() and cls.peer.last(MAP) and cls.peer.last(WALLS)
                   and cls.client(), "maps come, and the robot is answered")

    @classmethod
    def start_capture(cls):
        """Wireshark's dumpcap on the loopback interface, where that is permitted."""
        file = cls.folder / "rtps.pcapng"
        first = 7400 + 250 * cls.domain
        if shutil.which("dumpcap") is None:
            return None
        capture = subprocess.Popen(["dumpcap", "-q", "-i", "lo", "-f",
                                    f"udp portrange {first}-{first + 249}", "-w", file],
                                   stderr=subprocess.PIPE, text=True)
        cls.addClassCleanup(lambda: (capture.kill(), capture.wait(), capture.stderr.close()))
        # It says where it writes once it captures.
        for line in capture.stderr:
            if line.startswith("File:"):
                return capture, file
        return None

    @classmethod
    def client(cls):
        clients = json.loads(cls.daemon.call("GET", "/api/v1/clients")[1])["clients"]
        return next((it for it in clients if it["id"] == 7 and it["pose"]), None)

    def test_obstacles_are_a_map_and_the_lower_row_comes_first(self):
        walls = self.peer.last(WALLS)
        self.assertEqual(walls["header"]["frame_id"], "map")
        self.assertEqual(level(walls, 3.5, 2.7), 100)
        self.assertEqual(level(walls, 3.5, 0.3), 0)
        self.assertEqual(set(walls["data"]), {0, 100})
        self.assertEqual(walls["info"]["origin"]["orientation"]["w"], 1)
        # What has not changed is not published again, in a second and more.
        told = self.peer.count("rt/diagnostics")
        await_that(lambda: self.peer.count("rt/diagnostics") > told + 1, "time passes")
        self.assertEqual(self.peer.count(WALLS), 1)

    def test_what_is_painted_and_deposited_by_topic_is_published(self):
        def drawn(x_m, y_m):
            await_that(lambda: level(self.peer.last(MAP), x_m, y_m) > 0, f"({x_m}, {y_m}) is drawn")
            return level(self.peer.last(MAP), x_m, y_m)

        self.assertEqual(level(self.peer.last(MAP), 2.0, 0.5), 0)
        self.peer.write("rt/pheromone/path/deposit", {
            "header": {"frame_id": "elsewhere"}, "point": {"x": 3.0, "y": 2.0}})
        self.peer.write("rt/pheromone/path/deposit", {
            "header": {"frame_id": "map"}, "point": {"x": 2.0, "y": 0.5}})
        self.assertEqual(drawn(2.0, 0.5), round(0.125 * 98))  # one quantum of a maximum of 1
        self.peer.write("rt/pheromone/path/paint", {"header": {"frame_id": "/map"}, "poses": [
            {"pose": {"position": {"x": x, "y": 1.5}}} for x in (0.5, 1.5)]})
        self.assertEqual(drawn(1.0, 1.5), 98)
        grid = self.peer.last(MAP)
        self.assertEqual((level(grid, 3.0, 2.0), level(grid, 1.0, 0.5)), (0, 0))
        self.assertIn('deposit: frame "elsewhere", expected "map"', self.bridge.log())
        # Each cell is what the server has, rows upside down; unknown where the wall is.
        raster = json.loads(self.daemon.call("GET", "/api/v1/field?pheromone=path")[1])
        self.assertEqual(grid["data"], [-1 if value is None else value and max(1, round(value * 98))
                                        for row in reversed(raster["values"]) for value in row])
        self.assertEqual(level(grid, 3.5, 2.7), -1)
        self.assertEqual([grid["info"]["origin"]["position"][it] for it in "xy"], raster["origin_m"])

    def test_late_reader_gets_the_last_map_and_a_stopped_one_holds_nobody_up(self):
        late = Peer(self.tests_dir, self.domain)
        late.read(NO_GO, GRID, latched=True)
        await_that(lambda: late.last(NO_GO), "a late reader gets the map")
        late.process.send_signal(signal.SIGSTOP)
        try:
            before = self.peer.count("rt/diagnostics")
            for x in (0.5, 1.0, 1.5):
                self.daemon.call("POST", "/api/v1/deposit", {"pheromone": "no-go area", "x_m": x,
                                                             "y_m": 2.5})
                sensed = self.client()["requests"]
                await_that(lambda: self.client()["requests"] > sensed + 5, "the robot is answered")
            await_that(lambda: self.peer.count("rt/diagnostics") > before + 1, "states come")
        finally:
            late.process.send_signal(signal.SIGCONT)
        await_that(lambda: level(late.last(NO_GO), 1.5, 2.5) > 0, "it has the newest map then")
        late.close()

    def test_markers_are_where_the_robot_and_its_antennas_are(self):
        def shown():
            message = self.peer.last("rt/pheromone/markers") or {"markers": []}
            return {(it["ns"], it["id"]): it for it in message["markers"]}

        await_that(lambda: ("robots", 0) in shown() and abs(
            shown()["robots", 0]["pose"]["position"]["x"] - 1) < 0.01, "the robot is shown")
        markers = shown()
        robot, tag = markers["robots", 0], markers["tags", 0]
        self.assertAlmostEqual(robot["pose"]["position"]["y"], 2.0, delta=0.01)
        self.assertAlmostEqual(robot["pose"]["orientation"]["w"], math.cos(math.pi / 4), delta=0.01)
        # bias_m = 0.2, a heading of 90 degrees: 0.1 m to the left is -x.
        left, right = markers["antennas", 0]["points"]
        self.assertAlmostEqual(left["x"], 0.9, delta=0.01)
        self.assertAlmostEqual(right["x"], 1.1, delta=0.01)
        self.assertAlmostEqual(right["y"], 2.0, delta=0.01)
        self.assertEqual((tag["pose"]["position"]["x"], tag["type"]), (1.0, 1))
        self.assertEqual(markers["tag labels", 0]["text"], "door")
        self.assertRegex(markers["labels", 0]["text"], "^udp/7: ")
        self.assertTrue(all(it["lifetime"]["sec"] == 3 and it["header"]["frame_id"] == "map"
                            for it in markers.values()))

    def test_diagnostics_tell_server_links_and_robots(self):
        def states():
            message = self.peer.last("rt/diagnostics")
            return {it["name"]: it for it in message["status"]} if message else {}

        await_that(lambda: states().get("pheromone: tb1", {}).get("message", "").startswith(
            "stands: halted") and "pheromone: robot udp/7" in states(), "states")
        told = states()
        self.assertEqual((told["pheromone: server"]["level"], told["pheromone: server"]["message"]),
                         (0, "answers"))
        self.assertEqual(told["pheromone: link udp"]["level"], 0)
        self.assertEqual(told["pheromone: tb1"]["level"], 1)
        self.assertEqual({it["key"]: it["value"] for it in told["pheromone: tb1"]["values"]}["id"], "7")

    def test_frames_are_published_while_a_tracker_sees_the_robot(self):
        self.assertIsNone(self.peer.last("rt/tf"))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as camera:
            def seen():
                camera.sendto(b"pose udp 7 1.5 1.25 180\n", ("127.0.0.1", self.camera))
                return self.peer.last("rt/tf")

            await_that(seen, "map -> tb1/odom")
        frame = self.peer.last("rt/tf")["transforms"][0]
        self.assertEqual((frame["header"]["frame_id"], frame["child_frame_id"]), ("map", "tb1/odom"))
        # The base stands at (10, -20) in its odometry, turned by 1 rad; the camera sees it at
        # (1.5, 1.25), turned by pi: so the frame is turned by pi - 1.
        turn = math.pi - 1
        at, q = frame["transform"]["translation"], frame["transform"]["rotation"]
        self.assertAlmostEqual(2 * math.atan2(q["z"], q["w"]), turn, delta=1e-3)
        self.assertAlmostEqual(at["x"], 1.5 - (10 * math.cos(turn) + 20 * math.sin(turn)), delta=0.01)
        self.assertAlmostEqual(at["y"], 1.25 - (10 * math.sin(turn) - 20 * math.cos(turn)), delta=0.01)

    def test_robot_goes_to_its_goal_which_is_the_servers(self):
        self.peer.write("rt/tb1/goal_pose", {"header": {"frame_id": "map"}, "pose": {
            "position": {"x": 1.0, "y": 2.6}}})
        await_that(lambda: self.client()["goal"], "the server has the goal")
        self.assertEqual([self.client()["goal"][it] for it in ("x_m", "y_m")], [1.0, 2.6])
        self.daemon.call("POST", "/api/v1/command", {"link": "udp", "id": 7, "command": "resume"})
        await_that(lambda: self.client()["state"]["is"] == "at its goal", "the robot is there")
        x, y = self.base.track[-1]
        self.assertLess(math.hypot(x - 1.0, y - 2.6), 0.25)
        self.assertIn("tb1: goal: done", self.bridge.log())
        self.peer.write(HALT, {})
        await_that(lambda: "halted" in self.bridge.state("tb1"), "it is halted")
        await_that(lambda: "halt: done" in self.bridge.log(), "the server was told to halt all")

    def test_endpoints_have_ros_names_types_qos_and_hashes(self):
        # kind, topic: type, reliability, durability
        expected = {
            ("writer", MAP): (GRID, "reliable", "latched"),
            ("writer", NO_GO): (GRID, "reliable", "latched"),
            ("writer", WALLS): (GRID, "reliable", "latched"),
            ("writer", "rt/pheromone/markers"):
                ("visualization_msgs/msg/MarkerArray", "reliable", "volatile"),
            ("writer", "rt/diagnostics"): ("diagnostic_msgs/msg/DiagnosticArray", "reliable", "volatile"),
            ("writer", "rt/tf"): ("tf2_msgs/msg/TFMessage", "reliable", "volatile"),
            ("writer", "rt/tb1/cmd_vel"): ("geometry_msgs/msg/TwistStamped", "reliable", "volatile"),
            ("writer", "rt/tb1/pheromone/sensed"):
                ("std_msgs/msg/Float32MultiArray", "reliable", "volatile"),
            ("reader", "rt/tb1/odom"): ("nav_msgs/msg/Odometry", "best", "volatile"),
            ("reader", "rt/tb1/goal_pose"): ("geometry_msgs/msg/PoseStamped", "reliable", "volatile"),
            ("reader", HALT): ("std_msgs/msg/Empty", "reliable", "volatile"),
            ("reader", "rt/pheromone/path/deposit"):
                ("geometry_msgs/msg/PointStamped", "reliable", "volatile"),
            ("reader", "rt/pheromone/path/paint"): ("nav_msgs/msg/Path", "reliable", "volatile"),
            ("reader", "rt/pheromone/no_go_area/deposit"):
                ("geometry_msgs/msg/PointStamped", "reliable", "volatile"),
            ("reader", "rt/pheromone/no_go_area/paint"): ("nav_msgs/msg/Path", "reliable", "volatile"),
        }
        graph = ("writer", "ros_discovery_info")
        await_that(lambda: expected.keys() | {graph} <= self.peer.endpoints.keys(), "endpoints")
        found = dict(self.peer.endpoints)
        for where, (kind, reliability, durability) in expected.items():
            self.assertEqual(found[where][0], dds_type(kind), where)
            self.assertEqual(found[where][2:], [reliability, durability, f"typehash={TYPES.hash(kind)};"],
                             where)
        self.assertEqual(set(found), set(expected) | {graph}, "more than is configured")
        self.assertEqual(found[graph][0], dds_type("rmw_dds_common/msg/ParticipantEntitiesInfo"))
        # The graph lists them all, by GIDs of 16 bytes, and not its own.
        self.assertIn("enclave=/;", self.peer.participants.values())
        guids = {kind: {data[1] for (it, topic), data in found.items()
                        if it == kind and topic != "ros_discovery_info"} for kind in ("reader", "writer")}

        def listed():
            info = self.peer.last("ros_discovery_info")
            if info is None:
                return None
            node = info["node_entities_info_seq"][0]
            self.assertEqual((node["node_namespace"], node["node_name"]), ("/", "pheromone"))
            return {kind: {bytes(gid["data"]).hex() for gid in node[f"{kind}_gid_seq"]}
                    for kind in ("reader", "writer")}

        await_that(lambda: listed() == guids, "the graph is complete")

    def test_wireshark_finds_no_malformed_frame(self):
        if self.capture is None:
            self.skipTest("no capture: dumpcap may not capture on this machine")
        capture, file = self.capture
        # What the other tests exchange is captured until here: this one comes after them in the alphabet.
        capture.send_signal(signal.SIGINT)
        capture.wait()
        told = subprocess.run(["tshark", "-r", file, "-Y", "rtps", "-T", "fields", "-e", "_ws.malformed"],
                              capture_output=True, text=True, check=True).stdout
        frames = told.split("\n")[:-1]
        print(f"{len(frames)} RTPS frames")
        self.assertGreater(len(frames), 500)
        self.assertEqual([line for line in frames if line], [])

    def test_without_a_server_diagnostics_say_so(self):
        self.daemon.kill()

        def server():
            states = self.peer.last("rt/diagnostics")["status"]
            return next(it for it in states if it["name"] == "pheromone: server")

        # What it was asked when it was killed had no answer; the next question meets nobody.
        await_that(lambda: server()["level"] == 2 and "no server at" in server()["message"],
                   "an error is told")
        self.assertIn("server: no server at", self.bridge.log())


class DistroTest(unittest.TestCase):
    """A node without maps: how large GIDs are, and what there is of topics."""

    def run_with(self, *options, graph_of):
        """The graph that a node publishes when another one has `graph_of`."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        domain = free_domain()
        peer = Peer(self.tests_dir, domain)
        self.addCleanup(peer.close)
        peer.types["ros_discovery_info"] = graph_of
        peer.command("read", "ros_discovery_info", dds_type("rmw_dds_common/msg/ParticipantEntitiesInfo"),
                     "reliable", "latched")
        peer.command("make", "ros_discovery_info", dds_type("rmw_dds_common/msg/ParticipantEntitiesInfo"),
                     "reliable", "latched")
        bridge = Bridge(self.bin_dir, pathlib.Path(folder.name), domain, "--server",
                        f"udp:127.0.0.1:{free_port()}", "--robot", "tb1:1:0,0,0", *options)
        self.addCleanup(bridge.stop)
        await_that(lambda: bridge.log() and peer.last("ros_discovery_info"), "a graph")
        found = peer.last("ros_discovery_info")
        self.assertEqual(found["node_entities_info_seq"][0]["node_name"], "pheromone")
        return peer

    def test_beside_a_node_without_type_hash_gids_have_24_bytes(self):
        peer = self.run_with(graph_of="rmw_dds_common_humble/msg/ParticipantEntitiesInfo")
        self.assertEqual(peer.endpoints["writer", "ros_discovery_info"][2:], ["reliable", "latched", ""])
        # Without --allow there is no input but odometry.
        self.assertEqual({topic for kind, topic in peer.endpoints if kind == "reader"}, {"rt/tb1/odom"})

    def test_beside_a_node_with_type_hash_gids_have_16_bytes(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        domain = free_domain()
        peer = Peer(self.tests_dir, domain)
        self.addCleanup(peer.close)
        gids = set()
        peer.read("ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo", latched=True,
                  watch=lambda info: gids.add(bytes(info["gid"]["data"])))
        for distro in ("iron", "auto"):
            below = pathlib.Path(folder.name) / distro
            below.mkdir()
            bridge = Bridge(self.bin_dir, below, domain, "--server", f"udp:127.0.0.1:{free_port()}",
                            "--robot", f"{distro}:1:0,0,0", "--distro", distro)
            self.addCleanup(bridge.stop)
        await_that(lambda: len(gids) == 2, "both have a graph")

    def test_distro_can_be_set(self):
        self.run_with("--distro", "humble", graph_of="rmw_dds_common_humble/msg/ParticipantEntitiesInfo")


class PoseTest(unittest.TestCase):
    """A robot whose pose on the map somebody else finds."""

    def placed(self, source, topic, kind, message, early=False):
        """Where the server has it, while this message is published, or after it was published before
        there was odometry. Its odometry is (10, -20), turned by 1 rad."""
        self.doCleanups()  # of the last one
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        folder = pathlib.Path(folder.name)
        udp = free_port()
        write_config(folder, config(udp, free_port()))
        daemon = OperatedDaemon(self.bin_dir, folder)
        self.addCleanup(daemon.kill)
        domain = free_domain()
        peer = Peer(self.tests_dir, domain)
        self.addCleanup(peer.close)
        base = Base(peer, "tb1", (0, 0, 0))
        base.odometry_on = not early
        bases = Bases([base])
        self.addCleanup(bases.stop)
        bridge = Bridge(self.bin_dir, folder, domain, "--server", f"udp:127.0.0.1:{udp}", "--robot",
                        "tb1:7", "--pose", source, "--allow", "halt")
        self.addCleanup(bridge.stop)
        if not early:
            await_that(lambda: "no pose on the map" in bridge.state("tb1"), "odometry is there")
        peer.make(topic, kind, latched=True)
        if early:
            peer.make(HALT, "std_msgs/msg/Empty")
            await_that(lambda: peer.write(topic, message) or peer.write(HALT, {})
                       or bridge.log().count("halt, by") > 5, "it hears others")
            self.assertIn("no odometry yet", bridge.state("tb1"))
            base.odometry_on = True

        def pose():
            if not early:
                peer.write(topic, message)
            clients = json.loads(daemon.call("GET", "/api/v1/clients")[1])["clients"]
            return clients[0]["pose"] if clients else None

        await_that(pose, "the server has a pose")
        return pose()

    def test_by_tf(self):
        rotation = {"z": math.sin(-0.5), "w": math.cos(-0.5)}  # -1 rad
        at = {"x": 1 - (10 * math.cos(1) - 20 * math.sin(1)),
              "y": 2 - (-10 * math.sin(1) - 20 * math.cos(1))}
        for topic, early in (("rt/tf", False), ("rt/tf_static", False), ("rt/tf_static", True)):
            pose = self.placed("tf", topic, "tf2_msgs/msg/TFMessage", {"transforms": [
                {"header": {"frame_id": "map"}, "child_frame_id": "tb1/odom",
                 "transform": {"translation": at, "rotation": rotation}},
                {"header": {"frame_id": "map"}, "child_frame_id": "tb2/odom",
                 "transform": {"rotation": {"w": 1}}}]}, early)
            self.assertAlmostEqual(pose["x_m"], 1, delta=0.002)
            self.assertAlmostEqual(pose["y_m"], 2, delta=0.002)
            self.assertAlmostEqual(pose["heading_deg"] % 360 % 359.9, 0, delta=0.1)

    def test_by_amcl(self):
        for early in (False, True):
            pose = self.placed("amcl", "rt/tb1/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", {
                "header": {"frame_id": "map"}, "pose": {"pose": {
                    "position": {"x": 1.25, "y": 0.5},
                    "orientation": {"z": math.sin(0.25), "w": math.cos(0.25)}}}}, early)
            self.assertAlmostEqual(pose["x_m"], 1.25, delta=0.002)
            self.assertAlmostEqual(pose["y_m"], 0.5, delta=0.002)
            self.assertAlmostEqual(pose["heading_deg"], math.degrees(0.5), delta=0.1)


class HeldServer(socketserver.ThreadingMixIn, socketserver.UnixStreamServer):
    """Answers no question before it is released, but every order: each connection has its thread."""

    daemon_threads = True

    class Handler(socketserver.StreamRequestHandler):
        def handle(self):
            request = self.rfile.readline().decode().split()[:2]
            self.server.requests.append(request)
            if request[0] == "GET":
                self.server.release.wait()
            with contextlib.suppress(OSError):  # it waited long enough
                self.wfile.write(b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 2\r\n"
                                 b"Connection: close\r\n\r\n{}")

    def __init__(self, path):
        self.requests = []
        self.release = threading.Event()
        super().__init__(str(path), self.Handler)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def close(self):
        self.release.set()
        self.shutdown()
        self.server_close()


class ServerTest(unittest.TestCase):
    """What a bridge without robots does when its server changes."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.domain = free_domain()
        self.peer = Peer(self.tests_dir, self.domain)
        self.addCleanup(self.peer.close)

    def begin_bridge(self, *options):
        bridge = Bridge(self.bin_dir, self.folder, self.domain, "--socket",
                        self.folder / "pheromoned.sock", *options)
        self.addCleanup(lambda: (bridge.process.kill(), bridge.process.wait()))
        return bridge

    def test_maps_are_those_of_the_servers_pheromones(self):
        def begin_server(replaced):
            write_config(self.folder, config(free_port(), free_port()).replace("no-go area", replaced))
            daemon = OperatedDaemon(self.bin_dir, self.folder)
            self.addCleanup(daemon.kill)
            return daemon

        def has(topic):
            """Its GUID, by the node's graph: this Fast DDS does not notice that a writer of Cyclone DDS
            ended."""
            found = self.peer.endpoints.get(("writer", topic))
            graph = self.peer.last("ros_discovery_info")
            return found and graph and found[1] in (
                bytes(gid["data"]).hex() for gid in graph["node_entities_info_seq"][0]["writer_gid_seq"]
            ) and found[1]

        daemon = begin_server("no-go area")
        self.peer.read(MAP, GRID, latched=True)
        self.peer.read("ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo", latched=True)
        bridge = self.begin_bridge("--distro", "iron")
        await_that(lambda: bridge.log() and self.peer.last(MAP) and has(NO_GO), "maps come")
        daemon.kill()
        daemon = begin_server("way home")
        await_that(lambda: bridge.log() and has("rt/pheromone/way_home") and not has(NO_GO),
                   "maps are those of the new server")
        # Another pheromone with the same part of a topic gets what the last one had.
        before = has("rt/pheromone/way_home")
        daemon.kill()
        daemon = begin_server("way-home")
        await_that(lambda: bridge.log() and has("rt/pheromone/way_home") not in (False, None, before),
                   "the topic is free for the next")
        self.assertNotIn(("writer", "rt/pheromone/way_home_2"), self.peer.endpoints)
        daemon.call("POST", "/api/v1/deposit", {"pheromone": "path", "x_m": 2.0, "y_m": 0.5})
        await_that(lambda: level(self.peer.last(MAP), 2.0, 0.5) > 0, "the others go on")

    def test_a_halt_that_waits_at_the_end_reaches_the_server(self):
        server = HeldServer(self.folder / "pheromoned.sock")
        self.addCleanup(server.close)
        self.peer.make(HALT, "std_msgs/msg/Empty")
        bridge = self.begin_bridge("--allow", "halt")
        await_that(lambda: server.requests, "the server is asked")
        await_that(lambda: self.peer.write(HALT, {}) or "halt, by" in bridge.log(), "it hears the halt")
        bridge.process.send_signal(signal.SIGTERM)
        await_that(lambda: "ended;" in bridge.file.read_text(), "it ends")
        server.release.set()
        self.assertEqual(bridge.process.wait(60), 0)
        self.assertEqual([it for it in server.requests if it[0] == "POST"], [["POST", "/api/v1/halt"]])


def main():
    for case in (MapTest, DistroTest, PoseTest, ServerTest):
        case.bin_dir, case.tests_dir = (pathlib.Path(it).resolve() for it in sys.argv[1:3])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])


if __name__ == "__main__":
    main()
