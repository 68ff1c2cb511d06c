// So many requests of one robot through the service, without links, threads and files: for counting
// instructions, which do not depend on what else the machine does.
//
//   valgrind --tool=callgrind build/release/bin/engine_steps trace 20000
//
// Prints the state hash: two builds that print the same did the same work.

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/bench.h"

namespace {

using namespace pheromone::engine;  // NOLINT(google-build-using-namespace)
using pheromone::protocol::Message;

// Takes everything, and has it on the disk at once.
class QuickLog final : public OrderedLog {
 public:
  pheromone::protocol::Reason Admit() override { return pheromone::protocol::Reason::kNone; }
  uint64_t Append(const Stamp& /*stamp*/, const Event& /*event*/) override { return ++sequence_; }
  bool IsRotationDue() const override { return false; }
  void Rotate(uint64_t /*state_hash*/) override {}
  uint64_t DurableSequence() const override { return sequence_; }
  bool WhenDurable(uint64_t /*sequence*/, std::function<void()> done) override {
    done();
    return true;
  }
  std::string Trouble() const override { return ""; }

 private:
  uint64_t sequence_ = 0;
};

Message Request(std::string_view kind, uint32_t step) {
  const auto x = static_cast<int16_t>(1'000 + step * 37 % 8'000);
  const auto y = static_cast<int16_t>(1'000 + step * 91 % 8'000);
  const auto heading = static_cast<uint16_t>(step * 777);
  const auto seq = static_cast<uint8_t>(step + 1);
  return kind == "sense"   ? testing::Sense(1, x, y, heading)
         : kind == "trace" ? testing::Trace(1, seq, x, y, heading)
                           : testing::Deposit(1, seq, x, y);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view kind = argc == 3 ? argv[1] : "";
  const std::string_view number = argc == 3 ? argv[2] : "";
  uint32_t steps = 0;
  const auto read = std::from_chars(number.data(), number.data() + number.size(), steps);
  if ((kind != "sense" && kind != "trace" && kind != "deposit") || steps == 0 ||
      read.ptr != number.data() + number.size()) {
    std::fputs("usage: engine_steps sense|trace|deposit STEPS\n", stderr);
    return 2;
  }
  QuickLog log;
  uint64_t now_ms = 1'000;
  Service service(&log, [&now_ms] { return ClockReading{now_ms, static_cast<int64_t>(now_ms)}; });
  if (!service.Configure(testing::SmallConfig(), 7).ok()) {
    return 1;
  }
  std::vector<Outgoing> out;
  std::vector<Message> batch = {testing::Hello(1, 1)};
  service.Handle(0, batch, &out);
  for (uint32_t step = 0; step < steps; ++step) {
    out.clear();
    ++now_ms;
    batch[0] = Request(kind, step);
    service.Handle(0, batch, &out);
  }
  std::printf("%016llx\n", static_cast<unsigned long long>(service.StateHash()));
  return 0;
}
