"""Machines with networks of their own, on this one: network namespaces around a router.

    with Network("ab") as network:          # root only: can_make() tells
        subprocess.Popen(network.command("a", ["etcd", ...]))
        network.cut("a", "b")               # packets from a to b are lost, in the middle
        network.heal()

Machines are HOST addresses network.address(name); nobody else has them. Packets are dropped by the
router without a word, so that neither end learns of it, as behind a broken switch.
"""

import os
import shutil
import subprocess
import time

NET = "10.77"


def can_make(*others):
    """`others`: options of unshare for other namespaces."""
    return os.geteuid() == 0 and shutil.which("ip") is not None and subprocess.run(
        ["unshare", "-n", *others, "true"], stderr=subprocess.DEVNULL).returncode == 0


def address(number):
    """Of the machine of this number, from 1 on."""
    return f"{NET}.{number}.2"


class Network:
    def __init__(self, names):
        self.prefix = f"ph{os.getpid()}"
        self.names = list(names)
        self.cuts = set()
        self.changed_at = 0.0
        self._namespaces = []
        try:
            self._make()
        except BaseException:
            self.close()
            raise

    def address(self, name):
        return address(self.names.index(name) + 1)

    def space(self, name):
        return f"{self.prefix}{name}"

    def command(self, name, words):
        return ["ip", "netns", "exec", self.space(name), *map(str, words)]

    def _ip(self, *words):
        subprocess.run(["ip", *words], check=True)

    def _make(self):
        for name in ("router", *self.names):
            self._ip("netns", "add", self.space(name))
            self._namespaces.append(self.space(name))
            self._ip("-n", self.space(name), "link", "set", "lo", "up")
        router = self.space("router")
        for i, name in enumerate(self.names, 1):
            space = self.space(name)
            self._ip("-n", space, "link", "add", "eth0", "type", "veth", "peer", "name", f"to-{name}",
                     "netns", router)
            for where, device, last in ((space, "eth0", 2), (router, f"to-{name}", 1)):
                self._ip("-n", where, "addr", "add", f"{NET}.{i}.{last}/24", "dev", device)
                self._ip("-n", where, "link", "set", device, "up")
            self._ip("-n", space, "route", "add", "default", "via", f"{NET}.{i}.1")
        subprocess.run(["ip", "netns", "exec", router, "sh", "-c",
                        "echo 1 > /proc/sys/net/ipv4/ip_forward"], check=True)

    def cut(self, of, to):
        if (of, to) not in self.cuts:
            self.cuts.add((of, to))
            self._rule("add", of, to)

    def mend(self, of, to):
        if (of, to) in self.cuts:
            self.cuts.remove((of, to))
            self._rule("del", of, to)

    def heal(self):
        for of, to in list(self.cuts):
            self.mend(of, to)

    def _rule(self, what, of, to):
        self.changed_at = time.monotonic()
        self._ip("-n", self.space("router"), "rule", what, "from", self.address(of), "to",
                 self.address(to), "blackhole")

    def passes(self, of, to):
        return (of, to) not in self.cuts

    def close(self):
        for space in self._namespaces:
            subprocess.run(["ip", "netns", "del", space], check=False)
        self._namespaces = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
