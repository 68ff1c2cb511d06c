"""Nodes of other people for tests of pheromone-ros2: Fast DDS (fast_dds_peer), and TurtleBots on it.

    peer = Peer(tests_dir, domain)
    peer.read("rt/pheromone/path", "nav_msgs/msg/OccupancyGrid", latched=True)
    peer.make("rt/pheromone/halt", "std_msgs/msg/Empty")
    peer.write("rt/pheromone/halt", {})
    peer.last("rt/pheromone/path")              # the last message; None: there was none
    peer.close()
"""

import collections
import math
import pathlib
import struct
import subprocess
import threading
import time

from ros_types import Types

IDL = pathlib.Path(__file__).resolve().parents[1] / "messages.idl"
TYPES = Types(IDL)


def dds_type(name):
    package, _, message = name.split("/")
    return f"{package}::msg::dds_::{message}_"


class Peer:
    def __init__(self, tests_dir, domain):
        self.process = subprocess.Popen([tests_dir / "fast_dds_peer", str(domain)],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.lock = threading.Lock()
        self.types = {}
        self.bytes = {}
        self.counts = collections.Counter()
        self.received = collections.defaultdict(list)  # the times
        self.endpoints = {}  # (kind, topic): type, GUID, reliability, durability, user data
        self.participants = {}
        self.watchers = {}
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        for line in self.process.stdout:
            kind, *words = line.rstrip("\n").split(" ")
            if kind == "data":
                data = bytes.fromhex(words[1])
                with self.lock:
                    self.bytes[words[0]] = data
                    self.counts[words[0]] += 1
                    self.received[words[0]].append(time.monotonic())
                if words[0] in self.watchers:
                    self.watchers[words[0]](TYPES.unpack(self.types[words[0]], data))
            elif kind == "participant":
                self.participants[words[0]] = " ".join(words[1:])
            else:
                self.endpoints[kind, words[0]] = words[1:]

    def command(self, *words):
        self.process.stdin.write(" ".join(words) + "\n")
        self.process.stdin.flush()

    def read(self, topic, kind, latched=False, reliable=True, watch=None):
        self.types[topic] = kind
        if watch:
            self.watchers[topic] = watch
        self.command("read", topic, dds_type(kind), "reliable" if reliable else "best",
                     "latched" if latched else "volatile")

    def make(self, topic, kind, latched=False, reliable=True):
        self.types[topic] = kind
        self.command("make", topic, dds_type(kind), "reliable" if reliable else "best",
                     "latched" if latched else "volatile")

    def write(self, topic, message):
        self.write_bytes(topic, TYPES.pack(self.types[topic], message))

    def write_bytes(self, topic, data):
        self.command("write", topic, data.hex())

    def count(self, topic):
        with self.lock:
            return self.counts[topic]

    def last(self, topic):
        with self.lock:
            data = self.bytes.get(topic)
        return None if data is None else TYPES.unpack(self.types[topic], data)

    def close(self):
        self.process.stdin.close()
        self.thread.join()
        self.process.stdout.close()
        self.process.wait()


class Base:
    """A differential base below a namespace: cmd_vel in, odom out at 30 Hz. Its odometry began
    elsewhere than the map."""

    PERIOD_S = 1 / 30
    FASTEST_M_S, FASTEST_RAD_S = 0.22, 2.84  # of a TurtleBot3 Burger
    WATCHED_S = 0.5  # without a command for so long, the base stands

    def __init__(self, peer, name, start, stamped=False):
        self.peer, self.name, self.start = peer, name, start
        self.x, self.y, self.yaw = 0.0, 0.0, 0.0  # in its odometry, from where it began
        self.v = self.w = 0.0
        self.told_s = 0.0
        self.odometry_on = True
        self.way_m = 0.0
        self.track = []  # on the map
        self.cmd, self.odom = f"rt/{name}/cmd_vel", f"rt/{name}/odom"
        peer.read(self.cmd, "geometry_msgs/msg/TwistStamped" if stamped else
                  "geometry_msgs/msg/Twist", watch=self.obey)
        peer.make(self.odom, "nav_msgs/msg/Odometry", reliable=False)
        marks = {"x": 1.25e10, "y": 2.25e10, "z": 3.25e10, "w": 4.25e10}
        whole = TYPES.pack("nav_msgs/msg/Odometry", {
            "header": {"frame_id": f"{name}/odom"}, "child_frame_id": f"{name}/base_footprint",
            "pose": {"pose": {"position": {"x": marks["x"], "y": marks["y"]},
                              "orientation": {"z": marks["z"], "w": marks["w"]}}}})
        self.template = bytearray(whole)
        self.places = [whole.index(struct.pack("<d", mark)) for mark in marks.values()]

    def obey(self, message):
        twist = message.get("twist", message)
        self.v = max(-self.FASTEST_M_S, min(self.FASTEST_M_S, twist["linear"]["x"]))
        self.w = max(-self.FASTEST_RAD_S, min(self.FASTEST_RAD_S, twist["angular"]["z"]))
        self.told_s = time.monotonic()

    def step(self, passed_s):
        if time.monotonic() - self.told_s > self.WATCHED_S:
            self.v = self.w = 0.0
        self.x += self.v * math.cos(self.yaw) * passed_s
        self.y += self.v * math.sin(self.yaw) * passed_s
        self.yaw += self.w * passed_s
        self.way_m += abs(self.v) * passed_s
        x, y, heading = self.start
        angle = math.radians(heading)
        self.track.append((x + self.x * math.cos(angle) - self.y * math.sin(angle),
                           y + self.x * math.sin(angle) + self.y * math.cos(angle)))
        if self.odometry_on:
            # Where the base was switched on is (10, -20), turned by 1 rad.
            values = (10 + self.x * math.cos(1) - self.y * math.sin(1),
                      -20 + self.x * math.sin(1) + self.y * math.cos(1),
                      math.sin((self.yaw + 1) / 2), math.cos((self.yaw + 1) / 2))
            for place, value in zip(self.places, values):
                struct.pack_into("<d", self.template, place, value)
            self.peer.write_bytes(self.odom, bytes(self.template))


class Bases:
    """Steps them all in a thread, in real time."""

    def __init__(self, bases):
        self.bases = bases
        self.ending = threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        before = time.monotonic()
        while not self.ending.wait(Base.PERIOD_S):
            now = time.monotonic()
            for base in self.bases:
                base.step(now - before)
            before = now

    def stop(self):
        self.ending.set()
        self.thread.join()
