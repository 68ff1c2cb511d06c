"""Signed frames (../README.md, section 18), for make_vectors.py: what is sent, and what a receiver that
has accepted counters up to `last` makes of it. AES and CMAC are those of python3-cryptography.
"""

from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC

from naive_protocol import body_of, coded_of, read, wire_of

CLIENT, SERVER, TO_ALL, HELLO, GREETING, SESSION_KEY, GROUP_MASK = range(1, 8)
COUNTER_BYTES = {CLIENT: 1, SERVER: 1, TO_ALL: 2, HELLO: 2, GREETING: 0}
ADDED = {use: size + 4 for use, size in COUNTER_BYTES.items()}  # bytes after DATA

KEY = bytes.fromhex("603DEB1015CA71BE2B73AEF0857D7781")  # of robot 7
OTHER_KEY = bytes.fromhex("1F352C073B6108D72D9810A30914DFF4")
GROUP = bytes.fromhex("10021003A5A5F00F0123456789ABCDEF")
GROUP_COUNTER = 0x0001FFFE
NONCE = 42  # the client's
SERVER_NONCE = bytes.fromhex("C4D01E3310F7A210")

HELLO_7 = body_of("HELLO", dict(id=7, nonce=NONCE, firmware_version=1, round_period=0))
HELLO_ANSWER_7 = body_of("HELLO_ANSWER", dict(
    id=7, nonce=NONCE, protocol_version=1, epoch=1, pose_unit_10um=100, antenna_distance_mm=300,
    type_mask=6, slot_ms=2, response_window_ms=10, last_opcode=0, last_seq=0))
POSE = dict(x=1000, y=500, heading=0)
SENSE = body_of("SENSE", dict(id=7, type=1, **POSE))
SENSE_ANSWER = body_of("SENSE_ANSWER", dict(id=7, type=1, left=4096, right=2560))
TRACE = body_of("TRACE", dict(id=7, type=1, seq=1, **POSE))
TRACE_ANSWER = body_of("TRACE_ANSWER", dict(id=7, type=1, seq=1, left=4096, right=2560))
RESUME = body_of("COMMAND", dict(id=7, seq=1, code=2))
RESUME_ACK = body_of("COMMAND_ACK", dict(id=7, seq=1, code=2, result=0))
READ_ONLY = body_of("ERROR", dict(id=7, refused_opcode=0x31, reason=8, seq=2))
PING = body_of("PING", dict(id=7, payload=""))
SYMBOL = body_of("SYMBOL", dict(id=7, seq=3, kind=2, number=1, text=b"\x10".hex() * 45))
HALT_ALL = body_of("COMMAND", dict(id=255, seq=9, code=1))


def round_of(answers, turns):
    return body_of("ROUND", dict(id=255, number=5, turn_ms=20, turn_bytes=25, slot_ms=3, open_slots=8,
                                 left=[4096] * answers, right=[-16] * answers,
                                 turns=list(range(7, 7 + turns))))


def mac(key, use, counter, body):
    """`body`: ID, OPCODE, DATA."""
    tag = CMAC(AES(key))
    tag.update(bytes([use]) + counter.to_bytes(4, "little") + body)
    return tag.finalize()


def signed(key, use, counter, body):
    """ID, OPCODE, DATA and what is added."""
    return (body + counter.to_bytes(4, "little")[:COUNTER_BYTES[use]] +
            mac(key, use, counter, body)[:4])


def derived(use, number=0, server_nonce=SERVER_NONCE):
    body = HELLO_7[:2] + NONCE.to_bytes(2, "little") + server_nonce
    return body, mac(KEY, use, number, body)


SESSION = derived(SESSION_KEY)[1]
MASKED = bytes(a ^ b for a, b in zip(GROUP, derived(GROUP_MASK)[1], strict=True))
GREETING_7 = (HELLO_ANSWER_7[:4] + SERVER_NONCE + MASKED + GROUP_COUNTER.to_bytes(4, "little"))


def received(key, use, last, wire):
    """What the receiver computes: (covered by the MAC, counter, MAC, whether the tag is right)."""
    body = next((body for body, _ in read(wire) if body), b"")
    if len(body) < 2 + ADDED[use]:
        return b"", 0, b"", False
    tag, size = body[-4:], COUNTER_BYTES[use]
    sent = int.from_bytes(body[-4 - size:-4], "little")
    covered = body[:-4 - size]
    if use in (HELLO, GREETING):
        counter = sent if use == HELLO else last
    else:
        counter = next(it for it in range(last + 1, last + 1 + (1 << 8 * size))
                       if it & (1 << 8 * size) - 1 == sent)
    found = mac(key, use, counter, covered)
    return covered, counter, found, found[:4] == tag


def bit_changed(body, at):
    return body[:at] + bytes([body[at] ^ 1 << at % 8]) + body[at + 1:]


def good():
    """name, key, use, last accepted, counter, body."""
    own, to_all = SESSION, GROUP
    last = GROUP_COUNTER
    return [
        ("hello", KEY, HELLO, 0, 0, HELLO_7),
        ("hello_again", KEY, HELLO, 0, 0x1002, HELLO_7),
        ("greeting", KEY, GREETING, 0, 0, GREETING_7),
        ("greeting_coded", KEY, GREETING, 0, 0, GREETING_7),
        ("greeting_coded_to_16", KEY, GREETING, 0, 0, bytes([16]) + GREETING_7[1:]),
        ("hello_in_session", own, CLIENT, 0, 1, HELLO_7),
        ("hello_answer", own, SERVER, 0, 1, HELLO_ANSWER_7),
        ("hello_answer_coded", own, SERVER, 0, 1, HELLO_ANSWER_7),
        ("sense", own, CLIENT, 1, 2, SENSE),
        ("sense_answer", own, SERVER, 1, 2, SENSE_ANSWER),
        ("trace", own, CLIENT, 2, 3, TRACE),
        ("trace_repeated", own, CLIENT, 3, 4, TRACE),
        ("trace_answer", own, SERVER, 2, 3, TRACE_ANSWER),
        ("trace_answer_repeated", own, SERVER, 3, 4, TRACE_ANSWER),
        ("command_resume", own, SERVER, 4, 5, RESUME),
        ("command_ack", own, CLIENT, 4, 5, RESUME_ACK),
        ("error_read_only", own, SERVER, 5, 6, READ_ONLY),
        ("ping_empty", own, CLIENT, 5, 6, PING),
        ("symbol_longest", own, CLIENT, 6, 7, SYMBOL),
        ("halt_to_all", to_all, TO_ALL, last, last + 1, HALT_ALL),
        ("round_counter_wraps", to_all, TO_ALL, last + 1, last + 2, round_of(2, 3)),
        ("round_coded", to_all, TO_ALL, last + 2, last + 3, round_of(2, 3)),
        ("round_coded_rows_as_unsigned", to_all, TO_ALL, last + 3, last + 4, round_of(0, 1)),
        ("round_coded_largest", to_all, TO_ALL, last + 4, last + 5, round_of(10, 10)),
        ("counter_wraps", own, CLIENT, 255, 256, SENSE),
        ("counter_is_dle", own, CLIENT, 15, 16, SENSE),
        ("after_255_missed", own, SERVER, 250, 506, SENSE_ANSWER),
        ("after_65535_missed", to_all, TO_ALL, 0x1234, 0x11234, HALT_ALL),
        ("last_counter", own, SERVER, 0xFFFFFFFD, 0xFFFFFFFE, SENSE_ANSWER),
    ]


def changed():
    """Each part of good frames with a bit changed: name, key, use, last, body as sent."""
    rows = []
    for name, key, use, last, counter, body in good():
        whole = signed(key, use, counter, body)
        parts = {"id": 0, "opcode": 1, "data": 3, "tag": len(whole) - 3}
        if COUNTER_BYTES[use]:
            parts["counter"] = len(body)
        if name == "greeting":
            parts |= {"server_nonce": 5, "group_key": 17, "group_counter": 28}
        if name in ("hello", "greeting", "hello_in_session", "hello_answer", "sense", "sense_answer", "trace_repeated",
                    "command_resume", "halt_to_all"):
            rows += [(f"{name}_{part}_changed", key, use, last, bit_changed(whole, at))
                     for part, at in parts.items()]
    return rows


def wrong():
    """name, key, use, last, body as sent."""
    other_session = derived(SESSION_KEY, 1)[1]
    first, resume = signed(SESSION, CLIENT, 1, SENSE), signed(SESSION, SERVER, 5, RESUME)
    halt = signed(GROUP, TO_ALL, GROUP_COUNTER + 1, HALT_ALL)
    return changed() + [
        ("sense_replayed", SESSION, CLIENT, 1, first),
        ("sense_replayed_after_256", SESSION, CLIENT, 257, first),
        ("sense_replayed_in_another_session", other_session, CLIENT, 0, first),
        ("trace_replayed", SESSION, CLIENT, 4, signed(SESSION, CLIENT, 3, TRACE)),
        ("resume_replayed", SESSION, SERVER, 5, resume),
        ("resume_in_another_session", other_session, SERVER, 4, resume),
        ("halt_to_all_replayed", GROUP, TO_ALL, GROUP_COUNTER + 1, halt),
        ("after_256_missed", SESSION, SERVER, 250, signed(SESSION, SERVER, 507, SENSE_ANSWER)),
        ("of_another_robot", SESSION, CLIENT, 0, signed(OTHER_KEY, CLIENT, 1, SENSE)),
        ("by_the_robots_key", SESSION, CLIENT, 0, signed(KEY, CLIENT, 1, SENSE)),
        ("in_the_other_direction", SESSION, SERVER, 0, first),
        ("to_all_by_the_sessions_key", GROUP, TO_ALL, GROUP_COUNTER,
         signed(SESSION, TO_ALL, GROUP_COUNTER + 1, HALT_ALL)),
        ("to_one_by_the_groups_key", SESSION, SERVER, 3, signed(GROUP, SERVER, 4, RESUME)),
        ("greeting_of_another_hello", KEY, GREETING, 1, signed(KEY, GREETING, 0, GREETING_7)),
        ("hello_in_session_by_the_robots_key", SESSION, CLIENT, 0, signed(KEY, CLIENT, 1, HELLO_7)),
        ("hello_by_another_key", KEY, HELLO, 0, signed(OTHER_KEY, HELLO, 0, HELLO_7)),
        ("unsigned_sense", SESSION, CLIENT, 0, SENSE),
        ("unsigned_ping", SESSION, CLIENT, 0, PING),
        ("unsigned_hello", KEY, HELLO, 0, HELLO_7),
        ("unsigned_hello_in_session", SESSION, CLIENT, 0, HELLO_7),
        ("unsigned_hello_answer", SESSION, SERVER, 0, HELLO_ANSWER_7),
        ("unsigned_resume", SESSION, SERVER, 3, RESUME),
        ("unsigned_halt_to_all", GROUP, TO_ALL, GROUP_COUNTER, HALT_ALL),
    ]


# Coded frames: what is damaged, the places of the bytes, and whether they arrive. The greeting has 5
# rows from place 10 on, their sum at 50, P at 58 and Q at 64; the other answer 3, 34, 42 and 46.
DAMAGED = [
    ("greeting_coded", "begins_badly", [0], "ok"),
    ("greeting_coded", "id_first_wrong", [2], "wrong"),
    ("greeting_coded", "rows_first_wrong", [4], "ok"),
    ("greeting_coded", "second_beginning_wrong", range(5, 10), "ok"),
    ("greeting_coded", "both_beginnings_wrong", [3, 9], "wrong"),
    ("greeting_coded", "one_byte_a_row", [10, 21, 37, 18, 49, 52], "ok"),
    ("greeting_coded", "burst", range(30, 35), "ok"),
    ("greeting_coded", "a_row_lost", range(11, 51, 5), "ok"),
    ("greeting_coded", "p_and_q_wrong", [58, 61, 63, 65, 66], "ok"),
    ("greeting_coded", "two_rows_lost", [10, 15, 11, 21], "wrong"),
    ("hello_answer_coded", "begins_badly", [1], "ok"),
    ("hello_answer_coded", "opcode_first_wrong", [3], "ok"),
    ("hello_answer_coded", "one_byte_a_row", [33, 10, 14, 41], "ok"),
    ("hello_answer_coded", "a_row_lost", range(12, 36, 3), "ok"),
    ("hello_answer_coded", "two_rows_lost", [10, 13, 12, 15], "wrong"),
]


def rows():
    """name, key, use, last, wire, covered, counter, MAC, verdict of each line."""
    made = []
    for name, use in (("session_key", SESSION_KEY), ("group_mask", GROUP_MASK)):
        body, key = derived(use)
        made.append((name, KEY, use, 0, b"", body, 0, key, "key"))
    sent = [(name, key, use, last, signed(key, use, counter, body), "ok", (body, counter))
            for name, key, use, last, counter, body in good()]
    sent += [(*row, "wrong", None) for row in wrong()]
    wires = [coded_of(row[4]) if "_coded" in row[0] else wire_of(row[4]) for row in sent]
    for name, what, places, verdict in DAMAGED:
        at = next(i for i, row in enumerate(sent) if row[0] == name)
        _, key, use, last, body, _, expected = sent[at]
        sent.append((f"{name}_{what}", key, use, last, body, verdict,
                     expected if verdict == "ok" else None))
        wires.append(bytes(byte ^ 0x5A + i if i in places else byte
                           for i, byte in enumerate(wires[at])))
    for (name, key, use, last, body, verdict, expected), wire in zip(sent, wires):
        covered, counter, found, right = received(key, use, last, wire)
        if right != (verdict == "ok") or expected not in (None, (covered, counter)):
            raise ValueError(f"{name}: expected {verdict}, but the reader finds {covered.hex(' ')}, "
                             f"counter {counter}")
        made.append((name, key, use, last, wire, covered, counter, found, verdict))
    return made
