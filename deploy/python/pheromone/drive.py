"""A robot of any make that follows a trail.

    class MyRobot:                                     # a Drive
        def pose(self): return x_m, y_m, heading_deg
        def wheels(self, left_mm_s, right_mm_s): ...

    with open_line("udp:127.0.0.1:4951") as line:
        Follower(line, 7, MyRobot(), pheromone=1, released=True).run(seconds=60)

Five times a second it reports where it is, and steers by the answer with the differential law of
section 11 of protocol/README.md. It obeys an operator's halt, resume, speed and follow type. It
stands, and says so to the drive each time,

* until it is released: by a resume, or from the beginning;
* where it senses nothing, and without a pose, which the server is told once (EVENT 5 and 11);
* if the server refuses a request, and 500 ms after its last answer at the latest (section 8);
* while it connects to another server by TCP.
"""

from __future__ import annotations

import os
import secrets
import time
from typing import Protocol

from .robot import Client, ErrorAnswer, Line, NewEpoch, NoAnswer, NonceUsedUp, next_boot
from .wire import (BAD_VALUE, FOLLOW, HALT, MAX_TYPE, NOT_PERMITTED, POSE_LOST, RESUME, SAY_HELLO,
                   SPEED, TRAIL_LOST, UNIT, Message)

PERIOD_S = 0.2
PATIENCE_S = 0.1  # with the period, twice and an exchange more: below the 500 ms of the fail-safe


class Drive(Protocol):
    """What a robot has to offer. Neither method may wait."""

    def pose(self) -> tuple[float, float, float] | None:
        """x and y in metres and the heading in degrees counter-clockwise from +x, on the map; None
        if that is not known."""

    def wheels(self, left_mm_s: float, right_mm_s: float) -> None:
        """Sets the wheels' speeds; 0, 0 stops it. They hold until the next call. A robot should stop
        by itself when none has come for 500 ms: this program may end."""


def differential(left: int, right: int, speed_mm_s: float) -> tuple[float, float]:
    """The wheels' speeds for the intensities at the antennas, in 1/4096 unit: section 11."""
    difference = (left - right) / max(UNIT, abs(left), abs(right))
    return speed_mm_s * (1 - max(difference, 0)), speed_mm_s * (1 - max(-difference, 0))


class Follower:
    """A Client that drives. `speed_mm_s`: None is 200, or the maximum if that is less; `released`:
    it need not be told to go; `max_speed_mm_s`: a command to go faster is refused; `key`: the link
    signs its frames, and `boots` is the file of robot.next_boot. ValueError: the speed is negative
    or above the maximum, or a key has no such file. One thread at a time."""

    def __init__(self, line: Line, client_id: int, drive: Drive, pheromone: int = 1,
                 speed_mm_s: float | None = None, released: bool = False,
                 max_speed_mm_s: float = 1000, key: bytes | None = None,
                 boots: str | os.PathLike[str] | None = None) -> None:
        if speed_mm_s is None:
            speed_mm_s = min(200, max_speed_mm_s)
        if not 0 <= speed_mm_s <= max_speed_mm_s:
            raise ValueError(f"speed_mm_s is {speed_mm_s}, expected 0 to {max_speed_mm_s}")
        if key is not None and boots is None:
            raise ValueError("a robot with a key needs a file that counts its boots")
        self.client = Client(line, client_id, timeout=PATIENCE_S, tries=1, on_command=self._obey,
                             key=key)
        line.before_waiting = lambda: self.drive.wheels(0, 0)
        self.drive = drive
        self.pheromone = pheromone
        self.speed_mm_s = speed_mm_s
        self.max_speed_mm_s = max_speed_mm_s
        self.released = released
        self._boots = boots
        self._nonce = secrets.randbelow(1 << 16) if boots is None else next_boot(boots)
        self._unit_m: float | None = None  # of coordinates; None: HELLO is not answered yet
        self._told: int | None = None  # the EVENT of why it stands

    def run(self, seconds: float = float("inf")) -> None:
        """Stands at the end, also if that is an exception."""
        end = time.monotonic() + seconds
        try:
            while (began := time.monotonic()) < end:
                self.step()
                self.client.listen(max(0.0, min(began + PERIOD_S, end) - time.monotonic()))
        finally:
            self.drive.wheels(0, 0)

    def step(self) -> None:
        """One period: asks, and sets the wheels."""
        speeds = (0.0, 0.0)
        try:
            if self._unit_m is None:
                self._unit_m = self.client.hello(self._nonce).pose_unit_10um * 1e-5
            speeds = self._steer(self._unit_m)
        except NewEpoch:
            self._unit_m = None
        except NonceUsedUp:  # the server was away for hours
            assert self._boots is not None
            self._nonce = next_boot(self._boots)
            self._unit_m = None
        except NoAnswer:
            pass
        except ErrorAnswer as refused:
            if refused.reason == SAY_HELLO:
                self._unit_m = None
        self.drive.wheels(*(speeds if self.released else (0, 0)))

    def _steer(self, unit_m: float) -> tuple[float, float]:
        pose = self.drive.pose()
        if pose is None:
            self.drive.wheels(0, 0)  # before anything else
            self._tell(POSE_LOST)
            return 0, 0
        x, y = round(pose[0] / unit_m), round(pose[1] / unit_m)
        wide = not (-32768 <= min(x, y) and max(x, y) <= 32767)
        sensed = self.client.sense(self.pheromone, x, y, round(pose[2] / 360 * 65536) % 65536, wide)
        if sensed == (0, 0):
            self.drive.wheels(0, 0)
            if self.released:
                self._tell(TRAIL_LOST)
            return 0, 0
        self._told = None
        return differential(sensed.left, sensed.right, self.speed_mm_s)

    def _tell(self, event: int) -> None:
        if self._told != event:
            self.client.event(event)
            self._told = event

    def _obey(self, command: Message) -> int:
        """The result of the ACK."""
        code, fields = command.fields["code"], command.fields
        if code == HALT:
            self.released = False
            self.drive.wheels(0, 0)
        elif code == RESUME:
            self.released = True
        elif code == SPEED and 0 <= fields["speed_mm_s"] <= self.max_speed_mm_s:
            self.speed_mm_s = fields["speed_mm_s"]
        elif code == FOLLOW and 1 <= fields["type_to_follow"] <= MAX_TYPE:
            self.pheromone = fields["type_to_follow"]
        else:
            return BAD_VALUE if code in (SPEED, FOLLOW) else NOT_PERMITTED
        return 0
