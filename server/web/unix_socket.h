// The place in the file system where the Unix socket is.
#pragma once

#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/local/stream_protocol.hpp>

#include "server/base/result.h"

namespace pheromone::web {

/// Makes `path` a Unix socket with mode 0660 and listens on it. What is left of a server that is no
/// longer running is replaced; the socket of one that is, and any other file, is an error.
Status ListenOnUnixSocket(const std::string& path,
                          boost::asio::local::stream_protocol::acceptor* acceptor);

/// Which file a path is at the moment, so that only our own is removed at the end. Empty: none.
std::string IdentityOf(const std::string& path);

}  // namespace pheromone::web
