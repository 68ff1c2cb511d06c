#include "client_fw/ros2/node.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <iterator>
#include <type_traits>

namespace pheromone::ros2 {
namespace {

constexpr const char* kNodeNamespace = "/";
constexpr const char* kNodeName = "pheromone";
constexpr const char* kGraphTopic = "ros_discovery_info";

using QosPointer = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

QosPointer MakeQos(bool writer, Quality quality) {
  QosPointer qos(dds_create_qos(), &dds_delete_qos);
  const bool reliable = quality != Quality::kSensor && quality != Quality::kFrames;
  const bool kept = quality == Quality::kLatched || quality == Quality::kStatic;
  const bool many =
      quality == Quality::kFrames || quality == Quality::kStatic || quality == Quality::kMany;
  const int32_t depth = many ? 100 : quality == Quality::kOrders && !writer ? 10 : 1;
  dds_qset_reliability(qos.get(), reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_MSECS(1));
  dds_qset_durability(qos.get(), kept ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  if (writer) {
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, depth, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
    dds_qset_writer_data_lifecycle(qos.get(), false);
  }
  return qos;
}

void SetUserData(dds_qos_t* qos, const std::string& text) {
  dds_qset_userdata(qos, text.data(), text.size());
}

void SetTypeHash(dds_qos_t* qos, std::string_view hash) {
  std::string text = "typehash=";
  text += hash;
  text += ';';
  SetUserData(qos, text);
}

// The descriptors that idlc makes are constants, and so is each member.
dds_topic_descriptor_t Renamed(const dds_topic_descriptor_t& it, const char* name) {
  return {it.m_size, it.m_align,          it.m_flagset,    it.m_nkeys,
          name,      it.m_keys,           it.m_nops,       it.m_ops,
          it.m_meta, it.type_information, it.type_mapping, it.restrict_data_representation};
}

template <class Gid>
Gid ToGid(const dds_guid_t& guid) {
  Gid gid{};
  std::memcpy(gid.data, guid.v, sizeof guid.v);
  return gid;
}

}  // namespace

std::string DdsTopic(std::string_view ros_topic) {
  return "rt" + std::string(ros_topic);
}

bool IsRosName(std::string_view name) {
  char before = '/';
  for (const char c : name) {
    const bool digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    const bool letter = std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_';
    if (c == '/' ? before == '/' : !letter && (!digit || before == '/')) {
      return false;
    }
    if (c == '_' && before == '_') {
      return false;
    }
    before = c;
  }
  return before != '/';
}

Result<std::unique_ptr<Node>> Node::Create(const Discovery& discovery, Distro distro) {
  const dds_entity_t domain = dds_create_domain(discovery.domain, discovery.config.c_str());
  if (domain < 0) {
    return Error{"Cyclone DDS cannot start in domain " + std::to_string(discovery.domain) + ": " +
                 dds_strretcode(domain) + "; see CYCLONEDDS_URI"};
  }
  const QosPointer qos(dds_create_qos(), &dds_delete_qos);
  SetUserData(qos.get(), "enclave=/;");
  const dds_entity_t participant = dds_create_participant(discovery.domain, qos.get(), nullptr);
  if (participant < 0) {
    dds_delete(domain);
    return Error{"no DDS participant in domain " + std::to_string(discovery.domain) + ": " +
                 dds_strretcode(participant)};
  }
  return std::unique_ptr<Node>(new Node(domain, participant, distro));
}

Node::Node(dds_entity_t domain, dds_entity_t participant, Distro distro)
    : domain_(domain), participant_(participant), distro_(distro) {
  publications_ =
      dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
}

Node::~Node() {
  dds_delete(participant_);
  dds_delete(domain_);
}

dds_entity_t Node::Make(bool writer, const std::string& topic,
                        const dds_topic_descriptor_t* descriptor, const char* hash,
                        Quality quality) {
  const std::lock_guard lock(mutex_);
  const QosPointer qos = MakeQos(writer, quality);
  const dds_entity_t made =
      dds_create_topic(participant_, descriptor, DdsTopic(topic).c_str(), nullptr, nullptr);
  SetTypeHash(qos.get(), hash);
  const dds_entity_t entity =
      made < 0 ? made
               : (writer ? dds_create_writer(participant_, made, qos.get(), nullptr)
                         : dds_create_reader(participant_, made, qos.get(), nullptr));
  dds_guid_t guid{};
  if (entity < 0 || dds_get_guid(entity, &guid) < 0) {
    if (trouble_.empty()) {
      trouble_ = topic + ": " + dds_strretcode(entity);
    }
    return 0;
  }
  (writer ? writers_ : readers_).push_back(guid);
  if (writer) {
    entities_.push_back(entity);
  }
  changed_ = true;
  return entity;
}

void Node::Delete(dds_entity_t entity) {
  dds_guid_t guid{};
  if (entity <= 0 || dds_get_guid(entity, &guid) < 0) {
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    const auto is_it = [&](const dds_guid_t& it) {
      return std::memcmp(it.v, guid.v, sizeof guid.v) == 0;
    };
    std::erase_if(readers_, is_it);
    std::erase_if(writers_, is_it);
    std::erase(entities_, entity);
    changed_ = true;
  }
  // Without the lock: DDS waits for readers that have not acknowledged, and for listeners.
  const dds_entity_t topic = dds_get_topic(entity);
  dds_delete(entity);
  dds_delete(topic);
}

// Whoever publishes a graph of its own shows by a type hash that it is of Iron or later.
void Node::FindDistro() {
  Subscription<dds_builtintopic_endpoint_t> publications(publications_);
  dds_guid_t own{};
  dds_get_guid(participant_, &own);
  publications.Receive([&](const dds_builtintopic_endpoint_t& it) {
    if (distro_ != Distro::kAuto || it.topic_name == nullptr ||
        std::strcmp(it.topic_name, kGraphTopic) != 0 ||
        std::memcmp(it.participant_key.v, own.v, sizeof own.v) == 0) {
      return;
    }
    void* data = nullptr;
    size_t size = 0;
    const bool any = dds_qget_userdata(it.qos, &data, &size) && data != nullptr;
    const std::string text(any ? static_cast<const char*>(data) : "", any ? size : 0);
    dds_free(data);
    distro_ = text.find("typehash=") != std::string::npos ? Distro::kIron : Distro::kHumble;
  });
}

void Node::AdvertiseGraph() {
  const QosPointer qos = MakeQos(true, Quality::kLatched);
  const dds_topic_descriptor_t humble =
      Renamed(rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo__desc,
              Kind<ParticipantEntitiesInfo>::descriptor()->m_typename);
  const bool new_size = distro_ == Distro::kIron;
  if (new_size) {
    SetTypeHash(qos.get(), Kind<ParticipantEntitiesInfo>::kHash);
  }
  const dds_entity_t topic = dds_create_topic(
      participant_, new_size ? Kind<ParticipantEntitiesInfo>::descriptor() : &humble, kGraphTopic,
      nullptr, nullptr);
  graph_ = dds_create_writer(participant_, topic, qos.get(), nullptr);
}

template <class Info>
void Node::PublishGraph() {
  using NodeInfo = std::remove_pointer_t<decltype(Info::node_entities_info_seq._buffer)>;
  using Gid = decltype(Info::gid);
  std::vector<Gid> readers;
  std::vector<Gid> writers;
  std::transform(readers_.begin(), readers_.end(), std::back_inserter(readers), ToGid<Gid>);
  std::transform(writers_.begin(), writers_.end(), std::back_inserter(writers), ToGid<Gid>);
  std::vector<NodeInfo> nodes(1);
  std::memcpy(nodes[0].node_namespace, kNodeNamespace, std::strlen(kNodeNamespace));
  std::memcpy(nodes[0].node_name, kNodeName, std::strlen(kNodeName));
  PointAt(&nodes[0].reader_gid_seq, &readers);
  PointAt(&nodes[0].writer_gid_seq, &writers);
  dds_guid_t own{};
  dds_get_guid(participant_, &own);
  Info info{};
  info.gid = ToGid<Gid>(own);
  PointAt(&info.node_entities_info_seq, &nodes);
  dds_write(graph_, &info);
}

void Node::Step() {
  const std::lock_guard lock(mutex_);
  FindDistro();
  if (distro_ == Distro::kAuto || !changed_) {
    return;
  }
  if (graph_ == 0) {
    AdvertiseGraph();
  }
  distro_ == Distro::kHumble ? PublishGraph<HumbleParticipantEntitiesInfo>()
                             : PublishGraph<ParticipantEntitiesInfo>();
  changed_ = false;
}

Status Node::status() const {
  const std::lock_guard lock(mutex_);
  return trouble_.empty() ? Ok() : Status(Error{trouble_});
}

void Node::Flush(int64_t ms) {
  std::unique_lock lock(mutex_);
  const std::vector<dds_entity_t> writers = entities_;
  lock.unlock();
  const dds_time_t end = dds_time() + DDS_MSECS(ms);
  for (const dds_entity_t writer : writers) {
    dds_wait_for_acks(writer, std::max<dds_duration_t>(0, end - dds_time()));
  }
}

}  // namespace pheromone::ros2
