#!/usr/bin/env python3
"""pheromone-robot with a key, and an attacker between it and the daemon: the simulated Pioneer stands,
whatever is forged or repeated, until the operator lets it go.

    attacked_robot_test.py BIN_DIR

How long it is attacked is counted in frames. attacker_test.py does the same to robots in Python, and
looks at the map.
"""

import pathlib
import random
import select
import socket
import sys
import tempfile
import threading
import unittest

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "proto_tests"), str(ROOT / "deploy/python")]
from attach_test import CONFIG, PATH_Y, START, Pioneer, Program  # noqa: E402
from attacked_air import TO_ROBOTS, TO_SERVER  # noqa: E402
from free_numbers import free_port  # noqa: E402
from operated_daemon import OperatedDaemon, await_that, write_config  # noqa: E402
from pheromone import Server, wire  # noqa: E402
from test_config import link  # noqa: E402

BIN = pathlib.Path()
ID, KEY = 7, "603DEB1015CA71BE2B73AEF0857D7781"
FRAMES = 60  # to the robot, each time
# After each frame of the robot, to either side. This delays its answers, since it takes the channel
# for one that it shares. Beyond 256 wrong tags a second the server would not listen to it at all.
AT_ONCE = 6
RESUME = wire.build("COMMAND", ID, seq=0, code=wire.RESUME)


def is_resume(body):
    return body[0] == ID and body[1] == RESUME[1] and len(body) > 3 and body[3] == wire.RESUME


class Attacker:
    """A UDP port that leads to the daemon's."""

    def __init__(self, daemon_port):
        self.chance = random.Random(7)
        self.outer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.outer.bind(("127.0.0.1", 0))
        self.inner = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.inner.connect(("127.0.0.1", daemon_port))
        self.port = self.outer.getsockname()[1]
        self.robot = None  # its address
        self.of_robot, self.of_server = [], []
        self.sent = self.resumes = 0
        self.ending = False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        while not self.ending:
            for end in select.select((self.outer, self.inner), (), (), 0.1)[0]:
                try:
                    data, sender = end.recvfrom(4096, socket.MSG_DONTWAIT)
                except (ConnectionRefusedError, BlockingIOError):
                    continue  # there is no daemon; sending has already said so, if nothing is there to read
                if end is self.outer:
                    self.robot = sender
                    self.of_robot += wire.Decoder().feed(data)
                    self.to_server(data)
                    self.attack()
                else:
                    self.of_server += wire.Decoder().feed(data)
                    self.to_robot(data)

    def to_server(self, data):
        try:
            self.inner.send(data)
        except ConnectionRefusedError:
            pass

    def to_robot(self, data):
        if self.robot:
            self.outer.sendto(data, self.robot)

    def attack(self):
        genuine = [it for it in self.of_server if is_resume(it)]
        resumes = genuine + [RESUME, RESUME + self.chance.randbytes(5)]
        for _ in range(AT_ONCE):
            forged = self.chance.choice(TO_SERVER)(self.chance, self.of_robot)
            if forged:
                self.to_server(wire.encode(forged))
            forged = (self.chance.choice(resumes) if self.chance.random() < 0.3 else
                      self.chance.choice(TO_ROBOTS)(self.chance, self.of_server))
            if forged:
                self.to_robot(wire.encode(forged))
                self.resumes += is_resume(forged)
                self.sent += 1

    def end(self):
        self.ending = True
        self.thread.join()
        self.outer.close()
        self.inner.close()


class AttackedRobotTest(unittest.TestCase):
    def start_daemon(self):
        self.daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(self.daemon.kill)
        self.server = Server(str(self.folder / "pheromoned.sock"))
        self.server.paint("path", [(1, PATH_Y), (58, PATH_Y)], radius_m=0.05)

    def start_robot(self):
        robot = Program(BIN / "pheromone-robot", "--robot", f"127.0.0.1:{self.pioneer.tcp_port()}",
                        "--modem", f"udp:127.0.0.1:{self.attacker.port}", "--start", *START, "--wide",
                        "--speed", "300", "--id", ID, "--key", self.folder / "robot.key")
        self.addCleanup(robot.kill)
        return robot

    def await_requests(self, nonce):
        """The daemon has taken some of this start."""
        def found():
            mine = [it for it in self.server.clients() if it["id"] == ID and it["link"] == "signed"]
            return mine and mine[0]["known"] and mine[0]["nonce"] == nonce and mine[0]["requests"] > 3
        await_that(found, f"the daemon hears the robot, nonce {nonce}")

    def stands_under_attack(self):
        poses, sent, resumes = len(self.pioneer.poses()), self.attacker.sent, self.attacker.resumes
        await_that(lambda: self.attacker.sent >= sent + FRAMES, "the attacker has sent its frames")
        self.assertGreater(self.attacker.resumes, resumes)
        places = {it[1:] for it in self.pioneer.poses()[poses:]}
        self.assertEqual(len(places), 1, places)

    def resume(self):
        from_x = self.pioneer.poses()[-1][1]
        self.server.command("signed", ID, "resume")
        await_that(lambda: self.pioneer.poses()[-1][1] > from_x + 0.3, "it has driven")

    def halt(self):
        told = len(self.robot.lines)
        self.server.halt()
        self.robot.await_line("halted, until", told)  # it also stands while answers are late
        self.pioneer.stands()

    def test_stands_until_the_operator_lets_it_go(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        port = free_port()
        write_config(self.folder, CONFIG.replace("TCP_PORT", "0")
                     + link("signed", "udp", listen=f"127.0.0.1:{port}", security="require",
                            keys="keys"))
        for name, text in (("keys", f"{ID} {KEY}\n"), ("robot.key", KEY + "\n")):
            (self.folder / name).write_text(text)
            (self.folder / name).chmod(0o600)
        self.start_daemon()
        self.attacker = Attacker(port)
        self.addCleanup(self.attacker.end)
        self.pioneer = Pioneer(BIN, "--tcp", "0")
        self.addCleanup(self.pioneer.kill)
        robot = self.robot = self.start_robot()
        self.await_requests(nonce=1)
        self.stands_under_attack()
        self.resume()
        self.halt()
        self.stands_under_attack()  # now it has a genuine resume to repeat
        self.resume()
        robot.kill()
        self.pioneer.stands()
        self.robot = self.start_robot()
        self.await_requests(nonce=2)
        self.stands_under_attack()  # and one of an earlier session
        self.daemon.kill()
        self.start_daemon()
        self.await_requests(nonce=2)
        self.stands_under_attack()
        self.resume()
        self.halt()
        links = {it["name"]: it["counters"] for it in self.server.links()}
        for counter in ("unsigned_frames", "wrong_signatures", "unknown_robots"):
            self.assertGreater(links["signed"][counter], 0)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
