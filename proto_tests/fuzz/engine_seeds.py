"""Seeds for engine_fuzzer.cc and codec_fuzzer.cc: small sessions with a server, and what an engine
keeps in files, good and bad. Written from the head of the former, and from the tables in
server/store/journal/README.md, without any of the code that they are for.
"""

import struct

HELLO, EVENT, COMMAND_ACK, PING = 0x71, 0x52, 0x51, 0x72
SENSE, DEPOSIT, TRACE, TRACE_WIDE = 0x00, 0x20, 0x30, 0x60
SMALL, RICH, TIGHT = b"\0", b"\1", b"\3"


# --- Sessions.

def message(robot, opcode, data=b"", pause=1):
    return bytes([pause, len(data), robot, opcode]) + data


def hello(robot, nonce=1, pause=1):
    return message(robot, HELLO, struct.pack("<HBB", nonce, 1, 0), pause)


def deposit(robot, seq, x, y, quanta=1, kind=1, pause=1):
    return message(robot, DEPOSIT | kind, struct.pack("<BhhB", seq, x, y, quanta), pause)


def trace(robot, seq, x, y, heading=0, kind=1):
    return message(robot, TRACE | kind, struct.pack("<BhhH", seq, x, y, heading))


def sense(robot, x, y, heading=0, kind=1):
    return message(robot, SENSE | kind, struct.pack("<hhH", x, y, heading))


def event(robot, seq, code):
    return message(robot, EVENT, struct.pack("<BBh", seq, code, 5))


def acknowledged(robot, seq, code, result=0):
    return message(robot, COMMAND_ACK, struct.pack("<BBh", seq, code, result))


def far(number, shift=0):
    return struct.pack("<iB", number, shift)


FARTHEST = far(-2**31, 30)


def other(kind, data=b"", pause=1):
    return bytes([pause, 240 + kind]) + data


def reconfigured(what, which=0, data=b""):
    return other(0, bytes([what, which]) + data)


def command(link, robot, code, pause=1):
    return other(1, bytes([link, robot, code, 1, 2]), pause)


def observed(link, robot, x, y, valid_ms=60_000):
    return other(2, bytes([link, robot]) + x + y + struct.pack("<HI", 8192, valid_ms))


def edit(kind, shape, action, level, radius, *points, continues=False):
    head = struct.pack("<BBBI", kind, shape, action, level) + radius
    return other(3, head + bytes([len(points) + 128 * continues]) + b"".join(x + y for x, y in points))


UNDO, REDO = (other(3, bytes(12) + bytes([it])) for it in (253, 254))


def clocks(boottime, utc=far(0)):
    return other(4, boottime + utc)


def log(mood):
    return other(5, bytes([mood]))


def goal(link, robot, tolerance, x=b"", y=b""):
    return other(8, struct.pack("<BBI", link, robot, tolerance) + x + y)


ROBOT_IS, INT_IS = -17, -3  # namespaces


def tag_write(robot, seq, tag, x, y, slot=255, flags=0, expected=0, lease_s=0, block=None):
    words = block or (ROBOT_IS, robot, 1, 2, INT_IS, seq)
    return message(robot, 0x43, struct.pack("<BiiHBBHHI6i", seq, x, y, tag, slot, flags, expected,
                                            lease_s, 0, *words))


def tag_erase(robot, seq, tag, x, y, slot, flags=0, expected=0):
    return message(robot, 0x44, struct.pack("<BiiHBBH", seq, x, y, tag, slot, flags, expected))


def symbol(robot, seq, kind, number, text=b""):
    return message(robot, 0x45, struct.pack("<BBi", seq, kind, number) + text)


def tags_asked(robot, x, y):
    return (message(robot, 0x41, struct.pack("<iiH", x, y, 0)) + b"".join(
        message(robot, 0x42, struct.pack("<iiHB", x, y, tag, 0)) for tag in range(5)) + b"".join(
            message(robot, 0x46, struct.pack("<BiiB", kind, 1, number, 0))
            for kind in range(6) for number in range(3)))


def tags_changed(kind, row=(1, 1, 1, 4), tag=1, slot=255, lease_ms=0,
                 block=(1, 5, -17, 1, 1, 2, -3, 4)):
    """0: a block is written; 1: erased; 2: a row is defined; 3: a robot's are forgotten."""
    head = struct.pack("<BBBB", kind, tag, slot, slot != 255)
    if kind == 0:
        return other(9, head + struct.pack("<I", lease_ms) + struct.pack("<iI6i", *block))
    row_kind, robot, number, length = row
    return other(9, head + (struct.pack("<BiiBB", row_kind, robot, number, length, ord("x"))
                            if kind == 2 else bytes([robot]) if kind == 3 else b""))


def crc16(data):
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


NET_HASH = 0x1234  # of the net in server/core/engine/testing/random_tags.h, on tags 4 to 6
PRESENT, PASS, LEAVE, CHOOSE_A, _, STORE_A, _, TAKE = range(1, 9)


def record(robot, seq, tag, x, y, net_seq, action, amount=9, net=NET_HASH, slot=255):
    """What a robot leaves for a net; after it, the next instant has come."""
    checked = struct.pack("<BBIBBBxHH4x", 1, 3, net, net_seq, action, 1, amount, 0)
    whole = struct.pack("<i", -32) + checked + struct.pack("<H", crc16(checked))
    return tag_write(robot, seq, tag, x, y, slot=slot, lease_s=60,
                     block=struct.unpack("<6i", whole)) + clocks(far(250))


def net_reset(is_known=True):
    return other(10, bytes([not is_known]))


def keys_revoked(*keys):
    """Each a robot and the first byte of a fingerprint."""
    return other(11, bytes([len(keys)]) + b"".join(bytes(it) for it in keys))


RESTARTED = other(6, far(1000, 2) + b"\0")


def damaged(cut=0, *changes):
    at = b"".join(struct.pack("<IB", offset, byte) for offset, byte in changes)
    return other(7, bytes([len(changes)]) + at + struct.pack("<H", cut))


def sessions():
    """(name, session)."""
    near, across = (far(1_000_000), far(1_000_000)), (far(2_000_000), far(1_500_000))
    two = hello(1) + hello(2)
    yield "requests", RICH + two + b"".join(
        deposit(1, 3 * kind, 400, 400, 2, kind) + trace(1, 3 * kind + 1, 430, 400, 0, kind) +
        sense(1, 390, 400, 0, kind) for kind in range(1, 8))
    yield "sequence", (
        SMALL + deposit(1, 1, 5000, 5000) + hello(1) + hello(1) + deposit(1, 1, 5000, 5000) +
        deposit(1, 1, 5000, 5000) + deposit(1, 1, 5000, 5100) + deposit(1, 200, 5000, 5000) +
        deposit(1, 2, 5000, 5000, 0) + hello(1, 2) + hello(1, 1) + deposit(1, 9, 5000, 5000))
    yield "many_robots", SMALL + b"".join(hello(robot) for robot in (2, 4, 6, 8, 2, 10))
    yield "map_full", SMALL + hello(1) + b"".join(
        deposit(1, seq, 900 * seq, 900 * seq, 255, 1 + seq % 2) for seq in range(1, 11))
    yield "blocked", RICH + hello(2) + deposit(2, 1, 4990, 5990) + b"".join(
        deposit(2, seq, -600 + 20 * seq, 1200) for seq in range(2, 40, 6))
    yield "narrow_and_wide", SMALL + hello(1) + message(
        1, TRACE_WIDE | 1, struct.pack("<BiiH", 1, 5000, 2**31 - 1, 0)) + message(
        1, 0x11, struct.pack("<iiH", -2**31, 5000, 0)) + message(1, PING, bytes(16))
    yield "nobody", SMALL + message(0, HELLO) + message(255, HELLO) + message(7, 0x40) + message(
        7, HELLO) + message(7, 0xF1) + message(7, 0x01, bytes(64)) + message(7, 0, b"")
    near_tags = (600, 600)
    yield "tags", (
        RICH + two + symbol(1, 1, 1, 1, b"robot 1") + symbol(2, 1, 1, 0, b"robot 2") +
        symbol(1, 2, 2, 2, b"cleaning") + symbol(2, 2, 3, 1) + tag_write(1, 3, 1, *near_tags) +
        tag_write(1, 3, 1, *near_tags) + tag_write(2, 3, 1, *near_tags, flags=2, expected=0) +
        tag_write(2, 4, 1, *near_tags, flags=2, expected=1, lease_s=2) + tags_asked(1, *near_tags) +
        tag_erase(1, 4, 1, *near_tags, slot=1) + b"".join(
            tag_write(1, seq, 2, *near_tags) for seq in range(5, 9)) + RESTARTED +
        tag_erase(2, 5, 1, *near_tags, slot=1) + tags_asked(3, 5000, 5000))
    yield "net", (
        RICH + hello(1) + symbol(1, 1, 1, 0, b"one") + record(1, 2, 4, *near_tags, 1, PRESENT) +
        record(1, 3, 4, *near_tags, 2, PASS) + record(1, 4, 6, *near_tags, 3, TAKE) +
        record(1, 5, 6, *near_tags, 4, STORE_A) + record(1, 6, 6, *near_tags, 4, STORE_A) +
        record(1, 7, 6, *near_tags, 5, CHOOSE_A) + RESTARTED +
        record(1, 8, 5, *near_tags, 6, LEAVE) + clocks(far(9, 10)))
    yield "net_refuses", (
        RICH + hello(1) + symbol(1, 1, 1, 0, b"one") + record(1, 2, 5, *near_tags, 1, LEAVE) +
        record(1, 3, 4, *near_tags, 2, PASS) + record(1, 4, 6, *near_tags, 3, 99) +
        record(1, 5, 6, *near_tags, 4, TAKE, net=7) + tag_write(
            1, 6, 6, *near_tags, block=(-32, 0, 1, 2, 3, 4)) + clocks(far(250)) +
        record(1, 7, 4, *near_tags, 2, PASS, slot=1) + net_reset(False) + net_reset() +
        clocks(far(250)) + RESTARTED)
    yield "tags_of_operators", (
        RICH + tags_changed(2) + tags_changed(2, (2, 1, 2, 9)) + tags_changed(0) +
        tags_changed(0, slot=3, lease_ms=900) + tags_changed(1, slot=0) + tags_changed(0, tag=9) + tags_changed(3, (0, 0, 0, 0)) +
        tags_changed(0, block=(9, 0, -17, 1, 1, 2, -3, 4)) + clocks(far(2000)) + RESTARTED)
    yield "events", SMALL + hello(1) + b"".join(event(1, code + 1, code) for code in range(14))
    yield "strong", SMALL + reconfigured(1, 1, b"\xff\xff") + hello(2) + b"".join(
        deposit(2, seq, 5000 + 100 * seq, 5300, 255, 2) for seq in range(1, 9)) + sense(
            2, 5000, 5000, 0, 2) + sense(2, 5000, 5600, 0, 2)
    yield "commands", (
        SMALL + two + command(0, 2, 3) + acknowledged(2, 9, 3) + acknowledged(2, 0, 3) +
        command(0, 2, 9) + acknowledged(2, 1, 9, -4) + command(1, 1, 1) + command(2, 1, 1) +
        command(0, 2, 200) + command(0, 255, 3) + command(0, 4, 1) + command(0, 255, 1) +
        6 * message(2, PING, pause=5) + command(0, 2, 6) + hello(2, 8))
    yield "unanswered", SMALL + hello(2) + command(0, 2, 5) + 9 * message(2, PING, pause=20)
    yield "seen", (
        SMALL + two + observed(1, 1, *near) + observed(0, 9, *near) + observed(2, 1, *near) +
        deposit(1, 1, 0, 0) +
        trace(1, 2, 0, 0) + observed(0, 2, FARTHEST, FARTHEST) + trace(2, 1, 0, 0) +
        observed(0, 2, *near, 0) + hello(2, 5) + trace(2, 1, 5000, 5000))
    yield "goals", (
        SMALL + two + goal(0, 1, 100_000, *near) + sense(1, 5000, 5000) + goal(1, 1, 9, *near) +
        goal(0, 9, 100_000, *near) + goal(0, 1, 9, *near) + goal(0, 1, 0) +
        goal(0, 1, 100_000, FARTHEST, FARTHEST) + goal(0, 1, 100_000, *near) +
        sense(1, 3000, 1000, 9) + trace(1, 2, 1000, 3000) + RESTARTED + trace(1, 3, 1000, 1500) +
        damaged(1) + b"".join(damaged(0, (offset, 255)) for offset in range(200, 900, 31)) +
        sense(1, 1050, 1000) + goal(0, 1, 0) + goal(0, 1, 100_000, *near) + goal(0, 1, 0) +
        goal(0, 1, 100_000, *across) + log(0) + goal(0, 1, 100_000, *near) + goal(0, 1, 0) + log(1))
    yield "goal_blocked", RICH + hello(2) + sense(2, 1000, 500) + b"".join(
        goal(0, 2, 50_000, far(100_000 * x), far(100_000 * y)) + sense(2, 1000, 500)
        for x in range(0, 60, 7) for y in range(0, 60, 7))
    yield "edits", RICH + b"".join([
        edit(1, 0, 0, 64, far(0), near, across), edit(2, 1, 1, 64, far(90_000), near, across),
        edit(3, 1, 0, 64, far(50_000), near), edit(1, 2, 2, 0, far(0)), edit(3, 2, 2, 0, far(0)),
        edit(9, 0, 0, 1, far(0), near, across), edit(4, 0, 0, 1, far(0), near, across),
        edit(1, 0, 0, 9_999_999, far(0), near, across), edit(1, 3, 0, 1, far(0)),
        edit(1, 0, 0, 1, far(0), (FARTHEST, far(0)), near), edit(1, 1, 0, 1, far(-1), near),
        edit(1, 1, 0, 1, far(2**30, 3), near), edit(1, 0, 0, 1, far(0)),
        edit(1, 1, 0, 1, far(0), near, (far(2**30, 2), far(2**30, 2))),
        other(3, struct.pack("<BBBI", 1, 1, 0, 1) + far(0) + b"\xff")])
    undone = [UNDO, REDO, deposit(2, 1, 1000, 1000, 2), UNDO, UNDO, REDO]
    yield "undone", RICH + hello(2) + b"".join([
        UNDO, REDO, edit(1, 0, 0, 64, far(0), near, across), *undone,
        edit(2, 1, 1, 64, far(90_000), near, across),
        edit(2, 1, 1, 64, far(90_000), across, continues=True), *undone,
        edit(3, 1, 0, 64, far(50_000), near), edit(1, 2, 2, 0, far(0)), edit(3, 2, 2, 0, far(0)),
        *undone, RESTARTED, UNDO, UNDO, reconfigured(0, 0, far(9_000)), *undone,
        reconfigured(11, 1, struct.pack("<hhI", 3, 4, 640)), *undone, reconfigured(5, 0),
        reconfigured(12, 0, b"\0\1"), *undone, damaged(1)])
    yield "undone_tight", TIGHT + hello(2) + b"".join([
        edit(1, 0, 0, 64, far(0), near, across), edit(1, 2, 0, 64, far(0)), UNDO,
        edit(1, 1, 0, 64, far(0), near), edit(1, 1, 2, 64, far(0), near), *undone])
    yield "edit_full", TIGHT + edit(1, 0, 0, 64, far(0), (far(0), far(0)), (far(4_000_000),) * 2)
    yield "laws", RICH + two + trace(1, 1, 400, 400) + b"".join([
        reconfigured(0, 0, far(9_000)), reconfigured(1, 2, b"\x04\0"), reconfigured(2, 1 + 32),
        reconfigured(3, 2, struct.pack("<HHIH", 0, 100, 0, 0)), trace(1, 2, 400, 400),
        reconfigured(4, 1, struct.pack("<Bi", 2, 500)), reconfigured(5, 3), reconfigured(5, 0),
        reconfigured(12, 0, b"\0\0"), reconfigured(14, 16, far(0) + far(40_000) + far(99_000)),
        reconfigured(15)])
    yield "places", RICH + two + b"".join([
        reconfigured(6, 0, far(50_000)), reconfigured(7, 0, far(50_000) + far(9_000) + b"\0\x20"),
        reconfigured(7, 0, FARTHEST),
        trace(1, 1, 400, 400), reconfigured(8, 0), deposit(1, 1, 400, 400), reconfigured(8, 2),
        reconfigured(10, 2, struct.pack("<H", 3) + 2 * far(900_000) + 2 * far(2_000_000)),
        reconfigured(11, 1, struct.pack("<hhI", 3, 4, 640)), reconfigured(13, 9, b"\x64\0"),
        reconfigured(15 + 128)])
    turned = struct.pack("<H", 9_000)
    yield "frames", SMALL + b"".join([
        reconfigured(9, 2, far(1) + far(2) + turned + b"\0"), hello(2), trace(2, 1, 500, 500),
        reconfigured(9, 2, far(1) + far(2) + turned + b"\0"), reconfigured(9, 0),
        reconfigured(9, 4, FARTHEST + far(2) + turned + b"\0"),
        reconfigured(9, 4, far(1) + far(2) + turned + b"\7"), reconfigured(6, 0, far(50_000))])
    yield "clocks", (
        SMALL + hello(1) + deposit(1, 1, 5000, 5000, 8, pause=15) + clocks(far(-1_000)) +
        clocks(far(2**30, 3)) + sense(1, 5000, 4900) + clocks(far(2**30, 12)) +
        deposit(1, 2, 5000, 5000, 8) + clocks(FARTHEST, FARTHEST) + trace(1, 3, 5000, 5000) +
        RESTARTED + trace(1, 4, 5000, 5000))
    yield "clock_wraps", (
        SMALL + hello(1, pause=20) + clocks(far(-5_000)) + clocks(far(-4_000)) +
        deposit(1, 1, 9, 9))
    yield "log_refuses", SMALL + b"".join([
        hello(1), deposit(1, 1, 5000, 5000), log(0), deposit(1, 2, 5000, 5000, pause=90),
        command(0, 1, 1), command(1, 1, 1), edit(1, 0, 0, 64, far(0), near, across),
        observed(1, 1, *near), reconfigured(0, 0, far(9_000)), log(1), deposit(1, 2, 1, 1)])
    yield "log_lags", (
        SMALL + hello(1) + log(9) + deposit(1, 1, 5000, 5000) + command(1, 1, 1) + log(9) +
        deposit(1, 2, 5000, 5000) + deposit(1, 2, 5000, 5000) + log(1) + sense(1, 5000, 5000))
    yield "log_rotates", SMALL + log(5) + hello(1) + 3 * deposit(1, 1, 1, 1) + trace(1, 2, 50, 50)
    yield "restarts", (
        RICH + two + b"".join(deposit(2, kind, 400, 400, 2, kind) for kind in range(1, 8)) +
        trace(2, 8, 400, 400) + event(2, 9, 3) + command(0, 2, 1) + command(0, 255, 1) +
        observed(0, 2, *near) + hello(2, 3) + RESTARTED + message(2, PING, pause=20) +
        reconfigured(8, 0) + RESTARTED + trace(2, 10, 400, 400) + other(6, far(-9, 2) + b"\1"))
    yield "revoked", (
        SMALL + two + keys_revoked((2, 9), (1, 9)) + keys_revoked((2, 9), (2, 8), (2, 8)) +
        keys_revoked() + keys_revoked((0, 1)) + keys_revoked((255, 1)) + hello(2) + RESTARTED +
        keys_revoked((1, 8)) + b"".join(damaged(0, (offset, 255)) for offset in range(150, 350, 9)))
    yield "damaged", (
        RICH + two + command(0, 2, 1) + command(0, 255, 1) + observed(0, 2, *near) + damaged(1) +
        damaged(0, (0, 9)) + b"".join(damaged(cut) for cut in range(40, 1800, 160)) +
        b"".join(damaged(0, (offset, 255)) for offset in range(1, 1800, 61)))


# --- What stands in files.

VERSION = b"\4"  # of events and states


def logged(kind, data):
    """An event."""
    return VERSION + bytes([kind]) + data


def text(value):
    return struct.pack("<I", len(value)) + value


def many(*items):
    return struct.pack("<I", len(items)) + b"".join(items)


def law(kind=1, name=b"trail", profile=0, core=100_000, sigma=400_000, cutoff=0, evaporation=0,
        tau=30_000, quantum=125_000, most=8, directional=1, weight=1000,
        diffusion=(0, 100, 0, 0), blend=()):
    return (bytes([kind]) + text(name) +
            struct.pack("<BqqqBqqHBi4I", profile, core, sigma, cutoff, evaporation, tau, quantum,
                        most, directional, weight, *diffusion) +
            many(*(struct.pack("<Bi", *part) for part in blend)))


def path(kind, *points, count=1, closed=0):
    return struct.pack("<BHB", kind, count, closed) + many(
        *(struct.pack("<qq", *point) for point in points))


def walls(columns, rows, *blocks):
    return struct.pack("<Bii", 1, columns, rows) + many(
        *(struct.pack("<ii64Q", column, row, *(list(words) + 64 * [0])[:64])
          for column, row, words in blocks))


def frame(robot=1, x=0, y=0, heading=16384, cos=0, sin=2**30):
    return text(b"radio-a") + struct.pack("<BqqHii", robot, x, y, heading, cos, sin)


def config(box=(0, 0, 2_000_000, 1_500_000, 100_000), antennas=(330_000, 0, 16384), laws=None,
           paths=(), prints=(), obstacles=b"\0", memory=1 << 20, unit=100,
           links=(b"radio-a", b"radio-b"), frames=(), tags=(), privileged=()):
    return (struct.pack("<5q", *box) + struct.pack("<qqH", *antennas) +
            many(*([law(), law(2, b"path", tau=0)] if laws is None else laws)) + many(*paths) +
            many(*prints) + obstacles + struct.pack("<QH", memory, unit) +
            many(*(text(link) + b"\3\x28" for link in links)) + many(*frames) +
            many(*tags) + many(*privileged) + many())


def configs():
    """(name, configuration): good ones, and for each thing that can be wrong one that has it."""
    print_of = struct.pack("<BBIiiI", 1, 1, 1, 3, 4, 64)
    yield "plain", config()
    yield "rich", config(
        laws=[law(1, evaporation=1), law(2, profile=1, cutoff=900_000, evaporation=2),
              law(3, evaporation=2, diffusion=(8_000, 100, 0xFF00_0000, 512)),
              law(4, blend=[(1, 700), (3, -400)])],
        paths=[path(2, (0, 0), (400_000, 100_000), closed=1)], prints=[print_of, b"\2\0"],
        obstacles=walls(21, 16, (0, 0, [1, 0b110, 1 << 20])), frames=[frame()])
    yield "blend_of_anything", config(laws=[law(), law(
        2, core=2**63 - 1, sigma=2**63 - 1, tau=-1, quantum=-2**63, most=0, weight=-2**31,
        diffusion=(2**32 - 1,) * 4, blend=[(1, 1)])])
    yield "tag", config(tags=[text(b"door") + struct.pack("<qqqB", 1, 2, 3, 8)], privileged=[text(b"ann")])
    yield "no_map", config(box=(0, 0, 2_000_000, 1_500_000, 0))
    yield "large_map", config(box=(0, 0, 10**12, 10**12, 1))
    yield "far_antennas", config(antennas=(-1, 0, 0))
    yield "profile", config(laws=[law(profile=2)])
    yield "evaporation", config(laws=[law(evaporation=3)])
    yield "flag", config(laws=[law(directional=2)])
    yield "type_0", config(laws=[law(0)])
    yield "type_twice", config(laws=[law(), law()])
    yield "no_sigma", config(laws=[law(sigma=0)])
    yield "far_reach", config(box=(0, 0, 2_000_000, 1_500_000, 1_000), laws=[law(sigma=40_000_000)])
    yield "fast_diffusion", config(laws=[law(diffusion=(65_536, 0, 0, 0))])
    yield "blend_of_none", config(laws=[law(), law(2, blend=[(3, 1)])])
    yield "path_off_the_map", config(paths=[path(1, (-1, 0))])
    yield "print_off_the_map", config(prints=[struct.pack("<BBIiiI", 1, 1, 1, 99, 4, 64)])
    yield "walls_elsewhere", config(obstacles=walls(9, 9))
    yield "walls_out_of_order", config(obstacles=walls(21, 16, (0, 0, [1]), (0, 0, [1])))
    yield "walls_off_the_map", config(obstacles=walls(21, 16, (0, 0, [1 << 21])))
    yield "walls_of_nothing", config(obstacles=walls(21, 16, (0, 0, [])))
    yield "walls_everywhere", config(
        box=(0, 0, 6_300_000, 6_300_000, 100_000),
        obstacles=walls(64, 64, (0, 0, 64 * [2**64 - 1])))
    yield "no_links", config(links=[])
    yield "frame_of_nobody", config(frames=[frame(0)])
    yield "frame_twice", config(frames=[frame(), frame()])
    yield "frame_far", config(frames=[frame(x=2**62)])
    yield "frame_bent", config(frames=[frame(cos=5_000_000)])


def robot(number, answer=b"\x01\xa1\x01\x01", outcome=0, code=1, sent=0, rest=b"\0\0\0"):
    """A robot of a state; `rest`: its last event, where it was seen, its goal."""
    last = bytes([1, 0, 0x21, 1, 5, 0]) + answer
    return (bytes([number]) + struct.pack("<HHB", 1, 7, 0) + last +
            struct.pack("<QQB", 2, 3, 1) + bytes([outcome, number, 0, code]) + bytes(5) +
            struct.pack("<hBQ", 0, sent, 0) + rest)


def states():
    """(name, the beginning of a state). None has its hash, so none is valid."""

    nothing = b"\0" + bytes(4) + bytes(4) + bytes(40) + bytes(8)  # of a type
    no_edits = struct.pack("<QII", 0, 0, 0)
    sweep = struct.pack("<BiQQQ", 1, 0, 0, 0, 0)
    no_changes = b"\0" + many()
    field = 15 * nothing + no_edits + sweep + no_changes

    def state(*links, broadcasts=(), revoked=(), field=field):
        no_nets, no_tags = many(), many() + many() + many()
        return (VERSION + config() + struct.pack("<HQQB", 1, 1000, 3, 0) + many(*broadcasts) +
                many(*revoked) + many(*links) + field + no_nets + no_tags + bytes(8))

    def link(name, *robots):
        return text(name) + many(*robots)

    seen = b"\1" + bytes([1, 4, 3, 5, 0]) + b"\1" + struct.pack("<qqHQ", 1, 2, 3, 4) + b"\0"
    yield "version", b"\7"
    yield "robots", state(link(b"radio-a", robot(1, outcome=1), robot(2, rest=seen)), link(b"x"))
    yield "broadcast", state(broadcasts=[struct.pack("<HBBQ", 1, 0, 2, 5)])
    yield "broadcast_ended", state(broadcasts=[struct.pack("<HBBQ", 1, 0, 0, 5)])
    yield "revoked", state(revoked=[b"\7" + bytes(8), b"\7" + bytes(7) + b"\1"])
    yield "revoked_out_of_order", state(revoked=[b"\7" + bytes(8), b"\7" + bytes(8)])
    yield "revoked_of_nobody", state(revoked=[bytes(9)])
    yield "links_out_of_order", state(link(b"b"), link(b"a"))
    yield "robots_out_of_order", state(link(b"b", robot(2), robot(2)))
    yield "command", state(link(b"b", robot(2, code=77)))
    yield "answer", state(link(b"b", robot(2, answer=b"\1\1\xff")))
    yield "no_pheromone", state()
    yield "no_sweep", state(field=15 * nothing + no_edits + bytes(29) + no_changes)
    cells = b"\1" + many(struct.pack("<IBQQ", 0, 0, 1, (64 << 42) | 500))
    node = cells + nothing[5:]
    yield "node", state(field=node + 14 * nothing + no_edits + sweep + no_changes)
    info = struct.pack("<QqBBBB", 3, 0, 0, 1, 0, 0)
    edit = struct.pack("<QII", 2, 1, 1) + info + many(b"\1" + cells)
    yield "edit", state(field=node + 14 * nothing + edit + sweep + no_changes)
    undoing = struct.pack("<QBBQQBQQqBQ", 4, 2, 1, 0, 0, 0, 16, 0, 0, 1, 0)
    yield "undoing", state(field=15 * nothing + edit + sweep + b"\0" + many(undoing))
    yield "undoing_of_nothing", state(field=15 * nothing + no_edits + sweep + b"\0" + many(undoing))


def events():
    """(name, event), of each kind, and of none."""
    point = struct.pack("<qq", 1, 2)
    for kind, data in enumerate([
            b"", b"\0\0" + bytes([1, HELLO, 4, 1, 0, 1, 0]), b"", b"\7\0\0" + config(),
            b"\0\0\1\1" + bytes(5),
            struct.pack("<BBBIq", 1, 1, 0, 64, 9) + many(point, point) + bytes(8),
            b"\0\0\1" + point + struct.pack("<HI", 3, 4),
            b"\0\0\1" + many(point) + struct.pack("<I", 10_000), b"\0\0\1\1" + point]):
        yield f"kind_{kind}", logged(kind, data)
    yield "version", b"\7\2"
    yield "longer", logged(2, b"\3")
    yield "configuration", logged(3, b"\7\0\1" + config())
    yield "tag_written", logged(9, struct.pack(
        "<BHBBBBIiI6i", 0, 1, 1, 2, 0, 0, 0, 1, 5, -17, 1, 1, 2, -3, 4))
    yield "tag_erased", logged(9, struct.pack("<BHBB", 1, 1, 2, 0))
    yield "symbol_defined", logged(9, struct.pack("<BBii", 2, 1, 1, 1) + text(b"ann"))
    yield "symbols_forgotten", logged(9, b"\3" + text(b"radio-a") + b"\1")
    yield "net_reset", logged(10, text(b"gate"))
    yield "undone", logged(11, b"\0")
    yield "redone", logged(11, b"\1")
    yield "keys_revoked", logged(12, many(b"\7" + bytes(8), b"\x08" + bytes(range(8))))
    yield "of_no_kind", logged(15, b"")
    yield "sense", logged(1, b"\0\0" + bytes([1, SENSE | 1, 6]) + bytes(6))


def codec():
    """(name, seed) for codec_fuzzer.cc."""
    for number, (what, seeds) in enumerate(
            (("event", events), ("config", configs), ("state", states))):
        for name, data in seeds():
            yield f"{what}_{name}", bytes([number]) + data
            yield f"{what}_{name}_cut", bytes([number]) + data[:len(data) * 3 // 4]
