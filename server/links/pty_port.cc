// Pseudo-terminals. libserialport cannot open them (they have no entry in sysfs and no modem
// lines), so they go through termios.
#include <fcntl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <climits>
#include <cstdlib>
#include <string_view>

#include "server/links/port.h"

namespace pheromone::links {
namespace {

constexpr std::string_view kPtyFolder = "/dev/pts/";

// A pseudo-terminal disappears when its master is closed, and its name may soon be reused. Ours are
// marked with control characters that have no meaning on a raw line and that clients do not change.
// (A lock would serve as well if clients did not use locks themselves.)
constexpr cc_t kMark[] = {'P', 'h'};

void Mark(termios* mode) {
  mode->c_cc[VEOL2] = kMark[0];
  mode->c_cc[VREPRINT] = kMark[1];
}

bool HeldByAServer(const std::string& slave) {
  const Descriptor other(open(slave.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios mode{};
  return other.valid() && tcgetattr(other.get(), &mode) == 0 && mode.c_cc[VEOL2] == kMark[0] &&
         mode.c_cc[VREPRINT] == kMark[1];
}

// The target of a symbolic link; empty if it is not one.
std::string TargetOf(const std::string& path) {
  std::array<char, PATH_MAX> target{};
  const ssize_t size = readlink(path.c_str(), target.data(), target.size());
  return size > 0 ? std::string(target.data(), static_cast<size_t>(size)) : std::string();
}

// Gives access to the user's group, as for the control socket: by default, devpts lets only the
// user read it, and assigns it to the group tty. If this fails, the default remains.
void OpenToTheGroup(int slave) {
  if (fchown(slave, static_cast<uid_t>(-1), getegid()) == 0) {
    (void)fchmod(slave, S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP);
  }
}

class PtyPort final : public Port {
 public:
  explicit PtyPort(std::string path) : path_(std::move(path)) {}
  ~PtyPort() override { RemoveLink(); }

  Result<Descriptor> Open() override {
    Descriptor master(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    std::array<char, 64> name{};
    if (!master.valid() || grantpt(master.get()) != 0 || unlockpt(master.get()) != 0 ||
        ptsname_r(master.get(), name.data(), name.size()) != 0) {
      return SystemError("cannot make a pseudo-terminal");
    }
    Descriptor slave(open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
    termios mode{};
    if (!slave.valid() || tcgetattr(slave.get(), &mode) != 0) {
      return SystemError(std::string("cannot open ") + name.data());
    }
    cfmakeraw(&mode);
    Mark(&mode);
    if (tcsetattr(slave.get(), TCSANOW, &mode) != 0) {
      return SystemError(std::string("cannot set up ") + name.data());
    }
    OpenToTheGroup(slave.get());
    const Status linked = MakeLink(name.data());
    if (!linked.ok()) {
      return Error{linked.error()};
    }
    slave_ = std::move(slave);
    slave_name_ = name.data();
    return master;
  }

  void Close() override {
    RemoveLink();
    slave_ = Descriptor();
    slave_name_.clear();
  }

  std::string Describe() const override {
    return "pty " + path_ + (slave_name_.empty() ? "" : " -> " + slave_name_);
  }

 private:
  Status MakeLink(const std::string& slave) const {
    struct stat found = {};
    if (lstat(path_.c_str(), &found) == 0) {
      const std::string target = TargetOf(path_);
      if ((found.st_mode & S_IFMT) != S_IFLNK ||
          target.compare(0, kPtyFolder.size(), kPtyFolder) != 0) {
        return Error{path_ +
                     " exists and is not a link to a pseudo-terminal; remove it or configure "
                     "another path"};
      }
      if (target != slave && HeldByAServer(target)) {
        return Error{path_ + " belongs to another running server"};
      }
    }
    // Created under another name and renamed, so that there is always either the old or the new
    // one.
    const std::string aside = path_ + "." + std::to_string(getpid());
    unlink(aside.c_str());
    if (symlink(slave.c_str(), aside.c_str()) != 0) {
      return SystemError("cannot make the symbolic link " + path_);
    }
    if (rename(aside.c_str(), path_.c_str()) != 0) {
      const Error error = SystemError("cannot make the symbolic link " + path_);
      unlink(aside.c_str());
      return error;
    }
    return Ok();
  }

  void RemoveLink() const {
    if (!slave_name_.empty() && TargetOf(path_) == slave_name_) {
      unlink(path_.c_str());
    }
  }

  const std::string path_;
  Descriptor slave_;
  std::string slave_name_;
};

}  // namespace

std::unique_ptr<Port> MakePtyPort(std::string path) {
  return std::make_unique<PtyPort>(std::move(path));
}

}  // namespace pheromone::links
