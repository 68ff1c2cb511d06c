#include "server/core/tags/block.h"

#include <string>

namespace pheromone::tags {
namespace {

constexpr int32_t kMillisecondsADay = 86'400'000;

std::string InWords(const Term& term) {
  return "(" + std::to_string(term.space) + ", " + std::to_string(term.value) + ")";
}

bool IsUnicodeScalar(int32_t value) {
  return value >= 0 && value <= 0x10FFFF && (value < 0xD800 || value > 0xDFFF);
}

}  // namespace

Words ToWords(const Block& block) {
  return {block.author,          static_cast<int32_t>(block.time_s),
          block.subject.space,   block.subject.value,
          block.predicate.space, block.predicate.value,
          block.object.space,    block.object.value};
}

Block BlockFromWords(const Words& words) {
  return {.author = words[0],
          .time_s = static_cast<uint32_t>(words[1]),
          .subject = {words[2], words[3]},
          .predicate = {words[4], words[5]},
          .object = {words[6], words[7]}};
}

bool IsKnownType(const Term& term) {
  return term.space >= static_cast<int32_t>(TypeCode::kTime) || term.is(TypeCode::kRobot) ||
         term.is(TypeCode::kTag);
}

Status CheckObject(const Term& object) {
  if (object.is(TypeCode::kChar) && !IsUnicodeScalar(object.value)) {
    return Error{"the object is character " + std::to_string(object.value) +
                 ", expected a Unicode scalar value"};
  }
  if (object.is(TypeCode::kTime) && (object.value < 0 || object.value >= kMillisecondsADay)) {
    return Error{"the object is time " + std::to_string(object.value) +
                 " ms, expected 0 to 86399999"};
  }
  const bool is_number = object.is_symbol() || object.is(TypeCode::kString);
  if (is_number && object.value < 1) {
    return Error{"the object is " + InWords(object) + ", expected a string's number from 1 on"};
  }
  const bool is_thing = object.is(TypeCode::kRobot) || object.is(TypeCode::kTag);
  if (is_thing && object.value < 1) {
    return Error{"the object is " + InWords(object) + ", expected a number from 1 on"};
  }
  return Ok();
}

Status CheckBlock(const Block& block) {
  if (block.author < 1) {
    return Error{"the author is " + std::to_string(block.author) + ", expected at least 1"};
  }
  const Term& subject = block.subject;
  if (block.is_net_record()) {
    return Ok();
  }
  if (!(subject.is_symbol() || subject.is(TypeCode::kRobot) || subject.is(TypeCode::kTag)) ||
      subject.value < 1) {
    return Error{"the subject is " + InWords(subject) + ", expected a symbol, a robot or a tag"};
  }
  if (!block.predicate.is_symbol() || block.predicate.value < 1) {
    return Error{"the predicate is " + InWords(block.predicate) + ", expected a symbol"};
  }
  return CheckObject(block.object);
}

}  // namespace pheromone::tags
