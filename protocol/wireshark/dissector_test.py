#!/usr/bin/env python3
"""The dissector, in tshark, says of the protocol's vectors what the vectors say."""
import argparse
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
VECTORS = HERE.parent / "vectors"
TSHARK = "tshark"

LINKTYPE_USER0 = 147
LINKTYPE_RAW = 101
INBOUND, OUTBOUND = 1, 2
# The names that the vectors and the dissector have for the same thing, where they differ.
RENAMED = {"speed_mm_s": "speed", "type_to_follow": "follow_type",
           "code": {"COMMAND": "command", "COMMAND_ACK": "command", "EVENT": "event"},
           "pose_unit_10um": "pose_unit", "antenna_distance_mm": "antenna_distance",
           "slot_ms": "slot", "response_window_ms": "window", "turns": "turn",
           "slot": "tag_slot", "next": "next_slot", "lease_s": "lease",
           "flags": {"READ_ANSWER": "block_flags", "WRITE": "write_flags", "ERASE": "write_flags"},
           "number": {"ROUND": "number", "SYMBOL": "symbol_number",
                      "SYMBOL_ANSWER": "symbol_number", "RESOLVE": "symbol_number",
                      "RESOLVE_ANSWER": "symbol_number"}}


def renamed(key, message):
    """The dissector's name of a field of fields.txt."""
    name = RENAMED.get(key, key)
    return name[message] if isinstance(name, dict) else name


def rows(name):
    """The columns of each line of a file of vectors."""
    for line in (VECTORS / name).read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            yield [column.strip() for column in line.split("|")]


def block(kind, body):
    body += b"\0" * (-len(body) % 4)
    length = len(body) + 12
    return struct.pack("<II", kind, length) + body + struct.pack("<I", length)


def option(code, value):
    return struct.pack("<HH", code, len(value)) + value + b"\0" * (-len(value) % 4)


def capture(packets, links=1):
    """A pcapng file of (link, connection, direction, bytes, time in ns)."""
    out = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    for link in range(links):
        out += block(1, struct.pack("<HHI", LINKTYPE_USER0, 0, 0) +
                     option(2, b"radio-%d" % link) + option(9, b"\x09") + option(0, b""))
    for link, connection, direction, data, time_ns in packets:
        data = struct.pack("<HIBB", link, connection, direction, 0) + data
        padded = data + b"\0" * (-len(data) % 4)
        out += block(6, struct.pack("<IIIII", link, time_ns >> 32, time_ns & 0xFFFFFFFF, len(data),
                                    len(data)) + padded +
                     option(2, struct.pack("<I", direction)) + option(0, b""))
    return out


class DissectorTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.file = pathlib.Path(temporary.name) / "test.pcapng"

    def dissect(self, packets, fields, *arguments, links=1):
        """For each packet, for each field, the list of its values. In two passes, as a viewer that
        is clicked through does."""
        self.file.write_bytes(capture(packets, links))
        command = [TSHARK, "-2", "-r", self.file, "-X", f"lua_script:{HERE / 'pheromone.lua'}",
                   "-T", "fields", "-E", "separator=|", "-E", "aggregator=;", *arguments]
        for field in fields:
            command += ["-e", field]
        result = subprocess.run(command, capture_output=True, text=True, check=True)
        self.assertNotIn("Lua", result.stderr)
        lines = result.stdout.splitlines()
        self.assertEqual(len(lines), len(packets))
        return [[value.split(";") if value else [] for value in line.split("|")] for line in lines]

    def test_says_what_a_receiver_does_with_each_frame(self):
        vectors = [(name, bytes.fromhex(wire), verdict) for name, _, wire, verdict
                   in rows("frames.txt")]
        found = self.dissect([(0, i, INBOUND, wire, 0) for i, (_, wire, _) in enumerate(vectors)],
                             ["pheromone.verdict"])
        self.assertGreater(len(vectors), 50)
        for (name, _, verdict), [verdicts] in zip(vectors, found):
            with self.subTest(name):
                self.assertIn(verdict, verdicts)

    def test_reads_the_records_of_nets_in_blocks(self):
        sys.path.insert(0, str(VECTORS))
        import naive_protocol
        import net_vectors
        names = ["state", "outcome", "robot", "seq", "amount", "left", "action", "transition",
                 "energy", "candidate"]
        records = list(rows("net_records.txt"))
        packets = []
        for i, (_, _, _, statement, _, _) in enumerate(records):
            data = bytes.fromhex(statement)
            body = (bytes([7, 0xC2]) + bytes(20) if i % 2 else bytes([7, 0x43]) + bytes(21)) + data
            packets.append((0, i, INBOUND, naive_protocol.wire_of(body), 0))
        found = self.dissect(packets, ["pheromone.net_verdict", "pheromone.net_hash"] +
                             ["pheromone.net_" + name for name in names])
        self.assertGreater(len(records), 40)
        kinds = {number: kind for kind, number in net_vectors.KINDS.items()}
        for (name, _, _, statement, verdict, values), [shown, net, *columns] in zip(records, found):
            data = bytes.fromhex(statement)
            own_net = int.from_bytes(data[6:10], "little")
            expected = net_vectors.judge(data, kinds.get(data[5], "robot"), naive_protocol.crc16, own_net)
            with self.subTest(name):
                if expected == "no-record":
                    self.assertEqual(shown + net, [])
                    continue
                self.assertEqual((shown, [int(it, 16) for it in net]), ([expected], [own_net]))
                if verdict != "ok":
                    continue
                fields = dict(pair.split("=") for pair in values.split())
                if "candidates" in fields:
                    fields["candidate"] = fields.pop("candidates").replace("-", "")
                got = {key: ",".join(str(int(it, 0)) for it in column)
                       for key, column in zip(names, columns) if column}
                self.assertEqual(got, {key: value for key, value in fields.items() if value})

    def test_gives_each_field_its_value(self):
        wires = {name: bytes.fromhex(wire) for name, _, wire, _ in rows("frames.txt")}
        meanings = list(rows("fields.txt"))
        names = sorted({renamed(pair.split("=")[0], message)
                        for _, message, values in meanings for pair in values.split(" ")})
        found = self.dissect([(0, i, INBOUND, wires[name], 0)
                              for i, (name, *_) in enumerate(meanings)],
                             ["pheromone.message"] + ["pheromone." + name for name in names])
        for (name, message, values), [shown, *columns] in zip(meanings, found):
            expected = {}
            for pair in values.split(" "):
                key, value = pair.split("=", 1)
                expected[renamed(key, message)] = value
            with self.subTest(name):
                self.assertEqual(shown, [message])
                for key, value in expected.items():
                    got = columns[names.index(key)]
                    if key in ("payload", "text"):
                        self.assertEqual("".join(got), "" if value == "-" else value.lower())
                    else:
                        told = [] if value == "-" else [int(it) for it in value.split(",")]
                        self.assertEqual([int(it, 0) for it in got], told, key)
                others = [it for it, column in zip(names, columns) if column and it not in expected]
                self.assertEqual(others, [])

    def test_puts_frames_together_however_the_bytes_are_cut(self):
        chance = random.Random(7)
        streams = [(name, b"" if sent == "-" else bytes.fromhex(sent), delivered)
                   for name, sent, delivered in rows("streams.txt")]
        packets = []
        for connection, (_, data, _) in enumerate(streams):
            while data:
                size = chance.randint(1, 5)
                packets.append((0, connection, INBOUND, data[:size], len(packets)))
                data = data[size:]
        found = self.dissect(packets, ["pheromone.id", "pheromone.opcode"])
        for connection, (name, _, delivered) in enumerate(streams):
            heard = [(int(i), int(code, 16)) for packet, columns in zip(packets, found)
                     if packet[1] == connection for i, code in zip(*columns)]
            frames = [] if delivered == "-" else [bytes.fromhex(it) for it in delivered.split(";")]
            with self.subTest(name):
                self.assertEqual(heard, [(it[0], it[1]) for it in frames])

    def test_keeps_links_connections_and_directions_apart(self):
        frame = bytes.fromhex("10 02 07 01 E8 03 F4 01 00 00 61 FE 10 03")
        streams = [(0, 0, INBOUND), (0, 0, OUTBOUND), (0, 1, INBOUND), (1, 0, INBOUND)]
        packets = [(*stream, part, 0) for part in (frame[:6], frame[6:]) for stream in streams]
        found = self.dissect(packets, ["pheromone.verdict"], links=2)
        self.assertEqual(found, [[[]]] * 4 + [[["ok"]]] * 4)

    def test_shows_signatures_if_it_is_told_that_frames_have_them(self):
        signed = [(name, int(use), bytes.fromhex(wire), bytes.fromhex(covered), int(counter),
                   mac.replace(" ", "").lower()[:8])
                  for name, _, use, _, wire, covered, counter, mac, verdict in rows("signed.txt")
                  if verdict == "ok"]
        names = ["verdict", "opcode", "message", "counter", "hello_number", "mac", "server_nonce", "group_key",
                 "group_counter", "payload", "text", "turn"]
        packets = [(0, i, INBOUND, wire, 0) for i, (_, _, wire, *_) in enumerate(signed)]
        fields = ["pheromone." + name for name in names]
        found = self.dissect(packets, fields, "-o", "pheromone.signed:TRUE")
        self.assertGreater(len(signed), 20)
        for (name, use, _, covered, counter, mac), columns in zip(signed, found):
            added = {"mac": [mac]}
            if use == 5:
                added |= {"server_nonce": [covered[4:12].hex()], "group_key": [covered[12:28].hex()],
                          "group_counter": [str(int.from_bytes(covered[-4:], "little"))]}
            elif use == 4:
                added["hello_number"] = [str(counter)]
            else:
                added["counter"] = [str(counter % (65536 if use == 3 else 256))]
            if covered[1] == 0x45:
                added["text"] = [covered[8:].hex()]
            if covered[1] == 0xF3:
                added["turn"] = [str(it) for it in covered[8 + 4 * (covered[7] % 16):]]
            with self.subTest(name):
                shown = {key: values for key, values in zip(names, columns) if values}
                self.assertEqual(shown.pop("message") == ["GREETING"], use == 5)
                self.assertEqual(shown.pop("verdict")[-1], "ok")  # a damaged beginning is restarted
                self.assertEqual(shown, {"opcode": [f"0x{covered[1]:02x}"],
                                         **{key: it for key, it in added.items() if it}})

    def test_lengths_are_judged_without_signatures(self):
        chosen = {row[0]: bytes.fromhex(row[4]) for row in rows("signed.txt") if row[4] != "-"}
        unsigned = ["unsigned_sense", "unsigned_ping", "unsigned_hello", "unsigned_halt_to_all"]
        packets = [(0, i, INBOUND, chosen[name], 0)
                   for i, name in enumerate(["sense", "hello", *unsigned])]
        for preference, expected in (("TRUE", ["ok"] * 2 + ["bad-length"] * 4),
                                     ("FALSE", ["bad-length"] * 2 + ["ok"] * 4)):
            found = self.dissect(packets, ["pheromone.verdict"], "-o",
                                 f"pheromone.signed:{preference}")
            self.assertEqual([it for [[it]] in found], expected)

    def test_reads_udp_that_was_captured_by_other_means(self):
        frame = bytes.fromhex("10 02 07 01 E8 03 F4 01 00 00 61 FE 10 03")
        address = bytes([127, 0, 0, 1])
        datagram = struct.pack(">HHHH", 40000, 4951, 8 + len(frame), 0) + frame
        packet = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(datagram), 0, 0, 64, 17, 0) + \
            address + address + datagram
        self.file.write_bytes(
            block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1)) +
            block(1, struct.pack("<HHI", LINKTYPE_RAW, 0, 0)) +
            block(6, struct.pack("<IIIII", 0, 0, 0, len(packet), len(packet)) + packet))
        result = subprocess.run([TSHARK, "-r", self.file, "-X",
                                 f"lua_script:{HERE / 'pheromone.lua'}", "-d",
                                 "udp.port==4951,pheromone", "-T", "fields", "-e",
                                 "pheromone.message", "-e", "pheromone.x"],
                                capture_output=True, text=True, check=True)
        self.assertEqual(result.stdout.split(), ["SENSE", "1000"])

    def test_a_silence_longer_than_the_timeout_ends_a_frame(self):
        frame = bytes.fromhex("10 02 07 01 E8 03 F4 01 00 00 61 FE 10 03")
        packets = [(0, 0, INBOUND, frame[:6], 0), (0, 0, INBOUND, frame[6:], 21_000_000)]
        self.assertEqual(self.dissect(packets, ["pheromone.verdict"]), [[[]], [["ok"]]])
        found = self.dissect(packets, ["pheromone.verdict"], "-o", "pheromone.gap_timeout_ms:20")
        self.assertEqual(found, [[[]], [["timed-out"]]])

    def test_flags_what_is_damaged_and_what_is_malformed(self):
        damaged = [(name, bytes.fromhex(wire), verdict) for name, _, wire, verdict
                   in rows("frames.txt") if verdict != "ok"]
        found = self.dissect([(0, i, INBOUND, wire, 0) for i, (_, wire, _) in enumerate(damaged)],
                             ["_ws.expert.message"])
        for (name, _, verdict), [messages] in zip(damaged, found):
            with self.subTest(name):
                self.assertIn(verdict, messages)


def main():
    global TSHARK
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tshark", default=TSHARK)
    arguments, rest = parser.parse_known_args()
    TSHARK = arguments.tshark
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
