"""The protocol a second time, for make_vectors.py: messages by name, their bytes, and what a receiver
makes of a stream. Written from the specification (../README.md) alone, and as plainly as it goes: the
CRC bit by bit.
"""

import tag_vectors

DLE, STX, ETX = 0x10, 0x02, 0x03
MAX_DATA = 64


def crc16(data):
    """CRC-16/ARC, bit by bit."""
    crc = 0
    for byte in data:
        for bit in range(8):
            feedback = (crc ^ (byte >> bit)) & 1
            crc >>= 1
            if feedback:
                crc ^= 0xA001
    return crc


# --------------------------------------------------------------------------------------------------
# Messages: opcode and the layout of DATA. "type" in the opcode's place: the low four bits are the
# pheromone type. COMMAND's arguments and the lists of ROUND and of SCAN's answer follow the fixed
# part. Of "bytes", which are the last field, there may be any number up to a most.

POSE = "x:i16 y:i16 heading:u16"
WIDE_POSE = "x:i32 y:i32 heading:u16"
INTENSITIES = "left:i16 right:i16"

MESSAGES = {
    # name: (opcode, takes a type, layout)
    "SENSE": (0x00, True, POSE),
    "SENSE_ANSWER": (0x80, True, INTENSITIES),
    "SENSE_WIDE": (0x10, True, WIDE_POSE),
    "SENSE_WIDE_ANSWER": (0x90, True, INTENSITIES),
    "DEPOSIT": (0x20, True, "seq:u8 x:i16 y:i16 quanta:u8"),
    "DEPOSIT_ANSWER": (0xA0, True, "seq:u8"),
    "TRACE": (0x30, True, "seq:u8 " + POSE),
    "TRACE_ANSWER": (0xB0, True, "seq:u8 " + INTENSITIES),
    "TRACE_WIDE": (0x60, True, "seq:u8 " + WIDE_POSE),
    "TRACE_WIDE_ANSWER": (0xE0, True, "seq:u8 " + INTENSITIES),
    **tag_vectors.MESSAGES,
    "COMMAND": (0xD1, False, "seq:u8 code:u8"),
    "COMMAND_ACK": (0x51, False, "seq:u8 code:u8 result:i16"),
    "EVENT": (0x52, False, "seq:u8 code:u8 argument:i16"),
    "EVENT_ACK": (0xD2, False, "seq:u8"),
    "HELLO": (0x71, False, "nonce:u16 firmware_version:u8 round_period:u8"),
    "HELLO_ANSWER": (0xF1, False,
                     "nonce:u16 protocol_version:u8 epoch:u16 pose_unit_10um:u16 "
                     "antenna_distance_mm:u16 type_mask:u16 slot_ms:u8 response_window_ms:u8 "
                     "last_opcode:u8 last_seq:u8"),
    "PING": (0x72, False, "payload:bytes"),
    "PING_ANSWER": (0xF2, False, "payload:bytes"),
    "ROUND": (0xF3, False, "number:u8 turn_ms:u8 turn_bytes:u8 slot_ms:u8 open_slots:u8"),
    "ERROR": (0xFE, False, "refused_opcode:u8 reason:u8 seq:u8"),
}

COMMAND_ARGUMENTS = {
    1: "", 2: "",
    3: "speed_mm_s:i16",
    4: "x:i16 y:i16",
    5: "type_to_follow:u8",
    6: "", 7: "",
    8: "parameter:u8 value:i32",
    9: "parameter:u8",
}

MOST_BYTES = {"PING": 16, "PING_ANSWER": 16, **tag_vectors.MOST_BYTES}
EVERYBODY = 255
MOST_TURNS = 11
NO_INTENSITIES = -32768

# --------------------------------------------------------------------------------------------------
# What is sent, and what becomes of it.


def little_endian(value, kind):
    bits = int(kind[1:])
    least = -(1 << (bits - 1)) if kind[0] == "i" else 0
    if not least <= value < least + (1 << bits):
        raise ValueError(f"{value} does not fit {kind}")
    return bytes((value >> shift) & 0xFF for shift in range(0, bits, 8))


def body_of(message, fields):
    """ID, OPCODE, DATA of a message; uses every field exactly once."""
    opcode, typed, layout = MESSAGES[message]
    rest = dict(fields)
    body = [rest.pop("id"), opcode | rest.pop("type") if typed else opcode]
    if message == "COMMAND":
        layout += " " + COMMAND_ARGUMENTS[fields["code"]]
    data = b""
    for item in layout.split():
        name, kind = item.split(":")
        value = rest.pop(name)
        data += bytes.fromhex(value) if kind == "bytes" else little_endian(value, kind)
    if message == "SCAN_ANSWER":
        for row in zip(*(rest.pop(name) for name in tag_vectors.TAG_ROW), strict=True):
            data += b"".join(map(little_endian, row, tag_vectors.TAG_ROW.values()))
    if message == "ROUND":
        left, right, turns = rest.pop("left"), rest.pop("right"), rest.pop("turns")
        data += bytes([16 * len(turns) + len(left)])
        for one in zip(left, right, strict=True):
            data += b"".join(little_endian(value, "i16") for value in one)
        data += bytes(turns)
    if rest:
        raise ValueError(f"{message} has no field {', '.join(rest)}")
    return bytes(body) + data


def wire_of(body):
    crc = crc16(body)
    out = [DLE, STX]
    for byte in list(body) + [crc & 0xFF, crc >> 8]:
        out += [byte, byte] if byte == DLE else [byte]
    return bytes(out + [DLE, ETX])


# A coded ROUND: rows of eight bytes of DATA and CRC, a row that is their sum, and of each row P and Q,
# so that sum(bytes) + P = 0 and sum(2 ** column * byte) + Q = 0 in GF(256).

COLUMNS = 8
MOST_ROWS = 8
SIGNATURE_TO_ALL = 6  # bytes between DATA and CRC, if it is signed
CODED_HELLO = {5: 34, 3: 15 + 5}  # bytes of DATA by rows: the answers to the first and the second


def times(a, b):
    """The product in GF(256), modulo x^8 + x^4 + x^3 + x^2 + 1."""
    product = 0
    for bit in range(8):
        if b >> bit & 1:
            product ^= a << bit
    for bit in range(14, 7, -1):
        if product >> bit & 1:
            product ^= 0x11D << bit - 8
    return product


def p_of(row):
    p = 0
    for byte in row:
        p ^= byte
    return p


def q_of(row):
    q, weight = 0, 1
    for byte in row:
        q ^= times(weight, byte)
        weight = times(weight, 2)
    return q


def coded_of(body):
    """The coded form of a ROUND, or of the answer to a signed HELLO."""
    to, first = (EVERYBODY, 0xF4) if body[1] == 0xF3 else (body[0] if body[0] != DLE else 0, 0xF6)
    crc = crc16(body)
    data = list(body[2:]) + [crc & 0xFF, crc >> 8]
    rows = -(-len(data) // COLUMNS)
    data += [0] * (rows * COLUMNS - len(data))
    total = [p_of(data[rows * column:rows * (column + 1)]) for column in range(COLUMNS)]
    lines = [data[row::rows] for row in range(rows)] + [total]
    said = rows | (15 - rows) << 4
    return bytes([DLE, STX, to, first, said, DLE, STX, to, first + 1, said] + data + total +
                 [p_of(line) for line in lines] + [q_of(line) for line in lines])


def corrected(row, p, q):
    """The row in which P and Q are right with at most one byte changed, P and Q included; else None."""
    if p_of(row) == p or q_of(row) == q:
        return row
    for column in range(COLUMNS):
        fixed = list(row)
        fixed[column] ^= p_of(row) ^ p
        if q_of(fixed) == q:
            return fixed
    return None


def read_coded(stream, at):
    """From behind a DLE STX: (ID, OPCODE, DATA and CRC; whether it is whole; where to go on), or None if
    it is not coded. What is not whole, or has no right CRC, has no bytes."""
    if len(stream) < at + 3:
        return None
    to, opcode, said = stream[at:at + 3]
    rows = said & 0x0F
    if rows + (said >> 4) != 15:
        return None
    if to == EVERYBODY:
        if opcode not in (0xF4, 0xF5) or not 1 <= rows <= MOST_ROWS:
            return None
    elif opcode not in (0xF6, 0xF7) or rows not in CODED_HELLO:
        return None
    begin = at + 3 + (5 if opcode in (0xF4, 0xF6) else 0)
    end = begin + (COLUMNS + 2) * (rows + 1)
    if end > len(stream):
        return [], False, len(stream)
    code = list(stream[begin:end])
    data, total, checks = code[:8 * rows], code[8 * rows:8 * rows + 8], code[8 * rows + 8:]
    lines = [data[row::rows] for row in range(rows)] + [total]
    found = [corrected(line, checks[row], checks[rows + 1 + row]) for row, line in enumerate(lines)]
    lost = [row for row, line in enumerate(found) if line is None]
    found = [line or lines[row] for row, line in enumerate(found)]
    if lost:  # of several, only the last, and the CRC tells whether the others matter
        others = [line for row, line in enumerate(found) if row != lost[-1]]
        found[lost[-1]] = [p_of(line[column] for line in others) for column in range(COLUMNS)]
    data = [found[i % rows][i // rows] for i in range(8 * rows)]
    size = 6 + 4 * (data[5] & 0x0F) + (data[5] >> 4) + 2
    sizes = (size, size + SIGNATURE_TO_ALL) if to == EVERYBODY else (CODED_HELLO[rows] + 2,)
    head = [to or DLE, 0xF3 if to == EVERYBODY else 0xF1]
    for whole in sizes:
        if whole <= len(data) and crc16(head + data[:whole]) == 0:
            return head + data[:whole], True, end
    return [], True, end


def judge_round(to, data):
    """Six bytes, of which the last counts turns and answers, of four bytes each; then these."""
    if len(data) < 6:
        return "bad-length"
    turns, answers = divmod(data[5], 16)
    if len(data) != 6 + 4 * answers + turns or answers > MOST_TURNS or turns > MOST_TURNS:
        return "bad-length"
    turns = data[6 + 4 * answers:]
    good = to == EVERYBODY and 0 not in turns and EVERYBODY not in turns
    return "ok" if good else "bad-value"


def judge(body, crc_included):
    """What becomes of a complete frame: the receiver's rules, then the table of messages."""
    if len(crc_included) < 4:
        return "runt"
    if crc16(body) != crc_included[-2] | crc_included[-1] << 8:
        return "bad-crc"
    if body[0] == 0 or body[1] == 0:
        return "refused"
    data = len(body) - 2
    low = body[1] & 0x0F
    for name, (opcode, typed, layout) in MESSAGES.items():
        if body[1] != (opcode | low if typed else opcode) or typed and low == 0:
            continue
        if name == "COMMAND":
            if data < 2 or body[3] not in COMMAND_ARGUMENTS:
                return "bad-length"
            layout += " " + COMMAND_ARGUMENTS[body[3]]
        if name == "ROUND":
            return judge_round(body[0], body[2:])
        kinds = [item.split(":")[1] for item in layout.split()]
        fixed = sum(int(kind[1:]) for kind in kinds if kind != "bytes") // 8
        if name == "SCAN_ANSWER":
            rows, odd = divmod(data - fixed, 8)
            return "ok" if 0 <= rows <= tag_vectors.MOST_TAG_ROWS and odd == 0 else "bad-length"
        most = MOST_BYTES.get(name, 0)
        if name == "RESOLVE_ANSWER" and data >= fixed:
            most = min(most, body[1 + fixed])  # its last byte: the length of the whole text
        return "ok" if 0 <= data - fixed <= most else "bad-length"
    return "unknown-opcode"


def read_inside(stream, at):
    """From behind a DLE STX: (bytes inside, unstuffed; how it ended, if it did; where to go on)."""
    inside = []
    coded = read_coded(stream, at)
    if coded:
        inside, whole, at = coded
        return inside, ("complete" if inside else "bad-crc") if whole else None, at
    while at < len(stream):
        pair = list(stream[at:at + 2])
        if pair[0] != DLE:
            inside.append(pair[0])
            at += 1
        elif pair == [DLE, DLE]:
            inside.append(DLE)
            at += 2
        elif pair == [DLE, ETX]:
            return inside, "complete", at + 2
        elif pair in ([DLE], [DLE, STX]):
            return inside, None, at
        else:
            return inside, "bad-escape", at + 2
        if len(inside) > MAX_DATA + 4:
            return inside, "oversize", at
    return inside, None, at


def read(stream):
    """The frames in a stream without pauses: a list of (body, verdict)."""
    found = []
    at = 0
    while at < len(stream):
        if stream[at:at + 2] != bytes([DLE, STX]):
            at += 1
            continue
        inside, end, at = read_inside(stream, at + 2)
        if end == "complete":
            body = bytes(inside[:-2])
            found.append((body, judge(body, inside)))
        elif end:
            found.append((None, end))
    return found
