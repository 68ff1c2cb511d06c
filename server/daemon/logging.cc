#include "server/daemon/logging.h"

#include <pthread.h>
#include <spdlog/async.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/ansicolor_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <future>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "server/base/escape.h"
#include "server/base/standard_output.h"

namespace pheromone::daemon {
namespace {

// In place of %v: the message with control characters escaped. Lines after its first are indented,
// so that what begins like a line of the log is one.
class EscapedMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/,
              spdlog::memory_buf_t& to) override {
    for (const char byte : EscapeControls({message.payload.data(), message.payload.size()})) {
      to.push_back(byte);
      if (byte == '\n') {
        to.append(kIndent.data(), kIndent.data() + kIndent.size());
      }
    }
  }

  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<EscapedMessage>();
  }

 private:
  static constexpr std::string_view kIndent = "  ";
};

using Terminal = spdlog::sinks::ansicolor_sink<spdlog::details::console_mutex>;

// Tells of lines that were dropped before the next one that is written. Called by the pool's
// thread, which ends before the pool.
class LossReporter : public Terminal {
 public:
  explicit LossReporter(spdlog::details::thread_pool* pool)
      : Terminal(Unescaped(stderr), spdlog::color_mode::automatic), pool_(pool) {}

  void log(const spdlog::details::log_msg& message) override {
    const size_t lost = pool_->overrun_counter();
    if (lost != lost_) {
      const std::string text = std::to_string(lost - lost_) +
                               " lines of the log are missing here: they came while it could not "
                               "be written";
      lost_ = lost;
      Terminal::log({message.time, {}, message.logger_name, spdlog::level::warn, text});
    }
    Terminal::log(message);
  }

 private:
  spdlog::details::thread_pool* const pool_;
  size_t lost_ = 0;
};

constexpr size_t kKeptLines = 1'024;
constexpr std::chrono::seconds kPatience{2};

// Signals are for others.
void BlockSignals() {
  sigset_t all;
  sigfillset(&all);
  (void)pthread_sigmask(SIG_BLOCK, &all, nullptr);
}

}  // namespace

void SetUpLogging(const std::string& level) {
  spdlog::init_thread_pool(kKeptLines, 1, BlockSignals);
  const auto pool = spdlog::thread_pool();
  auto logger = std::make_shared<spdlog::async_logger>(
      "pheromoned", std::make_shared<LossReporter>(pool.get()), pool,
      spdlog::async_overflow_policy::overrun_oldest);
  const bool journal =
      std::getenv("JOURNAL_STREAM") != nullptr || std::getenv("INVOCATION_ID") != nullptr;
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<EscapedMessage>('v').set_pattern(journal ? "%l: %v"
                                                               : "%Y-%m-%d %H:%M:%S.%e %^%l%$: %v");
  logger->set_formatter(std::move(formatter));
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
}

int EndLogging(int status) {
  std::promise<void> written;
  std::thread writer([&written] {
    BlockSignals();
    spdlog::shutdown();
    written.set_value();
  });
  if (written.get_future().wait_for(kPatience) != std::future_status::ready) {
    _exit(status);
  }
  writer.join();
  return status;
}

}  // namespace pheromone::daemon
