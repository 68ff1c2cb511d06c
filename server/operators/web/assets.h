// The files of the dashboard: those embedded in the program, compressed, or those of a folder,
// while they are edited.
//
//   Assets assets;                                  // embedded
//   Assets assets("server/operators/web/dashboard");          // of a folder: --web-root
//   std::optional<std::string> file = Assets::FileOf("/dashboard/main.js");   // "main.js"
//   Response response = assets.Get(*file, request);
//
// The page is /, and everything else is below /dashboard/. Only files can be named whose path
// consists of letters, digits and "-_.", in folders of such names, none of which begins with a dot;
// in a folder, symbolic links are not followed. Each answer has a content security policy under
// which the page can load and contact nothing but this server.
//
// Thread-safe. Get of a folder reads the disk.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/operators/web/http.h"

namespace pheromone::web {

class Assets {
 public:
  /// An empty folder: the embedded files.
  explicit Assets(std::string folder = {}) : folder_(std::move(folder)) {}

  /// The file that a path of the server stands for; nothing if the path is not the dashboard's.
  static std::optional<std::string> FileOf(std::string_view path);

  /// 200, 304, or 404.
  Response Get(const std::string& file, const Request& request) const;

  bool reads_disk() const { return !folder_.empty(); }

 private:
  std::string folder_;
};

/// Whether a client that sent this Accept-Encoding takes gzip. (One that sent none may not be able
/// to.)
bool TakesGzip(std::string_view accept_encoding);

}  // namespace pheromone::web
