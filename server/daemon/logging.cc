#include "server/daemon/logging.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/ansicolor_sink.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <ctime>
#include <memory>
#include <string_view>
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

}  // namespace

void SetUpLogging(const std::string& level) {
  // Colours are the log's own.
  auto sink = std::make_shared<spdlog::sinks::ansicolor_sink<spdlog::details::console_mutex>>(
      Unescaped(stderr), spdlog::color_mode::automatic);
  auto logger = std::make_shared<spdlog::logger>("pheromoned", std::move(sink));
  const bool journal =
      std::getenv("JOURNAL_STREAM") != nullptr || std::getenv("INVOCATION_ID") != nullptr;
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<EscapedMessage>('v').set_pattern(journal ? "%l: %v"
                                                               : "%Y-%m-%d %H:%M:%S.%e %^%l%$: %v");
  logger->set_formatter(std::move(formatter));
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::trace);
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace pheromone::daemon
