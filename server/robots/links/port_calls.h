// Makes the calls of a port asynchronously, since any of them may block in the driver. They run on
// an executor of their own, one after the other in the order of the requests; the caller is a
// coroutine, whose strand is not blocked.
//
//   PortCalls calls(MakeSerialPort(options), aside);
//   const bool busy = co_await calls.Make([](Port& port) { return port.carrier(); });
//
// A call cannot be cancelled: the coroutine stays suspended until the driver returns. Exceptions of
// the call are rethrown by co_await. The port lives until its last call has ended, even if that is
// after the PortCalls is destroyed.
#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/robots/links/port.h"

namespace pheromone::links {

class PortCalls {
 public:
  /// Without `aside`, calls are made directly by the caller.
  PortCalls(std::unique_ptr<Port> port, const boost::asio::any_io_executor& aside)
      : port_(std::move(port)) {
    if (aside) {
      aside_.emplace(boost::asio::make_strand(aside));
    }
  }

  /// For functions that do not call the driver: Describe, senses_carrier, is_keyed. Or before any
  /// call.
  Port& port() { return *port_; }

  /// Makes `call(Port&)` and returns what it returns.
  template <typename Call>
  boost::asio::awaitable<std::invoke_result_t<Call&, Port&>> Make(Call call) {
    using Value = std::invoke_result_t<Call&, Port&>;
    if (!aside_) {
      co_return call(*port_);
    }
    Outcome<Value> outcome;
    auto begin = [&call, &outcome, this](auto handler) {
      auto back = boost::asio::get_associated_executor(handler);
      // Keeps the io_context running until the driver returns.
      boost::asio::post(*aside_, [&call, &outcome, port = port_, handler = std::move(handler),
                                  work = boost::asio::make_work_guard(back)]() mutable {
        outcome.Take(call, port.get());
        boost::asio::post(work.get_executor(), std::move(handler));
      });
    };
    co_await boost::asio::async_initiate<const boost::asio::use_awaitable_t<>&, void()>(
        std::move(begin), boost::asio::use_awaitable);
    co_return outcome.Get();
  }

 private:
  template <typename Value>
  class Outcome {
   public:
    template <typename Call>
    void Take(Call& call, Port* port) {
      try {
        if constexpr (std::is_void_v<Value>) {
          call(*port);
        } else {
          value_.emplace(call(*port));
        }
      } catch (...) {
        thrown_ = std::current_exception();
      }
    }
    Value Get() {
      if (thrown_) {
        std::rethrow_exception(thrown_);
      }
      if constexpr (!std::is_void_v<Value>) {
        return *std::move(value_);
      }
    }

   private:
    struct Nothing {};
    std::optional<std::conditional_t<std::is_void_v<Value>, Nothing, Value>> value_;
    std::exception_ptr thrown_;
  };

  const std::shared_ptr<Port> port_;
  std::optional<boost::asio::strand<boost::asio::any_io_executor>> aside_;
};

}  // namespace pheromone::links
