"""A cluster on machines with networks of their own, and robots on another one, for faults_test.py.

Machines a and b have etcd and a server, w only etcd; the robots are on the floor, f. Servers and etcd
that are killed, or end, are started again when they may be. Nothing here judges.
"""

import base64
import contextlib
import json
import os
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from cluster.machines import cluster_table, etcd_command, prepare  # noqa: E402
from cluster.network import Network  # noqa: E402
from operated_daemon import await_that, exchange  # noqa: E402
from test_config import link, map_of, pheromone, pty, table  # noqa: E402

SERVERS, WITNESS, FLOOR = "ab", "w", "f"
ETCD_PORT, ETCD_PEERS, PEERS, UDP, TCP = 2379, 2380, 8390, 4951, 4950
ROBOTS = [("udp", "ab"), ("udp", "ba"), ("tcp", "ab"), ("tcp", "ba"), ("udp", "a"), ("udp", "b"),
          ("pty", "a"), ("pty", "b")]  # their links and servers
RELAY_PORTS = (3001, 3002, 3003)
RESTART_S = 0.2  # of what has ended by itself
CALL_S = 1.0


class Call(Exception):
    """An operator's request was not answered."""


class Process:
    """One that is started again whenever it is not to be down. `leaves`: what remains of it, if it is
    killed, and soon belongs to somebody else."""

    def __init__(self, name, command, folder, log, environment, leaves=None):
        self.name, self.command, self.folder, self.log = name, command, folder, log
        self.leaves = leaves
        self.environment = {**os.environ, **environment}
        self.lock = threading.RLock()
        self.process = None
        self.down_until = 0.0
        self.stopped_until = None
        self.endings = []  # statuses of those that ended by themselves
        self.starts = 0
        self.changed_at = 0.0

    def start(self):
        self.starts += 1
        self.changed_at = time.monotonic()
        with open(self.log, "ab") as log:
            log.write(f"--- start {self.starts} at {time.monotonic():.3f}\n".encode())
            log.flush()
            self.process = subprocess.Popen(self.command, cwd=self.folder, env=self.environment,
                                            stdout=log, stderr=log)

    def look(self, now):
        with self.lock:
            if self.stopped_until is not None and now >= self.stopped_until:
                self.resume()
            if self.has_ended():
                self.endings.append(self.process.returncode)
                self._clear()
                self.down_until = max(self.down_until, now + RESTART_S)
            if self.process is None and now >= self.down_until:
                self.start()

    def kill(self, until):
        with self.lock:
            self.down_until = until
            self.stopped_until = None
            if self.process is not None:
                self.process.kill()
                self.process.wait()
                self._clear()

    def _clear(self):
        self.process = None
        self.changed_at = time.monotonic()
        if self.leaves:
            self.leaves.unlink(missing_ok=True)

    def end(self):
        """In order, as for an upgrade."""
        with self.lock:
            if self.process is not None:
                self.resume()
                self.process.terminate()
                self.changed_at = time.monotonic()

    def stop(self, until):
        with self.lock:
            if self.process is not None:
                self.stopped_until = until
                self.changed_at = time.monotonic()
                self.process.send_signal(signal.SIGSTOP)

    def resume(self):
        with self.lock:
            self.stopped_until = None
            if self.process is not None:
                self.process.send_signal(signal.SIGCONT)
                self.changed_at = time.monotonic()

    def has_ended(self):
        return self.process is not None and self.process.poll() is not None

    def runs(self):
        return self.process is not None and self.stopped_until is None


class Scene:
    """With `lies`, server a sees etcd through lying_relay.py."""

    def __init__(self, bin_dir, tests_dir, folder, lies=False):
        self.folder, self.tests_dir = folder, tests_dir
        self.lock = threading.RLock()
        self.network = Network(SERVERS + WITNESS + FLOOR)
        self.servers, self.etcds, self.robots, self.relay = {}, {}, None, None
        self.robot_nodes = {}  # their servers, in the order of their lists
        self.statuses, self.edits = [], []
        self.leaders = []  # (time, node, term), whenever it is told
        self.edit_count = 0
        self.ending = threading.Event()
        self.threads = []
        try:
            self._make(bin_dir, lies)
        except BaseException:
            self.close()
            raise

    def _make(self, bin_dir, lies):
        clients, peers = ({it: f"http://{self.network.address(it)}:{port}" for it in SERVERS + WITNESS}
                          for port in (ETCD_PORT, ETCD_PEERS))
        members = [f"{self.network.address(it)}:{ETCD_PORT}" for it in SERVERS + WITNESS]
        self.engine = {it: list(clients.values()) for it in SERVERS}
        if lies:
            self.engine["a"] = [f"http://127.0.0.1:{port}" for port in RELAY_PORTS]
            self.relay = subprocess.Popen(self.network.command("a", [
                sys.executable, pathlib.Path(__file__).parent / "lying_relay.py", "test",
                *[f"{port}={member}" for port, member in zip(RELAY_PORTS, members)]]),
                stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        for it in SERVERS + WITNESS:
            (self.folder / it).mkdir()
            self.etcds[it] = Process(f"etcd {it}", self.network.command(
                it, etcd_command(it, self.folder / it / "etcd", clients, peers)), self.folder / it,
                self.folder / it / "etcd.log", {})
        for it in SERVERS:
            here = self.folder / it
            prepare(here)
            (here / "sick").mkdir()
            (here / "ahead").write_text("0")
            self.write_config(it, 60.0)
            shims = " ".join(str(self.tests_dir / f"lib{name}_shim.so") for name in ("clock", "sick_disk"))
            self.servers[it] = Process(f"server {it}", self.network.command(it, [
                "env", f"LD_PRELOAD={shims}", bin_dir / "pheromoned", "--config", "test.toml"]), here,
                here / "pheromoned.log", {"SICK_DISK": str(here / "sick"),
                                          "CLOCK_AHEAD": str(here / "ahead")},
                                       leaves=here / "radio.pty")
        for it in (*self.etcds.values(), *self.servers.values()):
            it.start()
        self.begin(self._supervise)
        await_that(lambda: self.leader() is not None and all(
            self.status(it)["cluster"]["role"] in ("leads", "follows") for it in SERVERS),
            "the servers lead and follow")

    def write_config(self, node, tau_s):
        (self.folder / node / "test.toml").write_text(
            map_of(10.0, 10.0) + pheromone(1, "trail", tau_s=tau_s)
            + table("[tag]", name="door", x_m=5.0, y_m=5.0, range_m=2.0, slots=8)
            + link("udp", "udp", listen=f"{self.network.address(node)}:{UDP}")
            + link("tcp", "tcp", listen=f"{self.network.address(node)}:{TCP}")
            + link("radio", "pty", path="radio.pty", medium_access=False)
            + table("journal", folder="state", segment_mib=1, snapshot_mib=4000, snapshot_s=86400.0)
            + cluster_table(node, self.engine[node],
                            {it: f"{self.network.address(it)}:{PEERS}" for it in SERVERS}))

    def lose_disk(self, node, until):
        """The server is killed, and begins again without its journal, which is kept for the judge."""
        here, server = self.folder / node, self.servers[node]
        with server.lock:
            server.kill(until)
            if (here / "state").exists():
                (here / "state").rename(here / f"lost-{len(list(here.glob('lost-*')))}")

    def begin(self, run):
        """In a thread, until `ending` is set."""
        self.threads.append(threading.Thread(target=run, daemon=True))
        self.threads[-1].start()

    def _supervise(self):
        while not self.ending.wait(0.02):
            with self.lock:
                for it in (*self.etcds.values(), *self.servers.values()):
                    it.look(time.monotonic())

    def changed_at(self):
        """When a server was last killed, stopped or started, or the network cut or mended."""
        return max(it.changed_at for it in (*self.servers.values(), self.network))

    # --- Operators

    def call(self, node, method, target, body=None, patience_s=CALL_S):
        """The status and the text; raises Call if there is none."""
        try:
            with socket.socket(socket.AF_UNIX) as connection:
                connection.settimeout(patience_s)
                connection.connect(str(self.folder / node / "pheromoned.sock"))
                status, text = exchange(connection, method, target, body)
        except OSError as error:
            raise Call(str(error)) from None
        if status == 0:
            raise Call("hung up")
        return status, text

    def status(self, node, with_hash=False):
        try:
            status, text = self.call(node, "GET", f"/api/v1/status{'?hash=1' * with_hash}")
        except Call:
            return {"cluster": {"role": "", "term": 0}}
        return json.loads(text) if status == 200 else {"cluster": {"role": "", "term": 0}}

    def reached(self, node):
        """The servers, this one too, that it reaches, and from which robots are."""
        if not self.servers[node].runs():
            return set()  # who is stopped would not even say so
        up = {node, *(it["node"] for it in self.status(node)["cluster"].get("peers", ()) if it["up"])}
        with self.lock:
            return {it for it in up if self.servers[it].runs()
                    and (it == node or self._passes(node, it)) and self._passes(it, FLOOR)}

    def _passes(self, one, other):
        return self.network.passes(one, other) and self.network.passes(other, one)

    def leader(self):
        """Who says so, in the latest term; None."""
        found = [(it["cluster"]["term"], node) for node in SERVERS
                 if (it := self.status(node))["cluster"]["role"] == "leads"]
        return max(found)[1] if found else None

    def poll(self):
        """Until the end, what servers tell of their states."""
        while not self.ending.wait(0.25):
            for node in SERVERS:
                status = self.status(node, True)
                cluster = status["cluster"]
                if cluster["role"] == "leads":
                    if not self.leaders or self.leaders[-1][1:] != (node, cluster["term"]):
                        self.leaders.append((time.monotonic(), node, cluster["term"]))
                if "state_hash" in status and cluster["committed_sequence"] >= status["sequence"]:
                    self.statuses.append((node, status["sequence"], status["state_hash"]))

    def edit(self):
        """Until the end, edits at either server."""
        while not self.ending.wait(0.5):
            self.edit_count += 1
            node = SERVERS[self.edit_count % 2]
            x_mm, y_mm = 10 + self.edit_count % 9900, 10 + self.edit_count // 9900
            try:
                status, _ = self.call(node, "POST", "/api/v1/paint", {
                    "pheromone": "trail", "points_m": [[x_mm / 1000, y_mm / 1000]], "units": 0.5,
                    "add": True}, patience_s=5.0)
            except Call:
                status = 0
            self.edits.append((1000 * x_mm, 1000 * y_mm, status))

    def begin_operators(self):
        self.begin(self.poll)
        self.begin(self.edit)

    # --- Robots

    def begin_robots(self, seed, history):
        servers = {kind: [f"{kind}:{self.network.address(it)}:{port}" for it in SERVERS]
                   for kind, port in (("udp", UDP), ("tcp", TCP))}
        servers["pty"] = [str(self.folder / it / "radio.pty") for it in SERVERS]
        words = []
        for number, (kind, nodes) in enumerate(ROBOTS, 1):
            index = list(servers).index(kind)
            addresses = ",".join(servers[kind][SERVERS.index(it)] for it in nodes)
            self.robot_nodes[f"{index}:{number}"] = nodes
            words.append(f"{index}:{number}:{addresses}")
        self.robots = subprocess.Popen(
            self.network.command(FLOOR, [sys.executable, pathlib.Path(__file__).parent / "robots.py",
                                         seed, history, *words]), stdin=subprocess.PIPE)

    def lie(self):
        """When it has begun."""
        self.relay.stdin.write(b"lie\n")
        self.relay.stdin.flush()
        self.relay.stdout.readline()
        return time.monotonic()

    def end_robots(self, patience_s):
        """Whether all were answered."""
        with contextlib.suppress(BrokenPipeError):
            self.robots.stdin.write(b"end\n")
            self.robots.stdin.flush()
        try:
            return self.robots.wait(patience_s) == 0
        except subprocess.TimeoutExpired:
            self.robots.kill()
            self.robots.wait()
            return False

    def groups(self):
        """(first event, events, term) of each group that etcd has."""
        ask = ("import json, sys, urllib.request as it; print(it.urlopen(it.Request(sys.argv[1],"
               "sys.argv[2].encode()), timeout=10).read().decode())")
        prefix = b"/pheromone/test/log"
        made = subprocess.run(self.network.command(WITNESS, [
            sys.executable, "-c", ask, f"http://{self.network.address(WITNESS)}:{ETCD_PORT}/v3/kv/range",
            json.dumps({"key": base64.b64encode(prefix + b"/").decode(),
                        "range_end": base64.b64encode(prefix + b"0").decode()})]),
            capture_output=True, text=True, check=True)
        found = []
        for it in json.loads(made.stdout).get("kvs", []):
            _, count, term = struct.unpack_from("<BIQ", base64.b64decode(it["value"]))
            found.append((int(base64.b64decode(it["key"]).rpartition(b"/")[2], 16), count, term))
        return found

    # --- The end

    def heal(self):
        """All that is broken, at once."""
        with self.lock:
            self.network.heal()
            for node in SERVERS:
                (self.folder / node / "sick" / "full").unlink(missing_ok=True)
                (self.folder / node / "ahead").write_text("0")
            for it in (*self.etcds.values(), *self.servers.values()):
                it.down_until = 0.0
                it.resume()

    def await_equal(self, patience_s):
        """Whether both have the same state, committed."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            found = {(it.get("sequence"), it.get("state_hash"), it["cluster"].get("committed_sequence"))
                     for it in (self.status(node, True) for node in SERVERS)}
            if len(found) == 1 and None not in next(iter(found)):
                return True
            time.sleep(0.05)
        return False

    def end_servers(self):
        for it in self.servers.values():
            it.kill(float("inf"))

    def close(self):
        self.ending.set()
        for thread in self.threads:
            thread.join(10)
        for it in (self.robots, self.relay):
            if it is not None and it.poll() is None:
                it.kill()
                it.wait()
        for it in (*self.servers.values(), *self.etcds.values()):
            it.resume()
            it.kill(float("inf"))
        self.network.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
