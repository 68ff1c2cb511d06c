// Conflicts between two sections: a port to listen on, or a path to create, that both use. The
// server would start with one of the two down, which only the log would report.
#include <arpa/inet.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/config/folders.h"
#include "server/config/sections.h"

namespace pheromone::config {
namespace {

using Address = std::array<uint8_t, sizeof(in6_addr)>;

constexpr Address kAny6 = {};
constexpr Address kAny4 = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};

// IPv4 as its mapped IPv6 address: an IPv6 socket accepts both.
Address AddressOf(const std::string& text) {
  const std::string mapped = text.find(':') == std::string::npos ? "::ffff:" + text : text;
  Address address = {};
  inet_pton(AF_INET6, mapped.c_str(), address.data());
  return address;
}

// Whether `a` includes `b`, as for the system.
bool Covers(const Address& a, const Address& b) {
  const bool is_v4 = std::equal(kAny4.begin(), kAny4.end() - 4, b.begin());
  return a == b || a == kAny6 || (a == kAny4 && is_v4);
}

struct Listener {
  std::string key;  // link[2].listen
  std::string of;   // link "net"
  const Value* value = nullptr;
  bool tcp = false;
  Address address = {};
  uint16_t port = 0;
};

bool Clash(const Listener& a, const Listener& b) {
  return a.tcp == b.tcp && a.port != 0 && a.port == b.port &&
         (Covers(a.address, b.address) || Covers(b.address, a.address));
}

// A path that is created, or exists.
struct Place {
  enum class Kind { kPty, kSerial, kSocket, kFile };
  Kind kind = Kind::kFile;
  std::string key;
  std::string of;                // link "radio-a", the control socket, this configuration file
  const Value* value = nullptr;  // null: it is there without being configured
  std::filesystem::path path;
  std::vector<std::string> on = {};  // of a link

  bool is_link() const { return kind == Kind::kPty || kind == Kind::kSerial; }
};

bool Clash(const Place& a, const Place& b) {
  const auto makes = [](const Place& it) {
    return it.kind == Place::Kind::kPty || it.kind == Place::Kind::kSocket;
  };
  return a.path == b.path && !AreApart(a.on, b.on) &&
         ((a.is_link() && b.is_link()) || makes(a) || makes(b));
}

// The same for all names of a path; the target of a symbolic link in its last part is another path.
std::filesystem::path PlaceOf(const std::string& path) {
  const std::filesystem::path whole = AbsolutePath(path);
  std::error_code error;
  const std::filesystem::path folder =
      std::filesystem::weakly_canonical(whole.parent_path(), error);
  return error ? whole : folder / whole.filename();
}

std::string TextAt(const Value& table, std::string_view key) {
  const Value* value = table.Find(key);
  return value != nullptr && value->kind == Value::Kind::kString ? value->text : "";
}

// Visits the sections again, including those with errors: everything readable counts.
class Collector {
 public:
  Collector(const Value& root, const Notes& notes, const std::string& node)
      : notes_(notes), ignored_(notes.file) {
    if (notes.folder) {
      places_.push_back(
          {Place::Kind::kFile, "", "this configuration file", nullptr, PlaceOf(notes.file)});
    }
    ForEach(root, "link",
            [this](const Value& table, const std::string& path) { AddLink(table, path); });
    ForEach(root, "tracker", [this](const Value& table, const std::string& path) {
      AddListener(table, path, "tracker \"" + TextAt(table, "name") + '"', false);
    });
    ForEach(root, "web", [this](const Value& table, const std::string& path) {
      AddListener(table, path, "[web]", true);
      AddFile(table, path, "token_file");
    });
    ForEach(root, "cluster", [this, &node](const Value& table, const std::string& path) {
      const Value* nodes = table.Find("nodes");
      if (nodes != nullptr && !node.empty()) {
        AddListener(*nodes, path + ".nodes", "[cluster]", true, node);
      }
      AddFile(table, path, "secret_file");
    });
    ForEach(root, "obstacles",
            [this](const Value& table, const std::string& path) { AddFile(table, path, "map"); });
    for (const std::string_view name : {"path", "print"}) {
      ForEach(root, name, [this](const Value& table, const std::string& path) {
        AddFile(table, path, "file");
      });
    }
  }

  void AddSocket(const Value& root, const std::string& socket) {
    const Value* control = root.Find("control");
    const Value* value = control != nullptr ? control->Find("socket") : nullptr;
    if (!socket.empty()) {
      places_.push_back(
          {Place::Kind::kSocket, "control.socket", "the control socket", value, PlaceOf(socket)});
    }
  }

  /// In the order of the file.
  std::vector<Listener> listeners() const { return Sorted(listeners_); }
  std::vector<Place> places() const { return Sorted(places_); }

 private:
  // A table, or each of an array of tables.
  template <typename Function>
  static void ForEach(const Value& root, std::string_view name, const Function& function) {
    const Value* value = root.Find(name);
    if (value != nullptr && value->kind == Value::Kind::kTable) {
      function(*value, std::string(name));
    }
    const bool many = value != nullptr && value->kind == Value::Kind::kArray;
    for (size_t i = 0; many && i < value->items.size(); ++i) {
      if (value->items[i].kind == Value::Kind::kTable) {
        function(value->items[i], PathOf(name, i));
      }
    }
  }

  template <typename T>
  static std::vector<T> Sorted(std::vector<T> all) {
    const auto at = [](const T& it) { return it.value != nullptr ? it.value->at : Position{0, 0}; };
    std::stable_sort(all.begin(), all.end(), [&](const T& a, const T& b) { return at(a) < at(b); });
    return all;
  }

  void AddLink(const Value& table, const std::string& path) {
    const std::string kind = TextAt(table, "kind");
    const std::string of = "link \"" + TextAt(table, "name") + '"';
    if (kind == "tcp" || kind == "udp") {
      AddListener(table, path, of, kind == "tcp");
      return;
    }
    const std::string key = kind == "pty" ? "path" : "port";
    std::string place = TextAt(table, key);
    if (place.empty() || (kind == "serial" && table.Find("usb") != nullptr)) {
      return;
    }
    if (kind == "serial") {
      place = PortPath(place);
    }
    std::vector<std::string> on;
    if (const Value* nodes = table.Find("on"); nodes != nullptr) {
      for (const Value& node : nodes->items) {
        on.push_back(node.text);
      }
    }
    places_.push_back({kind == "pty" ? Place::Kind::kPty : Place::Kind::kSerial, path + '.' + key,
                       of, table.Find(key), PlaceOf(place), std::move(on)});
  }

  void AddListener(const Value& table, const std::string& path, const std::string& of, bool tcp,
                   const std::string& key = "listen") {
    const Value* value = table.Find(key);
    const auto endpoint =
        value != nullptr ? ReadEndpoint(TableReader(table, path, &ignored_), key) : std::nullopt;
    if (endpoint) {
      listeners_.push_back(
          {path + '.' + key, of, value, tcp, AddressOf(endpoint->address), endpoint->port});
    }
  }

  void AddFile(const Value& table, const std::string& path, const std::string& key) {
    const std::string name = TextAt(table, key);
    if (notes_.folder && !name.empty()) {
      places_.push_back({Place::Kind::kFile, path + '.' + key, "the file of " + path + '.' + key,
                         table.Find(key), PlaceOf((*notes_.folder / name).string())});
    }
  }

  const Notes& notes_;
  Problems ignored_;  // was told when the section was read
  std::vector<Listener> listeners_;
  std::vector<Place> places_;
};

void CheckListeners(const std::vector<Listener>& listeners, Problems* problems) {
  for (auto later = listeners.begin(); later != listeners.end(); ++later) {
    const auto earlier = std::find_if(listeners.begin(), later,
                                      [&](const Listener& it) { return Clash(it, *later); });
    if (earlier != later) {
      const bool same = earlier->value->text == later->value->text;
      problems->Add(later->value->at, later->key,
                    "found " + later->value->Describe() +
                        (same ? " again, expected a value not used by " + earlier->of
                              : ", expected another port than that of " + earlier->of +
                                    ", which listens on \"" + earlier->value->text + '"'));
    }
  }
}

void CheckPlaces(const std::vector<Place>& places, Problems* problems) {
  for (auto later = places.begin(); later != places.end(); ++later) {
    const auto clash =
        std::find_if(places.begin(), later, [&](const Place& it) { return Clash(it, *later); });
    if (clash == later) {
      continue;
    }
    // Two sections may read the same file.
    const bool swapped = later->kind == Place::Kind::kFile && clash->value != nullptr;
    const Place& wrong = swapped ? *clash : *later;
    const Place& right = swapped ? *later : *clash;
    if (wrong.is_link() && right.is_link()) {
      problems->Add(
          wrong.value->at, wrong.key,
          "found " + wrong.value->Describe() + " again, expected a value not used by " + right.of);
    } else {
      problems->Add(wrong.value->at, wrong.key,
                    "found " + wrong.value->Describe() + ", which is " + right.of +
                        ", expected a path of its own");
    }
  }
}

// An existing file that prevents the creation of a path; links of an earlier run are replaced.
void WarnOfObstructions(const std::vector<Place>& places, Notes* notes) {
  for (const Place& place : places) {
    struct stat found {};
    if (place.value == nullptr || lstat(place.path.c_str(), &found) != 0) {
      continue;
    }
    std::error_code error;
    const bool is_pty =
        S_ISLNK(found.st_mode) &&
        std::filesystem::read_symlink(place.path, error).string().rfind("/dev/pts/", 0) == 0;
    const char* expected =
        place.kind == Place::Kind::kPty && !is_pty ? "a link to a pseudo-terminal"
        : place.kind == Place::Kind::kSocket && !S_ISSOCK(found.st_mode) ? "a socket"
                                                                         : nullptr;
    if (expected != nullptr) {
      notes->warnings.push_back({FormatProblem(
          notes->file, place.value->at, place.key,
          place.path.string() + " already exists, expected no file there or " + expected)});
    }
  }
}

}  // namespace

void CheckConflicts(const Value& root, Notes* notes, const ControlSettings& control,
                    const std::string& node) {
  Collector collector(root, *notes, node);
  collector.AddSocket(root, control.socket);
  CheckListeners(collector.listeners(), &notes->problems);
  CheckPlaces(collector.places(), &notes->problems);
  WarnOfObstructions(collector.places(), notes);
}

}  // namespace pheromone::config
