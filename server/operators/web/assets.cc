#include "server/operators/web/assets.h"

#include <fcntl.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <utility>

#include "server/base/descriptor.h"
#include "server/base/file.h"
#include "server/base/format.h"
#include "server/base/hash.h"
#include "server/base/text.h"
#include "server/operators/web/embedded.h"

namespace pheromone::web {
namespace {

constexpr std::string_view kFolder = "/dashboard/";
constexpr size_t kMaxAssetBytes = size_t{4} << 20;
constexpr size_t kMaxDepth = 4;
constexpr std::string_view kBlanks = " \t";  // in the fields of a request

constexpr std::string_view kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors "
    "'none'";

std::string_view TypeOf(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kTypes = {{
      {".html", "text/html; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
  }};
  for (const auto& [ending, type] : kTypes) {
    if (name.ends_with(ending)) {
      return type;
    }
  }
  return "text/plain; charset=utf-8";
}

bool IsPlainName(std::string_view name) {
  return !name.empty() && name.front() != '.' && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  });
}

// The parts of a path between slashes; nothing if one of them is no plain name.
std::optional<std::vector<std::string>> PartsOf(std::string_view file) {
  std::vector<std::string> parts;
  for (;;) {
    const size_t end = std::min(file.find('/'), file.size());
    if (!IsPlainName(file.substr(0, end)) || parts.size() == kMaxDepth) {
      return std::nullopt;
    }
    parts.emplace_back(file.substr(0, end));
    if (end == file.size()) {
      return parts;
    }
    file.remove_prefix(end + 1);
  }
}

// Each part is opened by itself and is no symbolic link, so that nothing outside can be reached.
std::optional<std::string> ReadBelow(const std::string& folder, const std::string& file) {
  const auto parts = PartsOf(file);
  Descriptor at(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  for (size_t i = 0; parts && at.valid() && i < parts->size(); ++i) {
    const int kind = i + 1 < parts->size() ? O_DIRECTORY : O_NONBLOCK;
    at =
        Descriptor(openat(at.get(), (*parts)[i].c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | kind));
  }
  if (!parts || !at.valid()) {
    return std::nullopt;
  }
  Result<std::string> bytes = ReadFile("/proc/self/fd/" + std::to_string(at.get()), kMaxAssetBytes);
  return bytes.ok() ? std::optional(std::move(bytes).value()) : std::nullopt;
}

// What gzip made of a file of at most kMaxAssetBytes.
std::string Inflate(std::string_view gzip) {
  constexpr int kGzip = 16 + MAX_WBITS;
  z_stream stream{};
  std::string text;
  if (inflateInit2(&stream, kGzip) != Z_OK) {
    return text;
  }
  std::array<char, 16384> piece{};
  // zlib does not write to its input.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
  stream.avail_in = static_cast<uInt>(gzip.size());
  int state = Z_OK;
  while (state == Z_OK && text.size() <= kMaxAssetBytes) {
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    state = inflate(&stream, Z_NO_FLUSH);
    text.append(piece.data(), piece.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return text;
}

const EmbeddedFile* Find(std::string_view name) {
  const auto files = EmbeddedFiles();
  const auto found = std::find_if(files.begin(), files.end(),
                                  [name](const EmbeddedFile& it) { return it.name == name; });
  return found != files.end() ? &*found : nullptr;
}

// Whether one of a list of entity tags, such as `"a", W/"b"`, or "*", means this one.
bool Names(std::string_view list, std::string_view etag) {
  while (!list.empty()) {
    const size_t end = std::min(list.find(','), list.size());
    std::string_view item = Trim(list.substr(0, end), kBlanks);
    if (item.starts_with("W/")) {
      item.remove_prefix(2);
    }
    if (item == "*" || item == etag) {
      return true;
    }
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

}  // namespace

bool TakesGzip(std::string_view accept_encoding) {
  while (!accept_encoding.empty()) {
    const size_t end = std::min(accept_encoding.find(','), accept_encoding.size());
    const std::string_view item = accept_encoding.substr(0, end);
    const size_t semicolon = std::min(item.find(';'), item.size());
    if (Trim(item.substr(0, semicolon), kBlanks) == "gzip") {
      const std::string_view weight =
          Trim(item.substr(std::min(semicolon + 1, item.size())), kBlanks);
      return !weight.starts_with("q=0") ||
             weight.find_first_of("123456789") != std::string_view::npos;
    }
    accept_encoding.remove_prefix(std::min(end + 1, accept_encoding.size()));
  }
  return false;
}

std::optional<std::string> Assets::FileOf(std::string_view path) {
  if (path == "/") {
    return "index.html";
  }
  if (!path.starts_with(kFolder)) {
    return std::nullopt;
  }
  return std::string(path.substr(kFolder.size()));
}

Response Assets::Get(const std::string& file, const Request& request) const {
  const EmbeddedFile* embedded = folder_.empty() ? Find(file) : nullptr;
  std::optional<std::string> bytes = folder_.empty() ? std::nullopt : ReadBelow(folder_, file);
  if (embedded == nullptr && !bytes) {
    return Refuse(404, {"the dashboard has no file " + file.substr(0, 100), "target",
                        "/, or a file that it names"});
  }
  const bool zipped = embedded != nullptr && TakesGzip(request.accept_encoding);
  // Of the two encodings of a file, each has a tag of its own.
  const std::string etag = '"' + HexText(HashText(embedded != nullptr ? embedded->gzip : *bytes)) +
                           (zipped ? "-gzip\"" : "\"");
  Response response;
  response.content_type = TypeOf(file);
  response.headers = {{"ETag", etag},
                      {"Cache-Control", "no-cache"},  // asks each time, and mostly gets 304
                      {"Vary", "Accept-Encoding"},
                      {"Content-Security-Policy", std::string(kPolicy)},
                      {"Referrer-Policy", "no-referrer"},
                      {"X-Frame-Options", "DENY"},
                      {"Cross-Origin-Opener-Policy", "same-origin"},
                      {"Cross-Origin-Resource-Policy", "same-origin"}};
  if (Names(request.if_none_match, etag)) {
    response.status = 304;
    return response;
  }
  if (zipped) {
    response.headers.emplace_back("Content-Encoding", "gzip");
    response.body = std::string(embedded->gzip);
  } else {
    response.body = embedded != nullptr ? Inflate(embedded->gzip) : *std::move(bytes);
  }
  return response;
}

}  // namespace pheromone::web
