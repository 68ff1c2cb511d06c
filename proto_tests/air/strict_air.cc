// A half-duplex radio channel between terminals, in real time, as strict as real air: a judge,
// which shares no code with the simulator (client_fw/sim/radio_medium.h) or the server.
//
//   strict_air [--seconds N] [--damage P] [--burst N] [--seed N] STATION...
//
// STATION is PATH, or PATH,KEY=VALUE,...:
//   open=1        open the terminal PATH; otherwise PATH becomes a link to a new pseudo-terminal
//   turn=2        ms from a byte leaving the UART to its being on the air, and from the last byte
//   on
//                 the air until the modem hears again
//   uart=1        0: what is written has just left a UART, byte by byte
//   adapter=0     ms for which received bytes are held back
//   key=PATH      the modem is keyed by a line: a FIFO in which each change of it is a byte, '1' or
//   '0' rise=0        of such a modem, ms from being keyed until it can send hold=0        of such
//   a modem, ms for which it delays what it sends
//
// 9600 baud. What is written to a terminal leaves its UART byte by byte. Two bytes of different
// stations that overlap on the air are destroyed at every listener; so is one that overlaps the
// carrier of a keyed station, one that is sent before its own modem can, and one that is cut off. A
// station hears nothing from its first byte on until its modem has turned round. Each listener
// gets a byte wrong with probability P, in runs of N bytes in the mean.
//
// A terminal that was opened may go, and come again. Prints a line when the terminals are there,
// and at SIGTERM or the end of the time what became of all bytes, a line for each station; and of
// each, how many different TRACEs it sent, by their seq.
#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kByte = 10'000'000'000 / 9600;
constexpr int64_t kLook = kMs / 5;
constexpr int64_t kNever = std::numeric_limits<int64_t>::max();
constexpr size_t kAdapterBytes = 62;

volatile std::sig_atomic_t stop_requested = 0;

void OnStop(int /*signal*/) {
  stop_requested = 1;
}

int64_t Now() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

struct Span {
  int64_t from;
  int64_t to;
  bool Overlaps(const Span& other) const { return from < other.to && other.from < to; }
};

struct Byte {
  uint8_t value;
  size_t sender;
  Span air;
  bool spoilt;
};

// Reads what a station sends, before it is on the air.
class Ledger {
 public:
  void Read(uint8_t byte) {
    if (after_dle_) {
      after_dle_ = false;
      if (byte == 0x02) {
        body_.clear();
        open_ = true;
      } else if (byte == 0x03) {
        if (open_) {
          Frame();
        }
        open_ = false;
      } else if (byte == 0x10 && open_) {
        body_.push_back(byte);
      } else {
        open_ = false;
      }
    } else if (byte == 0x10) {
      after_dle_ = true;
    } else if (open_) {
      body_.push_back(byte);
    }
  }
  uint64_t traces() const { return traces_; }

 private:
  void Frame() {
    uint16_t crc = 0;
    for (const uint8_t byte : body_) {
      crc = static_cast<uint16_t>(crc ^ byte);
      for (int bit = 0; bit < 8; ++bit) {
        crc = static_cast<uint16_t>((crc & 1) != 0 ? crc >> 1 ^ 0xA001 : crc >> 1);
      }
    }
    // CLIENT_ID, opcode, seq; of TRACE and of EVENT, which share a counter.
    if (crc != 0 || body_.size() < 5) {
      return;
    }
    const bool trace = (body_[1] & 0xF0) == 0x30;
    if ((trace || body_[1] == 0x52) && body_[2] != last_seq_) {
      last_seq_ = body_[2];
      traces_ += trace ? 1 : 0;
    }
  }

  std::vector<uint8_t> body_;
  bool after_dle_ = false;
  bool open_ = false;
  int last_seq_ = -1;
  uint64_t traces_ = 0;
};

struct Station {
  std::string path;
  Ledger ledger;
  std::map<std::string, std::string> given;
  int fd = -1;
  int key_fd = -1;
  int64_t turn = 2 * kMs;
  int64_t adapter = 0;
  int64_t rise = 0;
  int64_t hold = 0;
  bool has_uart = true;
  bool keyed_by_line = false;

  int64_t uart_free = 0;
  std::deque<Span> deaf;     // the last is the present one, if it has not ended
  std::deque<Span> carrier;  // of a keyed modem
  bool key = false;
  int64_t key_edge = 0;
  std::deque<uint8_t> held;  // by the adapter
  int64_t deliver_at = kNever;
  bool in_burst = false;

  uint64_t sent = 0;
  uint64_t collided = 0;
  uint64_t cut = 0;  // too early, or cut off, for its own modem
  uint64_t heard = 0;
  uint64_t damaged = 0;
  uint64_t missed_deaf = 0;
};

[[noreturn]] void Fail(const std::string& what) {
  throw std::runtime_error(what + ": " + std::strerror(errno));
}

Station Parse(const std::string& text) {
  Station station;
  size_t at = text.find(',');
  station.path = text.substr(0, at);
  while (at != std::string::npos) {
    const size_t next = text.find(',', at + 1);
    const std::string word = text.substr(at + 1, next == std::string::npos ? next : next - at - 1);
    const size_t equals = word.find('=');
    if (equals == std::string::npos) {
      throw std::runtime_error(text + ": found \"" + word + "\", expected KEY=VALUE");
    }
    station.given[word.substr(0, equals)] = word.substr(equals + 1);
    at = next;
  }
  const auto take = [&](const char* key, int64_t otherwise) {
    const auto found = station.given.find(key);
    const int64_t value = found == station.given.end()
                              ? otherwise
                              : static_cast<int64_t>(std::stod(found->second) * kMs);
    return value;
  };
  station.turn = take("turn", 2 * kMs);
  station.adapter = take("adapter", 0);
  station.rise = take("rise", 0);
  station.hold = take("hold", 0);
  station.has_uart = take("uart", kMs) != 0;
  station.keyed_by_line = station.given.count("key") != 0;
  return station;
}

void Open(Station* station) {
  if (station->given.count("open") != 0) {
    station->fd = open(station->path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (station->fd < 0) {
      Fail(station->path);
    }
  } else {
    station->fd = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    std::array<char, 64> name{};
    if (station->fd < 0 || grantpt(station->fd) != 0 || unlockpt(station->fd) != 0 ||
        ptsname_r(station->fd, name.data(), name.size()) != 0) {
      Fail("a pseudo-terminal");
    }
    // Held open, so that a client may come and go.
    const int slave = open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    unlink(station->path.c_str());
    if (slave < 0 || symlink(name.data(), station->path.c_str()) != 0) {
      Fail(station->path);
    }
    termios raw{};
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    cfsetspeed(&raw, B9600);
    tcsetattr(slave, TCSANOW, &raw);
  }
  termios raw{};
  if (tcgetattr(station->fd, &raw) == 0) {
    cfmakeraw(&raw);
    tcsetattr(station->fd, TCSANOW, &raw);
  }
  if (station->keyed_by_line) {
    station->key_fd = open(station->given["key"].c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (station->key_fd < 0) {
      Fail(station->given["key"]);
    }
  }
}

class Air {
 public:
  Air(std::vector<Station> stations, double damage, double burst, uint64_t seed)
      : stations_(std::move(stations)), damage_(damage), burst_(burst), random_(seed) {}

  void Step(int64_t now) {
    latest_look_ = std::max(latest_look_, last_ == 0 ? 0 : now - last_);
    last_ = now;
    for (size_t i = 0; i < stations_.size(); ++i) {
      ReadKey(i, now);
      ReadBytes(i, now);
    }
    Settle(now);
    for (Station& station : stations_) {
      Deliver(&station, now);
    }
  }

  void Tell() const {
    for (const Station& s : stations_) {
      std::printf(
          "%s sent %llu collided %llu cut %llu heard %llu damaged %llu missed while deaf %llu "
          "traces %llu\n",
          s.path.c_str(), Count(s.sent), Count(s.collided), Count(s.cut), Count(s.heard),
          Count(s.damaged), Count(s.missed_deaf), Count(s.ledger.traces()));
    }
    std::printf("longest pause of this process %.1f ms\n", static_cast<double>(latest_look_) / kMs);
    std::fflush(stdout);
  }

 private:
  static unsigned long long Count(uint64_t value) { return value; }

  void ReadKey(size_t index, int64_t now) {
    Station& station = stations_[index];
    std::array<char, 64> edges{};
    const ssize_t size = station.key_fd < 0 ? 0 : read(station.key_fd, edges.data(), edges.size());
    for (ssize_t i = 0; i < size; ++i) {
      const bool key = edges[static_cast<size_t>(i)] == '1';
      if (key == station.key) {
        continue;
      }
      station.key = key;
      station.key_edge = now;
      if (key) {
        station.carrier.push_back({now, kNever});
        station.deaf.push_back({now, kNever});
      } else {
        station.carrier.back().to = now;
        station.deaf.back().to = now + station.turn;
        for (Byte& byte : on_air_) {  // what had not left
          if (byte.sender == index && byte.air.to > now) {
            byte.spoilt = true;
            ++station.cut;
          }
        }
      }
    }
  }

  void ReadBytes(size_t index, int64_t now) {
    Station& station = stations_[index];
    std::array<uint8_t, 4096> bytes{};
    if (station.fd < 0) {
      station.fd = open(station.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    }
    const ssize_t size = station.fd < 0 ? 0 : read(station.fd, bytes.data(), bytes.size());
    if (station.given.count("open") != 0 && station.fd >= 0 &&
        (size == 0 || (size < 0 && errno != EAGAIN))) {
      close(station.fd);
      station.fd = -1;
    }
    for (ssize_t i = 0; i < size; ++i) {
      const int64_t start = std::max(station.has_uart ? now : now - kByte, station.uart_free);
      station.uart_free = start + kByte;
      const int64_t delay = station.keyed_by_line ? station.hold : station.turn;
      Byte byte{
          bytes[static_cast<size_t>(i)], index, {start + delay, start + delay + kByte}, false};
      ++station.sent;
      station.ledger.Read(byte.value);
      if (!station.keyed_by_line) {
        if (station.deaf.empty() || station.deaf.back().to < start) {
          station.deaf.push_back({start, start});
        }
        station.deaf.back().to = byte.air.to + station.turn;
      } else if (!station.key || start < station.key_edge + station.rise) {
        byte.spoilt = true;
        ++station.cut;
      }
      on_air_.push_back(byte);
    }
  }

  // What has been on the air wholly, and all that may have overlapped it is known.
  void Settle(int64_t now) {
    std::stable_sort(on_air_.begin(), on_air_.end(),
                     [](const Byte& a, const Byte& b) { return a.air.to < b.air.to; });
    while (!on_air_.empty() && on_air_.front().air.to <= now) {
      Byte byte = on_air_.front();
      on_air_.pop_front();
      const bool collided = Collides(byte);
      if (collided) {
        ++stations_[byte.sender].collided;
      }
      settled_.push_back(byte);
      while (settled_.front().air.to < byte.air.from - kByte) {
        settled_.pop_front();
      }
      for (size_t i = 0; i < stations_.size(); ++i) {
        if (i != byte.sender) {
          Hear(&stations_[i], byte, collided || byte.spoilt, now);
        }
      }
    }
    for (Station& station : stations_) {
      for (std::deque<Span>* spans : {&station.deaf, &station.carrier}) {
        while (spans->size() > 1 && spans->front().to < now - 1000 * kMs) {
          spans->pop_front();
        }
      }
    }
  }

  bool Collides(const Byte& byte) const {
    const auto overlaps = [&byte](const Byte& other) {
      return other.sender != byte.sender && other.air.Overlaps(byte.air);
    };
    if (std::any_of(settled_.begin(), settled_.end(), overlaps) ||
        std::any_of(on_air_.begin(), on_air_.end(), overlaps)) {
      return true;
    }
    for (size_t i = 0; i < stations_.size(); ++i) {
      const auto& carrier = stations_[i].carrier;
      if (i != byte.sender &&
          std::any_of(carrier.begin(), carrier.end(),
                      [&byte](const Span& span) { return span.Overlaps(byte.air); })) {
        return true;
      }
    }
    return false;
  }

  void Hear(Station* station, const Byte& byte, bool destroyed, int64_t now) {
    if (std::any_of(station->deaf.begin(), station->deaf.end(),
                    [&byte](const Span& span) { return span.Overlaps(byte.air); })) {
      ++station->missed_deaf;
      return;
    }
    uint8_t value = byte.value;
    if (destroyed) {
      value = static_cast<uint8_t>(random_());
    } else if (Damages(station)) {
      value = static_cast<uint8_t>(value ^ (1u + random_() % 255u));
      ++station->damaged;
    }
    ++station->heard;
    if (station->held.empty()) {
      station->deliver_at = now + station->adapter;
    }
    station->held.push_back(value);
    if (station->held.size() >= kAdapterBytes) {
      station->deliver_at = now;
    }
  }

  bool Damages(Station* station) {
    const auto happens = [this](double p) {
      return p > 0 && std::uniform_real_distribution<double>(0, 1)(random_) < p;
    };
    if (burst_ <= 1) {
      return happens(damage_);
    }
    station->in_burst =
        happens(station->in_burst ? 1 - 1 / burst_ : damage_ / (burst_ * (1 - damage_)));
    return station->in_burst;
  }

  static void Deliver(Station* station, int64_t now) {
    if (station->held.empty() || station->deliver_at > now) {
      return;
    }
    if (station->fd < 0) {
      station->held.clear();
      return;
    }
    const std::vector<uint8_t> bytes(station->held.begin(), station->held.end());
    station->held.clear();
    if (write(station->fd, bytes.data(), bytes.size()) < 0 && errno != EAGAIN && errno != EIO) {
      Fail(station->path);
    }
  }

  std::vector<Station> stations_;
  double damage_;
  double burst_;
  std::mt19937_64 random_;
  std::deque<Byte> on_air_;
  std::deque<Byte> settled_;
  int64_t last_ = 0;
  int64_t latest_look_ = 0;
};

int Run(int argc, char** argv) {
  double damage = 0;
  double burst = 1;
  double seconds = 1e9;
  uint64_t seed = 1;
  std::vector<Station> stations;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.rfind("--", 0) != 0) {
      stations.push_back(Parse(word));
    } else if (i + 1 == argc) {
      throw std::runtime_error(word + ": a value is missing");
    } else if (word == "--damage") {
      damage = std::stod(argv[++i]);
    } else if (word == "--burst") {
      burst = std::stod(argv[++i]);
    } else if (word == "--seconds") {
      seconds = std::stod(argv[++i]);
    } else if (word == "--seed") {
      seed = std::stoull(argv[++i]);
    } else {
      throw std::runtime_error(word + ": no such option");
    }
  }
  for (Station& station : stations) {
    Open(&station);
  }
  prctl(PR_SET_TIMERSLACK, 1000);
  std::printf("on air with %zu stations\n", stations.size());
  std::fflush(stdout);
  Air air(std::move(stations), damage, burst, seed);
  const int64_t end = Now() + static_cast<int64_t>(seconds * 1e9);
  for (int64_t at = Now(); stop_requested == 0 && at < end; at = std::max(at + kLook, Now())) {
    const timespec until = {at / 1'000'000'000, at % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
    air.Step(Now());
  }
  air.Tell();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGTERM, &OnStop);
  std::signal(SIGINT, &OnStop);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return Run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "strict_air: %s\n", error.what());
    return 1;
  }
}
