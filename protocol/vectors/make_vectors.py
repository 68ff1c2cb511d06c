#!/usr/bin/env python3
"""Writes the protocol's test vectors: crc.txt, frames.txt, fields.txt, streams.txt, traces.txt,
net_records.txt, signed.txt.

    python3 make_vectors.py            write the files, beside this script
    python3 make_vectors.py --check    compare them with what would be written; exit 1 if different

Nothing here is shared with the implementation under test: the bytes come from naive_protocol.py, and
every verdict in the list below is what a person expects, checked against that file's reader before
anything is written. What is about tags is listed in tag_vectors.py, and what robots with nets leave
there in net_vectors.py; signed frames in signed_vectors.py; who may send when in trace_vectors.py.
"""

import math
import pathlib
import sys

import net_vectors
import signed_vectors
import tag_vectors
import trace_vectors
from naive_protocol import (MAX_DATA, NO_INTENSITIES, body_of, coded_of, crc16, read, wire_of)

# --------------------------------------------------------------------------------------------------
# The list. Good frames: name, message, fields.

GOOD = [
    ("sense_at_the_origin", "SENSE", dict(id=1, type=1, x=0, y=0, heading=0)),
    ("sense_of_the_worked_example", "SENSE", dict(id=7, type=1, x=1000, y=500, heading=0)),
    ("sense_facing_left", "SENSE", dict(id=7, type=1, x=1000, y=500, heading=16384)),
    ("sense_negative", "SENSE", dict(id=2, type=3, x=-1, y=-2, heading=65535)),
    ("sense_least", "SENSE", dict(id=254, type=15, x=-32768, y=-32768, heading=32768)),
    ("sense_greatest", "SENSE", dict(id=253, type=14, x=32767, y=32767, heading=32767)),
    ("sense_id_is_dle", "SENSE", dict(id=16, type=1, x=1, y=2, heading=3)),
    ("sense_data_holds_dle_stx", "SENSE", dict(id=3, type=2, x=0x0210, y=0x0102, heading=0x0210)),
    ("sense_data_holds_dle_etx", "SENSE", dict(id=3, type=2, x=0x0310, y=0x0102, heading=0x0310)),
    ("sense_data_is_all_dle", "SENSE", dict(id=3, type=2, x=0x1010, y=0x1010, heading=0x1010)),
    ("sense_dle_at_both_ends", "SENSE", dict(id=3, type=2, x=0x0010, y=0, heading=0x1000)),
    ("sense_crc_low_is_dle", "SENSE", dict(id=7, type=1, x=1000, y=500, heading=189)),
    ("sense_crc_high_is_dle", "SENSE", dict(id=7, type=1, x=1000, y=500, heading=10243)),
    ("sense_crc_is_dle_dle", "SENSE", dict(id=7, type=1, x=1000, y=500, heading=59582)),
    ("sense_crc_is_dle_stx", "SENSE", dict(id=7, type=1, x=1000, y=500, heading=4287)),
    ("sense_crc_is_dle_etx", "SENSE", dict(id=7, type=1, x=1000, y=500, heading=21312)),
    ("sense_answer_nothing_there", "SENSE_ANSWER", dict(id=1, type=1, left=0, right=0)),
    ("sense_answer_of_the_worked_example", "SENSE_ANSWER",
     dict(id=7, type=1, left=4096, right=2560)),
    ("sense_answer_negative", "SENSE_ANSWER", dict(id=2, type=3, left=-1, right=-4096)),
    ("sense_answer_saturated", "SENSE_ANSWER", dict(id=2, type=3, left=32767, right=-32767)),
    ("sense_answer_extremes", "SENSE_ANSWER", dict(id=254, type=15, left=-32768, right=32767)),
    ("sense_answer_dle", "SENSE_ANSWER", dict(id=16, type=1, left=0x1010, right=0x0310)),
    ("sense_wide_at_the_origin", "SENSE_WIDE", dict(id=1, type=1, x=0, y=0, heading=0)),
    ("sense_wide_beyond_narrow", "SENSE_WIDE", dict(id=4, type=2, x=32768, y=-32769, heading=1)),
    ("sense_wide_extremes", "SENSE_WIDE",
     dict(id=4, type=15, x=-2147483648, y=2147483647, heading=49152)),
    ("sense_wide_dle", "SENSE_WIDE",
     dict(id=16, type=1, x=0x10101010, y=0x02100310, heading=0x1010)),
    ("sense_wide_answer", "SENSE_WIDE_ANSWER", dict(id=4, type=2, left=300, right=-300)),
    ("sense_wide_answer_extremes", "SENSE_WIDE_ANSWER",
     dict(id=4, type=15, left=32767, right=-32768)),
    ("deposit_one", "DEPOSIT", dict(id=1, type=1, seq=0, x=100, y=200, quanta=1)),
    ("deposit_extremes", "DEPOSIT",
     dict(id=254, type=15, seq=255, x=-32768, y=32767, quanta=255)),
    ("deposit_dle", "DEPOSIT", dict(id=16, type=1, seq=16, x=0x1010, y=-0x0FF0, quanta=16)),
    ("deposit_answer", "DEPOSIT_ANSWER", dict(id=1, type=1, seq=0)),
    ("deposit_answer_dle", "DEPOSIT_ANSWER", dict(id=16, type=15, seq=16)),
    ("trace_at_the_origin", "TRACE", dict(id=1, type=1, seq=1, x=0, y=0, heading=0)),
    ("trace_extremes", "TRACE", dict(id=254, type=15, seq=255, x=32767, y=-32768, heading=65535)),
    ("trace_dle", "TRACE", dict(id=16, type=2, seq=16, x=0x0210, y=0x0310, heading=0x1010)),
    ("trace_answer", "TRACE_ANSWER", dict(id=1, type=1, seq=1, left=12, right=-34)),
    ("trace_answer_dle", "TRACE_ANSWER", dict(id=16, type=15, seq=16, left=0x0310, right=0x0210)),
    ("trace_wide_negative", "TRACE_WIDE",
     dict(id=5, type=1, seq=2, x=-40000, y=-40001, heading=8192)),
    ("trace_wide_extremes", "TRACE_WIDE",
     dict(id=254, type=15, seq=255, x=2147483647, y=-2147483648, heading=65535)),
    ("trace_wide_dle", "TRACE_WIDE",
     dict(id=16, type=1, seq=16, x=0x10101010, y=0x10101010, heading=0x1010)),
    ("trace_wide_answer", "TRACE_WIDE_ANSWER", dict(id=5, type=1, seq=2, left=-32768, right=5)),
    ("trace_wide_answer_dle", "TRACE_WIDE_ANSWER",
     dict(id=16, type=2, seq=16, left=0x1010, right=0x1010)),
    ("command_halt", "COMMAND", dict(id=1, seq=1, code=1)),
    ("command_halt_all", "COMMAND", dict(id=255, seq=9, code=1)),
    ("command_resume", "COMMAND", dict(id=1, seq=2, code=2)),
    ("command_speed", "COMMAND", dict(id=1, seq=3, code=3, speed_mm_s=-250)),
    ("command_go_to", "COMMAND", dict(id=1, seq=4, code=4, x=-32768, y=32767)),
    ("command_go_to_dle", "COMMAND", dict(id=16, seq=16, code=4, x=0x0210, y=0x0310)),
    ("command_follow_type", "COMMAND", dict(id=1, seq=5, code=5, type_to_follow=2)),
    ("command_pick_load", "COMMAND", dict(id=1, seq=6, code=6)),
    ("command_drop_load", "COMMAND", dict(id=1, seq=7, code=7)),
    ("command_set_parameter", "COMMAND",
     dict(id=1, seq=8, code=8, parameter=16, value=-2147483648)),
    ("command_get_parameter", "COMMAND", dict(id=1, seq=255, code=9, parameter=3)),
    ("command_ack_accepted", "COMMAND_ACK", dict(id=1, seq=1, code=1, result=0)),
    ("command_ack_refused", "COMMAND_ACK", dict(id=1, seq=3, code=3, result=11)),
    ("command_ack_dle", "COMMAND_ACK", dict(id=16, seq=16, code=4, result=0x0310)),
    ("event_load_picked", "EVENT", dict(id=1, seq=3, code=1, argument=0)),
    ("event_parameter_value", "EVENT", dict(id=1, seq=255, code=8, argument=-32768)),
    ("event_net_exception", "EVENT", dict(id=7, seq=9, code=12, argument=31)),
    ("event_dle", "EVENT", dict(id=16, seq=16, code=9, argument=0x1010)),
    ("event_ack", "EVENT_ACK", dict(id=1, seq=3)),
    ("event_ack_dle", "EVENT_ACK", dict(id=16, seq=16)),
    *tag_vectors.GOOD,
    *net_vectors.frames(crc16, tag_vectors),
    ("hello_of_the_worked_example", "HELLO",
     dict(id=7, nonce=42, firmware_version=1, round_period=0)),
    ("hello_extremes", "HELLO", dict(id=254, nonce=65535, firmware_version=255, round_period=255)),
    ("hello_dle", "HELLO", dict(id=16, nonce=0x0210, firmware_version=16, round_period=16)),
    ("hello_answer_of_the_worked_example", "HELLO_ANSWER",
     dict(id=7, nonce=42, protocol_version=1, epoch=1, pose_unit_10um=100, antenna_distance_mm=300,
          type_mask=0x0006, slot_ms=2, response_window_ms=10, last_opcode=0, last_seq=0)),
    ("hello_answer_remembers_a_trace", "HELLO_ANSWER",
     dict(id=7, nonce=43, protocol_version=1, epoch=1, pose_unit_10um=100, antenna_distance_mm=300,
          type_mask=0x0006, slot_ms=2, response_window_ms=10, last_opcode=0x31, last_seq=200)),
    ("hello_answer_extremes", "HELLO_ANSWER",
     dict(id=254, nonce=65535, protocol_version=255, epoch=65535, pose_unit_10um=65535,
          antenna_distance_mm=65535, type_mask=65534, slot_ms=255, response_window_ms=255,
          last_opcode=255, last_seq=255)),
    ("hello_answer_dle", "HELLO_ANSWER",
     dict(id=16, nonce=0x1010, protocol_version=16, epoch=0x1010, pose_unit_10um=0x0210,
          antenna_distance_mm=0x0310, type_mask=0x1010, slot_ms=16, response_window_ms=16,
          last_opcode=0x10, last_seq=16)),
    ("ping_empty", "PING", dict(id=1, payload="")),
    ("ping_nonce", "PING", dict(id=1, payload="DEADBEEF")),
    ("ping_longest", "PING", dict(id=254, payload="000102030405060708090A0B0C0D0E0F")),
    ("ping_longest_all_dle", "PING", dict(id=16, payload="10" * 16)),
    ("ping_answer_empty", "PING_ANSWER", dict(id=1, payload="")),
    ("ping_answer_nonce", "PING_ANSWER", dict(id=1, payload="DEADBEEF")),
    ("ping_answer_longest_all_dle", "PING_ANSWER", dict(id=16, payload="10" * 16)),
    ("round_empty", "ROUND",
     dict(id=255, number=0, turn_ms=0, turn_bytes=0, slot_ms=2, open_slots=255, left=[],
          right=[], turns=[])),
    ("round_first", "ROUND",
     dict(id=255, number=1, turn_ms=25, turn_bytes=20, slot_ms=2, open_slots=0, left=[],
          right=[], turns=[1, 7])),
    ("round_several", "ROUND",
     dict(id=255, number=2, turn_ms=20, turn_bytes=15, slot_ms=2, open_slots=4,
          left=[4096, -1, 0], right=[2560, -4096, 0], turns=[7, 1, 254, 3])),
    ("round_without_turns", "ROUND",
     dict(id=255, number=3, turn_ms=0, turn_bytes=0, slot_ms=2, open_slots=30, left=[32767],
          right=[-32767], turns=[])),
    ("round_reasons", "ROUND",
     dict(id=255, number=255, turn_ms=255, turn_bytes=140, slot_ms=255, open_slots=8,
          left=[NO_INTENSITIES, NO_INTENSITIES, -32767, NO_INTENSITIES], right=[0, 3, 3, 12],
          turns=[1])),
    ("round_of_one_robot_twice", "ROUND",
     dict(id=255, number=4, turn_ms=17, turn_bytes=14, slot_ms=2, open_slots=0, left=[1],
          right=[2], turns=[9, 9])),
    ("round_dle", "ROUND",
     dict(id=255, number=16, turn_ms=16, turn_bytes=16, slot_ms=16, open_slots=16,
          left=[0x1010, 0x0310], right=[0x0210, 0x1010], turns=[16, 17])),
    ("round_largest", "ROUND",
     dict(id=255, number=128, turn_ms=21, turn_bytes=16, slot_ms=2, open_slots=254,
          left=list(range(1, 12)), right=list(range(-1, -12, -1)), turns=list(range(244, 255)))),
    ("round_longest_on_the_wire", "ROUND",
     dict(id=255, number=16, turn_ms=16, turn_bytes=16, slot_ms=16, open_slots=16,
          left=[0x1010] * 11, right=[0x1010] * 11, turns=[16] * 11)),
    ("error_unknown_opcode", "ERROR", dict(id=1, refused_opcode=0x47, reason=1, seq=0)),
    ("error_bad_length_of_deposit", "ERROR", dict(id=1, refused_opcode=0x21, reason=2, seq=77)),
    ("error_off_the_map", "ERROR", dict(id=1, refused_opcode=0x01, reason=3, seq=0)),
    ("error_unknown_pheromone", "ERROR", dict(id=1, refused_opcode=0x2F, reason=4, seq=1)),
    ("error_sequence_reused", "ERROR", dict(id=1, refused_opcode=0x31, reason=5, seq=16)),
    ("error_say_hello", "ERROR", dict(id=1, refused_opcode=0x52, reason=6, seq=2)),
    ("error_busy", "ERROR", dict(id=1, refused_opcode=0x61, reason=7, seq=3)),
    ("error_read_only", "ERROR", dict(id=1, refused_opcode=0x21, reason=8, seq=4)),
    ("error_map_full", "ERROR", dict(id=1, refused_opcode=0x21, reason=9, seq=5)),
    ("error_not_permitted", "ERROR", dict(id=1, refused_opcode=0x21, reason=10, seq=6)),
    ("error_bad_value", "ERROR", dict(id=1, refused_opcode=0x21, reason=11, seq=7)),
    ("error_blocked_by_obstacle", "ERROR", dict(id=1, refused_opcode=0x31, reason=12, seq=8)),
    ("error_no_tag_in_range", "ERROR", dict(id=1, refused_opcode=0x42, reason=16, seq=0)),
    ("error_tag_protected", "ERROR", dict(id=1, refused_opcode=0x44, reason=17, seq=9)),
    ("error_tag_full", "ERROR", dict(id=1, refused_opcode=0x43, reason=18, seq=255)),
    ("error_generation_changed", "ERROR", dict(id=8, refused_opcode=0x43, reason=19, seq=16)),
    ("error_unknown_symbol", "ERROR", dict(id=1, refused_opcode=0x46, reason=20, seq=0)),
    ("error_everything_dle", "ERROR", dict(id=16, refused_opcode=0x10, reason=16, seq=16)),
]

# Whole frames with a right CRC that no message fits, or that are never to be delivered:
# name, unstuffed body, verdict.
BODIES = [
    ("opcode_sense_without_type", "01 00 00 00 00 00 00 01", "refused"),
    ("opcode_0x10", "01 10 01 02 03 04", "unknown-opcode"),
    ("opcode_sense_answer_without_type", "01 80 01 02 03 04", "unknown-opcode"),
    ("opcode_deposit_without_type", "01 20 01 02 03 04 05 06", "unknown-opcode"),
    ("opcode_tag_without_function", "01 40 01 02 03 04 05 06 07 08", "unknown-opcode"),
    ("opcode_tag_0x47", "01 47", "unknown-opcode"),
    ("opcode_tag_answer_without_function", "01 C0 00", "unknown-opcode"),
    ("opcode_tag_answer_holds_false_frame", "C1 C7 10 02 05 20 11 22", "unknown-opcode"),
    ("opcode_0x50", "01 50 00 00 00 00", "unknown-opcode"),
    ("opcode_0x53", "01 53 00 00 00 00", "unknown-opcode"),
    ("opcode_0x70", "01 70 00 00 00 00", "unknown-opcode"),
    ("opcode_0x7E", "01 7E 21 02 00", "unknown-opcode"),
    ("opcode_0xFF", "01 FF", "unknown-opcode"),
    ("longest_data", "C1 47 " + " ".join(f"{i:02X}" for i in range(100, 164)), "unknown-opcode"),
    ("longest_data_all_dle", "10 10 " + "10 " * 64, "unknown-opcode"),
    ("sense_too_short_crc_is_dle_dle", "01 02 40 6E", "bad-length"),
    ("sense_one_byte_short", "01 01 00 00 00 00 00", "bad-length"),
    ("sense_one_byte_long", "01 01 00 00 00 00 00 00 00", "bad-length"),
    ("deposit_empty", "01 21", "bad-length"),
    ("ping_too_long", "01 72 " + "AB " * 17, "bad-length"),
    ("command_halt_with_argument", "01 D1 01 01 00", "bad-length"),
    ("command_speed_without_argument", "01 D1 01 03", "bad-length"),
    ("command_unknown_code", "01 D1 01 0A", "bad-length"),
    *tag_vectors.BODIES,
    ("round_shorter_than_its_header", "FF F3 01 19 14 02 00", "bad-length"),
    ("round_without_an_answer_that_it_counts", "FF F3 01 19 14 02 00 01", "bad-length"),
    ("round_with_half_an_answer", "FF F3 01 19 14 02 00 02 00 10 00 0A 01 02", "bad-length"),
    ("round_of_twelve_answers", "FF F3 01 19 14 02 00 0C " + "00 10 00 0A " * 12, "bad-length"),
    ("round_of_fifteen_of_each", "FF F3 01 19 14 02 00 FF " + "01 " * 58, "bad-length"),
    ("round_of_twelve_turns", "FF F3 01 19 14 02 00 C0 01 02 03 04 05 06 07 08 09 0A 0B 0C",
     "bad-length"),
    ("round_with_a_turn_too_few", "FF F3 01 19 14 02 00 20 01", "bad-length"),
    ("round_with_a_turn_too_many", "FF F3 01 19 14 02 00 21 00 10 00 0A 01 02 03", "bad-length"),
    ("round_with_a_turn_of_id_zero", "FF F3 01 19 14 02 00 20 01 00", "bad-value"),
    ("round_with_a_turn_of_everybody", "FF F3 01 19 14 02 00 11 00 10 00 0A FF", "bad-value"),
    ("round_to_one_robot", "07 F3 01 19 14 02 00 10 07", "bad-value"),
    ("zero_line", "00 00", "refused"),
    ("zero_line_long", "00 00 00 00 00 00 00 00", "refused"),
    ("id_zero", "00 01 00 00 00 00 00 00", "refused"),
    ("opcode_zero", "01 00", "refused"),
]

# What never passes the receiver, as it would stand on the wire: name, wire, verdict.
DAMAGED = [
    ("crc_of_other_data", "10 02 07 01 E8 07 F4 01 00 00 61 FE 10 03", "bad-crc"),
    ("crc_high_byte_first", "10 02 07 01 E8 03 F4 01 00 00 FE 61 10 03", "bad-crc"),
    ("crc_covers_etx", "10 02 07 01 E8 03 F4 01 00 00 7F E9 10 03", "bad-crc"),
    ("crc_starts_with_ffff", "10 02 07 01 E8 03 F4 01 00 00 21 F5 10 03", "bad-crc"),
    ("crc_of_stuffed_bytes", "10 02 10 10 72 8C 20 10 03", "bad-crc"),
    ("crc_missing", "10 02 07 72 10 03", "runt"),
    ("dle_not_doubled", "10 02 10 01 00 00 00 00 00 00 11 CC 10 03", "bad-escape"),
    ("dle_then_zero", "10 02 01 72 10 00 00 00 10 03", "bad-escape"),
    # Who drops the two bytes, or the DLE alone, but stays inside the frame hears a good PING.
    ("good_without_the_illegal_escape", "10 02 01 72 10 55 81 B5 10 03", "bad-escape"),
    ("good_without_the_illegal_dle", "10 02 01 10 72 81 B5 10 03", "bad-escape"),
    ("empty_frame", "10 02 10 03", "runt"),
    ("one_byte_frame", "10 02 01 10 03", "runt"),
    ("two_zeros", "10 02 00 00 10 03", "runt"),
    ("three_dle", "10 02 10 10 10 10 10 10 10 03", "runt"),
    ("longest_and_one_more", "10 02 " + "55 " * (MAX_DATA + 5), "oversize"),
    ("longest_and_one_more_dle", "10 02 " + "10 10 " * (MAX_DATA + 5), "oversize"),
]

# Bytes as they may arrive without a pause, and the frames that come out: name, pieces, frames.
# "@name" is a frame of the lists above, "@name[n:]" the rest of it from byte n, counted from 0.
# "coded NAME" is the coded form of a ROUND, "coded NAME damaged n ..." the same with these bytes wrong.
STREAMS = [
    ("nothing", [], []),
    ("two_frames", ["@sense_at_the_origin", "@ping_empty"],
     ["@sense_at_the_origin", "@ping_empty"]),
    ("frame_noise_frame", ["@ping_empty", "00 FF 03 02", "@ping_nonce"],
     ["@ping_empty", "@ping_nonce"]),
    ("end_without_a_start", ["10 03", "@ping_nonce"], ["@ping_nonce"]),
    ("lone_dle_before", ["10", "@ping_nonce"], ["@ping_nonce"]),
    ("two_dle_before", ["10 10", "@ping_nonce"], ["@ping_nonce"]),
    ("dle_zero_before", ["10 00", "@ping_nonce"], ["@ping_nonce"]),
    ("start_twice", ["10 02", "@ping_nonce"], ["@ping_nonce"]),
    ("cut_short", ["10 02 07 01 E8", "@ping_nonce"], ["@ping_nonce"]),
    ("cut_short_pad", ["10 02 07 01 E8", "00", "@ping_nonce"], ["@ping_nonce"]),
    ("cut_after_dle", ["10 02 07 01 10", "@ping_nonce"], []),
    ("cut_after_dle_pad", ["10 02 07 01 10", "00", "@ping_nonce"], ["@ping_nonce"]),
    ("cut_after_dle_then_two", ["10 02 07 01 10", "@ping_nonce", "@ping_empty"], ["@ping_empty"]),
    ("cut_after_two_dle", ["10 02 07 01 10 10", "@ping_nonce"], ["@ping_nonce"]),
    ("joined_in_the_middle", ["@sense_of_the_worked_example[6:]", "@ping_nonce"], ["@ping_nonce"]),
    ("joined_at_a_false_frame", ["@opcode_tag_answer_holds_false_frame[5:]", "@ping_nonce"],
     ["05 20 11 22", "@ping_nonce"]),
    ("joined_before_a_false_frame", ["@opcode_tag_answer_holds_false_frame[4:]"], ["05 20 11 22"]),
    ("bad_crc_then_good", ["@crc_of_other_data", "@ping_nonce"], ["@ping_nonce"]),
    ("bad_escape_then_good", ["@dle_not_doubled", "@ping_nonce"], ["@ping_nonce"]),
    ("runt_then_good", ["@empty_frame", "@ping_nonce"], ["@ping_nonce"]),
    ("oversize_then_good", ["@longest_and_one_more", "AA 10 03", "@ping_nonce"], ["@ping_nonce"]),
    ("oversize_hides_nothing", ["@longest_and_one_more", "10", "@ping_nonce"], ["@ping_nonce"]),
    ("zero_line_then_good", ["00 " * 20, "@zero_line", "@ping_nonce"], ["@ping_nonce"]),
    ("coded_round_empty", ["coded round_empty"], ["@round_empty"]),
    ("coded_round_several", ["coded round_several"], ["@round_several"]),
    ("coded_round_dle", ["coded round_dle"], ["@round_dle"]),
    ("coded_round_largest", ["coded round_largest"], ["@round_largest"]),
    ("coded_round_longest", ["coded round_longest_on_the_wire", "@ping_nonce"],
     ["@round_longest_on_the_wire", "@ping_nonce"]),
    ("coded_round_begins_badly", ["coded round_several damaged 0"], ["@round_several"]),
    ("coded_round_rows_first_wrong", ["coded round_several damaged 4"], ["@round_several"]),
    ("coded_round_second_beginning_wrong", ["coded round_several damaged 5 6 7 8 9"],
     ["@round_several"]),
    ("coded_round_both_beginnings_wrong", ["coded round_several damaged 2 7", "@ping_nonce"],
     ["@ping_nonce"]),
    # round_several has three rows: bytes 10 to 33 of its coded form are DATA and CRC, 34 to 41 the
    # sum, 42 to 45 P, 46 to 49 Q.
    ("coded_round_one_byte_a_row", ["coded round_several damaged 10 14 33 41"], ["@round_several"]),
    ("coded_round_burst", ["coded round_several damaged 30 31 32"], ["@round_several"]),
    ("coded_round_a_row_lost", ["coded round_several damaged 11 14 17 20 23"], ["@round_several"]),
    ("coded_round_the_sum_lost", ["coded round_several damaged 34 35 36 37 38 39 40 41"],
     ["@round_several"]),
    ("coded_round_p_and_q_wrong", ["coded round_several damaged 42 43 48 49"], ["@round_several"]),
    ("coded_round_p_and_q_of_a_row_wrong", ["coded round_several damaged 43 47"],
     ["@round_several"]),
    ("coded_round_two_rows_lost", ["coded round_several damaged 10 13 16 11 14 17", "@ping_nonce"],
     ["@ping_nonce"]),
    ("coded_round_second_half", ["coded round_several[5:]", "@ping_nonce"],
     ["@round_several", "@ping_nonce"]),
    ("coded_round_of_no_rows", ["10 02 FF F4 F0", "@ping_nonce"], ["@ping_nonce"]),
    ("coded_round_of_nine_rows", ["10 02 FF F5 69", "@ping_nonce"], ["@ping_nonce"]),
]

CRCS = ["", "00", "00 00 00 00", "01", "80", "FF", "10", "31 32 33 34 35 36 37 38 39",
        "01 02 40 6E", "C1 C7 10 02 05 20 11 22", "07 01 E8 03 F4 01 00 00",
        "31 32 33 34 35 36 37 38 39 3D BB", "07 11 41 00 53 B9" + " 00" * 12,
        "07 11 41 00 53 B9" + " 00" * 12 + " 03", " ".join(f"{i:02X}" for i in range(256))]

# Known from elsewhere: the catalogues' check value, and the example of DF1's manual (Rockwell
# 1770-6.5.16), whose CRC covers the ETX that ours leaves out.
PUBLISHED = {
    "31 32 33 34 35 36 37 38 39": 0xBB3D,
    "07 11 41 00 53 B9" + " 00" * 12 + " 03": 0x4C6B,
}

# --------------------------------------------------------------------------------------------------
# The files.

DELIVERED = ("ok", "unknown-opcode", "bad-length", "bad-value")


def hexadecimal(data):
    return " ".join(f"{byte:02X}" for byte in data) or "-"


def damaged(wire, places):
    return bytes(byte ^ (0x5A + at) if at in places else byte for at, byte in enumerate(wire))


def header(*lines):
    made = ("Made by make_vectors.py: edit the list there. Columns are separated by |, bytes are",
            "hexadecimal, - stands for none, # begins a comment line.")
    return "".join(f"# {line}".rstrip() + "\n" for line in (*lines, "", *made))


def crc_file():
    text = header("CRC-16/ARC of some bytes.", "", "bytes | CRC as a number (sent low byte first)")
    for item in CRCS:
        data = bytes.fromhex(item)
        if PUBLISHED.get(item, crc16(data)) != crc16(data):
            raise ValueError(f"the CRC of {item} is not the published one")
        text += f"{hexadecimal(data)} | {crc16(data):04X}\n"
    return text


def frames():
    """name: (body or None, wire, verdict) of every frame; checks the verdicts."""
    table = {}

    def add(name, body, wire, verdict):
        if name in table:
            raise ValueError(f"{name} stands twice in the list")
        seen = read(wire)
        if [found for _, found in seen] != [verdict] or body is not None and seen[0][0] != body:
            raise ValueError(f"{name}: expected {verdict}, but the reader finds {seen}")
        table[name] = (body, wire, verdict)

    for name, message, fields in GOOD:
        body = body_of(message, fields)
        add(name, body, wire_of(body), "ok")
    if table["read_answer_of_the_reference"][0][-32:] != bytes.fromhex(tag_vectors.REFERENCE_BYTES):
        raise ValueError("the block of the reference has other bytes")
    for name, text, verdict in BODIES:
        body = bytes.fromhex(text)
        add(name, body, wire_of(body), verdict)
    for name, text, verdict in DAMAGED:
        add(name, None, bytes.fromhex(text), verdict)
    return table


def frames_file(table):
    text = header(
        "Frames, one by one: what they say, how they look on the wire, what a receiver does.", "",
        "name | ID OPCODE DATA, unstuffed (- where the wire holds no such thing) | wire | verdict",
        "",
        "verdict    ok              delivered; fields.txt says what it means",
        "           unknown-opcode  delivered by the decoder; no such opcode",
        "           bad-length      delivered by the decoder; wrong length for its opcode",
        "           bad-value       delivered by the decoder; a ROUND to a single ID, or with",
        "                           a turn of ID 0 or FF",
        "           refused         CRC right, but ID 0 or opcode 0",
        "           bad-crc         complete, but the CRC is wrong",
        "           bad-escape      DLE followed by something other than DLE, STX, ETX",
        "           oversize        more than 68 bytes, unstuffed, after DLE STX",
        "           runt            fewer than 4 bytes between the delimiters")
    for name, (body, wire, verdict) in table.items():
        shown = "-" if body is None else hexadecimal(body)
        text += f"{name} | {shown} | {hexadecimal(wire)} | {verdict}\n"
    return text


def shown_value(value):
    if isinstance(value, list):
        value = ",".join(map(str, value))
    return "-" if value == "" else str(value)


def fields_file():
    text = header(
        "What the frames with the verdict ok mean.", "",
        "name, as in frames.txt | message | field=value ...", "",
        "Values are decimal; only a PING's payload and a text are bytes. \"type\" is the pheromone",
        "type in the opcode's low four bits. COMMAND's arguments have a name each. Lists are",
        "separated by commas: a ROUND's left and right of its answers, and the IDs of its turns; the",
        "tag, dx, dy and generation of each row of SCAN's answer.")
    for name, message, fields in GOOD:
        shown = " ".join(f"{key}={shown_value(value)}" for key, value in fields.items())
        text += f"{name} | {message} | {shown}\n"
    return text


def streams_file(table):
    def coded(name, *places):
        name, _, part = name.partition("[")
        wire = damaged(coded_of(table[name][0]), [*map(int, places[1:])])
        first, _, last = part.rstrip("]").partition(":")
        return wire[int(first or 0):int(last or len(wire))]

    def bytes_of(piece, column):
        if piece.startswith("coded "):
            return coded(*piece.split()[1:])
        if not piece.startswith("@"):
            return bytes.fromhex(piece)
        name, _, start = piece[1:].partition("[")
        return table[name][column][int(start.rstrip(":]") or 0):]

    text = header(
        "Bytes that arrive without a pause, and the frames that a receiver delivers from them.", "",
        "name | bytes | ID OPCODE DATA of each delivered frame, separated by ;")
    for name, pieces, delivered in STREAMS:
        stream = b"".join(bytes_of(piece, 1) for piece in pieces)
        expected = [bytes_of(piece, 0) for piece in delivered]
        found = [body for body, verdict in read(stream) if verdict in DELIVERED]
        if found != expected:
            raise ValueError(f"{name}: expected {expected}, but the reader finds {found}")
        shown = " ; ".join(hexadecimal(body) for body in expected) or "-"
        text += f"{name} | {hexadecimal(stream)} | {shown}\n"
    return text


def traces_file():
    text = header(
        "What a client hears on a shared channel, and when it sends.", "",
        "name | ms: bytes; ... | MESSAGE from to; nothing until; ...", "",
        "The client has ID 7, asks SENSE of type 2, once in 200 ms, and takes part in rounds. At time 0 it",
        "has received the answer to its HELLO: slot 3 ms, window 30 ms, last seq 4. 9600 baud: the bytes of a",
        "piece follow each other, 1.04 ms each, and the last one of them is read at the time that is given,",
        "also while the client sends. No carrier; a gap timeout of 20 ms, and no link that is resynchronised.",
        "Nobody else was heard before. What is expected is in the order of time: a message whose first byte",
        "leaves from ... to ..., in ms, or \"nothing\" until then, counted from the end of its last frame with +.",
        "\"nothing\" ends with the message after it: nothing else comes in between. 1 ms more is permitted where",
        "a clock has such steps. MESSAGE/n has the number n; where there is a TRACE, the client asks TRACE of",
        "type 2 instead of SENSE, and repeats it byte for byte. Where a name has simple_ in it, the client has",
        "sent period 0 in HELLO; with slow_, slot and window are 12 and 60 ms; with adapter_, the client has an",
        "adapter that may hold bytes back for 16 ms. Over many boot counters, asks_within_its_window,",
        "request_of_another, its_answer_ends_the_window, hello_after_the_rounds and",
        "simple_draws_among_the_slots show each of eight slots.")

    def bytes_of(piece):
        if isinstance(piece, str):
            return bytes.fromhex(piece)
        body = body_of(*piece[:2])
        return damaged(coded_of(body), piece[2]) if len(piece) == 3 else wire_of(body)

    for name, heard, expected in trace_vectors.TRACES:
        data = [bytes_of(piece) for _, piece in heard]
        first_ms = math.ceil(len(data[0]) * 10_000 / 9600) if data else 0
        pieces = [f"{first_ms + at}: {hexadecimal(one)}" for (at, _), one in zip(heard, data)]
        sent = [" ".join([what, *(ms if ms[0] == "+" else str(first_ms + int(ms)) for ms in times)])
                for what, *times in map(str.split, expected)]
        text += f"{name} | {'; '.join(pieces) or '-'} | {'; '.join(sent)}\n"
    return text


def net_records_file():
    text = header(
        "Records of nets in blocks of tags, one by one: their bytes, and what a reader says.", "",
        "name | kind that is wanted | hash of the reader's net | 24 bytes | verdict | field=value ...",
        "",
        "verdict    ok         a record of this kind and net, with these fields",
        "           otherwise the first that applies:",
        "           no-record  the subject's namespace is not -32",
        "           version    not 1",
        "           crc        wrong",
        "           kind       another one",
        "           hash       of another net",
        "           value      a value that its field does not have")
    for name, wanted, record, verdict, fields in net_vectors.records(crc16):
        text += (f"{name} | {wanted} | {net_vectors.HASH:08X} | {hexadecimal(record)} | {verdict} | "
                 f"{fields}\n")
    return text


def signed_file():
    text = header(
        "Signed frames, and what their receiver makes of them (section 18).", "",
        "name | key | use | last | wire | ID OPCODE DATA | counter | MAC | verdict", "",
        "The receiver has accepted counters up to \"last\" with this key, of a use. Of the greeting",
        "that is the number of the HELLO that the client has sent; of a HELLO with the robot's own key",
        "it means nothing. The rest is what it finds: ID, OPCODE and DATA that the MAC covers; the",
        "whole counter; and the 16 bytes of the MAC that it computes. Numbers are decimal. Of coded",
        "frames, the wire may be damaged.", "",
        "verdict    ok      the tag is right, and the counter the last accepted from now on",
        "           wrong   the frame is ignored; without a MAC, it is too short, or no frame at all",
        "           key     no frame: the MAC is a key, or the mask of the group's")
    for name, key, use, last, wire, body, counter, mac, verdict in signed_vectors.rows():
        columns = (hexadecimal(key), use, last, hexadecimal(wire) or "-", hexadecimal(body) or "-",
                   counter, hexadecimal(mac) or "-", verdict)
        text += " | ".join(map(str, (name, *columns))) + "\n"
    return text


def main(arguments):
    if arguments not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    table = frames()
    files = {
        "crc.txt": crc_file(),
        "frames.txt": frames_file(table),
        "fields.txt": fields_file(),
        "streams.txt": streams_file(table),
        "traces.txt": traces_file(),
        "net_records.txt": net_records_file(),
        "signed.txt": signed_file(),
    }
    here = pathlib.Path(__file__).resolve().parent
    stale = []
    for name, text in files.items():
        path = here / name
        if not arguments:
            path.write_text(text, encoding="ascii", newline="\n")
        elif not path.exists() or path.read_bytes() != text.encode("ascii"):
            stale.append(name)
    for name in stale:
        print(f"{name} is not what make_vectors.py makes: run it and look at the difference")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
