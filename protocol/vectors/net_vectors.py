"""The part of the test vectors that is about records of nets in blocks of tags (../README.md,
section 17). make_vectors.py writes the file. The hash of the robots' net is computed here from
deploy/examples/nets/robot.toml, as the specification says.
"""

import pathlib
import struct
import tomllib

ROBOT_NET = pathlib.Path(__file__).resolve().parents[2] / "deploy/examples/nets/robot.toml"
TYPE_NET_RECORD = -32
KINDS = {"trigger": 1, "environment": 2, "robot": 3}
MOST_CANDIDATES = 11
PLACE_DOES = {"": 0, "follow": 1, "wait": 2, "choose": 3}
TRANSITION_DOES = {"": 0, "present": 1, "leave": 2, "leave A": 3, "leave B": 4, "store A": 5,
                   "store B": 6, "take": 7}


def hash_of(path):
    """FNV-1a, 32 bits, over a robots' net; without read arcs, which no net of ours has."""
    net = tomllib.loads(path.read_text(encoding="utf-8"))
    number = {place["id"]: i for i, place in enumerate(net["place"])}

    def mask(transition, arcs):
        return sum(1 << number[place] for place in transition.get(arcs, []))

    data = bytes([len(net["place"]), len(net["transition"])])
    marked = sum(place.get("tokens", 0) << i for i, place in enumerate(net["place"]))
    data += struct.pack("<I", marked)
    for place in net["place"]:
        does, _, line = place.get("does", "").partition(" ")
        data += bytes([PLACE_DOES[does], int(line or 0)])
    for it in net["transition"]:
        assert "reads" not in it
        data += struct.pack("<III", mask(it, "takes"), mask(it, "gives"), mask(it, "inhibited_by"))
        data += bytes([TRANSITION_DOES[it.get("does", "")]])
    value = 2166136261
    for byte in data:
        value = (value ^ byte) * 16777619 & 0xFFFFFFFF
    return value


HASH = hash_of(ROBOT_NET)
OTHER = HASH ^ 0x10000000


def trigger(*candidates, count=None):
    return "trigger", bytes([len(candidates) if count is None else count, *candidates]).ljust(12, b"\0")


def environment(state=0, outcome=0, robot=0, seq=0, amount=0, left=0):
    return "environment", struct.pack("<BBiBxHH", state, outcome, robot, seq, amount, left)


def robot(seq, action, transition=0, amount=0, energy=0):
    return "robot", struct.pack("<BBBxHHxxxx", seq, action, transition, amount, energy)


# name, kind and payload, and, where they are not the usual ones: a change of the whole record after
# its CRC was made, before it was made, the hash, the kind that the reader wants, and the verdict.
RECORDS = [
    ("trigger_of_P", trigger(2, 8, 15), {}),
    ("trigger_of_N1", trigger(1), {}),
    ("trigger_empty", trigger(), {}),
    ("trigger_most", trigger(*range(22, 33)), {}),
    ("trigger_dle", trigger(*[16] * 11), {}),
    ("trigger_of_another_net", trigger(2, 8, 15), dict(hash=OTHER, verdict="hash")),
    ("trigger_as_environment", trigger(1), dict(wanted="environment", verdict="kind")),
    ("trigger_too_many", trigger(*[1] * 11, count=12), dict(verdict="value")),
    ("trigger_candidate_zero", trigger(3, 0, 5), dict(verdict="value")),
    ("environment_start", environment(), {}),
    ("environment_green", environment(1, 1, 15, 7), {}),
    ("environment_advice_a", environment(2, 1, 15, 8, 0, 900), {}),
    ("environment_advice_b", environment(4, 1, 16, 255, 70, 830), {}),
    ("environment_refused", environment(0, 2, 15, 9), {}),
    ("environment_extremes", environment(1, 2, -2147483648, 255, 65535, 65535), {}),
    ("environment_dle", environment(0, 1, 0x10101010, 16, 0x1010, 0x1010), {}),
    ("environment_both_advices", environment(6, 1, 15, 7), dict(verdict="value")),
    ("environment_unknown_state", environment(8, 1, 15, 7), dict(verdict="value")),
    ("environment_unknown_outcome", environment(0, 3, 15, 7), dict(verdict="value")),
    ("environment_of_another_net", environment(1, 1, 15, 7), dict(hash=OTHER, verdict="hash")),
    ("environment_as_trigger", environment(1, 1, 15, 7), dict(wanted="trigger", verdict="kind")),
    ("robot_present", robot(7, 1, 1), {}),
    ("robot_pass", robot(8, 2, 1), {}),
    ("robot_leave", robot(9, 3, 3), {}),
    ("robot_choose_a", robot(10, 4, 2), {}),
    ("robot_choose_b", robot(11, 5, 2), {}),
    ("robot_store_a", robot(12, 6, 8, 100, 100), {}),
    ("robot_store_b", robot(13, 7, 15, 1, 65535), {}),
    ("robot_take", robot(14, 8, 5, 100, 0), {}),
    ("robot_extremes", robot(255, 8, 255, 65535, 65535), {}),
    ("robot_dle", robot(16, 8, 16, 0x1010, 0x1010), {}),
    ("robot_without_action", robot(7, 0), dict(verdict="value")),
    ("robot_unknown_action", robot(7, 9), dict(verdict="value")),
    ("robot_of_another_net", robot(7, 1, 1), dict(hash=OTHER, verdict="hash")),
    ("robot_as_environment", robot(7, 1, 1), dict(wanted="environment", verdict="kind")),
    ("bit_of_payload", robot(7, 1, 1), dict(after={11: 3}, verdict="crc")),
    ("bit_of_hash", robot(7, 1, 1), dict(after={9: 0xFF}, verdict="crc")),
    ("bit_of_crc", trigger(1), dict(after={23: 0xEE}, verdict="crc")),
    ("next_version", trigger(1), dict(before={4: 2}, verdict="version")),
    ("version_before_crc", trigger(1), dict(after={4: 0}, verdict="version")),
    ("kind_zero", trigger(1), dict(before={5: 0}, verdict="kind")),
    ("kind_unknown", trigger(1), dict(before={5: 4}, verdict="kind")),
    ("crc_before_kind", trigger(1), dict(after={5: 4}, verdict="crc")),
    ("kind_before_hash", trigger(1), dict(hash=OTHER, wanted="robot", verdict="kind")),
    ("hash_before_value", robot(7, 0), dict(hash=OTHER, verdict="hash")),
    ("fact_about_a_tag", trigger(1), dict(after={0: 0xEE}, verdict="no-record")),
    ("fact_of_zeros", trigger(1), dict(after={i: 0 for i in range(24)}, verdict="no-record")),
]


def statement_of(kind, payload, crc16, changed=None):
    """The 24 bytes of a block's statement."""
    record = bytearray(struct.pack("<iBBI", TYPE_NET_RECORD, 1, KINDS[kind], HASH) + payload)
    for at, value in (changed or {}).get("before", {}).items():
        record[at] = value
    if "hash" in (changed or {}):
        record[6:10] = struct.pack("<I", changed["hash"])
    record += struct.pack("<H", crc16(record[4:]))
    for at, value in (changed or {}).get("after", {}).items():
        record[at] = value
    assert len(record) == 24
    return bytes(record)


def judge(record, wanted, crc16, own_net=HASH):
    """What a reader says who wants a record of this kind of its own net."""
    subject, version, kind, net = struct.unpack("<iBBI", record[:10])
    payload = record[10:22]
    if subject != TYPE_NET_RECORD:
        return "no-record"
    if version != 1:
        return "version"
    if struct.unpack("<H", record[22:])[0] != crc16(record[4:22]):
        return "crc"
    if kind != KINDS[wanted]:
        return "kind"
    if net != own_net:
        return "hash"
    if wanted == "trigger":
        good = payload[0] <= MOST_CANDIDATES and 0 not in payload[1:1 + payload[0]]
    elif wanted == "environment":
        good = payload[0] < 8 and payload[0] & 6 != 6 and payload[1] <= 2
    else:
        good = 1 <= payload[1] <= 8
    return "ok" if good else "value"


def fields_of(record):
    payload = record[10:22]
    if record[5] == 1:
        return "candidates=" + (",".join(map(str, payload[1:1 + payload[0]])) or "-")
    if record[5] == 2:
        names, values = ("state", "outcome", "robot", "seq", "amount", "left"), struct.unpack(
            "<BBiBxHH", payload)
    else:
        names, values = ("seq", "action", "transition", "amount", "energy"), struct.unpack(
            "<BBBxHHxxxx", payload)
    return " ".join(f"{name}={value}" for name, value in zip(names, values, strict=True))


def records(crc16):
    """name, wanted kind, bytes, verdict, fields or "-"; checks the verdicts."""
    for name, (kind, payload), changed in RECORDS:
        record = statement_of(kind, payload, crc16, changed)
        wanted = changed.get("wanted", kind)
        verdict = judge(record, wanted, crc16)
        if verdict != changed.get("verdict", "ok"):
            raise ValueError(f"{name}: expected {changed.get('verdict', 'ok')}, found {verdict}")
        yield name, wanted, record, verdict, fields_of(record) if verdict == "ok" else "-"


def frames(crc16, tags):
    """Good frames: the conversation of the worked example. Robot 15 (CLIENT_ID 7) presents itself
    at tag 31, the entrance N1, and gets its green."""
    def words(kind, payload):
        return tags.statement(*struct.unpack("<6i", statement_of(kind, payload, crc16)))

    def read(slot):
        return dict(id=7, x=1000, y=500, tag=31, slot=slot)

    def block(slot, following, generation, slot_generation, kind_and_payload):
        return dict(id=7, tag=31, slot=slot, next=following, slots=8, tag_generation=generation,
                    slot_generation=slot_generation, lease_s=0, flags=1, author=90, time=1138458000,
                    **words(*kind_and_payload))

    def write(seq, record):
        return dict(id=7, seq=seq, x=1000, y=500, tag=31, slot=tags.NO_SLOT, flags=0, expected=0,
                    lease_s=3600, time=0, **words(*record))

    return [
        ("net_read_trigger", "READ", read(0)),
        ("net_read_answer_trigger", "READ_ANSWER", block(0, 1, 2, 1, trigger(1))),
        ("net_write_present", "WRITE", write(4, robot(7, 1, 1))),
        ("net_write_answer_present", "WRITE_ANSWER",
         dict(id=7, seq=4, tag=31, slot=2, slot_generation=1, tag_generation=3)),
        ("net_read_outcome", "READ", read(1)),
        ("net_read_answer_accepted", "READ_ANSWER",
         block(1, tags.NO_SLOT, 5, 2, environment(0, 1, 15, 7))),
        ("net_read_answer_green", "READ_ANSWER",
         block(1, tags.NO_SLOT, 6, 3, environment(1, 1, 15, 7))),
        ("net_write_pass", "WRITE", write(5, robot(8, 2, 1))),
    ]
