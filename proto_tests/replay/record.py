#!/usr/bin/env python3
"""Makes the captures of the replay corpus: a real pheromoned, and robots that follow a script.

Usage: record.py BIN_DIR [NAME]...          all of them, or only these

Each NAME.pcapng comes with NAME.answers, which begins with where it is from; ./bless writes the
answers of the engine below. Run it when a format has changed on purpose (the state that a capture
begins with is in the engine's format), and look at the difference before committing it.
"""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from stranger import wire  # noqa: E402
from stranger.client import Client, ErrorAnswer, open_terminal  # noqa: E402

PATIENCE_S = 30
REPLACE, EXPECT = 1, 2  # flags of WRITE and ERASE

CONFIG = """[map]
width_m = 4.0
height_m = 4.0
cell_m = 0.1
[antennas]
bias_m = 0.33
[[pheromone]]
type = 1
name = "trail"
core_m = 0.1
sigma_m = 0.4
tau_s = 0.05
quantum = 0.125
maximum = 1.0
[[pheromone]]
type = 2
name = "path"
core_m = 0.1
sigma_m = 0.4
tau_s = 0
quantum = 0.125
maximum = 1.0
[[path]]
pheromone = "path"
shape = "polyline"
points_m = [[0.5, 2.0], [3.5, 2.0]]
[[link]]
name = "radio-a"
kind = "pty"
path = "radio-a.pty"
gap_timeout_ms = 50
[[link]]
name = "radio-b"
kind = "pty"
path = "radio-b.pty"
[capture]
start = true
folder = "captures"
"""

# Nine tags reach (2, 2) m: two more than a row of SCAN's answer has room for.
TAGS = CONFIG + "".join(f"""[[tag]]
name = "place-{i}"
x_m = {1.6 + 0.1 * i:.1f}
y_m = 2.0
range_m = 1.0
""" for i in range(9)) + """[[tag]]
name = "narrow"
x_m = 3.5
y_m = 0.5
range_m = 0.3
slots = 2
"""

# Robots that carry energy, guided by a net on tags; the recording begins when it is told to.
BENCH = TAGS.replace("start = true", "start = false") + "".join(f"""[[tag]]
name = "{name}"
x_m = 1.0
y_m = 3.0
""" for name in ("N1", "N2", "N3", "N4", "N5", "N6", "S1", "S2", "S3", "S4", "P", "Src")) + """[[net]]
name = "bench"
file = "nets/pheromone.toml"
robot_file = "nets/robot.toml"
parameters = { robots = 2 }
period_ms = 50
law = "e3"
rate = 0.1
source = 100000
"""


class Lab:
    """A pheromoned in a folder of its own, a line to each of its links, and a robot on each."""

    def __init__(self, bin_dir, folder, config):
        self.bin_dir = bin_dir
        self.folder = folder
        (folder / "lab.toml").write_text(config)
        shutil.copytree(HERE.parents[1] / "deploy/examples/nets", folder / "nets")
        with open(folder / "log", "wb") as log:
            self.process = subprocess.Popen([bin_dir / "pheromoned", "--config", "lab.toml"],
                                            cwd=folder, stdout=log, stderr=log)
        self.await_log("ready: 2 of 2 links up")
        self.lines = [open_terminal(folder / f"radio-{it}.pty") for it in "ab"]
        self.robots = [Client(line, 1 + 15 * i, timeout=5) for i, line in enumerate(self.lines)]
        for i, robot in enumerate(self.robots):  # one of them has the number of DLE
            robot._ping_tag = b"corpus %d" % i  # the same in each run

    def await_log(self, text, times=1):
        deadline = time.monotonic() + PATIENCE_S
        while (self.folder / "log").read_text().count(text) < times:
            if time.monotonic() > deadline or self.process.poll() is not None:
                sys.exit(f"waited for {text!r} in\n{(self.folder / 'log').read_text()}")
            time.sleep(0.01)

    def reload(self, config, times):
        (self.folder / "lab.toml").write_text(config)
        self.process.send_signal(signal.SIGHUP)
        self.await_log("configuration reread", times)

    def ctl(self, *arguments, status=0):
        result = subprocess.run([self.bin_dir / "pheromonectl", *arguments], cwd=self.folder)
        if result.returncode != status:
            sys.exit(f"{arguments} ended with {result.returncode} instead of {status}")

    def end(self):
        """The capture."""
        for line in self.lines:
            line.close()
        self.process.send_signal(signal.SIGTERM)
        if self.process.wait(PATIENCE_S) != 0:
            sys.exit((self.folder / "log").read_text())
        [capture] = (self.folder / "captures").iterdir()
        return capture


def frame(name, client, **fields):
    return wire.encode(wire.build(name, client, **fields))


def await_frames(line, count):
    for _ in range(count):
        if line.receive(time.monotonic() + PATIENCE_S) is None:
            sys.exit("an answer is missing")


def traffic(lab):
    """Two robots on two links send HELLO, TRACE, DEPOSIT, SENSE of both types, PING and EVENT."""
    for robot in lab.robots:
        robot.hello(0x1010)
    for i in range(6):
        for robot in lab.robots:
            robot.trace(1, 1000 + 50 * i, 2000, 16 * i)
            robot.sense(2, 1000 + 50 * i, 1900, 0)
            robot.sense(1, 1000, 2000, 0x8000, wide=True)
    lab.robots[0].deposit(2, 3000, 1000, 8)
    lab.robots[0].sense(2, 2900, 1000, 0)
    lab.robots[1].event(3, -16)
    lab.robots[1].ping(b"\x10\x02\x10\x03")


def damaged(lab):
    """Noise, bad CRCs, bad escapes, frames that are too long, too short, cut off or restarted, and
    one that is late in the middle: link radio-a times out, radio-b waits."""
    for robot in lab.robots:
        robot.hello(7)
    good = frame("SENSE", 1, type=2, x=1000, y=2000, heading=0)
    wrong = good[:-4] + bytes([good[-4] ^ 1]) + good[-3:]
    for bytes_before in (b"noise\x10", wrong, b"\x10\x02\x01\x10\x41", b"\x10\x02" + bytes(80),
                         b"\x10\x02\x10\x03", good[:7], b"\x10\x02\x00\x00\x00\x00\x10\x03"):
        lab.lines[0].send(bytes_before)
        lab.lines[0].send(good)
        await_frames(lab.lines[0], 1)
    for line in lab.lines:
        line.send(good[:6])
    time.sleep(0.1)
    for line in lab.lines:
        line.send(good[6:])
    await_frames(lab.lines[1], 1)
    lab.robots[0].ping(b"still here")


def retries(lab):
    """Requests again, byte for byte; a seq for two things; an old one; a robot that said no HELLO; a
    HELLO with a new nonce; opcodes, lengths and places that do not exist."""
    robot, line = lab.robots[0], lab.lines[0]
    line.send(frame("TRACE", 1, type=1, seq=0, x=1000, y=2000, heading=0))
    await_frames(line, 1)
    robot.hello(7)
    for seq in (1, 1, 2, 2, 1, 2):
        line.send(frame("TRACE", 1, type=1, seq=seq, x=1000, y=2000 + seq, heading=0))
    await_frames(line, 5)
    line.send(frame("TRACE", 1, type=1, seq=2, x=0, y=0, heading=0))
    line.send(frame("TRACE", 1, type=9, seq=3, x=1000, y=2000, heading=0))
    line.send(frame("DEPOSIT", 1, type=1, seq=4, x=-1000, y=2000, quanta=1))
    line.send(wire.encode(bytes([1, 0x7F])) + wire.encode(bytes([1, 0x01, 0])))
    await_frames(line, 5)
    robot.hello(8)  # takes number 5: what was sent before is not executed any more
    for seq in (2, 5, 6):
        line.send(frame("TRACE", 1, type=1, seq=seq, x=1000, y=2000, heading=0))
    await_frames(line, 2)


def evaporation(lab):
    """A trail loses one quantum every 50 ms, while two robots sense it from both sides."""
    for robot in lab.robots:
        robot.hello(7)
    lab.robots[0].deposit(1, 2000, 2000, 8)
    for _ in range(12):
        for robot in lab.robots:
            robot.sense(1, 1900, 2000, 0)
        time.sleep(0.04)
    lab.robots[1].trace(1, 2000, 2000, 0)
    lab.robots[0].sense(1, 1900, 2000, 0)


def reload(lab):
    """SIGHUP twice: another tau, which freezes what is there; another antenna distance, after which
    robots have to say HELLO again."""
    robot = lab.robots[0]
    robot.hello(7)
    robot.deposit(1, 2000, 2000, 8)
    slower = CONFIG.replace("tau_s = 0.05", "tau_s = 0.2")
    lab.reload(slower, 1)
    for _ in range(4):
        robot.sense(1, 1900, 2000, 0)
        time.sleep(0.04)
    lab.reload(slower.replace("bias_m = 0.33", "bias_m = 0.2"), 2)
    lab.lines[0].send(frame("TRACE", 1, type=1, seq=9, x=1000, y=2000, heading=0))
    await_frames(lab.lines[0], 1)
    robot.hello(7)
    robot.trace(1, 1900, 2000, 0)


def commands(lab):
    """A command that is repeated until it is acknowledged, and a deposit of the operator, undone."""
    acknowledged = []
    robot = Client(lab.lines[0], 1, timeout=5, on_command=lambda it: acknowledged.append(it) or 0)
    robot.hello(7)
    lab.ctl("command", "radio-a", "1", "speed", "272", "--no-wait")
    time.sleep(0.6)  # deaf for two transmissions
    robot.listen(0.2)
    lab.ctl("deposit", "trail", "2", "2", "--quanta", "8")
    robot.sense(1, 1900, 2000, 0)
    lab.ctl("undo")
    robot.sense(1, 1900, 2000, 0)
    lab.ctl("halt", status=1)  # the robot does not listen while it waits
    robot.listen(0.5)


def expect_refusal(reason, request, *arguments, **fields):
    try:
        request(*arguments, **fields)
    except ErrorAnswer as refused:
        if wire.REASONS.get(refused.reason) == reason:
            return
        sys.exit(f"expected {reason!r}, got {refused}")
    sys.exit(f"expected {reason!r}, but it was done")


def expect(found, expected):
    if found != expected:
        sys.exit(f"expected {expected!r}, got {found!r}")


def statement(robot, predicate, number):
    """Subject the robot, predicate of its strings 1 and `predicate`, object an integer."""
    return dict(subject_namespace=-17, subject=robot, predicate_namespace=1, predicate=predicate,
                object_namespace=-3, object=number)


def tags(lab):
    """All TAG messages: SYMBOL and RESOLVE of all kinds; SCAN of nine tags; READ from slot to slot;
    WRITE with REPLACE, EXPECT, a lease, a repetition and every refusal; ERASE; what is dropped,
    what the operator wrote, a lease that ends, and tags that are no longer configured."""
    here, narrow = (2000, 2000), (3500, 500)
    one, two = lab.robots
    third = Client(lab.lines[0], 3, timeout=5)
    third._ping_tag = b"corpus 3"
    for robot in (one, two, third):
        robot.hello(7)
    define_symbols(one, two, third)
    write_and_read(lab, here, one, two, third)
    fill_up(narrow, one, two)
    lease_and_protect(lab, here, one, two)
    lab.reload(TAGS.replace('name = "place-8"', 'name = "new-place"'), 1)
    expect([row[0] for row in one.scan(*here)], [1, 2, 3, 4, 5, 6, 7, 8, 9])
    lab.reload(CONFIG, 2)
    expect(one.scan(*here), [])
    expect_refusal("no tag in range", one.read, *here, 1)  # its blocks wait for a configuration
    lab.reload(TAGS, 3)
    expect(len(one.read(*here, 1)), 3)


def define_symbols(one, two, third):
    expect_refusal("unknown symbol", one.define, 1, "http://example.org/ns#")
    expect(one.register("123-233-201"), 1)
    expect(two.register("00:11:22:33:44:55", 16), 16)
    expect(third.register("x" * 56), 2)
    expect(one.register("123-233-201"), 1)
    expect_refusal("not permitted", one.register, "123-233-201", 5)
    expect_refusal("not permitted", third.register, "another", 16)
    expect_refusal("bad value", third.register, "line\n")
    for robot in (one, two):
        robot.define(1, "http://example.org/ns#")
        robot.define(2, "lookingfortag")
        robot.define(3, "\u00e4\u20ac")
    one.define(2, "lookingfortag")
    expect_refusal("not permitted", one.define, 2, "occupied")
    expect_refusal("bad value", one.define, 0, "zero")
    for kind, number, reason in ((3, 1, None), (3, 16, "not permitted"), (9, 1, "bad value")):
        symbol = dict(kind=kind, number=number, text=b"")
        if reason is None:
            third._change("SYMBOL", **symbol)
        else:
            expect_refusal(reason, third._change, "SYMBOL", **symbol)
    expect_refusal("not permitted", one._change, "SYMBOL", kind=3, number=16, text=b"")
    expect(two.resolve(1, 2), "lookingfortag")
    expect(two.resolve(2, 3), "\u00e4\u20ac")  # a string of robot 1, by the mapping

    def ask(kind, robot, number, offset):
        request = wire.build("RESOLVE", 1, kind=kind, robot=robot, number=number, offset=offset)
        return one._ask(request, tries=1)

    for kind, robot, number, offset in ((1, 2, 0, 0), (1, 2, 0, 50), (1, 2, 0, 200), (2, 16, 3, 1),
                                        (3, 2, 0, 0), *((4, 0, row, 0) for row in range(4))):
        ask(kind, robot, number, offset)
    for missing in ((1, 9, 0), (2, 1, 9), (3, 1, 0), (4, 0, -1), (4, 0, 10), (7, 1, 1)):
        expect_refusal("unknown symbol", ask, *missing, 0)


def write_and_read(lab, here, one, two, third):
    rows = one.scan(*here)
    expect([row[0] for row in rows], [1, 2, 3, 4, 5, 6, 7, 8, 9])
    expect(two.scan(0, 4000), [])
    expect(one.read(*here, 1), [])
    one.write(*here, 1, statement(1, 2, 244), time=1138458000)
    two.write(*here, 1, statement(16, 2, -1))
    third.write(*here, 1, statement(2, 2, 0x10101010), slot=5)
    expect([it["slot"] for it in two.read(*here, 1)], [0, 1, 5])
    one.write(*here, 1, statement(1, 2, 245), flags=REPLACE, time=1138458060)
    one.write(*here, 1, statement(1, 3, 1), flags=REPLACE, time=1138458061)
    expect([it["object"] for it in one.read(*here, 1)], [245, -1, 1, 0x10101010])
    two.write(*here, 1, statement(16, 2, -2), slot=5)  # over another robot's
    for wrong in (dict(flags=4), dict(slot=8), dict(lease_s=3601), dict(object_namespace=-7,
                                                                        object=86_400_000)):
        expect_refusal("bad value", one.write, *here, 1, statement(1, 2, 0) | wrong)
    for place, tag in ((here, 10), (here, 99), ((-100_000, 0), 1)):
        expect_refusal("no tag in range", one.write, *place, tag, statement(1, 2, 0))
        expect_refusal("no tag in range", one.read, *place, tag)
        expect_refusal("no tag in range", one.erase, *place, tag, 0)
    # The same WRITE four times, as if its answers were lost, and another one under its number.
    seq = two.next_seq
    fields = dict(seq=seq, x=2000, y=2000, tag=2, slot=255, flags=0, expected=0, lease_s=0, time=0)
    for _ in range(4):
        lab.lines[1].send(frame("WRITE", 16, **fields, **statement(16, 2, 7)))
    lab.lines[1].send(frame("WRITE", 16, **fields, **statement(16, 2, 8)))
    await_frames(lab.lines[1], 5)
    two.next_seq = seq + 1
    expect([it["object"] for it in one.read(*here, 2)], [7])


def fill_up(narrow, one, two):
    """The tag has two slots, of which one may be protected."""
    tag = 10
    for i in range(3):  # the oldest is dropped
        one.write(*narrow, tag, statement(1, 2, i), time=1138458000 + i)
    expect([it["object"] for it in one.read(*narrow, tag)], [2, 1])
    two.write(*narrow, tag, statement(16, 2, 100), lease_s=3600)
    expect_refusal("tag full", one.write, *narrow, tag, statement(1, 2, 3), lease_s=60)
    one.write(*narrow, tag, statement(1, 2, 4))
    expect([it["object"] for it in one.read(*narrow, tag)], [4, 100])


def lease_and_protect(lab, here, one, two):
    """Two robots claim a place, and one of them leaves it to its lease."""
    tag = 3
    [seen] = [row[3] for row in one.scan(*here) if row[0] == tag]
    expect([row[3] for row in two.scan(*here) if row[0] == tag], [seen])
    claim = dict(flags=EXPECT, expected=seen, lease_s=60)
    mine = one.write(*here, tag, statement(1, 2, 1), **claim)
    expect_refusal("generation changed", two.write, *here, tag, statement(16, 2, 1), **claim)
    slot, generation = mine["slot"], mine["slot_generation"]
    again = dict(slot=slot, flags=EXPECT, expected=generation, lease_s=1)
    expect_refusal("tag protected", two.write, *here, tag, statement(16, 2, 1), slot=slot)
    expect_refusal("tag protected", two.erase, *here, tag, slot)
    one.write(*here, tag, statement(1, 2, 2), **again)
    expect_refusal("generation changed", one.write, *here, tag, statement(1, 2, 3), **again)
    expect([it["lease_s"] for it in two.read(*here, tag)], [1])
    lab.ctl("tags", "write", "place-0", "15 lookingfortag 244", "--lease", "600")
    [operators] = [it["slot"] for it in one.read(*here, 1) if it["flags"] == 1]
    expect_refusal("tag protected", one.erase, *here, 1, operators)
    lab.ctl("tags", "erase", "place-0", str(operators))
    time.sleep(1.1)
    expect(two.read(*here, tag), [])
    two.write(*here, tag, statement(16, 2, 1), lease_s=60)
    two.erase(*here, tag, 0)
    two.erase(*here, tag, 0)
    [block, *_] = one.read(*here, 1)
    erase = dict(x=2000, y=2000, tag=1, slot=block["slot"], flags=EXPECT)
    generation = block["slot_generation"]
    expect_refusal("generation changed", one._change, "ERASE", **erase, expected=generation - 1)
    one._change("ERASE", **erase, expected=generation)
    expect_refusal("bad value", one._change, "ERASE", **erase | dict(slot=8), expected=0)
    expect_refusal("bad value", one._change, "ERASE", **erase | dict(flags=1), expected=0)


def parts(lab):
    """It begins in the middle, with a state that holds robots, one of them with a goal, pheromone,
    symbols and blocks on tags, and a net whose pheromones evaporate; all of them go on."""
    here = (2000, 2000)
    one, two = lab.robots
    for robot in (one, two):
        robot.hello(7)
    one.register("123-233-201")
    two.register("00:11:22:33:44:55", 16)
    for robot in (one, two):
        robot.define(1, "http://example.org/ns#")
        robot.define(2, "lookingfortag")
    one.write(*here, 1, statement(1, 2, 244), time=1138458000)
    two.write(*here, 1, statement(16, 2, -1), lease_s=600)
    one.deposit(2, 3000, 1000, 8)
    for robot in (one, two):
        robot.trace(1, 1000, 2000, 0x4000)
    lab.ctl("goto", "radio-a", "1", "3", "3")
    lab.ctl("capture", "start")
    one.sense(1, 1000, 2000, 0)
    one.sense(2, 2900, 1000, 0)
    two.sense(2, 2900, 1000, 0)
    expect([it["object"] for it in two.read(*here, 1)], [244, -1])
    expect(two.resolve(1, 1), "http://example.org/ns#")
    expect_refusal("tag protected", one.erase, *here, 1, 1)
    places = [row[0] for row in two.scan(1000, 3000)][:3]
    for place in places:
        two.read(1000, 3000, place)
    time.sleep(0.2)  # the net's pheromones evaporate
    for place in places:
        two.read(1000, 3000, place)
    two.trace(1, 1000, 2000, 0x4000)
    lab.ctl("goto", "radio-a", "1", "--cancel")
    one.sense(1, 1000, 2000, 0)


SCENARIOS = [(traffic, CONFIG), (damaged, CONFIG), (retries, CONFIG), (evaporation, CONFIG),
             (reload, CONFIG), (commands, CONFIG), (tags, TAGS), (parts, BENCH)]


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    names = sys.argv[2:] or [it.__name__ for it, _ in SCENARIOS]
    version = subprocess.run([bin_dir / "pheromoned", "--version"], text=True, capture_output=True,
                             check=True).stdout.strip()
    for scenario, config in SCENARIOS:
        name = scenario.__name__
        if name not in names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            lab = Lab(bin_dir, pathlib.Path(folder), config)
            scenario(lab)
            capture = lab.end()
            recorded = time.strftime("%Y-%m-%d", time.gmtime(os.stat(capture).st_mtime))
            (HERE / f"{name}.pcapng").write_bytes(capture.read_bytes())
        what = " ".join(scenario.__doc__.split())
        (HERE / f"{name}.answers").write_text(
            f"# {what}\n# Recorded by record.py with {version} on {recorded}; written by "
            "./bless. Field time in ms, link, frame.\n")
        print(f"{name}: recorded")
    subprocess.run([HERE / "bless", bin_dir, *names], check=True)


if __name__ == "__main__":
    main()
