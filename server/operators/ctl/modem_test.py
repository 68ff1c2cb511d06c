#!/usr/bin/env python3
"""pheromonectl modem test between two pseudo-terminals, with a process that plays the modems.

    modem_test.py BIN_DIR SHIM [CLASS]

SHIM (server/robots/links/testing/pty_as_serial_shim.c) makes libserialport take pseudo-terminals for
serial ports. The modems played are half-duplex: what one gets goes on the air a turnaround later, and
it is deaf from its first byte on until a turnaround after its last. Of times only the least is
asserted, which no busy machine can make shorter.
"""

import heapq
import itertools
import os
import pathlib
import random
import re
import select
import subprocess
import sys
import threading
import time
import tty
import unittest

BIN = pathlib.Path()
SHIM = ""
BAUD = 9600
BYTE_S = 10 / BAUD


class Modems(threading.Thread):
    """Two of them, each with a port, and the air between them."""

    def __init__(self, turnaround_s, adapters_s, damaged=0.0, cut=False, slow_to_listen_s=None,
                 inserted=b"", air_byte_s=BYTE_S, silent_after=None):
        super().__init__(daemon=True)
        self.turnaround_s = turnaround_s
        self.adapters_s = adapters_s  # of each port, for how long it holds back what it received
        self.damaged = damaged
        self.cut = cut
        self.listens_after_s = turnaround_s if slow_to_listen_s is None else slow_to_listen_s
        self.inserted = inserted  # before each transmission
        self.air_byte_s = air_byte_s
        self.silent_after = silent_after  # bytes
        self.random = random.Random(7)
        self.fds, self.ports, self.slaves = [], [], []
        for _ in range(2):
            fd, slave = os.openpty()
            tty.setraw(slave)
            os.set_blocking(fd, False)
            self.fds.append(fd)
            self.slaves.append(slave)
            self.ports.append(os.ttyname(slave))
        self.on = True

    def run(self):
        on_air = []  # (when it is heard, its number, to whom, byte)
        numbers = itertools.count()
        held = [[], []]
        deliver_at = [None, None]
        uart_free = [0.0, 0.0]
        deaf = [(0.0, 0.0), (0.0, 0.0)]
        while self.on:
            select.select(self.fds, [], [], 0.0003)
            now = time.monotonic()
            for me, fd in enumerate(self.fds):
                try:
                    data = os.read(fd, 4096)
                except OSError:
                    continue
                first = now + BYTE_S
                if uart_free[me] < now:
                    deaf[me] = (now, now)
                    for byte in self.inserted:
                        heapq.heappush(on_air, (first + self.turnaround_s, next(numbers), 1 - me, byte))
                for byte in data:
                    uart_free[me] = max(uart_free[me], now) + self.air_byte_s
                    heapq.heappush(on_air, (uart_free[me] + self.turnaround_s, next(numbers), 1 - me, byte))
                deaf[me] = (deaf[me][0], uart_free[me] + self.turnaround_s + self.listens_after_s)
            while on_air and on_air[0][0] <= now:
                at, number, to, byte = heapq.heappop(on_air)
                if self.silent_after is not None and number >= self.silent_after:
                    continue
                if self.cut or deaf[to][0] <= at <= deaf[to][1] - self.turnaround_s:
                    continue
                if self.random.random() < self.damaged:
                    byte ^= 1 << self.random.randrange(8)
                if not held[to]:
                    tick = self.adapters_s[to]
                    deliver_at[to] = now if tick == 0 else (now // tick + 1) * tick
                held[to].append(byte)
            for to, fd in enumerate(self.fds):
                if held[to] and deliver_at[to] <= now:
                    os.write(fd, bytes(held[to]))
                    held[to] = []

    def stop(self):
        self.on = False
        self.join()
        for fd in self.fds + self.slaves:
            os.close(fd)


def try_modems(modems, *options):
    modems.start()
    try:
        return subprocess.run([BIN / "pheromonectl", "modem", "test", *modems.ports, *options],
                              text=True, capture_output=True, check=False,
                              env={**os.environ, "LD_PRELOAD": SHIM})
    finally:
        modems.stop()


def row(text, name):
    """Both columns."""
    line = re.search(rf"^ *{name} +(.*)$", text, re.M)
    return re.split(r" {2,}", line.group(1))


class SettingsTest(unittest.TestCase):
    def test_settings_fit_what_was_played(self):
        all_rows = {"frames, one by one": 30, "frames, without a pause": 20, "answers, at once": 10}
        for _ in range(5):  # again, if the modems paused for the 300 ms after which a frame is lost
            modems = Modems(turnaround_s=0.005, adapters_s=(0.016, 0))
            result = try_modems(modems, "--frames", "20")
            self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)
            if all(row(result.stdout, name) == [f"{n} of {n}"] * 2 for name, n in all_rows.items()):
                break
        else:
            self.fail(result.stdout)
        self.assertIn(f'port = "{modems.ports[0]}"\nbaud = 9600\n', result.stdout)
        self.assertGreaterEqual(int(re.search(r"turnaround_ms = (\d+)", result.stdout)[1]), 5)
        self.assertGreaterEqual(int(re.search(r"adapter_latency_ms = (\d+)", result.stdout)[1]), 12)
        # What a quiet machine adds to 5 ms at least, and the line's rate, which nothing exceeds.
        for delay in row(result.stdout, "delay, at least"):
            self.assertGreaterEqual(float(delay.split()[0]), 5.0)
        for rate in row(result.stdout, "bytes a second"):
            self.assertLessEqual(float(rate), 1.03 * BAUD / 10)

    def test_clock_of_a_slow_adapter_is_its_latency_and_not_the_turnaround(self):
        result = try_modems(Modems(turnaround_s=0.002, adapters_s=(0.1, 0)), "--frames", "10")
        adapter_ms = int(re.search(r"adapter_latency_ms = (\d+)", result.stdout)[1])
        self.assertGreaterEqual(adapter_ms, 80, result.stdout + result.stderr)

    def test_bytes_before_frames_do_no_harm(self):
        result = try_modems(Modems(turnaround_s=0.002, adapters_s=(0, 0), inserted=b"xyz"),
                            "--frames", "10")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        whole = int(row(result.stdout, "frames, one by one")[0].split()[0])
        self.assertIn(f"{3 * whole} bytes came before frames at 2: the server and the robots ignore "
                      "them", result.stdout)
        for delay in row(result.stdout, "delay, at least"):
            self.assertGreaterEqual(float(delay.split()[0]), 2.0)


class AirTest(unittest.TestCase):
    def test_damage_is_that_of_the_air(self):
        result = try_modems(Modems(turnaround_s=0.002, adapters_s=(0, 0), damaged=0.01),
                            "--frames", "150")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        for share in row(result.stdout, "damaged bytes"):
            self.assertTrue(0.6 <= float(share.split()[0]) <= 1.5, result.stdout)

    def test_answers_that_the_air_loses_are_no_fault_of_the_modems(self):
        result = try_modems(Modems(turnaround_s=0.002, adapters_s=(0, 0), damaged=0.015),
                            "--frames", "10")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertNotIn("do not fit", result.stdout)
        self.assertNotIn("after a pause", result.stdout)

    def test_air_that_is_slower_than_the_ports_is_not_taken_for_damage(self):
        result = try_modems(Modems(turnaround_s=0.002, adapters_s=(0, 0), air_byte_s=2 * BYTE_S),
                            "--frames", "20")
        self.assertEqual(row(result.stdout, "frames, without a pause"), ["20 of 20"] * 2,
                         result.stdout + result.stderr)
        slower = float(re.search(r"From 1 to 2 the air takes (\S+) times", result.stdout)[1])
        self.assertGreaterEqual(slower, 1.8)


class ModemsTest(unittest.TestCase):
    def test_modem_that_falls_silent(self):
        modems = Modems(turnaround_s=0.002, adapters_s=(0, 0), silent_after=60 * 24 + 50)
        result = try_modems(modems, "--frames", "10")
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertIn("a modem has fallen silent", result.stderr)

    def test_modem_that_is_deaf_for_too_long_does_not_fit(self):
        result = try_modems(Modems(turnaround_s=0.002, adapters_s=(0, 0), slow_to_listen_s=0.05),
                            "--frames", "10")
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertEqual(row(result.stdout, "answers, at once"), ["0 of 10", "0 of 10"])
        self.assertRegex(result.stdout, "The modem of 1 heard answers only after a pause of (32|128) ms")

    def test_nothing_arrives(self):
        modems = Modems(turnaround_s=0.002, adapters_s=(0, 0), cut=True)
        result = try_modems(modems)
        self.assertEqual(result.returncode, 1)
        self.assertIn(f"pheromonectl: nothing whole of 5 frames from {modems.ports[0]} arrived at "
                      f"{modems.ports[1]} (0 bytes", result.stderr)

    def test_port_that_is_none(self):
        result = subprocess.run([BIN / "pheromonectl", "modem", "test", "/nowhere", "/dev/null"],
                                text=True, capture_output=True, check=False)
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr, "pheromonectl: /nowhere: No such file or directory\n")


if __name__ == "__main__":
    BIN, SHIM = pathlib.Path(sys.argv[1]), sys.argv[2]
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
