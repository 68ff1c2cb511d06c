#include "proto_tests/exchange_bench/udp_load.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "client_fw/core/signing/signing.h"
#include "proto_tests/exchange_bench/fail.h"
#include "proto_tests/exchange_bench/given_up.h"
#include "protocol/decoder.h"

namespace pheromone::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLostAfter{500};
constexpr int kPatienceMs = 10'000;  // for the answer to HELLO
constexpr int kClientsPerLink = 254;

class Clients {
 public:
  Clients(const Arena& arena, const LoadOptions& options)
      : arena_(arena), options_(options), poller_(epoll_create1(EPOLL_CLOEXEC)) {
    for (int i = 0; i < options.clients; ++i) {
      const auto link = static_cast<size_t>(i / kClientsPerLink);
      clients_.push_back(
          Connect(static_cast<uint8_t>(1 + i % kClientsPerLink), options.ports.at(link)));
      epoll_event event{};
      event.events = EPOLLIN;
      event.data.u32 = static_cast<uint32_t>(i);
      epoll_ctl(poller_, EPOLL_CTL_ADD, clients_.back().socket, &event);
    }
  }
  Clients(const Clients&) = delete;
  Clients& operator=(const Clients&) = delete;
  ~Clients() {
    for (const Client& client : clients_) {
      close(client.socket);
    }
    close(poller_);
  }

  LoadResult Run() {
    if (options_.is_signed) {
      Greet();
    }
    if (Changes()) {
      SayHello();
    }
    if (WritesTags()) {
      Register();
    }
    const auto begin = Clock::now();
    const auto length = std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(options_.seconds));
    for (Client& client : clients_) {
      Ask(&client);
    }
    auto next_search = begin + kLostAfter;
    auto now = begin;
    while (options_.load == Load::kTagWriteAll ? result_.right < places() : now - begin < length) {
      TakeWhatCame(50);
      now = Clock::now();
      if (now >= next_search) {
        next_search = now + kLostAfter / 10;
        GiveUpLost(now);
      }
    }
    result_.per_second =
        static_cast<double>(result_.right) / std::chrono::duration<double>(now - begin).count();
    LoadResult result = std::move(result_);
    AwaitTheLast();
    return result;
  }

 private:
  struct Client {
    int socket = -1;
    uint8_t id = 0;
    uint8_t seq = 0;
    size_t pose = 0;
    Clock::time_point asked_at;
    size_t request_size = 0;
    std::array<uint8_t, protocol::kMaxFrame> request{};
    GivenUp given_up;
    std::array<uint8_t, 16> key{};
    std::shared_ptr<client::Signing> signing;
  };

  bool WritesTags() const {
    return options_.load == Load::kTagWrite || options_.load == Load::kTagWriteAll;
  }
  bool Changes() const {
    return options_.load == Load::kTrace || options_.load == Load::kRoam || WritesTags();
  }
  size_t places() const {
    return options_.tags != nullptr ? options_.tags->size() : arena_.poses.size();
  }

  static Client Connect(uint8_t id, uint16_t port) {
    Client client;
    client.id = id;
    client.socket = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    if (connect(client.socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      Fail("cannot connect a UDP socket");
    }
    return client;
  }

  // What is still under way must not reach the clients of the next load, whose ports may be the
  // same.
  void AwaitTheLast() {
    is_over_ = true;
    waiting_ = clients_.size();
    const auto end = Clock::now() + 2 * kLostAfter;
    while (waiting_ > 0 && Clock::now() < end) {
      TakeWhatCame(50);
    }
  }

  // Leaves the answer in buffer_ and gives its size. Again while the log is busy, as it is at first
  // with a large configuration: a client that took this for the answer would be refused for ever.
  size_t AskUntilDone(Client* client, const protocol::Message& message) {
    const auto end = Clock::now() + std::chrono::milliseconds(kPatienceMs);
    size_t size = 0;
    do {
      Send(client, message);
      pollfd answer{client->socket, POLLIN, 0};
      poll(&answer, 1, kPatienceMs);
      const ssize_t received = recv(client->socket, buffer_.data(), buffer_.size(), 0);
      size = received > 0 ? static_cast<size_t>(received) : 0;
    } while (IsBusy(std::span(buffer_).first(size)) && Clock::now() < end);
    return size;
  }

  static bool IsBusy(std::span<const uint8_t> bytes) {
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    bool is_busy = false;
    decoder.PushBlock(bytes.data(), bytes.size(), 0, [&](const protocol::Message& answer) {
      protocol::ErrorAnswer error;
      is_busy = protocol::Decode(answer, &error) && error.reason == protocol::Reason::kBusy;
    });
    return is_busy;
  }

  // The daemon may know these robots.
  void SayHello() {
    std::random_device random;
    const auto go_on_from = [](Client* client, size_t size, const uint8_t* bytes) {
      protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
      decoder.PushBlock(bytes, size, 0, [client](const protocol::Message& message) {
        protocol::HelloAnswer answer;
        if (protocol::Decode(message, &answer)) {
          client->seq = answer.last_seq;
        }
      });
    };
    for (Client& client : clients_) {
      protocol::Message hello;
      protocol::Encode(protocol::HelloRequest{client.id, static_cast<uint16_t>(random()), 1, 0},
                       &hello);
      const size_t size = AskUntilDone(&client, hello);
      go_on_from(&client, size, buffer_.data());
    }
  }

  // The sessions of signed clients; SENSE needs no more.
  void Greet() {
    std::random_device random;
    for (Client& client : clients_) {
      client.key = BenchKey(client.id);
      client.signing = std::make_shared<client::Signing>(client.key.data());
      protocol::Message hello;
      protocol::Encode(protocol::HelloRequest{client.id, static_cast<uint16_t>(random()), 1, 0},
                       &hello);
      std::array<uint8_t, client::Signing::kLongest> signature{};
      Append(signature, client.signing->SignHello(ViewOf(hello), 0, signature.data()), &hello);
      const size_t size = AskUntilDone(&client, hello);
      protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
      bool is_greeted = false;
      decoder.PushBlock(buffer_.data(), size, 0, [&](const protocol::Message& message) {
        is_greeted = client.signing->TakeAnswer(ViewOf(message));
      });
      if (!is_greeted) {
        Fail(fmt::format("client {} has no session", client.id));
      }
    }
  }

  static client::FrameView ViewOf(const protocol::Message& message) {
    return {message.id, message.opcode, message.data, message.length};
  }

  static void Append(std::span<const uint8_t> signature, uint8_t size, protocol::Message* message) {
    std::copy_n(signature.begin(), size, message->data + message->length);
    message->length = static_cast<uint8_t>(message->length + size);
  }

  // Who writes on tags has a unique ID.
  void Register() {
    for (size_t i = 0; i < clients_.size(); ++i) {
      Client& client = clients_[i];
      const std::string unique_id = fmt::format("bench-{}", i);
      protocol::SymbolRequest request;
      request.id = client.id;
      request.seq = ++client.seq;
      request.length = static_cast<uint8_t>(unique_id.size());
      std::copy(unique_id.begin(), unique_id.end(), request.text);
      protocol::Message message;
      protocol::Encode(request, &message);
      static_cast<void>(AskUntilDone(&client, message));
    }
  }

  void Ask(Client* client) {
    if (is_over_) {
      --waiting_;
      return;
    }
    client->pose =
        options_.load == Load::kTagWriteAll ? next_place_++ % places() : random_() % places();
    ++client->seq;
    switch (options_.load) {
      case Load::kEcho:
      case Load::kSense: {
        protocol::Message message = arena_.Sense(client->id, client->pose);
        if (client->signing != nullptr) {
          std::array<uint8_t, client::Signing::kLongest> signature{};
          Append(signature, client->signing->Sign(ViewOf(message), signature.data()), &message);
        }
        return Send(client, message);
      }
      case Load::kTrace:
        return Send(client, arena_.Trace(client->id, client->pose, client->seq));
      case Load::kRoam:
        return Send(client, arena_.Roam(client->id, client->pose, client->seq));
      case Load::kScan:
        return Send(client, options_.tags->Scan(client->id, client->pose));
      case Load::kTagRead:
        return Send(client, options_.tags->Read(client->id, client->pose));
      case Load::kTagWrite:
      case Load::kTagWriteAll:
        return Send(client, options_.tags->Write(client->id, client->pose, client->seq));
    }
  }

  static void Send(Client* client, const protocol::Message& message) {
    client->request_size =
        protocol::EncodeFrame(message, client->request.data(), client->request.size());
    client->asked_at = Clock::now();
    static_cast<void>(!send(client->socket, client->request.data(), client->request_size, 0));
  }

  void TakeWhatCame(int patience_ms) {
    std::array<epoll_event, 256> events{};
    const int count =
        epoll_wait(poller_, events.data(), static_cast<int>(events.size()), patience_ms);
    for (int i = 0; i < count; ++i) {
      Client& client = clients_[events[static_cast<size_t>(i)].data.u32];
      const ssize_t size = recv(client.socket, buffer_.data(), buffer_.size(), 0);
      if (size <= 0) {
        continue;
      }
      const std::span<const uint8_t> bytes(buffer_.data(), static_cast<size_t>(size));
      if (IsAnswer(client, {client.pose, client.seq}, bytes)) {
        ++result_.right;
        result_.times.Add(Clock::now() - client.asked_at);
        Ask(&client);
      } else if (client.given_up.Take(
                     [&](const Asked& asked) { return IsAnswer(client, asked, bytes); })) {
        ++result_.late;
      } else {
        ++result_.wrong;
      }
    }
  }

  bool IsAnswer(const Client& client, const Asked& asked, std::span<const uint8_t> bytes) const {
    if (options_.load == Load::kEcho) {  // never late: there is no engine, and no disk
      return std::equal(bytes.begin(), bytes.end(), client.request.begin(),
                        client.request.begin() + static_cast<std::ptrdiff_t>(client.request_size));
    }
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    int frames = 0;
    bool right = false;
    decoder.PushBlock(bytes.data(), bytes.size(), 0, [&](protocol::Message answer) {
      ++frames;
      if (client.signing != nullptr) {
        const uint8_t size = client.signing->Verify(ViewOf(answer));
        if (size == client::Signing::kForged) {
          return;
        }
        answer.length = static_cast<uint8_t>(answer.length - size);
      }
      right = IsAnswer(client.id, asked, answer);
    });
    return right && frames == 1;
  }

  bool IsAnswer(uint8_t id, const Asked& asked, const protocol::Message& answer) const {
    switch (options_.load) {
      case Load::kEcho:
        return false;
      case Load::kSense:
        return arena_.IsSenseAnswer(answer, id, asked.pose);
      case Load::kTrace:
        return arena_.IsTraceAnswer(answer, id, asked.pose, asked.seq);
      case Load::kRoam:
        return Arena::IsRoamAnswer(answer, id, asked.seq);
      case Load::kScan:
        return options_.tags->IsScanAnswer(answer, id, asked.pose);
      case Load::kTagRead:
        return TagSites::IsReadAnswer(answer, id, asked.pose);
      case Load::kTagWrite:
      case Load::kTagWriteAll:
        return TagSites::IsWriteAnswer(answer, id, asked.pose, asked.seq);
    }
    return false;
  }

  void GiveUpLost(Clock::time_point now) {
    for (Client& client : clients_) {
      if (now - client.asked_at > kLostAfter) {
        ++result_.lost;
        client.given_up.Add({client.pose, client.seq});
        Ask(&client);
      }
    }
  }

  const Arena& arena_;
  const LoadOptions& options_;
  const int poller_;
  std::vector<Client> clients_;
  std::minstd_rand random_{1};
  size_t next_place_ = 0;
  bool is_over_ = false;
  size_t waiting_ = 0;
  std::array<uint8_t, 2048> buffer_{};
  LoadResult result_;
};

}  // namespace

std::array<uint8_t, 16> BenchKey(uint8_t id) {
  std::array<uint8_t, 16> key{};
  key.fill(id);
  return key;
}

LoadResult RunLoad(const Arena& arena, const LoadOptions& options) {
  return Clients(arena, options).Run();
}

}  // namespace pheromone::bench
