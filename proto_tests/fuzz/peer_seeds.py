"""Seeds of peer_wire_fuzzer.cc: what the daemons of a cluster tell each other, as
server/cluster/peer_wire.h describes it, without any of its code."""

import struct

COMMAND_ARGUMENTS = 5  # bytes, of whatever command


def text(value):
    return struct.pack("<I", len(value)) + value


def texts(*values):
    return struct.pack("<I", len(values)) + b"".join(text(value) for value in values)


def frame(kind, *fields):
    body = bytes([kind]) + b"".join(fields)
    return struct.pack("<I", len(body)) + body


def greeting(peers=3, events=4, rest=None):
    known = text(b"lab") + text(b"a") + text(b"1f") + struct.pack("<QQ", 7, 9)
    return frame(0, bytes([peers, events]), text(b"0.1.0"), known if rest is None else rest)


def message(link, robot, opcode, data):
    return struct.pack("<HBBB", link, robot, opcode, len(data)) + data


def changes():
    """(name, index, fields) of each change of an operator."""
    stroke = struct.pack("<BBBIqI", 1, 1, 1, 64, 100_000, 2)
    points = struct.pack("<4q", 1_000_000, -2_000_000, 3_000_000, 4_000_000)
    yield "edited", 0, stroke + points + struct.pack("<Q", 0)
    yield "reversed", 1, b"\1"
    yield "command", 2, struct.pack("<HBB", 0, 5, 4) + bytes(COMMAND_ARGUMENTS)
    yield "goal", 3, struct.pack("<HBqqI", 0, 5, 1, 2, 100_000)
    yield "goal_cancelled", 4, struct.pack("<HB", 0, 5)
    yield "erased", 5, struct.pack("<BHBB", 1, 3, 2, 0)
    yield "net", 6, text(b"trails")
    yield "revoked", 7, struct.pack("<IB", 1, 8) + bytes(range(8))
    yield "tau", 8, struct.pack("<Bq", 1, 30_000)
    yield "reload", 9, b""


def messages():
    """(name, frame), good ones, of each type."""
    yield "greeting", greeting()
    yield "beat", frame(1, struct.pack("<Q??Q", 3, True, True, 1201), text(b"b"),
                        struct.pack("<QQ", 1180, 1 << 60))
    yield "request", frame(2, message(0, 5, 0x31, bytes(7)))
    yield "answer", frame(3, message(0, 5, 0xFE, bytes([0x31, 7, 1])))
    yield "observed", frame(4, b"\0", struct.pack("<HBqqHI", 0, 5, 1, 2, 3, 1000))
    yield "arrived", frame(4, b"\1", struct.pack("<HB?qq", 0, 5, True, 1, 2))
    for name, index, fields in changes():
        yield name, frame(5, struct.pack("<QB", 6, index), fields)
    yield "result", frame(6, struct.pack("<Q?", 6, True), text(b""),
                          struct.pack("<qQQ", 9, 8, 7),
                          struct.pack("<Qq?BBB", 7, -1, False, 1, 0, 2),
                          texts(b"changed links require a restart"))
    yield "halt", frame(7)
    yield "poses", frame(8, struct.pack("<I", 2), struct.pack("<HBiiHI", 0, 5, -1, 2, 3, 40) * 2)
    yield "asks", frame(9, struct.pack("<QQ", 1, 65536))
    yield "portion", frame(10, struct.pack("<QQ?", 1, 65536, True), text(bytes(99)), text(b""))


def seeds():
    """(name, input of the fuzzer): how many bytes come at once, less one; then the stream."""
    good = dict(messages())
    for name, it in good.items():
        yield name, b"\xFF" + it
    yield "session", b"\x1F" + b"".join(good.values())
    yield "bytewise", b"\0" + b"".join(good.values())
    yield "later_version", b"\xFF" + greeting(peers=4, rest=b"what is not known yet")
    yield "later_events", b"\xFF" + greeting(events=5)
    yield "bad_empty", b"\xFF" + struct.pack("<I", 0)
    yield "bad_long", b"\xFF" + struct.pack("<I", 1 << 17 | 1) + bytes(64)
    yield "bad_type", b"\xFF" + frame(11)
    yield "bad_cut", b"\xFF" + frame(1, bytes(17))
    yield "bad_longer", b"\xFF" + frame(9, bytes(17))
    yield "bad_list", b"\xFF" + frame(8, struct.pack("<I", 0xFFFFFFFF))
