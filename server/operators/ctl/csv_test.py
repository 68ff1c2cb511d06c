#!/usr/bin/env python3
"""What robots and operators did, as tables: from a recording, and from the running server.

    csv_test.py BIN_DIR
"""

import csv
import datetime
import http.server
import json
import pathlib
import re
import socketserver
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "proto_tests"))
from operated_daemon import OperatedDaemon, await_that, write_config  # noqa: E402
from stranger.client import Client, ErrorAnswer, open_terminal  # noqa: E402
from test_config import map_of, pheromone, pty, table  # noqa: E402

BIN = pathlib.Path()
PATIENCE_S = 60
CONFIG = (map_of(4.0, 3.0, bias_m=0.2) + pheromone(1, "trail", sigma_m=0.3, maximum=2.0)
          + pheromone(2, "path", sigma_m=0.3) + pty("radio-a")
          + table("[frame]", link="radio-a", id=8, x_m=1.0, y_m=1.0, heading_deg=90)
          + table("capture", folder="captures"))


class Tables(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        write_config(self.folder, CONFIG)
        self.daemon = OperatedDaemon(BIN, self.folder)
        self.addCleanup(self.daemon.kill)

    def ctl(self, *arguments, status=0):
        result = subprocess.run([BIN / "pheromonectl", *map(str, arguments)], cwd=self.folder,
                                text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.returncode, status, result)
        return result.stdout if status == 0 else result.stderr

    def rows(self, name):
        with open(self.folder / "out" / (name + ".csv"), encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def act(self):
        """Two robots and an operator; returns what robot 7 was answered last."""
        line = open_terminal(self.folder / "radio-a.pty")
        self.addCleanup(line.close)
        seven, eight = (Client(line, number, timeout=PATIENCE_S, tries=1) for number in (7, 8))
        seven.hello(nonce=1)
        eight.hello(nonce=2)
        seven.deposit(1, 1500, 500, 3)
        eight.deposit(1, 500, 0)  # ahead, in its own frame
        with self.assertRaises(ErrorAnswer):
            seven.deposit(1, -500, 0)  # off the map
        seven.event(9, 105)
        self.ctl("paint", "path", 1, 1, 3, 1, "--radius", 0.01, "--units", 0.5)
        return seven.sense(2, 2000, 1000, 0)

    def state(self):
        clients = json.loads(self.ctl("clients", "--json"))["clients"]
        state = next(it["state"] for it in clients if it["id"] == 7)
        return state["is"], state["reason"] or ""

    def check_tables(self, sensed, states):
        deposits = self.rows("deposits")
        self.assertEqual(
            [(it["by"], it["link"], it["robot"], it["action"], it["pheromone"], float(it["x_m"]),
              float(it["y_m"]), float(it["units"])) for it in deposits],
            [("robot", "radio-a", "7", "deposit", "trail", 1.5, 0.5, 0.375),
             ("robot", "radio-a", "8", "deposit", "trail", 1.0, 1.5, 0.125),  # that off the map: none
             ("operator", "", "", "set", "path", 1.0, 1.0, 0.5)])
        self.assertEqual(deposits[2]["shape"], "stroke")
        self.assertEqual(deposits[2]["radius_m"], "0.01")

        robots = self.rows("robots")
        last = [it for it in robots if it["robot"] == "7"][-1]
        self.assertEqual((last["x_m"], last["y_m"], last["heading_deg"], last["pose_source"],
                          last["pheromone"]), ("2", "1", "0.00", "robot", "path"))
        self.assertEqual([round(float(last[it]) * 4096) for it in ("left_units", "right_units")],
                         list(sensed))
        self.assertIn((last["state"], last["reason"]), states)
        times = [float(it["time_s"]) for it in robots if it["robot"] == "7"]
        self.assertEqual(times, sorted(times))
        steps = {round(after - before, 3) for before, after in zip(times[:-2], times[1:-1])}
        self.assertLessEqual(steps, {0.05})
        said = datetime.datetime.fromisoformat(last["utc"].replace("Z", "+00:00")).timestamp()
        self.assertLess(abs(said - time.time()), PATIENCE_S)

        events = [(it["by"], it["robot"], it["event"], it["value"]) for it in self.rows("events")]
        self.assertEqual(events, [("robot", "7", "hello", "1"), ("robot", "8", "hello", "2"),
                                  ("robot", "7", "battery low", "105")])


class RecordingTest(Tables):
    def test_a_recording_becomes_three_tables(self):
        self.ctl("capture", "start")
        sensed = self.act()
        states = [self.state()]
        self.ctl("capture", "stop")
        states.append(self.state())  # silent, if the machine was slow meanwhile
        self.daemon.stop()
        files = sorted((self.folder / "captures").iterdir())
        told = self.ctl("export", "--csv", "out", "--rate", 20, *files)
        self.assertRegex(told, r"out/robots\.csv: \d+ rows\nout/deposits\.csv: 3 rows\n")
        self.check_tables(sensed, states)

    def test_a_table_that_cannot_be_written_is_an_error(self):
        self.ctl("capture", "start")
        self.ctl("capture", "stop")
        (self.folder / "out").write_text("")
        words = self.ctl("export", "--csv", "out", *(self.folder / "captures").iterdir(), status=1)
        self.assertIn("out/robots.csv.new0: cannot be created: Not a directory", words)

    def test_tables_stay_if_there_is_nothing_to_export(self):
        tables = [self.folder / "out" / name for name in ("robots.csv", "deposits.csv", "events.csv")]
        (self.folder / "out").mkdir()
        for table in tables:
            table.write_text("earlier")
        (self.folder / "empty").touch()
        for name in ("nope.pcapng", "empty"):
            self.assertIn(name, self.ctl("export", "--csv", "out", name, status=1))
        self.assertEqual({it.read_text() for it in tables}, {"earlier"})
        self.assertEqual(sorted((self.folder / "out").iterdir()), sorted(tables))

    def test_what_it_needs_is_told(self):
        self.assertIn("expected recordings or --live", self.ctl("export", "--csv", "out", status=2))
        self.assertIn("expected either --csv FOLDER or --mcap FILE",
                      self.ctl("export", "--live", status=2))
        self.assertIn("--rate requires --csv",
                      self.ctl("export", "--mcap", "x", "--rate", 5, "--live", status=2))
        self.ctl("capture", "start")
        self.assertIn("recording", self.ctl("export", "--csv", "out", "--live", status=1))


class LiveTest(Tables):
    def test_the_running_server_becomes_the_same_tables(self):
        exporter = subprocess.Popen([BIN / "pheromonectl", "export", "--csv", "out", "--rate", "20",
                                     "--live"], cwd=self.folder, text=True,
                                    stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(exporter.kill)
        await_that(lambda: json.loads(self.ctl("capture", "status", "--json"))["recording"],
                   "the recording begins")
        sensed = self.act()
        states = [self.state()]
        exporter.terminate()
        told, words = exporter.communicate(timeout=PATIENCE_S)
        self.assertEqual(exporter.returncode, 0, words)
        states.append(self.state())
        self.assertRegex(words, r"^recording into .*captures/.*; Ctrl-C ends it\n$")
        self.assertIn("out/deposits.csv: 3 rows\n", told)
        self.check_tables(sensed, states)
        self.assertFalse(json.loads(self.ctl("capture", "status", "--json"))["recording"])

    def test_a_file_that_the_server_has_removed_meanwhile_is_told(self):
        exporter = subprocess.Popen([BIN / "pheromonectl", "export", "--csv", "out", "--live"],
                                    cwd=self.folder, text=True, stderr=subprocess.PIPE)
        self.addCleanup(exporter.kill)
        self.addCleanup(exporter.stderr.close)
        recording = re.fullmatch("recording into (.*); Ctrl-C ends it\n", exporter.stderr.readline())
        (self.folder / recording[1]).unlink()
        exporter.terminate()
        words = exporter.stderr.read()
        self.assertEqual(exporter.wait(PATIENCE_S), 1)
        self.assertRegex(words, "recorded, but no longer there: the server keeps max_files of ")


class NamelessServer(http.server.BaseHTTPRequestHandler):
    """Records, but says nothing about where."""

    def do_POST(self):
        body = b'{"recording": true}'
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):  # not to the test's output
        pass

    def address_string(self):  # of a Unix socket there is none
        return ""


class OtherServerTest(unittest.TestCase):
    def test_a_server_that_does_not_name_its_file_is_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "other.sock"
            with socketserver.UnixStreamServer(str(path), NamelessServer) as server:
                exporter = subprocess.Popen(
                    [BIN / "pheromonectl", "export", "--csv", "out", "--live", "--socket", path],
                    cwd=folder, text=True, stderr=subprocess.PIPE)
                self.addCleanup(exporter.kill)
                server.handle_request()
                words = exporter.communicate(timeout=PATIENCE_S)[1]
        self.assertEqual(exporter.returncode, 1)
        self.assertIn("does not name its file", words)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
