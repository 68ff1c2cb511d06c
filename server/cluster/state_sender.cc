#include "server/cluster/state_sender.h"

#include <utility>

#include "server/store/journal/format.h"

namespace pheromone::cluster {

// Used aside while it is filled, and on the executor otherwise.
struct StateSender::Copy {
  std::unique_ptr<journal::StateSource> source;
  uint64_t sequence = 0;
  std::string bytes;  // that were not sent
  bool is_begun = false;
  bool is_whole = false;
  std::string error;
};

void StateSender::OnRequest(const std::string& from, const StateRequest& request,
                            uint64_t committed, uint64_t now_ms) {
  const auto refuse = [&](const std::string& why) {
    parts_.send(from, {.number = request.number, .offset = request.offset, .error = why});
  };
  if (copy_ != nullptr && from != to_) {
    refuse("its state is being sent to " + to_ + "; that takes a while");
    return;
  }
  if (request.offset == 0 && (copy_ == nullptr || request.number != request_.number)) {
    End();
    to_ = from;
    copy_ = std::make_shared<Copy>();
  } else if (copy_ == nullptr || request.number != request_.number || request.offset != offset_) {
    refuse("its state is not being sent from byte " + std::to_string(request.offset) + " on");
    return;
  }
  request_ = request;
  waits_ = true;
  asked_ms_ = now_ms;
  Serve(committed);
}

void StateSender::Continue(uint64_t committed, uint64_t now_ms) {
  if (copy_ != nullptr && now_ms - asked_ms_ >= kPatienceMs && !waits_) {
    End();
  }
  Serve(committed);
}

void StateSender::OnDown(const std::string& node) {
  if (node == to_) {
    End();
  }
}

// Until there is enough for a portion.
void StateSender::Fill() {
  is_filling_ = true;
  const std::shared_ptr<Copy> copy = copy_;
  parts_.aside(
      [copy, freeze = parts_.freeze] {
        if (!copy->is_begun) {
          copy->is_begun = true;
          copy->source = freeze();
          if (copy->source == nullptr) {
            copy->error =
                "it has no state yet, or its state is being copied for a snapshot or a recording";
            return;
          }
          copy->sequence = copy->source->header().sequence;
          copy->bytes = EncodeHeader(copy->source->header());
        }
        while (copy->bytes.size() < kMaxPortionBytes && !copy->is_whole) {
          const Result<std::string> next = copy->source->Next();
          if (!next.ok()) {
            copy->error = next.error();
            break;
          }
          copy->bytes += next.value();
          copy->is_whole = next.value().empty();
        }
        if (copy->is_whole || !copy->error.empty()) {
          copy->source.reset();
        }
      },
      [this, copy] {
        if (copy == copy_) {
          is_filling_ = false;
          Serve(0);
        }
      });
}

void StateSender::Serve(uint64_t committed) {
  if (!waits_ || is_filling_) {
    return;
  }
  Copy& copy = *copy_;
  StatePortion portion{.number = request_.number, .offset = offset_};
  if (!copy.error.empty()) {
    portion.error = copy.error;
    parts_.send(std::exchange(to_, ""), std::move(portion));
    End();
    return;
  }
  if (copy.bytes.size() < kMaxPortionBytes && !copy.is_whole) {
    Fill();
    return;
  }
  portion.is_last = copy.is_whole && copy.bytes.size() <= kMaxPortionBytes;
  if (portion.is_last && copy.sequence > committed) {
    return;  // until Continue knows of more
  }
  portion.bytes = copy.bytes.substr(0, kMaxPortionBytes);
  copy.bytes.erase(0, portion.bytes.size());
  offset_ += portion.bytes.size();
  waits_ = false;
  const bool is_last = portion.is_last;
  parts_.send(to_, std::move(portion));
  if (is_last) {
    End();
  }
}

void StateSender::End() {
  to_.clear();
  request_ = {};
  waits_ = false;
  is_filling_ = false;
  offset_ = 0;
  copy_.reset();
}

}  // namespace pheromone::cluster
