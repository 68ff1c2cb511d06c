// Another implementation of DDS, by which tests judge pheromone-ros2: Fast DDS, on the loopback
// interface alone. It carries messages as their bytes, and knows none of their types; Python packs
// and unpacks them (ros_types.py).
//
//   fast_dds_peer DOMAIN
//
// A line of its input:
//   read TOPIC TYPE reliable|best latched|volatile     then each message is told
//   make TOPIC TYPE reliable|best latched|volatile     a writer
//   write TOPIC HEX                                    with the bytes of encapsulation
// and of its output:
//   data TOPIC HEX
//   participant GUID USER_DATA                         of others, as they are found
//   writer|reader TOPIC TYPE GUID reliable|best latched|volatile USER_DATA
// It ends at the end of its input.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

namespace {

using namespace eprosima::fastdds::dds;  // NOLINT: a foreign library's names
namespace rtps = eprosima::fastrtps::rtps;
using Bytes = std::vector<uint8_t>;

constexpr uint32_t kMaxBytes = 1u << 24;
constexpr uint16_t kParticipants = 8;  // that may be on this machine in the domain

std::string ToHex(const Bytes& bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string hex;
  for (const uint8_t byte : bytes) {
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

Bytes FromHex(const std::string& hex) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

void Say(const std::string& line) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  std::cout << line << std::endl;
}

// Any type: its bytes.
class BytesType : public TopicDataType {
 public:
  explicit BytesType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = kMaxBytes;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<Bytes*>(data);
    payload->encapsulation = CDR_LE;
    payload->length = static_cast<uint32_t>(bytes.size());
    std::memcpy(payload->data, bytes.data(), bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

std::string TextOf(const rtps::GUID_t& guid) {
  Bytes bytes(guid.guidPrefix.value, guid.guidPrefix.value + 12);
  bytes.insert(bytes.end(), guid.entityId.value, guid.entityId.value + 4);
  return ToHex(bytes);
}

template <class UserData>
std::string TextOf(const UserData& data) {
  return {data.data_vec().begin(), data.data_vec().end()};
}

template <class Proxy>
void SayEndpoint(const char* kind, const Proxy& it) {
  const auto& qos = it.m_qos;
  Say(std::string(kind) + " " + it.topicName().to_string() + " " + it.typeName().to_string() + " " +
      TextOf(it.guid()) +
      (qos.m_reliability.kind == RELIABLE_RELIABILITY_QOS ? " reliable" : " best") +
      (qos.m_durability.kind == TRANSIENT_LOCAL_DURABILITY_QOS ? " latched " : " volatile ") +
      TextOf(qos.m_userData));
}

class Discoveries : public DomainParticipantListener {
 public:
  void on_participant_discovery(DomainParticipant*,
                                rtps::ParticipantDiscoveryInfo&& found) override {
    if (found.status == rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT) {
      Say("participant " + TextOf(found.info.m_guid) + " " + TextOf(found.info.m_userData));
    }
  }
  void on_publisher_discovery(DomainParticipant* self, rtps::WriterDiscoveryInfo&& found) override {
    if (found.status == rtps::WriterDiscoveryInfo::DISCOVERED_WRITER &&
        found.info.guid().guidPrefix != self->guid().guidPrefix) {
      SayEndpoint("writer", found.info);
    }
  }
  void on_subscriber_discovery(DomainParticipant* self,
                               rtps::ReaderDiscoveryInfo&& found) override {
    if (found.status == rtps::ReaderDiscoveryInfo::DISCOVERED_READER &&
        found.info.guid().guidPrefix != self->guid().guidPrefix) {
      SayEndpoint("reader", found.info);
    }
  }
};

class Teller : public DataReaderListener {
 public:
  explicit Teller(std::string topic) : topic_(std::move(topic)) {}
  void on_data_available(DataReader* reader) override {
    Bytes bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) {
        Say("data " + topic_ + " " + ToHex(bytes));
      }
    }
  }

 private:
  std::string topic_;
};

DomainParticipantQos LoopbackQos(uint32_t domain) {
  DomainParticipantQos qos;
  auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.emplace_back("127.0.0.1");
  transport->sendBufferSize = transport->receiveBufferSize = 1u << 22;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  for (uint16_t i = 0; i < kParticipants; ++i) {
    rtps::Locator_t locator;
    rtps::IPLocator::setIPv4(locator, "127.0.0.1");
    locator.port = 7400 + 250 * domain + 10 + 2u * i;
    qos.wire_protocol().builtin.initialPeersList.push_back(locator);
  }
  return qos;
}

}  // namespace

int main(int argc, char** argv) {
  const uint32_t domain = argc == 2 ? static_cast<uint32_t>(std::atoi(argv[1])) : 0;
  Discoveries discoveries;
  DomainParticipant* participant = DomainParticipantFactory::get_instance()->create_participant(
      domain, LoopbackQos(domain), &discoveries, StatusMask::none());
  if (participant == nullptr) {
    std::cerr << "no participant in domain " << domain << '\n';
    return 1;
  }
  Publisher* publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  Subscriber* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  std::map<std::string, Topic*> topics;
  std::map<std::string, DataWriter*> writers;
  std::vector<std::unique_ptr<Teller>> tellers;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string verb;
    std::string name;
    words >> verb >> name;
    if (verb == "write") {
      std::string hex;
      words >> hex;
      Bytes bytes = FromHex(hex);
      writers.at(name)->write(&bytes);
      continue;
    }
    std::string type;
    std::string reliability;
    std::string durability;
    words >> type >> reliability >> durability;
    const auto reliable =
        reliability == "reliable" ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    const auto kept =
        durability == "latched" ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    if (topics.count(name) == 0) {
      TypeSupport(new BytesType(type)).register_type(participant);
      topics[name] = participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
    }
    const auto set = [&](auto* qos) {
      qos->reliability().kind = reliable;
      qos->durability().kind = kept;
      qos->history().depth = 10;
      qos->endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    };
    if (verb == "read") {
      DataReaderQos qos = DATAREADER_QOS_DEFAULT;
      set(&qos);
      tellers.push_back(std::make_unique<Teller>(name));
      subscriber->create_datareader(topics[name], qos, tellers.back().get());
    } else {
      DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
      set(&qos);
      qos.publish_mode().kind = SYNCHRONOUS_PUBLISH_MODE;
      writers[name] = publisher->create_datawriter(topics[name], qos);
    }
  }
  participant->set_listener(nullptr);
  participant->delete_contained_entities();
  DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
