#include "proto_tests/exchange_bench/server_process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string_view>
#include <thread>

#include "proto_tests/exchange_bench/fail.h"
#include "proto_tests/exchange_bench/process_memory.h"

namespace pheromone::bench {
namespace {

constexpr std::chrono::seconds kPatience{60};

void End(pid_t process) {
  if (process > 0) {
    kill(process, SIGTERM);
    waitpid(process, nullptr, 0);
  }
}

[[noreturn]] void Echo(int socket) {
  constexpr size_t kBatch = 64;
  static std::array<std::array<uint8_t, 2048>, kBatch> bytes;
  static std::array<sockaddr_in, kBatch> from;
  static std::array<iovec, kBatch> parts;
  static std::array<mmsghdr, kBatch> headers;
  while (true) {
    for (size_t i = 0; i < kBatch; ++i) {
      parts[i] = {bytes[i].data(), bytes[i].size()};
      headers[i].msg_hdr = {};
      headers[i].msg_hdr.msg_name = &from[i];
      headers[i].msg_hdr.msg_namelen = sizeof from[i];
      headers[i].msg_hdr.msg_iov = &parts[i];
      headers[i].msg_hdr.msg_iovlen = 1;
    }
    const int count = recvmmsg(socket, headers.data(), kBatch, MSG_WAITFORONE, nullptr);
    if (count < 0) {
      continue;
    }
    for (int i = 0; i < count; ++i) {
      const auto place = static_cast<size_t>(i);
      parts[place].iov_len = headers[place].msg_len;
    }
    for (int sent = 0; sent < count;) {
      const int more =
          sendmmsg(socket, headers.data() + sent, static_cast<unsigned>(count - sent), 0);
      sent += more > 0 ? more : 1;
    }
  }
}

}  // namespace

ServerProcess::ServerProcess(const std::string& program, const std::string& config_file,
                             const std::vector<std::string>& arguments, const std::string& folder,
                             const Environment& environment) {
  const std::string log_file = folder + "/pheromoned.log";
  std::ofstream(log_file).close();  // what one before it said is not its own
  std::vector<std::string> words = {program, "--config", config_file};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  process_ = fork();
  if (process_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    const int log = open(log_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(log, STDERR_FILENO);
    dup2(log, STDOUT_FILENO);
    for (const auto& [name, value] : environment) {
      setenv(name.c_str(), value.c_str(), 1);
    }
    if (chdir(folder.c_str()) == 0) {
      execv(program.c_str(), argv.data());
    }
    _exit(127);
  }
  AwaitReady(log_file);
}

ServerProcess::~ServerProcess() {
  End(process_);
}

void ServerProcess::Kill() {
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
  process_ = -1;
}

// The log says when the links are up, and where: "link udp-1: up, udp 127.0.0.1:40001".
void ServerProcess::AwaitReady(const std::string& log_file) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (true) {
    std::stringstream log;
    log << std::ifstream(log_file).rdbuf();
    if (log.str().find("ready: ") != std::string::npos) {
      constexpr std::string_view kBefore = ": up, udp 127.0.0.1:";
      for (std::string line; std::getline(log, line);) {
        const size_t up = line.find(kBefore);
        const size_t link = line.rfind("link ", up);
        if (up != std::string::npos && link != std::string::npos) {
          const std::string name = line.substr(link + 5, up - link - 5);
          ports_[name] = static_cast<uint16_t>(std::stoi(line.substr(up + kBefore.size())));
        }
      }
      return;
    }
    const bool ended = waitpid(process_, nullptr, WNOHANG) != 0;
    if (ended || std::chrono::steady_clock::now() > deadline) {
      Fail("pheromoned did not start:\n" + log.str());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

uint16_t ServerProcess::PortOf(const std::string& link) const {
  const auto found = ports_.find(link);
  return found != ports_.end() ? found->second : uint16_t{0};
}

long ServerProcess::rss_kib() const {
  return RssKib(process_);
}

EchoProcess::EchoProcess() {
  const int handle = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  constexpr int kBufferBytes = 4 << 20;  // as the daemon's
  setsockopt(handle, SOL_SOCKET, SO_RCVBUF, &kBufferBytes, sizeof kBufferBytes);
  setsockopt(handle, SOL_SOCKET, SO_SNDBUF, &kBufferBytes, sizeof kBufferBytes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(handle, reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      getsockname(handle, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    Fail("cannot bind a UDP socket");
  }
  port_ = ntohs(address.sin_port);
  process_ = fork();
  if (process_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    Echo(handle);
  }
  close(handle);
}

EchoProcess::~EchoProcess() {
  End(process_);
}

}  // namespace pheromone::bench
