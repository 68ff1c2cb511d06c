"""Reads MCAP files record by record, from what https://mcap.dev/spec says alone, and checks all that
the format says twice: lengths, checksums, indexes, statistics.

    file = read_mcap(path)
    for message in file.messages: ...      # (topic, time_ns, bytes), in the order of the file
"""

import binascii
import struct
from collections import Counter, namedtuple

from checks import check

MAGIC = b"\x89MCAP0\r\n"
Message = namedtuple("Message", "topic time_ns data")
File = namedtuple("File", "messages schemas encodings chunks profile")


class Fields:
    def __init__(self, data):
        self.data = data
        self.at = 0

    def take(self, layout):
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values[0] if len(values) == 1 else values

    def bytes(self, layout="I"):
        size = self.take(layout)
        check(self.at + size <= len(self.data), "a length beyond the record's end")
        self.at += size
        return self.data[self.at - size:self.at]

    def text(self):
        return self.bytes().decode()

    def pairs(self, layout):
        return dict(struct.iter_unpack("<" + layout, self.bytes()))


def records(data, begin, end):
    """(place, opcode, content) of each."""
    at = begin
    while at < end:
        opcode, size = struct.unpack_from("<BQ", data, at)
        check(at + 9 + size <= end, f"the record at {at} is longer than what it is in")
        yield at, opcode, data[at + 9:at + 9 + size]
        at += 9 + size


def read_mcap(path):
    data = path.read_bytes()
    check(data.startswith(MAGIC) and data.endswith(MAGIC), "no magic")
    footer_at = len(data) - len(MAGIC) - 9 - 20
    footer = Fields(data[footer_at:])
    check(footer.take("BQ") == (2, 20), "no footer")
    summary, offsets, crc = footer.take("QQI")
    check(crc == binascii.crc32(data[summary:footer_at + 9 + 16]), "the summary's checksum")

    schemas, channels, messages, chunks, indexes = {}, {}, [], {}, {}

    def define(opcode, fields, schemas, channels):
        number = fields.take("H")
        if opcode == 3:
            schemas[number] = (fields.text(), fields.text(), fields.bytes())
        else:
            channels[number] = (fields.take("H"), fields.text(), fields.text(), fields.pairs("II"))

    def chunk(at, fields):
        first, last, size, crc = fields.take("QQQI")
        check(fields.text() == "", "compressed")
        content = fields.bytes("Q")
        check(len(content) == size and binascii.crc32(content) == crc, "a chunk's checksum")
        places = {}
        for place, opcode, inner in records(content, 0, len(content)):
            inner = Fields(inner)
            if opcode != 5:
                check(opcode in (3, 4), f"record {opcode} in a chunk")
                define(opcode, inner, schemas, channels)
                continue
            channel, _, time_ns, _ = inner.take("HIQQ")
            check(first <= time_ns <= last, "a message outside of its chunk's time")
            places.setdefault(channel, []).append((time_ns, place))
            messages.append(Message(channels[channel][1], time_ns, inner.data[inner.at:]))
        chunks[at] = (first, last, places, size)

    ended = False
    current = None
    profile = None
    for at, opcode, content in records(data, len(MAGIC), summary):
        fields = Fields(content)
        check(not ended, "records after the end of data")
        if opcode == 6:
            current = at
            chunk(at, fields)
            indexes[current] = {}
        elif opcode == 7:
            channel = fields.take("H")
            entries = list(struct.iter_unpack("<QQ", fields.bytes()))
            check(entries == chunks[current][2][channel], "an index of messages")
            indexes[current][channel] = at
        elif opcode == 15:
            check(fields.take("I") == binascii.crc32(data[:at]), "the checksum of the data")
            ended = True
        else:
            check((opcode, at) == (1, len(MAGIC)), f"record {opcode} in the data")
            profile = fields.text()
    check(ended, "no end of data")

    again_schemas, again_channels, listed, groups = {}, {}, {}, {}
    for at, opcode, content in records(data, summary, offsets):
        fields = Fields(content)
        groups.setdefault(opcode, [at, 0])[1] = at + 9 + len(content)
        if opcode in (3, 4):
            define(opcode, fields, again_schemas, again_channels)
        elif opcode == 11:
            totals = fields.take("QHIIIIQQ")
            check(fields.pairs("HQ") == Counter(
                number for it in chunks.values() for number, places in it[2].items()
                for _ in places), "the statistics of channels")
            times = [it.time_ns for it in messages]
            check(totals == (len(messages), len(schemas), len(channels), 0, 0, len(chunks),
                             min(times, default=0), max(times, default=0)), f"statistics {totals}")
        elif opcode == 8:
            first, last, place, size = fields.take("QQQQ")
            listed[place] = fields.pairs("HQ")
            fields.take("Q")
            check(fields.text() == "" and fields.take("QQ") == (chunks[place][3],) * 2 and
                  (first, last) == chunks[place][:2] and
                  struct.unpack_from("<BQ", data, place) == (6, size - 9), "an index of a chunk")
    check((again_schemas, again_channels) == (schemas, channels), "what the summary repeats")
    check(listed == indexes, "the indexes of chunks")
    found = {}
    for _, opcode, content in records(data, offsets, footer_at):
        check(opcode == 14, "a record among the summary's offsets")
        group, begin, size = Fields(content).take("BQQ")
        found[group] = [begin, begin + size]
    check(found == groups, "the summary's offsets")
    by_topic = {topic: (schemas[schema] if schema else ("", "", b""))
                for schema, topic, _, _ in channels.values()}
    return File(messages, by_topic, {it[1]: it[2] for it in channels.values()}, len(chunks),
                profile)
