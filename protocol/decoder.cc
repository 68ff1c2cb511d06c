#include "protocol/decoder.h"

namespace pheromone {
namespace protocol {

namespace {

// What a byte adds to, in the order of FrameParser::Result, from kFrame on.
uint32_t DecoderCounters::*const kCounters[] = {
    &DecoderCounters::frames,   &DecoderCounters::crc_errors,    &DecoderCounters::bad_escapes,
    &DecoderCounters::oversize, &DecoderCounters::runts,         &DecoderCounters::refused,
    &DecoderCounters::restarts, &DecoderCounters::ignored_bytes, &DecoderCounters::ignored_bytes,
};
static_assert(sizeof(kCounters) == FrameParser::kIgnoredPair * sizeof(kCounters[0]),
              "a result is missing here");

}  // namespace

void Tally(FrameParser::Result event, DecoderCounters* counters) {
  if (event != FrameParser::kNothing) {
    counters->*kCounters[event - 1] += event == FrameParser::kIgnoredPair ? 2u : 1u;
  }
}

void TimeOut(FrameParser* parser, DecoderCounters* counters) {
  if (!parser->idle()) {  // if none is open, there is a lone DLE
    ++(counters->*(parser->open() ? &DecoderCounters::timeouts : &DecoderCounters::ignored_bytes));
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
