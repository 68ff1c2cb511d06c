#include "server/daemon/audit.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <utility>

#include "server/base/descriptor.h"
#include "server/base/format.h"
#include "server/operators/control/json_text.h"

namespace pheromone::daemon {
namespace {

constexpr size_t kMaxAuditWaiting = 1000;
constexpr mode_t kAuditMode = 0640;

std::string UtcNow() {
  return UtcMsText(std::chrono::duration_cast<std::chrono::milliseconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count());
}

}  // namespace

Audit::Audit(control::Control* control, std::string folder, uint64_t max_bytes)
    : folder_(std::move(folder)),
      max_bytes_(max_bytes),
      log_({.name = "the audit's log", .yields = true}),
      file_({.name = "the audit's file", .yields = true}) {
  const std::lock_guard lock(mutex_);  // another thread may be woken at once
  subscription_ = control->Subscribe(
      {.max_waiting = kMaxAuditWaiting, .wake = [this] { (void)log_.Add([this] { Take(); }); }});
}

Audit::~Audit() {
  log_.Close();
  Take();
  file_.Close();
  Keep();
}

// Waits for no disk.
void Audit::Take() {
  const std::lock_guard lock(mutex_);
  const control::Subscription::Taken taken = subscription_->Take();
  const auto keep = [&](const control::Notice& notice) {
    spdlog::log(notice.is_on ? spdlog::level::info : spdlog::level::warn, "{}: {}", notice.subject,
                notice.text);
    if (!folder_.empty() && lines_.size() < max_bytes_) {
      lines_ += web::AuditLine(notice, UtcNow());
    }
  };
  if (taken.dropped != 0) {
    keep({control::Notice::Topic::kOperator, false, "audit",
          fmt::format("{} notices were lost", taken.dropped)});
  }
  for (const control::Notice& notice : taken.notices) {
    if (notice.topic == control::Notice::Topic::kOperator) {
      keep(notice);
    }
  }
  if (!lines_.empty()) {
    (void)file_.Add([this] { Keep(); });  // if it is full, the next one writes these, too
  }
}

void Audit::Keep() {
  std::string lines;
  {
    const std::lock_guard lock(mutex_);
    lines.swap(lines_);
  }
  if (lines.empty()) {
    return;
  }
  const std::string trouble = WriteLines(lines);
  if (!trouble.empty() && trouble != trouble_) {
    spdlog::error("audit: {}; what operators do is told here only", trouble);
  }
  trouble_ = trouble;
}

// All of them or none; returns what is wrong.
std::string Audit::WriteLines(const std::string& lines) const {
  const std::string path = folder_ + "/audit.jsonl";
  const Descriptor file(
      open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kAuditMode));
  struct stat before {};
  if (!file.valid() || fstat(file.get(), &before) != 0) {
    return SystemError(path);
  }
  if (!WriteAll(file.get(), lines)) {
    const Error error = SystemError(path);
    (void)!ftruncate(file.get(), before.st_size);
    return error;
  }
  const uint64_t bytes = static_cast<uint64_t>(before.st_size) + lines.size();
  if (bytes >= max_bytes_ && std::rename(path.c_str(), (folder_ + "/audit.1.jsonl").c_str()) != 0) {
    return SystemError(path);
  }
  return "";
}

}  // namespace pheromone::daemon
