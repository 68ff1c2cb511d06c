// Base64 (RFC 4648, section 4, with padding). Any thread.
#pragma once

#include <string>
#include <string_view>

#include "server/base/result.h"

namespace pheromone {

std::string ToBase64(std::string_view bytes);

/// Only what ToBase64 writes: no line breaks, complete padding, no bits beyond the last byte. The
/// error says at which character.
Result<std::string> FromBase64(std::string_view text);

}  // namespace pheromone
