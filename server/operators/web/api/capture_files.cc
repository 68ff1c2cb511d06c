#include "server/operators/web/api/capture_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/base/descriptor.h"
#include "server/base/format.h"
#include "server/operators/control/json_text.h"
#include "server/operators/web/byte_range.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

class File final : public Content {
 public:
  File(Descriptor descriptor, Lane lane)
      : descriptor_(std::make_shared<Descriptor>(std::move(descriptor))), lane_(std::move(lane)) {}

  void Read(uint64_t offset, size_t count, Respond respond) override {
    if (!RunIn(lane_, [descriptor = descriptor_, offset, count, respond] {
          std::string bytes(count, '\0');
          const ssize_t size =
              pread(descriptor->get(), bytes.data(), count, static_cast<off_t>(offset));
          bytes.resize(static_cast<size_t>(std::max<ssize_t>(size, 0)));
          respond({.body = std::move(bytes)});
        })) {
      respond(Busy());
    }
  }

 private:
  const std::shared_ptr<Descriptor> descriptor_;
  const Lane lane_;
};

double ModifiedSeconds(const struct stat& facts) {
  const int64_t milliseconds = facts.st_mtim.tv_nsec / 1'000'000;
  return static_cast<double>(facts.st_mtim.tv_sec) + static_cast<double>(milliseconds) / 1e3;
}

// Changes whenever the file does.
std::string TagOf(const struct stat& facts) {
  const auto hex = [](auto number) { return HexText(static_cast<uint64_t>(number)); };
  return '"' + hex(facts.st_ino) + '-' + hex(facts.st_size) + '-' + hex(facts.st_mtim.tv_sec) +
         '-' + hex(facts.st_mtim.tv_nsec) + '"';
}

Response NoSuchCapture(const std::string& name) {
  return Refuse(404, {"there is no recording " + name.substr(0, 100), "target",
                      "a name listed by /api/v1/captures"});
}

}  // namespace

bool IsCaptureName(std::string_view name) {
  return (name.ends_with(".pcapng") || name.ends_with(".mcap")) && !name.starts_with('.') &&
         name.find('/') == std::string_view::npos && name.find('\0') == std::string_view::npos;
}

Result<Descriptor> OpenCapture(const std::string& folder, const std::string& name) {
  const std::string path = std::filesystem::path(folder) / name;
  Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct stat facts {};
  if (!file.valid()) {
    return SystemError(name);
  }
  if (fstat(file.get(), &facts) != 0 || !S_ISREG(facts.st_mode)) {
    return Error{name + ": not a regular file"};
  }
  return file;
}

Response ListCaptures(const control::Control& control, Parameters* fields) {
  fields->AllowOnly({});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  const control::CaptureView view = control.GetCapture();
  const std::string present = std::filesystem::path(view.file).filename();
  struct Found {
    std::string name;
    struct stat facts {};
  };
  std::vector<Found> all;
  std::error_code error;  // no folder: no recordings yet
  for (std::filesystem::directory_iterator it(view.folder, error), end; !error && it != end;
       it.increment(error)) {
    Found found{.name = it->path().filename()};
    if (IsCaptureName(found.name) && lstat(it->path().c_str(), &found.facts) == 0 &&
        S_ISREG(found.facts.st_mode)) {
      all.push_back(std::move(found));
    }
  }
  std::sort(all.begin(), all.end(), [](const Found& a, const Found& b) { return a.name < b.name; });
  json::array list;
  for (const Found& it : all) {
    list.push_back(json::object{{"name", it.name},
                                {"bytes", it.facts.st_size},
                                {"modified_s", ModifiedSeconds(it.facts)},
                                {"recording", view.recording && it.name == present}});
  }
  return {.body = ToText(json::object{{"captures", std::move(list)}})};
}

Response SendCapture(const control::Control& control, const std::string& name,
                     const Request& request, const Lane& lane) {
  if (!IsCaptureName(name)) {
    return NoSuchCapture(name);
  }
  errno = 0;
  Result<Descriptor> opened = OpenCapture(control.GetCapture().folder, name);
  if (!opened.ok()) {
    const bool is_ours = errno == EMFILE || errno == ENFILE || errno == EACCES || errno == EIO;
    return is_ours ? Refuse(503, {opened.error(), "", "try again"}) : NoSuchCapture(name);
  }
  Descriptor file = std::move(opened).value();
  struct stat facts {};
  fstat(file.get(), &facts);
  const auto bytes = static_cast<uint64_t>(facts.st_size);
  const std::string tag = TagOf(facts);
  // A part of another version would be useless.
  const bool is_same = request.if_range.empty() || request.if_range == tag;
  const ByteRange range = ParseRange(is_same ? request.range : "", bytes);
  if (range.kind == ByteRange::Kind::kUnsatisfiable) {
    Response refused = Refuse(416, {"found " + request.range.substr(0, 100), "Range",
                                    "bytes below " + std::to_string(bytes)});
    refused.headers.emplace_back("Content-Range", ContentRange(range, bytes));
    return refused;
  }
  Response response{.content_type = "application/octet-stream"};
  response.headers = {{"Accept-Ranges", "bytes"}, {"ETag", tag}};
  if (range.kind == ByteRange::Kind::kPart) {
    response.status = 206;
    response.headers.emplace_back("Content-Range", ContentRange(range, bytes));
  }
  response.content = std::make_shared<File>(std::move(file), lane);
  response.content_offset = range.first;
  response.content_bytes = range.count;
  return response;
}

}  // namespace pheromone::web
