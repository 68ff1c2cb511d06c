#include "protocol/decoder.h"

namespace pheromone {
namespace protocol {

void Tally(FrameParser::Result event, DecoderCounters* counters) {
  uint32_t* counter = &counters->ignored_bytes;
  switch (event) {
    case FrameParser::kNothing:
      return;
    case FrameParser::kFrame:
      counter = &counters->frames;
      break;
    case FrameParser::kCrcError:
      counter = &counters->crc_errors;
      break;
    case FrameParser::kBadEscape:
      counter = &counters->bad_escapes;
      break;
    case FrameParser::kOversize:
      counter = &counters->oversize;
      break;
    case FrameParser::kRunt:
      counter = &counters->runts;
      break;
    case FrameParser::kRefused:
      counter = &counters->refused;
      break;
    case FrameParser::kRestart:
      counter = &counters->restarts;
      break;
    case FrameParser::kIgnored:
    case FrameParser::kIgnoredPair:
      break;
  }
  *counter += event == FrameParser::kIgnoredPair ? 2u : 1u;
}

void TimeOut(FrameParser* parser, DecoderCounters* counters) {
  if (parser->open()) {
    ++counters->timeouts;
  } else if (!parser->idle()) {
    ++counters->ignored_bytes;  // a lone DLE
  }
  parser->Abort();
}

void FrameDecoder::Expire(uint32_t now_ms) {
  const uint32_t gap_ms = now_ms - last_byte_ms_;
  if (gap_timeout_ms_ != kNoGapTimeout && gap_ms > gap_timeout_ms_) {
    TimeOut(&parser_, &counters_);
  }
}

bool FrameDecoder::Push(uint8_t byte, uint32_t now_ms) {
  Expire(now_ms);
  last_byte_ms_ = now_ms;
  const FrameParser::Result event = parser_.Push(byte);
  Tally(event, &counters_);
  if (event != FrameParser::kFrame) {
    return false;
  }
  const uint8_t* const body = parser_.body();
  message_.id = body[0];
  message_.opcode = body[1];
  message_.length = static_cast<uint8_t>(parser_.size() - 4);
  for (uint8_t i = 0; i < message_.length; ++i) {
    message_.data[i] = body[2 + i];
  }
  return true;
}

}  // namespace protocol
}  // namespace pheromone
