#include "server/operators/web/unix_socket.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <optional>

#include "server/base/descriptor.h"
#include "server/base/holders.h"

namespace pheromone::web {
namespace {

using Local = boost::asio::local::stream_protocol;
using boost::system::error_code;

constexpr mode_t kMode = 0660;

std::optional<ucred> CredentialsOf(int socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 ? std::optional(peer)
                                                                        : std::nullopt;
}

// Makes room for a socket at `path`, if nobody needs what is there.
Status MakeRoom(const std::string& path, const boost::asio::any_io_executor& executor) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) {
    return errno == ENOENT ? Ok() : Status(SystemError(path));
  }
  if (!S_ISSOCK(found.st_mode)) {
    return Error{path + ": already exists and is not a socket"};
  }
  error_code error;
  Local::socket probe(executor);
  probe.connect(Local::endpoint(path), error);
  if (!error) {
    const auto peer = CredentialsOf(probe.native_handle());
    return Error{path + ": in use by " +
                 (peer ? DescribeProcess(peer->pid) : std::string("a running server"))};
  }
  return error != boost::asio::error::connection_refused
             ? Status(Error{path + ": " + error.message()})
         : unlink(path.c_str()) == 0 ? Ok()
                                     : Status(SystemError(path));
}

}  // namespace

Status ListenOnUnixSocket(const std::string& path, Local::acceptor* acceptor) {
  if (path.size() >= sizeof(sockaddr_un::sun_path)) {
    return Error{path + ": has " + std::to_string(path.size()) + " bytes, expected at most " +
                 std::to_string(sizeof(sockaddr_un::sun_path) - 1)};
  }
  PHEROMONE_TRY_STATUS(MakeRoom(path, acceptor->get_executor()));
  error_code error;
  acceptor->open(Local(), error);
  if (!error) {
    // Before the file exists, so that it never has wider permissions than intended.
    fchmod(acceptor->native_handle(), kMode);
    acceptor->bind(Local::endpoint(path), error);
  }
  if (!error && chmod(path.c_str(), kMode) != 0) {
    error = error_code(errno, boost::system::system_category());
  }
  if (!error) {
    acceptor->listen(boost::asio::socket_base::max_listen_connections, error);
  }
  if (error) {
    error_code ignored;
    acceptor->close(ignored);
    return Error{path + ": " + error.message()};
  }
  return Ok();
}

std::string PeerOf(int socket) {
  const auto peer = CredentialsOf(socket);
  return peer ? "uid " + std::to_string(peer->uid) : "";
}

std::string IdentityOf(const std::string& path) {
  struct stat found {};
  return lstat(path.c_str(), &found) == 0
             ? std::to_string(found.st_dev) + ":" + std::to_string(found.st_ino)
             : std::string();
}

}  // namespace pheromone::web
