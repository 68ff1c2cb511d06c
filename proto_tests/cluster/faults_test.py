#!/usr/bin/env python3
"""A cluster under faults: what was acknowledged is in the log, once and in order, whatever dies.

    faults_test.py BIN_DIR TESTS_DIR                      some faults, for the gate
    faults_test.py BIN_DIR TESTS_DIR --faults 200         two hundred, one every 2 to 8 s
    faults_test.py BIN_DIR TESTS_DIR --plant              answers before the log has them: to be found
    faults_test.py BIN_DIR TESTS_DIR --leader-kills 50 --csv FILE
                                                          silences and latencies

Two machines with etcd and pheromoned, one with etcd only, in network namespaces (network.py); robots
over UDP and TCP with two servers, with one, and on a terminal; operators at both servers. `--seed` makes
the same schedule again; it is printed. histories.py judges; what it says is wrong makes the exit status
1, and `--keep FOLDER` keeps journals, histories and logs. Nothing is asserted about how long anything
takes, except that a halt comes at all: latencies, silences and the times of halts are printed.
"""

import argparse
import csv
import datetime
import pathlib
import random
import re
import signal
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from attach_test import Program  # noqa: E402
from checks import quantile  # noqa: E402
from cluster import histories  # noqa: E402
from cluster.network import can_make  # noqa: E402
from cluster.scene import FLOOR, SERVERS, TCP, UDP, WITNESS, Call, Scene  # noqa: E402
from operated_daemon import await_that  # noqa: E402

SKIPPED = 77
SERVER_LINKS = {"udp": 0, "tcp": 1}  # their indices
AGAIN_S = 180  # that robots may take until everything is answered, once all is healed
HALT_S = 0.1


class Faults:
    """Each method makes a fault of its name, for `s` seconds, and returns when it heals and how."""

    def __init__(self, scene):
        self.scene = scene

    def _leader(self):
        return self.scene.leader() or SERVERS[0]

    def _follower(self):
        return SERVERS[1] if self._leader() == SERVERS[0] else SERVERS[0]

    def _kill(self, s, *processes):
        for it in processes:
            it.kill(time.monotonic() + s)

    def kill_leader(self, s, _):
        self._kill(s, self.scene.servers[self._leader()])

    def kill_follower(self, s, _):
        self._kill(s, self.scene.servers[self._follower()])

    def end_leader(self, _s, _choice):
        self.scene.servers[self._leader()].end()

    def end_follower(self, _s, _choice):
        self.scene.servers[self._follower()].end()

    def kill_etcd(self, s, choice):
        self._kill(s, self.scene.etcds[choice.choice(SERVERS + WITNESS)])

    def kill_leader_machine(self, s, _):
        it = self._leader()
        self._kill(s, self.scene.servers[it], self.scene.etcds[it])

    def kill_follower_machine(self, s, _):
        it = self._follower()
        self._kill(s, self.scene.servers[it], self.scene.etcds[it])

    def kill_all(self, s, _):
        self._kill(s, *self.scene.servers.values(), *self.scene.etcds.values())

    def lose_disk(self, s, _):
        """Always the same one: what the other has is all that was ever acknowledged."""
        self.scene.lose_disk(SERVERS[1], time.monotonic() + s)

    def stop_leader(self, s, _):
        self.scene.servers[self._leader()].stop(time.monotonic() + s)

    def stop_follower(self, s, _):
        self.scene.servers[self._follower()].stop(time.monotonic() + s)

    def stop_etcd(self, s, choice):
        self.scene.etcds[choice.choice(SERVERS + WITNESS)].stop(time.monotonic() + s)

    def stop_leader_machine(self, s, _):
        it = self._leader()
        for one in (self.scene.servers[it], self.scene.etcds[it]):
            one.stop(time.monotonic() + s)

    def _cut(self, *pairs):
        for of, to in pairs:
            self.scene.network.cut(of, to)
        return lambda: [self.scene.network.mend(of, to) for of, to in pairs]

    def _others(self, it):
        return [other for other in SERVERS + WITNESS if other != it]

    def cut_leader_off(self, _s, _choice):
        it = self._leader()
        return self._cut(*[(it, other) for other in self._others(it) + [FLOOR]],
                         *[(other, it) for other in self._others(it) + [FLOOR]])

    def cut_leader_from_machines(self, _s, _choice):
        it = self._leader()
        return self._cut(*[(it, other) for other in self._others(it)],
                         *[(other, it) for other in self._others(it)])

    def cut_leader_one_way(self, _s, choice):
        it = self._leader()
        pairs = [(it, other) for other in self._others(it)]
        return self._cut(*(pairs if choice.random() < 0.5 else [(to, of) for of, to in pairs]))

    def cut_follower_off(self, _s, _choice):
        it = self._follower()
        return self._cut(*[(it, other) for other in self._others(it)],
                         *[(other, it) for other in self._others(it)])

    def cut_pair(self, _s, choice):
        of, to = choice.sample(SERVERS + WITNESS, 2)
        return self._cut((of, to), (to, of))

    def cut_pair_one_way(self, _s, choice):
        return self._cut(tuple(choice.sample(SERVERS + WITNESS, 2)))

    def cut_robots(self, _s, choice):
        it = choice.choice(SERVERS)
        return self._cut((FLOOR, it), (it, FLOOR))

    def fill_disk(self, _s, choice):
        full = self.scene.folder / choice.choice(SERVERS) / "sick" / "full"
        full.touch()
        return lambda: full.unlink(missing_ok=True)

    def set_clock(self, _s, choice):
        ahead = self.scene.folder / choice.choice(SERVERS) / "ahead"
        ahead.write_text(str(choice.choice([-3600, 3600])))
        return lambda: ahead.write_text("0")

    def reload(self, _s, choice):
        tau_s = choice.choice([50.0, 60.0, 70.0])
        for it in SERVERS:
            self.scene.write_config(it, tau_s)
        call(self.scene, choice.choice(SERVERS), "/api/v1/reload")

    def step_down(self, _s, _choice):
        call(self.scene, self._leader(), "/api/v1/step-down")


KINDS = [it for it in vars(Faults) if not it.startswith("_")]
SHORT = ["kill_leader", "cut_leader_off", "stop_leader", "kill_etcd", "kill_leader_machine"]


def schedule(seed, count, pause_s, longest_s, kinds):
    """(pause before it in s, kind, its length in s, a seed for its choices) of each."""
    choice = random.Random(seed)
    bag = []
    for _ in range(count):
        if not bag:
            bag = list(kinds)
            choice.shuffle(bag)
        kind = bag.pop()
        yield (round(choice.uniform(*pause_s), 2), kind, round(choice.uniform(0.3, longest_s), 2),
               choice.randrange(1 << 30))


def call(scene, node, target):
    """The status of a POST; 0: none."""
    try:
        return scene.call(node, "POST", target, {})[0]
    except Call:
        return 0


class Run:
    def __init__(self, scene, planned, history):
        self.scene, self.planned, self.history = scene, planned, history
        self.faults = Faults(scene)
        self.heals = []   # (when, how)
        self.halts, self.halted = histories.Halts(), []  # (when, at which server)
        self.wrong = []
        self.ending = threading.Event()
        self.made = []    # (when, kind)

    def wait(self, s):
        end = time.monotonic() + s
        while (left := end - time.monotonic()) > 0:
            time.sleep(min(left, 0.05))
            self.heal_due()

    def heal_due(self, all_of_them=False):
        now = time.monotonic()
        for it in [it for it in self.heals if all_of_them or it[0] <= now]:
            self.heals.remove(it)
            with self.scene.lock:
                it[1]()

    def run(self):
        for number, (pause_s, kind, length_s, seed) in enumerate(self.planned, 1):
            self.wait(pause_s)
            begin = time.monotonic()
            print(f"{begin:.2f} fault {number}: {kind}, {length_s} s", flush=True)
            with self.scene.lock:
                self.made.append((begin, kind))
                how = getattr(self.faults, kind)(length_s, random.Random(seed))
            if how:
                self.heals.append((begin + length_s, how))
        self.wait(3.0)
        self.ending.set()
        self.heal_due(all_of_them=True)
        self.scene.heal()

    def halt(self):
        """Until the end of the faults, at either server in turn. Until a halt has come nothing fails and
        nothing is mended: then it has to come."""
        number = 0
        self.history.touch()
        with open(self.history, encoding="ascii") as history:
            while not self.ending.wait(1.3):
                number += 1
                with self.scene.lock:
                    self._halt(SERVERS[number % 2], history)

    def _halt(self, node, history):
        reached = self.scene.reached(node)
        if not reached:
            return
        self._feed(history)
        at = time.monotonic()
        self.halts.begin(at, {
            robot: server for robot, (t, server) in self.halts.servers.items()
            if t > self.scene.changed_at() and self.scene.robot_nodes[robot][server] in reached})
        if call(self.scene, node, "/api/v1/halt") != 200:
            return
        while self.halts.missing() and not any(it.has_ended() for it in self.scene.servers.values()):
            if time.monotonic() > at + AGAIN_S:
                self.wrong += [f"the halt at {at:.2f} from {node} never came to robot {robot}"
                               for robot in self.halts.missing()]
                break
            time.sleep(0.01)
            self._feed(history)
        self.halted.append((at, node))
        self.halts.end()

    def _feed(self, history):
        for it in histories.following(history):
            self.halts.feed(it)


def judge(run, folder, is_complete, logs, others=()):
    """What is wrong, and prints figures. `logs`: the groups of the log while servers ran, and then."""
    earlier, groups = logs
    scene, program = run.scene, run.scene.tests_dir / "replayed_journal"
    history = histories.read(run.history)
    hashed = {sequence for _, sequence, _ in scene.statuses}
    journals = {it: histories.Journal(program, folder / it / "state", hashed) for it in SERVERS}
    journals |= {f"{it.parent.name}, whose disk was lost ({it.name})": histories.Journal(program, it, hashed)
                 for it in folder.glob("*/lost-*")}
    wrong = [] if is_complete else ["the servers did not come to the same state"]
    for it, journal in journals.items():
        wrong += histories.check_journal(it, journal)
    wrong += histories.check_equal(journals)
    whole = histories.join(journals.values())
    wrong += histories.check_groups(earlier, groups, whole)
    wrong += histories.check_robots(history, whole, others)
    wrong += histories.check_operators(scene.edits, whole)
    wrong += histories.check_hashes(scene.statuses, groups, whole)
    # In order, deposed, at a second signal at once, or by a signal before it takes any.
    for it in SERVERS:
        wrong += [f"{scene.servers[it].name} ended with status {status}"
                  for status in scene.servers[it].endings if status not in (0, 1, 143, -signal.SIGTERM)]
    answered = histories.latencies(history)
    wrong += run.wrong
    found = run.halts.delays
    delays = [it[-1] for it in found]
    late = sum(it > HALT_S for it in delays)
    times = sorted(it for _, it in answered)
    print(f"{len(run.made)} faults; {len(whole.lines)} events; {len(answered)} changes of robots "
          f"acknowledged, {sum(status == 200 for *_, status in scene.edits)} of {len(scene.edits)} edits; "
          f"{len(hashed)} hashes told; {len({term for *_, term in groups})} terms in the "
          f"log; servers ended by themselves "
          f"{sum(len(it.endings) for it in scene.servers.values())} times")
    run.rows = [("changes", times, "", max(times, default=0.0)),
                ("halts", delays, "", max(delays, default=0.0))]
    print(f"changes: p50 {1000 * quantile(times, 0.5):.0f} ms, p99 "
          f"{1000 * quantile(times, 0.99):.0f} ms, longest {1000 * max(times, default=0):.0f} ms")
    print(f"halts: {len(run.halted)}, to {len(delays)} robots: p50 "
          f"{1000 * quantile(delays, 0.5):.1f} ms, {late} later than {1000 * HALT_S:.0f} ms, "
          f"{len(run.wrong)} never")
    for at, robot, delay in found:
        if delay > HALT_S:
            last = max((it for it in run.made if it[0] < at), default=(0, "-"))
            node = next(it[1] for it in run.halted if it[0] == at)
            print(f"  late: at {at:.2f} from {node} to {robot} {delay:.2f} s, {at - last[0]:.2f} s after "
                  f"{last[1]}")
    return wrong


def write(options, fault, faults, table):
    """`table`: (figure, values in s, fail-safe stops, the most in s) of each row."""
    rows = [[options.date, fault, faults, figure, len(values),
             *[f"{1000 * it:.0f}" for it in (quantile(values, 0.5), quantile(values, 0.99), most)], stops]
            for figure, values, stops, most in table]
    for row in rows:
        print(", ".join(map(str, row)))
    if options.csv:
        is_new = not options.csv.exists()
        with open(options.csv, "a", encoding="ascii", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            if is_new:
                writer.writerow(["date", "fault", "faults", "figure", "values", "p50_ms", "p99_ms",
                                 "max_ms", "fail_safe_stops"])
            writer.writerows(rows)


def run_faults(options, planned, folder):
    """What is wrong after these faults."""
    planned = list(planned)
    print(f"seed {options.seed}: {len(planned)} faults", flush=True)
    history = folder / "robots.jsonl"
    with Scene(options.bin_dir, options.tests_dir, folder) as scene:
        scene.begin_robots(options.seed, history)
        scene.begin_operators()
        run = Run(scene, planned, history)
        scene.begin(run.halt)
        run.run()
        is_complete = scene.end_robots(AGAIN_S)
        logs = [scene.groups()]
        is_complete = scene.await_equal(AGAIN_S) and is_complete
        scene.end_servers()
        logs.append(scene.groups())
    wrong = judge(run, folder, is_complete, logs)
    write(options, "all kinds" if not options.only else options.only, len(planned), run.rows)
    return wrong


def run_plant(options, folder):
    """Server a releases answers that the log does not have, and dies: whether that is found."""
    history = folder / "robots.jsonl"
    with Scene(options.bin_dir, options.tests_dir, folder, lies=True) as scene:
        scene.servers["b"].kill(float("inf"))
        await_that(lambda: scene.leader() == "a", "a leads")
        scene.servers["b"].down_until = 0.0
        await_that(lambda: scene.status("b")["cluster"]["role"] == "follows", "b follows")
        history.touch()
        scene.begin_robots(options.seed, history)
        await_that(lambda: len({robot for robot, _ in histories.answered_since(history, 0)})
                   == len(scene.robot_nodes), "all robots are answered")
        lied_at = scene.lie()
        await_that(lambda: histories.answered_since(history, lied_at), "the lie is believed")
        scene.servers["a"].kill(float("inf"))
        await_that(lambda: scene.leader() == "b", "b leads")
        scene.end_robots(0)
        scene.end_servers()
        journal = histories.Journal(options.tests_dir / "replayed_journal", folder / "b" / "state", ())
    lost = [it for it in histories.check_robots(histories.read(history), journal) if "is lost" in it]
    wrong = [it for it in lost for _, body in histories.answered_since(history, lied_at) if body in it]
    print(f"planted: {len(wrong)} acknowledged changes are lost, as they should be; "
          + (wrong[0] if wrong else "none was found"))
    return [] if wrong else ["the planted fault was not found"]


class Drivers:
    """Real robots between simulated Pioneers and the servers, which drive and lay trails."""

    def __init__(self, scene, bin_dir):
        self.robots, self.pioneers = [], []
        for number, (kind, lays) in enumerate(
                [(kind, lays) for kind in ("udp", "tcp") for lays in (False, True)], 21):
            pioneer = Program(*scene.network.command(FLOOR, [
                bin_dir / "pheromone-swarm", "pioneer", "--model", "p3dx-sh", "--tcp", "0"]))
            self.pioneers.append(pioneer)
            pioneer.await_line("Ctrl-C ends it")
            port = int(pioneer.lines[0].split("127.0.0.1:")[1].split(";")[0])
            modems = [word for it in SERVERS for word in (
                "--modem", f"{'udp:' * (kind == 'udp')}{scene.network.address(it)}:"
                           f"{UDP if kind == 'udp' else TCP}")]
            self.robots.append((kind, lays, f"{SERVER_LINKS[kind]}:{number}", Program(*scene.network.command(FLOOR, [
                bin_dir / "pheromone-robot", "--robot", f"127.0.0.1:{port}", *modems, "--start", "5", "5",
                "0", "--speed", "50", "--id", str(number), "--released", *["--lay-trail"] * lays]))))

    def end(self):
        """(kind, lays a trail, longest silence in s, fail-safe stops, silences at moves, name) of each."""
        found = []
        for kind, lays, name, robot in self.robots:
            robot.end(signal.SIGTERM)
            text = robot.text()
            found.append((kind, lays, float(re.search(r"longest time without an answer ([\d.]+)", text)[1]),
                          int(re.search(r"(\d+) fail-safe stops", text)[1]),
                          [float(it) for it in re.findall(r"answers, ([\d.]+) s after", text)], name))
        for it in self.pioneers:
            it.kill()
        return found


def run_kills(options, folder):
    """Kills the leader again and again, each time when both servers are well; measures."""
    history = folder / "robots.jsonl"
    with Scene(options.bin_dir, options.tests_dir, folder) as scene:
        scene.begin_robots(options.seed, history)
        drivers = Drivers(scene, options.bin_dir)
        for *_, robot in drivers.robots:
            robot.await_line(" drives")
        run = Run(scene, [], history)
        kills = []
        for number in range(options.leader_kills):
            await_that(lambda: scene.leader() and all(
                scene.status(it)["cluster"]["role"] in ("leads", "follows") for it in SERVERS),
                "both servers lead or follow")
            run.wait(2.0)
            kills.append(time.monotonic())
            getattr(run.faults, options.only or "kill_leader")(2.5, random.Random(number))
            run.wait(2.5)
        run.wait(2.0)
        is_complete = scene.end_robots(AGAIN_S)
        driven = drivers.end()
        logs = [scene.groups()]
        is_complete = scene.await_equal(AGAIN_S) and is_complete
        scene.end_servers()
        logs.append(scene.groups())
    wrong = judge(run, folder, is_complete, logs, [it[-1] for it in driven])
    lines = histories.read(history)
    pairs = [it for it in lines if it["robot"] in ("0:1", "0:2", "1:3", "1:4")]  # of servers
    over = [[s for at, s in histories.latencies(pairs) if t - s < at < t + 2.0] for t in kills]
    waits = [it for some in over for it in some]
    longest = [max(some, default=0.0) for some in over]
    silences = [it["s"] for it in pairs if it["what"] == "silence"]
    table = [("changes in the 2 s after it", waits, "", max(waits, default=0.0)),
             ("longest wait of a change in each", longest, "", max(longest, default=0.0)),
             ("silences above 0.2 s of robots.py", silences, "", max(silences, default=0.0))]
    for kind, lays, silence, stops, moves, _ in driven:
        table.append((f"silences at moves of pheromone-robot by {kind}{' that lays a trail' * lays}",
                      moves, stops, silence))
    write(options, options.only or "kill_leader", len(kills), table)
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bin_dir", type=lambda it: pathlib.Path(it).resolve())
    parser.add_argument("tests_dir", type=lambda it: pathlib.Path(it).resolve())
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--faults", type=int, default=0)
    parser.add_argument("--pause", type=float, nargs=2, default=(2.0, 8.0), metavar=("MIN", "MAX"),
                        help="between faults, in s")
    parser.add_argument("--longest", type=float, default=8.0, help="of a fault, in s")
    parser.add_argument("--only", help="kinds of faults, with commas between")
    parser.add_argument("--plant", action="store_true", help="answers that the log does not have")
    parser.add_argument("--leader-kills", type=int, default=0, help="measure in so many")
    parser.add_argument("--csv", type=pathlib.Path, help="add the figures to this file")
    parser.add_argument("--date", default=str(datetime.date.today()))
    parser.add_argument("--keep", type=pathlib.Path, help="an empty folder, for everything")
    options = parser.parse_args()
    if not can_make():
        print("skipped: network namespaces need root and iproute2")
        return SKIPPED
    kinds = options.only.split(",") if options.only else KINDS
    planned = (schedule(options.seed, options.faults, options.pause, options.longest, kinds)
               if options.faults else schedule(options.seed, len(SHORT), (1.5, 2.5), 4.0, SHORT))
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or pathlib.Path(temporary)
        folder.mkdir(exist_ok=True)
        wrong = (run_plant(options, folder) if options.plant
                 else run_kills(options, folder) if options.leader_kills
                 else run_faults(options, planned, folder))
    for it in wrong[:40]:
        print(f"WRONG: {it}")
    print(f"{len(wrong)} things are wrong" if wrong else "ok")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
