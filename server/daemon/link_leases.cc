#include "server/daemon/link_leases.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <utility>

#include <boost/asio/post.hpp>

#include "server/base/boottime.h"

namespace pheromone::daemon {
namespace {

constexpr uint64_t kBetweenPortLooksMs = 100;
constexpr uint64_t kFreeingMs = 1'500;

std::vector<cluster::SharedLink> SettingsOf(const std::vector<LinkLeases::Shared>& links) {
  std::vector<cluster::SharedLink> settings;
  settings.reserve(links.size());
  for (const LinkLeases::Shared& it : links) {
    settings.push_back(it.settings);
  }
  return settings;
}

}  // namespace

LinkLeases::LinkLeases(const std::string& node, uint64_t process, std::vector<Shared> links,
                       const MakeLog& make_log)
    : timer_(io_),
      links_(std::move(links)),
      owners_(node, process, SettingsOf(links_)),
      log_(make_log(io_.get_executor())) {}

void LinkLeases::Start() {
  boost::asio::post(io_, [this] { Continue(); });
  thread_ = std::thread([this] { io_.run(); });
}

void LinkLeases::Stop() {
  if (!thread_.joinable()) {
    return;
  }
  boost::asio::post(io_, [this] {
    owners_.Release();
    end_ms_ = BoottimeMs() + kFreeingMs;
    Continue();
  });
  thread_.join();
}

void LinkLeases::Continue() {
  if (is_ended_) {
    return;
  }
  const uint64_t now_ms = BoottimeMs();
  for (size_t i = 0; i < links_.size(); ++i) {
    owners_.SetUsable(i, links_[i].link->state().up);
    owners_.SetInUse(i, links_[i].permit->in_use_until_ms());
  }
  for (const cluster::LinkOwners::Request& it : owners_.Next(now_ms)) {
    const auto done = [this, link = it.link](const Result<cluster::Register>& answer) {
      owners_.OnRegister(link, answer, BoottimeMs());
      Continue();
    };
    const std::string& name = links_[it.link].settings.name;
    if (it.sets) {
      log_->SetRegister(name, it.seen, it.value, done);
    } else {
      log_->ReadRegister(name, done);
    }
  }
  for (size_t i = 0; i < links_.size(); ++i) {
    links_[i].permit->Set(owners_.until_ms(i), owners_.owner(i));
  }
  if (end_ms_ != UINT64_MAX && (!owners_.has_any() || now_ms >= end_ms_)) {
    is_ended_ = true;
    log_->Stop();
    timer_.cancel();
    return;
  }
  const uint64_t due_ms = std::min(owners_.Deadline(now_ms), now_ms + kBetweenPortLooksMs);
  timer_.expires_after(std::chrono::milliseconds(due_ms - std::min(due_ms, now_ms)));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      Continue();
    }
  });
}

}  // namespace pheromone::daemon
