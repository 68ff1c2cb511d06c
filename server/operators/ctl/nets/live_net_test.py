#!/usr/bin/env python3
"""The two-trail bench, executed by the server: robots that were written from protocol/README.md
alone make trips, the server is killed on the way, its journal is replayed by a program that knows
nothing but the rule of firing; and what pheromonectl net tells of it.

    live_net_test.py BIN_DIR
"""

import json
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[4]
sys.path[:0] = [str(ROOT / "server/daemon"), str(ROOT / "proto_tests")]
import running_daemon  # noqa: E402
from checks import PATIENCE_S, await_that  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402
from stranger.wire import crc16  # noqa: E402

BIN = pathlib.Path()
NAMES = ["N1", "N2", "N3", "N4", "N5", "N6", "S1", "S2", "S3", "S4", "P", "Src"]
TAGS = {name: number for number, name in enumerate(NAMES, 1)}
PLACE = (5000, 5000)  # all tags are there: what is tried here are records, not wheels
NET = """[[net]]
name = "bench"
file = "nets/pheromone.toml"
robot_file = "nets/robot.toml"
parameters = { robots = 2 }
period_ms = 20
law = "e3"
rate = 0.001
source = 100000
[journal]
folder = "state"
"""

# Section 17: records of nets.
TYPE, VERSION, TRIGGER, ENVIRONMENT, ROBOT = -32, 1, 1, 2, 3
PRESENT, PASS, LEAVE, CHOOSE_A, CHOOSE_B, STORE_A, STORE_B, TAKE = range(1, 9)
GREEN, ADVICE_A, ADVICE_B = 1, 2, 4
ACCEPTED, REFUSED = 1, 2
WORDS = ["subject_namespace", "subject", "predicate_namespace", "predicate", "object_namespace",
         "object"]


def encode(net, seq, action, amount=0, version=VERSION):
    checked = struct.pack("<BBIBBBxHH4x", version, ROBOT, net, seq, action, 1, amount, 0)
    record = struct.pack("<i", TYPE) + checked + struct.pack("<H", crc16(checked))
    return dict(zip(WORDS, struct.unpack("<6i", record)))


def decode(block, kind):
    """The hash and the twelve bytes of that kind of record."""
    record = struct.pack("<6i", *(block[word] for word in WORDS))
    found, version, its_kind, net = struct.unpack_from("<iBBI", record)
    assert (found, version, its_kind) == (TYPE, VERSION, kind), record.hex()
    assert crc16(record[4:22]).to_bytes(2, "little") == record[22:], record.hex()
    return net, record[10:22]


class Robot:
    """Goes from tag to tag, as its net says."""

    def __init__(self, test, client_id, line=None):
        self.test = test
        self.client_id = client_id
        self.seq = 0
        self.net = 0
        self.connect(line)

    def connect(self, line=None):
        """On a terminal of its own, or on another robot's."""
        if line is None:
            line = open_terminal(self.test.folder / "radio-a.pty")
            self.test.addCleanup(line.close)
        self.client = Client(line, self.client_id, timeout=30)
        self.client.hello(self.client_id)
        self.number = self.client.register(f"robot {self.client_id}")

    def triggers(self, tag):
        """What a capture of the tag may fire."""
        slot = self.client.read(*PLACE, TAGS[tag])[0]
        self.net, payload = decode(slot, TRIGGER)
        return list(payload[1:1 + payload[0]])

    def signs(self, tag):
        """state, outcome, robot, seq, amount, left."""
        slots = self.client.read(*PLACE, TAGS[tag])
        return struct.unpack("<BBiBxHH", decode(slots[1], ENVIRONMENT)[1])

    def await_signs(self, tag, condition):
        end = time.monotonic() + PATIENCE_S
        while not condition(signs := self.signs(tag)):
            assert time.monotonic() < end, f"at {tag}: {signs}"
        return signs

    def leave_record(self, tag, record):
        self.client.write(*PLACE, TAGS[tag], record, lease_s=3600)

    def await_answer(self, tag):
        return self.await_signs(tag, lambda it: it[2:4] == (self.number, self.seq))

    def say(self, tag, action, amount=0, expected=ACCEPTED):
        """What is granted."""
        self.triggers(tag)
        self.seq = (self.seq + 1) % 256
        self.leave_record(tag, encode(self.net, self.seq, action, amount))
        answer = self.await_answer(tag)
        assert answer[1] == expected, f"at {tag}: {answer}"
        return answer[4]

    def enter(self, tag):
        self.say(tag, PRESENT)
        self.await_signs(tag, lambda it: it[0] & GREEN and it[2] == self.number)
        self.say(tag, PASS)

    def leave_nest(self):
        """The trail that it takes."""
        self.enter("N1")
        advice = self.signs("P")[0]
        trail = "B" if advice & ADVICE_B else "A"
        self.say("P", CHOOSE_B if trail == "B" else CHOOSE_A)
        self.say("N6" if trail == "B" else "N5", LEAVE)
        return trail

    def fetch(self, trail):
        self.enter("S1" if trail == "A" else "S2")
        energy = self.say("Src", TAKE, 50)
        self.say("S3" if trail == "A" else "S4", LEAVE)
        return energy

    def come_back(self, trail, energy):
        self.enter("N2" if trail == "A" else "N3")
        self.say("P", STORE_A if trail == "A" else STORE_B, energy)
        self.say("N4", LEAVE)


class LiveNetTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)
        shutil.copytree(ROOT / "deploy/examples/nets", self.folder / "nets")
        tags = "".join(f'[[tag]]\nname = "{name}"\nx_m = 5\ny_m = 5\n' for name in NAMES)
        (self.folder / "test.toml").write_text(running_daemon.CONFIG + running_daemon.PTY + tags + NET)
        self.start()

    def start(self):
        self.server = running_daemon.Running(self.folder, "--config", "test.toml")
        self.addCleanup(self.server.__exit__)
        self.server.await_log("ready")
        await_that(lambda: self.net()["firings"] or self.has_signs("Src"), "the net goes on")

    def has_signs(self, tag):
        return len(json.loads(self.ctl("tags", "show", tag, "--json"))["blocks"]) >= 2

    def crash(self):
        self.server.process.kill()
        self.server.process.wait()
        self.start()

    def ctl(self, *arguments, status=0):
        result = subprocess.run([BIN / "pheromonectl", *arguments], cwd=self.folder, text=True,
                                capture_output=True, check=False, timeout=PATIENCE_S)
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return result.stdout if status == 0 else result.stderr

    def net(self):
        return json.loads(self.ctl("net", "show", "bench", "--json"))

    def replay(self):
        """Of the stopped server's journal, by the other program."""
        self.ctl("net", "export", "--format", "pnml", "--set", "robots=2", "--output", "net.pnml",
                 "nets/pheromone.toml")
        self.ctl("net", "replay", "state", "--output", "firings.jsonl")
        return self.judge("firings.jsonl")

    def judge(self, firings):
        return subprocess.run(
            [sys.executable, ROOT / "proto_tests/petri/replay_firings.py", "net.pnml", firings],
            cwd=self.folder, text=True, capture_output=True, check=False, timeout=PATIENCE_S)

    def test_robots_make_trips_and_a_crash_on_the_way_loses_nothing(self):
        one = Robot(self, 7)
        self.assertEqual([one.triggers(tag) for tag in ("N1", "P", "Src")],
                         [[1], [2, 8, 15], [5, 12]])
        trail = one.leave_nest()
        energy = one.fetch(trail)
        self.assertEqual((trail, energy), ("A", 50))
        two = Robot(self, 8, one.client.line)
        one.seq += 1  # a record that the server has not read when it is killed
        one.leave_record("N2", encode(one.net, one.seq, PRESENT))
        self.crash()
        one.connect()
        self.assertEqual(one.await_answer("N2")[1], ACCEPTED)
        one.await_signs("N2", lambda it: it[0] & GREEN and it[2] == one.number)
        one.say("N2", PASS)
        one.say("P", STORE_A, energy)
        self.assertEqual(one.signs("P")[0], ADVICE_A)
        one.say("N4", LEAVE)
        two.connect(one.client.line)
        for robot in (two, one, two, one):
            trail = robot.leave_nest()
            self.assertEqual(trail, "A", "it was advised")
            robot.come_back(trail, robot.fetch(trail))
        net = self.net()
        self.assertEqual((net["deposits"], net["exceptions"], net["advice"]), (5, 0, "01"))
        self.assertEqual((net["deposited"], net["taken"], net["source"]), (250, 250, 99_750))
        self.assertLess(249.5, net["A"]["concentration"])
        self.assertLessEqual(net["A"]["concentration"], 250)
        self.assertEqual(net["marking"]["nest"], 2)
        self.assertIn("trail A: 2", self.ctl("net", "show", "bench"))
        self.assertEqual(self.ctl("net", "list").splitlines()[1].split()[:3], ["bench", "e3", "01"])
        self.assertEqual(self.server.stop(), 0)
        judged = self.replay()
        self.assertEqual(judged.returncode, 0, judged.stderr)
        self.assertIn("by 2 robots and the environment: all legal", judged.stdout)
        self.every_change_of_the_firings_is_found()

    def every_change_of_the_firings_is_found(self):
        """The other program is no rubber stamp."""
        lines = (self.folder / "firings.jsonl").read_text().splitlines()
        at = next(i for i, line in enumerate(lines) if "N1.pass" in line)
        for wrong in (lines[:at] + lines[at + 1:], lines[:at] + [lines[at]] + lines[at:],
                      lines[:-1] + [lines[-1].replace('"nest":2', '"nest":1')], lines[1:]):
            (self.folder / "wrong.jsonl").write_text("\n".join(wrong) + "\n")
            self.assertEqual(self.judge("wrong.jsonl").returncode, 1)

    def test_it_goes_on_when_the_state_is_moved_to_another_map(self):
        one = Robot(self, 7)
        trail = one.leave_nest()
        energy = one.fetch(trail)
        before = self.net()
        self.server.stop()
        config = self.folder / "test.toml"
        config.write_text(config.read_text().replace("cell_m = 0.1", "cell_m = 0.05"))
        self.ctl("journal", "resample", "--config", "test.toml", "state")
        self.start()
        after = self.net()
        for name in ("marking", "firings", "records", "taken", "source"):
            self.assertEqual(after[name], before[name])
        one.connect()
        one.come_back(trail, energy)
        self.assertEqual(self.net()["deposits"], 1)

    def test_what_the_net_does_not_permit_is_refused_and_told(self):
        robot = Robot(self, 7)
        robot.say("N5", LEAVE, expected=REFUSED)
        damaged = encode(robot.net, 9, PRESENT)
        damaged["object"] ^= 1 << 16  # of the CRC
        robot.leave_record("N1", damaged)
        await_that(lambda: self.net()["exceptions"] == 2, "two exceptions")
        robot.seq = 10
        robot.leave_record("N1", encode(robot.net ^ 1, robot.seq, PRESENT))
        self.assertEqual(robot.await_answer("N1")[1], REFUSED)
        net = self.net()
        self.assertEqual(net["exceptions"], 3)
        self.assertEqual([(it["tag"], it["why"]) for it in net["last_exceptions"]],
                         [("N5", "the net does not permit it"),
                          ("N1", "a record with a wrong CRC"), ("N1", "a record of another net")])
        self.assertIn("robot 1 (robot 7) at tag N5: leave: the net does not permit it",
                      self.ctl("net", "show", "bench"))
        self.server.await_log('net "bench": refused: robot 1 (robot 7) at tag N1: a record of '
                              'another net')
        robot.leave_nest()
        self.assertIn("fires 2, 8, 15", self.ctl("tags", "show", "P"))
        self.assertIn("accepted", self.ctl("tags", "show", "N5"))
        exported = self.ctl("tags", "export", "--format", "ntriples")
        self.assertEqual(exported, "", "records are no facts")
        self.ctl("net", "reset", "bench")
        await_that(lambda: robot.signs("N5")[1] == 0, "the sign is taken back")
        self.assertEqual(self.net()["marking"]["nest"], 2)
        self.assertIn("there is no net", self.ctl("net", "reset", "get", status=1))
        robot.leave_nest()
        self.assertEqual(self.server.stop(), 0)
        judged = self.replay()
        self.assertEqual(judged.returncode, 0, judged.stderr)

    def test_another_law_goes_on_and_another_net_is_refused(self):
        config = self.folder / "test.toml"
        text = config.read_text()
        robot = Robot(self, 7)
        trail = robot.leave_nest()
        robot.come_back(trail, robot.fetch(trail))
        config.write_text(text.replace('"e3"', '"e1"').replace("rate = 0.001", "rate = 2"))
        self.ctl("reload")
        net = self.net()
        self.assertEqual((net["law"], net["deposits"]), ("e1", 1))
        self.assertLess(45, net["A"]["stored"])
        config.write_text(text.replace("robots = 2", "robots = 3"))
        self.assertIn("give it another name to begin anew", self.ctl("reload", status=1))
        config.write_text(text.replace('name = "Src"', 'name = "source"'))
        self.assertIn('tag "Src" of the net is [[tag]] "Src", which is missing',
                      self.ctl("reload", status=1))
        self.assertEqual(self.net()["law"], "e1")


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    running_daemon.PHEROMONED = BIN / "pheromoned"
    unittest.main()
