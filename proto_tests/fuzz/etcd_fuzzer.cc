// Any bytes as answers of etcd: a reader that is sent them, one after the other, has news or an
// error with words, and returns groups in order, without a gap.
//
// The first byte is where the reader begins; then answers, each with a byte before that says to
// what request, and a byte 0 behind.

#include <cstdint>
#include <string>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/cluster/etcd_messages.h"
#include "server/cluster/etcd_reader.h"

namespace {

using pheromone::Result;
using pheromone::cluster::EtcdKeys;
using pheromone::cluster::EtcdReader;
using pheromone::cluster::Sequence;
using pheromone::fuzz::Require;

void Send(EtcdReader* reader, char request, std::string_view text) {
  const Sequence before = reader->next();
  const bool was_found = reader->found();
  const Result<EtcdReader::News> news =
      request == 'w' ? reader->OnWatch(text) : reader->OnRead(text);
  if (!news.ok()) {
    Require(!news.error().empty());
    Require(!reader->found() || reader->next() == before);
    return;
  }
  Sequence next = before;
  for (const auto& stored : news.value().groups) {
    Require(was_found || request == 'w');
    Require(stored.group.first == next && stored.group.count > 0);
    next = stored.end();
    Require(next > stored.group.first);
  }
  Require(news.value().groups.empty() || reader->next() == next);
  Require(news.value().log_end >= news.value().floor);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  if (rest.empty()) {
    return 0;
  }
  std::string id;
  EtcdReader reader(EtcdKeys("lab"), static_cast<unsigned char>(rest.front()), &id);
  rest.remove_prefix(1);
  while (!rest.empty()) {
    const char request = rest.front();
    rest.remove_prefix(1);
    const std::string_view text = rest.substr(0, rest.find('\0'));
    rest.remove_prefix(text.size() < rest.size() ? text.size() + 1 : text.size());
    if (request == 's') {
      const auto status = pheromone::cluster::ParseStatus(text);
      Require(status.ok() || !status.error().empty());
      Require(!pheromone::cluster::ErrorOf(text).empty());
    } else {
      Send(&reader, request, text);
    }
  }
  return 0;
}
