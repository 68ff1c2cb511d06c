#!/usr/bin/env python3
"""How long a halt takes beside the loads that anybody on the network can make.

    halt_bench.py BIN_DIR [SECONDS] [CSV]        default: 15 seconds each

Halts go over the Unix socket, twenty a second, while four UDP robots and two on ptys ask for echoes,
and strangers at the web port do one thing: nothing, 60 ask for the largest raster, four watch
replays (all there may be), 16 watch by TLS, 400 handshakes a second, connections that come and go.
A second server has as many robots and no load: the control, on the same machine at the same time.

For each load a row: how much the strangers got (pictures, frames, handshakes, answers), the halts'
median, 99th percentile and maximum, the robots' 99th percentile and that of the control, and the
most memory of the server. Strangers have the lowest priority: what is measured is the server, not who
has the processor.
"""

import contextlib
import csv
import datetime
import json
import multiprocessing
import os
import pathlib
import select
import socket
import ssl
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from checks import check, quantile  # noqa: E402
from operated_daemon import OperatedDaemon, write_config  # noqa: E402
from stranger.client import open_terminal  # noqa: E402
from stranger.wire import Decoder, encode  # noqa: E402
from test_config import link, map_of, pheromone, pty, table  # noqa: E402

PING, ECHO = 0x72, 0xF2
EVERY_S = 0.05  # of halts and robots
LONGEST_S = 30.0
RASTER = "/api/v1/field?pheromone=2&format=json&nodes_per_cell=1"  # 2000 x 2000: all there may be
UPGRADE = ("GET {} HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
           "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
           "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n")


def config(tls):
    return (map_of(199.9, 199.9, wide=True) + pheromone(1, "trail", tau_s=30.0) + pheromone(2, "paint")
            + link("udp", "udp", listen="127.0.0.1:0") + pty("radio-1") + pty("radio-2")
            + table("capture", folder="captures")
            + table("web", listen="127.0.0.1:0", token_file="token",
                    **({"tls_certificate": "cert.pem", "tls_key": "key.pem"} if tls else {})))


# --- The strangers. Each runs in processes of its own, until it is killed.

SERVED = multiprocessing.Value("Q", 0)  # what they got: pictures, frames, handshakes, answers


def served():
    with SERVED.get_lock():
        SERVED.value += 1


def hold(connection):
    """Reads and forgets."""
    with contextlib.suppress(OSError):
        while connection.recv(1 << 20):
            served()


def ask_for_rasters(port, count):
    """Of one process: each asks again when it has all of it."""
    request = f"GET {RASTER} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode()
    open_ones = []
    while True:
        while len(open_ones) < count:
            connection = socket.create_connection(("127.0.0.1", port))
            connection.sendall(request)
            open_ones.append(connection)
        for connection in select.select(open_ones, (), (), 1)[0]:
            try:
                data = connection.recv(1 << 20)
            except OSError:
                data = b""
            if not data:
                served()
                connection.close()
                open_ones.remove(connection)


def frame(text):
    """A client's text frame of WebSocket; its mask is 0."""
    data = text.encode()
    check(len(data) < 65536, "a short message")
    size = bytes((0x80 | len(data),)) if len(data) < 126 else b"\xfe" + len(data).to_bytes(2, "big")
    return b"\x81" + size + bytes(4) + data


def watch(port, target, by_tls):
    """Subscribes to whatever there is, by the numbers that channels have."""
    connection = socket.create_connection(("127.0.0.1", port))
    if by_tls:
        connection = untrusting().wrap_socket(connection)
    connection.sendall(UPGRADE.format(target).encode())
    head = b""
    while b"\r\n\r\n" not in head:
        head += connection.recv(1)
    check(head.startswith(b"HTTP/1.1 101 "), f"refused: {head}")
    connection.sendall(frame(json.dumps({"op": "subscribe", "subscriptions": [
        {"id": number, "channelId": number} for number in range(1, 20)]})))
    hold(connection)


def untrusting():
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context


def shake_hands(port, a_second):
    context = untrusting()
    due = time.monotonic()
    while True:
        due += 1 / a_second
        time.sleep(max(0.0, due - time.monotonic()))
        with contextlib.suppress(OSError):
            with socket.create_connection(("127.0.0.1", port)) as plain:
                context.wrap_socket(plain).close()
            served()


def come_and_go(port):
    while True:
        with contextlib.suppress(OSError):
            with socket.create_connection(("127.0.0.1", port)) as connection:
                connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
                connection.recv(4096)
            served()


def stranger(act, *arguments):
    os.nice(19)
    act(*arguments)


LOADS = [  # name, whether by TLS, (function, arguments behind the port) for each process
    ("nothing", False, []),
    ("60 raster clients", False, [(ask_for_rasters, 30)] * 2),
    ("4 replays", False, [(watch, "/replay/{recording}", False)] * 4),
    ("16 TLS viewers", True, [(watch, "/", True)] * 16),
    ("400 handshakes/s", True, [(shake_hands, 200)] * 2),
    ("connection churn", False, [(come_and_go,)] * 4),
]


@contextlib.contextmanager
def strangers(daemon, acts):
    recording = next((it.name for it in (daemon.folder / "captures").glob("*.pcapng")), "")
    all_of_them = []
    for act, *rest in acts:
        rest = [it.format(recording=recording) if isinstance(it, str) else it for it in rest]
        process = multiprocessing.Process(target=stranger, args=(act, daemon.web_port(), *rest))
        process.start()
        all_of_them.append(process)
    try:
        yield
        check(all(process.is_alive() for process in all_of_them), "a stranger has given up")
    finally:
        for process in all_of_them:
            process.kill()
            process.join()


# --- Who is measured.

class Robot:
    """Asks for an echo every EVERY_S, and notes how long it took."""

    def __init__(self, number, write, fd):
        self.number, self.write, self.fd = number, write, fd
        self.decoder = Decoder()
        self.sequence = 0
        self.asked_at = 0.0
        self.waits = False
        self.times = []

    def ask(self, now):
        self.sequence += 1
        self.write(encode(bytes((self.number, PING)) + self.sequence.to_bytes(8, "little")))
        self.asked_at, self.waits = now, True

    def hear(self, data):
        for body in self.decoder.feed(data):
            if body[1] == ECHO and body[2:10] == self.sequence.to_bytes(8, "little") and self.waits:
                self.times.append(time.monotonic() - self.asked_at)
                self.waits = False


def drive_robots(daemon_folder, udp_port, seconds, queue):
    robots = []
    terminals = [open_terminal(daemon_folder / f"radio-{i}.pty") for i in (1, 2)]
    for number, terminal in enumerate(terminals, 1):
        robots.append(Robot(number, terminal.send, terminal.fd))
    for number in range(3, 7):
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        udp.connect(("127.0.0.1", udp_port))
        robots.append(Robot(number, udp.send, udp.detach()))
    robots_by_fd = {it.fd: it for it in robots}
    for robot in robots[2:]:
        robot.write = lambda data, fd=robot.fd: os.write(fd, data)
    end = time.monotonic() + seconds
    while (now := time.monotonic()) < end:
        for robot in robots:
            if now - robot.asked_at >= (LONGEST_S if robot.waits else EVERY_S):
                robot.ask(now)
        for fd in select.select(robots_by_fd, (), (), 0.002)[0]:
            robots_by_fd[fd].hear(os.read(fd, 4096))
    queue.put([it for robot in robots for it in robot.times])


def time_halts(daemon, seconds):
    times = []
    most_kib = 0
    end = time.monotonic() + seconds
    while (begin := time.monotonic()) < end:
        status, text = daemon.call("POST", "/api/v1/halt", {})
        times.append(time.monotonic() - begin)
        check(status == 200, f"a halt: {status} {text}")
        most_kib = max(most_kib, daemon.rss_kib())
        time.sleep(max(0.0, begin + EVERY_S - time.monotonic()))
    return times, most_kib


def prepare(folder, tls):
    write_config(folder, config(tls))
    if tls:
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2",
                        "-subj", "/CN=localhost", "-keyout", "key.pem", "-out", "cert.pem"],
                       cwd=folder, check=True, stderr=subprocess.DEVNULL)


def fill(daemon):
    """Something that is not 0 everywhere, and a recording."""
    check(daemon.call("POST", "/api/v1/capture", {"action": "start"})[0] == 200, "a recording")
    for column in range(20):
        status, text = daemon.call("POST", "/api/v1/paint", {
            "pheromone": "paint", "units": 0.375,
            "area_m": [10 * column, 0, 10 * column + 10, 199.9]})
        check(status == 200, f"painted: {status} {text}")
    check(daemon.call("POST", "/api/v1/capture", {"action": "stop"})[0] == 200, "a recording")


def measure(bin_dir, name, tls, acts, seconds):
    with contextlib.ExitStack() as stack:
        folders = [pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory())) for _ in "ab"]
        daemons = []
        for folder in folders:
            prepare(folder, tls)
            daemons.append(OperatedDaemon(bin_dir, folder))
            stack.callback(daemons[-1].kill)
            fill(daemons[-1])
        queues = []
        SERVED.value = 0
        with strangers(daemons[0], acts):
            time.sleep(1)  # they have begun
            for daemon in daemons:
                queues.append(multiprocessing.Queue())
                multiprocessing.Process(target=drive_robots, args=(
                    daemon.folder, daemon.udp_port(), seconds, queues[-1])).start()
            halts, kib = time_halts(daemons[0], seconds)
            robots, control = (queue.get() for queue in queues)
        for daemon in daemons:
            daemon.stop()
    return {"load": name, "served": SERVED.value, "halts": len(halts),
            "halt_p50_ms": 1000 * quantile(halts, 0.5), "halt_p99_ms": 1000 * quantile(halts, 0.99),
            "halt_max_ms": 1000 * max(halts), "robots_p99_ms": 1000 * quantile(robots, 0.99),
            "control_p99_ms": 1000 * quantile(control, 0.99),
            "ratio": quantile(robots, 0.99) / quantile(control, 0.99), "rss_mib": kib / 1024}


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 15.0
    rows = []
    for name, tls, acts in LOADS:
        row = measure(bin_dir, name, tls, acts, seconds)
        rows.append({key: f"{it:.2f}" if isinstance(it, float) else it for key, it in row.items()})
        print(", ".join(f"{key} {it}" for key, it in rows[-1].items()), flush=True)
    if len(sys.argv) > 3:
        with open(sys.argv[3], "w", newline="", encoding="ascii") as out:
            writer = csv.DictWriter(out, ["date", *rows[0]], lineterminator="\n")
            writer.writeheader()
            for row in rows:
                writer.writerow({"date": datetime.date.today().isoformat(), **row})


if __name__ == "__main__":
    main()
