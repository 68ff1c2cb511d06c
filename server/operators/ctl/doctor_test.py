#!/usr/bin/env python3
"""Faults of a laboratory's first day, planted one by one: pheromonectl doctor finds each, and says what
mends it.

    doctor_test.py BIN_DIR
"""

import contextlib
import json
import os
import pathlib
import pty
import re
import socket
import subprocess
import sys
import tempfile
import time
import tty
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "proto_tests"))
from operated_daemon import OperatedDaemon, await_that, write_config  # noqa: E402
from stranger import wire  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402
from test_config import link, map_of, pheromone, pty as pty_link, table  # noqa: E402

BIN = pathlib.Path()
PATIENCE_S = 60
NOBODY = 65534

MAP = map_of(4.0, 3.0, bias_m=0.2) + pheromone(1, "path", sigma_m=0.3)
WEB = table("web", listen="127.0.0.1:0", token_file="token")
JOURNAL = table("journal", folder="journal")
SOUND = MAP + pty_link("radio-a") + WEB + JOURNAL
TRACKED = SOUND + table("[tracker]", name="ceiling", listen="127.0.0.1:0")


def serial(port):
    return link("modem", "serial", port=str(port))


class Laboratory(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.folder.chmod(0o755)
        self.configure(SOUND)

    def configure(self, config):
        write_config(self.folder, config)

    def serve(self, config):
        self.configure(config)
        daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(daemon.kill)
        return daemon

    def examine(self, *arguments, **kwargs):
        """The exit status, and what was found."""
        result = subprocess.run(
            [BIN / "pheromonectl", "doctor", "--json", *arguments], cwd=self.folder, text=True,
            capture_output=True, timeout=PATIENCE_S, check=False, **kwargs)
        self.assertEqual(result.stderr, "")
        report = json.loads(result.stdout)
        levels = [it["level"] for it in report["findings"]]
        self.assertEqual(report["faults"], levels.count("fault"))
        self.assertEqual(report["warnings"], levels.count("warning"))
        self.assertEqual(result.returncode, 1 if report["faults"] else 0)
        for it in report["findings"]:
            self.assertEqual(it["mend"] is None, it["level"] == "ok", it)
            if it["mend"]:
                self.assertTrue(it["mend"].endswith("."), it)
        return report["findings"]

    def assert_found(self, level, subject, found, mend, findings):
        """One finding, and no fault beside it."""
        fits = [it for it in findings if (it["level"], it["subject"]) == (level, subject)
                and re.search(found, it["looked_at"] + ": " + it["found"])]
        self.assertEqual(len(fits), 1, findings)
        self.assertRegex(fits[0]["mend"], mend)
        others = [it for it in findings if it["level"] == "fault" and it is not fits[0]]
        self.assertEqual(others, [])

    def examine_file(self, *arguments, **kwargs):
        return self.examine("--config", "test.toml", *arguments, **kwargs)

    def held(self, path):
        """Another program that has it open; ends with the test."""
        handle = os.open(path, os.O_RDWR | os.O_NOCTTY)
        holder = subprocess.Popen(["sleep", "1000"], stdin=handle)
        os.close(handle)

        def end():
            holder.kill()
            holder.wait()
        self.addCleanup(end)
        await_that(lambda: pathlib.Path(f"/proc/{holder.pid}/comm").read_text() == "sleep\n",
                   "the program runs")
        return holder

    def device(self):
        """A terminal as a serial device, and where it is."""
        master, slave = pty.openpty()
        self.addCleanup(os.close, master)
        path = os.ttyname(slave)
        os.close(slave)
        return path

    def unprivileged(self, path):
        """Takes a file from whoever runs the result's program."""
        if os.geteuid() == 0:
            os.chown(path, 0, 0)
            os.chmod(path, 0o600)
            return {"user": NOBODY, "group": NOBODY, "extra_groups": []}
        os.chmod(path, 0)
        return {}


class WithoutServerTest(Laboratory):
    def test_a_sound_laboratory_has_no_fault(self):
        findings = self.examine_file()
        self.assertEqual([it for it in findings if it["level"] == "fault"], [])
        self.assert_found("warning", "server", "no server runs there", "Start pheromoned", findings)
        well = {it["subject"] for it in findings if it["level"] == "ok"}
        self.assertLessEqual({"configuration", "journal", "token", "ports", "groups"}, well)

    def test_a_key_that_does_not_exist(self):
        self.configure(SOUND.replace("sigma_m", "sigmam"))
        findings = self.examine_file()
        self.assertTrue(any(re.search(r"test\.toml:\d+:\d+: pheromone\[1\]\.sigmam: ", it["found"])
                            and it["level"] == "fault" and "Correct this" in it["mend"]
                            for it in findings), findings)

    def test_a_node_of_a_cluster(self):
        (self.folder / "secret").write_text("0123456789abcdef" * 4)
        (self.folder / "secret").chmod(0o600)
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            address = f"127.0.0.1:{taken.getsockname()[1]}"

            def configure(**keys):
                self.configure(
                    SOUND + link("modem", "serial", port="/dev/of-the-other", on=["b"])
                    + table("cluster", name="lab", engine=["http://127.0.0.1:1"], secret_file="secret",
                            nodes={"a": address, "b": "127.0.0.2:8390"}, **keys))
            configure(node="a")
            self.assert_found("fault", "ports", f"node a, TCP {address}: in use by ",
                              r"choose another port with nodes in \[cluster\]\.", self.examine_file())
            configure()
            self.assert_found("warning", "configuration", r"cluster\.node.*named as this machine",
                              "pheromoned --node NAME", self.examine_file())

    def test_antennas_that_are_metres_apart(self):
        self.configure(SOUND.replace("bias_m = 0.2", "bias_m = 33"))
        self.assert_found("warning", "configuration", "33", "Change the value", self.examine_file())

    def test_a_journal_in_a_folder_that_is_not_there(self):
        self.configure(SOUND.replace('"journal"', '"missing/journal"'))
        self.assert_found("fault", "journal", "missing: No such file", "Create that folder",
                          self.examine_file())

    def test_a_disk_that_is_too_small(self):
        self.configure(SOUND + "snapshot_mib = 1048576\n")
        self.assert_found("fault", "journal", "free, but the log may take 1024", "Free space",
                          self.examine_file())

    def test_no_journal(self):
        self.configure(SOUND.replace(JOURNAL, ""))
        self.assert_found("warning", "journal", "lost at each stop", r"Name a folder in \[journal\]",
                          self.examine_file())

    def test_a_clock_that_was_set_back(self):
        (self.folder / "journal").mkdir()
        written = self.folder / "journal" / "log"
        written.write_bytes(b"")
        later = time.time() + 7200
        os.utime(written, (later, later))
        self.assert_found("fault", "clock", r"written 2\.0 h after the present time", "timedatectl",
                          self.examine_file())

    def test_no_token(self):
        self.configure(SOUND.replace('token_file = "token"\n', ""))
        self.assert_found("warning", "token", "there is none", "token_file = ", self.examine_file())

    def test_the_default_configuration_names_a_token_to_be_made(self):
        self.assertIn(("ok", "web-token", "there is none yet: the server makes it when it starts"),
                      [(it["level"], it["looked_at"], it["found"]) for it in self.examine()
                       if it["subject"] == "token"])

    def test_a_token_that_everybody_reads(self):
        (self.folder / "token").chmod(0o644)
        self.assert_found("warning", "token", "mode 0644: each user", "chmod o= ",
                          self.examine_file())

    def test_a_web_port_that_another_program_has(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            self.configure(SOUND.replace("127.0.0.1:0", f"127.0.0.1:{port}"))
            self.assert_found("fault", "ports",
                              rf"web, TCP 127\.0\.0\.1:{port}: in use by .*\(process {os.getpid()}, ",
                              r"another port with listen in \[web\]", self.examine_file())

    def test_a_trackers_port_that_another_program_has(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            port = taken.getsockname()[1]
            self.configure(SOUND + table("[tracker]", name="ceiling", listen=f"127.0.0.1:{port}"))
            self.assert_found("fault", "ports", rf"UDP .*:{port}: in use by .*{os.getpid()}",
                              r"\[\[tracker\]\]", self.examine_file())

    def test_an_address_of_another_machine(self):
        self.configure(SOUND.replace("127.0.0.1:0", "192.0.2.1:8377"))  # of documentation, RFC 5737
        self.assert_found("fault", "ports", "no network interface", "ip address",
                          self.examine_file())

    def test_a_serial_port_that_is_not_plugged_in(self):
        self.configure(SOUND + serial("/dev/ttyUSB-none"))
        self.assert_found("fault", "serial", "/dev/ttyUSB-none: No such file", "Plug the adapter in",
                          self.examine_file())

    def test_a_serial_port_that_is_not_permitted(self):
        device = self.device()
        self.configure(SOUND + serial(device))
        (self.folder / "token").chmod(0o644)
        privileges = self.unprivileged(device)
        self.folder.chmod(0o777)
        self.assert_found("fault", "serial", f"{device}: not permitted for the user ",
                          "dialout|adduser", self.examine_file(**privileges))

    def test_a_serial_port_that_another_program_has(self):
        device = self.device()
        holder = self.held(device)
        self.configure(SOUND + serial(device))
        self.assert_found("fault", "serial", rf"{device}: in use by sleep \(process {holder.pid}, ",
                          "Stop that program", self.examine_file())

    def test_the_text_has_each_mend(self):
        self.configure(SOUND.replace(JOURNAL, "") + serial("/dev/ttyUSB-none"))
        result = subprocess.run([BIN / "pheromonectl", "doctor", "--config", "test.toml"],
                                cwd=self.folder, text=True, capture_output=True, check=False)
        self.assertEqual((result.returncode, result.stderr), (1, ""))
        self.assertRegex(result.stdout, r"(?m)^fault +serial +link modem, /dev/ttyUSB-none: No such ")
        self.assertRegex(result.stdout, r"(?m)^ +Plug the adapter in, ")
        self.assertRegex(result.stdout, r"(?m)^1 fault, [23] warnings$")


class WithServerTest(Laboratory):
    def robot(self, identifier):
        line = open_terminal(self.folder / "radio-a.pty")
        self.addCleanup(line.close)
        client = Client(line, identifier, timeout=PATIENCE_S, tries=1)
        client.hello(nonce=1)
        return client

    def track(self, daemon, *lines):
        """Reports to the tracker, and waits until they were dealt with."""
        def view():
            return json.loads(daemon.call("GET", "/api/v1/trackers")[1])["trackers"][0]
        host, port = view()["address"].split(":")
        before = view()["datagrams"]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto("\n".join(lines).encode(), (host, int(port)))
        await_that(lambda: view()["datagrams"] == before + 1, "the poses arrive")

    def test_a_server_with_a_robot_is_well(self):
        daemon = self.serve(SOUND)
        robot = self.robot(7)
        for _ in range(5):  # again, if it took so long that the robot counts as silent
            robot.sense(1, 1500, 500, 0)
            findings = self.examine()
            found = {it["subject"]: it["looked_at"] + ": " + it["found"] for it in findings}
            if "1 robot heard" in found["channels"]:
                break
        self.assertEqual([it for it in findings if it["level"] == "fault"], [])
        self.assertIn(f"pheromoned (process {daemon.process.pid}, ", str(findings))
        self.assertRegex(found["configuration"], r"/test\.toml: map: 4 m x 3 m")
        self.assertRegex(found["links"], "link radio-a, pty: up, [2-7] frames received")
        self.assertRegex(found["channels"], "1 robot heard")

    def test_nothing_is_received_and_no_robot_is_heard(self):
        self.serve(SOUND)
        findings = self.examine()
        self.assert_found("warning", "links", "radio-a.*nothing was received", "Start a robot there",
                          findings)
        self.assert_found("warning", "robots", "none was heard", "Switch one on", findings)

    def test_a_socket_that_is_not_permitted(self):
        self.serve(SOUND)
        privileges = self.unprivileged(self.folder / "pheromoned.sock")
        (self.folder / "token").chmod(0o644)
        findings = self.examine(**privileges)
        self.assert_found("fault", "server", "not permitted for the user ", "adduser .* pheromone",
                          [it for it in findings if it["subject"] == "server"])

    def test_another_server_that_has_the_journal(self):
        daemon = self.serve(SOUND)
        self.assert_found("fault", "journal",
                          rf"in use by pheromoned \(process {daemon.process.pid}, ",
                          "Stop that server", self.examine_file("--socket", "other.sock"))

    def test_a_configuration_that_the_server_has_not_read(self):
        self.serve(SOUND)
        self.configure(SOUND.replace("sigma_m = 0.3", "sigma_m = 0.25"))
        self.assert_found("warning", "configuration", "not what the server has read: .*0.35 m",
                          "pheromonectl reload", self.examine())

    def test_a_robot_without_hello(self):
        self.serve(SOUND)
        with contextlib.closing(open_terminal(self.folder / "radio-a.pty")) as line:
            for _ in range(5):  # again, if it took so long that the robot counts as silent
                line.send(wire.encode(bytes([9, 0x72, 1])))  # PING
                self.assertIsNotNone(line.receive(time.monotonic() + PATIENCE_S))
                findings = self.examine()
                if "has not said HELLO" in str(findings):
                    break
        self.assert_found("warning", "robots", "robot 9 on radio-a: refused: it has not said HELLO",
                          "Restart the robot", findings)

    def test_a_robot_that_says_nothing_but_hello(self):
        self.serve(SOUND)
        with contextlib.closing(open_terminal(self.folder / "radio-a.pty")) as line:
            for _ in range(5):  # as above
                for _ in range(3):
                    line.send(wire.encode(bytes([9, 0x71, 1, 1, 0, 0])))  # HELLO, one nonce
                    self.assertIsNotNone(line.receive(time.monotonic() + PATIENCE_S))
                findings = self.examine()
                if "silent" not in str(findings):
                    break
        self.assert_found("warning", "robots", "robot 9 on radio-a: only HELLO: again and again",
                          "Look at the robot's light or log", findings)

    def test_bytes_that_are_no_frames(self):
        daemon = self.serve(SOUND)
        with open(self.folder / "radio-a.pty", "wb", buffering=0) as line:
            tty.setraw(line.fileno())
            line.write(b"U" * 64)

        def received():
            view = json.loads(daemon.call("GET", "/api/v1/links")[1])["links"][0]
            return view["counters"]["received_bytes"] == 64
        await_that(received, "the bytes are received")
        self.assert_found("fault", "links", "64 bytes received, but no frame", "same baud",
                          self.examine())

    def test_a_robot_with_another_baud_rate_beside_one_that_is_heard(self):
        daemon = self.serve(SOUND)

        def frames():
            view = json.loads(daemon.call("GET", "/api/v1/links")[1])["links"][0]
            return view["counters"]["received_frames"]
        robot = self.robot(7)
        for _ in range(30):
            robot.line.send(b"\xe0\x9c\x1c")
            robot.ping()
        self.assertGreater(frames(), 20)
        self.assert_found("warning", "links", r"radio-a.*: \d+ of \d+ bytes were outside of frames: a robot "
                          "with another baud rate", "same baud", self.examine())

    def test_poses_on_a_link_that_is_not_there(self):
        daemon = self.serve(TRACKED)
        self.track(daemon, "pose radio-b 7 1 1 0")
        self.assert_found("fault", "trackers",
                          r"0 poses accepted, 1 lines refused: unknown link \(1\); the last one: "
                          r'unknown link: "pose radio-b 7 1 1 0"', "LINK", self.examine())

    def test_poses_of_a_robot_that_has_not_said_hello(self):
        daemon = self.serve(TRACKED)
        self.robot(7)
        self.track(daemon, "pose radio-a 7 1 1 0", "pose radio-a 8 1 1 0")
        self.assert_found("warning", "trackers",
                          r"1 poses accepted, 1 lines refused: the robot has not said HELLO",
                          "has said HELLO", self.examine())

    def test_a_tracker_that_reports_nothing(self):
        self.serve(TRACKED)
        self.assert_found("warning", "trackers", "nothing was received at 127", "by UDP",
                          self.examine())

    def test_two_programs_on_one_terminal(self):
        self.serve(SOUND)
        self.held(self.folder / "radio-a.pty")
        self.held(self.folder / "radio-a.pty")
        self.assert_found("fault", "links", r"opened by sleep .* and by sleep ", "Stop one of them",
                          self.examine())


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
