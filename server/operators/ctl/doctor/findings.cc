#include "server/operators/ctl/doctor/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/operators/control/json_text.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

std::string_view NameOf(Level level) {
  switch (level) {
    case Level::kOk:
      return "ok";
    case Level::kWarning:
      return "warning";
    case Level::kFault:
      break;
  }
  return "fault";
}

std::string Counted(size_t count, std::string_view what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

void Findings::Ok(std::string subject, std::string looked_at, std::string found) {
  all_.push_back({std::move(subject), std::move(looked_at), Level::kOk, std::move(found), {}});
}

void Findings::Warning(std::string subject, std::string looked_at, std::string found,
                       std::string mend) {
  all_.push_back({std::move(subject), std::move(looked_at), Level::kWarning, std::move(found),
                  std::move(mend)});
}

void Findings::Fault(std::string subject, std::string looked_at, std::string found,
                     std::string mend) {
  all_.push_back(
      {std::move(subject), std::move(looked_at), Level::kFault, std::move(found), std::move(mend)});
}

size_t Findings::Count(Level level) const {
  return static_cast<size_t>(std::count_if(
      all_.begin(), all_.end(), [level](const Finding& it) { return it.level == level; }));
}

int Findings::Print(bool as_json) const {
  const size_t faults = Count(Level::kFault);
  const size_t warnings = Count(Level::kWarning);
  if (as_json) {
    json::array array;
    for (const Finding& it : all_) {
      array.push_back({{"subject", it.subject},
                       {"looked_at", it.looked_at},
                       {"level", NameOf(it.level)},
                       {"found", it.found},
                       {"mend", it.mend.empty() ? json::value(nullptr) : json::value(it.mend)}});
    }
    fmt::print("{}",
               web::ToText(json::object{
                   {"findings", std::move(array)}, {"faults", faults}, {"warnings", warnings}}));
    return faults == 0 ? 0 : kFailed;
  }
  for (const Finding& it : all_) {
    fmt::print("{:<7}  {:<13}  {}: {}\n", NameOf(it.level), it.subject, it.looked_at, it.found);
    if (!it.mend.empty()) {
      fmt::print("{:24} {}\n", "", it.mend);
    }
  }
  fmt::print("{}, {}\n", Counted(faults, "fault"), Counted(warnings, "warning"));
  return faults == 0 ? 0 : kFailed;
}

}  // namespace pheromone::ctl
