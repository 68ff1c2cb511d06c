// Reading and writing of whole files.
//
//   Result<std::string> bytes = ReadFile("lab.pgm", kMaxFileBytes);
//   Status written = WriteFile("lab.pgm", bytes.value());
//
// Any thread. Errors name the file and the system's reason.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"

namespace pheromone {

constexpr size_t kMaxFileBytes = size_t{1} << 30;

/// All bytes of a regular file; pipes and devices, which may never end, are refused unread. More
/// than `max_bytes` is an error, detected before they are read.
Result<std::string> ReadFile(const std::string& path, size_t max_bytes = kMaxFileBytes);

/// Replaces a file atomically: the bytes are written to a new file beside it and synced, and the
/// new file is then renamed. A concurrent reader, or one after a power failure, finds either the
/// old or the new content. On an error the old file is untouched. It is an error if something that
/// is not a regular file, such as a device, has that name.
Status WriteFile(const std::string& path, std::string_view bytes);

/// The same for what only the owner may read: mode 0600 from the beginning, under any umask. A file
/// that is replaced keeps its owner: root may change what belongs to a service's user.
Status WriteSecretFile(const std::string& path, std::string_view bytes);

/// That writing `output` replaces none of the `inputs`, under whatever names. Inputs that do not
/// exist are none.
Status CheckOutput(const std::string& output, const std::vector<std::string>& inputs);

}  // namespace pheromone
