#!/usr/bin/env python3
"""Signed links, with the real daemon over UDP and a pseudo-terminal: who is heard, what repeats do.

    signed_links_test.py BIN_DIR

That a frame is ignored is seen from what comes after it: the next frame that is heard answers the
next request.
"""

import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

from operated_daemon import OperatedDaemon, await_that
from signed_robot import COMMAND, DEPOSIT, HELLO, PING, SENSE, SignedRobot, plain
from stranger.client import Line, open_terminal
from test_config import link, map_of, pheromone, pty, table

BIN = pathlib.Path()
LINKS = 3  # that are signed
PLACE = (1, 1000, 500)  # a pheromone, and where in mm
SENSE_THERE = struct.pack("<hhH", 1000, 500, 0)


class SignedLink(unittest.TestCase):
    """Robots 7 and 8 have keys."""

    security = "require"
    link = "udp"

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.ctl("keys", "new", 7, 8, "--file", "robots.keys")
        signed = {"security": self.security, "keys": "robots.keys"}
        (self.folder / "test.toml").write_text(
            map_of(4.0, 3.0) + pheromone(1, "path") + table("journal", folder="state")
            + link("udp", "udp", listen="127.0.0.1:0", **signed)
            + link("tcp", "tcp", listen="127.0.0.1:0", **signed) + pty("pty")
            + "".join(f'{key} = "{value}"\n' for key, value in signed.items()))
        self.start()

    def start(self):
        self.daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(self.daemon.kill)

    def ctl(self, *arguments):
        return subprocess.run([BIN / "pheromonectl", *map(str, arguments)], cwd=self.folder,
                              text=True, capture_output=True, check=True).stdout

    def key_of(self, robot):
        text = (self.folder / "robots.keys").read_text()
        return bytes.fromhex(re.search(rf"(?m)^{robot} (\w+)", text)[1])

    def open(self):
        if self.link == "pty":
            line = open_terminal(self.folder / "pty.pty")
        else:
            kind = socket.SOCK_DGRAM if self.link == "udp" else socket.SOCK_STREAM
            with socket.socket(socket.AF_INET, kind) as peer:
                peer.connect(("127.0.0.1", int(self.state()["address"].rpartition(":")[2])))
                line = Line(os.dup(peer.fileno()))
        self.addCleanup(line.close)
        return line

    def state(self):
        links = json.loads(self.daemon.call("GET", "/api/v1/links")[1])["links"]
        (state,) = [it for it in links if it["name"] == self.link]
        return state

    def counters(self):
        """Of frames that are ignored: unsigned, wrongly signed, of robots without a key."""
        return tuple(self.state()["counters"][name]
                     for name in ("unsigned_frames", "wrong_signatures", "unknown_robots"))


class RequireTest(SignedLink):
    def test_a_robot_with_a_key_is_served(self):
        robot = SignedRobot(self.open(), 7, self.key_of(7))
        robot.hello(nonce=1)
        self.assertEqual(robot.sense(*PLACE), (0, 0))
        robot.deposit(*PLACE)
        once = robot.sense(*PLACE)
        self.assertGreater(once[0], 0)
        robot.deposit(*PLACE)
        self.assertGreater(robot.sense(*PLACE)[0], once[0])
        self.assertEqual(self.counters(), (0, 0, 0))

    def test_more_frames_than_the_low_byte_of_the_counter_counts(self):
        robot = SignedRobot(self.open(), 7, self.key_of(7))
        robot.hello(nonce=1)
        for number in range(600):
            robot.ping(struct.pack("<H", number))
        self.assertEqual(self.counters(), (0, 0, 0))

    def test_unsigned_frames_are_ignored_and_counted(self):
        line = self.open()
        robot = SignedRobot(line, 7, self.key_of(7))
        line.send(plain(7, HELLO, struct.pack("<HBB", 1, 1, 0)))  # before a session
        line.send(plain(7, PING, b"?"))
        line.send(plain(9, HELLO, struct.pack("<HBB", 1, 1, 0)))  # a robot without a key
        robot.hello(nonce=1)
        robot.deposit(*PLACE)
        once = robot.sense(*PLACE)
        line.send(plain(7, PING, b"?"))
        line.send(plain(7, DEPOSIT | 1, struct.pack("<BhhB", robot.sequence + 1, 1000, 500, 1)))
        line.send(plain(7, SENSE | 1, SENSE_THERE))
        self.assertEqual(robot.sense(*PLACE), once)
        # Five bytes or more in a session may be a signature: the tag is wrong then.
        self.assertEqual(self.counters(), (3, 2, 1))

    def test_another_robots_key_does_not_open_a_session(self):
        line = self.open()
        liar = SignedRobot(line, 7, self.key_of(8))
        line.send(liar.first_hello(nonce=1))
        SignedRobot(line, 8, self.key_of(8)).hello(nonce=1)  # nothing comes before its answer
        self.assertEqual(self.counters(), (0, 1, 0))

    def test_a_frame_that_is_changed_is_ignored(self):
        line = self.open()
        robot = SignedRobot(line, 7, self.key_of(7))
        robot.hello(nonce=1)
        frame = robot.sealed(PING, b"abc")
        (body,) = robot.line.decoder.feed(frame)
        for place in range(2, len(body)):
            line.send(plain(7, PING, bytes([*body[2:place], body[place] ^ 1, *body[place + 1:]])))
        line.send(frame)
        self.assertEqual(robot.next_answer(PING | 0x80), b"abc")
        self.assertEqual(self.counters(), (0, len(body) - 2, 0))

    def test_repeated_frames_change_nothing(self):
        line = self.open()
        robot = SignedRobot(line, 7, self.key_of(7))
        robot.hello(nonce=1)
        robot.deposit(*PLACE)
        once = robot.sense(*PLACE)
        before = list(robot.said)
        for frame in before:
            line.send(frame)
        self.assertEqual(robot.sense(*PLACE), once)
        robot.deposit(*PLACE)
        twice = robot.sense(*PLACE)
        self.assertGreater(twice[0], once[0])
        self.assertEqual(self.counters(), (0, len(before), 0))
        # Neither after the robot has begun anew.
        robot.hello(nonce=2)
        before = [it for it in robot.said if it not in before]
        for frame in before[:-2]:
            line.send(frame)
        self.assertEqual(robot.sense(*PLACE), twice)
        robot.deposit(*PLACE)
        self.assertGreater(robot.sense(*PLACE)[0], twice[0])

    def test_a_halt_of_all_is_signed_with_the_groups_key(self):
        line = self.open()
        robots = [SignedRobot(line, it, self.key_of(it)) for it in (7, 8)]
        for robot in robots:
            robot.hello(nonce=1)
        self.assertEqual(robots[0].group, robots[1].group)
        for _ in range(2):
            self.assertEqual(self.daemon.call("POST", "/api/v1/halt", {})[0], 200)
            self.assertEqual(robots[0].next_to_all(COMMAND)[1:], b"\x01")
        self.assertEqual(robots[0].heard_to_all, 2)

    def test_a_key_that_is_revoked_ends_its_session_at_once(self):
        line = self.open()
        seven, eight = (SignedRobot(line, it, self.key_of(it)) for it in (7, 8))
        seven.hello(nonce=1)
        eight.hello(nonce=1)
        self.ctl("keys", "revoke", 8, "--file", "robots.keys")
        self.ctl("keys", "new", 9, "--file", "robots.keys")
        eight.ping(b"not yet")
        self.ctl("reload")
        await_that(lambda: self.daemon.log().count(": keys revoked 8, added 9\n") == LINKS,
                   self.daemon.log)
        group = seven.group
        line.send(eight.sealed(PING, b"?"))
        line.send(seven.sealed(PING, b"?"))  # it knows the group's key as well
        seven.hello(nonce=1)
        self.assertNotEqual(seven.group, group)
        seven.ping(b"again")
        SignedRobot(line, 9, self.key_of(9)).hello(nonce=1)
        self.assertEqual(self.counters(), (1, 0, 1))
        self.assertNotIn(seven.key.hex(), self.daemon.log())
        self.assertIn('"unknown_robots"', self.ctl("links", "--json"))

    def revoke_eight(self):
        self.assertEqual(self.ctl("keys", "revoke", 8),
                         "revoked: robot 8, on pty, tcp, udp; for good, whatever the keys file "
                         "has\n")
        await_that(lambda: self.daemon.log().count(": keys revoked 8\n") == LINKS, self.daemon.log)

    def test_a_key_that_is_revoked_at_the_server_ends_its_session_at_once(self):
        line = self.open()
        seven, eight = (SignedRobot(line, it, self.key_of(it)) for it in (7, 8))
        seven.hello(nonce=1)
        eight.hello(nonce=1)
        group = seven.group
        self.revoke_eight()
        line.send(eight.sealed(PING, b"?"))
        line.send(eight.first_hello(nonce=2))
        line.send(seven.sealed(PING, b"?"))  # it knows the group's key as well
        seven.hello(nonce=1)
        self.assertNotEqual(seven.group, group)
        seven.ping(b"again")
        self.assertEqual(self.counters(), (1, 0, 2))
        self.assertRegex(self.ctl("links"), rf"(?m)^revoked on {self.link}: robot 8$")
        audit = self.folder / "state" / "audit.jsonl"
        await_that(lambda: "revoked the keys of robots [8]" in audit.read_text(), audit.read_text)
        self.ctl("reload")  # the file still has it
        line.send(eight.first_hello(nonce=3))
        seven.ping(b"still there")
        self.assertEqual(self.counters(), (1, 0, 3))

    def test_a_revoked_key_is_not_taken_after_a_restart_and_another_one_is(self):
        self.revoke_eight()
        lost = self.key_of(8)
        self.daemon.kill()
        for file in (self.folder / "state").iterdir():
            self.assertNotIn(lost, file.read_bytes())
        self.assertIn("keys_revoked", self.ctl("journal", "dump", "state"))
        for nonce in (1, 2):
            self.start()
            line = self.open()
            seven, eight = (SignedRobot(line, it, self.key_of(it)) for it in (7, 8))
            line.send(eight.first_hello(nonce))
            seven.hello(nonce)  # nothing comes before its answer
            self.assertEqual(self.counters(), (0, 0, 1))
            if nonce == 1:  # nor with another state that is made of this one
                self.daemon.stop()
                self.ctl("journal", "resample", "--config", "test.toml", "state")
        self.ctl("keys", "revoke", 8, "--file", "robots.keys")
        self.ctl("keys", "new", 8, "--file", "robots.keys")
        self.ctl("reload")
        await_that(lambda: self.daemon.log().count(": keys added 8\n") == LINKS, self.daemon.log)
        SignedRobot(line, 8, self.key_of(8)).hello(nonce=1)
        seven.ping(b"still there")

    def test_without_a_journal_it_is_told_that_a_revocation_is_not_kept(self):
        self.daemon.stop()
        file = self.folder / "test.toml"
        file.write_text(file.read_text().replace('folder = "state"', 'durability = "none"'))
        self.start()
        self.assertEqual(self.ctl("keys", "revoke", 8),
                         "revoked: robot 8, on pty, tcp, udp; not kept: no journal; take it out of "
                         "the keys file, too, with --file\n")

    def test_a_robot_without_a_key_cannot_be_revoked(self):
        answer = subprocess.run([BIN / "pheromonectl", "keys", "revoke", "8", "9"], text=True,
                                cwd=self.folder, capture_output=True, check=False)
        self.assertEqual(answer.returncode, 1)
        self.assertIn("no link has a key of robot 9, expected one of 7, 8; ", answer.stderr)
        SignedRobot(self.open(), 8, self.key_of(8)).hello(nonce=1)

    def test_keys_that_are_only_added_end_no_session(self):
        line = self.open()
        seven = SignedRobot(line, 7, self.key_of(7))
        seven.hello(nonce=1)
        self.ctl("keys", "new", 9, "--file", "robots.keys")
        self.daemon.process.send_signal(signal.SIGHUP)
        await_that(lambda: self.daemon.log().count(": keys added 9\n") == LINKS, self.daemon.log)
        SignedRobot(line, 9, self.key_of(9)).hello(nonce=1)
        seven.ping(b"still there")
        self.assertEqual(self.counters(), (0, 0, 0))

    def test_a_wrong_file_changes_nothing_when_it_is_read_again(self):
        seven = SignedRobot(self.open(), 7, self.key_of(7))
        seven.hello(nonce=1)
        file = self.folder / "robots.keys"
        file.write_text(file.read_text() + "8 00\n")
        answer = subprocess.run([BIN / "pheromonectl", "reload"], cwd=self.folder, text=True,
                                capture_output=True, check=False)
        self.assertEqual(answer.returncode, 1)
        self.assertIn("robots.keys:4: found a key of 2 digits, expected 32 hexadecimal digits",
                      answer.stderr)
        seven.ping(b"still there")

    def test_a_file_that_others_may_read_is_refused_by_check(self):
        check = [BIN / "pheromoned", "--check", "--config", "test.toml"]
        good = subprocess.run(check, cwd=self.folder, text=True, capture_output=True, check=True)
        self.assertIn("signed frames required, keys: 2\n", good.stdout)
        (self.folder / "robots.keys").chmod(0o644)
        bad = subprocess.run(check, cwd=self.folder, text=True, capture_output=True, check=False)
        self.assertEqual(bad.returncode, 2)
        self.assertRegex(bad.stderr, r"(?m)^test\.toml:\d+:8: link\[1\]\.keys: .*"
                                     r": chmod 600 .*robots\.keys$")

    def test_after_a_restart_old_sessions_are_ignored_and_hello_begins_new_ones(self):
        robot = SignedRobot(self.open(), 7, self.key_of(7))
        robot.hello(nonce=1)
        robot.deposit(*PLACE)
        once = robot.sense(*PLACE)
        said = list(robot.said)
        self.daemon.stop()
        self.start()
        robot.line = line = self.open()
        line.send(robot.sealed(SENSE | 1, SENSE_THERE))
        # All that was said before: only the first HELLO is answered, with a nonce of the server's
        # that its session does not have.
        for frame in said:
            line.send(frame)
        robot_id, opcode, greeting = robot.next_frame()
        self.assertEqual((robot_id, opcode, len(greeting)), (7, HELLO | 0x80, 34))
        robot.hello(nonce=1)
        self.assertEqual(robot.sense(*PLACE), once)
        # Those that are read together with the first HELLO come before its session.
        unsigned, wrong, unknown = self.counters()
        self.assertEqual((unsigned + wrong, unknown), (len(said), 0))
        robot.deposit(*PLACE)
        self.assertGreater(robot.sense(*PLACE)[0], once[0])


class RequireOnPtyTest(RequireTest):
    link = "pty"


class TwoAddressesTest(SignedLink):
    def test_a_halt_of_all_is_the_same_frame(self):
        robots = [SignedRobot(self.open(), it, self.key_of(it)) for it in (7, 8)]
        for robot in robots:
            robot.hello(nonce=1)
        for count in (1, 2):
            self.assertEqual(self.daemon.call("POST", "/api/v1/halt", {})[0], 200)
            for robot in robots:
                self.assertEqual(robot.next_to_all(COMMAND)[1:], b"\x01")
                self.assertEqual(robot.heard_to_all, count)


class TwoConnectionsTest(TwoAddressesTest):
    link = "tcp"


class AcceptTest(SignedLink):
    security = "accept"

    def test_robots_with_and_without_keys_are_served(self):
        line = self.open()
        robot = SignedRobot(line, 7, self.key_of(7))
        for number in (7, 9):  # one that has a key, but does not use it yet
            line.send(plain(number, PING, b"plain"))
            self.assertEqual(robot.next_frame(), (number, PING | 0x80, b"plain"))
        robot.hello(nonce=1)
        robot.deposit(*PLACE)
        line.send(plain(7, PING, b"?"))
        self.assertGreater(robot.sense(*PLACE)[0], 0)
        line.send(plain(7, HELLO, struct.pack("<HBB", 2, 1, 0)))  # ends the session
        self.assertEqual(len(robot.next_frame()[2]), 15)
        line.send(plain(7, PING, b"plain"))
        self.assertEqual(robot.next_frame(), (7, PING | 0x80, b"plain"))
        self.assertEqual(self.counters(), (1, 0, 0))


class AcceptOnPtyTest(AcceptTest):
    link = "pty"


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
