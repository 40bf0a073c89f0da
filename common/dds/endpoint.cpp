#include "common/dds/endpoint.h"

#include <algorithm>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/core/error.h"
#include "common/dds/expediting_transport.h"
#include "common/dds/parts.h"

namespace sectio {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

// To Fast DDS a sample is bytes, which codec.h has made and will read.
class SampleType : public dds::TopicDataType {
 public:
  explicit SampleType(const TopicQos& topic) : max_bytes_(topic.max_bytes) {
    setName(topic.type);
    m_typeSize = topic.max_bytes;
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }

  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<const Bytes*>(data);
    if (bytes.size() > payload->max_size) return false;
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    if (payload->length > max_bytes_) return false;
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }

 private:
  std::uint32_t max_bytes_;
};

// A topic is shared by all endpoints of a participant and lives as long as the participant.
dds::Topic* topic_of(Participant::Parts& parts, const TopicQos& topic) {
  if (dds::TopicDescription* known = parts.participant->lookup_topicdescription(topic.name))
    return dynamic_cast<dds::Topic*>(known);
  dds::TypeSupport type(new SampleType(topic));
  if (type.register_type(parts.participant) != ReturnCode_t::RETCODE_OK) return nullptr;
  return parts.participant->create_topic(topic.name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
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

// With keys, DDS refuses what the permissions of this program don't hold.
[[noreturn]] void refuse(const Participant::Parts& parts, const std::string& verb, const TopicQos& topic) {
  if (parts.keys)
    throw InputError("--keys " + parts.keys->directory() + ": " + parts.keys->identity() + " may not " + verb + ' ' +
                     topic.name + " of this session");
  throw std::runtime_error("DDS refuses to " + verb + ' ' + topic.name);
}

// A viewer that hears a slow channel of states sits behind a thin link, in whose queue a repeat waits for long: it
// isn't asked for again and again meanwhile, and a newer state comes anyway.
constexpr std::size_t kFirstSlowChannel = 2;
void calm(dds::DataWriterQos& qos) {
  constexpr double kCalm = 4;
  auto& times = qos.reliable_writer_qos().times;
  const auto longer = [](const eprosima::fastrtps::Duration_t& time) {
    return duration(kCalm * static_cast<double>(time.to_ns()) * 1e-9);
  };
  times.heartbeatPeriod = longer(times.heartbeatPeriod);
  times.nackResponseDelay = longer(times.nackResponseDelay);
}

dds::Publisher* publisher_of(Participant::Parts& parts, const std::string& channel) {
  dds::Publisher*& publisher = parts.publishers[channel];
  if (publisher == nullptr) {
    dds::PublisherQos qos;
    qos.partition().push_back(parts.partition_of(channel).c_str());
    publisher = parts.participant->create_publisher(qos);
  }
  return publisher;
}

}  // namespace

struct SampleWriter::Core {
  struct Channel {
    dds::Publisher* publisher = nullptr;
    dds::DataWriter* writer = nullptr;
  };
  const Peers* peers = nullptr;
  std::vector<Channel> channels;  // one, when the topic has none by name
  std::uint32_t max_bytes = 0;
  bool expedited = false;
};

SampleWriter::SampleWriter(Participant& participant, const TopicQos& topic) : core_(std::make_unique<Core>()) {
  Participant::Parts& parts = participant.parts();
  dds::DataWriterQos qos;
  set_common(qos, topic, topic.depth);
  qos.durability().kind = topic.reliable ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  qos.reliability().max_blocking_time = duration(0.1);
  qos.reliable_writer_qos().times.heartbeatPeriod = duration(topic.repair.heartbeat_s);
  qos.reliable_writer_qos().times.nackResponseDelay = duration(topic.repair.nack_response_s);
  qos.reliable_writer_qos().times.nackSupressionDuration = duration(topic.repair.nack_suppression_s);
  qos.reliable_writer_qos().disable_heartbeat_piggyback = true;
  *core_ = {&parts.peers, {}, topic.max_bytes, topic.expedited};
  std::vector<std::string> names(topic.channels.begin(), topic.channels.end());
  if (names.empty()) names = {""};
  for (const std::string& name : names) {
    if (core_->channels.size() == kFirstSlowChannel) calm(qos);
    dds::Publisher* publisher = publisher_of(parts, name);
    dds::DataWriter* writer = publisher ? publisher->create_datawriter(topic_of(parts, topic), qos) : nullptr;
    if (writer == nullptr) refuse(parts, "write", topic);
    core_->channels.push_back({publisher, writer});
  }
}

SampleWriter::~SampleWriter() {
  if (!core_) return;
  for (const Core::Channel& channel : core_->channels) channel.publisher->delete_datawriter(channel.writer);
}

SampleWriter::SampleWriter(SampleWriter&&) noexcept = default;

bool SampleWriter::write(const Bytes& bytes, std::size_t channel) {
  const Expedite expedite(core_->expedited);
  return bytes.size() <= core_->max_bytes && core_->channels[channel].writer->write(const_cast<Bytes*>(&bytes));
}

std::uint32_t SampleWriter::readers(std::size_t channel) const {
  dds::PublicationMatchedStatus status;
  core_->channels[channel].writer->get_publication_matched_status(status);
  return static_cast<std::uint32_t>(status.current_count);
}

std::uint32_t SampleWriter::lost_readers() const {
  return core_->peers->lost_readers(core_->channels.front().writer);
}

bool SampleWriter::wait_for_acknowledgments(double timeout_s) {
  return core_->channels.front().writer->wait_for_acknowledgments(duration(timeout_s)) == ReturnCode_t::RETCODE_OK;
}

struct SampleReader::Core {
  dds::Subscriber* subscriber = nullptr;
  dds::DataReader* reader = nullptr;
};

SampleReader::SampleReader(Participant& participant, const TopicQos& topic) : core_(std::make_unique<Core>()) {
  Participant::Parts& parts = participant.parts();
  dds::DataReaderQos qos;
  set_common(qos, topic, std::max(topic.depth, topic.reader_depth));
  qos.durability().kind = topic.late_joiners ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.reliable_reader_qos().times.heartbeatResponseDelay = duration(topic.repair.response_s);
  *core_ = {parts.subscriber, parts.subscriber->create_datareader(topic_of(parts, topic), qos)};
  if (core_->reader == nullptr) refuse(parts, "read", topic);
}

SampleReader::~SampleReader() {
  if (core_) core_->subscriber->delete_datareader(core_->reader);
}

SampleReader::SampleReader(SampleReader&&) noexcept = default;

bool SampleReader::take(Bytes& bytes) {
  dds::SampleInfo info;
  while (core_->reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK)
    if (info.valid_data) {
      std::copy_n(rtps::GUID_t(info.publication_handle).guidPrefix.value, sender_.size(), sender_.begin());
      return true;
    }
  return false;
}

std::uint32_t SampleReader::writers() const {
  dds::SubscriptionMatchedStatus status;
  core_->reader->get_subscription_matched_status(status);
  return static_cast<std::uint32_t>(status.current_count);
}

}  // namespace sectio
