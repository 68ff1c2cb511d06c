#!/usr/bin/env python3
"""pheromonectl tags: notes on the floor, written and read by operators and robots, which survive a
crash of the server.

    tags_test.py BIN_DIR
"""

import json
import pathlib
import socket
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[4]
sys.path[:0] = [str(ROOT / "server/daemon"), str(ROOT / "proto_tests")]
import running_daemon  # noqa: E402
from stranger import wire  # noqa: E402
from stranger.client import Client, ErrorAnswer, open_terminal  # noqa: E402

BIN = pathlib.Path()
ROBOT, INT = -17, -3  # namespaces: a robot's number, a number
EXPECT = 2  # a flag of WRITE
TAGS = """[[tag]]
name = "door"
x_m = 1.5
y_m = 2
[[tag]]
name = "plant-7"
x_m = 6
y_m = 2
range_m = 0.5
slots = 2
[journal]
folder = "state"
"""


def statement(robot, predicate, number):
    """Subject robot, predicate of the robot's strings 1 and `predicate`, a whole number."""
    return dict(subject_namespace=ROBOT, subject=robot, predicate_namespace=1, predicate=predicate,
                object_namespace=INT, object=number)


class TagsTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)
        (self.folder / "test.toml").write_text(running_daemon.CONFIG + running_daemon.PTY + TAGS)
        self.start()

    def start(self):
        self.server = running_daemon.Running(self.folder, "--config", "test.toml")
        self.addCleanup(self.server.__exit__)
        self.server.await_log("ready")

    def crash(self):
        self.server.process.kill()
        self.server.process.wait()
        self.start()

    def robot(self, client_id, unique_id, nonce=1, line=None):
        robot = Client(line or open_terminal(self.folder / "radio-a.pty"), client_id, timeout=30)
        self.addCleanup(robot.line.close)
        robot.hello(nonce)
        return robot, robot.register(unique_id)

    def ctl(self, *arguments, status=0):
        result = subprocess.run([BIN / "pheromonectl", "tags", *arguments], cwd=self.folder,
                                text=True, capture_output=True, check=False, timeout=60)
        if status is not None:
            self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return result.stderr if status else result.stdout

    def metrics(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control:
            control.connect(str(self.folder / "pheromoned.sock"))
            control.sendall(b"GET /metrics HTTP/1.0\r\nHost: localhost\r\n\r\n")
            return b"".join(iter(lambda: control.recv(65536), b"")).decode().splitlines()

    def sentences(self, tag):
        shown = json.loads(self.ctl("show", tag, "--json"))
        return [f'{it["subject"]} {it["predicate"]} {it["object"]}' for it in shown["blocks"]]

    def test_a_robot_reads_what_an_operator_wrote(self):
        self.ctl("write", "door", "15 lookingfortag 244")
        robot, _ = self.robot(7, "00:11:22:33:44:55")
        self.assertEqual([row[0] for row in robot.scan(1500, 2000)], [1])
        [block] = robot.read(1500, 2000, 1)
        self.assertEqual((block["subject_namespace"], block["subject"]), (ROBOT, 15))
        self.assertEqual((block["object_namespace"], block["object"]), (INT, 244))
        self.assertEqual(block["flags"], 1)
        author = block["author"]
        self.assertEqual(robot.resolve(author, block["predicate_namespace"]),
                         "http://example.org/ns#")
        self.assertEqual(robot.resolve(author, block["predicate"]), "lookingfortag")

    def test_an_operator_reads_what_a_robot_wrote(self):
        robot, number = self.robot(7, "00:11:22:33:44:55")
        robot.define(1, "http://example.org/ns#")
        robot.define(2, "lookingfortag")
        robot.write(1500, 2000, 1, statement(number, 2, 244), time=1138458000)
        self.assertIn(f"00:11:22:33:44:55  2006-01-28 14:20:00  -          {number} lookingfortag 244",
                      self.ctl("show", "door"))
        self.assertIn(f"{number} lookingfortag 244",
                      self.ctl("find", "robot=00:11:22:33:44:55", "predicate=lookingfortag"))
        self.assertNotIn("244", self.ctl("find", "predicate=lookingfortag", "tag=plant-7"))

    def test_all_survives_a_crash(self):
        robot, number = self.robot(7, "00:11:22:33:44:55")
        robot.define(1, "http://example.org/ns#")
        robot.define(2, "occupied")
        robot.write(1500, 2000, 1, statement(number, 2, 1), lease_s=3000)
        self.ctl("write", "door", "15 lookingfortag 244", "--author", "ann", "--lease", "3000")
        before = json.loads(self.ctl("show", "door", "--json"))
        self.crash()
        after = json.loads(self.ctl("show", "door", "--json"))
        for it in before["blocks"] + after["blocks"]:
            self.assertTrue(2900 < it.pop("lease_s") <= 3000)
        self.assertEqual(after, before)

    def test_they_stay_when_the_state_is_moved_to_another_map(self):
        robot, number = self.robot(7, "00:11:22:33:44:55")
        robot.define(1, "http://example.org/ns#")
        robot.define(2, "occupied")
        robot.write(1500, 2000, 1, statement(number, 2, 1), lease_s=3000)
        for tag in ("door", "plant-7"):
            for predicate in ("lookingfortag", "saw"):
                self.ctl("write", tag, f"15 {predicate} 244", "--author", "ann")
        before = [json.loads(self.ctl("show", tag, "--json")) for tag in ("door", "plant-7")]
        self.server.stop()
        config = self.folder / "test.toml"
        fine = config.read_text().replace("cell_m = 0.1", "cell_m = 0.05")
        fine = fine.replace("x_m = 1.5", "x_m = 1.25")
        command = [BIN / "pheromonectl", "journal", "resample", "--config", "test.toml", "state"]
        config.write_text(fine.replace("slots = 2", "slots = 1"))
        refused = subprocess.run(command, cwd=self.folder, text=True, capture_output=True, check=False)
        self.assertEqual((refused.returncode, refused.stderr),
                         (2, 'pheromonectl: state does not match the configuration: tag "plant-7" has a '
                             "block in slot 1, and would have only 1 slots; erase that block first\n"))
        config.write_text(fine)
        subprocess.run(command, cwd=self.folder, check=True)
        self.start()
        after = [json.loads(self.ctl("show", tag, "--json")) for tag in ("door", "plant-7")]
        for tag in before + after:
            for it in tag["blocks"]:
                self.assertTrue(it.get("lease_s") is None or 2900 < it.pop("lease_s") <= 3000)
        self.assertEqual(after, before)
        self.assertIn(" 1.25 2.00 m ", self.ctl("list"))

    def test_a_crash_in_the_middle_of_a_claim_leaves_the_claim_or_none(self):
        one, number = self.robot(7, "one")
        for round_ in range(9):
            seen = one.scan(1500, 2000)[0][3]
            claim = wire.build("WRITE", 7, seq=one.next_seq, x=1500, y=2000, tag=1, slot=255,
                               flags=EXPECT, expected=seen, lease_s=3000, time=0,
                               **statement(number, 2, 1))
            one.next_seq = (one.next_seq + 1) % 256
            if round_ % 3 == 0:  # perhaps nobody has received it
                one.line.send(wire.encode(claim))
            elif round_ % 3 == 1:  # received, perhaps not on the disk
                one.line.send(wire.encode(claim))
                one.ping()
            else:  # answered, that is, on the disk
                self.assertEqual(one._exchange(claim).name, "WRITE_ANSWER")
            one.line.close()
            self.crash()
            one.line = open_terminal(self.folder / "radio-a.pty")
            one._in_step = False
            one.hello(1)
            found = [block["author"] for block in one.read(1500, 2000, 1)]
            self.assertIn(found, [[number]] if round_ % 3 == 2 else [[], [number]])
            # It cannot know, and repeats: executed once, and it holds the place.
            self.assertEqual(one._exchange(claim).name, "WRITE_ANSWER")
            [block] = one.read(1500, 2000, 1)
            self.assertEqual((block["author"], one.scan(1500, 2000)[0][3]), (number, seen + 1))
            with self.assertRaises(ErrorAnswer) as refused:  # the next claim with what it saw then
                one.write(1500, 2000, 1, statement(number, 2, 1), flags=EXPECT, expected=seen)
            self.assertEqual(refused.exception.reason, 19)
            one.erase(1500, 2000, 1, block["slot"])

    def test_of_two_claims_one_is_refused(self):
        self.ctl("write", "door", "15 is here")
        one, number = self.robot(7, "one")
        two, other = self.robot(8, "two", line=one.line)
        seen = one.scan(1500, 2000)[0][3]
        claim = dict(flags=EXPECT, expected=seen, lease_s=60)
        one.define(1, "http://example.org/ns#")
        one.define(2, "occupied")
        one.write(1500, 2000, 1, statement(number, 2, 1), **claim)
        with self.assertRaises(ErrorAnswer) as refused:
            two.write(1500, 2000, 1, statement(other, 2, 1), **claim)
        self.assertEqual(refused.exception.reason, 19)
        self.assertEqual(len(one.read(1500, 2000, 1)), 2)
        self.assertEqual(one.read(1500, 2000, 1)[1]["author"], number)
        with self.assertRaises(ErrorAnswer) as refused:
            two.erase(1500, 2000, 1, 1)
        self.assertEqual(refused.exception.reason, 17)

    def test_tags_are_listed(self):
        self.ctl("write", "plant-7", 'door note "wet \\"paint\\""')
        lines = self.ctl("list").splitlines()
        self.assertEqual(lines[0].split(), ["TAG", "NUMBER", "PLACE", "RANGE", "USED"])
        self.assertEqual(lines[1].split(), ["door", "1", "1.50", "2.00", "m", "1", "m", "0", "of", "8"])
        self.assertEqual(lines[2].split()[-3:], ["1", "of", "2"])
        self.assertEqual(self.sentences("plant-7"), ['door note "wet \\"paint\\""'])
        self.assertEqual(json.loads(self.ctl("list", "--json"))["tags"][1]["used"], 1)

    def test_a_slot_is_erased_or_all_of_them(self):
        for number in range(3):
            self.ctl("write", "door", f"15 saw {number}")
        self.ctl("erase", "door", "1")
        self.assertEqual(self.sentences("door"), ["15 saw 0", "15 saw 2"])
        self.ctl("erase", "door", "--all")
        self.assertEqual(self.sentences("door"), [])
        self.assertIn("nothing is written on it", self.ctl("show", "door"))

    def test_a_sentence_is_replaced(self):
        self.ctl("write", "door", "15 cleaned 2006-01-28T14:20:00Z", "--replace")
        self.ctl("write", "door", "15 cleaned 2006-01-28T14:35:00Z", "--replace")
        self.assertEqual(self.sentences("door"), ["15 cleaned 2006-01-28T14:35:00Z"])

    def test_the_metrics_count_them(self):
        robot, number = self.robot(7, "one")
        robot.define(1, "http://example.org/ns#")
        for i in range(3):  # the third one drops the first
            robot.write(6000, 2000, 2, statement(number, 1 + i, i), time=1138458000 + i)
        robot.write(1500, 2000, 1, statement(number, 1, 3), lease_s=3000)
        with self.assertRaises(ErrorAnswer):
            robot.read(6000, 2000, 1)
        lines = self.metrics()
        for sample in ("tags 2", "tags_unconfigured 0", "tag_slots 10", "tag_blocks 3",
                       "tag_leased_blocks 1", "tag_definitions 2", "tag_blocks_written_total 4",
                       "tag_blocks_dropped_total 1", "tag_leases_expired_total 0",
                       'requests_total{request="tag_write"} 4',
                       'errors_total{reason="no tag in range"} 1'):
            self.assertIn("pheromone_" + sample, lines)

    def test_a_sentence_without_quotes_is_refused_with_quotes(self):
        self.assertEqual(self.ctl("write", "door", "15", "lookingfortag", "244", status=2),
                         "pheromonectl: found a sentence of 3 arguments, expected it in quotes, as one: "
                         "'15 lookingfortag 244'\n")
        self.assertEqual(self.sentences("door"), [])

    def test_a_full_tag_says_so(self):
        self.ctl("write", "plant-7", "15 keeps out")
        self.assertIn('tag "plant-7": it is full: leased and privileged blocks take 1 of its 2 slots, '
                      "and may take 1: erase one of them, or wait until a lease ends\n",
                      self.ctl("write", "plant-7", "16 keeps out", status=1))

    def test_what_is_exported_is_imported(self):
        for tag, sentence in (("door", "15 lookingfortag 244"), ("door", 'tag:2 note "wet paint"'),
                              ("plant-7", "door seen 2006-01-28T14:20:00Z")):
            self.ctl("write", tag, sentence, "--author", "ann")
        before = {tag: sorted(self.sentences(tag)) for tag in ("door", "plant-7")}
        lines = sorted(self.ctl("export").splitlines())
        for name in ("tags.nt", "tags.ttl", "tags.rdf"):
            with self.subTest(name):
                self.ctl("export", "--output", name)
                for tag in before:
                    self.ctl("erase", tag, "--all")
                self.assertEqual(self.ctl("import", name),
                                 self.summary(written=3))
                self.assertEqual({tag: sorted(self.sentences(tag)) for tag in before}, before)
                self.assertEqual(sorted(self.ctl("export").splitlines()), lines)
                self.assertEqual(self.ctl("import", name),
                                 self.summary(there=3))
        self.assertNotIn("seen", self.ctl("export", "door", "--format", "turtle"))

    @staticmethod
    def summary(written=0, there=0, unfit=0, refused=0, ignored=0):
        return (f"{written} facts written, {there} were there, {unfit} did not fit, {refused} refused; "
                f"{ignored} other triples ignored\n")

    def facts(self, name, numbers, robot="sweeper", predicate="http://example.org/ns#saw",
              type_="int", tag="door"):
        """A file in which a robot has seen these numbers, each at the second of that number."""
        rdf, xsd = "http://www.w3.org/1999/02/22-rdf-syntax-ns#", "http://www.w3.org/2001/XMLSchema#"
        (self.folder / name).write_text("".join(f"""<urn:{number}> a <{rdf}Statement> ;
  <{rdf}subject> <http://robots.org/robot/{robot}> ; <{rdf}predicate> <{predicate}> ;
  <{rdf}object> "{number}"^^<{xsd}{type_}> ; <http://robots.org/ns#tag> <http://robots.org/tag/{tag}> ;
  <http://robots.org/ns#robotId> "{robot}" ;
  <http://robots.org/ns#dtime> "2006-01-28T14:20:{number:02}Z"^^<{xsd}dateTime> .
""" for number in numbers))
        return name

    def numbers(self, tag="door"):
        return sorted(int(it.split()[-1]) for it in self.sentences(tag))

    def imported(self, name, status=0):
        result = subprocess.run([BIN / "pheromonectl", "tags", "import", name], cwd=self.folder,
                                text=True, capture_output=True, check=False, timeout=60)
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return result.stdout, result.stderr

    def test_a_second_import_changes_nothing(self):
        # Another maker splits the same IRI elsewhere, and numbers it otherwise.
        robot, number = self.robot(7, "sweeper")
        robot.define(3, "http://example.org/")
        robot.define(4, "ns#saw")
        for i in range(1, 5):
            robot.write(1500, 2000, 1, dict(statement(number, 4, i), predicate_namespace=3),
                        time=1138458000 + i)
        name = self.facts("eight.ttl", range(1, 9))
        self.assertEqual(self.imported(name), (self.summary(written=4, there=4), ""))
        self.assertEqual(self.numbers(), list(range(1, 9)))
        definitions = [line for line in self.metrics() if "tag_definitions" in line]
        for _ in range(2):
            self.assertEqual(self.imported(name), (self.summary(there=8), ""))
            self.assertEqual(self.numbers(), list(range(1, 9)))
        # As integers, which are the same numbers.
        self.assertEqual(self.imported(self.facts("integers.ttl", range(1, 9), type_="integer")),
                         (self.summary(there=8), ""))
        self.assertEqual([line for line in self.metrics() if "tag_definitions" in line], definitions)
        for example in ("saw", "<http://example.org/ns#saw>", "http://example.org/ns#saw"):
            found = self.ctl("find", f"predicate={example}").splitlines()
            self.assertEqual(len(found), 1 + 8, example)

    def test_of_more_facts_than_slots_the_latest_remain(self):
        self.ctl("write", "door", "15 is leased", "--author", "guest", "--lease", "3000")
        name = self.facts("ten.ttl", range(1, 11))
        why = 'pheromonectl: tag "door": 3 of 10 new facts did not fit: its 8 slots have later ones, ' \
              "or are leased or of privileged authors\n"
        self.assertEqual(self.imported(name, status=1), (self.summary(written=7, unfit=3), why))
        latest = [it for it in self.sentences("door") if "saw" in it]
        self.assertEqual(sorted(int(it.split()[-1]) for it in latest), list(range(4, 11)))
        why = why.replace("3 of 10", "3 of 3")
        for _ in range(3):
            self.assertEqual(self.imported(name, status=1), (self.summary(there=7, unfit=3), why))
            self.assertEqual([it for it in self.sentences("door") if "saw" in it], latest)
        # Later ones take the place of the oldest only.
        self.assertEqual(self.imported(self.facts("later.ttl", [11, 12])), (self.summary(written=2), ""))
        self.assertEqual(sorted(int(it.split()[-1]) for it in self.sentences("door") if "saw" in it),
                         list(range(6, 13)))
        counts = json.loads(self.ctl("import", name, "--json", status=None))
        self.assertEqual(counts, {"written": 0, "there": 5, "unfit": 5, "refused": 0, "ignored": 0})

    def test_what_a_tag_refuses_is_counted(self):
        self.ctl("write", "plant-7", "15 keeps out")  # of the operator: one protected block of one
        name = self.facts("two.ttl", [1, 2], robot="operator", tag="plant-7")
        output, words = self.imported(name, status=1)
        self.assertEqual(output, self.summary(unfit=1, refused=1))
        self.assertIn('"plant-7": it is full: leased and privileged blocks take 1 of its 2 slots, and '
                      "may take 1: erase", words)
        self.assertIn('"plant-7": 1 of 2 new facts did not fit', words)

    def test_a_file_with_an_error_changes_nothing(self):
        (self.folder / "bad.ttl").write_text("<http://a.b/c> <http://a.b/d> .\n")
        self.assertIn("bad.ttl", self.ctl("import", "bad.ttl", status=2))
        self.ctl("write", "door", "15 is here")
        text = self.ctl("export")
        (self.folder / "other.nt").write_text(text.replace("tag/door>", "tag/window>"))
        self.assertIn('tag "window", expected one of this server',
                      self.ctl("import", "other.nt", status=1))
        self.assertIn("none.nt", self.ctl("import", "none.nt", status=2))
        self.assertEqual(self.sentences("plant-7"), [])

    def test_mistakes_are_named(self):
        self.assertIn('there is no tag "window"', self.ctl("show", "window", status=1))
        self.assertIn("found 1 terms, expected subject, predicate and object",
                      self.ctl("write", "door", "hello", status=2))
        self.assertIn("expected the number of a slot, or --all", self.ctl("erase", "door", status=2))
        self.assertIn("it has no such slot", self.ctl("erase", "door", "9", status=1))
        self.assertIn('tag "door": the slot is 8, expected 0 to 7',
                      self.ctl("write", "door", "15 is here", "--slot", "8", status=1))
        self.assertIn("expected 1 to 255 bytes of UTF-8 without control characters",
                      self.ctl("write", "door", "15 is here", "--author", "a\nb", status=2))
        self.assertIn("has a text of 256 bytes, expected 1 to 255",
                      self.ctl("write", "door", f'15 note "{"x" * 256}"', status=2))
        self.assertIn("pheromone_tag_definitions 0", self.metrics())  # they would be for ever
        self.assertIn("expected robot=, subject=", self.ctl("find", "colour=red", status=2))
        self.assertEqual(self.sentences("door"), [])

    def test_the_journal_tells_them(self):
        robot, number = self.robot(7, "one")
        robot.write(1500, 2000, 1, statement(number, 2, 1))
        result = subprocess.run([BIN / "pheromonectl", "journal", "export", "state"],
                                cwd=self.folder, text=True, capture_output=True, check=True)
        events = [line.split(",")[3] for line in result.stdout.splitlines()]
        self.assertEqual(events[-2:], ["symbol", "tag_write"])


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    running_daemon.PHEROMONED = BIN / "pheromoned"
    unittest.main()
