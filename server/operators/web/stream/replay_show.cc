#include "server/operators/web/stream/replay_show.h"

#include <unistd.h>

#include <algorithm>
#include <optional>
#include <utility>

#include <boost/json/object.hpp>

#include "server/base/descriptor.h"
#include "server/operators/control/json_text.h"
#include "server/operators/web/api/capture_files.h"

namespace pheromone::web {
namespace {

constexpr size_t kReadBytes = size_t{64} << 10;

// The file is opened once, so that it stays the same one.
playback::Player::Open Opener(const std::string& folder, const std::string& name) {
  return [folder, name, file = std::shared_ptr<const Descriptor>()](
             uint64_t from) mutable -> Result<ByteReader::Source> {
    if (file == nullptr) {
      PHEROMONE_TRY(Descriptor opened, OpenCapture(folder, name));
      file = std::make_shared<const Descriptor>(std::move(opened));
    }
    return ByteReader::Source(
        [file, from, portion = std::make_shared<std::string>()]() mutable -> std::string_view {
          portion->resize(kReadBytes);
          const ssize_t size =
              pread(file->get(), portion->data(), portion->size(), static_cast<off_t>(from));
          portion->resize(static_cast<size_t>(std::max<ssize_t>(size, 0)));
          from += portion->size();
          return *portion;
        });
  };
}

}  // namespace

ReplayShow::ReplayShow(Options options, HubOptions hub)
    : options_(std::move(options)),
      hub_(hub),
      player_(options_.name, Opener(options_.folder, options_.name)),
      tells_states_(options_.knows_states) {
  auto catalogue = std::make_shared<Catalogue>();
  catalogue->session = std::move(hub.session);
  catalogue->recording = ReplayedRecording{options_.name, 0, 0};
  empty_ = std::move(catalogue);
}

bool ReplayShow::Work(uint64_t now_ms) {
  if (playback_ == nullptr) {
    if (!player_.Survey(kPortionBytes)) {
      return true;
    }
    hub_.SetRecording({options_.name, player_.range().begin_ns, player_.range().end_ns});
    playback_ = std::make_unique<playback::Playback>(&player_);
  }
  return playback_->Turn(now_ms, kPortionBytes);
}

std::shared_ptr<const Catalogue> ReplayShow::catalogue() const {
  const bool is_hopeless = playback_ != nullptr && !player_.has_views() &&
                           playback_->state().phase != playback::State::Phase::kBuffering;
  return is_hopeless ? empty_ : hub_.catalogue();
}

void ReplayShow::Begin() {
  if (!std::exchange(has_begun_, true) && player_.has_views()) {
    first_state_ = playback_->Take({.play = true});
  }
}

Views ReplayShow::ViewsOf(const Needs& needs) const {
  const uint64_t at_ns = player_.time_ns();
  Views views;
  views.taken = needs;
  views.field = player_.Field(at_ns);
  if (needs.clients) {
    views.clients = player_.Clients(at_ns);
  }
  if (needs.links) {
    views.links = player_.Links(at_ns);
  }
  if (needs.status) {
    views.status = player_.ServerStatus(at_ns);
  }
  if (needs.nets) {
    views.nets = player_.Nets(at_ns);
  }
  if (needs.tags) {
    views.tags = player_.Tags(at_ns);
  }
  if (needs.paths) {
    views.paths = player_.engine().config().field.paths;
  }
  return views;
}

std::vector<Update> ReplayShow::Make(uint64_t now_ms) {
  if (playback_ == nullptr || !playback_->is_ready()) {
    return {};
  }
  if (std::exchange(generation_, player_.generation()) != player_.generation()) {
    hub_.Forget();
  }
  const Needs needs = hub_.Due(now_ms);
  if (!needs.any()) {
    return {};
  }
  return hub_.Make(ViewsOf(needs), {now_ms, player_.time_ns()});
}

StreamMessage ReplayShow::Take(const PlaybackRequest& request) {
  tells_states_ = true;
  if (request.request.seek_ns) {
    generation_ = 0;  // also forwards, robots leap
  }
  return {EncodePlaybackState(playback_->Take(request.request), request.id), true};
}

std::vector<StreamMessage> ReplayShow::TakeNews() {
  std::vector<StreamMessage> news;
  if (playback_ == nullptr || !has_begun_) {
    return news;
  }
  for (const auto& state : {std::exchange(first_state_, std::nullopt), playback_->TakeNews()}) {
    if (state && tells_states_) {
      news.push_back({EncodePlaybackState(*state, ""), true});
    }
  }
  if (told_problem_ != player_.problem()) {
    told_problem_ = player_.problem();
    const bool is_end = player_.has_failed() || !player_.has_views();
    if (!told_problem_.empty()) {
      news.push_back({ToText(boost::json::object{{"op", "status"},
                                                 {"level", is_end ? 2 : 1},
                                                 {"message", WellFormed(told_problem_)}}),
                      false});
    }
  }
  return news;
}

uint64_t ReplayShow::time_ns() const {
  return playback_ != nullptr ? playback_->state().time_ns : 0;
}

}  // namespace pheromone::web
