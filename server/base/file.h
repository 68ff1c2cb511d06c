// Whole files in and out.
//
//   Result<std::string> bytes = ReadFile("lab.pgm", kMaxFileBytes);
//   Status written = WriteFile("lab.pgm", bytes.value());
//
// Any thread. Errors name the file and the system's reason.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "server/base/result.h"

namespace pheromone {

constexpr size_t kMaxFileBytes = size_t{1} << 30;

/// All bytes of a regular file; pipes and devices, which may never end, are refused unread. More
/// than `max_bytes` is an error, found before they are read into memory.
Result<std::string> ReadFile(const std::string& path, size_t max_bytes = kMaxFileBytes);

/// Replaces a file as a whole: the bytes go to a new file beside it, to the disk, and only then
/// take the old one's name. Whoever reads meanwhile, or after a power cut, finds the old or the new
/// content and nothing between. On an error the old file is untouched; what is there and is no
/// regular file, such as a device, is one.
Status WriteFile(const std::string& path, std::string_view bytes);

}  // namespace pheromone
