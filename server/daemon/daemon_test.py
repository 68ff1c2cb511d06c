#!/usr/bin/env python3
"""The pheromoned program from outside: command line, exit status, signals, links that fail.

    daemon_test.py --pheromoned build/release/bin/pheromoned
                   --shim build/release/tests/libpty_as_serial_shim.so
                   --sick-disk build/release/tests/libsick_disk_shim.so
"""

import os
import re
import select
import signal
import socket
import subprocess
import time
import tty
import urllib.request

import running_daemon
from running_daemon import CONFIG, DaemonTest, ECHO, PATIENCE_S, PING, PTY, ask, frame


def read_log(log, until=None):
    """Up to this text, or to its end."""
    found = b""
    while until is None or until not in found:
        if not select.select([log], [], [], PATIENCE_S)[0]:
            raise AssertionError(f"nothing more for {PATIENCE_S} s after {found[-200:]!r}")
        more = log.read(4096)
        if not more:
            if until is not None:
                raise AssertionError(f"the log ended: {found[-200:]!r}")
            break
        found += more
    return found


class ProgramTest(DaemonTest):
    def test_check_accepts_a_good_file(self):
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        lines = result.stdout.splitlines()
        self.assertEqual(lines[0], "test.toml: ok")
        self.assertIn("loses one quantum every 30 s", lines[2])

    def test_check_refuses_a_bad_file_with_every_mistake(self):
        self.config.write_text(CONFIG.replace("cell_m = 0.1", "cel_m = 0.1")
                               .replace("sigma_m = 0.4", 'sigma_m = "wide"') + PTY)
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual(result.returncode, 2)
        self.assertEqual(result.stdout, "")
        self.assertIn("test.toml:4:1: map.cel_m: unknown key, expected cell_m?\n", result.stderr)
        self.assertIn("test.toml:11:11: pheromone[1].sigma_m: found the string \"wide\", expected "
                      "a number", result.stderr)

    def test_check_refuses_a_journal_whose_folder_cannot_be_made_by_anybody(self):
        self.config.write_text(CONFIG + PTY + '[journal]\nfolder = "none/state"\n')
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual((result.returncode, result.stdout), (2, ""))
        self.assertEqual(result.stderr, f"test.toml: journal.folder: {self.folder}/none: No such "
                         "file or directory, expected a writable folder\n")

    def write_cluster(self, more=""):
        (self.folder / "secret").write_text("0123456789abcdef" * 4)
        (self.folder / "secret").chmod(0o600)
        self.config.write_text(
            CONFIG + PTY + '[cluster]\nname = "lab"\nengine = ["http://127.0.0.1:2379"]\n'
            'nodes = {a1 = "127.0.0.1:8390", b1 = "127.0.0.1:8391"}\n'
            'secret_file = "secret"\n' + more)

    def test_a_node_of_a_cluster_is_named_by_the_command_line(self):
        result = self.call("--check", "--config", "test.toml", "--node", "a1")
        self.assertEqual((result.returncode, result.stderr),
                         (2, "--node is given, expected a configuration with [cluster]\n"))
        self.write_cluster('[journal]\nfolder = "state"\n')
        result = self.call("--check", "--config", "test.toml", "--node", "b1")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn("  cluster lab: node b1 of a1 (127.0.0.1:8390), b1 (127.0.0.1:8391); ",
                      result.stdout)
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual((result.returncode, result.stdout), (2, ""))
        self.assertIn('cluster.node: missing, expected one of "a1", "b1", or the option --node: '
                      f'none is named as this machine, "{socket.gethostname()}"', result.stderr)

    def test_a_cluster_does_not_start_without_a_journal(self):
        self.write_cluster()
        with self.start("--config", "test.toml", "--node", "a1") as server:
            self.assertEqual(server.end(), 2)
            self.assertIn("a cluster needs a journal, expected [journal] with a folder", server.log)

    def test_check_says_whether_the_folders_can_be_used_and_leaves_them_alone(self):
        self.config.write_text(CONFIG + PTY + '[journal]\nfolder = "state"\n')
        result = self.call("--check", "--config", "test.toml")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn(f"  journal: {self.folder}/state, to be created\n"
                      f"  recordings: {self.folder}/captures, to be created\n",
                      result.stdout)
        self.assertEqual(os.listdir(self.folder), ["test.toml"])
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            result = self.call("--check", "--config", "test.toml")  # beside the one that owns it
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertIn(f"  journal: {self.folder}/state\n", result.stdout)
            self.assertEqual(server.stop(), 0)
        # Root may write everywhere, so another user asks.
        (self.folder / "state" / "lock").chmod(0o600)
        self.folder.chmod(0o555)
        (self.folder / "state").chmod(0o777)
        other = {"user": 65534} if os.geteuid() == 0 else {}
        result = subprocess.run([running_daemon.PHEROMONED, "--check", "--config", "test.toml"],
                                cwd=self.folder, text=True, capture_output=True, check=False,
                                **other)
        self.folder.chmod(0o755)
        warnings = result.stderr.splitlines()
        self.assertEqual(result.returncode, 0)
        self.assertIn(f"warning: capture.folder: {self.folder}: Permission denied, expected a "
                      "writable folder", warnings)
        self.assertEqual(bool(other), f"warning: journal.folder: {self.folder}/state/lock: "
                         "Permission denied, "
                         "expected a file owned by the server's user" in warnings)

    def test_a_bad_file_ends_the_start_with_the_same_words(self):
        self.config.write_text("[map\n")
        checked = self.call("--check", "--config", "test.toml")
        started = self.call("--config", "test.toml")
        self.assertEqual((started.returncode, started.stderr), (2, checked.stderr))
        self.assertTrue(started.stderr.startswith("test.toml:1:"))

    def test_a_file_that_is_not_there(self):
        result = self.call("--config", "none.toml")
        self.assertEqual((result.returncode, result.stderr),
                         (2, "none.toml: cannot be opened: No such file or directory\n"))

    def test_the_default_configuration_can_be_copied(self):
        printed = self.call("--default-config")
        self.assertEqual(printed.returncode, 0)
        self.config.write_text(printed.stdout)
        self.assertEqual(self.call("--check", "--config", "test.toml").returncode, 0)
        result = self.call("--check")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertNotIn("note: ", result.stdout)  # or notes are not read any more

    def test_command_line_mistakes_and_help(self):
        for arguments in (["--confg", "x"], ["--log-level", "loud"], ["stray"], ["--config"],
                          ["--config", ""], ["--config="], ["--check", "--config", ""]):
            self.assertEqual(self.call(*arguments).returncode, 2, arguments)
        self.assertIn("--config", self.call("--help").stdout)
        self.assertRegex(self.call("--version").stdout, r"^pheromoned \d+\.\d+\.\d+\n$")

    def test_the_default_serves_a_pty_and_sigterm_ends_it_cleanly(self):
        with self.start() as server:
            server.await_log("ready: 1 of 1 links up")
            port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
            self.assertEqual(ask(port, PING, len(ECHO)), ECHO)
            self.assertEqual(server.stop(), 0)
            os.close(port)
            self.assertFalse(os.path.lexists(self.folder / "radio-a.pty"))
            self.assertIn("requests 1, answers 1", server.log)
            self.assertIn("state hash", server.log)
            self.assertTrue(server.log.endswith("stopped\n"))

    def test_sigint_ends_it_cleanly_too(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            self.assertEqual(server.stop(signal.SIGINT), 0)

    def test_two_stop_signals_close_together_are_one(self):
        for pause_s in (0, 0, 0.0005, 0.001, 0.002, 0.003, 0.005, 0.01, 0.02):
            with self.start("--config", "test.toml") as server:
                server.await_log("ready")
                server.process.send_signal(signal.SIGTERM)
                time.sleep(pause_s)
                self.assertEqual(server.stop(), 0, pause_s)
                self.assertIn("state hash", server.log)
                self.assertTrue(server.log.endswith("stopped\n"), server.log)
                self.assertFalse(os.path.lexists(self.folder / "radio-a.pty"))

    def test_a_later_stop_signal_ends_a_stop_that_is_stuck(self):
        (self.folder / "state").mkdir()
        self.config.write_text(CONFIG + PTY + '[journal]\nfolder = "state"\n')
        with self.start("--config", "test.toml", LD_PRELOAD=running_daemon.SICK_DISK,
                        SICK_DISK=str(self.folder)) as server:
            server.await_log("ready")
            (self.folder / "stuck").touch()
            deadline = time.monotonic() + PATIENCE_S
            while server.process.poll() is None and time.monotonic() < deadline:
                server.process.send_signal(signal.SIGTERM)
                time.sleep(1.1)
            server.process.kill()
            self.assertEqual(server.process.wait(), 128 + signal.SIGTERM)

    def start_with_a_full_log(self):
        """The process, whose log nobody reads, and where it would be read."""
        reading, writing = os.pipe()
        process = subprocess.Popen([running_daemon.PHEROMONED, "--config", "test.toml"],
                                   cwd=self.folder, stderr=writing)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        reader = open(reading, "rb", buffering=0)
        self.addCleanup(reader.close)
        read_log(reader, b"ready")
        os.set_blocking(writing, False)
        with self.assertRaises(BlockingIOError):
            while True:
                os.write(writing, b"x")
        os.set_blocking(writing, True)
        os.close(writing)
        return process, reader

    def test_a_log_that_nobody_reads_holds_up_neither_robots_nor_the_stop(self):
        process, _ = self.start_with_a_full_log()
        port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
        for nonce in (1, 2, 1):  # two robots under one ID, of which the log tells
            os.write(port, frame(3, 0x71, bytes([nonce, 0, 1, 0])))
        os.write(port, PING)
        answers = b""
        while ECHO not in answers:
            self.assertTrue(select.select([port], [], [], PATIENCE_S)[0], answers)
            answers += os.read(port, 64)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(PATIENCE_S), 0)
        os.close(port)

    def test_a_log_that_was_not_read_for_a_while_tells_how_much_is_missing(self):
        process, reader = self.start_with_a_full_log()
        for _ in range(400):  # more than three lines each
            with socket.socket(socket.AF_UNIX) as control:
                control.connect(str(self.folder / "pheromoned.sock"))
                control.sendall(b"POST /api/v1/reload HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n"
                                b"Connection: close\r\n\r\n")
                self.assertIn(b" 200 OK\r\n", control.recv(4096))
        missing = b"lines of the log are missing here"
        self.assertIn(missing, read_log(reader, missing))
        process.send_signal(signal.SIGTERM)
        log = read_log(reader)
        self.assertEqual(process.wait(PATIENCE_S), 0)
        self.assertTrue(log.endswith(b"stopped\n"), log[-200:])

    def test_two_robots_under_one_id_are_warned_of_and_in_the_summary(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
            for nonce in (1, 2, 1):
                os.write(port, frame(3, 0x71, bytes([nonce, 0, 1, 0])))
            trouble = "ID conflicts (two robots under one ID) 1\n"
            server.await_log("so far: " + trouble)
            self.assertEqual(server.stop(), 0)
            self.assertEqual(server.log.count("so far"), 1)
            self.assertEqual(server.log.count(trouble), 2)
            os.close(port)

    def test_a_stop_with_clients_connected_and_talking(self):
        self.config.write_text(CONFIG + '[[link]]\nname = "t"\nkind = "tcp"\n'
                               'listen = "127.0.0.1:0"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            address = server.log.split("up, tcp ")[1].split()[0].split(":")
            clients = [socket.create_connection((address[0], int(address[1]))) for _ in range(5)]
            for client in clients:
                self.assertEqual(ask(client.fileno(), PING, len(ECHO)), ECHO)
                client.sendall(PING * 100 + PING[:5])
            self.assertEqual(server.stop(), 0)
            for client in clients:
                client.close()

    def test_a_port_that_does_not_exist_does_not_stop_the_others(self):
        self.config.write_text(CONFIG + PTY + '[[link]]\nname = "radio-b"\nkind = "serial"\n'
                               'port = "/dev/ttyNONE7"\n')
        with self.start("--config", "test.toml") as server:
            server.await_log("ready: 1 of 2 links up")
            self.assertIn("link radio-b: down, /dev/ttyNONE7: No such file or directory; "
                          "retrying", server.log)
            port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
            self.assertEqual(ask(port, PING, len(ECHO)), ECHO)
            os.close(port)
            self.assertEqual(server.stop(), 0)

    def test_a_serial_port_serves_and_survives_being_unplugged(self):
        if not running_daemon.SHIM:
            self.skipTest("no --shim to let libserialport open a pseudo-terminal")
        self.config.write_text(CONFIG + '[[link]]\nname = "radio-b"\nkind = "serial"\n'
                               'port = "./modem"\nresponse_window_ms = 255\n')

        def plug_in():
            master, slave = os.openpty()
            tty.setraw(slave)
            os.symlink(os.ttyname(slave), self.folder / "modem")
            os.close(slave)
            return master

        # The sanitizers want to be loaded first, and say so unless told not to.
        options = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
        master = plug_in()
        with self.start("--config", "test.toml", LD_PRELOAD=running_daemon.SHIM,
                        ASAN_OPTIONS=options) as server:
            server.await_log("ready: 1 of 1 links up")
            self.assertEqual(ask(master, PING, len(ECHO)), ECHO)
            os.unlink(self.folder / "modem")
            os.close(master)
            server.await_log("the other side hung up; retrying")
            master = plug_in()
            server.await_log("link radio-b: up, serial ./modem at 9600 baud", 2)
            self.assertEqual(ask(master, PING, len(ECHO)), ECHO)
            self.assertEqual(server.stop(), 0)
            self.assertIn("opened 2 times", server.log)
        os.close(master)

    def test_a_required_port_that_does_not_exist_ends_the_start(self):
        self.config.write_text(CONFIG + PTY + '[[link]]\nname = "radio-b"\nkind = "serial"\n'
                               'port = "/dev/ttyNONE7"\nrequired = true\n')
        with self.start("--config", "test.toml") as server:
            self.assertEqual(server.end(), 1)
            self.assertIn("link radio-b is required but could not be opened: /dev/ttyNONE7: No "
                          "such "
                          "file or directory", server.log)
        self.assertFalse(os.path.lexists(self.folder / "radio-a.pty"))

    def test_sighup_reads_the_configuration_again(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            self.config.write_text(CONFIG.replace("tau_s = 30.0", "tau_s = 5") + PTY)
            server.process.send_signal(signal.SIGHUP)
            server.await_log("configuration reread")
            self.assertIn("loses one quantum every 5 s", server.log)
            self.assertNotIn("require a restart", server.log)

            self.config.write_text(CONFIG + PTY.replace("radio-a.pty", "other.pty")
                                   + "[daemon]\nio_threads = 3\n")
            server.process.send_signal(signal.SIGHUP)
            server.await_log("configuration reread", 2)
            self.assertIn("changed links require a restart", server.log)
            self.assertIn("changed [daemon], [control] or [web] settings require a restart",
                          server.log)
            self.assertEqual(server.stop(), 0)

    def test_a_cluster_requires_a_restart(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            self.write_cluster('node = "a1"\n')
            server.process.send_signal(signal.SIGHUP)
            server.await_log("changed [cluster] settings require a restart")
            self.assertEqual(server.stop(), 0)

    def test_sighup_with_a_bad_file_changes_nothing(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            self.config.write_text(CONFIG.replace("tau_s = 30.0", "tau_s = -1") + PTY)
            server.process.send_signal(signal.SIGHUP)
            server.await_log("test.toml:12:9: pheromone[1].tau_s")
            self.config.write_text(CONFIG.replace("cell_m = 0.1", "cell_m = 0.2") + PTY)
            server.process.send_signal(signal.SIGHUP)
            server.await_log("the configuration is unchanged", 2)
            port = os.open(self.folder / "radio-a.pty", os.O_RDWR | os.O_NOCTTY)
            self.assertEqual(ask(port, PING, len(ECHO)), ECHO)
            os.close(port)
            self.assertEqual(server.stop(), 0)

    def test_the_dashboard_of_a_folder_is_served_instead_of_the_built_in_one(self):
        (self.folder / "page").mkdir()
        (self.folder / "page/index.html").write_text("mine")
        self.config.write_text(CONFIG + PTY + '[web]\nlisten = "127.0.0.1:0"\n')
        with self.start("--config", "test.toml", "--web-root", "page") as server:
            server.await_log("web: http")
            address = re.search(r"web: (http://[^/]+/)", server.log)[1]
            with urllib.request.urlopen(address, timeout=PATIENCE_S) as page:
                self.assertEqual(page.read(), b"mine")
            self.assertEqual(server.stop(), 0)

    def test_the_journal_gets_no_time_of_ours(self):
        with self.start("--config", "test.toml", JOURNAL_STREAM="8:1") as server:
            server.await_log("ready")
            self.assertTrue(server.log.startswith("info: pheromoned "), server.log)
            self.assertEqual(server.stop(), 0)

    def test_a_control_socket_that_somebody_removes_comes_back(self):
        with self.start("--config", "test.toml") as server:
            server.await_log("ready")
            path = self.folder / "pheromoned.sock"
            path.unlink()
            server.await_log("control: pheromoned.sock: lost, nobody can connect; trying to "
                             "listen again\n")
            server.await_log("control: pheromoned.sock: listening again\n")
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control:
                control.connect(str(path))
                control.sendall(b"GET /healthz HTTP/1.0\r\nHost: localhost\r\n\r\n")
                self.assertEqual(control.recv(64).split()[1], b"200")
            self.assertEqual(server.stop(), 0)
            self.assertFalse(path.exists())

    def test_log_level_silences(self):
        with self.start("--config", "test.toml", "--log-level", "warn") as server:
            deadline = time.monotonic() + PATIENCE_S
            while not os.path.lexists(self.folder / "radio-a.pty"):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.01)
            self.assertEqual(server.stop(), 0)
            self.assertEqual(server.log, "")


if __name__ == "__main__":
    running_daemon.main(__doc__)
