// Links over one serial line, real or virtual.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/links/backoff.h"
#include "server/links/link.h"

namespace pheromone::links {

struct PtyOptions {
  std::string path;             ///< the symbolic link to the slave side
  uint16_t gap_timeout_ms = 0;  ///< 0: none; a pty loses nothing
  BackoffOptions backoff;
};

/// A virtual modem: no medium access. See MakePtyPort for the symbolic link.
std::unique_ptr<Link> MakePtyLink(boost::asio::io_context& io, const PtyOptions& options,
                                  LinkContext context);

struct SerialOptions {
  std::string path;
  uint32_t baud = 9600;
  uint16_t gap_timeout_ms = 20;
  uint16_t turnaround_ms = 0;        ///< T_t
  uint16_t response_window_ms = 25;  ///< W
  BackoffOptions backoff;
};

/// A radio modem, shared by its robots: answers keep to the server gap and the response window.
std::unique_ptr<Link> MakeSerialLink(boost::asio::io_context& io, const SerialOptions& options,
                                     LinkContext context);

}  // namespace pheromone::links
