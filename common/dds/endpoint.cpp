#include "common/dds/endpoint.h"

#include <algorithm>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <stdexcept>

#include "common/dds/parts.h"
#include "common/dds/qos.h"
#include "idl/sessionPubSubTypes.h"
#include "idl/statePubSubTypes.h"
#include "idl/toolPubSubTypes.h"
#include "idl/topologyPubSubTypes.h"

namespace sectio {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

// clang-format off
template <class T> struct GeneratedType;
template <> struct GeneratedType<wire::ToolPacket> { using type = wire::ToolPacketPubSubType; };
template <> struct GeneratedType<wire::ContactModel> { using type = wire::ContactModelPubSubType; };
template <> struct GeneratedType<wire::TopologyDelta> { using type = wire::TopologyDeltaPubSubType; };
template <> struct GeneratedType<wire::KeyframeChunk> { using type = wire::KeyframeChunkPubSubType; };
template <> struct GeneratedType<wire::KeyframeRequest> { using type = wire::KeyframeRequestPubSubType; };
template <> struct GeneratedType<wire::StateHeader> { using type = wire::StateHeaderPubSubType; };
template <> struct GeneratedType<wire::StatePiece> { using type = wire::StatePiecePubSubType; };
template <> struct GeneratedType<wire::SceneInfo> { using type = wire::SceneInfoPubSubType; };
template <> struct GeneratedType<wire::Event> { using type = wire::EventPubSubType; };
template <> struct GeneratedType<wire::ServerStatus> { using type = wire::ServerStatusPubSubType; };
template <> struct GeneratedType<wire::GravityRequest> { using type = wire::GravityRequestPubSubType; };
template <> struct GeneratedType<wire::SessionEnd> { using type = wire::SessionEndPubSubType; };
// clang-format on

// The generated type lets some exceptions of a damaged sample through, into threads of Fast DDS.
template <class T>
class CheckedType : public GeneratedType<T>::type {
 public:
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    if (payload->length > qos_of<T>().max_bytes) return false;
    try {
      return GeneratedType<T>::type::deserialize(payload, data);
    } catch (const std::exception&) {
      return false;
    }
  }
};

// A topic is shared by all endpoints of a participant and lives as long as it.
template <class T>
dds::Topic* topic_of(Participant::Parts& parts) {
  const char* name = qos_of<T>().name;
  if (dds::TopicDescription* known = parts.participant->lookup_topicdescription(name))
    return dynamic_cast<dds::Topic*>(known);
  dds::TypeSupport type(new CheckedType<T>());
  type->auto_fill_type_information(false);
  type->auto_fill_type_object(false);
  if (type.register_type(parts.participant) != ReturnCode_t::RETCODE_OK) return nullptr;
  return parts.participant->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
}

// Fields that readers and writers have in common.
template <class Qos>
void set_common(Qos& qos, const TopicQos& topic, std::int32_t depth) {
  qos.reliability().kind = topic.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  qos.resource_limits().max_instances = 1;
  qos.resource_limits().max_samples = depth;
  qos.resource_limits().max_samples_per_instance = depth;
  qos.resource_limits().allocated_samples = std::min(depth, 16);
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  qos.data_sharing().off();
}

constexpr std::int32_t kLeastReaderDepth = 16;  // the newest sample of each server of a session

}  // namespace

template <class T>
struct Writer<T>::Core {
  const LostReaders* lost_readers = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::DataWriter* writer = nullptr;
};

template <class T>
Writer<T>::Writer(Participant& participant) : core_(std::make_unique<Core>()) {
  Participant::Parts& parts = participant.parts();
  const TopicQos& topic = qos_of<T>();
  dds::DataWriterQos qos;
  set_common(qos, topic, topic.depth);
  qos.durability().kind = topic.reliable ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  qos.reliability().max_blocking_time = duration(0.1);
  qos.reliable_writer_qos().times.heartbeatPeriod = duration(kHeartbeat_s);
  qos.reliable_writer_qos().times.nackResponseDelay = duration(0);
  qos.reliable_writer_qos().times.nackSupressionDuration = duration(0);
  core_->lost_readers = &parts.lost_readers;
  core_->publisher = parts.publisher;
  core_->writer = parts.publisher->create_datawriter(topic_of<T>(parts), qos);
  if (core_->writer == nullptr) throw std::runtime_error(std::string("DDS refuses to write ") + topic.name);
}

template <class T>
Writer<T>::~Writer() {
  core_->publisher->delete_datawriter(core_->writer);
}

template <class T>
bool Writer<T>::write(const T& message) {
  if (T::getCdrSerializedSize(message) > qos_of<T>().max_bytes) return false;
  return core_->writer->write(const_cast<T*>(&message));
}

template <class T>
std::uint32_t Writer<T>::readers() const {
  dds::PublicationMatchedStatus status;
  core_->writer->get_publication_matched_status(status);
  return static_cast<std::uint32_t>(status.current_count);
}

template <class T>
std::uint32_t Writer<T>::lost_readers() const {
  return core_->lost_readers->of(core_->writer);
}

template <class T>
bool Writer<T>::wait_for_acknowledgments(double timeout_s) {
  return core_->writer->wait_for_acknowledgments(duration(timeout_s)) == ReturnCode_t::RETCODE_OK;
}

template <class T>
struct Reader<T>::Core {
  dds::Subscriber* subscriber = nullptr;
  dds::DataReader* reader = nullptr;
};

template <class T>
Reader<T>::Reader(Participant& participant) : core_(std::make_unique<Core>()) {
  Participant::Parts& parts = participant.parts();
  const TopicQos& topic = qos_of<T>();
  dds::DataReaderQos qos;
  set_common(qos, topic, std::max(topic.depth, kLeastReaderDepth));
  qos.durability().kind = topic.late_joiners ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.reliable_reader_qos().times.heartbeatResponseDelay = duration(kHeartbeatResponse_s);
  core_->subscriber = parts.subscriber;
  core_->reader = parts.subscriber->create_datareader(topic_of<T>(parts), qos);
  if (core_->reader == nullptr) throw std::runtime_error(std::string("DDS refuses to read ") + topic.name);
}

template <class T>
Reader<T>::~Reader() {
  core_->subscriber->delete_datareader(core_->reader);
}

template <class T>
bool Reader<T>::take(T& message) {
  dds::SampleInfo info;
  while (core_->reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK)
    if (info.valid_data) return true;
  return false;
}

template <class T>
std::uint32_t Reader<T>::writers() const {
  dds::SubscriptionMatchedStatus status;
  core_->reader->get_subscription_matched_status(status);
  return static_cast<std::uint32_t>(status.current_count);
}

template <class T>
std::vector<std::uint8_t> encode(const T& message) {
  CheckedType<T> type;
  auto* data = const_cast<T*>(&message);
  rtps::SerializedPayload_t payload(type.getSerializedSizeProvider(data)());
  if (!type.serialize(data, &payload)) return {};
  return {payload.data, payload.data + payload.length};
}

template <class T>
bool decode(std::span<const std::uint8_t> bytes, T& message) {
  CheckedType<T> type;
  rtps::SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  return type.deserialize(&payload, &message);
}

// NOLINTBEGIN(bugprone-macro-parentheses): T is a type.
#define SECTIO_ENDPOINTS(T)                               \
  template class Writer<T>;                               \
  template class Reader<T>;                               \
  template std::vector<std::uint8_t> encode<T>(const T&); \
  template bool decode<T>(std::span<const std::uint8_t>, T&)
// NOLINTEND(bugprone-macro-parentheses)

SECTIO_ENDPOINTS(wire::ToolPacket);
SECTIO_ENDPOINTS(wire::ContactModel);
SECTIO_ENDPOINTS(wire::TopologyDelta);
SECTIO_ENDPOINTS(wire::KeyframeChunk);
SECTIO_ENDPOINTS(wire::KeyframeRequest);
SECTIO_ENDPOINTS(wire::StateHeader);
SECTIO_ENDPOINTS(wire::StatePiece);
SECTIO_ENDPOINTS(wire::SceneInfo);
SECTIO_ENDPOINTS(wire::Event);
SECTIO_ENDPOINTS(wire::ServerStatus);
SECTIO_ENDPOINTS(wire::GravityRequest);
SECTIO_ENDPOINTS(wire::SessionEnd);

}  // namespace sectio
