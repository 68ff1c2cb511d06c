#!/usr/bin/env python3
"""Records a running pheromoned and replays the recording: not a byte may differ.

Four links with four robots each trace, sense, repeat themselves and are damaged by noise, while
trails evaporate; in between a configuration is read again with another tau, the operator gives a
command that nobody acknowledges and lays pheromone, and the daemon is restarted and goes on with
the state that its journal has.

Usage: replay_test.py BIN_DIR [SECONDS]        SECONDS: how long that goes on (default 10)
"""

import json
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from free_numbers import free_port
from operated_daemon import PATIENCE_S, OperatedDaemon, await_that, write_config
from stranger import wire
from stranger.client import Client, Line, NoAnswer, open_terminal
from test_config import link, map_of, pheromone, pty, table

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path()
SECONDS = 10.0
STEPS = 150  # of evaporation, while it goes on
ROBOTS = 4
PTYS = ["radio-a", "radio-b"]
TCPS = ["tcp-a", "tcp-b"]
DISSECTOR = ROOT / "protocol/wireshark/pheromone.lua"


def config(tau_s, ports, max_mb=1000):
    return (map_of() + pheromone(1, "trail", tau_s=round(tau_s, 3)) + table("journal", folder="state")
            + table("capture", folder="captures", start=True, max_mb=max_mb, max_files=0)
            + "".join(map(pty, PTYS))
            + "".join(link(name, "tcp", listen=f"127.0.0.1:{port}") for name, port in zip(TCPS, ports)))


def run(*command, **kwargs):
    return subprocess.run([str(it) for it in command], text=True, capture_output=True,
                          timeout=10 * PATIENCE_S, check=False, **kwargs)


def serve(folder, **options):
    """With all links, whose ports another test could have taken."""
    daemon = OperatedDaemon(BIN, folder, **options)
    if "ready: 4 of 4 links up" not in daemon.log():
        daemon.kill()
        raise AssertionError(daemon.log())
    return daemon


def replay(*files):
    return run(BIN / "pheromonectl", "replay", *files)


class Robots(threading.Thread):
    """The robots of one link, taking turns until told to stop. They all walk on the same circle."""

    def __init__(self, lines, seed):
        super().__init__()
        self.chance = random.Random(seed)
        self.clients = [Client(lines[i % len(lines)], i + 1, timeout=2) for i in range(ROBOTS)]
        self.lines = lines
        self.ended = threading.Event()
        self.trouble = None
        self.start()

    def run(self):
        try:
            for client in self.clients:
                client.hello(self.chance.randrange(1, 0x10000))
            while not self.ended.wait(0.1):
                for client in self.clients:
                    self.take_turn(client)
        except Exception as trouble:  # for the main thread to raise
            self.trouble = trouble
        finally:
            for line in self.lines:
                line.close()

    def take_turn(self, client):
        chance = self.chance
        x, y, heading = chance.randrange(2000, 2400), chance.randrange(100, 500), 0x1010
        seq = client.next_seq
        try:
            client.trace(1, x, y, heading)
            what = chance.randrange(6)
            if what == 0:  # the answer was lost, say: once more, byte for byte
                client.line.send(wire.encode(wire.build("TRACE", client.client_id, type=1, seq=seq,
                                                        x=x, y=y, heading=heading)))
            elif what == 1:  # somebody else's noise
                client.line.send(chance.randbytes(chance.randrange(1, 9)))
            elif what == 2:  # in pieces
                frame = wire.encode(wire.build("SENSE", client.client_id, type=1, x=x, y=y,
                                               heading=heading))
                client.line.send(frame[:5])
                client.line.send(frame[5:])
            client.sense(1, x, y, heading)
        except NoAnswer:  # noise may swallow the beginning of a frame
            pass

    def stop(self):
        self.ended.set()
        self.join(PATIENCE_S)
        if self.trouble:
            raise self.trouble


def all_robots(folder, ports, seed):
    for i, name in enumerate(PTYS):
        yield Robots([open_terminal(folder / f"{name}.pty")], seed + i)
    for i, port in enumerate(ports):
        lines = [Line(socket.create_connection(("127.0.0.1", port)).detach())
                 for _ in range(ROBOTS)]
        yield Robots(lines, seed + 10 + i)


def ctl(daemon, *command):
    result = run(BIN / "pheromonectl", *command, cwd=daemon.folder)
    if result.returncode != 0:
        raise AssertionError(result.stderr)
    return result.stdout


def operate(daemon, port):
    """A command that is never acknowledged, and an operator's deposits."""
    with socket.create_connection(("127.0.0.1", port)) as deaf:
        client = Client(Line(os.dup(deaf.fileno())), 99)
        client.hello(1)
        ctl(daemon, "command", TCPS[0], "99", "halt", "--no-wait")
        ctl(daemon, "deposit", "trail", "5", "5", "--quanta", "3")
        time.sleep(1)  # so that some are sent to a connection, and some to none
        client.line.close()


class ReplayTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.ports = [free_port(), free_port()]
        cls.tau_s = SECONDS / STEPS
        cls.logs = []
        for run_number in range(2):
            write_config(cls.folder, config(cls.tau_s, cls.ports))
            with serve(cls.folder) as daemon:
                robots = list(all_robots(cls.folder, cls.ports, 100 * run_number))
                time.sleep(SECONDS / 4)
                if run_number == 0:
                    write_config(cls.folder, config(1.5 * cls.tau_s, cls.ports))
                    daemon.process.send_signal(signal.SIGHUP)
                    await_that(lambda: "configuration reread" in daemon.log(), "it is reread")
                    operate(daemon, cls.ports[0])
                time.sleep(SECONDS / 4)
                for it in robots:
                    it.stop()
                daemon.stop()
                cls.logs.append(daemon.log())
        cls.files = sorted((cls.folder / "captures").iterdir())

    def test_nothing_differs_by_a_byte(self):
        result = replay(*self.files)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        print(result.stdout, end="")
        self.assertEqual(len(self.files), 2)
        self.assertRegex(self.logs[1], r"journal: \S+ resumed after sequence [1-9]")
        hashes = re.findall(r"state hash ([0-9a-f]{16})\n", result.stdout)
        self.assertEqual(hashes, [re.search(r"state hash ([0-9a-f]{16})", it)[1]
                                  for it in self.logs])
        for line, log in zip(result.stdout.splitlines(), self.logs):
            sent = sum(int(it) for it in re.findall(r", (\d+) in \d+ bytes sent", log))
            self.assertIn(f" {sent} answers ", line)
            self.assertGreater(int(re.search(r"\((\d+) repeated\)", log)[1]), 0)
            self.assertRegex(log, r"[1-9]\d* stray_bytes")

    def test_evaporation_went_on_for_more_than_100_steps(self):
        result = run(BIN / "pheromonectl", "replay", "--answers", *self.files)
        times_ms = [int(line.split()[0]) for line in result.stdout.splitlines()]
        begins = [0] + [i for i in range(1, len(times_ms)) if times_ms[i] < times_ms[i - 1]]
        ends = begins[1:] + [len(times_ms)]
        steps = sum(times_ms[end - 1] - times_ms[begin] for begin, end in zip(begins, ends)) / (
            1250 * self.tau_s)  # half of it with a tau, half with one and a half
        self.assertGreater(steps, 100)

    def test_two_frames_that_changed_places_make_it_fail(self):
        data = self.files[0].read_bytes()
        blocks, at = [], 0
        while at < len(data):
            kind, length = struct.unpack_from("<II", data, at)
            blocks.append((kind, data[at:at + length]))
            at += length
        batches = [i for i, (kind, _) in enumerate(blocks) if kind == 0x80504804]
        for i, j in ((batches[3], batches[4]), (batches[-2], batches[-1])):
            swapped = [block for _, block in blocks]
            swapped[i], swapped[j] = swapped[j], swapped[i]
            (self.folder / "swapped.pcapng").write_bytes(b"".join(swapped))
            result = replay(self.folder / "swapped.pcapng")
            self.assertEqual(result.returncode, 1)
            self.assertIn("not replayable from here", result.stderr)

    def test_tshark_shows_requests_and_answers_with_their_fields(self):
        if not shutil.which("tshark"):
            self.skipTest("there is no tshark")
        result = run("tshark", "-r", self.files[0], "-X", f"lua_script:{DISSECTOR}", "-T", "fields",
                     "-E", "separator=|", "-e", "frame.interface_name", "-e", "pheromone.message",
                     "-e", "pheromone.x", "-e", "pheromone.left", "-e", "frame.time_epoch", "-Y",
                     'pheromone.message == "SENSE" || pheromone.message == "SENSE_ANSWER"')
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = [line.split("|") for line in result.stdout.splitlines()]
        self.assertEqual({row[0] for row in rows}, set(PTYS + TCPS))
        asked = [row for row in rows if row[1] == "SENSE"]
        answered = [row for row in rows if row[1] == "SENSE_ANSWER"]
        self.assertGreater(len(asked), 50)
        self.assertGreater(len(answered), 50)
        self.assertTrue(all(2000 <= int(row[2]) < 2400 for row in asked))
        self.assertTrue(any(int(row[3]) > 0 for row in answered))
        self.assertLess(abs(float(rows[0][4]) - time.time()), 86_400)

    def test_what_robots_sent_is_sent_again_to_a_server_that_knows_nothing(self):
        folder = self.folder / "again"
        folder.mkdir()
        ports = [free_port(), free_port()]
        write_config(folder, config(self.tau_s, ports))
        read = {name: size for name, size in re.findall(
            r"link (\S+): \d+ frames in (\d+) bytes received", self.logs[1])}
        with serve(folder) as daemon:
            for name, to in ((PTYS[0], folder / "radio-a.pty"), (TCPS[0], f"127.0.0.1:{ports[0]}")):
                result = run(BIN / "pheromonectl", "replay", self.files[1], "--to", to, "--link",
                             name, "--speed", 1000)
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                self.assertIn(f"sent {read[name]} bytes, received ", result.stdout)
            daemon.stop()
            for name in (PTYS[0], TCPS[0]):
                self.assertRegex(daemon.log(),
                                 rf"link {name}: \d+ frames in {read[name]} bytes received")


class CommandedTest(unittest.TestCase):
    """Recordings that an operator begins and ends while robots trace and sense on all links."""

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)
        self.ports = [free_port(), free_port()]
        write_config(self.folder, config(1, self.ports).replace("start = true", "start = false"))

    def await_traffic(self, daemon, requests):
        """Until the server has handled so many more requests."""
        def handled():
            return json.loads(ctl(daemon, "status", "--json"))["counters"]["requests"]

        goal = handled() + requests
        deadline = time.monotonic() + PATIENCE_S
        while handled() < goal:
            self.assertLess(time.monotonic(), deadline)

    def test_what_is_recorded_between_start_and_stop_in_the_middle_of_traffic_is_replayed(self):
        with serve(self.folder) as daemon:
            robots = list(all_robots(self.folder, self.ports, 700))
            files = []
            for _ in range(3):
                self.await_traffic(daemon, 40)
                self.assertIn("recording into", ctl(daemon, "capture", "start"))
                self.await_traffic(daemon, 200)
                ctl(daemon, "deposit", "trail", "5", "5")
                view = json.loads(ctl(daemon, "capture", "stop", "--json"))
                self.assertEqual((view["error"], view["lost"], view["files"]), (None, 0, 1))
                files.append(self.folder / view["file"])
                result = replay(files[-1])  # at once: the file is whole
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                self.assertGreater(int(re.search(r" (\d+) answers ", result.stdout)[1]), 150)
            for it in robots:
                it.stop()
            daemon.stop()
            self.assertEqual(sorted((self.folder / "captures").iterdir()), files)

    def test_a_recording_that_a_full_disk_ends_is_seen_and_another_may_begin(self):
        # To a process, that is what a full disk is: files of 100 kB, 512 bytes a block.
        limit_files = ("sh", "-c", "trap '' XFSZ; ulimit -f 200; exec \"$@\"", "sh")
        with serve(self.folder, before=limit_files) as daemon:
            ctl(daemon, "capture", "start")
            line = open_terminal(self.folder / "radio-a.pty")
            client = Client(line, 7, timeout=5)
            client.hello(1)
            deadline = time.monotonic() + PATIENCE_S
            while json.loads(ctl(daemon, "capture", "status", "--json"))["recording"]:
                self.assertLess(time.monotonic(), deadline)
                line.send(bytes(2000))
                client.ping(b"go on")
            view = json.loads(ctl(daemon, "status", "--json"))["capture"]
            self.assertIn("cannot be written: File too large", view["error"])
            self.assertIn("it stopped by itself: ", ctl(daemon, "status"))
            self.assertIn("the recording has ended: ", daemon.log())
            client.ping(b"still here")
            ctl(daemon, "capture", "start")
            client.ping(b"recorded again")
            view = json.loads(ctl(daemon, "capture", "stop", "--json"))
            self.assertIsNone(view["error"])
            result = replay(self.folder / view["file"])
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            line.close()
            daemon.stop()


class RotationTest(unittest.TestCase):
    def test_each_of_many_files_stands_by_itself(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            ports = [free_port(), free_port()]
            write_config(folder, config(1, ports, max_mb=1))
            with serve(folder) as daemon:
                line = open_terminal(folder / "radio-a.pty")
                client = Client(line, 7, timeout=5)
                client.hello(1)
                sent, files = 0, []
                while len(files) < 3:
                    files = list((folder / "captures").iterdir())
                    # No faster than the disk: records that do not fit into the queue would be
                    # dropped.
                    if sent - sum(it.stat().st_size for it in files) < 1_000_000:
                        line.send(bytes(2000))
                        client.ping(b"go on")
                        sent += 2000
                line.close()
                daemon.stop()
            files = sorted((folder / "captures").iterdir())
            for file in files:
                result = replay(file)
                self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_a_capture_section_that_makes_no_sense_is_named(self):
        with tempfile.TemporaryDirectory() as name:
            file = pathlib.Path(name) / "lab.toml"
            file.write_text(config(1, [1, 2]).replace('"captures"', '""'))
            result = run(BIN / "pheromoned", "--check", "--config", file)
            self.assertEqual(result.returncode, 2)
            self.assertIn("capture.folder", result.stderr)


class FilesTest(unittest.TestCase):
    def test_files_that_are_none_and_mistakes_in_the_command_line(self):
        with tempfile.TemporaryDirectory() as name:
            none = pathlib.Path(name) / "none.pcapng"
            self.assertEqual(replay(none).returncode, 1)
            none.write_bytes(b"no capture at all")
            result = replay(none)
            self.assertEqual(result.returncode, 1)
            self.assertIn("block 1, at byte 0: not a pcapng file", result.stderr)
            self.assertEqual(replay(none, "--speed", "2").returncode, 2)
            self.assertEqual(replay().returncode, 2)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv[1]).resolve()
    SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS
    unittest.main(argv=sys.argv[:1], verbosity=2)
