#include "server/base/holders.h"

#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <system_error>

namespace pheromone {
namespace {

namespace fs = std::filesystem;

constexpr int kStartField = 22;  // of /proc/PID/stat

// A table of sockets, and the state of one that receives from anybody.
struct SocketTable {
  const char* name;
  const char* state;
};
constexpr std::array<SocketTable, 2> kTcpTables = {{{"net/tcp", "0A"}, {"net/tcp6", "0A"}}};
constexpr std::array<SocketTable, 2> kUdpTables = {{{"net/udp", "07"}, {"net/udp6", "07"}}};

std::string FirstLineOf(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

// Seconds since 1970; 0: unknown.
std::time_t BootTime(const fs::path& proc) {
  std::ifstream file(proc / "stat");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("btime ")) {
      return static_cast<std::time_t>(std::stoll(line.substr(6)));
    }
  }
  return 0;
}

std::time_t StartOf(const fs::path& proc, const std::string& pid) {
  const std::string line = FirstLineOf(proc / pid / "stat");
  const size_t name_end = line.rfind(')');  // the name may contain anything
  const std::time_t boot = BootTime(proc);
  if (name_end == std::string::npos || boot == 0) {
    return 0;
  }
  std::istringstream rest(line.substr(name_end + 1));
  std::string field;
  for (int i = 3; i <= kStartField; ++i) {
    rest >> field;
  }
  const long long ticks = rest ? std::stoll(field) : 0;
  return boot + static_cast<std::time_t>(ticks / std::max(1L, sysconf(_SC_CLK_TCK)));
}

bool Holds(const fs::path& process, const std::string& target) {
  std::error_code error;  // for other users' processes, and those that have just ended
  for (fs::directory_iterator it(process / "fd", error), end; !error && it != end;
       it.increment(error)) {
    std::error_code unreadable;
    const fs::path opened = fs::read_symlink(it->path(), unreadable);
    if (!unreadable && opened == target) {
      return true;
    }
  }
  return false;
}

// Of the socket that listens on `port`; empty if there is none in that table.
std::string InodeIn(const fs::path& proc, const SocketTable& table, uint16_t port) {
  std::ifstream file(proc / table.name);
  std::string line;
  std::getline(file, line);  // the titles
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::array<std::string, 10> field;
    for (std::string& it : field) {
      fields >> it;
    }
    const size_t colon = field[1].rfind(':');
    if (fields && field[3] == table.state && colon != std::string::npos &&
        std::stoul(field[1].substr(colon + 1), nullptr, 16) == port) {
      return field[9];
    }
  }
  return "";
}

}  // namespace

std::string DescribeProcess(int pid, const std::string& proc) {
  const std::string number = std::to_string(pid);
  const std::string name = FirstLineOf(fs::path(proc) / number / "comm");
  std::string text = (name.empty() ? "a program" : name) + " (process " + number;
  if (const std::time_t start = StartOf(proc, number); start != 0) {
    std::tm local{};
    std::array<char, 32> date{};
    localtime_r(&start, &local);
    std::strftime(date.data(), date.size(), "%Y-%m-%d %H:%M:%S", &local);
    text += std::string(", since ") + date.data();
  }
  return text + ")";
}

std::vector<int> HoldersOf(const std::string& target, const std::string& proc) {
  std::error_code error;
  const fs::path canonical = fs::canonical(target, error);
  const std::string shown = error ? target : canonical.string();  // in /proc
  std::vector<int> holders;
  for (fs::directory_iterator it(proc, error), end; !error && it != end; it.increment(error)) {
    const std::string id = it->path().filename().string();
    const bool is_process = id.find_first_not_of("0123456789") == std::string::npos &&
                            id.size() < std::numeric_limits<int>::digits10;
    if (is_process && id != std::to_string(getpid()) && Holds(it->path(), shown)) {
      holders.push_back(std::stoi(id));
    }
  }
  std::sort(holders.begin(), holders.end());
  return holders;
}

std::optional<int> HolderOfLock(int descriptor, const std::string& proc) {
  struct stat file {};
  if (fstat(descriptor, &file) != 0) {
    return std::nullopt;
  }
  std::array<char, 64> name{};
  std::snprintf(name.data(), name.size(), "%02x:%02x:%ju", major(file.st_dev), minor(file.st_dev),
                static_cast<uintmax_t>(file.st_ino));
  // "1: FLOCK  ADVISORY  WRITE 4711 00:1a:4 0 EOF"; of one that waits, the second field is "->".
  std::ifstream locks(fs::path(proc) / "locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream fields(line);
    std::array<std::string, 4> skipped;
    int pid = 0;
    std::string inode;
    for (std::string& field : skipped) {
      fields >> field;
    }
    if (fields >> pid >> inode && skipped[1] == "FLOCK" && inode == name.data() && pid > 0) {
      return pid;
    }
  }
  return std::nullopt;
}

std::optional<int> HolderOfPort(uint16_t port, Transport transport, const std::string& proc) {
  for (const SocketTable& table : transport == Transport::kTcp ? kTcpTables : kUdpTables) {
    const std::string inode = InodeIn(proc, table, port);
    if (inode.empty()) {
      continue;
    }
    const std::vector<int> holders = HoldersOf("socket:[" + inode + "]", proc);
    if (!holders.empty()) {
      return holders.front();
    }
  }
  return std::nullopt;
}

}  // namespace pheromone
