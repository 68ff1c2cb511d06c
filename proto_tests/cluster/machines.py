"""The machines of a cluster, on this one: members of etcd, and servers that share their log.

    with Machines(bin_dir, folder, nodes="ab") as machines:
        leader = machines.leader()
        machines.kill(leader)
        machines.start(leader)

Etcd and servers listen on loopback. Each server has a folder of its own, with its configuration, its
journal and its log.
"""

import json
import pathlib
import shutil
import signal
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from checks import check  # noqa: E402
from free_numbers import free_port  # noqa: E402
from operated_daemon import OperatedDaemon, await_that  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

SECRET = "0123456789abcdef" * 4 + "\n"


def etcd_command(name, folder, clients, peers):
    """Of the member of this name, with the times that a cluster of one room has. `clients` and `peers`
    have the URL of each member."""
    program = shutil.which("etcd")
    check(program, "no etcd on this machine: apt-get install etcd-server")
    return [program, "--name", name, "--data-dir", folder,
            "--listen-client-urls", clients[name], "--advertise-client-urls", clients[name],
            "--listen-peer-urls", peers[name], "--initial-advertise-peer-urls", peers[name],
            "--initial-cluster", ",".join(f"{it}={peer}" for it, peer in peers.items()),
            "--initial-cluster-state", "new", "--pre-vote", "--heartbeat-interval", "30",
            "--election-timeout", "300", "--log-level", "error", "--logger", "zap"]


def prepare(folder):
    """For a server of a cluster."""
    folder.mkdir(exist_ok=True)
    (folder / "secret").write_text(SECRET)
    (folder / "secret").chmod(0o600)


def cluster_table(node, engine, nodes, **more):
    return table("cluster", name="test", node=node, engine=engine, nodes=nodes, secret_file="secret", **more)


class Etcd:
    """Members on this machine."""

    def __init__(self, folder, members=3):
        ports = [free_port() for _ in range(2 * members)]
        self.clients = [f"http://127.0.0.1:{port}" for port in ports[:members]]
        names = [f"m{i}" for i in range(members)]
        clients = dict(zip(names, self.clients))
        peers = {name: f"http://127.0.0.1:{port}" for name, port in zip(names, ports[members:])}
        self.commands = [etcd_command(name, folder / name, clients, peers) for name in names]
        self.log = folder / "etcd.log"
        self.processes = [None] * members
        for i in range(members):
            self.start(i)

    def start(self, member):
        with open(self.log, "ab") as log:
            self.processes[member] = subprocess.Popen(self.commands[member], stdout=log, stderr=log)

    def kill(self, member):
        self.processes[member].kill()
        self.processes[member].wait()

    def close(self):
        for process in self.processes:
            process.send_signal(signal.SIGCONT)
            process.kill()
            process.wait()


class Machines:
    """`config` is added to that of all servers, `in_cluster` to its table [cluster], and by `add_files` to
    the folder of each."""

    def __init__(self, bin_dir, folder, nodes="ab", config=None, add_files=lambda folder: None,
                 **in_cluster):
        self.bin_dir, self.nodes, self.in_cluster = bin_dir, nodes, in_cluster
        self.folders = {node: folder / node for node in nodes}
        self.etcd = Etcd(folder)
        self.ports = {node: free_port() for node in nodes}
        self.robots = {node: free_port() for node in nodes}
        self.daemons = {}
        for node in nodes:
            prepare(self.folders[node])
            add_files(self.folders[node])
            (self.folders[node] / "test.toml").write_text(self.config(node, config))
        try:
            self.start(*nodes)
            await_that(self.are_connected, "the servers are connected")
        except BaseException:
            self.close()
            raise

    def config(self, node, more):
        return ((more or map_of(10.0, 10.0) + pheromone(1, "trail", tau_s=60.0))
                + link("udp", "udp", listen=f"127.0.0.1:{self.robots[node]}")
                + table("journal", folder="state")
                + cluster_table(node, self.etcd.clients,
                                {it: f"127.0.0.1:{port}" for it, port in self.ports.items()},
                                **self.in_cluster))

    def start(self, *nodes):
        """All of them at once: the first that is up may need the others."""
        for node in nodes:
            self.daemons[node] = OperatedDaemon(self.bin_dir, self.folders[node])

    def kill(self, node):
        self.daemons[node].kill()

    def running(self):
        return {node: it for node, it in self.daemons.items() if it.process.poll() is None}

    def status(self, node, with_hash=False):
        status, text = self.daemons[node].call("GET", f"/api/v1/status{'?hash=1' * with_hash}")
        check(status == 200, f"{node}: {status} {text}")
        return json.loads(text)

    def role(self, node):
        """Empty: it does not respond; it may be ending."""
        try:
            status, text = self.daemons[node].call("GET", "/api/v1/status")
        except OSError:
            return ""
        return json.loads(text)["cluster"]["role"] if status == 200 else ""

    def are_connected(self):
        return all(peer["up"] for node in self.running()
                   for peer in self.status(node)["cluster"]["peers"]
                   if peer["node"] in self.running())

    def leader(self):
        """The one that leads, once there is one."""
        found = []

        def look():
            found[:] = [node for node in self.running() if self.role(node) == "leads"]
            return len(found) == 1
        await_that(look, lambda: f"one server leads; found {found}")
        return found[0]

    def await_equal(self):
        """Until all that run have the same state; it."""
        hashes = {}

        def look():
            for node in self.running():
                status = self.status(node, True)
                hashes[node] = (status["sequence"], status["state_hash"])
            return len(set(hashes.values())) == 1
        await_that(look, lambda: f"all have the same sequence and state; found {hashes}")
        return next(iter(hashes.values()))

    def address(self, node):
        return f"udp:127.0.0.1:{self.robots[node]}"

    def close(self):
        for it in self.daemons.values():
            if it.process.poll() is None:
                it.process.send_signal(signal.SIGCONT)
                it.kill()
        self.etcd.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
