#!/usr/bin/env python3
"""The checker of faults_test.py finds what it is for: each case breaks one thing of a sound run."""

import copy
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from cluster import histories  # noqa: E402

FIRST, SECOND = "01210001020304", "01210101020305"  # two changes of robot 0:1
EDIT = (1000, 2000)
GROUPS = [(1, 2, 5), (3, 2, 9)]


class Stub(histories.Journal):
    def __init__(self, *lines):
        self.error = ""
        self.lines = list(lines)
        self.events = [line.split("\t") for line in lines]


def line(sequence, time_ms, what, epoch=7, hashed="-"):
    return f"{sequence}\t{time_ms}\t{epoch}\t{hashed}\t{what}"


SOUND = (line(1, 10, "other"), line(2, 20, f"request\t0\t{FIRST}\t01a100"),
         line(3, 20, "edit\t1000\t2000"), line(4, 30, f"request\t0\t{SECOND}\t01a101", hashed="ab"))
HISTORY = [
    {"t": 1.0, "robot": "0:1", "what": "hello", "epoch": 7, "last_seq": 0},
    {"t": 1.1, "robot": "0:1", "what": "sent", "body": FIRST},
    {"t": 1.2, "robot": "0:1", "what": "answer", "body": FIRST, "answer": "01a100"},
    {"t": 1.3, "robot": "0:1", "what": "sent", "body": SECOND},
    {"t": 1.4, "robot": "0:1", "what": "answer", "body": SECOND, "answer": "01a101"},
]


class HistoriesTest(unittest.TestCase):
    def robots(self, lines=SOUND, history=None):
        return list(histories.check_robots(history or HISTORY, Stub(*lines)))

    def finds(self, found, what):
        self.assertEqual(len(found), 1, found)
        self.assertIn(what, found[0])

    def test_a_sound_run_is_sound(self):
        self.assertEqual(self.robots(), [])
        self.assertEqual(list(histories.check_journal("a", Stub(*SOUND))), [])
        self.assertEqual(list(histories.check_equal({"a": Stub(*SOUND), "b": Stub(*SOUND[:3])})), [])
        self.assertEqual(list(histories.check_operators([(*EDIT, 200)], Stub(*SOUND))), [])
        self.assertEqual(list(histories.check_hashes([("a", 4, "ab")], GROUPS, Stub(*SOUND))), [])
        self.assertEqual(list(histories.check_groups(GROUPS[:1], GROUPS, Stub(*SOUND))), [])
        self.assertEqual(list(histories.check_groups(GROUPS[:1], GROUPS, Stub(*SOUND[:3]))), [])

    def test_an_acknowledged_change_that_is_lost(self):
        self.finds(self.robots(SOUND[:3]), "was acknowledged and is lost")

    def test_a_change_that_was_applied_twice(self):
        found = self.robots((*SOUND, line(5, 30, f"request\t0\t{SECOND}\t01a101")))
        self.assertTrue(any("applied 2 times" in it for it in found), found)

    def test_changes_in_another_order(self):
        self.finds(self.robots((SOUND[0], SOUND[3], SOUND[2], SOUND[1])), "another order")

    def test_an_answer_that_is_not_the_replays(self):
        history = copy.deepcopy(HISTORY)
        history[2]["answer"] = "01a1ff"
        self.finds(self.robots(history=history), "the replay's answer is 01a100")

    def test_a_change_without_an_answer(self):
        self.finds(self.robots(history=HISTORY[:4]), "was never answered")

    def test_another_epoch(self):
        history = [*HISTORY, {**HISTORY[0], "epoch": 8}]
        self.finds(self.robots(history=history), "expected one")
        self.finds(list(histories.check_journal("a", Stub(*SOUND[:3], line(4, 30, "other", 8)))),
                   "expected one")

    def test_changes_of_a_robot_that_sent_none(self):
        self.finds(self.robots((*SOUND, line(5, 30, "request\t0\t02210001020304\t02a100"))),
                   "never sent")

    def test_time_that_goes_back(self):
        self.finds(list(histories.check_journal("a", Stub(*SOUND, line(5, 29, "other")))),
                   "29 ms of event 5 after 30 ms")

    def test_journals_that_differ(self):
        other = (*SOUND[:2], line(3, 20, "edit\t1000\t2001"), SOUND[3])
        self.finds(list(histories.check_equal({"a": Stub(*SOUND), "b": Stub(*other)})), "event 3 differs")

    def test_a_journal_that_begins_with_a_state_and_one_that_lacks_what_no_other_has(self):
        late = Stub(*SOUND[2:])
        self.assertEqual(list(histories.check_equal({"a": Stub(*SOUND), "b": late})), [])
        self.finds(list(histories.check_equal({"a": Stub(*SOUND[:3], line(4, 30, "other")), "b": late})),
                   "event 4 differs")
        whole = histories.join([Stub(*SOUND[:3]), late])
        self.assertEqual(whole.lines, list(SOUND))
        self.finds(list(histories.check_groups(GROUPS[:1], GROUPS, histories.join([Stub(*SOUND[:1]), late]))),
                   "do not have all events")

    def test_edits_that_are_lost_doubled_or_nobodys(self):
        journal = Stub(*SOUND, line(5, 30, "edit\t1000\t2000"))
        self.finds(list(histories.check_operators([(*EDIT, 0)], journal)), "made 2 times")
        self.finds(list(histories.check_operators([(*EDIT, 200), (5, 5, 200)], Stub(*SOUND))), "is lost")
        self.finds(list(histories.check_operators([], Stub(*SOUND))), "by nobody")

    def test_a_hash_that_is_not_the_replays(self):
        self.finds(list(histories.check_hashes([("a", 4, "cd")], GROUPS, Stub(*SOUND))), "told hash cd")

    def test_a_committed_state_that_the_log_does_not_have(self):
        self.finds(list(histories.check_hashes([("a", 4, "ab"), ("a", 5, "ef")], GROUPS, Stub(*SOUND))),
                   "after event 5 as committed, the log ends before event 5")
        self.finds(list(histories.check_groups(GROUPS, GROUPS, Stub(*SOUND, line(5, 30, "other")))),
                   "the journals after 5")
        self.finds(list(histories.check_groups(GROUPS, GROUPS, Stub(*SOUND[:3]))), "the journals after 3")

    def test_groups_that_leave_a_gap_or_go_back_to_an_earlier_term(self):
        self.finds(list(histories.check_groups([], [(1, 2, 5), (4, 1, 5)], Stub(*SOUND))), "follows one that")
        self.finds(list(histories.check_groups([], [(1, 2, 9), (3, 2, 5)], Stub(*SOUND))), "term 5, after 9")

    def halts(self, *lines):
        halts = histories.Halts()
        for it in HISTORY:
            halts.feed({"server": 0, **it})
        halts.begin(2.0, {"0:1": 0, "0:2": 0})  # the second is not there any more
        for it in lines:
            halts.feed(it)
        return halts

    def test_a_halt_that_comes_late(self):
        halt = {"t": 2.3, "robot": "0:1", "what": "halt", "server": 0}
        halts = self.halts(halt)
        self.assertEqual(halts.missing(), [])
        halts.end()
        self.assertEqual([(t, robot, round(s, 3)) for t, robot, s in halts.delays], [(2.0, "0:1", 0.3)])
        halts = self.halts(halt, {"t": 2.3, "robot": "-", "what": "stall", "s": 0.25})
        halts.end()
        self.assertEqual(halts.delays, [])

    def test_a_halt_that_never_comes(self):
        earlier = {"t": 1.9, "robot": "0:1", "what": "halt", "server": 0}
        self.assertEqual(self.halts(earlier).missing(), ["0:1"])
        self.assertEqual(self.halts({"t": 2.1, "robot": "0:1", "what": "moved", "server": 1}).missing(), [])



if __name__ == "__main__":
    unittest.main()
