#!/usr/bin/env python3
"""CLUSTER.md word for word: three bare systems, each with a systemd and an address of its own,
become a cluster; a plug is pulled; and each kind of machine is replaced by one with an empty disk.

    cluster_page_test.py BASE PACKAGE.deb WORK

BASE is a tree of a bare Debian 12, WORK a folder for the machines' disks. The clock runs while
packages come from the network; the time in which a person reads and types is not in it. Must be root.
`./deploy/bare_test --cluster` runs it.
"""

import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "proto_tests"))
from cluster.network import Network  # noqa: E402
from operated_daemon import await_that  # noqa: E402

PAGE = (ROOT / "deploy/CLUSTER.md").read_text(encoding="utf-8")
BASE, PACKAGE, WORK = (pathlib.Path(it).resolve() for it in sys.argv[1:4])
MACHINES = ("a", "b", "witness")
# Of systemd: one hierarchy, or as before version 2 of cgroups, two.
CGROUPS = [it for it in (pathlib.Path("/sys/fs/cgroup") / path for path in ("", "systemd", "unified"))
           if (it / "cgroup.procs").exists()]
PATIENCE_S = 180
BEGUN = time.monotonic()


def say(what):
    seconds = round(time.monotonic() - BEGUN)
    print(f"{seconds // 60:3}:{seconds % 60:02}  {what}", flush=True)


def block(after):
    """The commands of the page's first block behind these words."""
    text = re.search(r"^ *```sh\n(.*?)^ *```$", PAGE[PAGE.index(after):], re.M | re.S)[1]
    return [line.strip() for line in text.splitlines()]


class Machine:
    def __init__(self, network, name):
        self.name, self.disk = name, WORK / name
        self.space = f"/run/netns/{network.space(name)}"
        self.cgroups = [it / f"{network.prefix}-{name}" for it in CGROUPS]
        self.process = None

    def boot(self):
        """With an empty disk: a Debian, sudo, and nothing else."""
        shutil.rmtree(self.disk, ignore_errors=True)
        subprocess.run(["cp", "-a", WORK / "debian", self.disk], check=True)
        (self.disk / "etc/hostname").write_text(f"{self.name}\n", encoding="ascii")
        (self.disk / "etc/hosts").write_text(f"127.0.0.1 localhost\n127.0.1.1 {self.name}\n", encoding="ascii")
        (self.disk / "etc/machine-id").write_text("", encoding="ascii")
        for cgroup in self.cgroups:  # systemd believes that all below it is its own
            cgroup.mkdir()
        enter = "".join(f"echo $$ >{cgroup}/cgroup.procs && " for cgroup in self.cgroups)
        with open(WORK / f"{self.name}.log", "ab") as log:
            self.process = subprocess.Popen(
                ["sh", "-c", f'{enter} exec "$@"', "sh", "systemd-nspawn",
                 "--quiet", "--boot", "--register=no", "--keep-unit", "--console=pipe",
                 f"--directory={self.disk}", f"--machine={self.name}", "--resolv-conf=copy-host",
                 f"--network-namespace-path={self.space}", "--capability=CAP_NET_ADMIN"],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        await_that(lambda: self.first_process() and self.state() in ("running", "degraded"),
                   f"{self.name} boots", PATIENCE_S)

    def first_process(self):
        """Its number outside: the child of nspawn that is process 1 inside."""
        pid, proc = self.process.pid, pathlib.Path("/proc")
        for child in (proc / f"{pid}/task/{pid}/children").read_text().split():
            with contextlib.suppress(OSError):
                if re.search(r"^NSpid:.*\t1$", (proc / child / "status").read_text(), re.M):
                    return int(child)
        return None

    def state(self):
        return self.run("systemctl is-system-running --wait", check=False).stdout.strip()

    def run(self, command, folder="/root", check=True):
        """In a shell there; packages are fetched over the network of this machine."""
        namespaces = ["--mount", "--uts", "--ipc", "--pid", "--root"]
        if "apt" not in command:
            namespaces.append("--net")
        done = subprocess.run(
            ["nsenter", f"--target={self.first_process()}", *namespaces, "--", "env", "-i", "HOME=/root",
             "PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
             "DEBIAN_FRONTEND=noninteractive", "bash", "-ec", f"cd {folder}\n{command}"],
            text=True, capture_output=True, stdin=subprocess.DEVNULL, check=False)
        if check and done.returncode != 0:
            sys.exit(f"{self.name}: {command}\n{done.stdout}{done.stderr}")
        return done

    def follow(self, but=()):
        """What README.txt says; its last command, which looks at the whole, is for a PC at the end.
        There is no ufw here."""
        readme = (self.disk / "root" / self.name / "README.txt").read_text(encoding="utf-8")
        but = [*but, *block("Then, on a PC")]
        for command in re.findall("^     (.+)$", readme, re.M):
            if command not in but and not command.startswith("sudo ufw "):
                self.run(command, f"/root/{self.name}")

    def lose(self):
        """At once, as by its plug."""
        if self.process is None:
            return
        if (init := self.first_process()) is not None:
            os.kill(init, signal.SIGKILL)
        self.process.wait()
        self.process = None
        for cgroup in self.cgroups:
            for folder in sorted(cgroup.glob("**/"), reverse=True):
                await_that(lambda: not (folder / "cgroup.procs").read_text(), f"{folder} is empty")
                folder.rmdir()


class Lab:
    def __init__(self, network):
        self.network = network
        self.machines = {name: Machine(network, name) for name in MACHINES}

    def copy(self, of, path, to, where):
        """As scp -r does."""
        subprocess.run(["cp", "-r", self.machines[of].disk / path, self.machines[to].disk / where],
                       check=True)

    def check(self, *names):
        """Until it ends with 0 faults: machines take a while to find together."""
        command, = block("Then, on a PC")
        for name in names:
            shown = []

            def is_well():
                done = self.machines[name].run(command, check=False)
                shown[:] = [done.stdout + done.stderr]
                return done.returncode == 0 and bool(re.search("^0 faults", done.stdout, re.M))
            await_that(is_well, lambda: "".join(shown), PATIENCE_S)
            print("".join(shown).strip())

    def leader(self, name):
        done = self.machines[name].run("sudo pheromonectl --json cluster status", check=False)
        return json.loads(done.stdout)["leader"] if done.returncode == 0 else None

    def set_up(self, by):
        """The folders, with the words of the page and the addresses of this network."""
        command, = block("## The ten minutes")
        for name in MACHINES:
            word = f"{name}={self.network.address(name)}"
            command, count = re.subn(rf"\b{name}=[0-9.]+", word, command)
            assert count == 1, command
        self.machines[by].run(command)

    def make(self):
        for name in ("a", "b"):
            shutil.copy(PACKAGE, self.machines[name].disk / "root")
        self.machines["a"].run("sudo apt install ./pheromone_*.deb")
        self.set_up("a")
        for name in MACHINES:
            self.copy("a", f"root/cluster-lab/{name}", name, "root")
            if name != "witness":
                shutil.copy(PACKAGE, self.machines[name].disk / "root" / name)
            self.machines[name].follow()
            say(f"{name} is set up")
        self.check("a", "b")

    def replace(self, name, other):
        """The page's paragraph about a machine that is lost for good."""
        machine, helper = self.machines[name], self.machines[other]
        machine.boot()
        say(f"{name} has an empty disk")
        helper.run("rm -rf cluster-lab")
        self.set_up(other)
        self.copy(other, f"root/cluster-lab/{name}", name, "root")
        start = "sudo systemctl restart --no-block etcd"
        if name != "witness":
            shutil.copy(PACKAGE, machine.disk / "root" / name)
            self.copy(other, "etc/pheromone/cluster-secret", name, f"root/{name}/cluster-secret")
            start += " pheromoned"
        machine.follow(but=[start])
        helper.run("sudo apt install etcd-client")
        listed, remove, add = block("A machine is lost for good")
        members = helper.run(listed).stdout.splitlines()
        member, = [line.split(", ") for line in members if f", {name}, " in line]
        helper.run(remove.replace("ID", member[0]))
        add = add.replace("NAME", name).replace("ADDRESS", self.network.address(name))
        await_that(lambda: helper.run(add, check=False).returncode == 0, "a new member", PATIENCE_S)
        for command in block("On the new one"):
            machine.run(command)
        if name != "witness":
            machine.run(re.search(r"`(sudo systemctl start pheromoned)`", PAGE)[1])
        self.check("a", "b")
        say(f"{name} is replaced")

    def sense(self, name):
        shown = self.machines[name].run("sudo pheromonectl --json sense path 0.4 0.5").stdout
        return json.loads(shown)["left"]["intensity"]


def prepare():
    """A bare Debian, and sudo. Its user says yes to apt."""
    tree = WORK / "debian"
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    subprocess.run(["cp", "-a", BASE, tree], check=True)
    shutil.copy("/etc/resolv.conf", tree / "etc/resolv.conf")
    (tree / "etc/apt/apt.conf.d/yes").write_text('APT::Get::Assume-Yes "true";\n', encoding="ascii")
    for command in "apt-get update -qq", "apt-get install -qq --no-install-recommends sudo":
        subprocess.run(["chroot", tree, "env", "DEBIAN_FRONTEND=noninteractive", *command.split()],
                       check=True, stdout=subprocess.DEVNULL)


def main():
    global BEGUN
    prepare()
    with contextlib.ExitStack() as stack:
        lab = Lab(stack.enter_context(Network(MACHINES)))
        for machine in lab.machines.values():
            stack.callback(machine.lose)
            machine.boot()
        BEGUN = time.monotonic()
        say("three bare machines")
        lab.make()
        say("the cluster is well: the ten minutes of the page")

        assert lab.sense("a") == 0
        first = lab.leader("a")
        other = "b" if first == "a" else "a"
        lab.machines[first].run("sudo pheromonectl deposit path 0.5 0.5")
        lab.machines[first].lose()
        await_that(lambda: lab.leader(other) == other, f"{other} leads", PATIENCE_S)
        lab.machines[other].run("sudo pheromonectl deposit path 0.6 0.6")
        assert lab.sense(other) > 0
        say(f"{first} led and is lost; {other} leads")

        lab.replace(first, other)
        assert lab.sense(first) > 0
        lab.machines["witness"].lose()
        lab.replace("witness", other)
        lab.machines[first].run("sudo pheromonectl deposit path 0.7 0.7")
    say("all held")
    shutil.rmtree(WORK)


if __name__ == "__main__":
    main()
