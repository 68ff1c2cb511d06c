#!/usr/bin/env python3
"""AVR images and pheromone-robot on a strict radio channel, and the real daemon with its journal.

    strict_air_live_test.py BIN_DIR TESTS_DIR IMAGE [--seconds N] [--slow N] [CASE...]

strict_air plays modems and air: T_t is 2 ms, the daemon's adapter holds bytes back for 16 ms. Robots
leave trails, so that each answer waits for the journal. Cases:

  damage   eight and four AVR images; 0, 1 and 3 % of the bytes damaged
  mixed    three AVR images in rounds, and a pheromone-robot behind an adapter of 16 ms
  contend  four pheromone-robots, each behind an adapter of 16 ms
  once     changes in damaged air, 1 and 3 %, while the daemon is killed and images are reset: each is
           on the map once. Four images in rounds, then four pheromone-robots that contend
  measured a pheromone-robot behind an adapter of 16 ms that looks like a UART: it contends once it
           has measured that. With --strict, another one behind a quick adapter that tells nothing:
           it takes turns then
  sick     six AVR images in rounds while the journal's disk is stuck for 3 s, and two
           pheromone-robots that contend while each sync takes 300 ms: a third is one too many for
           two adapters of 16 ms, on a healthy disk too
  keyed    two AVR images and a daemon whose transmitters are keyed by a line; with --strict, for quiet
           machines, no byte may be cut

What robots count is asked over the air, as an operator would. Rates are printed, and asserted nowhere:
a robot must be answered, and everything must end in an orderly way.

A machine that pauses for 30 ms costs robots answers, and in runs of minutes stops. With --slow N all
clocks run N times slower (slow_clock_shim.c), so that such a pause is N times shorter beside the 480 ms
without an answer that stop a robot; --seconds are of these clocks.
"""

import argparse
import contextlib
import json
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from operated_daemon import OperatedDaemon, await_that, check  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

# Settings by number: period, fail-safe and all else as a flashed image has them.
STANDS, LAYS_TRAIL, NEVER_LOST, PTT_LEAD, PTT_TAIL = "7=0", "3=1", "10=0", "16=%d", "17=%d"
REQUESTS, UNANSWERED, FAIL_SAFE_STOPS = 138, 139, 141
TRACE_BYTES = 15 + 13
MOST_QUANTA = 24_000
BYTE_S = 10 / 9600
JOINED_S = 5
BETWEEN_QUESTIONS_S = 1
SETTLED_S = 20
CALM_S = 5


class Channel:
    """The daemon, the air, and the robots, until the end of a with statement."""

    def __init__(self, arguments, name):
        self.arguments = arguments
        self.name = name
        self.stack = contextlib.ExitStack()
        self.ids = []
        self.robots = []

    def __enter__(self):
        self.folder = pathlib.Path(self.stack.enter_context(tempfile.TemporaryDirectory()))
        return self

    def __exit__(self, *exception):
        self.stack.close()

    def serve(self, kind="pty", environment=None, **keys):
        config = map_of(origin_x_m=-5.0, origin_y_m=-5.0) + pheromone(
            1, "trail", maximum=MOST_QUANTA / 8) + link(
            "radio-a", kind, medium_access=True, baud=9600, adapter_latency_ms=16, **keys)
        (self.folder / "test.toml").write_text(config + table("journal", folder="journal"))
        self.daemon = OperatedDaemon(self.arguments.bin_dir, self.folder, **(environment or {}))
        self.stack.callback(self.daemon.kill)

    def kill_daemon(self):
        """And starts it again, from its journal."""
        # The number of its pty is free then: through this link the air would open what another
        # program makes of it.
        (self.folder / "radio-a.pty").unlink()
        self.daemon.kill()
        self.daemon = OperatedDaemon(self.arguments.bin_dir, self.folder)
        self.stack.callback(self.daemon.kill)

    def attached(self, *names):
        """Robots whose ports have these names, for which one must be root. That of a USB adapter,
        which tells no latency, is taken for one of 16 ms, with which a robot contends, until it has
        been measured. Without a name it is a pseudo-terminal, and taken for a UART."""
        for robot, name in enumerate(names, 1):
            pioneer, modem = self.folder / f"pioneer{robot}", self.folder / f"modem{robot}"
            self.run(self.arguments.bin_dir / "pheromone-swarm", "pioneer", "--pty", pioneer,
                     stdin=subprocess.PIPE)
            await_that(pioneer.exists, "the Pioneer is there")
            named = []
            if name:
                port = self.folder / f"{name}{robot}"
                port.touch()
                named = ["unshare", "--mount", "sh", "-c",
                         'mount --bind "$1" "$2" && shift 2 && exec "$@"', "sh",
                         os.path.realpath(modem), port]
                modem = port
            with open(self.folder / f"log{robot}", "w", encoding="utf-8") as log:
                self.robots.append(self.run(
                    *named, self.arguments.bin_dir / "pheromone-robot", "--robot", pioneer,
                    "--modem", modem, "--modem-baud", 9600, "--start", 0, 0, 0, "--id", 100 + robot,
                    "--speed", 20, "--released", "--lay-trail", stdout=log))
            self.ids.append(100 + robot)

    def run(self, *words, **options):
        process = subprocess.Popen([str(word) for word in words], text=True,
                                   stdout=options.pop("stdout", subprocess.DEVNULL), **options)
        self.stack.callback(lambda: end(process))
        return process

    def on_air(self, *stations, damaged=0.0):
        self.air = self.run(self.arguments.tests_dir / "strict_air", "--damage", damaged, *stations,
                            stdout=subprocess.PIPE)
        check("on air" in self.air.stdout.readline(), "the air did not begin")

    def images(self, count, *settings, ptt=None):
        for robot in range(1, count + 1):
            self.robots.append(self.run(
                self.arguments.tests_dir / "avr_live", self.arguments.image,
                self.folder / f"robot{robot}", robot,
                self.folder / f"key{robot}" if ptt else "-", *settings))
            self.ids.append(robot)

    def get(self, robot, value):
        """Asked until it is told: the air is bad."""
        for _ in range(20):
            told = subprocess.run(
                [self.arguments.bin_dir / "pheromonectl", "--socket",
                 self.folder / "pheromoned.sock", "command", "radio-a", str(robot), "get",
                 str(value)], capture_output=True, text=True, check=False)
            found = re.search(r"(-?\d+)\s*$", told.stdout.strip())
            if told.returncode == 0 and found:
                return int(found[1])
        raise AssertionError(f"robot {robot} does not tell {value}: {told.stdout}{told.stderr}")

    def answers(self, robot):
        """And when."""
        unanswered = self.get(robot, UNANSWERED)
        return time.monotonic(), self.get(robot, REQUESTS) - unanswered

    def await_robots(self):
        """Until all have joined, and no longer disturb each other by that."""
        await_that(lambda: self.present() >= set(self.ids), "all robots are there")
        time.sleep(JOINED_S)

    def measure(self, seconds):
        """Answers a second of each robot once all are there, and what is to be told of stops. What
        they count is asked over the air, which itself can cost a stop: so it is asked once more."""
        self.await_robots()
        before = {robot: self.answers(robot) for robot in self.ids}
        asked = self.stops()
        before_stops = self.stops()
        time.sleep(seconds)
        stops = " ".join(map(str, added(before_stops, self.stops()).values()))
        rates = {}
        for robot in self.ids:
            at, answers = self.answers(robot)
            rates[robot] = (answers - before[robot][1]) / (at - before[robot][0])
        check(min(rates.values()) > 0, f"{self.name}: a robot has no answers: {rates}")
        asking = sum(added(asked, before_stops).values())
        return rates, f"{stops}, {asking} in all while no more than that was asked"

    def stops(self):
        """Asked slowly: a COMMAND, and the EVENT that tells the value, cost a robot an answer, and
        several in a second would cost stops."""
        stops = {}
        for robot in self.ids:
            if robot > 100:
                stops[robot] = self.logged_stops(robot)
            else:
                time.sleep(BETWEEN_QUESTIONS_S)
                stops[robot] = self.get(robot, FAIL_SAFE_STOPS)
        return stops

    def logged_stops(self, robot):
        """Of a pheromone-robot, which tells each change of why it stands."""
        log = (self.folder / f"log{robot - 100}").read_text(encoding="utf-8")
        stands = ["(fail-safe)" in line for line in log.splitlines()
                  if re.search(" s  (stands|drives)", line)]
        return sum(now and not before for before, now in zip([False, *stands], stands))

    def stops_in(self, seconds):
        before = self.stops()
        time.sleep(seconds)
        return sum(added(before, self.stops()).values())

    def quanta(self):
        status, told = self.daemon.call("GET", "/api/v1/field?pheromone=trail")
        check(status == 200, told)
        return round(sum(map(sum, json.loads(told)["values"])) / 0.125)

    def settled_quanta(self):
        """Once there were no more for so long that a robot would have repeated its last change: it
        may be about to say HELLO again, which in bad air takes some attempts."""
        quanta, since = self.quanta(), time.monotonic()
        while time.monotonic() < since + SETTLED_S:
            time.sleep(1)
            now = self.quanta()
            if now != quanta:
                quanta, since = now, time.monotonic()
        return quanta

    def set(self, robot, setting, value):
        for _ in range(20):
            if subprocess.run(
                    [self.arguments.bin_dir / "pheromonectl", "--socket",
                     self.folder / "pheromoned.sock", "command", "radio-a", str(robot), "set",
                     str(setting), str(value)], capture_output=True, check=False).returncode == 0:
                return
        raise AssertionError(f"robot {robot} does not acknowledge setting {setting}")

    def clients(self):
        status, told = self.daemon.call("GET", "/api/v1/clients")
        check(status == 200, told)
        return json.loads(told)["clients"]

    def present(self):
        return {client["id"] for client in self.clients()}

    def finish(self):
        """What the air says at its end. The daemon's comes before: it finishes the frame on the
        air."""
        for robot in self.robots:
            end(robot)
        self.daemon.stop()
        self.air.send_signal(signal.SIGTERM)
        told = self.air.communicate(timeout=30)[0]
        check(self.air.returncode == 0, f"the air ended with {self.air.returncode}")
        return told


def preloaded(shim):
    """With what this program has preloaded itself."""
    return ":".join(filter(None, [str(shim), os.environ.get("LD_PRELOAD")]))


def end(process):
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def added(before, after):
    return {robot: count - before[robot] for robot, count in after.items()}


def tell(name, rates, stops, most=None):
    total = sum(rates.values())
    beside = f", {total / most:.2f} of B_1" if most else ""
    print(f"{name}: {total:.1f} answers/s{beside}; of each "
          + " ".join(f"{rate:.1f}" for rate in rates.values())
          + f"; fail-safe stops {stops}", flush=True)


def of_images(folder, count):
    # An image has its own UART, and is stepped each millisecond.
    return [f"{folder}/robot{robot},uart=0,turn=1.5" for robot in range(1, count + 1)]


def damage(arguments):
    for damaged in (0.0, 0.01, 0.03):
        for count in (8, 4):
            name = f"{count} AVR images, {100 * damaged:g} % of bytes damaged"
            with Channel(arguments, name) as channel:
                channel.serve(path="radio-a.pty", turnaround_ms=2)
                channel.on_air(f"{channel.folder}/radio-a.pty,open=1,adapter=16",
                               *of_images(channel.folder, count), damaged=damaged)
                channel.images(count, STANDS, LAYS_TRAIL)
                rates, stops = channel.measure(arguments.seconds)
                told = channel.finish()
                print(told if arguments.verbose else "", end="")
                bound = (1 - damaged) ** TRACE_BYTES / (TRACE_BYTES * BYTE_S + 2 * 0.002)
                tell(name, rates, stops, min(bound, 5 * count))


def mixed(arguments):
    name = "three AVR images, and pheromone-robot behind an adapter of 16 ms"
    with Channel(arguments, name) as channel:
        channel.serve(path="radio-a.pty", turnaround_ms=2)
        folder = channel.folder
        channel.on_air(f"{folder}/radio-a.pty,open=1,adapter=16", *of_images(folder, 3),
                       f"{folder}/modem1,adapter=16")
        channel.images(3, STANDS, LAYS_TRAIL)
        channel.attached("ttyUSB")
        rates, stops = channel.measure(arguments.seconds)
        told = channel.finish()
        print(told if arguments.verbose else "", end="")
        tell(name, rates, stops)


def contend(arguments):
    name = "four pheromone-robots behind adapters of 16 ms"
    with Channel(arguments, name) as channel:
        channel.serve(path="radio-a.pty", turnaround_ms=2)
        folder = channel.folder
        channel.on_air(f"{folder}/radio-a.pty,open=1,adapter=16",
                       *(f"{folder}/modem{robot},adapter=16" for robot in range(1, 5)))
        channel.attached(*4 * ["ttyUSB"])
        rates, stops = channel.measure(arguments.seconds)
        told = channel.finish()
        print(told if arguments.verbose else "", end="")
        tell(name, rates, stops)


def measured(arguments):
    name = "pheromone-robots that measure their adapters"
    with Channel(arguments, name) as channel:
        channel.serve(path="radio-a.pty", turnaround_ms=2)
        folder = channel.folder
        channel.on_air(f"{folder}/radio-a.pty,open=1", f"{folder}/modem1,adapter=16",
                       f"{folder}/modem2,adapter=1")
        expected = ["contends for the channel", "takes turns"]
        channel.attached(*(["", "ttyUSB"] if arguments.strict else [""]))
        for robot in range(1, len(channel.robots) + 1):
            log = folder / f"log{robot}"
            found = re.compile(r"measured, its adapter holds bytes back for [\d.]+ ms; the robot "
                               + expected[robot - 1])
            await_that(lambda: found.search(log.read_text()), lambda: f"{found}: {log.read_text()}")
        rates, stops = channel.measure(arguments.seconds)
        channel.finish()
        print("".join(line for robot in range(1, len(channel.robots) + 1)
                      for line in open(folder / f"log{robot}", encoding="utf-8")
                      if " s  modem" in line), end="")
        tell(name, rates, stops)


def once(arguments):
    for damaged in (0.01, 0.03):
        for contends in (False, True):
            count_once(arguments, damaged, contends)


def count_once(arguments, damaged, contends):
    name = (f"{'pheromone-robots that contend' if contends else 'AVR images in rounds'}, "
            f"{100 * damaged:g} % of bytes damaged")
    chance = random.Random(f"{damaged} {contends}")
    with Channel(arguments, name) as channel:
        channel.serve(path="radio-a.pty", turnaround_ms=2)
        folder = channel.folder
        robots = ([f"{folder}/modem{robot},adapter=16" for robot in range(1, 5)] if contends
                  else of_images(folder, 4))
        channel.on_air(f"{folder}/radio-a.pty,open=1,adapter=16", *robots, damaged=damaged)
        if contends:
            channel.attached(*4 * ["ttyUSB"])
        else:
            channel.images(4, STANDS, LAYS_TRAIL)
        await_that(lambda: channel.present() >= set(channel.ids), "all robots are there")
        kills, resets = 0, 0
        before = 0
        while before < arguments.changes:
            # Those that contend take long to say HELLO to each daemon.
            for _ in range(chance.randrange(1, 5) * (6 if contends else 1) * arguments.calm):
                time.sleep(chance.uniform(0.5, 4))
                if not contends:
                    chance.choice(channel.robots).send_signal(signal.SIGUSR1)
                    resets += 1
            channel.kill_daemon()
            kills += 1
            quanta = channel.quanta()
            check(quanta >= before, f"{name}: {before - quanta} changes are gone after kill {kills}")
            before = quanta
            if arguments.verbose:
                print(f"{name}: {quanta} changes, {kills} kills, {resets} resets", flush=True)
        for robot in channel.ids:
            channel.set(robot, 3, 0)  # no more trail, once the last change is made
        quanta = channel.settled_quanta()
        told = channel.finish()
        made = [int(found) for found in re.findall(r" traces (\d+)", told)]
        check(sum(made) == quanta, f"{name}: {sum(made)} changes were made, the map has {quanta}:"
              f"\n{told}")
        print(f"{name}: {quanta} changes, {kills} kills of the daemon, {resets} resets of robots: "
              "each is on the map once", flush=True)


def sick(arguments):
    for name, how, seconds in (("six AVR images, disk stuck for 3 s", "stuck", 3),
                               ("two pheromone-robots that contend, 300 ms a sync", "slow",
                                arguments.seconds)):
        with Channel(arguments, name) as channel:
            folder = channel.folder
            channel.serve(path="radio-a.pty", turnaround_ms=2, environment={
                "LD_PRELOAD": preloaded(arguments.tests_dir / "libsick_disk_shim.so"),
                "SICK_DISK": str(folder)})
            if how == "stuck":
                channel.on_air(f"{folder}/radio-a.pty,open=1,adapter=16", *of_images(folder, 6))
                channel.images(6, STANDS, LAYS_TRAIL)
            else:
                channel.on_air(f"{folder}/radio-a.pty,open=1,adapter=16",
                               *(f"{folder}/modem{robot},adapter=16" for robot in (1, 2)))
                channel.attached(*2 * ["ttyUSB"])
            channel.await_robots()
            well = channel.stops_in(CALM_S + seconds)
            before = channel.stops()
            time.sleep(CALM_S)  # what was asked last has cost an answer, too
            (folder / how).touch()
            time.sleep(seconds)
            (folder / how).unlink()  # now they can be asked
            ill = sum(added(before, channel.stops()).values())
            after = channel.stops_in(CALM_S + seconds)
            made = channel.quanta()
            await_that(lambda: channel.quanta() > made, "changes are made again")
            channel.finish()
            load = pathlib.Path("/proc/loadavg").read_text(encoding="ascii").split()[0]
            print(f"{name}: {ill} fail-safe stops in these {seconds:g} s and {CALM_S} s before them, "
                  f"{well} in as long before that and {after} after; load {load}", flush=True)


def keyed(arguments):
    name = "two AVR images and a daemon, keyed by a line (40 ms to rise, 10 ms to leave)"
    with Channel(arguments, name) as channel:
        folder = channel.folder
        for key in ("key0", "key1", "key2"):
            os.mkfifo(folder / key)
        modem = "turn=5,rise=40,hold=10"
        channel.on_air(f"{folder}/server,{modem},key={folder}/key0,adapter=16",
                       *(f"{folder}/robot{robot},uart=0,{modem},key={folder}/key{robot}"
                         for robot in (1, 2)))
        channel.serve(kind="serial", port=os.path.realpath(folder / "server"), turnaround_ms=95,
                      ptt="rts", ptt_lead_ms=60, ptt_tail_ms=30, environment={
                          "LD_PRELOAD": preloaded(arguments.tests_dir / "libpty_as_serial_shim.so"),
                          "PTY_SHIM_KEY": str(folder / "key0")})
        channel.images(2, STANDS, LAYS_TRAIL, PTT_LEAD % 60, PTT_TAIL % 30, ptt=True)
        rates, stops = channel.measure(arguments.seconds)
        told = channel.finish()
        cut = [int(found) for found in re.findall(r" cut (\d+)", told)]
        check(cut == [0, 0, 0] or not arguments.strict,
              f"bytes were cut by their own modems:\n{told}")
        print(told if arguments.verbose else "", end="")
        tell(name, rates, stops)


CASES = {"damage": damage, "mixed": mixed, "contend": contend, "measured": measured, "once": once,
         "keyed": keyed, "sick": sick}


def main():
    parser = argparse.ArgumentParser()
    for folder in ("bin_dir", "tests_dir", "image"):
        parser.add_argument(folder, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--slow", type=int, default=1, metavar="N", help="clocks N times slower")
    parser.add_argument("--changes", type=int, default=10_000, help="of each run of once")
    parser.add_argument("--calm", type=int, default=1, metavar="N",
                        help="N times as long between two kills of once")
    parser.add_argument("--strict", action="store_true")
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=" ".join(CASES))
    arguments = parser.parse_intermixed_args()
    if arguments.slow > 1 and "SLOW_CLOCK" not in os.environ:
        os.execve(sys.executable, [sys.executable, *sys.argv],
                  {**os.environ, "SLOW_CLOCK": str(arguments.slow),
                   "LD_PRELOAD": preloaded(arguments.tests_dir / "libslow_clock_shim.so")})
    for case in arguments.cases or CASES:
        CASES[case](arguments)
    print("ok")


if __name__ == "__main__":
    main()
