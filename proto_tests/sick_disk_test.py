#!/usr/bin/env python3
"""A journal whose disk is stuck, and then full, while a crowd repeats its requests.

    sick_disk_test.py BIN_DIR SHIM [ADDRESSES [SECONDS]]     default: 3000 addresses, 4 seconds

SHIM is sick_disk_shim.c. 254 robots leave pheromone over UDP and repeat what is not answered, each
from many addresses in 127.0.0.0/8, as byte for byte the same request. Whatever the disk does:

  * nobody is told that a change was made before it is durable; each change is made once, and is
    there after the server was killed; no answer is sent twice, or more than a second after it was
    asked for;
  * the server's memory does not grow after the first second;
  * a halt reaches the robots within 100 ms, and /healthz says within 2 s that the disk does not
    advance, also while two edits wait for the disk and 500 idle connections hold the web's port;
  * the service's watchdog is fed all the time: a server that senses and halts is not killed.

Times are asserted here, for they are what is promised; the best of some attempts counts, since the
machine may be busy.
"""

import json
import pathlib
import re
import select
import socket
import struct
import sys
import tempfile
import threading
import time

from asking_robot import CONFIG
from checks import check
from operated_daemon import PATIENCE_S, OperatedDaemon, await_that
from stranger.client import open_terminal
from stranger.wire import Decoder, build, build_hello, encode, parse
from test_config import link, pheromone, pty, table

ROBOTS = 254
QUANTUM = 0.125
MOST_GROWTH = 1.05
MOST_AGE_S = 1.0  # of an answer, protocol/README.md, section 8
HALT_S = 0.1
HEALTH_S = 2.0
SLACK_S = 1.0  # for asking
ATTEMPTS = 5  # at what has a time
IDLE_CONNECTIONS = 500
BETWEEN_REPEATS_S = 0.2
NOT_NOW = (7, 8)  # reasons of an ERROR: busy, read-only

EXTRA = (pheromone(2, "paint") + link("udp", "udp", listen="127.0.0.1:0") + pty("radio")
         + table("web", listen="127.0.0.1:0") + table("journal", folder="state"))


class Disk:
    """The file that controls the shim."""

    def __init__(self, folder):
        self.folder = folder

    def fall_ill(self, how):
        (self.folder / how).touch()

    def heal(self):
        for how in ("stuck", "full"):
            (self.folder / how).unlink(missing_ok=True)


class ServiceManager:
    """Hears WATCHDOG=1 in time, or would kill the server: sd_notify(3)."""

    def __init__(self, folder, limit_s):
        self.limit_s = limit_s
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(folder / "notify"))
        self.environment = {"NOTIFY_SOCKET": str(folder / "notify"),
                            "WATCHDOG_USEC": str(int(1e6 * limit_s))}
        self.fed = []
        threading.Thread(target=self.hear, daemon=True).start()

    def hear(self):
        while True:
            if b"WATCHDOG=1" in self.socket.recv(4096):
                self.fed.append(time.monotonic())

    def check_fed(self, since):
        """From then until now, never later than the limit."""
        times = [since, *(it for it in self.fed if it > since), time.monotonic()]
        longest_s = max(later - earlier for earlier, later in zip(times, times[1:]))
        print(f"watchdog of {self.limit_s:.0f} s: fed {len(times) - 2} times in "
              f"{times[-1] - since:.0f} s, {longest_s:.1f} s apart at most", flush=True)
        check(times[-1] - since > 1.5 * self.limit_s, "the disk was not stuck for long enough")
        check(longest_s < self.limit_s, "the server would have been killed")


class Daemon(OperatedDaemon):
    def requests(self):
        """How many messages of robots it has read."""
        status, text = self.call("GET", "/api/v1/status")
        check(status == 200, f"no status: {status} {text}")
        return json.loads(text)["counters"]["requests"]

    def quanta(self):
        """The contents of the map, by column and row."""
        status, text = self.call("GET", "/api/v1/field?pheromone=1&nodes_per_cell=1")
        check(status == 200, f"no picture of the map: {status} {text}")
        return {(column, row): value / QUANTUM
                for row, values in enumerate(reversed(json.loads(text)["values"]))
                for column, value in enumerate(values) if value != 0}


def ip(address):
    """Of the crowd's address with this number."""
    return bytes((127, 1 + (address >> 16), address >> 8 & 255, address & 255))


class Crowd:
    """Everybody in 127.0.0.0/8, on one socket: the address that a datagram comes from, or goes to,
    is told beside it."""

    PKTINFO = 8  # ip(7), IP_PKTINFO
    LAYOUT = struct.Struct("=i4s4s")

    def __init__(self, port):
        self.server = ("127.0.0.1", port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.IPPROTO_IP, self.PKTINFO, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self.socket.bind(("0.0.0.0", 0))
        self.socket.setblocking(False)

    def send(self, address, datagram):
        info = self.LAYOUT.pack(0, ip(address), bytes(4))
        try:
            self.socket.sendmsg((datagram,), ((socket.IPPROTO_IP, self.PKTINFO, info),), 0,
                                self.server)
        except BlockingIOError:
            pass  # it will be repeated

    def receive(self):
        """All that has come: pairs of an address and a frame's body."""
        came = []
        while True:
            try:
                data, ancillary, _, _ = self.socket.recvmsg(2048, 64)
            except BlockingIOError:
                return came
            _, _, to = self.LAYOUT.unpack(ancillary[0][2][:self.LAYOUT.size])
            address = (to[1] - 1 << 16) + (to[2] << 8) + to[3]
            came.extend((address, body) for body in Decoder().feed(data))

    def listen(self, seconds):
        came = []
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            select.select((self.socket,), (), (), left)
            came.extend(self.receive())
        return came


def node(robot):
    """The node at which it deposits, by column and row."""
    return robot % 100, robot // 100


def change(robot, seq):
    """Its request to deposit a quantum: DEPOSIT or TRACE."""
    column, row = node(robot)
    if robot % 2:
        body = build("TRACE", robot, type=1, seq=seq, x=100 * column, y=100 * row, heading=0)
    else:
        body = build("DEPOSIT", robot, type=1, seq=seq, x=100 * column, y=100 * row, quanta=1)
    return encode(body)


def is_done(body, seq):
    """Whether it says that the change with this seq was made."""
    message = parse(body)
    if message.name == "ERROR":
        check(message.fields["reason"] in NOT_NOW, f"refused: {message}")
        return False
    return message.name in ("DEPOSIT_ANSWER", "TRACE_ANSWER") and message.fields["seq"] == seq


class Attack:
    def __init__(self, bin_dir, shim, folder, addresses, seconds):
        self.manager = ServiceManager(folder, min(20, max(4, seconds / 3)))
        self.start = lambda: Daemon(bin_dir, folder, LD_PRELOAD=str(shim), SICK_DISK=str(folder),
                                    **self.manager.environment)
        self.disk = Disk(folder)
        self.addresses = addresses
        self.seconds = seconds
        self.daemon = self.start()
        self.crowd = Crowd(self.daemon.udp_port())
        self.seq = 0

    def all_robots(self, request, is_answer):
        """Each repeats its request from an address of its own until it is answered. Returns the
        answers."""
        answers = {}
        end = time.monotonic() + PATIENCE_S
        while len(answers) < ROBOTS:
            check(time.monotonic() < end, f"only {len(answers)} of {ROBOTS} are answered")
            for robot in range(1, ROBOTS + 1):
                if robot not in answers:
                    self.crowd.send(robot, request(robot))
            for _, body in self.crowd.listen(BETWEEN_REPEATS_S):
                if is_answer(body):
                    answers[body[0]] = body
        return answers

    def hello(self):
        return self.all_robots(
            lambda robot: encode(build_hello(robot, nonce=robot)), lambda body: body[1] == 0xF1)

    def next_change(self):
        self.seq += 1
        return [b""] + [change(robot, self.seq) for robot in range(1, ROBOTS + 1)]

    def finish_change(self):
        """Each repeats the last change until it is answered; then all of them are there, once."""
        self.all_robots(lambda robot: change(robot, self.seq),
                        lambda body: is_done(body, self.seq))
        self.crowd.listen(1)  # what is still on its way
        self.check_map()

    def check_map(self):
        expected = {node(robot): self.seq for robot in range(1, ROBOTS + 1)}
        found = self.daemon.quanta()
        check(found == expected, "not each change is there once: " + ", ".join(
            f"at {at} {found.get(at, 0)}, not {expected.get(at, 0)}"
            for at in sorted(found.keys() | expected.keys())
            if found.get(at, 0) != expected.get(at, 0))[:1000])

    def flood(self, requests, what):
        """Everybody repeats, and is not told that it was done. The daemon does not grow after the
        first second."""
        begin = time.monotonic()
        sent = refused = 0
        first_kib = last_kib = 0
        took_s = 0.0
        while took_s < self.seconds:
            address = 1 + sent % self.addresses
            self.crowd.send(address, requests[1 + (address - 1) % ROBOTS])
            sent += 1
            if sent % ROBOTS != 0:
                continue
            for _, body in self.crowd.receive():
                check(not is_done(body, self.seq), f"{what}: told before it was durable")
                refused += 1
            last_kib = max(last_kib, self.daemon.rss_kib())
            if took_s < 1:
                first_kib = last_kib
            took_s = time.monotonic() - begin
        print(f"{what}: {sent} requests from {self.addresses} addresses, {refused} refused; "
              f"{first_kib} KiB after a second, at most {last_kib} KiB", flush=True)
        check(self.daemon.keeps_memory or last_kib <= MOST_GROWTH * first_kib,
              f"{what}: the daemon has grown from {first_kib} to {last_kib} KiB")

    def paint(self, answers):
        answers.append(self.daemon.call("POST", "/api/v1/paint", {
            "pheromone": "paint", "area_m": [0, 8, 1, 9]}))

    def time_halt(self, terminal):
        """Seconds until the robot at the end of the pty has it."""
        while terminal.receive(time.monotonic() + 0.5) is not None:
            pass  # of the halt before
        begin = time.monotonic()
        caller = threading.Thread(target=self.daemon.call, args=("POST", "/api/v1/halt", {}))
        caller.start()
        body = terminal.receive(begin + PATIENCE_S)
        took_s = time.monotonic() - begin
        check(body is not None and body[:2] == b"\xff\xd1" and body[3] == 1, f"a halt, not {body}")
        caller.join(PATIENCE_S)
        return took_s

    def time_illness(self, since):
        """Seconds until /healthz says that something is wrong."""
        await_that(lambda: not self.daemon.healthy(), "/healthz sees that the disk is stuck")
        return time.monotonic() - since

    def operators_beside_a_stuck_disk(self):
        """Called with changes under way. Returns what is left to be joined: who waits."""
        begin = time.monotonic()
        answers = []
        painters = [threading.Thread(target=self.paint, args=(answers,)) for _ in range(2)]
        for painter in painters:
            painter.start()
        idle = [socket.create_connection(("127.0.0.1", self.daemon.web_port()))
                for _ in range(IDLE_CONNECTIONS)]
        with open_terminal(self.daemon.folder / "radio.pty") as terminal:
            halts_s = [self.time_halt(terminal)]
            illness_s = self.time_illness(begin)
            while min(halts_s) > HALT_S and len(halts_s) < ATTEMPTS:
                halts_s.append(self.time_halt(terminal))
        print(f"stuck: a halt took {1000 * min(halts_s):.0f} ms; /healthz told after "
              f"{illness_s:.2f} s", flush=True)
        check(min(halts_s) <= HALT_S, f"halts took {halts_s} s")
        check(illness_s <= HEALTH_S + SLACK_S, f"/healthz told after {illness_s} s only")
        told = re.compile(r" (warn|warning|error): .*(journal|disk)")
        while (told.search(self.daemon.log()) is None
               and time.monotonic() < begin + HEALTH_S + SLACK_S):
            time.sleep(0.05)
        check(told.search(self.daemon.log()) is not None, "the log says nothing of the disk")
        check(self.daemon.call("GET", "/healthz", web=True)[0] == 503,
              "idle connections lock the web's port")
        for connection in idle:
            connection.close()
        return painters, answers

    def stuck_for_long(self):
        requests = self.next_change()
        begin = time.monotonic()
        self.disk.fall_ill("stuck")
        for robot in range(1, ROBOTS + 1):
            self.crowd.send(robot, requests[robot])
        painters, answers = self.operators_beside_a_stuck_disk()
        self.flood(requests, "stuck")
        for _, body in self.crowd.listen(MOST_AGE_S + 1):  # nobody asks any more
            check(not is_done(body, self.seq), "told before it was durable")
        self.manager.check_fed(begin)
        self.disk.heal()
        await_that(self.daemon.healthy, "the disk has come back")
        late = [body for _, body in self.crowd.listen(1) if is_done(body, self.seq)]
        check(not late, f"{len(late)} answers came more than {MOST_AGE_S} s after the request")
        for painter in painters:
            painter.join(PATIENCE_S)
        check(len(answers) == 2 and all(status != 0 for status, _ in answers),
              f"edits that waited got {answers}")
        self.finish_change()

    def stuck_for_a_moment(self):
        requests = self.next_change()
        before = self.daemon.requests()
        self.disk.fall_ill("stuck")
        for round_number in range(3):
            for robot in range(1, ROBOTS + 1):
                self.crowd.send(robot + round_number * ROBOTS, requests[robot])
        await_that(lambda: self.daemon.requests() >= before + 3 * ROBOTS, "all has been read")
        self.disk.heal()
        came = [(address, body[0]) for address, body in self.crowd.listen(2)
                if is_done(body, self.seq)]
        done = [robot for _, robot in came]
        print(f"stuck for a moment: {len(done)} answers, to {len(set(done))} of {ROBOTS} robots",
              flush=True)
        twice = sorted(robot for robot in set(done) if done.count(robot) > 1)
        check(not twice, f"robots {twice} got an answer more than once")
        check(all(address == robot + 2 * ROBOTS for address, robot in came),
              "an answer went to where it was not asked for last")
        self.finish_change()

    def full(self):
        requests = self.next_change()
        self.disk.fall_ill("full")
        self.flood(requests, "full")
        check(not self.daemon.healthy(), "/healthz does not know that the disk is full")
        self.disk.heal()
        self.finish_change()
        await_that(self.daemon.healthy, "changes are accepted again")

    def killed(self):
        self.daemon.kill()
        self.daemon = self.start()
        self.crowd.socket.close()
        self.crowd = Crowd(self.daemon.udp_port())
        self.check_map()
        for robot, body in self.hello().items():
            check(parse(body).fields["last_seq"] == self.seq, f"robot {robot}: {parse(body)}")

    def run(self):
        self.hello()
        self.next_change()
        self.finish_change()
        self.stuck_for_long()
        self.stuck_for_a_moment()
        self.full()
        self.stuck_for_a_moment()
        self.killed()
        self.daemon.stop()


def main():
    bin_dir, shim = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    numbers = [int(word) for word in sys.argv[3:]] + [3000, 4][len(sys.argv[3:]):]
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        (folder / "test.toml").write_text(
            CONFIG.replace("tau_s = 30.0", "tau_s = 0").replace("maximum = 0.25", "maximum = 31.875")
            + EXTRA, encoding="ascii")
        attack = Attack(bin_dir, shim, folder, *numbers)
        try:
            attack.run()
        except BaseException:
            print(attack.daemon.log()[-4000:], file=sys.stderr)
            raise
        finally:
            attack.disk.heal()
            attack.daemon.kill()
    print("ok")


if __name__ == "__main__":
    main()
