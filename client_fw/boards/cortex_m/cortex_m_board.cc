#include "client_fw/boards/cortex_m/cortex_m_board.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint32_t kRobotBaud = 9600;
/// This UART does not tell when its shift register is empty, only when its buffer is: the last byte
/// takes so long from then on. The first millisecond may be a short one.
constexpr uint16_t kLastByteMs = BytesMs(1, CortexMBoard::radio_baud()) + 1;

constexpr uint32_t kStraps = 0xFF;
constexpr uint32_t kCarrier = 1u << 8;
constexpr uint32_t kPtt = 1u << 9;
constexpr uint32_t kLoad = 1u << 10;
constexpr uint32_t kLed = 1u << 11;

// The first time it expires it only interrupts (without a handler), the second time it resets.
constexpr uint32_t kWatchdogCycles = kClockHz / 8;

// QEMU and the chip do not report the cause of a reset, but if RAM contains these values, it was
// kept.
constexpr uint32_t kKept[2] = {0x50686572, 0x6F6D6F6E};
volatile uint32_t kept[2] __attribute__((section(".noinit")));

void SetPin(uint32_t pin, bool high) {
  Gpio().out = high ? Gpio().out | pin : Gpio().out & ~pin;
}

}  // namespace

#if !PHEROMONE_SIGNING
uint8_t ResetProofRam::bytes[256] __attribute__((section(".noinit")));
#endif

void CortexMBoard::Start() {
  ram_was_kept_ = kept[0] == kKept[0] && kept[1] == kKept[1];
  kept[0] = kKept[0];
  kept[1] = kKept[1];
  CortexMStorage::Begin();
  Gpio().output_enable_set = kPtt | kLoad | kLed;
  Watchdog().load = kWatchdogCycles;
  Watchdog().control = 3;
  radio_.Start(radio_baud());
  robot_.Start(kRobotBaud);
  EnableUartInterrupts();
  SysTick().reload = kClockHz / 1000 - 1;
  SysTick().value = 0;
  SysTick().control = 7;
}

bool CortexMBoard::radio_put(uint8_t byte) {
  if (!transmitting_ && lead_ms_ != 0) {
    radio_.Hold();
    lead_left_ms_ = static_cast<uint16_t>(lead_ms_ + 1u);
  }
  SetPin(kPtt, true);
  line_busy_ms_ = static_cast<uint16_t>(kLastByteMs + tail_ms_);
  transmitting_ = true;
  return radio_.Put(byte);
}

bool CortexMBoard::channel_busy() {
  return (Gpio().data & kCarrier) != 0 || !radio_tx_idle();
}

void CortexMBoard::set_load(bool hold) {
  DisableInterrupts();
  SetPin(kLoad, hold);
  EnableInterrupts();
}

void CortexMBoard::set_led(bool on) {
  DisableInterrupts();
  SetPin(kLed, on);
  EnableInterrupts();
}

uint8_t CortexMBoard::id() const {
  const uint8_t id = static_cast<uint8_t>(Gpio().data & kStraps);
  return id == 0 || id == 0xFF ? uint8_t{1} : id;
}

void CortexMBoard::EndTurn() {
  Watchdog().interrupt_clear = 1;
  nonvolatile_.Step();
  DisableInterrupts();
  if (!happened_) {
    WaitForInterrupt();  // ends with the interrupt pending, although they are disabled
  }
  happened_ = false;  // interrupts from now on are handled in the next turn, and wake it
  EnableInterrupts();
}

void CortexMBoard::OnReceived(InterruptUart* uart) {
  happened_ = true;
  uart->OnReceived();
}

void CortexMBoard::OnSent(InterruptUart* uart) {
  happened_ = true;
  uart->OnSent();
}

void CortexMBoard::OnMillisecond() {
  happened_ = true;
  now_ms_ = now_ms_ + 1;
  if (lead_left_ms_ != 0) {
    lead_left_ms_ = static_cast<uint16_t>(lead_left_ms_ - 1u);
    if (lead_left_ms_ == 0) {
      radio_.Release();
    }
  }
  if (!radio_.sending() && line_busy_ms_ != 0) {
    line_busy_ms_ = static_cast<uint16_t>(line_busy_ms_ - 1u);
    if (line_busy_ms_ == 0) {
      SetPin(kPtt, false);
    }
  }
}

}  // namespace client
}  // namespace pheromone
