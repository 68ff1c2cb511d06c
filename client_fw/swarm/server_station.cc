#include "client_fw/swarm/server_station.h"

#include <algorithm>
#include <optional>
#include <random>
#include <span>

namespace pheromone::swarm {
namespace {

using radio::Time;

constexpr int64_t kBetweenLooksNs = 1'000'000;
constexpr uint16_t kGapTimeoutMs = 20;
constexpr size_t kAdapterBytes = 62;  // it does not hold back more

radio::ChannelOptions OptionsOf(const engine::LinkSettings& announced,
                                const sim::RadioMedium& medium, int64_t turnaround_ns,
                                const ServerTiming& timing, signing::Signing* signing) {
  radio::ChannelOptions options;
  options.signing = signing;
  options.gap_timeout_ms = kGapTimeoutMs;
  options.half_duplex = true;
  options.timing.byte = Time(medium.byte_ns());
  options.timing.turnaround = Time(turnaround_ns);
  options.timing.adapter = Time(timing.adapter_ns);
  options.timing.processing = Time(timing.delay_ns);
  options.timing.keyed = timing.keyed;
  options.timing.lead = Time(timing.lead_ns);
  options.timing.tail = Time(timing.tail_ns);
  options.response_window = std::chrono::milliseconds(announced.response_window_ms);
  options.slot = std::chrono::milliseconds(announced.slot_ms);
  return options;
}

}  // namespace

signing::Signing::Random SeededRandom(uint64_t seed) {
  return [random = std::mt19937_64(seed)](std::span<uint8_t> bytes) mutable {
    std::generate(bytes.begin(), bytes.end(), [&] { return static_cast<uint8_t>(random()); });
  };
}

ServerStation::ServerStation(engine::Service* service, engine::LinkIndex link,
                             const engine::LinkSettings& announced, sim::RadioMedium* medium,
                             const ServerTiming& timing, signing::Signing* signing)
    : service_(service),
      medium_(medium),
      timing_(timing),
      channel_(OptionsOf(announced, *medium, medium->default_turnaround_ns(), timing, signing),
               [](const protocol::Message&) {}),
      number_(medium->AddStation(this, timing.keyed ? std::optional<int64_t>(0) : std::nullopt)),
      link_(link) {}

void ServerStation::OnByte(uint8_t byte, int64_t time_ns) {
  held_.push_back(byte);
  read_at_ns_ = std::min(read_at_ns_, time_ns + timing_.adapter_ns);
  if (held_.size() >= kAdapterBytes) {
    read_at_ns_ = time_ns;
  }
  if (read_at_ns_ <= time_ns) {
    Read();
  }
}

void ServerStation::Read() {
  const Time now(medium_->now_ns());
  std::vector<protocol::Message> messages;
  std::vector<engine::Outgoing> out;
  channel_.Hear(held_, now, now, &messages);
  held_.clear();
  read_at_ns_ = sim::RadioMedium::kNever;
  service_->Handle(link_, messages, &out);
  NoteChanges(messages);
  for (const engine::Outgoing& outgoing : out) {
    if (outgoing.message.opcode == protocol::kCommand) {
      channel_.Send(outgoing.message);
    } else {
      const int64_t at_ns = AnswerAt(outgoing.message);
      const auto later = std::find_if(pending_.begin(), pending_.end(),
                                      [at_ns](const Pending& it) { return it.at_ns > at_ns; });
      pending_.insert(later, {at_ns, now, outgoing.message});
    }
  }
}

// A repetition is on disk when the first was.
void ServerStation::NoteChanges(const std::vector<protocol::Message>& messages) {
  if (!timing_.durable_at) {
    return;
  }
  for (const protocol::Message& message : messages) {
    if (protocol::IsMutating(message.opcode)) {
      const uint16_t crc = protocol::MessageCrc(message);
      Change& last = changes_[message.id];
      if (last.opcode != message.opcode || last.crc != crc) {
        last = {message.opcode, crc, timing_.durable_at(medium_->now_ns())};
      }
    }
  }
}

int64_t ServerStation::AnswerAt(const protocol::Message& answer) const {
  const int64_t at_ns = medium_->now_ns() + timing_.delay_ns;
  const auto change = changes_.find(answer.id);
  const bool waits =
      change != changes_.end() && answer.opcode == (change->second.opcode | protocol::kFromServer);
  return waits ? std::max(at_ns, change->second.durable_ns) : at_ns;
}

void ServerStation::Queue(const engine::Outgoing& outgoing) {
  channel_.Send(outgoing.message);
}

void ServerStation::AdvanceTo(int64_t time_ns) {
  for (;;) {
    const int64_t now_ns = medium_->now_ns();
    const int64_t next_ns = std::min(medium_->NextEventTime(), NextStep());
    medium_->AdvanceTo(std::clamp(next_ns, now_ns, time_ns));
    Act();
    if (next_ns >= time_ns) {
      return;
    }
  }
}

// When there is something to do without any event of the medium.
int64_t ServerStation::NextStep() {
  const int64_t answered_ns = pending_.empty() ? sim::RadioMedium::kNever : pending_.front().at_ns;
  const int64_t start_ns =
      keyed_ ? keyed_->count() + timing_.lead_ns
             : std::max(channel_.NextStart(Time(medium_->now_ns())).count(), look_at_ns_);
  return std::min({read_at_ns_, answered_ns, start_ns, unkey_at_ns_});
}

void ServerStation::Act() {
  const int64_t now_ns = medium_->now_ns();
  const Time now(now_ns);
  if (read_at_ns_ <= now_ns) {
    Read();
  }
  while (!pending_.empty() && pending_.front().at_ns <= now_ns) {
    channel_.Answer(pending_.front().message, pending_.front().asked_at, now);
    pending_.pop_front();
  }
  if (unkey_at_ns_ <= now_ns) {
    unkey_at_ns_ = sim::RadioMedium::kNever;
    medium_->Key(number_, false);
  }
  if (keyed_) {
    if (keyed_->count() + timing_.lead_ns <= now_ns) {
      Transmit(*keyed_);
    }
    return;
  }
  if (channel_.NextStart(now) > now || now_ns < look_at_ns_) {
    return;
  }
  const bool carrier = medium_->Busy(number_) && !medium_->Sending(number_);
  if (!channel_.IsClear(carrier, now)) {
    look_at_ns_ = now_ns + kBetweenLooksNs;
  } else if (timing_.keyed && timing_.lead_ns != 0) {
    keyed_ = now;
    medium_->Key(number_, true);
  } else {
    Transmit(now);
  }
}

// `begin`: when the transmitter was keyed, if it is.
void ServerStation::Transmit(Time begin) {
  keyed_.reset();
  const radio::Transmission out = channel_.Begin(begin);
  medium_->Transmit(number_, out.bytes);
  if (timing_.keyed) {
    const int64_t sent_ns = out.bytes.empty() ? medium_->now_ns() : channel_.sent_at().count();
    unkey_at_ns_ = sent_ns + timing_.tail_ns;
    look_at_ns_ = unkey_at_ns_;
    medium_->Key(number_, true);
  }
}

}  // namespace pheromone::swarm
