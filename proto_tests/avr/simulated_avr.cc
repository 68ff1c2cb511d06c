#include "proto_tests/avr/simulated_avr.h"

#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace pheromone::conformance {
namespace {

constexpr char kMcu[] = "atmega1284p";
constexpr uint32_t kFrequencyHz = 16'000'000;

// Only what is wrong; the rest ("Loaded 12896 bytes") would be in every test's output.
void LogErrors(avr_t* /*avr*/, const int level, const char* format, va_list arguments) {
  if (level == LOG_ERROR) {
    std::vfprintf(stderr, format, arguments);
  }
}

avr_t* Load(const std::string& image) {
  avr_global_logger_set(&LogErrors);
  elf_firmware_t firmware;
  std::memset(&firmware, 0, sizeof(firmware));
  if (elf_read_firmware(image.c_str(), &firmware) != 0) {
    throw std::runtime_error("cannot read the image " + image);
  }
  std::snprintf(firmware.mmcu, sizeof(firmware.mmcu), "%s", kMcu);
  firmware.frequency = kFrequencyHz;
  avr_t* avr = avr_make_mcu_by_name(kMcu);
  if (avr == nullptr) {
    throw std::runtime_error(std::string("this libsimavr does not know the ") + kMcu);
  }
  avr_init(avr);
  avr_load_firmware(avr, &firmware);
  std::free(firmware.flash);  // both have been copied
  std::free(firmware.eeprom);
  avr->sleep = [](avr_t*, avr_cycle_count_t) {};  // the original sleeps in real time
  avr->run_cycle_limit = 200;                     // longer stretches make it faster; 1 unless told
  return avr;
}

}  // namespace

SimulatedAvr::SimulatedAvr(const std::string& image) : avr_(Load(image)) {
  // By itself the simulator prints what the UART sends and sleeps when its status is polled.
  uint32_t flags = 0;
  avr_ioctl(avr_, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
  flags &= ~static_cast<uint32_t>(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
  avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);

  const auto uart = [this](int index) {
    return avr_io_getirq(avr_, AVR_IOCTL_UART_GETIRQ('0'), index);
  };
  input_ = uart(UART_IRQ_INPUT);
  avr_irq_register_notify(
      uart(UART_IRQ_OUTPUT),
      [](avr_irq_t*, uint32_t value, void* self) {
        static_cast<SimulatedAvr*>(self)->from_avr_.push_back(static_cast<uint8_t>(value));
      },
      this);
  avr_irq_register_notify(
      uart(UART_IRQ_OUT_XON),
      [](avr_irq_t*, uint32_t, void* self) { static_cast<SimulatedAvr*>(self)->may_send_ = true; },
      this);
  avr_irq_register_notify(
      uart(UART_IRQ_OUT_XOFF),
      [](avr_irq_t*, uint32_t, void* self) { static_cast<SimulatedAvr*>(self)->may_send_ = false; },
      this);
}

SimulatedAvr::~SimulatedAvr() {
  avr_terminate(avr_);
  std::free(avr_);
}

void SimulatedAvr::Send(const std::vector<uint8_t>& bytes) {
  to_avr_.insert(to_avr_.end(), bytes.begin(), bytes.end());
}

uint8_t SimulatedAvr::Receive() {
  const uint64_t until = avr_->cycle + kPatienceCycles;
  while (from_avr_.empty()) {
    Feed();
    const int state = avr_run(avr_);
    if (state == cpu_Done || state == cpu_Crashed) {
      throw std::runtime_error(state == cpu_Crashed ? "the AVR crashed" : "the AVR stopped");
    }
    if (avr_->cycle > until) {
      throw std::runtime_error("the AVR does not answer");
    }
  }
  const uint8_t byte = from_avr_.front();
  from_avr_.pop_front();
  return byte;
}

uint64_t SimulatedAvr::cycles() const {
  return avr_->cycle;
}

void SimulatedAvr::Feed() {
  while (may_send_ && !to_avr_.empty()) {
    const uint8_t byte = to_avr_.front();
    to_avr_.pop_front();
    avr_raise_irq(input_, byte);  // may say XOFF
  }
}

}  // namespace pheromone::conformance
