#include "server/operators/ctl/watch.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>

#include "server/base/descriptor.h"
#include "server/base/escape.h"
#include "server/base/percent.h"
#include "server/base/standard_output.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/screen.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

constexpr int kBetweenPicturesMs = 250;
constexpr int kStatusLines = 2;

volatile std::sig_atomic_t g_ended = 0;

void OnSignal(int /*signal*/) {
  g_ended = 1;
}

// A resized terminal interrupts the wait, which is sufficient.
void OnResize(int /*signal*/) {}

ScreenSize SizeOf(const WatchOptions& watch) {
  winsize terminal{};
  ScreenSize size;
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &terminal) == 0 && terminal.ws_col > 0) {
    size = {terminal.ws_col, terminal.ws_row};
  }
  return {watch.columns != 0 ? watch.columns : size.columns,
          watch.rows != 0 ? watch.rows : size.rows};
}

// NO_COLOR (https://no-color.org) and COLORTERM are the established conventions.
Colours ColoursOf(const WatchOptions& watch) {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string_view(value != nullptr ? value : "");
  };
  if (!watch.colours.empty()) {
    return watch.colours == "none"  ? Colours::kNone
           : watch.colours == "256" ? Colours::k256
                                    : Colours::k24Bit;
  }
  if (isatty(STDOUT_FILENO) == 0 || !variable("NO_COLOR").empty() || variable("TERM") == "dumb") {
    return Colours::kNone;
  }
  const std::string_view colours = variable("COLORTERM");
  return colours == "truecolor" || colours == "24bit" ? Colours::k24Bit : Colours::k256;
}

// The terminal's mode for the picture: no line editing, no echo, no cursor, and the alternate
// screen, so that the previous contents are restored.
class RawTerminal {
 public:
  RawTerminal() {
    is_terminal_ = tcgetattr(STDIN_FILENO, &before_) == 0;
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    if (is_terminal_) {
      tcsetattr(STDIN_FILENO, TCSANOW, &raw);
    }
    Write("\x1b[?1049h\x1b[?25l\x1b[2J");
  }
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;
  ~RawTerminal() {
    Write("\x1b[?25h\x1b[?1049l");
    if (is_terminal_) {
      tcsetattr(STDIN_FILENO, TCSANOW, &before_);
    }
  }

  // 0, or the error of the output, as in errno.
  static int Write(std::string_view text) { return WriteAll(STDOUT_FILENO, text) ? 0 : errno; }

  // Waits until the next picture is due. False: the operator quits.
  static bool Wait() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, kBetweenPicturesMs) > 0) {
      char key = 0;
      if (read(STDIN_FILENO, &key, 1) <= 0 || key == 'q' || key == 'Q' || key == '\x1b') {
        return false;
      }
    }
    return g_ended == 0;
  }

 private:
  termios before_{};
  bool is_terminal_ = false;
};

struct Frame {
  int exit_status = 0;
  std::string text;
};

// The pheromone to watch: the one that was named, or the first that is not a blend.
std::string PheromoneOf(const WatchOptions& watch, const json::value& laws) {
  if (!watch.pheromone.empty()) {
    return watch.pheromone;
  }
  for (const json::value& law : ItemsAt(laws, "pheromones")) {
    if (At(law, "blend").is_null()) {
      return std::to_string(CountAt(law, "type"));
    }
  }
  return "1";
}

MapPicture PictureOf(const json::value& field, const json::value& clients) {
  MapPicture picture;
  picture.columns = static_cast<int>(CountAt(field, "columns"));
  picture.rows = static_cast<int>(CountAt(field, "rows"));
  picture.maximum = NumberAt(field, "maximum");
  picture.cell_m = NumberAt(field, "cell_m");
  const json::array& origin = ItemsAt(field, "origin_m");
  if (origin.size() == 2 && origin[0].is_number() && origin[1].is_number()) {
    picture.left_m = origin[0].to_number<double>();
    picture.bottom_m = origin[1].to_number<double>();
  }
  for (const json::value& row : ItemsAt(field, "values")) {
    for (const json::value& value : row.is_array() ? row.get_array() : json::array()) {
      picture.values.push_back(value.is_number() ? std::optional(value.to_number<double>())
                                                 : std::nullopt);
    }
  }
  for (const json::value& client : ItemsAt(clients, "clients")) {
    if (const json::value& pose = At(client, "pose"); !pose.is_null()) {
      picture.markers.push_back({NumberAt(pose, "x_m"), NumberAt(pose, "y_m"),
                                 NumberAt(pose, "heading_deg"),
                                 std::to_string(CountAt(client, "id"))});
    }
  }
  return picture;
}

Frame MakeFrame(const ServerOptions& options, const WatchOptions& watch) {
  const JsonReply laws = CallJson(options, "GET", "/api/v1/laws");
  if (laws.exit_status != 0) {
    return {laws.exit_status, ""};
  }
  const ScreenSize size = SizeOf(watch);
  const ScreenSize map_size{size.columns, size.rows - kStatusLines};
  const json::value& map = At(laws.value, "map");
  const int nodes = NodesPerCell(static_cast<int>(CountAt(map, "columns")),
                                 static_cast<int>(CountAt(map, "rows")), map_size);
  const std::string pheromone = PheromoneOf(watch, laws.value);
  const JsonReply field = CallJson(
      options, "GET",
      fmt::format("/api/v1/field?pheromone={}&nodes_per_cell={}", PercentEncode(pheromone), nodes));
  if (field.exit_status != 0) {
    return {field.exit_status, ""};
  }
  const JsonReply clients = CallJson(options, "GET", "/api/v1/clients");
  if (clients.exit_status != 0) {
    return {clients.exit_status, ""};
  }
  const MapPicture picture = PictureOf(field.value, clients.value);
  const size_t robots = ItemsAt(clients.value, "clients").size();
  const size_t nowhere = robots - picture.markers.size();
  std::string status = fmt::format(
      "{} up to {}, a cell is {:g} m; {} robot{}{}; field time {:.1f} s",
      TextAt(field.value, "pheromone"), picture.maximum, picture.cell_m, robots,
      robots == 1 ? "" : "s", nowhere == 0 ? "" : fmt::format(", {} without a position", nowhere),
      NumberAt(field.value, "field_time_s"));
  // The map's colours are written as they are; the name is the server's.
  status = EscapeControls(status, "");
  status.resize(std::min(status.size(), static_cast<size_t>(size.columns)));
  status.resize(status.size() - UnfinishedAtEnd(status));
  return {0, Draw(picture, map_size, ColoursOf(watch)) + status + '\n'};
}

// Lines of a frame, each cleared to its end, which removes the rest of a wider frame.
std::string OverOld(const std::string& frame) {
  std::string text = "\x1b[H";
  for (const char c : frame) {
    text += c == '\n' ? "\x1b[K\r\n" : std::string(1, c);
  }
  return text + "q quits\x1b[J";
}

void Catch(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigaction(signal, &action, nullptr);
}

}  // namespace

int Watch(const ServerOptions& options, const WatchOptions& watch) {
  Frame frame = MakeFrame(options, watch);
  if (frame.exit_status != 0 || watch.once) {
    fmt::print(Unescaped(stdout), "{}", frame.text);
    return frame.exit_status;
  }
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    Catch(signal, OnSignal);
  }
  Catch(SIGWINCH, OnResize);
  Catch(SIGPIPE, SIG_IGN);  // the keyboard gets its echo back before the program ends
  std::optional<RawTerminal> terminal(std::in_place);
  int not_taken = 0;
  do {
    not_taken = RawTerminal::Write(OverOld(frame.text));
    if (not_taken != 0 || !RawTerminal::Wait()) {
      break;
    }
    frame = MakeFrame(options, watch);
  } while (frame.exit_status == 0);
  terminal.reset();
  if (not_taken == EPIPE) {
    Catch(SIGPIPE, SIG_DFL);
    std::raise(SIGPIPE);
  }
  if (not_taken != 0) {
    return Fail(kFailed,
                std::string("standard output cannot be written: ") + std::strerror(not_taken));
  }
  // Errors were shown on the alternate screen: print them again.
  return frame.exit_status != 0 ? MakeFrame(options, watch).exit_status : 0;
}

}  // namespace pheromone::ctl
