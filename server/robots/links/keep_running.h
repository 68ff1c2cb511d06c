// Keeps a coroutine of a link running in spite of exceptions. A merely detached coroutine would end
// silently when it throws, and its link would stop working.
//
//   KeepRunning(strand, [this] { return Run(); }, [this](const Error& error) { ... });
#pragma once

#include <exception>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>

#include "server/robots/links/link.h"

namespace pheromone::links {

/// Runs the coroutine returned by `begin` until it ends normally: if it throws, calls `report` and
/// starts it again. All of this happens on the strand.
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
