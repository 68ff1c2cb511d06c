// pheromonectl keys: the robots' keys in a file (server/robots/signing/keys_file.h), without a
// server; and revoking keys at a running one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

struct KeysOptions {
  std::string file;
  std::vector<int> ids = {};  ///< 1 to 254
};

/// Where the formats of key_formats.h go; empty: not there.
struct KeyExport {
  std::string file;
  int id = 0;
  std::string robot = {};
  std::string eeprom = {};
  std::string header = {};
};

// Each returns the exit status; errors are reported on standard error, and nothing is changed then.

/// Makes keys, and the file unless it exists. Error: one of the robots has a key.
int MakeKeys(const KeysOptions& options);

/// Prints IDs and comments.
int ListKeys(const std::string& file);

/// Removes the robots' lines. Error: one of the robots has no key.
int RevokeKeysInFile(const KeysOptions& options);

/// Has a server revoke the keys of these robots, on all its links. Error: no link has a key of one
/// of them.
int RevokeKeysAtServer(const ServerOptions& server, const std::vector<int>& ids);

/// Error: the robot has no key, or a file cannot be written.
int ExportKey(const KeyExport& options);

}  // namespace pheromone::ctl
