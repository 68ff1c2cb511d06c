#!/usr/bin/env python3
"""The Python package's robot on a signed link: against the vectors, python3-cryptography and a server
that is written with it.

    signing_test.py
"""

import asyncio
import multiprocessing
import pathlib
import random
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
from pheromone import _signing, aio, drive, wire  # noqa: E402
from pheromone.robot import (  # noqa: E402
    Client, Line, NewEpoch, NoAnswer, NonceUsedUp, next_boot)
from pheromone.wire import build  # noqa: E402
from signed_server import SignedServer, cmac  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
VECTORS = HERE.parents[1] / "protocol/vectors/signed.txt"
KEY = bytes(range(16))
RESUME = build("COMMAND", 7, seq=1, code=wire.RESUME)
HALT_ALL = build("COMMAND", 255, seq=9, code=wire.HALT)


def vectors():
    """name: key, use, last, the frame's body, covered, counter, MAC, verdict."""
    found = {}
    for line in VECTORS.read_text().splitlines():
        if not line.startswith("#"):
            name, key, use, last, sent, covered, counter, mac, verdict = line.split(" | ")
            sent, covered, mac = (bytes.fromhex(it.replace("-", "")) for it in (sent, covered, mac))
            bodies = wire.Decoder().feed(sent)
            found[name] = (bytes.fromhex(key), int(use), int(last), bodies[0] if bodies else b"",
                           covered, int(counter), mac, verdict)
    return found


class MacTest(unittest.TestCase):
    def test_is_that_of_another_library(self):
        chance = random.Random(18)
        for size in [*range(70), *(chance.randrange(200) for _ in range(200))]:
            key, data = chance.randbytes(16), chance.randbytes(size)
            self.assertEqual(_signing.Mac(key)(data), cmac(key, data))

    def test_is_that_of_the_vectors(self):
        for name, (key, use, _, _, covered, counter, mac, _) in vectors().items():
            if mac:
                data = bytes([use]) + counter.to_bytes(4, "little") + covered
                self.assertEqual(_signing.Mac(key)(data), mac, name)

    def test_a_key_has_16_bytes(self):
        for size in (0, 15, 17, 32):
            with self.assertRaises(ValueError):
                _signing.Signer(bytes(size), 7)


class SignerTest(unittest.TestCase):
    def setUp(self):
        self.vectors = vectors()
        self.signer = _signing.Signer(self.vectors["hello"][0], 7)

    def body(self, name):
        return self.vectors[name][3]

    def covered(self, name):
        return self.vectors[name][4]

    def greet(self):
        self.assertEqual(self.signer.ask(self.covered("hello")), self.body("hello"))
        self.assertTrue(self.signer.awaits_greeting)
        self.assertIsNone(self.signer.verify(self.body("greeting")))
        self.assertFalse(self.signer.awaits_greeting)

    def test_a_session_is_that_of_the_vectors(self):
        self.greet()
        for name in ("hello_in_session", "sense", "trace", "trace_repeated", "command_ack", "ping_empty",
                     "symbol_longest"):
            self.assertEqual(self.signer.sign(self.covered(name)), self.body(name), name)
        for name in ("hello_answer", "sense_answer", "trace_answer", "trace_answer_repeated", "command_resume",
                     "error_read_only", "halt_to_all", "round_counter_wraps", "round_coded",
                     "round_coded_rows_as_unsigned", "round_coded_largest"):
            self.assertEqual(self.signer.verify(self.body(name)), self.covered(name), name)
            self.assertIsNone(self.signer.verify(self.body(name)), name)  # again

    def test_accepts_what_the_vectors_say(self):
        seen = {"ok": 0, "wrong": 0}
        for name, (key, use, last, body, covered, counter, _, verdict) in self.vectors.items():
            if use not in (2, 3, 5):
                continue
            signer = _signing.Signer(key, 16 if covered[:1] == b"\x10" else 7)
            if use == 5:
                signer._asked = (42).to_bytes(2, "little"), last
            signer._session = signer._group = _signing.Mac(key)
            signer._heard = signer._group_heard = last
            found = signer.verify(body) if body else None  # too much damage
            if use == 5:
                self.assertEqual(not signer.awaits_greeting, verdict == "ok", name)
            else:
                self.assertEqual(found is not None, verdict == "ok", name)
            if found is not None:
                self.assertEqual((found, max(signer._heard, signer._group_heard)), (covered, counter))
            seen[verdict] += 1
        self.assertGreaterEqual(seen["ok"], 10)
        self.assertGreaterEqual(seen["wrong"], 20)

    def test_a_greeting_is_accepted_once_and_only_of_the_last_hello(self):
        self.greet()
        self.signer.sign(self.covered("hello_in_session"))
        self.signer.verify(self.body("greeting"))
        self.assertEqual(self.signer.sign(self.covered("sense")), self.body("sense"))
        self.signer.ask(self.covered("hello"))
        self.signer.verify(self.body("greeting"))
        self.assertTrue(self.signer.awaits_greeting)

    def test_a_greeting_that_was_held_back_does_not_set_the_groups_counter_back(self):
        self.greet()
        self.signer._asked = (42).to_bytes(2, "little"), 0
        for name in ("halt_to_all", "round_counter_wraps"):
            self.assertIsNotNone(self.signer.verify(self.body(name)))
        self.signer.verify(self.body("greeting"))
        self.assertFalse(self.signer.awaits_greeting)
        for name in ("halt_to_all", "round_counter_wraps"):
            self.assertIsNone(self.signer.verify(self.body(name)))
        self.assertIsNotNone(self.signer.verify(self.body("round_coded")))

    def test_a_greeting_of_an_earlier_boot_is_not_accepted(self):
        hello = wire.build_hello(7, nonce=43)
        self.assertEqual(self.signer.ask(hello)[-6:-4], b"\0\0")  # the number that it had, too
        self.signer.verify(self.body("greeting"))
        self.assertTrue(self.signer.awaits_greeting)

    def test_numbers_of_hello_are_used_once(self):
        hello = wire.build_hello(7, nonce=43)
        numbers = [self.signer.ask(it)[-6:-4].hex() for it in (self.covered("hello"), hello,
                                                                self.covered("hello"), hello)]
        self.assertEqual(numbers, ["0000", "0000", "0100", "0100"])
        self.signer._numbers[hello[2:4]] = 0x10000
        with self.assertRaises(NonceUsedUp):
            self.signer.ask(hello)

    def test_nothing_is_signed_without_a_session(self):
        with self.assertRaises(ValueError):
            self.signer.sign(self.covered("sense"))



class BootsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "boots"

    def test_counts_up_from_1_to_the_last(self):
        self.assertEqual([next_boot(self.file) for _ in range(3)], [1, 2, 3])
        self.file.write_text("65534\n")
        self.assertEqual(next_boot(str(self.file)), 65535)
        with self.assertRaises(OverflowError):
            next_boot(self.file)

    def test_a_damaged_file_does_not_begin_again(self):
        for text in ("", "seven"):
            self.file.write_text(text)
            with self.assertRaises(ValueError):
                next_boot(self.file)

    def test_no_number_is_given_to_two_programs(self):
        with multiprocessing.Pool(4) as pool:
            numbers = pool.map(next_boot, [self.file] * 80, chunksize=5)
        self.assertEqual(sorted(numbers), list(range(1, 81)))


class ConversationTest(unittest.TestCase):
    def serve(self, **options):
        self.server = SignedServer(KEY, **options)
        self.server.__enter__()
        self.addCleanup(self.server.__exit__)
        line = Line(self.server.robots_end())
        self.addCleanup(line.close)
        self.obeyed = []

        def obey(command):
            self.obeyed.append(command.fields["code"])
            return 0
        self.robot = Client(line, 7, timeout=60, tries=40, on_command=obey, key=KEY)

    def settle(self):
        """All that the server has sent is read with the first echo, and what that was answered with
        is before the second."""
        self.robot.ping(b"settled")
        self.robot.ping(b"settled again")

    def test_hello_comes_first(self):
        self.serve()
        with self.assertRaises(ValueError):
            self.robot.sense(1, 0, 0, 0)
        self.assertEqual(self.robot.hello(nonce=1).pose_unit_10um, 100)
        self.assertEqual(self.robot.sense(1, 0, 0, 0), (4096, 2560))
        self.assertEqual(self.server.ignored, [])

    def test_each_change_is_made_once_though_answers_are_lost(self):
        self.serve()
        self.robot.hello(nonce=1)
        chance = random.Random(3)
        self.server.lose = lambda body: chance.random() < 0.3
        self.robot.timeout = 0.03
        for x in range(60):
            self.robot.trace(1, x, 0, 0)
        self.assertEqual([it.fields["x"] for it in self.server.executed], list(range(60)))
        traces = [it for it in self.server.heard if it[1] == 0x31]
        self.assertGreater(len(traces), 70)  # repetitions, each with a counter and a tag of its own
        self.assertEqual(len(set(traces)), len(traces))
        self.assertEqual(len({it[:-5] for it in traces}), 60)
        hellos = [it[2:4] + it[-6:-4] for it in self.server.heard if it[1] == 0x71 and len(it) == 12]
        self.assertGreater(len(hellos), 10)
        self.assertEqual(len(set(hellos)), len(hellos))

    def test_a_server_that_was_restarted_is_greeted_again(self):
        self.serve()
        self.robot.hello(nonce=1)
        self.robot.deposit(1, 1, 1)
        self.server.restart()
        self.robot.timeout = 0.05
        self.robot.deposit(1, 2, 2)
        self.assertEqual([it.fields["x"] for it in self.server.executed], [1, 2])
        self.assertGreater(len(self.server.ignored), 0)

    def test_another_epoch_is_told(self):
        self.serve()
        self.robot.hello(nonce=1)
        self.server.restart()
        self.server.epoch = 2
        self.robot.tries, self.robot.timeout = 1, 0.05
        with self.assertRaises(NoAnswer):
            self.robot.sense(1, 0, 0, 0)
        self.robot.timeout = 60
        with self.assertRaises(NewEpoch):
            self.robot.deposit(1, 1, 1)
        self.assertEqual(self.server.executed, [])
        self.assertEqual(self.robot.hello(nonce=1).epoch, 2)
        self.robot.deposit(1, 1, 1)

    def test_only_what_the_server_signed_is_obeyed(self):
        self.serve()
        self.robot.hello(nonce=1)
        self.settle()
        self.server.tell(RESUME)
        self.server.tell_all(HALT_ALL)
        self.settle()
        self.assertEqual(self.obeyed, [wire.RESUME, wire.HALT])
        self.assertEqual(len(self.server.acknowledged), 1)
        recorded = list(self.server.sent)
        other = build("COMMAND", 7, seq=2, code=wire.RESUME)
        forged = [other, HALT_ALL, other + bytes(5), HALT_ALL + bytes(6), b"\x07\xd1",
                  build("SENSE_ANSWER", 7, type=1, left=-1, right=-1), other[:-1]]
        for body in forged + recorded:
            self.server.transmit(body)
        self.assertEqual(self.robot.sense(1, 0, 0, 0), (4096, 2560))
        self.robot.hello(nonce=1)  # and in the next session
        for body in forged + recorded:
            self.server.transmit(body)
        self.assertEqual(self.robot.sense(1, 0, 0, 0), (4096, 2560))
        self.settle()
        self.assertEqual(self.obeyed, [wire.RESUME, wire.HALT])
        self.assertEqual(len(self.server.acknowledged), 1)

    def test_a_command_that_is_repeated_is_obeyed_once_and_acknowledged_twice(self):
        self.serve()
        self.robot.hello(nonce=1)
        self.settle()
        self.server.tell(RESUME)
        self.server.tell(RESUME)
        self.settle()
        self.assertEqual((self.obeyed, len(self.server.acknowledged)), ([wire.RESUME], 2))

    def test_more_than_256_frames_each_way(self):
        self.serve()
        self.robot.hello(nonce=1)
        for x in range(600):
            self.robot.sense(1, x, 0, 0)
        self.assertEqual(self.server.session.heard, 601)  # HELLO is the first
        self.assertEqual(self.server.ignored, [])

    def test_frames_to_all_of_a_link_that_takes_both_are_not_signed(self):
        self.serve(signs_to_all=False)
        self.server.transmit(HALT_ALL)  # before HELLO nobody knows that
        self.robot.hello(nonce=1)
        self.settle()
        self.assertEqual(self.obeyed, [])
        self.server.transmit(build("COMMAND", 7, seq=2, code=wire.RESUME))
        self.server.tell_all(HALT_ALL)
        self.settle()
        self.assertEqual(self.obeyed, [wire.HALT])

    def test_a_follower_and_asyncio(self):
        self.serve()

        class Still:
            def __init__(self):
                self.speeds = []

            def pose(self):
                return 1, 1, 0

            def wheels(self, left_mm_s, right_mm_s):
                self.speeds.append((left_mm_s, right_mm_s))
        with tempfile.TemporaryDirectory() as folder:
            boots = pathlib.Path(folder) / "boots"
            line, still = self.robot.line, Still()
            with self.assertRaises(ValueError):
                drive.Follower(line, 7, still, key=KEY)
            follower = drive.Follower(line, 7, still, released=True, key=KEY, boots=boots)
            follower.client.timeout = 60
            follower.step()
            self.assertEqual(still.speeds, [(125, 200)])
            # The server is away for hours, and comes back.
            follower.client._signer._numbers[(1).to_bytes(2, "little")] = 1 << 16
            follower.client._in_step = False
            follower.step()
            follower.step()
            self.assertEqual(still.speeds[1:], [(0, 0), (125, 200)])
            self.assertEqual(self.server.nonce, 2)
            nonce = next_boot(boots)
        self.assertEqual(nonce, 3)

        async def ask():
            robot = aio.AsyncClient(line, 7, key=KEY)
            await robot.hello(nonce)
            return await robot.sense(1, 0, 0, 0)
        self.assertEqual(asyncio.run(ask()), (4096, 2560))


if __name__ == "__main__":
    unittest.main()
