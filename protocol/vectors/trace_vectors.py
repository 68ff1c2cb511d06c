"""The part of the test vectors that is about time: what client 7 hears on a shared channel and at what
time, in ms, the last byte of it; and what it sends when: "MESSAGE from to", when its first byte
leaves, or "nothing until". The first piece begins at once, and all times count from its end.
A piece is bytes, or a message and its fields, or these and the bytes of its coded form that are damaged.
make_vectors.py writes them; the header of traces.txt, which is there, has the rest.
"""


def turns(*ids, open_slots=0, number=1, answers=()):
    return ("ROUND", dict(id=255, number=number, turn_ms=20, turn_bytes=20, slot_ms=3, open_slots=open_slots,
                          left=[left for left, _ in answers], right=[right for _, right in answers],
                          turns=list(ids)))


def dripping(begin_ms, text):
    """A frame whose bytes come in steps of 15 ms, the first four and the last four together."""
    data = text.split()
    pieces = [data[:4], *([byte] for byte in data[4:-4]), data[-4:]]
    return [(begin_ms + 15 * i, " ".join(piece)) for i, piece in enumerate(pieces)]


OTHERS_SENSE = ("SENSE", dict(id=9, type=2, x=1, y=2, heading=3))
THIRDS_SENSE = ("SENSE", dict(id=3, type=2, x=1, y=2, heading=3))
OTHERS_ANSWER = ("SENSE_ANSWER", dict(id=9, type=2, left=1, right=2))
ITS_ANSWER = ("SENSE_ANSWER", dict(id=7, type=2, left=1, right=2))
DAMAGED_SENSE = "10 02 09 02 01 00 02 00 03 00 55 55 10 03"
HALT = ("COMMAND", dict(id=7, seq=1, code=1))
OTHERS_HALT = ("COMMAND", dict(id=9, seq=1, code=1))
OTHERS_ACK = ("COMMAND_ACK", dict(id=9, seq=1, code=1, result=0))
# A byte changed at each of these is repaired: one in a row, and the first of both beginnings.
REPAIRABLE, BEYOND_REPAIR = (2, 11), (10, 11, 12, 13, 14, 15, 16, 17)

TRACES = [
    ("asks_within_its_window", [], ["SENSE 1 80"]),
    ("request_of_another", [(0, OTHERS_SENSE)], ["nothing 30", "SENSE 31 107"]),
    ("its_answer_ends_the_window", [(0, OTHERS_SENSE), (19, OTHERS_ANSWER)],
     ["nothing 20", "SENSE 21 77"]),
    ("any_frame_ends_the_window", [(0, OTHERS_SENSE), (15, OTHERS_HALT), (27, OTHERS_ACK)],
     ["nothing 27", "SENSE 28 97"]),
    ("command_to_another", [(0, OTHERS_HALT)], ["nothing 30", "SENSE 31 107"]),
    ("event_of_another", [(0, ("EVENT", dict(id=9, seq=1, code=1, argument=0)))],
     ["nothing 30", "SENSE 31 107"]),
    ("hello_of_another", [(0, ("HELLO", dict(id=9, nonce=1, firmware_version=1, round_period=0)))],
     ["nothing 30", "SENSE 31 107"]),
    ("ping_of_another", [(0, ("PING", dict(id=9, payload="31")))], ["nothing 30", "SENSE 31 107"]),
    ("wide_trace_of_another", [(0, ("TRACE_WIDE", dict(id=9, type=2, seq=1, x=1, y=2, heading=3)))],
     ["nothing 30", "SENSE 31 107"]),
    ("ack_of_another_opens_no_window", [(0, OTHERS_ACK)], ["nothing 6", "SENSE 7 30"]),
    ("bad_escape_opens_no_window", [(0, "10 02 09 02 01 10 55 55 55 55")], ["nothing 6", "SENSE 7 30"]),
    ("damaged_frame_opens_a_window", [(0, DAMAGED_SENSE)],
     ["nothing 30", "SENSE 31 107"]),
    ("eighth_damaged_frame_opens_a_window", [(25 * i, DAMAGED_SENSE) for i in range(8)],
     ["nothing 205", "SENSE 206 282"]),
    ("tenth_damaged_frame_opens_none",
     [*((25 * i, DAMAGED_SENSE) for i in range(9)), (218, DAMAGED_SENSE)],
     ["nothing 223", "SENSE 224 247"]),
    ("valid_frame_takes_back_one_that_was_damaged",
     [*((25 * i, DAMAGED_SENSE) for i in range(8)), (190, OTHERS_ANSWER), (205, DAMAGED_SENSE)],
     ["nothing 235", "SENSE 236 312"]),
    ("valid_frame_takes_back_no_more",
     [*((25 * i, DAMAGED_SENSE) for i in range(8)), (190, OTHERS_ANSWER), (205, DAMAGED_SENSE),
      (230, DAMAGED_SENSE)],
     ["nothing 236", "SENSE 237 260"]),
    ("slow_request_of_another", [(0, OTHERS_SENSE)], ["nothing 51", "SENSE 52 152"]),
    # The server is heard meanwhile, so that no HELLO is due.
    ("five_retries_and_the_next_period", [(0, OTHERS_ANSWER), (300, OTHERS_ANSWER)],
     ["SENSE 1 80", *["nothing +30", "SENSE +31 +100"] * 5, "nothing +184", "SENSE +185 +200"]),
    ("adapter_waits_for_its_own", [], ["SENSE 1 320", "nothing +46", "SENSE +47 +330"]),
    ("adapter_request_of_another", [(0, OTHERS_SENSE)], ["nothing 78", "SENSE 79 400"]),
    ("frame_that_never_ends", [(0, "10 02 09 02 01 00")], ["nothing 20", "SENSE 21 107"]),
    ("frame_that_drips_for_longer_than_the_longest", dripping(0, "10 02 09 02" + " 01" * 24),
     ["nothing 160", "SENSE 162 210"]),
    ("silence_begins_the_longest_frame_again",
     [*dripping(0, DAMAGED_SENSE), *dripping(130, "10 02 09 02 01 00 02 00 03 00 01 02 03 04")],
     ["nothing 255", "SENSE 256 332"]),
    ("frames_that_never_end", [(10 * i, "10 02 09") for i in range(40)],
     ["nothing 160", "SENSE 162 200"]),
    ("bytes_outside_of_frames", [(0, OTHERS_ANSWER), *((1 + 2 * i, "55") for i in range(200))],
     ["nothing 166", "SENSE 167 210"]),
    ("ack_at_once", [(0, HALT)], ["COMMAND_ACK 0 2"]),
    ("ack_after_three_bytes_with_rounds", [(0, turns()), (27, HALT)], ["COMMAND_ACK 30 33"]),
    ("ack_in_its_turn", [(0, turns()), (27, HALT), (44, turns(7, 7, number=2))],
     ["nothing 44", "COMMAND_ACK 45 47", "SENSE +0 +2"]),
    ("ack_of_a_repeated_command", [(0, turns()), (27, HALT), (127, HALT)],
     ["COMMAND_ACK 30 33", "nothing 127", "COMMAND_ACK 130 133"]),
    ("ack_in_the_only_turn", [(0, turns()), (27, HALT), (43, turns(7, number=2))],
     ["nothing 43", "COMMAND_ACK 44 46", "nothing 100"]),
    ("first_turn", [(0, turns(7))], ["SENSE 1 3"]),
    ("turn_after_a_frame_that_was_heard", [(0, turns(9, 7)), (16, OTHERS_SENSE)], ["SENSE 16 18"]),
    ("turn_after_two_of_the_one_before", [(0, turns(9, 9, 7)), (14, OTHERS_ACK), (29, OTHERS_SENSE)],
     ["nothing 28", "SENSE 29 31"]),
    ("turn_not_after_a_frame_of_a_third", [(0, turns(9, 7)), (16, THIRDS_SENSE)],
     ["nothing 20", "SENSE 21 23"]),
    ("turn_is_lost_to_a_later_frame", [(0, turns(9, 7)), (26, OTHERS_SENSE)], ["nothing 97"]),
    ("turn_after_one_who_is_silent", [(0, turns(9, 7))], ["SENSE 21 23"]),
    ("turn_does_not_wait_for_the_idle_time", [(0, turns(9, 7)), (20, "55")], ["SENSE 21 23"]),
    ("turn_is_lost_to_an_incomplete_frame", [(0, turns(9, 7)), (20, "10 02 09 02")], ["nothing 97"]),
    ("turns_in_succession_without_an_ack", [(0, turns(7, 7))], ["SENSE 1 3", "nothing 57"]),
    ("second_turn_not_in_succession", [(0, turns(7, 9, 7))], ["SENSE 1 3", "nothing 77"]),
    ("turn_without_an_answer_goes_again",
     [(0, turns(7)), (40, turns(7, number=2, answers=[(-32768, 0)])),
      (80, turns(7, number=3, answers=[(-32768, 7)])), (120, turns(7, number=5, answers=[(1, 2)]))],
     ["SENSE 1 3", "SENSE 41 43", "SENSE 81 83", "SENSE 121 123"]),
    ("answer_is_in_the_round_one_higher",
     [(0, turns(7)), (40, turns(7, number=2, answers=[(1, 2)])), (80, turns(7, number=4, answers=[(1, 2)])),
      (120, turns(7, number=5, answers=[(1, 2)]))],
     ["TRACE/5 1 3", "TRACE/6 41 43", "TRACE/6 81 83", "TRACE/7 121 123"]),
    ("coded_round", [(0, (*turns(7), ()))], ["SENSE 1 3"]),
    ("coded_round_that_is_damaged", [(0, (*turns(7), REPAIRABLE))], ["SENSE 1 3"]),
    ("coded_round_beyond_repair", [(0, (*turns(7), BEYOND_REPAIR))], ["nothing 30", "SENSE 31 107"]),
    ("others_have_turns", [(0, turns(9, 3))], ["nothing 197"]),
    ("who_takes_part_leaves_the_opening", [(0, turns(9, open_slots=8))], ["nothing 1999"]),
    ("who_takes_part_leaves_the_time_between_rounds", [(0, turns(9, open_slots=255))], ["nothing 500"]),
    ("hello_after_the_rounds", [(0, turns(7))], ["SENSE 1 3", "nothing 1981", "HELLO 2000 2024"]),
    ("simple_waits_for_an_opening", [(0, turns(9))], ["nothing 1999"]),
    ("simple_draws_among_the_slots", [(0, turns(9, open_slots=8))], ["nothing 20", "SENSE 21 49"]),
    ("simple_sends_once_in_an_opening", [(0, turns(9, open_slots=2))],
     ["nothing 20", "SENSE 21 31", "nothing 1999"]),
    ("simple_heeds_no_window_of_a_turn", [(0, turns(9, open_slots=4)), (16, OTHERS_SENSE)],
     ["nothing 22", "SENSE 23 37"]),
    ("simple_may_send_in_an_opening_that_was_renewed",
     [(0, turns(9, open_slots=4)), (20, "55"), (39, OTHERS_SENSE), (61, OTHERS_ANSWER)],
     ["nothing 62", "SENSE 63 77"]),
    ("simple_slow_counts_as_unanswered_when_a_round_comes",
     [(0, turns(9, open_slots=1)), (70, turns(9, number=2, open_slots=1))],
     ["nothing 20", "SENSE 21 36", "nothing 90", "SENSE 91 106"]),
    ("simple_heeds_damage_in_a_turn", [(0, turns(9, open_slots=4)), (18, DAMAGED_SENSE)],
     ["nothing 1999"]),
    ("simple_contends_in_an_opening_of_255", [(0, turns(9, open_slots=255))],
     ["nothing 20", "SENSE 21 98"]),
    ("simple_takes_an_opening_early",
     [(0, turns(9, open_slots=2)), (60, ITS_ANSWER), (170, turns(9, number=2, open_slots=1))],
     ["nothing 20", "SENSE 21 31", "nothing 190", "SENSE 191 199"]),
    ("simple_takes_none_much_too_early",
     [(0, turns(9, open_slots=2)), (60, ITS_ANSWER), (110, turns(9, number=2, open_slots=1))],
     ["nothing 20", "SENSE 21 31", "nothing 1999"]),
]
