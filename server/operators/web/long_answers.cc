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

std::shared_ptr<void> LongAnswers::Enter(const std::string& client,
                                         const std::shared_ptr<Content>& content) {
  const uint64_t bytes = content->bytes_in_memory();
  if (bytes != 0) {
    const std::lock_guard lock(mutex_);
    const bool is_held = by_content_.contains(content.get());
    const auto its = by_client_.find(client);
    if ((its != by_client_.end() && its->second >= limits_.each_client) ||
        (!is_held && bytes_ != 0 && bytes_ + bytes > limits_.bytes)) {
      return nullptr;
    }
    ++by_client_[client];
    ++by_content_[content.get()];
    bytes_ += is_held ? 0 : bytes;
  }
  return {content.get(), [this, client, content, bytes](void* /*content*/) {
            if (bytes != 0) {
              Leave(client, content);
            }
          }};
}

void LongAnswers::Leave(const std::string& client, const std::shared_ptr<Content>& content) {
  const std::lock_guard lock(mutex_);
  const auto its = by_client_.find(client);
  if (--its->second == 0) {
    by_client_.erase(its);
  }
  const auto held = by_content_.find(content.get());
  if (--held->second == 0) {
    by_content_.erase(held);
    bytes_ -= content->bytes_in_memory();
  }
}

}  // namespace pheromone::web
