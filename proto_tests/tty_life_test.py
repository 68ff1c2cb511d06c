#!/usr/bin/env python3
"""USB serial adapters that are unplugged and replugged while others are served, in a VM.

    tty_life_test.py MACHINE PACKAGE.deb ROUNDS ACCELERATOR      what ./deploy/tty_test calls

MACHINE is a folder with the kernel, the initrd and the disk of a Debian that has a shell.service;
./deploy/tty_test makes it. The machine has eight adapters with FTDI's chip: a kernel's usbserial and
ftdi_sio, its udev with our rules and its systemd with our units serve them. The other end of each
is a socket here, with a robot at it that asks all the time; when the robot hangs up, the adapter is
pulled out. Links name their adapters by by-id name, by /dev/pheromone name and by USB identity,
and each serves its own robot alone, so that adapters that are mixed up would show.

Half of the adapters are there before the package is installed, half appear only after the service
has started. In each round four at random are pulled out and put back, then the other four, so that
each gets other ttyUSB numbers than before. Meanwhile each of the others gets an answer to each
request, its own and once. In the end every link serves under its name, each adapter has been gone
as often as it was pulled, by the kernel's own count, and the daemon, the same process as in the
beginning, holds no more descriptors and hardly more memory.
"""

import json
import pathlib
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time

from asking_robot import CONFIG, EXCHANGES, Robot, come_and_go, everyone_answered, serve
from checks import PATIENCE_S, check

ADAPTERS = 8
MACHINE_PATIENCE_S = 900  # where a busy machine emulates this one
MOST_GROWTH_KIB = 4096


def serial_number(client):
    return f"PHER{client:04}"


def by_id(client):
    return f"/dev/serial/by-id/usb-QEMU_QEMU_USB_SERIAL_{serial_number(client)}-if00-port0"


def configuration():
    text = CONFIG
    for client in range(1, ADAPTERS + 1):
        names = (f'port = "{by_id(client)}"', f'port = "/dev/pheromone/{serial_number(client)}"',
                 f'usb = "0403:6001:{serial_number(client)}"')
        text += (f'[[link]]\nname = "radio-{client}"\nkind = "serial"\nmedium_access = false\n'
                 f'clients = [{client}]\n{names[client % 3]}\n')
    return text


class Robot8N1(Robot):
    """At the other end of an adapter's line."""

    def __init__(self, client, folder):
        self.path = str(folder / f"radio-{client}")
        super().__init__(f"radio-{client}", client)

    def connect(self):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(self.path)
        self.socket.setblocking(False)
        self.fd = self.socket.fileno()

    def tear_down(self):
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def receive(self):
        data = self.socket.recv(4096)
        check(data, f"{self.name}: the machine is gone")
        return data


class Machine:
    def __init__(self, files, package, folder, accelerator):
        self.console = folder / "console.log"
        command = [
            "qemu-system-x86_64", "-nodefaults", "-no-user-config", "-display", "none", "-no-reboot",
            "-machine", f"q35,accel={accelerator}", "-smp", "2", "-m", "768",
            "-kernel", files / "kernel", "-initrd", files / "initrd",
            "-append", "root=/dev/vda rw console=ttyS0 panic=-1",
            "-serial", f"file:{self.console}",
            "-drive", f"file={files / 'disk'},if=virtio,format=raw,snapshot=on",
            "-virtfs", f"local,path={package.parent},mount_tag=package,security_model=none,"
                       "readonly=on",
            "-device", "virtio-serial",
            "-chardev", f"socket,id=shell,path={folder / 'shell'},server=on,wait=off",
            "-device", "virtserialport,chardev=shell,name=shell",
            "-device", f"qemu-xhci,id=usb,p2={ADAPTERS}"]
        for client in range(1, ADAPTERS + 1):
            # Such an adapter is plugged in while somebody is connected to its socket.
            command += [
                "-chardev", f"socket,id=radio-{client},path={folder}/radio-{client},"
                            "server=on,wait=off",
                "-device", f"usb-serial,bus=usb.0,port={client},chardev=radio-{client},"
                           f"serial={serial_number(client)}"]
        self.process = subprocess.Popen(command)
        self.shell = socket.socket(socket.AF_UNIX)
        end = time.monotonic() + PATIENCE_S
        while self.shell.connect_ex(str(folder / "shell")) != 0:
            check(self.process.poll() is None and time.monotonic() < end, "qemu does not start")
            time.sleep(0.02)
        self.shell.settimeout(MACHINE_PATIENCE_S)
        self.answers = self.shell.makefile("r")
        self.booted = False

    def await_boot(self):
        check(self.answers.readline() != "", "the machine does not boot")
        self.booted = True

    def run(self, command):
        """The output of a shell's command in the machine, which succeeds."""
        self.shell.sendall(json.dumps(command).encode() + b"\n")
        status, output = json.loads(self.answers.readline())
        check(status == 0, f"{command}: exit status {status}\n{output}")
        return output.strip()

    def number(self, command):
        return int(self.run(command))

    def explain(self):
        """What the machine last said, for whoever has to find out why a test failed."""
        if self.console.exists():
            print(self.console.read_text(errors="replace")[-2000:], file=sys.stderr)
        if self.booted:
            print(self.run("journalctl -b -u pheromoned -n 60 --no-pager"), file=sys.stderr)

    def stop(self):
        self.process.kill()
        self.process.wait()


class Service:
    """pheromoned in the machine."""

    def __init__(self, machine):
        self.machine = machine
        self.process = self.show("MainPID")
        check(self.process != "0", "the service does not run")

    def show(self, what):
        return self.machine.run(f"systemctl show -p {what} --value pheromoned")

    def descriptors(self):
        return self.machine.number(f"ls /proc/{self.process}/fd | wc -l")

    def rss_kib(self):
        status = self.machine.run(f"cat /proc/{self.process}/status")
        return int(re.search(r"VmRSS:\s+(\d+) kB", status)[1])

    def check_same(self):
        check(self.show("MainPID") == self.process and self.show("NRestarts") == "0",
              "the service was started again")


def install(machine, package):
    machine.run("mount -t 9p -o trans=virtio,ro package /mnt")
    machine.run(f"DEBIAN_FRONTEND=noninteractive dpkg -i /mnt/{package.name}")
    machine.run(f"cat >/etc/pheromone/pheromoned.toml <<'EOF'\n{configuration()}EOF")
    machine.run("systemctl restart pheromoned")


def check_adapters(machine, clients):
    """The effects of our udev rules on each adapter."""
    for client in clients:
        name = by_id(client)
        properties = machine.run(f"udevadm info -q property {name}").splitlines()
        check("ID_MM_DEVICE_IGNORE=1" in properties, f"{name}: ModemManager may have it")
        check(machine.run(f"stat -L -c '%G %a' {name}") == "dialout 660", f"{name}: its rights")
        device = machine.run(f"readlink -f {name}")
        check(machine.run(f"readlink -f /dev/pheromone/{serial_number(client)}") == device,
              f"{name} and the name in /dev/pheromone differ")
        latency = machine.run(f"cat /sys/class/tty/{pathlib.Path(device).name}/device/latency_timer")
        check(latency == "1", f"{name}: latency timer {latency} ms")


def times_pulled_out(machine):
    return machine.number("journalctl -k -b | "
                          "grep -c 'FTDI USB Serial Device converter now disconnected' || true")


def rounds_of_loss(machine, service, robots, rounds):
    rng = random.Random(1)
    serve(robots, everyone_answered(robots, EXCHANGES), "all are well")
    devices = {robot.client: set() for robot in robots}

    def one_round():
        rng.shuffle(robots)
        for half in (robots[:4], robots[4:]):
            come_and_go(robots, half)
        for client, device in enumerate(machine.run(
                "readlink -f " + " ".join(by_id(robot.client) for robot in sorted(
                    robots, key=lambda robot: robot.client))).splitlines(), start=1):
            devices[client].add(device)

    one_round()  # before it is measured: what is needed for that is kept
    descriptors, memory_kib = service.descriptors(), service.rss_kib()
    begun = time.monotonic()
    for robot in robots:
        robot.slowest_s = 0.0
    for done in range(1, rounds + 1):
        one_round()
        if done % 10 == 0:
            print(f"{done} rounds done", flush=True)
    print(f"{rounds} rounds in {time.monotonic() - begun:.0f} s, "
          f"{sum(robot.exchanges for robot in robots)} exchanges; the slowest answer after "
          f"{max(robot.slowest_s for robot in robots) * 1000:.0f} ms", flush=True)
    print("numbers that an adapter had: "
          f"{', '.join(str(len(of_one)) for of_one in devices.values())}", flush=True)
    growth_kib = service.rss_kib() - memory_kib
    print(f"descriptors {descriptors}, then {service.descriptors()}; the daemon of {memory_kib} KiB "
          f"has grown by {growth_kib} KiB", flush=True)
    service.check_same()
    check(service.descriptors() == descriptors, "descriptors leak")
    check(growth_kib < MOST_GROWTH_KIB, "memory leaks")
    pulled = times_pulled_out(machine)
    print(f"adapters pulled out: {pulled}", flush=True)
    check(pulled == ADAPTERS * (rounds + 1), "the kernel has not seen each of them go")


def run(machine, package, folder, rounds):
    there = [Robot8N1(client, folder) for client in range(1, ADAPTERS // 2 + 1)]
    machine.await_boot()
    print(machine.run("uname -srv"), "on", machine.run("systemd-detect-virt"), flush=True)
    install(machine, package)
    service = Service(machine)
    check_adapters(machine, [robot.client for robot in there])
    serve(there, everyone_answered(there, EXCHANGES), "those that were there are served")
    robots = there + [Robot8N1(client, folder)
                      for client in range(ADAPTERS // 2 + 1, ADAPTERS + 1)]
    for robot in robots:
        robot.may_lose = robot not in there
    serve(robots, everyone_answered(robots), "those that came later are served")
    come_and_go(robots, [])
    rounds_of_loss(machine, service, robots, rounds)
    check_adapters(machine, range(1, ADAPTERS + 1))
    machine.run("systemctl stop pheromoned")
    check(service.show("Result") == "success", "the service ended badly")
    complaints = machine.run("journalctl -k -b -o cat | "
                             "grep -E 'BUG|WARNING|Oops|hung task|general protection' || true")
    check(complaints == "", f"the kernel complains:\n{complaints}")


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("terminated"))  # and stop the machine
    with tempfile.TemporaryDirectory() as temporary:
        the_folder, the_package = pathlib.Path(temporary), pathlib.Path(sys.argv[2])
        the_machine = Machine(pathlib.Path(sys.argv[1]), the_package, the_folder, sys.argv[4])
        try:
            run(the_machine, the_package, the_folder, int(sys.argv[3]))
        except BaseException:
            the_machine.explain()
            raise
        finally:
            the_machine.stop()
    print("ok")
