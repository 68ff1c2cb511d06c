#include "proto_tests/cluster/etcd_members.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "server/base/descriptor.h"

namespace pheromone::cluster {
namespace {

constexpr char kAddress[] = "127.0.0.1";
constexpr char kProgram[] = "/usr/bin/etcd";

std::string NameOf(size_t member) {
  return "m" + std::to_string(member);
}

// In the child, where nothing may allocate.
[[noreturn]] void Become(const std::vector<char*>& arguments, const char* log) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int output = open(log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  execv(kProgram, arguments.data());
  _exit(127);
}

}  // namespace

// Different ones: all are chosen before any is given back.
std::vector<uint16_t> FreePorts(size_t count) {
  std::vector<Descriptor> sockets;
  std::vector<uint16_t> ports;
  for (size_t i = 0; i < count; ++i) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    const Descriptor& socket = sockets.emplace_back(::socket(AF_INET, SOCK_STREAM, 0));
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    if (bind(socket.get(), generic, size) != 0 || getsockname(socket.get(), generic, &size) != 0) {
      throw std::runtime_error(SystemError("no free port"));
    }
    ports.push_back(ntohs(address.sin_port));
  }
  return ports;
}

EtcdMembers::EtcdMembers() {
  if (!std::filesystem::exists(kProgram)) {
    throw std::runtime_error(std::string(kProgram) + " is missing: install etcd-server");
  }
  const std::vector<uint16_t> ports = FreePorts(2 * kCount);
  for (size_t member = 0; member < kCount; ++member) {
    endpoints_.push_back({kAddress, ports[member]});
    peers_.push_back(ToText(Endpoint{kAddress, ports[kCount + member]}));
  }
  for (size_t member = 0; member < kCount; ++member) {
    Start(member);
  }
}

EtcdMembers::~EtcdMembers() {
  for (size_t member = 0; member < kCount; ++member) {
    Kill(member);
  }
}

void EtcdMembers::Start(size_t member) {
  if (processes_[member] != 0) {
    return;
  }
  std::string cluster;
  for (size_t i = 0; i < kCount; ++i) {
    cluster += (i > 0 ? "," : "") + NameOf(i) + "=http://" + peers_[i];
  }
  const std::string client = "http://" + ToText(endpoints_[member]);
  const std::string peer = "http://" + peers_[member];
  // Elections are short, for tests, but not so short that a busy machine begins one.
  std::vector<std::string> arguments = {kProgram,
                                        "--name",
                                        NameOf(member),
                                        "--data-dir",
                                        folder_ / NameOf(member),
                                        "--listen-client-urls",
                                        client,
                                        "--advertise-client-urls",
                                        client,
                                        "--listen-peer-urls",
                                        peer,
                                        "--initial-advertise-peer-urls",
                                        peer,
                                        "--initial-cluster",
                                        cluster,
                                        "--initial-cluster-state",
                                        "new",
                                        "--pre-vote",
                                        "--heartbeat-interval",
                                        "50",
                                        "--election-timeout",
                                        "500",
                                        "--logger",
                                        "zap",
                                        "--log-level",
                                        "warn"};
  std::vector<char*> pointers;
  for (std::string& argument : arguments) {
    pointers.push_back(argument.data());
  }
  pointers.push_back(nullptr);
  const std::string log = folder_ / (NameOf(member) + ".log");
  const pid_t process = fork();
  if (process == 0) {
    Become(pointers, log.c_str());
  }
  if (process < 0) {
    throw std::runtime_error(SystemError("fork"));
  }
  processes_[member] = process;
}

void EtcdMembers::Kill(size_t member) {
  if (processes_[member] != 0) {
    kill(processes_[member], SIGKILL);
    waitpid(processes_[member], nullptr, 0);
    processes_[member] = 0;
  }
}

uint64_t EtcdMembers::DatabaseBytes() const {
  uint64_t largest = 0;
  for (size_t member = 0; member < kCount; ++member) {
    largest = std::max<uint64_t>(
        largest, std::filesystem::file_size(folder_ / (NameOf(member) + "/member/snap/db")));
  }
  return largest;
}

}  // namespace pheromone::cluster
