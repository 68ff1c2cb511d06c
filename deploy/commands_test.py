#!/usr/bin/env python3
"""Runs the commands of README.md, of the first steps (deploy/examples/README.md), of the pages about the
Python package (deploy/python) and Arduinos (client_fw/boards/arduino), and of the manual pages' EXAMPLES,
literally and in order, each page in a shell and a folder of its own.

    commands_test.py BIN_DIR [UNITTEST ARGUMENT...]

The folder is as a clone after ./deploy/run: what is in the tree, and the programs in build/gate/bin.
Commands that last until Ctrl-C run beside those that follow, and get their Ctrl-C at the end. All of
it is done in a network of its own, where every port is free; without one, the test is skipped.
"""

import fcntl
import os
import pathlib
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
MAN = ROOT / "deploy" / "man"
EXAMPLES = ROOT / "deploy" / "examples"
BIN = pathlib.Path()
PATIENCE_S = 120
SKIPPED = 77

# Commands that last until Ctrl-C.
LASTING = re.compile(r"pheromoned --config \S+$"
                     r"|pheromone-swarm run --robots \d+$"
                     r"|pheromone-swarm live (?!.*--seconds)"
                     r"|pheromone-swarm pioneer "
                     r"|pheromone-robot "
                     r"|/usr/sbin/mosquitto |python3 \S+/mqtt\.py "
                     r"|pheromone-experiments trails .*--daemon ")
# What is run elsewhere, and where: a line of that file.
ELSEWHERE = {
    "./deploy/run --seconds 60": ("deploy/bare_test", "./deploy/run --seconds 60"),
    "./deploy/test": ("deploy/bare_test", "./deploy/test"),
    "cmake --build build/gate --target pheromone-experiments   # not part of what ./deploy/run builds":
        ("deploy/bare_test", "cmake --build build/gate --target pheromone-experiments"),
    "pheromonectl journal check /var/lib/pheromone/pheromoned/journal":
        ("deploy/package_steps", "pheromonectl journal check /var/lib/pheromone/pheromoned/journal"),
}

# What is refuted, as the page says.
REFUTED = ("pheromonectl net check deploy/examples/nets/broken/red_by_timer.toml",)


def blocks_of(markdown):
    """The commands of a page's blocks of "sh", with the lines that belong together joined."""
    text = "\n".join(re.findall(r"^```sh\n(.*?)^```", markdown, re.M | re.S))
    return commands_of(text)


def commands_of(text):
    lines = text.replace("\\\n", " ").splitlines()
    return [line.strip().removeprefix("$ ") for line in lines if line.strip()]


def examples_of(page):
    """The literal displays of a manual page's EXAMPLES, as they are shown."""
    text = (MAN / page).read_text(encoding="utf-8")
    section = text.split(".Sh EXAMPLES\n")[1].split("\n.Sh ")[0]
    displays = re.findall(r"^\.Bd -literal.*?\n(.*?)^\.Ed", section, re.M | re.S)
    return [it.replace("\\e", "\\").replace("\\-", "-").replace("\\(dq", '"') for it in displays]


class Lasting:
    """A command in a process group of its own, and what it has printed."""

    def __init__(self, command, folder, environment):
        self.command = command
        self.output = tempfile.TemporaryFile()
        self.process = subprocess.Popen(["bash", "-c", f"exec {command}"], cwd=folder,
                                        env=environment, stdin=subprocess.DEVNULL,
                                        stdout=self.output, stderr=self.output,
                                        start_new_session=True)

    def text(self):
        self.output.seek(0)
        return self.output.read().decode(errors="replace")

    def stop(self):
        os.killpg(self.process.pid, signal.SIGINT)
        status = self.process.wait(PATIENCE_S)
        text = self.text()
        self.output.close()
        return status, text


class Page(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        for entry in ROOT.iterdir():
            if entry.name not in ("build", ".git"):
                (self.folder / entry.name).symlink_to(entry)
        (self.folder / "build" / "gate").mkdir(parents=True)
        (self.folder / "build" / "gate" / "bin").symlink_to(BIN)
        self.environment = dict(os.environ, PATH=f"{BIN}:{os.environ['PATH']}")
        self.lasting = []
        self.addCleanup(self.kill)

    def kill(self):
        for it in self.lasting:
            if it.process.poll() is None:
                os.killpg(it.process.pid, signal.SIGKILL)
            it.process.wait()

    def lay_out(self, folder):
        """What is in a folder of examples lies in the working directory."""
        for entry in folder.iterdir():
            if not (self.folder / entry.name).is_symlink():
                (self.folder / entry.name).symlink_to(entry)

    def await_that(self, holds, what):
        end = time.monotonic() + PATIENCE_S
        while not holds():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.05)

    def run_it(self, command, status=0):
        result = subprocess.run(["bash", "-c", command], cwd=self.folder, env=self.environment,
                                text=True, capture_output=True, timeout=PATIENCE_S * 5,
                                stdin=subprocess.DEVNULL, check=False)
        self.assertEqual(result.returncode, status,
                         (command, result.stdout[-2000:], result.stderr))
        return result.stdout

    def begin(self, command):
        it = Lasting(command, self.folder, self.environment)
        self.lasting.append(it)
        words = f"{command} printed nothing, or ended:\n"
        if command.startswith("pheromoned "):
            self.await_that(lambda: "ready: " in it.text() or it.process.poll() is not None, words)
        elif "pheromone-swarm live" in command:
            self.await_that(lambda: self.poses() or it.process.poll() is not None, words)
        elif number := re.search(r"--robots (\d+)", command):
            self.await_that(lambda: self.poses() == int(number[1]) or it.process.poll() is not None,
                            words)
        else:
            self.await_that(lambda: it.text() or it.process.poll() is not None, words)
        self.assertIsNone(it.process.poll(), words + it.text())
        return it

    def poses(self):
        return self.run_it("pheromonectl clients --json").replace(" ", "").count('"pose":{')

    def end(self, it, statuses=(0,)):
        self.lasting.remove(it)
        status, text = it.stop()
        self.assertIn(status, statuses, f"{it.command}\n{text}")

    def follow(self, commands, statuses=(0,)):
        """Runs them; `statuses` are those of lasting commands when they end."""
        self.assertTrue(commands)
        for command in commands:
            if command in ELSEWHERE:
                file, line = ELSEWHERE[command]
                lines = [it.strip() for it in (ROOT / file).read_text().splitlines()]
                self.assertTrue(line in lines, f"{command} is not run by {file}")
            elif command.startswith("export "):
                name, value = command.removeprefix("export ").split("=", 1)
                self.environment[name] = self.run_it(f"printf %s {value}")
            elif command.startswith("kill -HUP $!"):
                os.kill(self.lasting[-1].process.pid, signal.SIGHUP)
                self.await_that(lambda: "configuration reread" in self.lasting[-1].text(), command)
            elif command.startswith("python3 ") and "figure.py" in command and not HAS_MATPLOTLIB:
                print(f"not run, there is no matplotlib: {command}")
            elif LASTING.match(command.removesuffix(" &")):
                self.free_the_modem_for(command, statuses)
                self.begin(command.removesuffix(" &"))
            else:
                self.free_the_modem_for(command, statuses)
                self.run_it(command, 1 if command in REFUTED else 0)
        while self.lasting:
            self.end(self.lasting[-1], statuses)

    def free_the_modem_for(self, command, statuses):
        if "--daemon" not in command and "--robots" not in command:
            return
        for it in [it for it in self.lasting if "pheromone-swarm live" in it.command]:
            self.end(it, statuses)


class ReadmeTest(Page):
    def test_readme(self):
        self.follow(blocks_of((ROOT / "README.md").read_text(encoding="utf-8")))

    def test_first_steps(self):
        self.follow(blocks_of((EXAMPLES / "README.md").read_text(encoding="utf-8")))

    def test_arduino(self):
        page = ROOT / "client_fw" / "boards" / "arduino" / "README.md"
        self.follow(blocks_of(page.read_text(encoding="utf-8")))


class PythonTest(Page):
    def test_python(self):
        """With the system's own Python: it is the one that packages.test is for."""
        (self.folder / "deploy").unlink()
        shutil.copytree(ROOT / "deploy/python", self.folder / "deploy/python",  # pip builds in it
                        ignore=shutil.ignore_patterns("__pycache__", "build", "*.egg-info"))
        self.environment["PATH"] = "/usr/bin:" + self.environment["PATH"]
        self.follow(blocks_of((ROOT / "deploy/python/README.md").read_text(encoding="utf-8")),
                    statuses=(0, -signal.SIGINT))
        module = self.run_it("cd / && python3 -c 'import pheromone; print(pheromone.__file__)'")
        installed = pathlib.Path(module.strip()).parent
        self.assertEqual(installed.parents[4], self.folder / "build")
        self.assertTrue((installed / "py.typed").is_file())
        self.assertTrue((self.folder / "map.png").read_bytes().startswith(b"\x89PNG"))


class ManualTest(Page):
    def commands(self, page):
        return [it for text in examples_of(page) for it in commands_of(text)]

    def test_every_page_with_examples_is_here(self):
        with_examples = {page.name for page in MAN.iterdir() if ".Sh EXAMPLES" in page.read_text()}
        self.assertEqual(with_examples, {
            "pheromone-experiments.1", "pheromone-net.5", "pheromone-robot.1",
            "pheromone-scenario.5", "pheromone-swarm.1", "pheromone-tracker.1", "pheromonectl.1", "pheromoned.8",
            "pheromoned.toml.5"})

    def test_pheromoned(self):
        self.follow(self.commands("pheromoned.8"))

    def test_pheromonectl(self):
        self.lay_out(EXAMPLES / "nets")
        self.run_it("pheromoned --default-config > lab.toml")
        server = self.begin("pheromoned --config lab.toml --save-field lab.field")
        self.run_it("pheromonectl deposit trail 1 1")
        os.kill(server.process.pid, signal.SIGUSR1)
        self.await_that((self.folder / "lab.field").exists, "the field is saved")
        self.follow(self.commands("pheromonectl.1"))

    def test_pheromone_swarm(self):
        self.run_it("pheromoned --default-config > lab.toml")
        self.begin("pheromoned --config lab.toml")
        self.lay_out(ROOT / "client_fw/lab/examples")
        commands = self.commands("pheromone-swarm.1")
        own = next(i for i, it in enumerate(commands) if " lab config " in it)
        self.follow(commands[:own])
        self.follow(commands[own:])  # with a server of its own

    def test_pheromone_robot(self):
        self.follow(self.commands("pheromone-robot.1"), statuses=(0, 1))  # there is no robot

    def test_pheromone_tracker(self):
        self.lay_out(ROOT / "client_fw/tracker/examples")
        self.follow(self.commands("pheromone-tracker.1"))

    def test_pheromone_experiments(self):
        self.lay_out(EXAMPLES)
        self.lay_out(ROOT / "client_fw/experiments/cleaning/floors")
        self.follow(self.commands("pheromone-experiments.1"))

    def check_file(self, page, name, command):
        (text,) = [it for it in examples_of(page) if "[" in it]
        (self.folder / name).write_text(text)
        self.run_it(command)

    def test_configuration(self):
        self.check_file("pheromoned.toml.5", "a.toml", "pheromoned --check --config a.toml")

    def test_scenario(self):
        self.check_file("pheromone-scenario.5", "a.toml", "pheromone-swarm run a.toml")

    def test_net(self):
        self.check_file("pheromone-net.5", "a.toml", "pheromonectl net check a.toml")


HAS_MATPLOTLIB = subprocess.run(["python3", "-c", "import matplotlib"], capture_output=True,
                                check=False).returncode == 0


def bring_up_loopback():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, 0x8914, struct.pack("16sh", b"lo", 1))  # SIOCSIFFLAGS, IFF_UP


def main():
    global BIN
    if os.environ.get("COMMANDS_TEST_INSIDE") != "yes":
        own = ["unshare", "--net", *([] if os.geteuid() == 0 else ["--map-root-user"])]
        if shutil.which("unshare") is None or subprocess.run(
                [*own, "true"], capture_output=True, check=False).returncode != 0:
            print("no network namespace can be made here")
            sys.exit(SKIPPED)
        os.environ["COMMANDS_TEST_INSIDE"] = "yes"
        os.execvp(own[0], [*own, sys.executable, *sys.argv])
    bring_up_loopback()
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()


if __name__ == "__main__":
    main()
