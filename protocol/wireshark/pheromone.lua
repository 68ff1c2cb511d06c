-- Wireshark's dissector for the pheromone protocol (../README.md is the specification).
--
--   wireshark -X lua_script:pheromone.lua capture.pcapng
--   tshark    -X lua_script:pheromone.lua -r capture.pcapng -T fields -e pheromone.message
--
-- or for good: copy it into Wireshark's folder of personal Lua plugins (Help > About > Folders).
--
-- A packet of a capture is what was read or written at once on a link: half a frame, or several.
-- Before it stand 8 bytes, little-endian: the link's number (2 bytes), the number of the connection
-- on it (4), the direction (1 byte: 1 from robots, 2 to robots), and 0. Frames are put together
-- across packets, each shown in the packet that ends it. TCP and UDP that were captured by other
-- means have no such bytes: Decode As > PHEROMONE.
--
-- Whether frames are signed (section 18) cannot be seen in them: there is a preference for it, off
-- unless you set it, for all links of a capture. Tags are not verified: that would take the keys.
--
--   tshark -o pheromone.signed:TRUE ...

local DLE, STX, ETX = 0x10, 0x02, 0x03
local MIN_FRAME, MAX_FRAME = 4, 68  -- bytes between the delimiters, unstuffed
local HEADER = 8
local FROM_ROBOTS = 1

local pheromone = Proto("pheromone", "Pheromone Protocol")
pheromone.prefs.gap_timeout_ms = Pref.uint("Gap timeout (ms)", 0,
  "A longer silence inside a frame ends it, as it does for the receiver; 0: never")

pheromone.prefs.signed = Pref.bool("Frames are signed", false,
  "Counter and tag follow the data of each frame (section 18)")

local REASONS = {
  [0] = "none", "unknown opcode", "bad length", "off the map", "unknown pheromone",
  "sequence reused", "say hello", "busy", "read-only", "map full", "not permitted", "bad value",
  "blocked by obstacle", [16] = "no tag in range", [17] = "tag protected", [18] = "tag full",
  [19] = "generation changed", [20] = "unknown symbol",
}
local COMMANDS = { "halt", "resume", "speed", "go to", "follow type", "pick the load",
                   "drop the load", "set parameter", "get parameter" }
local EVENTS = { "load picked", "load dropped", "obstacle", "off the map", "trail lost",
                 "fail-safe stop", "goal reached", "parameter value", "battery low",
                 "stopped by hand", "pose lost", "net exception" }
local NAMESPACES = {
  [0] = "an absolute IRI", [-1] = "string", [-2] = "character", [-3] = "integer", [-4] = "binary32",
  [-5] = "date and time", [-6] = "date", [-7] = "time of day", [-16] = "chain of fragments",
  [-17] = "robot", [-18] = "tag", [-32] = "record of a net",
}
local NET_RECORD, NET_RECORD_SIZE, NET_VERSION, MAX_CANDIDATES = -32, 24, 1, 11
local NET_KINDS = { "trigger vector", "environment", "robot" }
local NET_ACTIONS = { "present", "pass", "leave", "choose A", "choose B", "store A", "store B",
                      "take" }
local NET_OUTCOMES = { [0] = "none", "accepted", "refused" }
local SYMBOL_KINDS = { "robot", "string", "mapping", "row" }
-- The verdicts on frames that a receiver does not drop.
local DELIVERED = { ok = true, ["unknown-opcode"] = true, ["bad-length"] = true,
                    ["bad-value"] = true }

local f = {
  link = ProtoField.uint16("pheromone.link", "Link"),
  connection = ProtoField.uint32("pheromone.connection", "Connection"),
  direction = ProtoField.uint8("pheromone.direction", "Direction", base.DEC,
                               { "from robots", "to robots" }),
  verdict = ProtoField.string("pheromone.verdict", "Verdict"),
  message = ProtoField.string("pheromone.message", "Message"),
  id = ProtoField.uint8("pheromone.id", "Client ID"),
  opcode = ProtoField.uint8("pheromone.opcode", "Opcode", base.HEX),
  type = ProtoField.uint8("pheromone.type", "Pheromone type", base.DEC, nil, 0x0F),
  crc = ProtoField.uint16("pheromone.crc", "CRC-16/ARC", base.HEX),
  data = ProtoField.bytes("pheromone.data", "Data"),
  seq = ProtoField.uint8("pheromone.seq", "Seq"),
  x = ProtoField.int32("pheromone.x", "x (pose units)"),
  y = ProtoField.int32("pheromone.y", "y (pose units)"),
  heading = ProtoField.uint16("pheromone.heading", "Heading (65536 to a turn)"),
  left = ProtoField.int16("pheromone.left", "Left antenna (1/4096)"),
  right = ProtoField.int16("pheromone.right", "Right antenna (1/4096)"),
  quanta = ProtoField.uint8("pheromone.quanta", "Quanta"),
  command = ProtoField.uint8("pheromone.command", "Command", base.DEC, COMMANDS),
  speed = ProtoField.int16("pheromone.speed", "Speed (mm/s)"),
  follow_type = ProtoField.uint8("pheromone.follow_type", "Follow pheromone type"),
  parameter = ProtoField.uint8("pheromone.parameter", "Parameter"),
  value = ProtoField.int32("pheromone.value", "Value"),
  result = ProtoField.int16("pheromone.result", "Result", base.DEC, REASONS),
  event = ProtoField.uint8("pheromone.event", "Event", base.DEC, EVENTS),
  argument = ProtoField.int16("pheromone.argument", "Argument"),
  nonce = ProtoField.uint16("pheromone.nonce", "Nonce"),
  firmware_version = ProtoField.uint8("pheromone.firmware_version", "Firmware version"),
  round_period = ProtoField.uint8("pheromone.round_period", "Period of turns (20 ms)"),
  protocol_version = ProtoField.uint8("pheromone.protocol_version", "Protocol version"),
  epoch = ProtoField.uint16("pheromone.epoch", "Epoch"),
  pose_unit = ProtoField.uint16("pheromone.pose_unit", "Pose unit (10 um)"),
  antenna_distance = ProtoField.uint16("pheromone.antenna_distance", "Antenna distance (mm)"),
  type_mask = ProtoField.uint16("pheromone.type_mask", "Pheromone types", base.HEX),
  slot = ProtoField.uint8("pheromone.slot", "Slot (ms)"),
  window = ProtoField.uint8("pheromone.window", "Response window (ms)"),
  last_opcode = ProtoField.uint8("pheromone.last_opcode", "Last opcode", base.HEX),
  last_seq = ProtoField.uint8("pheromone.last_seq", "Last seq"),
  payload = ProtoField.bytes("pheromone.payload", "Payload"),
  refused_opcode = ProtoField.uint8("pheromone.refused_opcode", "Refused opcode", base.HEX),
  reason = ProtoField.uint8("pheromone.reason", "Reason", base.DEC, REASONS),
  number = ProtoField.uint8("pheromone.number", "Round"),
  turn_ms = ProtoField.uint8("pheromone.turn_ms", "Length of a turn (ms)"),
  turn_bytes = ProtoField.uint8("pheromone.turn_bytes", "Longest frame of a turn (bytes)"),
  open_slots = ProtoField.uint8("pheromone.open_slots", "Open slots"),
  counts = ProtoField.uint8("pheromone.counts", "Number of turns and of answers", base.HEX),
  turn = ProtoField.uint8("pheromone.turn", "Turn of client"),
  after = ProtoField.uint16("pheromone.after", "After tag"),
  more = ProtoField.uint8("pheromone.more", "Further tags in range"),
  tag = ProtoField.uint16("pheromone.tag", "Tag"),
  dx = ProtoField.int16("pheromone.dx", "dx (pose units)"),
  dy = ProtoField.int16("pheromone.dy", "dy (pose units)"),
  generation = ProtoField.uint16("pheromone.generation", "Generation of the tag"),
  tag_slot = ProtoField.uint8("pheromone.tag_slot", "Slot"),
  next_slot = ProtoField.uint8("pheromone.next_slot", "Next slot"),
  slots = ProtoField.uint8("pheromone.slots", "Slots of the tag"),
  tag_generation = ProtoField.uint16("pheromone.tag_generation", "Tag generation"),
  slot_generation = ProtoField.uint16("pheromone.slot_generation", "Slot generation"),
  lease = ProtoField.uint16("pheromone.lease", "Lease (s)"),
  block_flags = ProtoField.uint8("pheromone.block_flags", "Flags (1: privileged)", base.HEX),
  write_flags = ProtoField.uint8("pheromone.write_flags", "Flags (1: REPLACE, 2: EXPECT)",
                                 base.HEX),
  expected = ProtoField.uint16("pheromone.expected", "Expected generation"),
  author = ProtoField.int32("pheromone.author", "Author"),
  time = ProtoField.uint32("pheromone.time", "Time (Unix s)"),
  subject_namespace = ProtoField.int32("pheromone.subject_namespace", "Namespace of the subject"),
  subject = ProtoField.int32("pheromone.subject", "Subject"),
  predicate_namespace = ProtoField.int32("pheromone.predicate_namespace",
                                         "Namespace of the predicate"),
  predicate = ProtoField.int32("pheromone.predicate", "Predicate"),
  object_namespace = ProtoField.int32("pheromone.object_namespace", "Namespace of the object"),
  object = ProtoField.int32("pheromone.object", "Object"),
  kind = ProtoField.uint8("pheromone.kind", "Kind of symbol", base.DEC, SYMBOL_KINDS),
  robot = ProtoField.int32("pheromone.robot", "Robot"),
  symbol_number = ProtoField.int32("pheromone.symbol_number", "Number"),
  offset = ProtoField.uint8("pheromone.offset", "Offset in the text"),
  rows = ProtoField.uint32("pheromone.rows", "Rows of all tables"),
  text_length = ProtoField.uint8("pheromone.text_length", "Length of the whole text"),
  text = ProtoField.bytes("pheromone.text", "Text"),
  counter = ProtoField.uint16("pheromone.counter", "Counter, its low bytes"),
  hello_number = ProtoField.uint16("pheromone.hello_number", "Number of this HELLO"),
  server_nonce = ProtoField.bytes("pheromone.server_nonce", "Nonce of the server"),
  group_key = ProtoField.bytes("pheromone.group_key", "Key of the group, masked"),
  group_counter = ProtoField.uint32("pheromone.group_counter", "Counter of the group"),
  mac = ProtoField.bytes("pheromone.mac", "Tag of the signature"),
  net_verdict = ProtoField.string("pheromone.net_verdict", "Verdict"),
  net_version = ProtoField.uint8("pheromone.net_version", "Version"),
  net_kind = ProtoField.uint8("pheromone.net_kind", "Kind", base.DEC, NET_KINDS),
  net_hash = ProtoField.uint32("pheromone.net_hash", "Hash of the net", base.HEX),
  net_crc = ProtoField.uint16("pheromone.net_crc", "CRC-16/ARC", base.HEX),
  net_candidate = ProtoField.uint8("pheromone.net_candidate", "Transition of the tag"),
  net_state = ProtoField.uint8("pheromone.net_state",
                               "State (1: green, 2: advice A, 4: advice B)", base.HEX),
  net_outcome = ProtoField.uint8("pheromone.net_outcome", "Outcome", base.DEC, NET_OUTCOMES),
  net_robot = ProtoField.int32("pheromone.net_robot", "Of robot"),
  net_seq = ProtoField.uint8("pheromone.net_seq", "Seq of the record"),
  net_action = ProtoField.uint8("pheromone.net_action", "Action", base.DEC, NET_ACTIONS),
  net_transition = ProtoField.uint8("pheromone.net_transition", "Transition"),
  net_amount = ProtoField.uint16("pheromone.net_amount", "Amount"),
  net_left = ProtoField.uint16("pheromone.net_left", "Left in the source"),
  net_energy = ProtoField.uint16("pheromone.net_energy", "Energy of the robot"),
}
local fields = {}
for _, field in pairs(f) do fields[#fields + 1] = field end
pheromone.fields = fields

local e_damaged = ProtoExpert.new("pheromone.damaged", "A frame that a receiver drops",
  expert.group.CHECKSUM, expert.severity.ERROR)
local e_malformed = ProtoExpert.new("pheromone.malformed", "Not a message of this protocol",
  expert.group.MALFORMED, expert.severity.WARN)
local e_error = ProtoExpert.new("pheromone.refusal", "The server refuses",
  expert.group.RESPONSE_CODE, expert.severity.NOTE)
local e_net = ProtoExpert.new("pheromone.net_record", "Not a valid record of a net",
  expert.group.MALFORMED, expert.severity.WARN)
pheromone.experts = { e_damaged, e_malformed, e_error, e_net }

-- ---------------------------------------------------------------- Messages.

-- Layouts of DATA: { field, bytes, signed, remark } in order; the remark may be a table of remarks by
-- value. In the services that take a pheromone type, the key is the opcode without it.
local POSE = { { f.x, 2, true }, { f.y, 2, true }, { f.heading, 2 } }
local WIDE_POSE = { { f.x, 4, true }, { f.y, 4, true }, { f.heading, 2 } }
local SEQ = { f.seq, 1 }
local ANTENNAS = { { f.left, 2, true }, { f.right, 2, true } }
local function after_seq(items) return { SEQ, table.unpack(items) } end

local TYPED = {
  [0x00] = { "SENSE", POSE }, [0x80] = { "SENSE_ANSWER", ANTENNAS },
  [0x10] = { "SENSE_WIDE", WIDE_POSE }, [0x90] = { "SENSE_WIDE_ANSWER", ANTENNAS },
  [0x20] = { "DEPOSIT", { SEQ, { f.x, 2, true }, { f.y, 2, true }, { f.quanta, 1 } } },
  [0xA0] = { "DEPOSIT_ANSWER", { SEQ } },
  [0x30] = { "TRACE", after_seq(POSE) }, [0xB0] = { "TRACE_ANSWER", after_seq(ANTENNAS) },
  [0x60] = { "TRACE_WIDE", after_seq(WIDE_POSE) },
  [0xE0] = { "TRACE_WIDE_ANSWER", after_seq(ANTENNAS) },
}
local STATEMENT = {
  { f.subject_namespace, 4, true, NAMESPACES }, { f.subject, 4, true },
  { f.predicate_namespace, 4, true, NAMESPACES }, { f.predicate, 4, true },
  { f.object_namespace, 4, true, NAMESPACES }, { f.object, 4, true } }
local AT_TAG = { { f.x, 4, true }, { f.y, 4, true }, { f.tag, 2 }, { f.tag_slot, 1 } }
local WRITTEN = { SEQ, { f.tag, 2 }, { f.tag_slot, 1 }, { f.slot_generation, 2 },
                  { f.tag_generation, 2 } }
local TAG_ROW = { { f.tag, 2 }, { f.dx, 2, true }, { f.dy, 2, true }, { f.generation, 2 } }
local function joined(...)
  local all = {}
  for _, items in ipairs({ ... }) do
    for _, item in ipairs(items) do all[#all + 1] = item end
  end
  return all
end

local OTHERS = {
  [0x41] = { "SCAN", { { f.x, 4, true }, { f.y, 4, true }, { f.after, 2 } } },
  [0x42] = { "READ", AT_TAG },
  [0xC2] = { "READ_ANSWER", joined(
    { { f.tag, 2 }, { f.tag_slot, 1 }, { f.next_slot, 1 }, { f.slots, 1 }, { f.tag_generation, 2 },
      { f.slot_generation, 2 }, { f.lease, 2 }, { f.block_flags, 1 }, { f.author, 4, true },
      { f.time, 4 } }, STATEMENT) },
  [0x43] = { "WRITE", joined(
    { SEQ }, AT_TAG, { { f.write_flags, 1 }, { f.expected, 2 }, { f.lease, 2 }, { f.time, 4 } },
    STATEMENT) },
  [0xC3] = { "WRITE_ANSWER", WRITTEN },
  [0x44] = { "ERASE", joined({ SEQ }, AT_TAG, { { f.write_flags, 1 }, { f.expected, 2 } }) },
  [0xC4] = { "ERASE_ANSWER", WRITTEN },
  [0xC5] = { "SYMBOL_ANSWER", { SEQ, { f.kind, 1 }, { f.symbol_number, 4, true } } },
  [0x46] = { "RESOLVE", { { f.kind, 1 }, { f.robot, 4, true }, { f.symbol_number, 4, true },
                          { f.offset, 1 } } },
  [0x51] = { "COMMAND_ACK", { SEQ, { f.command, 1 }, { f.result, 2, true } } },
  [0x52] = { "EVENT", { SEQ, { f.event, 1 }, { f.argument, 2, true } } },
  [0xD2] = { "EVENT_ACK", { SEQ } },
  [0x71] = { "HELLO", { { f.nonce, 2 }, { f.firmware_version, 1 }, { f.round_period, 1 } } },
  [0xF1] = { "HELLO_ANSWER", {
    { f.nonce, 2 }, { f.protocol_version, 1 }, { f.epoch, 2 }, { f.pose_unit, 2 },
    { f.antenna_distance, 2 }, { f.type_mask, 2 }, { f.slot, 1 }, { f.window, 1 },
    { f.last_opcode, 1 }, { f.last_seq, 1 } } },
  [0xFE] = { "ERROR", { { f.refused_opcode, 1 }, { f.reason, 1 }, SEQ } },
}
local ARGUMENTS = {
  {}, {}, { { f.speed, 2, true } }, { { f.x, 2, true }, { f.y, 2, true } },
  { { f.follow_type, 1 } }, {}, {}, { { f.parameter, 1 }, { f.value, 4, true } },
  { { f.parameter, 1 } },
}
-- What ends with a text: name, layout of what is before it, the longest text.
local WITH_TEXT = {
  [0x45] = { "SYMBOL", { SEQ, { f.kind, 1 }, { f.symbol_number, 4, true } }, 56 },
  [0xC6] = { "RESOLVE_ANSWER",
             { { f.kind, 1 }, { f.robot, 4, true }, { f.symbol_number, 4, true }, { f.rows, 4 },
               { f.text_length, 1 } }, 50 },
}
local MAX_PING = 16
-- Where a statement is in the DATA of what carries one, and what may be in a record of a net there.
local STATEMENT_AT = { [0xC2] = 20, [0x43] = 21 }
local NET_PAYLOADS = {
  {},
  { { f.net_state, 0, 1 }, { f.net_outcome, 1, 1 }, { f.net_robot, 2, 4 }, { f.net_seq, 6, 1 },
    { f.net_amount, 8, 2 }, { f.net_left, 10, 2 } },
  { { f.net_seq, 0, 1 }, { f.net_action, 1, 1 }, { f.net_transition, 2, 1 }, { f.net_amount, 4, 2 },
    { f.net_energy, 6, 2 } },
}
local SCAN_ANSWER, MAX_TAG_ROWS, TAG_ROW_BYTES = 0xC1, 7, 8
local ROUND, ROUND_HEADER, MAX_TURNS = 0xF3, 6, 11
local EVERYBODY = 0xFF

-- What is behind DATA if frames are signed.
local MAC = { f.mac, 4 }
local OF_ONE = { { f.counter, 1 }, MAC }
local OF_ALL = { { f.counter, 2 }, MAC }
-- HELLO that asks for a session, and the greeting that answers it, are told by their lengths.
local HELLO, HELLO_BYTES, OF_HELLO = 0x71, 4, { { f.hello_number, 2 }, MAC }
local GREETING, GREETING_BYTES = 0xF1, 34
local GREETING_DATA = { { f.nonce, 2 }, { f.server_nonce, 8 }, { f.group_key, 16 },
                        { f.group_counter, 4 } }
local function is_greeting(opcode, length)
  return pheromone.prefs.signed and opcode == GREETING and length == GREETING_BYTES
end
local function signature_layout(body)
  if not pheromone.prefs.signed then return {} end
  local length = #body - MIN_FRAME
  return body[1] == EVERYBODY and OF_ALL or
      is_greeting(body[2], length) and { MAC } or
      body[2] == HELLO and length == HELLO_BYTES + 6 and OF_HELLO or OF_ONE
end

local function length_of(layout)
  local length = 0
  for _, item in ipairs(layout) do length = length + item[2] end
  return length
end

-- The layout of an answer to SCAN, or none if the length is wrong.
local function scan_answer_layout(data)
  local rows = (data:len() - 1) / TAG_ROW_BYTES
  if rows < 0 or rows > MAX_TAG_ROWS or rows ~= math.floor(rows) then return nil end
  local layout = { { f.more, 1 } }
  for _ = 1, rows do layout = joined(layout, TAG_ROW) end
  return layout
end

-- The layout of what ends with a text, or none if the length is wrong.
local function text_layout(opcode, data)
  local _, before, most = table.unpack(WITH_TEXT[opcode])
  local length = data:len() - length_of(before)
  if length < 0 or length > most then return nil end
  if opcode == 0xC6 and length > data:get_index(length_of(before) - 1) then return nil end
  local text = data:raw(length_of(before), length)
  return joined(before, { { f.text, length, false, not text:find("%c") and text or nil } })
end

-- The layout of a ROUND, or none if the length is wrong.
local function round_layout(data)
  if data:len() < ROUND_HEADER then return nil end
  local counts = data:get_index(ROUND_HEADER - 1)
  local answers, turns = counts % 16, bit32.rshift(counts, 4)
  if answers > MAX_TURNS or turns > MAX_TURNS or
      data:len() ~= ROUND_HEADER + 4 * answers + turns then
    return nil
  end
  local layout = { { f.number, 1 }, { f.turn_ms, 1 }, { f.turn_bytes, 1 }, { f.slot, 1 },
                   { f.open_slots, 1 }, { f.counts, 1 } }
  for i = 1, answers do
    local at = ROUND_HEADER + 4 * (i - 1)
    if data:get_index(at) == 0x00 and data:get_index(at + 1) == 0x80 then
      local reason = data:get_index(at + 2) + 256 * data:get_index(at + 3)
      layout[#layout + 1] = { f.left, 2, true, "no intensities" }
      layout[#layout + 1] = { f.right, 2, true,
                              reason == 0 and "not heard or not answered yet" or
                              REASONS[reason] or "unknown reason" }
    else
      layout[#layout + 1] = ANTENNAS[1]
      layout[#layout + 1] = ANTENNAS[2]
    end
  end
  for _ = 1, turns do layout[#layout + 1] = { f.turn, 1 } end
  return layout
end

-- Of a ROUND whose length is right.
local function has_bad_value(body)
  if body[1] ~= EVERYBODY then return true end
  local counts = body[2 + ROUND_HEADER]
  local turns = 2 + ROUND_HEADER + 4 * (counts % 16)
  for i = turns + 1, turns + math.floor(counts / 16) do
    if body[i] == 0 or body[i] == EVERYBODY then return true end
  end
  return false
end

-- The name of a message and the layout of its DATA; no layout: the length is wrong; no name: there
-- is no such opcode.
local function find_layout(opcode, data)
  local known = OTHERS[opcode]
  local typed = TYPED[opcode - opcode % 16]
  if not known and typed and opcode % 16 ~= 0 then known = typed end
  if is_greeting(opcode, data:len() + MAC[2]) then
    return "GREETING", GREETING_DATA, false
  elseif opcode == 0x72 or opcode == 0xF2 then
    local name = opcode == 0x72 and "PING" or "PING_ANSWER"
    if data:len() > MAX_PING then return name, nil end
    return name, { { f.payload, data:len() } }, false
  elseif opcode == ROUND then
    return "ROUND", round_layout(data), false
  elseif opcode == SCAN_ANSWER then
    return "SCAN_ANSWER", scan_answer_layout(data), false
  elseif WITH_TEXT[opcode] then
    return WITH_TEXT[opcode][1], text_layout(opcode, data), false
  elseif opcode == 0xD1 then
    local arguments = data:len() >= 2 and ARGUMENTS[data:get_index(1)]
    if not arguments then return "COMMAND", nil end
    known = { "COMMAND", { SEQ, { f.command, 1 }, table.unpack(arguments) } }
  end
  if not known then return nil, nil end
  if length_of(known[2]) ~= data:len() then return known[1], nil end
  return known[1], known[2], typed ~= nil and known == typed
end

-- ---------------------------------------------------------------- Frames.

local function byte_array(values, first, count)
  local bytes = ByteArray.new()
  bytes:set_size(count)
  for i = 1, count do bytes:set_index(i - 1, values[first + i]) end
  return bytes
end

-- Without a signature; none if there is no room for it.
local function data_of(body)
  local length = #body - MIN_FRAME - length_of(signature_layout(body))
  return length >= 0 and byte_array(body, 2, length) or nil
end

local function crc16(bytes, count)
  local crc = 0
  for i = 0, count - 1 do
    crc = bit32.bxor(crc, bytes:get_index(i))
    for _ = 1, 8 do
      if crc % 2 == 1 then
        crc = bit32.bxor(bit32.rshift(crc, 1), 0xA001)
      else
        crc = bit32.rshift(crc, 1)
      end
    end
  end
  return crc
end

local function judge(body)
  if #body < MIN_FRAME then return "runt" end
  local bytes = byte_array(body, 0, #body)
  local sent = bytes:get_index(#body - 2) + 256 * bytes:get_index(#body - 1)
  if crc16(bytes, #body - 2) ~= sent then return "bad-crc" end
  if body[1] == 0 or body[2] == 0 then return "refused" end
  local data = data_of(body)
  if not data then return "bad-length" end
  local name, layout = find_layout(body[2], data)
  if not name then return "unknown-opcode" end
  if not layout then return "bad-length" end
  if body[2] == ROUND and has_bad_value(body) then return "bad-value" end
  return "ok"
end

-- A coded ROUND (section 4), or answer to a signed HELLO (section 18): rows of eight bytes, one more
-- that is their sum, P and Q of each.
local CODED, CODED_HELLO, CODED_COLUMNS, MAX_CODED_ROWS, LEAD = 0xF4, 0xF6, 8, 8, 5
local CODED_HELLO_BYTES = { [3] = 15 + 5, [5] = GREETING_BYTES }  -- of DATA, by rows

local function double(value)
  value = 2 * value
  return value > 255 and bit32.bxor(value, 0x11D) or value
end

-- How many bytes follow the first three of a body, and the number of rows, if it is one.
local function coded_size(body)
  local again = body[2] % 2
  if body[2] - again ~= (body[1] == EVERYBODY and CODED or CODED_HELLO) then return nil end
  local rows = body[3] % 16
  if math.floor(body[3] / 16) ~= 15 - rows or rows < 1 or rows > MAX_CODED_ROWS then return nil end
  if body[1] ~= EVERYBODY and not CODED_HELLO_BYTES[rows] then return nil end
  return (CODED_COLUMNS + 2) * (rows + 1) + (1 - again) * LEAD, rows
end

-- The message in these bytes, as a frame's body; they may be damaged.
local function decode_code(id, code, rows)
  local function place(row, column)  -- counted from 0
    return row < rows and rows * column + row + 1 or CODED_COLUMNS * rows + column + 1
  end
  local checks = CODED_COLUMNS * (rows + 1) + 1
  local lost
  for row = 0, rows do
    local p, q = code[checks + row], 0
    for column = CODED_COLUMNS - 1, 0, -1 do
      local value = code[place(row, column)]
      p = bit32.bxor(p, value)
      q = bit32.bxor(double(q), value)
    end
    q = bit32.bxor(q, code[checks + rows + 1 + row])
    if p ~= 0 and q ~= 0 then
      local column, power = 0, p
      while column < CODED_COLUMNS and power ~= q do column, power = column + 1, double(power) end
      if column < CODED_COLUMNS then
        code[place(row, column)] = bit32.bxor(code[place(row, column)], p)
      else
        lost = row
      end
    end
  end
  for column = 0, lost and CODED_COLUMNS - 1 or -1 do
    local sum = 0
    for row = 0, rows do
      if row ~= lost then sum = bit32.bxor(sum, code[place(row, column)]) end
    end
    code[place(lost, column)] = sum
  end
  local body = { id ~= 0 and id or DLE, id == EVERYBODY and ROUND or GREETING }
  local size = CODED_HELLO_BYTES[rows]
  if id == EVERYBODY then
    local counts = code[ROUND_HEADER]
    size = ROUND_HEADER + 4 * (counts % 16) + math.floor(counts / 16) + length_of(signature_layout(body))
  end
  size = size + 2
  for i = 1, math.min(size, CODED_COLUMNS * rows) do body[#body + 1] = code[i] end
  return body
end

-- A receiver as section 2 of the specification has it. Byte by byte; `ended(body, verdict, first,
-- last)` is called for each frame that ends, with the places of its bytes in this packet.
local Receiver = {}
Receiver.__index = Receiver

function Receiver.new()
  return setmetatable({ inside = false, escaped = false, body = {}, last_time = nil }, Receiver)
end

function Receiver:take(bytes, time, gap_timeout_ms, ended)
  local first = 0
  local function finish(verdict, last)
    ended(self.body, verdict, math.max(first, 0), last)
    self.inside, self.body = false, {}
  end
  if gap_timeout_ms > 0 and self.last_time and (time - self.last_time) * 1000 > gap_timeout_ms then
    if self.inside then finish("timed-out", -1) end
    self.escaped, self.coded = false, nil
  end
  self.last_time = time
  for i = 0, bytes:len() - 1 do
    local value = bytes:get_index(i)
    if self.coded then
      self.code[#self.code + 1] = value
      if #self.code == self.coded then
        while #self.code > (CODED_COLUMNS + 2) * (self.rows + 1) do table.remove(self.code, 1) end
        self.body, self.coded = decode_code(self.body[1], self.code, self.rows), nil
        finish(judge(self.body), i)
      end
    elseif self.escaped then
      self.escaped = false
      if value == STX then
        if self.inside then finish("restarted", i - 2) end
        self.inside, first = true, i - 1
      elseif self.inside then
        if value == DLE then
          self.body[#self.body + 1] = DLE
        elseif value == ETX then
          finish(judge(self.body), i)
        else
          finish("bad-escape", i)
        end
      elseif value == DLE then
        self.escaped = true  -- there is no stuffing outside
      end
    elseif value == DLE then
      self.escaped = true
    elseif self.inside then
      self.body[#self.body + 1] = value
    end
    if self.inside and #self.body == LEAD - 2 and not self.escaped and not self.coded then
      self.coded, self.rows = coded_size(self.body)
      self.code = {}
    end
    if self.inside and #self.body > MAX_FRAME then finish("oversize", i) end
  end
end

-- ---------------------------------------------------------------- Packets.

local receivers  -- by stream
local seen       -- by packet: the frames that end in it; filled when it is looked at first

function pheromone.init()
  receivers, seen = {}, {}
end

local function frames_of(tvb, stream, pinfo)
  if not seen[pinfo.number] then
    local frames = {}
    receivers[stream] = receivers[stream] or Receiver.new()
    receivers[stream]:take(tvb:bytes(), pinfo.abs_ts, pheromone.prefs.gap_timeout_ms,
      function(body, verdict, first, last)
        frames[#frames + 1] = { body = body, verdict = verdict, first = first, last = last }
      end)
    seen[pinfo.number] = frames
  end
  return seen[pinfo.number]
end

local IS_BYTES = { [f.payload] = true, [f.text] = true, [f.server_nonce] = true,
                   [f.group_key] = true, [f.mac] = true }

local function add_fields(tree, body_tvb, layout, typed, offset)
  if typed then tree:add(f.type, body_tvb(1, 1)) end
  for _, item in ipairs(layout) do
    local field, length = item[1], item[2]
    if length > 0 then
      local range = body_tvb(offset, length)
      local added
      if IS_BYTES[field] then
        added = tree:add(field, range)
      elseif item[3] then
        added = tree:add(field, range, range:le_int())
      else
        added = tree:add(field, range, range:le_uint())
      end
      local remark = item[4]
      if type(remark) == "table" then remark = remark[range:le_int()] end
      if remark then added:append_text(" (" .. remark .. ")") end
    end
    offset = offset + length
  end
end

-- What is wrong with a record whose net is not known here.
local function judge_net_record(range)
  local bytes = range:bytes()
  if bytes:get_index(4) ~= NET_VERSION then return "version" end
  if crc16(bytes:subset(4, 18), 18) ~= range(22, 2):le_uint() then return "crc" end
  local kind, first, second = bytes:get_index(5), bytes:get_index(10), bytes:get_index(11)
  if not NET_KINDS[kind] then return "kind" end
  if kind == 1 then
    if first > MAX_CANDIDATES then return "value" end
    for i = 1, first do
      if bytes:get_index(10 + i) == 0 then return "value" end
    end
  elseif kind == 2 then
    if first >= 6 or not NET_OUTCOMES[second] then return "value" end
  elseif not NET_ACTIONS[second] then
    return "value"
  end
  return "ok"
end

local function add_net_record(tree, range)
  local verdict = judge_net_record(range)
  local kind = range(5, 1):uint()
  local sub = tree:add(pheromone, range,
                       "Record of a net: " .. (NET_KINDS[kind] or "unknown kind") .. ", " .. verdict)
  sub:add(f.net_verdict, range, verdict)
  sub:add(f.net_version, range(4, 1))
  sub:add(f.net_kind, range(5, 1))
  sub:add_le(f.net_hash, range(6, 4))
  if verdict == "ok" and kind == 1 then
    for i = 1, range(10, 1):uint() do sub:add(f.net_candidate, range(10 + i, 1)) end
  end
  for _, item in ipairs(NET_PAYLOADS[kind] or {}) do
    sub:add_le(item[1], range(10 + item[2], item[3]))
  end
  sub:add_le(f.net_crc, range(22, 2))
  if verdict ~= "ok" then sub:add_proto_expert_info(e_net, verdict) end
end

-- Adds a frame to the tree; returns how the list of packets sums it up.
local function dissect_frame(tvb, tree, frame)
  local verdict = frame.verdict
  local range = frame.last >= frame.first and tvb(frame.first, frame.last - frame.first + 1) or tvb()
  local sub = tree:add(pheromone, range, "Pheromone frame, " .. verdict)
  sub:add(f.verdict, range, verdict)
  if #frame.body == 0 then
    sub:add_proto_expert_info(e_damaged, verdict)
    return verdict
  end
  local body_tvb = byte_array(frame.body, 0, #frame.body):tvb("Frame, unstuffed")
  if not DELIVERED[verdict] then
    sub:add(f.data, body_tvb())
    sub:add_proto_expert_info(e_damaged, verdict)
    return verdict
  end
  local id, opcode = frame.body[1], frame.body[2]
  local data_length = #frame.body - MIN_FRAME
  sub:add(f.id, body_tvb(0, 1))
  sub:add(f.opcode, body_tvb(1, 1))
  local data = data_of(frame.body)
  local signature = data and signature_layout(frame.body) or {}
  local name, layout, typed = find_layout(opcode, data or byte_array(frame.body, 2, data_length))
  if not data then layout = nil end
  if name then sub:add(f.message, body_tvb(1, 1), name) end
  if layout then
    add_fields(sub, body_tvb, layout, typed, 2)
    local at = STATEMENT_AT[opcode] and 2 + STATEMENT_AT[opcode]
    if at and body_tvb(at, 4):le_int() == NET_RECORD then
      add_net_record(sub, body_tvb(at, NET_RECORD_SIZE))
    end
  else
    local length = data_length - length_of(signature)
    if length > 0 then sub:add(f.data, body_tvb(2, length)) end
  end
  add_fields(sub, body_tvb, signature, false, 2 + data_length - length_of(signature))
  if verdict ~= "ok" then sub:add_proto_expert_info(e_malformed, verdict) end
  sub:add_le(f.crc, body_tvb(#frame.body - 2, 2))
  sub:set_text("Pheromone " .. (name or string.format("opcode %02X", opcode)) .. ", client " .. id)
  local summary = string.format("%s %d", name or string.format("opcode %02X", opcode), id)
  if opcode == 0xFE and layout then
    sub:add_proto_expert_info(e_error, REASONS[frame.body[4]] or "unknown reason")
    summary = summary .. ": " .. (REASONS[frame.body[4]] or tostring(frame.body[4]))
  elseif verdict ~= "ok" then
    summary = summary .. " (" .. verdict .. ")"
  end
  return summary
end

-- Dissects what came at once on a stream; `tvb` holds nothing else.
local function dissect(tvb, stream, pinfo, tree)
  pinfo.cols.protocol = "PHEROMONE"
  local summaries = {}
  for _, frame in ipairs(frames_of(tvb, stream, pinfo)) do
    summaries[#summaries + 1] = dissect_frame(tvb, tree, frame)
  end
  if #summaries == 0 then
    summaries[1] = "part of a frame, " .. tvb:len() .. " bytes"
    tree:add(pheromone, tvb(), "Pheromone, part of a frame")
  end
  pinfo.cols.info = table.concat(summaries, " | ")
end

-- On TCP and UDP.
function pheromone.dissector(tvb, pinfo, tree)
  dissect(tvb, string.format("%s %d %s %d", pinfo.src, pinfo.src_port, pinfo.dst, pinfo.dst_port),
          pinfo, tree)
end

-- In captures of the server.
local record = Proto("pheromone_record", "Pheromone Capture Record")
function record.dissector(tvb, pinfo, tree)
  if tvb:len() <= HEADER then return 0 end
  local sub = tree:add(record, tvb(0, HEADER))
  sub:add_le(f.link, tvb(0, 2))
  sub:add_le(f.connection, tvb(2, 4))
  sub:add(f.direction, tvb(6, 1))
  local inbound = tvb(6, 1):uint() == FROM_ROBOTS
  pinfo.cols.src = inbound and "robots" or "server"
  pinfo.cols.dst = inbound and "server" or "robots"
  local stream = string.format("%d %d %d", tvb(0, 2):le_uint(), tvb(2, 4):le_uint(),
                               tvb(6, 1):uint())
  dissect(tvb(HEADER):tvb(), stream, pinfo, tree)
end

DissectorTable.get("wtap_encap"):add(wtap.USER0, record)
DissectorTable.get("tcp.port"):add_for_decode_as(pheromone)
DissectorTable.get("udp.port"):add_for_decode_as(pheromone)
