// Creates the Unix socket in the file system.
#pragma once

#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/local/stream_protocol.hpp>

#include "server/base/result.h"

namespace pheromone::web {

/// Creates a Unix socket with mode 0660 at `path` and listens on it. A stale socket is replaced;
/// the socket of a running server, and any other file, is an error.
Status ListenOnUnixSocket(const std::string& path,
                          boost::asio::local::stream_protocol::acceptor* acceptor);

/// Who is at the other end of a connected Unix socket: "uid 1000". A number, since its name may
/// have to be asked of another machine.
std::string PeerOf(int socket);

/// Which file a path is at the moment, so that only our own is removed at the end. Empty: none.
std::string IdentityOf(const std::string& path);

}  // namespace pheromone::web
