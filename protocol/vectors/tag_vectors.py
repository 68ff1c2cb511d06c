"""The part of the test vectors that is about tags: messages, good frames, and frames of a wrong
length. make_vectors.py, which checks them and writes the files, says what each column is.
"""

AT = "x:i32 y:i32 "
STATEMENT = ("subject_namespace:i32 subject:i32 predicate_namespace:i32 predicate:i32 "
             "object_namespace:i32 object:i32")
WRITTEN = "seq:u8 tag:u16 slot:u8 slot_generation:u16 tag_generation:u16"

MESSAGES = {
    "SCAN": (0x41, False, AT + "after:u16"),
    "SCAN_ANSWER": (0xC1, False, "more:u8"),
    "READ": (0x42, False, AT + "tag:u16 slot:u8"),
    "READ_ANSWER": (0xC2, False,
                    "tag:u16 slot:u8 next:u8 slots:u8 tag_generation:u16 slot_generation:u16 "
                    "lease_s:u16 flags:u8 author:i32 time:u32 " + STATEMENT),
    "WRITE": (0x43, False,
              "seq:u8 " + AT + "tag:u16 slot:u8 flags:u8 expected:u16 lease_s:u16 time:u32 " +
              STATEMENT),
    "WRITE_ANSWER": (0xC3, False, WRITTEN),
    "ERASE": (0x44, False, "seq:u8 " + AT + "tag:u16 slot:u8 flags:u8 expected:u16"),
    "ERASE_ANSWER": (0xC4, False, WRITTEN),
    "SYMBOL": (0x45, False, "seq:u8 kind:u8 number:i32 text:bytes"),
    "SYMBOL_ANSWER": (0xC5, False, "seq:u8 kind:u8 number:i32"),
    "RESOLVE": (0x46, False, "kind:u8 robot:i32 number:i32 offset:u8"),
    "RESOLVE_ANSWER": (0xC6, False,
                       "kind:u8 robot:i32 number:i32 rows:u32 text_length:u8 text:bytes"),
}

MOST_BYTES = {"SYMBOL": 56, "RESOLVE_ANSWER": 50}
TAG_ROW = {"tag": "u16", "dx": "i16", "dy": "i16", "generation": "u16"}
MOST_TAG_ROWS = 7
NO_SLOT = 255
LEAST, GREATEST = -2147483648, 2147483647


def statement(*words):
    """The six words of subject, predicate and object, by name."""
    names = [item.split(":")[0] for item in STATEMENT.split()]
    return dict(zip(names, words, strict=True))


EXTREMES = statement(GREATEST, LEAST, GREATEST, LEAST, LEAST, GREATEST)
ALL_DLE = statement(*[0x10101010] * 6)
# The block of the reference: robot 15, 2006-01-28T14:20:00Z, symbols (1, 2) and (3, 4), the integer
# 244.
REFERENCE_BYTES = "0f000000907ddb4301000000020000000300000004000000fdfffffff4000000"
REFERENCE = dict(author=15, time=1138458000, **statement(1, 2, 3, 4, -3, 244))
EMPTY = dict(author=0, time=0, **statement(0, 0, 0, 0, 0, 0))
CLAIM = statement(-18, 3, 1, 2, -17, 15)  # tag 3 is held by robot 15

# Good frames: name, message, fields.
GOOD = [
    ("scan_of_the_worked_example", "SCAN", dict(id=7, x=1000, y=500, after=0)),
    ("scan_extremes", "SCAN", dict(id=254, x=LEAST, y=GREATEST, after=65535)),
    ("scan_dle", "SCAN", dict(id=16, x=0x10101010, y=0x02100310, after=0x1010)),
    ("scan_answer_none_in_range", "SCAN_ANSWER",
     dict(id=7, more=0, tag=[], dx=[], dy=[], generation=[])),
    ("scan_answer_of_the_worked_example", "SCAN_ANSWER",
     dict(id=7, more=0, tag=[3], dx=[50], dy=[-20], generation=[9])),
    ("scan_answer_extremes", "SCAN_ANSWER",
     dict(id=254, more=255, tag=[1, 65535], dx=[-32768, 32767], dy=[32767, -32768],
          generation=[65535, 0])),
    ("scan_answer_dle", "SCAN_ANSWER",
     dict(id=16, more=16, tag=[0x1010, 0x1011], dx=[0x1010, 0x0210], dy=[0x0310, 0x1010],
          generation=[0x1010, 0x1010])),
    ("scan_answer_largest", "SCAN_ANSWER",
     dict(id=1, more=1, tag=list(range(1, 8)), dx=list(range(-3, 4)), dy=list(range(300, 307)),
          generation=list(range(1000, 1007)))),
    ("read_of_the_worked_example", "READ", dict(id=7, x=1000, y=500, tag=3, slot=0)),
    ("read_extremes", "READ", dict(id=254, x=GREATEST, y=LEAST, tag=65535, slot=255)),
    ("read_dle", "READ", dict(id=16, x=0x10101010, y=0x10101010, tag=0x1010, slot=16)),
    ("read_answer_of_the_worked_example", "READ_ANSWER",
     dict(id=7, tag=3, slot=NO_SLOT, next=NO_SLOT, slots=8, tag_generation=9, slot_generation=0,
          lease_s=0, flags=0, **EMPTY)),
    ("read_answer_of_the_reference", "READ_ANSWER",
     dict(id=7, tag=3, slot=0, next=2, slots=8, tag_generation=513, slot_generation=258,
          lease_s=60, flags=1, **REFERENCE)),
    ("read_answer_extremes", "READ_ANSWER",
     dict(id=254, tag=65535, slot=254, next=NO_SLOT, slots=255, tag_generation=65535,
          slot_generation=65535, lease_s=65535, flags=255, author=GREATEST, time=4294967295,
          **EXTREMES)),
    ("read_answer_dle", "READ_ANSWER",
     dict(id=16, tag=0x1010, slot=16, next=16, slots=16, tag_generation=0x1010,
          slot_generation=0x1010, lease_s=0x1010, flags=16, author=0x10101010, time=0x10101010,
          **ALL_DLE)),
    ("write_of_the_worked_example", "WRITE",
     dict(id=7, seq=4, x=1000, y=500, tag=3, slot=NO_SLOT, flags=2, expected=9, lease_s=60,
          time=0, **CLAIM)),
    ("write_of_the_reference", "WRITE",
     dict(id=7, seq=5, x=-40000, y=40000, tag=300, slot=NO_SLOT, flags=1, expected=0, lease_s=0,
          time=1138458000, **statement(1, 2, 3, 4, -3, 244))),
    ("write_into_a_slot_if_unchanged", "WRITE",
     dict(id=7, seq=6, x=0, y=0, tag=1, slot=7, flags=2, expected=65535, lease_s=3600,
          time=4294967295, **statement(0, 1, 0, 2, -16, -1))),
    ("write_extremes", "WRITE",
     dict(id=254, seq=255, x=LEAST, y=GREATEST, tag=65535, slot=254, flags=255, expected=65535,
          lease_s=65535, time=2147483648, **EXTREMES)),
    ("write_longest_on_the_wire", "WRITE",
     dict(id=16, seq=16, x=0x10101010, y=0x10101010, tag=0x1010, slot=16, flags=16,
          expected=0x1010, lease_s=0x1010, time=0x10101010, **ALL_DLE)),
    ("write_answer_of_the_worked_example", "WRITE_ANSWER",
     dict(id=7, seq=4, tag=3, slot=0, slot_generation=5, tag_generation=10)),
    ("write_answer_extremes", "WRITE_ANSWER",
     dict(id=254, seq=255, tag=65535, slot=254, slot_generation=65535, tag_generation=65535)),
    ("write_answer_dle", "WRITE_ANSWER",
     dict(id=16, seq=16, tag=0x1010, slot=16, slot_generation=0x1010, tag_generation=0x1010)),
    ("erase_of_the_worked_example", "ERASE",
     dict(id=7, seq=5, x=1000, y=500, tag=3, slot=0, flags=2, expected=5)),
    ("erase_whatever_is_there", "ERASE",
     dict(id=7, seq=6, x=-1, y=-2, tag=3, slot=1, flags=0, expected=0)),
    ("erase_extremes", "ERASE",
     dict(id=254, seq=255, x=GREATEST, y=LEAST, tag=65535, slot=255, flags=255, expected=65535)),
    ("erase_dle", "ERASE",
     dict(id=16, seq=16, x=0x10101010, y=0x10101010, tag=0x1010, slot=16, flags=16,
          expected=0x1010)),
    ("erase_answer_of_the_worked_example", "ERASE_ANSWER",
     dict(id=7, seq=5, tag=3, slot=0, slot_generation=6, tag_generation=11)),
    ("erase_answer_extremes", "ERASE_ANSWER",
     dict(id=254, seq=255, tag=65535, slot=254, slot_generation=65535, tag_generation=65535)),
    ("erase_answer_dle", "ERASE_ANSWER",
     dict(id=16, seq=16, tag=0x1010, slot=16, slot_generation=0x1010, tag_generation=0x1010)),
    ("symbol_robot_of_the_worked_example", "SYMBOL",
     dict(id=7, seq=1, kind=1, number=0, text=b"123-233-201".hex())),
    ("symbol_namespace_of_the_worked_example", "SYMBOL",
     dict(id=7, seq=2, kind=2, number=1, text=b"http://example.org/".hex())),
    ("symbol_string_of_the_worked_example", "SYMBOL",
     dict(id=7, seq=3, kind=2, number=2, text=b"heldBy".hex())),
    ("symbol_not_ascii", "SYMBOL",
     dict(id=7, seq=4, kind=2, number=3, text="\u00df\u0219\u4e2d\U0001f600".encode().hex())),
    ("symbol_mapping", "SYMBOL", dict(id=8, seq=2, kind=3, number=15, text="")),
    ("symbol_extremes", "SYMBOL", dict(id=254, seq=255, kind=255, number=LEAST, text="ff" * 56)),
    ("symbol_longest_on_the_wire", "SYMBOL",
     dict(id=16, seq=16, kind=16, number=0x10101010, text="10" * 56)),
    ("symbol_answer_of_the_worked_example", "SYMBOL_ANSWER",
     dict(id=7, seq=1, kind=1, number=15)),
    ("symbol_answer_extremes", "SYMBOL_ANSWER", dict(id=254, seq=255, kind=255, number=LEAST)),
    ("symbol_answer_dle", "SYMBOL_ANSWER", dict(id=16, seq=16, kind=16, number=0x10101010)),
    ("resolve_of_the_worked_example", "RESOLVE", dict(id=8, kind=2, robot=15, number=2, offset=0)),
    ("resolve_the_first_row", "RESOLVE", dict(id=8, kind=4, robot=0, number=0, offset=0)),
    ("resolve_extremes", "RESOLVE",
     dict(id=254, kind=255, robot=LEAST, number=GREATEST, offset=255)),
    ("resolve_dle", "RESOLVE",
     dict(id=16, kind=16, robot=0x10101010, number=0x10101010, offset=16)),
    ("resolve_answer_of_the_worked_example", "RESOLVE_ANSWER",
     dict(id=8, kind=2, robot=15, number=2, rows=3, text_length=6, text=b"heldBy".hex())),
    ("resolve_answer_robot", "RESOLVE_ANSWER",
     dict(id=8, kind=1, robot=15, number=15, rows=3, text_length=11, text=b"123-233-201".hex())),
    ("resolve_answer_mapping", "RESOLVE_ANSWER",
     dict(id=8, kind=3, robot=16, number=15, rows=4294967295, text_length=0, text="")),
    ("resolve_answer_a_part_of_the_text", "RESOLVE_ANSWER",
     dict(id=8, kind=2, robot=LEAST, number=GREATEST, rows=2147483648, text_length=255,
          text=bytes(range(97, 122)).hex() * 2)),
    ("resolve_answer_longest_on_the_wire", "RESOLVE_ANSWER",
     dict(id=16, kind=16, robot=0x10101010, number=0x10101010, rows=0x10101010, text_length=50,
          text="10" * 50)),
    ("resolve_answer_dle", "RESOLVE_ANSWER",
     dict(id=16, kind=16, robot=0x10101010, number=0x10101010, rows=0x10101010, text_length=16,
          text="10" * 16)),
]

# Whole frames with a right CRC that no message fits: name, unstuffed body, verdict.
BODIES = [
    ("scan_empty", "01 41", "bad-length"),
    ("scan_one_byte_short", "01 41 " + "01 " * 9, "bad-length"),
    ("scan_one_byte_long", "01 41 " + "01 " * 11, "bad-length"),
    ("scan_answer_empty", "01 C1", "bad-length"),
    ("scan_answer_with_half_a_row", "01 C1 00 03 00 32 00", "bad-length"),
    ("scan_answer_one_byte_long", "01 C1 00 03 00 32 00 EC FF 09 00 00", "bad-length"),
    ("scan_answer_of_eight_rows", "01 C1 " + "01 " * 64, "bad-length"),
    ("read_one_byte_short", "01 42 " + "01 " * 10, "bad-length"),
    ("read_one_byte_long", "01 42 " + "01 " * 12, "bad-length"),
    ("read_answer_without_its_block", "01 C2 03 00 FF FF 08 09 00 00 00 00 00 00", "bad-length"),
    ("read_answer_one_byte_short", "01 C2 " + "01 " * 43, "bad-length"),
    ("read_answer_one_byte_long", "01 C2 " + "01 " * 45, "bad-length"),
    ("write_empty", "01 43", "bad-length"),
    ("write_one_byte_short", "01 43 " + "01 " * 44, "bad-length"),
    ("write_one_byte_long", "01 43 " + "01 " * 46, "bad-length"),
    ("write_answer_one_byte_short", "01 C3 " + "01 " * 7, "bad-length"),
    ("write_answer_one_byte_long", "01 C3 " + "01 " * 9, "bad-length"),
    ("erase_one_byte_short", "01 44 " + "01 " * 14, "bad-length"),
    ("erase_one_byte_long", "01 44 " + "01 " * 16, "bad-length"),
    ("erase_answer_one_byte_short", "01 C4 " + "01 " * 7, "bad-length"),
    ("erase_answer_one_byte_long", "01 C4 " + "01 " * 9, "bad-length"),
    ("symbol_shorter_than_its_header", "01 45 01 02 03 00 00", "bad-length"),
    ("symbol_text_too_long", "01 45 01 02 03 00 00 00 " + "61 " * 57, "bad-length"),
    ("symbol_answer_one_byte_short", "01 C5 " + "01 " * 5, "bad-length"),
    ("symbol_answer_one_byte_long", "01 C5 " + "01 " * 7, "bad-length"),
    ("resolve_one_byte_short", "01 46 " + "01 " * 9, "bad-length"),
    ("resolve_one_byte_long", "01 46 " + "01 " * 11, "bad-length"),
    ("resolve_answer_shorter_than_its_header", "01 C6 " + "01 " * 13, "bad-length"),
    ("resolve_answer_of_more_text_than_there_is",
     "01 C6 02 0F 00 00 00 02 00 00 00 03 00 00 00 02 61 62 63", "bad-length"),
]
