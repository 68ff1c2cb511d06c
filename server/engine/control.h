// The control interface: what an operator may see of a running server, and change in it. HTTP
// (server/web) speaks to this and to nothing else of the server; the daemon implements it over the
// service and the links.
//
//   const StatusView status = control->GetStatus(false);
//   control->Edit(edit, [](const Result<EditOutcome>& outcome) { ... });
//
// Views are copies, taken under the service's lock for as long as copying takes; the field itself
// is looked at through a FieldReader, which holds nobody up. Changes go through the ordered log as
// a robot's do, and no thread waits for them: whoever asks for one is called back.
//
// A callback is called exactly once, from any thread, perhaps before the function that it was given
// to returns; it must not take long. An error says that nothing was changed, unless it says
// otherwise: a change that the disk does not take within some seconds is "applied; not yet
// durable".
//
// Thread-safe: every function may be called from any thread. Times are field time in milliseconds
// unless their names say otherwise.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/engine/latency.h"
#include "server/engine/service.h"
#include "server/field/field.h"

namespace pheromone::engine {

/// The recording of all that passes: the present one, or the last.
struct CaptureView {
  bool recording = false;
  std::string folder;    ///< where its files are
  std::string file;      ///< the present one, or the last; empty: there was none
  std::string error;     ///< why it ended by itself; empty: it did not
  uint64_t files = 0;    ///< begun
  uint64_t bytes = 0;    ///< written
  uint64_t records = 0;  ///< taken
  uint64_t lost = 0;     ///< records that the disk could not take in time
};

/// The server as a whole.
struct StatusView {
  std::string version;
  double uptime_s = 0;
  uint64_t field_time_ms = 0;
  uint16_t epoch = 0;
  uint64_t sequence = 0;               ///< of the last event of the log
  uint64_t durable_sequence = 0;       ///< of the last that a crash cannot take back
  std::optional<uint64_t> state_hash;  ///< if it was asked for: it may cost a look at a whole layer
  size_t links = 0;
  size_t links_up = 0;
  size_t robots = 0;  ///< that have said HELLO
  size_t nodes = 0;   ///< remembered, of all types that do not diffuse
  size_t tiles = 0;
  uint64_t field_bytes = 0;
  uint64_t field_limit_bytes = 0;
  ServiceCounters service;
  EngineCounters engine;
  std::array<uint64_t, 128> requests_by_opcode{};
  LatencyCounts latency;        ///< of batches of requests: waiting for the engine, and in it
  uint64_t resident_bytes = 0;  ///< of the process
  uint64_t open_descriptors = 0;
  double cpu_s = 0;
  CaptureView capture;
  std::string warning;  ///< why the server is not healthy, see CheckHealth; empty: it is
};

/// A number that only grows, with its name in snake_case and what it counts, in words.
struct NamedCount {
  std::string_view name;
  std::string_view help;
  uint64_t count = 0;
};

struct LinkView {
  std::string name;
  std::string kind;     ///< "pty", "serial", "tcp"
  std::string address;  ///< how it is reached; empty while that is not known
  bool up = false;
  std::string state;                     ///< in words: how it is reached, or why it is down
  double since_s = 0;                    ///< up, or down, for so long
  std::string last_error;                ///< why it was down last; empty if it never was
  uint64_t failed_attempts = 0;          ///< to come up, since it was up; 0 while it is
  std::optional<double> next_attempt_s;  ///< until it tries again, while it is down
  std::optional<double> silent_s;        ///< since the last byte came in; nothing: none did yet
  bool silent = false;                   ///< up, but not heard for longer than is expected of it
  std::optional<double> byte_rate;  ///< bytes a second that the line can carry, if it has a limit
  double bytes_per_s = 0;           ///< both ways, over about the last ten seconds
  std::vector<NamedCount> counters;
};

enum class PoseSource { kNone, kRobot, kTracker };

struct ClientView {
  std::string link;
  uint8_t id = 0;
  bool known = false;  ///< it has said HELLO in this epoch; else `robot` is empty, or of before
  RobotState robot;
  RobotTraffic traffic;
  std::optional<uint64_t> silent_ms;  ///< since its last message; nothing: not heard since a start
  PoseSource pose_source = PoseSource::kNone;
  field::PoseUm pose;  ///< on the map, unless the source is kNone
};

/// What is needed to look at the field.
struct FieldView {
  const field::Field* field = nullptr;  ///< lives as long as the server; for a FieldReader only
  field::FieldConfig config;            ///< at the moment, without its paths and prints
  uint64_t now_ms = 0;
};

/// What an edit did.
struct EditOutcome {
  uint64_t nodes = 0;  ///< of the map, in the edit's shape; those in obstacles are left as they are
};

class Control {
 public:
  using Done = std::function<void(const Status&)>;
  template <typename T>
  using DoneWith = std::function<void(const Result<T>&)>;

  Control() = default;
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;
  virtual ~Control() = default;

  virtual StatusView GetStatus(bool with_hash) const = 0;
  virtual std::vector<LinkView> GetLinks() const = 0;
  /// All robots that have said HELLO or were heard, by link and ID.
  virtual std::vector<ClientView> GetClients() const = 0;
  virtual FieldView GetField() const = 0;
  virtual CaptureView GetCapture() const = 0;
  /// The configuration that is in effect, in words, a line each.
  virtual std::vector<std::string> GetConfig() const = 0;
  /// Whether changes are taken at the moment and become durable; if not, why. Waits for no lock
  /// that anything else holds for long.
  virtual Status CheckHealth() const = 0;

  /// Changes the map. Errors: the shape touches no node of the map; what the engine refuses.
  virtual void Edit(const field::FieldEdit& edit, DoneWith<EditOutcome> done) = 0;
  /// Gives a command to a robot; what became of it is in its ClientView. Errors: no such link or
  /// robot.
  virtual void Issue(std::string_view link, uint8_t id, protocol::CommandCode code,
                     std::span<const uint8_t> arguments, Done done) = 0;
  /// Halts all robots of all links, also while the log takes no changes or the disk takes nothing:
  /// nothing that others ask for delays it. `done` gets the names of the links once they have the
  /// halt.
  virtual void HaltAll(DoneWith<std::vector<std::string>> done) = 0;
  /// Reads the configuration again. `done` gets what waits for a restart, or an error if nothing
  /// changed.
  virtual void Reload(DoneWith<std::vector<std::string>> done) = 0;
  /// Makes a durable snapshot. `done` gets its name, nothing if the server keeps no journal.
  virtual void Snapshot(DoneWith<std::optional<std::string>> done) = 0;
  /// Begins a recording; `done` when its first file is there. Errors: there is one already; the
  /// folder or the disk takes no file.
  virtual void StartCapture(Done done) = 0;
  /// Ends it; `done` when its last file is whole. Errors: there is none; the disk did not take all
  /// of it.
  virtual void StopCapture(Done done) = 0;
};

}  // namespace pheromone::engine
