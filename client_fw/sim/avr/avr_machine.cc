#include "client_fw/sim/avr/avr_machine.h"

#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <simavr/sim_elf.h>

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <random>
#include <stdexcept>

#include "client_fw/sim/avr/avr_eeprom.h"

namespace pheromone::sim {
namespace {

constexpr uint64_t kSecond = 1'000'000'000;
constexpr uint64_t kInterruptEntryCycles = 4;
// A stretch of instructions without a check of timers and interrupts ends early whenever necessary.
constexpr uint64_t kLongestStretch = 1'000'000;

// MCUSR and WDTCSR.
constexpr uint8_t kPowerOnFlag = 0x01;
constexpr uint8_t kExternalFlag = 0x02;
constexpr uint8_t kBrownOutFlag = 0x04;
constexpr uint8_t kWatchdogFlag = 0x08;
constexpr uint8_t kWatchdogChange = 0x18;  // WDCE and WDE
constexpr uint8_t kWatchdogEnable = 0x08;  // at the shortest time
constexpr uint16_t kWatchdogControl = 0x60;

// Only errors; the rest ("Loaded 12896 bytes") would be in every test's output.
void LogErrors(avr_t* /*avr*/, const int level, const char* format, va_list arguments) {
  if (level == LOG_ERROR) {
    std::vfprintf(stderr, format, arguments);
  }
}

struct Destroy {
  void operator()(avr_t* avr) const {
    avr_terminate(avr);
    std::free(avr);
  }
};

std::unique_ptr<avr_t, Destroy> Load(const AvrMachineConfig& config) {
  avr_global_logger_set(&LogErrors);
  elf_firmware_t firmware;
  std::memset(&firmware, 0, sizeof(firmware));
  if (elf_read_firmware(config.image.c_str(), &firmware) != 0) {
    throw std::runtime_error("cannot read the image " + config.image);
  }
  std::snprintf(firmware.mmcu, sizeof(firmware.mmcu), "%s", config.mcu.c_str());
  firmware.frequency = config.frequency_hz;
  avr_t* made = avr_make_mcu_by_name(config.mcu.c_str());
  if (made == nullptr) {
    throw std::runtime_error("this libsimavr does not know the " + config.mcu);
  }
  avr_init(made);
  std::unique_ptr<avr_t, Destroy> avr(made);
  avr_load_firmware(made, &firmware);
  std::free(firmware.flash);  // both have been copied
  std::free(firmware.eeprom);
  return avr;
}

}  // namespace

struct AvrMachine::Impl {
  explicit Impl(const AvrMachineConfig& config)
      : size(ReadAvrImageSize(config.image)),
        avr(Load(config)),
        run(avr->run),
        eeprom(avr.get()),
        pins(avr.get()),
        noise(config.seed) {
    uarts.emplace_back(avr.get(), '0', config.radio_baud);
    if (config.mcu != "atmega328p") {
      uarts.emplace_back(avr.get(), '1', config.robot_baud, true);
    }
    eeprom.Load(config.eeprom);
    for (const AvrPin pin : config.grounded) {
      pins.Drive(pin, false);
    }
  }

  int64_t ToNs(uint64_t cycle) const {
    const uint64_t hz = avr->frequency;
    return static_cast<int64_t>(cycle / hz * kSecond + cycle % hz * kSecond / hz);
  }
  // The first cycle that does not begin before `time_ns`.
  uint64_t ToCycle(int64_t time_ns) const {
    const auto ns = static_cast<uint64_t>(time_ns);
    const uint64_t hz = avr->frequency;
    return ns / kSecond * hz + (ns % kSecond * hz + kSecond - 1) / kSecond;
  }

  void RunTo(uint64_t target);
  void Step();
  void ServiceInterrupts();
  void Check() const;
  void Reset(Cause cause);
  void OnWatchdog();
  void AfterReset();
  void ScrambleRam(uint8_t changes);

  AvrImageSize size;
  std::unique_ptr<avr_t, Destroy> avr;
  const avr_run_t run;  // as the simulator came; its watchdog puts another here to reset
  std::deque<AvrUart> uarts;
  AvrEeprom eeprom;
  AvrPins pins;
  std::mt19937_64 noise;
  std::vector<uint8_t> painted;  // RAM as it was at power-up
  uint64_t asleep = 0;
  uint64_t watchdog_resets = 0;
  std::string crash;
};

// --- Running.

void AvrMachine::Impl::RunTo(uint64_t target) {
  if (avr->cycle >= target) {
    return;
  }
  // Ends the stretch in which the target lies; nothing happens then.
  avr_cycle_timer_register(
      avr.get(), target - avr->cycle,
      [](avr_t*, avr_cycle_count_t, void*) -> avr_cycle_count_t { return 0; }, this);
  // Every instruction is followed by timers and then by interrupts, also across calls: inputs given
  // since the last call may be due before the next instruction.
  avr_cycle_timer_process(avr.get());
  for (;;) {
    ServiceInterrupts();
    Step();
    Check();
    if (avr->cycle >= target) {
      return;
    }
  }
}

void AvrMachine::Impl::Step() {
  if (avr->run != run) {
    OnWatchdog();
  } else if (avr->state == cpu_Running) {
    avr->pc = avr_run_one(avr.get());
  } else if (avr->state == cpu_Sleeping) {
    if (avr->sreg[S_I] == 0) {
      crash = "sleeps with interrupts off";
    }
    const avr_cycle_count_t cycles = avr_cycle_timer_process(avr.get());
    if (avr->state == cpu_Sleeping) {
      avr->cycle += cycles;
      asleep += cycles;
    }
  }
  avr_cycle_timer_process(avr.get());
}

void AvrMachine::Impl::ServiceInterrupts() {
  if (avr->state != cpu_Running && avr->state != cpu_Sleeping) {
    return;
  }
  const auto running = avr->interrupts.running_ptr;
  avr_service_interrupts(avr.get());
  if (avr->interrupts.running_ptr > running) {
    avr->cycle += kInterruptEntryCycles;
    const bool more = avr->run_cycle_count > kInterruptEntryCycles;
    avr->run_cycle_count = more ? avr->run_cycle_count - kInterruptEntryCycles : 1;
  }
}

void AvrMachine::Impl::Check() const {
  if (avr->state == cpu_Crashed || avr->state == cpu_Done) {
    throw std::runtime_error("the firmware crashed");
  }
  if (!crash.empty()) {
    throw std::runtime_error("the firmware " + crash);
  }
  for (const AvrUart& uart : uarts) {
    if (!uart.error().empty()) {
      throw std::runtime_error(uart.error());
    }
  }
}

// --- Resets.

void AvrMachine::Impl::Reset(Cause cause) {
  const uint16_t status = avr->reset_flags.porf.reg;
  const uint8_t earlier = avr->data[status];
  if (cause == Cause::kPowerOn || cause == Cause::kBrownOut) {
    eeprom.OnPowerLoss(static_cast<uint8_t>(noise()));
  }
  avr_reset(avr.get());
  AfterReset();
  switch (cause) {
    case Cause::kPowerOn:
      ScrambleRam(0xFF);
      painted.assign(avr->data, avr->data + avr->ramend + 1);
      avr->data[status] = kPowerOnFlag;
      break;
    case Cause::kBrownOut:
      ScrambleRam(0x01);
      avr->data[status] = static_cast<uint8_t>(earlier | kBrownOutFlag);
      break;
    case Cause::kExternal:
      avr->data[status] = static_cast<uint8_t>(earlier | kExternalFlag);
      break;
    case Cause::kWatchdog: {
      avr->data[status] = static_cast<uint8_t>(earlier | kWatchdogFlag);
      const auto& control = avr->io[AVR_DATA_TO_IO(kWatchdogControl)].w;
      control.c(avr.get(), kWatchdogControl, kWatchdogChange, control.param);
      control.c(avr.get(), kWatchdogControl, kWatchdogEnable, control.param);
      break;
    }
  }
}

void AvrMachine::Impl::OnWatchdog() {
  const uint16_t status = avr->reset_flags.porf.reg;
  const uint8_t earlier = avr->data[status];
  ++watchdog_resets;
  avr->run(avr.get());  // resets, and puts `run` back
  AfterReset();
  avr->data[status] = static_cast<uint8_t>(earlier | kWatchdogFlag);
}

// The simulator has lost all timers and registers, and its run limit.
void AvrMachine::Impl::AfterReset() {
  avr->run_cycle_limit = kLongestStretch;
  for (AvrUart& uart : uarts) {
    uart.OnReset();
  }
  eeprom.OnReset(static_cast<uint32_t>(noise()));
  pins.OnReset();
}

// A bit of RAM changes if its bit of `changes` is set and a random bit is set: all, or some.
void AvrMachine::Impl::ScrambleRam(uint8_t changes) {
  for (uint32_t address = avr->ioend + 1u; address <= avr->ramend; ++address) {
    const auto bits = static_cast<uint8_t>(noise());
    avr->data[address] ^= static_cast<uint8_t>(bits & changes);
  }
}

// --- The public interface.

AvrMachine::AvrMachine(const AvrMachineConfig& config) : impl_(std::make_unique<Impl>(config)) {
  impl_->Reset(Cause::kPowerOn);
}

AvrMachine::~AvrMachine() = default;

void AvrMachine::RunTo(int64_t time_ns) {
  impl_->RunTo(impl_->ToCycle(time_ns));
}

int64_t AvrMachine::now_ns() const {
  return impl_->ToNs(impl_->avr->cycle);
}

void AvrMachine::Send(Port port, uint8_t byte, int64_t time_ns, AvrByteFault fault) {
  impl_->uarts.at(port).Deliver(byte, impl_->ToCycle(time_ns), fault);
}

void AvrMachine::OnSent(Port port, std::function<void(uint8_t byte, int64_t time_ns)> callback) {
  impl_->uarts.at(port).set_on_sent(
      [impl = impl_.get(), callback = std::move(callback)](uint8_t byte, uint64_t cycle) {
        callback(byte, impl->ToNs(cycle));
      });
}

void AvrMachine::set_robot_baud(int64_t baud) {
  impl_->uarts.at(kRobot).set_nominal_baud(baud);
}

void AvrMachine::SetPin(AvrPin pin, bool high) {
  impl_->pins.Drive(pin, high);
}

void AvrMachine::OnPin(AvrPin pin, std::function<void(bool high, int64_t time_ns)> callback) {
  impl_->pins.Watch(pin, [impl = impl_.get(), callback = std::move(callback)](bool high) {
    callback(high, impl->ToNs(impl->avr->cycle));
  });
}

void AvrMachine::Reset(Cause cause) {
  impl_->Reset(cause);
}

uint64_t AvrMachine::watchdog_resets() const {
  return impl_->watchdog_resets;
}

std::vector<uint8_t> AvrMachine::eeprom() const {
  return impl_->eeprom.contents();
}

uint8_t AvrMachine::data(uint16_t address) const {
  return impl_->avr->data[address];
}

const AvrUartCounters& AvrMachine::uart(Port port) const {
  return impl_->uarts.at(port).counters();
}

size_t AvrMachine::underway(Port port) const {
  return impl_->uarts.at(port).underway();
}

uint64_t AvrMachine::cycles() const {
  return impl_->avr->cycle;
}

uint64_t AvrMachine::cycles_asleep() const {
  return impl_->asleep;
}

const AvrImageSize& AvrMachine::image_size() const {
  return impl_->size;
}

uint16_t AvrMachine::stack_bytes() const {
  const uint16_t end = impl_->avr->ramend;
  for (uint32_t address = impl_->size.static_ram_end; address <= end; ++address) {
    if (impl_->avr->data[address] != impl_->painted[address]) {
      return static_cast<uint16_t>(end + 1u - address);
    }
  }
  return 0;
}

}  // namespace pheromone::sim
