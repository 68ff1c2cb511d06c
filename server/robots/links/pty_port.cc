// Pseudo-terminals. libserialport cannot open them (they have no entry in sysfs and no modem
// lines), so they go through termios.
#include <fcntl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <system_error>

#include "server/base/hash.h"
#include "server/robots/links/port.h"

namespace pheromone::links {
namespace {

constexpr std::string_view kPtyFolder = "/dev/pts/";

// A pseudo-terminal disappears when its master is closed, and its name may soon be reused, perhaps
// by another server. Ours are marked with control characters that have no meaning on a raw line and
// that clients do not change: two that are the same for all, and a hash of the link's path. (A lock
// would serve as well if clients did not use locks themselves.)
constexpr std::array kMarked = {VEOL2, VREPRINT, VDISCARD, VWERASE, VLNEXT};

std::array<cc_t, kMarked.size()> MarkOf(const std::string& path) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(path, error);
  const std::filesystem::path folder = std::filesystem::canonical(absolute.parent_path(), error);
  const uint64_t hash = HashText((folder / absolute.filename()).string());
  return {'P', 'h', static_cast<cc_t>(hash >> 48), static_cast<cc_t>(hash >> 32),
          static_cast<cc_t>(hash >> 16)};
}

void Mark(const std::string& path, termios* mode) {
  const auto mark = MarkOf(path);
  for (size_t i = 0; i < mark.size(); ++i) {
    mode->c_cc[kMarked[i]] = mark[i];
  }
}

// Whether the terminal is of a server whose link has this path.
bool HeldByAServer(const std::string& slave, const std::string& path) {
  const Descriptor other(open(slave.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios mode{};
  if (!other.valid() || tcgetattr(other.get(), &mode) != 0) {
    return false;
  }
  termios marked = mode;
  Mark(path, &marked);
  return std::equal(std::begin(mode.c_cc), std::end(mode.c_cc), std::begin(marked.c_cc));
}

// The target of a symbolic link; empty if it is not one.
std::string TargetOf(const std::string& path) {
  std::error_code error;
  return std::filesystem::read_symlink(path, error).string();
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
    Mark(path_, &mode);
    if (tcsetattr(slave.get(), TCSANOW, &mode) != 0) {
      return SystemError(std::string("cannot set up ") + name.data());
    }
    OpenToTheGroup(slave.get());
    PHEROMONE_TRY_STATUS(MakeLink(name.data()));
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
      if (target != slave && HeldByAServer(target, path_)) {
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
