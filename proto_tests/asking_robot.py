"""Robots that send requests continuously, some of whose links fail and come back.

    class RobotOnALine(Robot):  # connect, tear_down, send, receive, and fd to wait for
        ...
    serve(robots, everyone_answered(robots), "all are well")
    come_and_go(robots, victims=robots[:4])

Each request has a number of its own. A robot whose link is undisturbed gets one answer to each, its
own, or AssertionError says what came instead. Nothing is asserted about how fast any of this is.
"""

import select
import time

from checks import PATIENCE_S, check
from stranger.wire import Decoder, encode
from test_config import map_of, pheromone

ASK_AGAIN_S = 0.1  # while a link is coming back
PING, ECHO = 0x72, 0xF2
EXCHANGES = 20  # that each undisturbed robot makes while others are away

# Of a server; links are to be added.
CONFIG = map_of() + pheromone(1, "trail", tau_s=30.0, maximum=0.25)


def waited_s():
    """How long this process has waited for a processor, if the kernel counts that."""
    try:
        with open("/proc/self/schedstat", "rb") as file:
            return int(file.read().split()[1]) / 1e9
    except OSError:
        return 0.0


class Robot:
    """Asks for echoes, one after the other, each with a number of its own."""

    def __init__(self, name, client):
        self.name = name
        self.client = client
        self.number = 0
        self.given_up = 0  # answers up to this one are not waited for, and may come or not
        self.asked_at = None  # of what is under way
        self.waited_before_s = 0.0
        self.exchanges = 0
        self.slowest_s = 0.0
        self.may_lose = False  # its link is on its way down or up
        self.begin()

    def begin(self):
        self.connect()
        self.decoder = Decoder()
        self.given_up = self.number
        self.asked_at = None

    def ask(self):
        if self.asked_at is not None:
            self.given_up = self.number
        self.number += 1
        payload = self.number.to_bytes(8, "little")
        try:
            self.send(encode(bytes((self.client, PING)) + payload))
        except OSError:
            check(self.may_lose, f"{self.name}: cannot send")
        self.waited_before_s = waited_s()
        self.asked_at = time.monotonic()

    def read(self):
        for body in self.decoder.feed(self.receive()):
            number = int.from_bytes(body[2:10], "little")
            if number <= self.given_up:
                continue
            check(body[:2] == bytes((self.client, ECHO)) and number == self.number
                  and self.asked_at is not None, f"{self.name}: {body.hex()} was not asked for")
            took_s = time.monotonic() - self.asked_at - (waited_s() - self.waited_before_s)
            self.slowest_s = max(self.slowest_s, took_s)
            self.asked_at = None
            self.exchanges += 1


def serve(robots, until, what):
    """Lets all robots ask and be answered until `until()`."""
    end = time.monotonic() + PATIENCE_S
    by_fd = {robot.fd: robot for robot in robots}
    poller = select.poll()
    for fd in by_fd:
        poller.register(fd, select.POLLIN)
    while not until():
        now = time.monotonic()
        for robot in robots:
            if robot.asked_at is None or robot.may_lose and now - robot.asked_at > ASK_AGAIN_S:
                robot.ask()
            check(now - robot.asked_at < PATIENCE_S, f"{robot.name}: no answer while {what}")
        check(now < end, f"gave up while {what}: " + ", ".join(
            f"{robot.name} {robot.exchanges}" for robot in robots))
        for fd, events in poller.poll(50):
            if events & select.POLLIN:
                by_fd[fd].read()
            elif events:  # a line that the daemon does not hold open yet: no haste
                time.sleep(0.001)


def everyone_answered(robots, more=1):
    goals = [(robot, robot.exchanges + more) for robot in robots]
    return lambda: all(robot.exchanges >= goal for robot, goal in goals)


def come_and_go(robots, victims):
    """The links of the victims fail and come back; the others are served meanwhile."""
    others = [robot for robot in robots if robot not in victims]
    for robot in victims:
        robot.may_lose = True
        robot.tear_down()
    serve(others, everyone_answered(others, EXCHANGES), "others are away")
    for robot in victims:
        robot.begin()
    serve(robots, everyone_answered(robots), "others come back")
    for robot in victims:  # what was asked twice is answered twice, and must not confuse
        robot.ask()
    serve(robots, everyone_answered(robots), "all are back")
    for robot in victims:
        robot.may_lose = False
