// A pending response: a session waits for it on its own executor, and a handler gives it from any
// thread, however late.
//
//   PendingResponse pending(executor, [&] { timer.cancel(); });   // on the executor
//   handle(request, pending.MakeRespond());
//   ... until the timer is cancelled or has expired
//   std::optional<Response> response = pending.Take();
//
// The result of MakeRespond may outlive the pending response, its executor and the io_context: then
// it has no effect. Only its first call counts; if all copies are destroyed uncalled, the answer is
// 503.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include <boost/asio/any_io_executor.hpp>

#include "server/operators/web/http.h"

namespace pheromone::web {

class PendingResponse {
 public:
  /// `wake` is called on `executor`, a strand, on which this is destroyed too.
  PendingResponse(boost::asio::any_io_executor executor, std::function<void()> wake);
  PendingResponse(const PendingResponse&) = delete;
  PendingResponse& operator=(const PendingResponse&) = delete;
  ~PendingResponse();

  /// To be called once.
  Respond MakeRespond();

  /// Empty until there is a response, and after it was taken.
  std::optional<Response> Take();

 private:
  // Shared by the two sides; contains no Asio objects, so that any thread may destroy it.
  struct Shared {
    std::mutex mutex;
    PendingResponse* waiting = nullptr;  // null: no longer waiting
    std::optional<Response> response;
  };
  class Promise;

  const boost::asio::any_io_executor executor_;
  const std::function<void()> wake_;
  const std::shared_ptr<Shared> shared_;
};

}  // namespace pheromone::web
