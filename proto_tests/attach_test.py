#!/usr/bin/env python3
"""pheromone-robot between the simulated Pioneer and the real daemon: three processes, in real time.

Over TCP it follows a painted path, and goes on after each of these: the daemon freezes, and is killed
and started again; the robot's connection is closed, and its network falls silent. Over
pseudo-terminals it is killed while it drives, and started again. Every run ends with a robot that
stands and a session that is closed. What is asserted about time is that all this happens at all; how
fast the robot stands is tested in virtual time (attached_robot_test).

Usage: attach_test.py BIN_DIR [tcp|others]
"""

import contextlib
import json
import math
import os
import pathlib
import re
import select
import signal
import socket
import subprocess
import sys
import tempfile
import termios
import threading
import tty

from free_numbers import free_port
from operated_daemon import PATIENCE_S, OperatedDaemon, await_that, check
from test_config import link, map_of, pheromone, pty

README = pathlib.Path(__file__).resolve().parents[1] / "client_fw/attach/README.md"
START = (1.5, 2.2, 20.0)  # 0.2 m beside the path, and 20 degrees off, as in the paper's experiment
PATH_Y = 2.0
EVERY_S = 0.05  # between the true poses that the Pioneer tells
MOST_MEAN_MM = 150  # 30 mm on a quiet machine; a starved one makes the robot stop and go

CONFIG = (map_of(60.0, 4.0, wide=True) + pheromone(1, "path") + pty("radio-a")
          + link("tcp", "tcp", listen="127.0.0.1:TCP_PORT") + link("udp", "udp", listen="127.0.0.1:0"))


class Program:
    """A process, and the lines that it prints."""

    def __init__(self, *command, **options):
        self.lines = []
        self.reads_no_more = False
        self.process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE,
                                        text=True, **options)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        while not self.reads_no_more:
            line = self.process.stdout.readline()
            if not line:
                return
            self.lines.append(line)
        self.process.stdout.close()

    def stop_reading(self):
        """After the next line: the program's output leads nowhere then."""
        self.reads_no_more = True
        self.reader.join(PATIENCE_S)
        check(self.process.stdout.closed, f"no line comes:\n{self.text()}")

    def text(self):
        return "".join(self.lines)

    def await_line(self, text, since=0):
        """Returns the number of lines up to the one that contains `text`, after the first `since`."""
        found = []

        def there():
            found[:] = [i for i, line in enumerate(self.lines[since:], since) if text in line]
            check(found or self.process.poll() is None,
                  f"ended with {self.process.poll()} before \"{text}\":\n{self.text()}")
            return found

        try:
            await_that(there, f"\"{text}\" comes")
        except AssertionError as error:
            raise AssertionError(f"{error}:\n{self.text()}") from None
        return found[0] + 1

    def end(self, sent):
        self.process.send_signal(sent)
        status = self.process.wait(PATIENCE_S)
        self.reader.join(PATIENCE_S)
        return status

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


class Pioneer(Program):
    """pheromone-swarm pioneer, which tells where it truly is."""

    def __init__(self, bin_dir, *port):
        super().__init__(bin_dir / "pheromone-swarm", "pioneer", "--model", "p3dx-sh", *port,
                         "--start", *START, "--poses", EVERY_S)
        self.await_line("Ctrl-C ends it")

    def tcp_port(self):
        return int(self.lines[0].split("127.0.0.1:")[1].split(";")[0])

    def states(self):
        """The lines about its client, without poses."""
        return [line for line in self.lines if "true pose" not in line]

    def poses(self):
        """(time, x, y), in s and m."""
        found = (re.match(r" *([\d.]+) s  true pose (-?[\d.]+) (-?[\d.]+) m", line)
                 for line in list(self.lines))
        return [tuple(float(number) for number in match.groups()) for match in found if match]

    def drives(self):
        """For a second, from now on."""
        since = len(self.poses())
        await_that(lambda: self._row(since, 20, lambda a, b: a != b), "the robot drives")

    def stands(self):
        """From now on; its time then."""
        since = len(self.poses())
        await_that(lambda: self._row(since, 4, lambda a, b: a == b), "the robot stands")
        return self._row(since, 4, lambda a, b: a == b)

    def now_s(self):
        return self.poses()[-1][0]

    def _row(self, since, length, holds):
        """The time of the first of `length` poses in a row, each of which `holds` with the next."""
        poses = self.poses()[since:]
        for i in range(len(poses) - length + 1):
            row = poses[i:i + length]
            if all(holds(a[1:], b[1:]) for a, b in zip(row, row[1:])):
                return row[0][0]
        return None

    def mean_distance_mm(self, after_s):
        poses = self.poses()
        first = next(now[0] for now, then in zip(poses, poses[1:]) if now[1:] != then[1:])
        away = [abs(y_m - PATH_Y) * 1000 for at, _, y_m in poses if at > first + after_s]
        return sum(away) / len(away)


class Cable:
    """A TCP port that leads to the Pioneer's. It can be cut: closed to both sides, or silent."""

    def __init__(self, pioneer_port):
        self.pioneer_port = pioneer_port
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.closed = False
        self.swallows = False
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            client, _ = self.listener.accept()
            if self.closed:
                client.close()
                continue
            robot = socket.create_connection(("127.0.0.1", self.pioneer_port))
            self._relay(client, robot)

    def _relay(self, client, robot):
        swallows = False
        try:
            while not self.closed:
                for end in select.select([client, robot], [], [], 0.02)[0]:
                    data = end.recv(4096)
                    if not data:
                        return
                    swallows = swallows or self.swallows  # until there is another connection
                    if not swallows:
                        (robot if end is client else client).sendall(data)
        except OSError:
            pass
        finally:
            client.close()
            robot.close()


class World:
    """A daemon with its path painted. Ends everything at the end."""

    def __init__(self, bin_dir, folder):
        self.bin_dir, self.folder = bin_dir, folder
        self.programs = []
        (folder / "test.toml").write_text(CONFIG.replace("TCP_PORT", str(free_port())))
        self.start_daemon()

    def start_daemon(self):
        self.daemon = OperatedDaemon(self.bin_dir, self.folder)
        self.ctl("paint", "path", "1", str(PATH_Y), "58", str(PATH_Y), "--radius", "0.05")

    def ctl(self, *command):
        subprocess.run([self.bin_dir / "pheromonectl", *command], cwd=self.folder, check=True,
                       stdout=subprocess.DEVNULL, timeout=PATIENCE_S)

    def tcp_port(self):
        return next(line.split(":")[-1].strip('"\n') for line in
                    (self.folder / "test.toml").read_text().splitlines() if "listen" in line)

    def start(self, program):
        self.programs.append(program)
        return program

    def robot(self, robot, modem, *options):
        return self.start(Program(self.bin_dir / "pheromone-robot", "--robot", robot, "--modem", modem,
                                  "--start", *START, "--wide", "--speed", "300", "--released", *options,
                                  cwd=self.folder))

    def close(self):
        for program in self.programs:
            program.kill()
        self.daemon.kill()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def ends(robot, sent):
    """Ends it: the robot stands then."""
    status = robot.end(sent)
    check(status == 0, f"ended with {status}:\n{robot.text()}")
    check("the robot stands" in robot.text(), robot.text())


def check_left(pioneer):
    """Its session was closed, and it stands."""
    await_no_session(pioneer)
    pioneer.stands()
    check(pioneer.end(signal.SIGTERM) == 0, pioneer.text())


def await_no_session(pioneer):
    await_that(lambda: re.search("no session|no client", pioneer.states()[-1]),
               "the session is closed")


def follows_a_path_over_tcp_and_goes_on_after_every_cut(bin_dir, folder):
    with World(bin_dir, folder) as world:
        pioneer = world.start(Pioneer(bin_dir, "--tcp", "0"))
        cable = Cable(pioneer.tcp_port())
        address = f"127.0.0.1:{cable.port}"
        robot = world.robot(address, f"127.0.0.1:{world.tcp_port()}", "--status", "1")
        await_that(lambda: pioneer.poses() and pioneer.poses()[-1][1] > START[0] + 4,
                   "it has driven 4 m")
        mean_mm = pioneer.mean_distance_mm(5)
        print(f"mean distance from the path after 5 s: {mean_mm:.0f} mm")
        check(mean_mm < MOST_MEAN_MM, f"{mean_mm} mm from the path")

        cut_s = pioneer.now_s()
        world.daemon.process.send_signal(signal.SIGSTOP)
        print(f"the daemon froze: the robot stood after {pioneer.stands() - cut_s:.2f} s")
        world.daemon.process.send_signal(signal.SIGCONT)
        pioneer.drives()

        told = len(robot.lines)
        cut_s = pioneer.now_s()
        cable.closed = True
        print(f"its connection was closed: the robot stood after {pioneer.stands() - cut_s:.2f} s")
        told = robot.await_line(f"robot {address}: closed by the other side; trying again", told)
        cable.closed = False
        told = robot.await_line(f"robot {address}: session open", told)
        pioneer.drives()

        cut_s = pioneer.now_s()
        cut_line = len(robot.lines)
        cable.swallows = True
        print(f"its network fell silent: the robot stood after {pioneer.stands() - cut_s:.2f} s")
        told = robot.await_line(f"robot {address}: nothing received for 3 s; trying again", told)
        robot.await_line("the robot is not heard", cut_line)
        check(not any(" stands: " in line for line in robot.lines[cut_line:]), robot.text())
        cable.swallows = False
        robot.await_line(f"robot {address}: session open", told)
        pioneer.drives()

        cut_s = pioneer.now_s()
        world.daemon.kill()
        print(f"the daemon was killed: the robot stood after {pioneer.stands() - cut_s:.2f} s")
        world.start_daemon()
        pioneer.drives()
        check(abs(pioneer.poses()[-1][2] - PATH_Y) < 0.5, f"off the path: {pioneer.poses()[-1]}")

        ends(robot, signal.SIGTERM)
        print(robot.text())
        check_left(pioneer)
        world.daemon.stop()


def drives_over_terminals_and_takes_up_the_session_of_one_that_was_killed(bin_dir, folder):
    with World(bin_dir, folder) as world:
        pty = folder / "pioneer.pty"
        pioneer = world.start(Pioneer(bin_dir, "--pty", pty))
        robot = world.robot(pty, "radio-a.pty")
        robot.await_line("drives")
        robot.kill()

        robot = world.robot(pty, "radio-a.pty", "--status", "0.5")
        told = robot.await_line("drives")
        robot.await_line(", wheels 300 ", told)  # the left one at full speed; the path decides on the other
        await_that(lambda: "session 2, motors on" in pioneer.text(), "there is a second session")
        robot.stop_reading()  # whoever reads the lines goes: nothing happens
        robot.process.send_signal(signal.SIGHUP)
        status = robot.process.wait(PATIENCE_S)
        check(status == 0, f"ended with {status}")
        await_no_session(pioneer)


class RatedCable:
    """A terminal for pheromone-robot that carries bytes to and from the Pioneer's terminal only at one
    rate; at others, what it sends is garbled, and nothing comes back."""

    def __init__(self, pioneer_pty, speed):
        self.speed = speed
        self.inner = os.open(pioneer_pty, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.inner)
        self.master, self.slave = os.openpty()
        self.path = os.ttyname(self.slave)
        threading.Thread(target=self._carry, daemon=True).start()

    def _carry(self):
        while True:
            ready, _, _ = select.select((self.inner, self.master), (), ())
            for port in ready:
                try:
                    data = os.read(port, 4096)
                except OSError:
                    return
                fits = termios.tcgetattr(self.slave)[5] == self.speed
                if port == self.master:
                    os.write(self.inner, data if fits else bytes(0x55 for _ in data))
                elif fits:
                    os.write(self.master, data)


def finds_a_robot_that_was_left_at_another_rate(bin_dir, folder):
    with World(bin_dir, folder) as world:
        port = folder / "pioneer.pty"
        later = folder / "later"
        robot = world.robot(later, "radio-a.pty", "--status", "1")
        for _ in range(3):  # longer than it tries one rate
            robot.await_line("pose unknown", len(robot.lines))
        pioneer = world.start(Pioneer(bin_dir, "--pty", port))
        cable = RatedCable(port, termios.B38400)
        later.symlink_to(cable.path)
        robot.await_line("no answer at 9600 baud, trying 38400")
        check("no answer at 38400" not in robot.text(), robot.text())
        robot.await_line("session open")
        robot.await_line("drives")
        ends(robot, signal.SIGTERM)
        await_no_session(pioneer)


def drives_over_udp(bin_dir, folder):
    with World(bin_dir, folder) as world:
        pioneer = world.start(Pioneer(bin_dir, "--tcp", "0"))
        robot = world.robot(f"localhost:{pioneer.tcp_port()}",
                            f"udp:127.0.0.1:{world.daemon.udp_port()}")
        robot.await_line("HELLO answered, protocol version 1")
        robot.await_line("drives")
        ends(robot, signal.SIGINT)
        check_left(pioneer)
        check(" 0 watchdog stops" in pioneer.text(), f"it was left alone:\n{pioneer.text()}")


def readme_blocks():
    """The commands of client_fw/attach/README.md."""
    return re.findall(r"^```sh\n(.*?)^```$", README.read_text(encoding="utf-8"), re.M | re.S)


def does_what_the_readme_says(bin_dir, folder):
    (folder / "test.toml").write_text(subprocess.run(
        [bin_dir / "pheromoned", "--default-config"], check=True, capture_output=True,
        text=True).stdout.replace("127.0.0.1:8377", "127.0.0.1:0"))
    daemon = OperatedDaemon(bin_dir, folder)
    shells = []

    def run(block):
        # The service's folder is this one, and the port is one that is free.
        for installed, here in (("/run/pheromone/pheromoned/", f"{folder}/"), ("8101", port)):
            block = block.replace(installed, here)
        shells.append(Program("bash", "-e", "-c", block + "\nwait", cwd=folder, env={
            **os.environ, "PATH": f"{bin_dir}:{os.environ['PATH']}"}, start_new_session=True))
        return shells[-1]

    def gone_m():
        """How far robot 1 has come from (5, 3); -1 if the server has not heard of it."""
        clients = json.loads(subprocess.run(
            [bin_dir / "pheromonectl", "clients", "--json"], cwd=folder, check=True,
            capture_output=True, timeout=PATIENCE_S).stdout)["clients"]
        poses = [client["pose"] for client in clients if client["id"] == 1 and client.get("pose")]
        return math.hypot(poses[0]["x_m"] - 5, poses[0]["y_m"] - 3) if poses else -1

    port = str(free_port())
    blocks = readme_blocks()
    check(len(blocks) == 3, f"README.md: {len(blocks)} blocks")
    try:
        shell = run(blocks[0])
        shell.await_line("stands: halted")
        await_that(lambda: gone_m() >= 0, "the server has heard of the robot")
        check(gone_m() < 0.01, "the robot moves before it is told to")
        resume = run(blocks[1])
        check(resume.process.wait(PATIENCE_S) == 0, f"README.md: {blocks[1]} failed")
        await_that(lambda: gone_m() > 0.5, "the robot has driven half a metre")
        robot = child_of(shell.process.pid, "pheromone-robot")
        os.kill(robot, signal.SIGTERM)
        shell.await_line("the robot stands")
    finally:
        for shell in shells:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(shell.process.pid, signal.SIGKILL)
        daemon.kill()


def child_of(parent, name):
    children = pathlib.Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return next(int(child) for child in children
                if pathlib.Path(f"/proc/{child}/comm").read_text().strip() == name)


def says_what_is_wrong_with_the_command_line(bin_dir, folder):
    good = {"--robot": "nowhere", "--modem": "nowhere", "--start": "0 0 0"}
    for option, value, told in (
            ("--robot", "", "empty address"), ("--robot", "udp:localhost:1", "not by UDP"),
            ("--robot", "localhost:0", 'port "0", expected 1 to 65535'),
            ("--modem", "no.such.host.invalid:1", 'host "no.such.host.invalid"'),
            ("--start", "1 2", "3 required"), ("--start", "nan 0 0", "nan m, expected"),
            ("--start", "1e9 0 0", "expected at most"), ("--start", "0 0 inf", "heading"),
            ("--id", "0", "1 to 254"), ("--id", "255", "1 to 254"), ("--type", "16", "1 to 15"),
            ("--speed", "-5", "20 to 1000"), ("--speed", "fast", "fast"),
            ("--fail-safe", "99", "100 to 2000"), ("--fail-safe", "200", "more than the period"),
            ("--speed", "900 --fail-safe 2000", "drives 1800 mm in 2000 ms"),
            ("--robot-baud", "1234", "9600"), ("--seconds", "nan", 'found "nan", expected a number from 0.1'),
            ("--status", "0", 'found "0", expected a number from 0.1')):
        words = []
        for name, text in {**good, option: value}.items():
            words += [name, *(text.split() if name != "--robot" else [text])]
        run = subprocess.run([bin_dir / "pheromone-robot", *words], capture_output=True, text=True,
                             cwd=folder, timeout=PATIENCE_S, check=False)
        check(run.returncode == 2 and told in run.stderr,
              f"{words}: ended with {run.returncode}: {run.stdout}{run.stderr}")
    for missing in good:
        words = [word for name, text in good.items() if name != missing
                 for word in (name, *text.split())]
        run = subprocess.run([bin_dir / "pheromone-robot", *words], capture_output=True, text=True,
                             timeout=PATIENCE_S, check=False)
        check(run.returncode == 2 and f"{missing} is required" in run.stderr, run.stderr)


def says_that_a_robot_that_was_never_there_was_not_stopped(bin_dir, folder):
    robot = Program(bin_dir / "pheromone-robot", "--robot", "nowhere", "--modem", "nowhere", "--start",
                    "0", "0", "0", cwd=folder)
    robot.await_line("robot nowhere: No such file or directory; trying again")
    robot.await_line("server nowhere: No such file or directory; trying again")
    status = robot.end(signal.SIGTERM)
    check(status == 1 and "did not confirm that it stands" in robot.text(), robot.text())


def main():
    bin_dir = pathlib.Path(os.path.abspath(sys.argv[1]))
    tests = {"others": (says_what_is_wrong_with_the_command_line,
                        says_that_a_robot_that_was_never_there_was_not_stopped, drives_over_udp,
                        does_what_the_readme_says,
                        drives_over_terminals_and_takes_up_the_session_of_one_that_was_killed,
                        finds_a_robot_that_was_left_at_another_rate),
             "tcp": (follows_a_path_over_tcp_and_goes_on_after_every_cut,)}
    for test in tests[sys.argv[2]] if len(sys.argv) > 2 else tests["others"] + tests["tcp"]:
        print(f"--- {test.__name__}", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            test(bin_dir, pathlib.Path(folder))
    print("ok")


if __name__ == "__main__":
    main()
