// Why a robot stands, in words, for programs on a host.
#pragma once

#include <cstdint>
#include <string>

#include "client_fw/core/steering/behaviour.h"

namespace pheromone::client {

/// "halted, until it is told to resume; trail lost", of these StopFlags; empty if there are none.
inline std::string StopText(uint8_t flags) {
  struct Text {
    uint8_t flag;
    const char* words;
  };
  static constexpr Text kTexts[] = {{kNoAnswerYet, "no answer from the server yet"},
                                    {kFailSafe, "answers have stopped (fail-safe)"},
                                    {kHalted, "halted, until it is told to resume"},
                                    {kOffTheMap, "off the map"},
                                    {kWrongVersion, "the server speaks another protocol version"},
                                    {kTypeMissing, "the server does not have its pheromone type"},
                                    {kTrailLost, "trail lost"},
                                    {kPoseLost, "its pose is lost"}};
  std::string text;
  for (const Text& it : kTexts) {
    if ((flags & it.flag) != 0) {
      text += (text.empty() ? "" : "; ") + std::string(it.words);
    }
  }
  return text;
}

}  // namespace pheromone::client
