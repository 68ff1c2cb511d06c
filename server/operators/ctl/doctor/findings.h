// What `pheromonectl doctor` found: for each thing that was looked at, whether it is well, and if
// it is not, what mends it.
//
//   Findings findings;
//   findings.Ok("journal", "/var/lib/pheromone/lab/journal", "writable, 12 GiB free");
//   findings.Fault("ports", "web, 127.0.0.1:8377", "in use by ...", "Stop that program, or ...");
//   return findings.Print(options.json);
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pheromone::ctl {

enum class Level : uint8_t {
  kOk,
  kWarning,  ///< it works, but probably not as intended
  kFault,    ///< it does not work
};

struct Finding {
  std::string subject;    ///< "journal", "ports": the same for all findings about such things
  std::string looked_at;  ///< which of them
  Level level = Level::kOk;
  std::string found;
  std::string mend;  ///< a sentence; empty if nothing is wrong
};

class Findings {
 public:
  void Ok(std::string subject, std::string looked_at, std::string found);
  void Warning(std::string subject, std::string looked_at, std::string found, std::string mend);
  void Fault(std::string subject, std::string looked_at, std::string found, std::string mend);

  /// Prints all of them, as text or as JSON; returns the exit status: kFailed if there is a fault.
  int Print(bool as_json) const;

 private:
  size_t Count(Level level) const;

  std::vector<Finding> all_;
};

}  // namespace pheromone::ctl
