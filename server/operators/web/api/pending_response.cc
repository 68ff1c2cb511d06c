#include "server/operators/web/api/pending_response.h"

#include <atomic>
#include <utility>

#include <boost/asio/post.hpp>

namespace pheromone::web {

// The handler's side. It accesses the waiting side only under the mutex: the latter and its
// executor exist as long as it has not detached itself.
class PendingResponse::Promise {
 public:
  explicit Promise(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}
  Promise(const Promise&) = delete;
  Promise& operator=(const Promise&) = delete;
  ~Promise() {
    if (!kept_) {
      Keep(Refuse(503, {"the server could not answer", "", "try again in a moment"}));
    }
  }

  void Keep(Response response) {
    if (kept_.exchange(true)) {
      return;
    }
    const std::lock_guard lock(shared_->mutex);
    if (shared_->waiting == nullptr) {
      return;
    }
    shared_->response = std::move(response);
    boost::asio::post(shared_->waiting->executor_, [shared = shared_] {
      const std::lock_guard again(shared->mutex);
      if (shared->waiting != nullptr) {
        shared->waiting->wake_();
      }
    });
  }

 private:
  const std::shared_ptr<Shared> shared_;
  std::atomic<bool> kept_{false};
};

PendingResponse::PendingResponse(boost::asio::any_io_executor executor, std::function<void()> wake)
    : executor_(std::move(executor)), wake_(std::move(wake)), shared_(std::make_shared<Shared>()) {
  shared_->waiting = this;
}

PendingResponse::~PendingResponse() {
  const std::lock_guard lock(shared_->mutex);
  shared_->waiting = nullptr;
}

Respond PendingResponse::MakeRespond() {
  return [promise = std::make_shared<Promise>(shared_)](Response response) {
    promise->Keep(std::move(response));
  };
}

std::optional<Response> PendingResponse::Take() {
  const std::lock_guard lock(shared_->mutex);
  return std::exchange(shared_->response, std::nullopt);
}

}  // namespace pheromone::web
