// What runs for as long as its link does, whatever is thrown in it. A coroutine that is merely
// detached ends without a word when it throws, and with it what it was there for.
//
//   KeepRunning(strand, [this] { return Run(); }, [this](const Error& error) { ... });
#pragma once

#include <exception>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>

#include "server/links/link.h"

namespace pheromone::links {

/// Runs what `begin` returns, a coroutine, until it ends by itself: when it throws, `report` is
/// told and it begins anew. All of it on the strand.
template <typename Strand, typename Begin, typename Report>
void KeepRunning(const Strand& strand, Begin begin, Report report) {
  boost::asio::awaitable<void> run = begin();
  boost::asio::co_spawn(strand, std::move(run),
                        [strand, begin = std::move(begin),
                         report = std::move(report)](const std::exception_ptr& thrown) mutable {
                          if (thrown) {
                            report(InternalError(thrown));
                            KeepRunning(strand, std::move(begin), std::move(report));
                          }
                        });
}

}  // namespace pheromone::links
