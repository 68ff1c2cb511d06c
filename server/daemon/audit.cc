#include "server/daemon/audit.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <utility>

#include "server/base/descriptor.h"
#include "server/operators/control/json_text.h"

namespace pheromone::daemon {
namespace {

constexpr size_t kMaxAuditWaiting = 1000;
constexpr mode_t kAuditMode = 0640;

std::string UtcNow() {
  const auto now = std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto second = std::chrono::floor<std::chrono::seconds>(now);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(second), (now - second).count());
}

}  // namespace

Audit::Audit(control::Control* control, std::string folder, uint64_t max_bytes)
    : folder_(std::move(folder)),
      max_bytes_(max_bytes),
      queue_({.name = "the audit", .yields = true}) {
  const std::lock_guard lock(mutex_);  // another thread may be woken at once
  subscription_ = control->Subscribe(
      {.max_waiting = kMaxAuditWaiting, .wake = [this] { (void)queue_.Add([this] { Take(); }); }});
}

Audit::~Audit() {
  queue_.Close();
  Take();
}

void Audit::Take() {
  const std::lock_guard lock(mutex_);
  const control::Subscription::Taken taken = subscription_->Take();
  std::string lines;
  if (taken.dropped != 0) {
    lines += web::AuditLine({control::Notice::Topic::kOperator, false, "audit",
                             fmt::format("{} notices were lost", taken.dropped)},
                            UtcNow());
  }
  for (const control::Notice& notice : taken.notices) {
    if (notice.topic != control::Notice::Topic::kOperator) {
      continue;
    }
    spdlog::log(notice.is_on ? spdlog::level::info : spdlog::level::warn, "{}: {}", notice.subject,
                notice.text);
    lines += web::AuditLine(notice, UtcNow());
  }
  if (!folder_.empty() && !lines.empty()) {
    Keep(lines);
  }
}

void Audit::Keep(const std::string& lines) {
  const std::string path = folder_ + "/audit.jsonl";
  const Descriptor file(
      open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kAuditMode));
  const bool is_written = file.valid() && write(file.get(), lines.data(), lines.size()) ==
                                              static_cast<ssize_t>(lines.size());
  const std::string trouble = is_written ? "" : std::string(SystemError(path));
  if (!trouble.empty() && trouble != trouble_) {
    spdlog::error("audit: {}; what operators do is told here only", trouble);
  }
  trouble_ = trouble;
  struct stat facts {};
  if (is_written && fstat(file.get(), &facts) == 0 &&
      static_cast<uint64_t>(facts.st_size) >= max_bytes_) {
    std::rename(path.c_str(), (folder_ + "/audit.1.jsonl").c_str());
  }
}

}  // namespace pheromone::daemon
