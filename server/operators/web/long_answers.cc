#include "server/operators/web/long_answers.h"

#include <string>
#include <utility>

namespace pheromone::web {
namespace {

class SharedText final : public Content {
 public:
  explicit SharedText(std::string text) : text_(std::move(text)) {}

  void Read(uint64_t offset, size_t count, Respond respond) override {
    respond({.body = offset < text_.size() ? text_.substr(offset, count) : std::string()});
  }
  uint64_t bytes_in_memory() const override { return text_.size(); }

 private:
  const std::string text_;
};

}  // namespace

void ShareLongBody(Response* response) {
  if (response->body.size() > kPortionBytes) {
    response->content_offset = 0;
    response->content_bytes = response->body.size();
    response->content = std::make_shared<SharedText>(std::exchange(response->body, {}));
  }
}

bool LongAnswers::Held::Fits(const Content* content, const Limit& limit) const {
  const bool has_room =
      bytes_ == 0 || times_.contains(content) || bytes_ + content->bytes_in_memory() <= limit.bytes;
  return has_room && answers_ < limit.answers;
}

void LongAnswers::Held::Add(const Content* content) {
  ++answers_;
  if (++times_[content] == 1) {
    bytes_ += content->bytes_in_memory();
  }
}

void LongAnswers::Held::Remove(const Content* content) {
  --answers_;
  const auto found = times_.find(content);
  if (--found->second == 0) {
    times_.erase(found);
    bytes_ -= content->bytes_in_memory();
  }
}

std::shared_ptr<void> LongAnswers::Enter(const std::string& client,
                                         const std::shared_ptr<Content>& content) {
  if (content->bytes_in_memory() < limits_.least) {
    return content;
  }
  const std::lock_guard lock(mutex_);
  const auto its = by_client_.find(client);
  if ((its != by_client_.end() && !its->second.Fits(content.get(), limits_.each_client)) ||
      !all_.Fits(content.get(), limits_.all)) {
    return nullptr;
  }
  by_client_[client].Add(content.get());
  all_.Add(content.get());
  return {content.get(),
          [this, client, content](void* /*content*/) { Leave(client, content.get()); }};
}

void LongAnswers::Leave(const std::string& client, const Content* content) {
  const std::lock_guard lock(mutex_);
  all_.Remove(content);
  const auto its = by_client_.find(client);
  its->second.Remove(content);
  if (its->second.empty()) {
    by_client_.erase(its);
  }
}

}  // namespace pheromone::web
