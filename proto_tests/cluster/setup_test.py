#!/usr/bin/env python3
"""deploy/CLUSTER.md, done literally: three machines, the commands of their README.txt, etcd with
the settings that systemd would give it, what remains when one machine is gone, and another one in its
place. `./deploy/bare_test --cluster`, run by hand, does it with whole systems.

    setup_test.py BIN_DIR

The machines are namespaces, with a network, an /etc and a /var/lib of their own: root only.
"""

import json
import pathlib
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "proto_tests"))
from cluster.network import Network, address, can_make  # noqa: E402
from operated_daemon import await_that  # noqa: E402

BIN = pathlib.Path(sys.argv.pop(1)).resolve() if len(sys.argv) > 1 else None
ADDRESSES = {name: address(i) for i, name in enumerate(("a", "b", "witness"), 1)}
WORDS = [f"{name}={address}" for name, address in ADDRESSES.items()]
# What a test must not do to the machine that it runs on; systemd is played by the test.
STUBS = """set -euo pipefail
sudo() { "$@"; }
apt() { echo "apt $*" >>/var/lib/told; }
systemctl() { echo "systemctl $*" >>/var/lib/told; }
ufw() { echo "ufw $*" >>/var/lib/told; }
pheromonectl() { :; }
"""


def run(*words, **options):
    return subprocess.run([str(it) for it in words], text=True, capture_output=True, check=False,
                          **options)


def set_up(folder, *words):
    return run(BIN / "pheromonectl", "cluster", "setup", *words, cwd=folder)


def commands_of(readme):
    """The indented lines."""
    return "".join(f"{line.strip()}\n" for line in readme.splitlines() if line.startswith("     "))


class Machine:
    """A bare Debian after step 1 of the instructions: packages are installed."""

    def __init__(self, network, name, folder, made):
        """`made`: the folder of `cluster setup`."""
        self.name, self.folder, self.processes = name, folder, {}
        shutil.copytree("/etc", folder / "etc", symlinks=True, ignore_dangling_symlinks=True)
        for path in ("etc/default", "etc/pheromone", "var/lib/etcd", "run",
                     "var/lib/pheromone/pheromoned/journal"):
            (folder / path).mkdir(parents=True, exist_ok=True)
        with open(folder / "etc/group", "a", encoding="ascii") as groups:
            groups.write("pheromone:x:64990:\n")
        shutil.copy(ROOT / "server/config/default.toml", folder / "etc/pheromone/pheromoned.toml")
        # As long as this runs, so does the mount namespace.
        self.holder = subprocess.Popen(network.command(name, [
            "unshare", "--mount", "sh", "-ec", f"mount --bind {folder}/etc /etc\n"
            f"mount --bind {folder}/var/lib /var/lib\necho\nexec cat"]),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        try:
            assert self.holder.stdout.readline(), "no namespaces"
            self.install(made / name)
        except BaseException:
            self.close()
            raise

    def command(self, *words):
        return ["nsenter", f"--target={self.holder.pid}", "--net", "--mount", *map(str, words)]

    def install(self, made):
        self.do(f"cd {made}\n" + commands_of((made / "README.txt").read_text()))

    def do(self, commands):
        done = run(*self.command("bash", "-c", STUBS + commands))
        assert done.returncode == 0, done

    def start(self):
        """What the last command of systemctl names, as its unit says."""
        told = (self.folder / "var/lib/told").read_text().splitlines()
        units = told[-1].removeprefix("systemctl restart --no-block ").split()
        assert units[0] == "etcd", told
        if "etcd" in units:
            settings = (self.folder / "etc/default/etcd").read_text().splitlines()
            self.begin("etcd", [shutil.which("etcd")],
                       [line for line in settings if line and not line.startswith("#")])
        if "pheromoned" in units:
            unit = (self.folder / "etc/systemd/system/pheromoned.service.d/cluster.conf").read_text()
            program, *words = re.findall(r"^ExecStart=(.+)$", unit, re.M)[-1].split()
            assert program == "/usr/sbin/pheromoned"
            self.begin("pheromoned", [BIN / "pheromoned", *words],
                       ["STATE_DIRECTORY=/var/lib/pheromone/pheromoned"])

    def begin(self, name, command, environment):
        with open(self.folder / f"{name}.log", "ab") as log:
            self.processes[name] = subprocess.Popen(
                self.command("env", f"--chdir={self.folder}/run", *environment, *command),
                stdout=log, stderr=log)

    def ctl(self, *words):
        return run(*self.command(BIN / "pheromonectl", "--socket",
                                 self.folder / "run/pheromoned.sock", *words))

    def member_call(self, what, body):
        """What etcdctl asks of the member here."""
        done = run(*self.command("curl", "-sS", "-d", json.dumps(body),
                                 f"http://127.0.0.1:2379/v3/cluster/member/{what}"))
        return json.loads(done.stdout)

    def log(self, name):
        return (self.folder / f"{name}.log").read_text()

    def die(self):
        for process in self.processes.values():
            process.kill()
        for process in self.processes.values():
            process.wait()
        self.processes = {}

    def close(self):
        self.die()
        if self.holder.returncode is None:
            self.holder.kill()
            self.holder.communicate()


class FilesTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def secrets(self):
        return [(self.folder / "cluster-lab" / node / "cluster-secret").read_text() for node in "ab"]

    def test_the_secret_is_one_for_its_owner_and_never_printed(self):
        made = set_up(self.folder, *WORDS)
        self.assertEqual(made.returncode, 0, made)
        secret = self.secrets()
        self.assertRegex(secret[0], r"\A[0-9a-f]{64}\n\Z")
        self.assertEqual(secret[0], secret[1])
        self.assertNotIn(secret[0].strip(), made.stdout + made.stderr)
        file = self.folder / "cluster-lab/a/cluster-secret"
        self.assertEqual(stat.S_IMODE(file.stat().st_mode), 0o600)
        self.assertFalse((self.folder / "cluster-lab/witness/cluster-secret").exists())

    def test_what_is_there_is_overwritten_only_by_force_and_with_a_new_secret(self):
        self.assertEqual(set_up(self.folder, *WORDS).returncode, 0)
        secret = self.secrets()
        refused = set_up(self.folder, *WORDS)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("cluster-lab/a: is there already; expected a new folder, or --force",
                      refused.stderr)
        self.assertEqual(self.secrets(), secret)
        (self.folder / "cluster-lab/a/cluster-secret").chmod(0o644)
        self.assertEqual(set_up(self.folder, *WORDS, "--force").returncode, 0)
        self.assertNotEqual(self.secrets()[0], secret[0])
        file = self.folder / "cluster-lab/a/cluster-secret"
        self.assertEqual(stat.S_IMODE(file.stat().st_mode), 0o600)

    def test_a_mistake_makes_nothing(self):
        refused = set_up(self.folder, "a=10.0.0.1", "b=lab-pc", "witness=10.0.0.3")
        self.assertEqual(refused.returncode, 2)
        self.assertIn('machine "b=lab-pc": expected a numeric address', refused.stderr)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_the_instructions_are_commands(self):
        made = set_up(self.folder, *WORDS, "--name", "lab2", "--output", "out", "--witness", "b",
                      "c=10.0.0.4", "d=10.0.0.5")
        self.assertEqual(made.returncode, 0, made)
        for machine in (self.folder / "out").iterdir():
            checked = run("bash", "-n", input=commands_of((machine / "README.txt").read_text()))
            self.assertEqual((checked.returncode, checked.stderr), (0, ""))
        self.assertFalse((self.folder / "out/b/cluster.toml").exists())


@unittest.skipUnless(can_make("--mount") and shutil.which("etcd") and shutil.which("nft"),
                     "needs root, iproute2, etcd-server, nftables")
class PageTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        made = set_up(self.folder, *WORDS)
        self.assertEqual(made.returncode, 0, made)
        self.network = Network(ADDRESSES)
        self.addCleanup(self.network.close)
        self.machines = {}
        for name in ADDRESSES:
            self.make(name, self.folder)

    def make(self, name, folder):
        """A machine with an empty disk; `folder` has what `cluster setup` made."""
        disk = folder / name
        disk.mkdir()
        self.machines[name] = Machine(self.network, name, disk, folder / "cluster-lab")
        self.addCleanup(self.machines[name].close)

    def findings(self, node):
        """What `cluster check` tells, and its exit status."""
        checked = self.machines[node].ctl("--json", "cluster", "check")
        return json.loads(checked.stdout), checked.returncode

    def leader(self, node):
        shown = self.machines[node].ctl("--json", "cluster", "status")
        return json.loads(shown.stdout)["leader"] if shown.returncode == 0 else None

    def begin(self):
        for machine in self.machines.values():
            machine.start()
        for node in "ab":
            await_that(lambda: self.findings(node)[1] == 0, f"{node} is well", 60)

    def test_the_page(self):
        found, status = self.findings("a")  # before anything runs
        self.assertEqual(status, 1)
        self.assertEqual([it["subject"] for it in found["findings"] if it["level"] == "fault"],
                         ["server", "etcd", "etcd", "etcd"])
        self.begin()
        found, _ = self.findings("b")
        looked_at = [(it["subject"], it["looked_at"]) for it in found["findings"]]
        for expected in (("peers", "node a"), ("server", "node b of lab"), ("journal", "node b of lab"),
                         ("etcd", f"{ADDRESSES['a']}:2379, on a"),
                         ("etcd", f"{ADDRESSES['witness']}:2379, a witness")):
            self.assertIn(expected, looked_at)
        self.assertIn("pheromoned", self.machines["a"].log("pheromoned"))

        first = self.leader("b")
        other = "b" if first == "a" else "a"
        laid = self.machines[first].ctl("deposit", "path", "0.5", "0.5")
        self.assertEqual(laid.returncode, 0, laid)

        self.machines[first].die()
        await_that(lambda: self.leader(other) == other, f"{other} leads", 60)
        sensed = self.machines[other].ctl("--json", "sense", "path", "0.4", "0.5")
        self.assertGreater(json.loads(sensed.stdout)["left"]["intensity"], 0, sensed)
        laid = self.machines[other].ctl("deposit", "path", "0.6", "0.6")
        self.assertEqual(laid.returncode, 0, laid)
        found, status = self.findings(other)
        self.assertEqual(status, 1)
        faults = {(it["subject"], it["looked_at"]) for it in found["findings"]
                  if it["level"] == "fault"}
        self.assertEqual(faults, {("peers", f"node {first}"),
                                  ("etcd", f"{ADDRESSES[first]}:2379, on {first}")})
        self.assertTrue(all(it["mend"] for it in found["findings"] if it["level"] == "fault"))

        self.machines[first].start()
        await_that(lambda: self.findings(first)[1] == 0, f"{first} is back", 60)

    def test_a_machine_that_is_lost_for_good_is_replaced(self):
        self.begin()
        self.machines["b"].close()
        await_that(lambda: self.leader("a") == "a", "the other one leads", 60)
        laid = self.machines["a"].ctl("deposit", "path", "0.5", "0.5")
        self.assertEqual(laid.returncode, 0, laid)
        self.replace("b")
        sensed = self.machines["b"].ctl("--json", "sense", "path", "0.4", "0.5")
        self.assertGreater(json.loads(sensed.stdout)["left"]["intensity"], 0, sensed)
        self.machines["witness"].close()
        self.replace("witness")

    def replace(self, name):
        """By a machine with nothing on its disk; the folder of `cluster setup` is gone, too."""
        again, other = self.folder / f"again-{name}", self.machines["a"]
        again.mkdir()
        self.assertEqual(set_up(again, *WORDS).returncode, 0)
        if name != "witness":
            shutil.copy(other.folder / "etc/pheromone/cluster-secret", again / "cluster-lab" / name)
        gone, = [it for it in other.member_call("list", {})["members"] if it.get("name") == name]
        other.member_call("remove", {"ID": gone["ID"]})
        await_that(lambda: "member" in other.member_call("add", {"peerURLs": gone["peerURLs"]}),
                   "the others are connected for the five seconds that etcd asks for", 60)
        self.make(name, again)
        page = (ROOT / "deploy/CLUSTER.md").read_text(encoding="utf-8")
        joins, = re.findall("^ *(sudo sed .* /etc/default/etcd)$", page, re.M)
        self.machines[name].do(joins)
        self.machines[name].start()
        for node in "ab":
            await_that(lambda: self.findings(node)[1] == 0, f"{node} is well", 60)


if __name__ == "__main__":
    unittest.main()
