// A program that takes part in a session and means ill. It knows the wire, writes valid messages under its own name,
// and forges no packets of others.
// usage: hostile ATTACK SESSION DOMAIN
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/endpoint.h"
#include "common/messages/codec.h"
#include "common/messages/contact.h"
#include "common/messages/inputs.h"
#include "common/messages/session.h"
#include "common/messages/state.h"
#include "common/messages/tool.h"
#include "common/messages/topology.h"
#include "tests/support/damage.h"
#include "tests/support/random.h"

namespace sectio::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();

void wait(double s) {
  std::this_thread::sleep_for(std::chrono::duration<double>(s));
}

class Hostile {
 public:
  explicit Hostile(const NetworkOptions& network) : participant_(network, "render_client 1") {
    scene_ = first<SceneInfo>();
    header_ = first<StateHeader>();
    contact_ = first<ContactMessage>();
  }

  // Twenty packets of a bridge that was started at the end of time.
  void tool_packets() {
    Writer<ToolPacket> out(participant_);
    meet(out);
    for (std::uint64_t i = 1; i <= 20; ++i) {
      const Pose away{Vec3(1, 1, 1), Eigen::Quaterniond::Identity()};
      write(out, ToolPacket{kMost, 0, {{0, i, 0.001 * static_cast<double>(i), away}}});
      wait(0.001);
    }
  }

  // One scene of a server that was there before all others, one of the server that comes after this one, and one of our
  // server with other bodies.
  void scenes() {
    Writer<SceneInfo> out(participant_);
    meet(out);
    for (const std::uint64_t epoch : {std::uint64_t{1}, scene_.epoch + 1, scene_.epoch}) {
      SceneInfo scene = scene_;
      scene.epoch = epoch;
      if (epoch == scene_.epoch) scene.bodies.push_back({"another"});
      write(out, scene);
      wait(0.2);
    }
  }

  // Scene and end of our server with another body, for all who come later.
  void scene_for_latecomers() {
    Writer<SceneInfo> scenes(participant_);
    Writer<SessionEnd> ends(participant_);
    meet(scenes);
    SceneInfo scene = scene_;
    scene.bodies.push_back({"another"});
    scene.world_bodies.push_back("another");
    write(scenes, scene);
    write(ends, SessionEnd{scene_.epoch, header_.step, "over", std::vector<BodyVersion>(scene.bodies.size())});
    std::puts("it stays");
    std::fflush(stdout);
    wait(60);
  }

  void session_end() {
    Writer<SessionEnd> out(participant_);
    meet(out);
    write(out, SessionEnd{scene_.epoch, header_.step, "over", std::vector<BodyVersion>(scene_.bodies.size())});
    wait(0.2);
  }

  void state_headers() {
    Writer<StateHeader> out(participant_);
    meet(out);
    for (std::uint64_t i = 1; i <= 5; ++i) {
      StateHeader header = header_;
      header.step += 1'000'000 * i;
      header.sim_time_s = static_cast<double>(header.step) * scene_.step_s;
      write(out, header);
      wait(0.02);
    }
  }

  // A thousand a second, of ten newtons: in the server's name, in that of the one that comes after it, and in our own.
  void contact_models() {
    Writer<ContactMessage> out(participant_);
    Writer<SceneInfo> scenes(participant_);
    meet(out);
    for (const std::uint64_t epoch : {scene_.epoch, scene_.epoch + 1, std::uint64_t{4096}}) {
      SceneInfo scene = scene_;
      scene.epoch = epoch;
      write(scenes, scene);
      for (std::uint64_t i = 0; i < 500; ++i) {
        ContactMessage contact = contact_;
        contact.epoch = epoch;
        contact.model.sequence = kMost / 2 + i;
        contact.model.state = ContactState::penetration;
        contact.model.force_world_n = Vec3(0, 0, 10);
        contact.model.stiffness_n_per_m = 0;
        contact.model.yield_n = kNeverYields_n;
        contact.model.tool_time_s += 0.001 * static_cast<double>(i);
        write(out, contact);
        wait(0.001);
      }
    }
  }

  // A scene of many bodies, and of each body one chunk of a keyframe, one state and one change that are as large as can
  // be.
  void large_messages() {
    Writer<SceneInfo> scenes(participant_);
    Writer<KeyframeChunk> chunks(participant_);
    Writer<StateHeader> headers(participant_);
    meet(chunks);
    SceneInfo scene = scene_;
    scene.epoch = 4096;
    scene.bodies.resize(kMaxBodies, {"x"});
    write(scenes, scene);
    wait(0.3);
    for (std::uint32_t b = 0; b < kMaxBodies; ++b) {
      write(chunks, KeyframeChunk{4096, b, 5, kMaxKeyframeBytes, 0, kMaxChunks, Bytes(1024, 1)});
      wait(0.001);
    }
    StateHeader header = header_;
    header.epoch = 4096;
    header.bodies.resize(kMaxBodies);
    for (BodyState& body : header.bodies) {
      body.vertex_slots = 192 * 8 * 4000;
      body.pieces_sent.assign(4000, 0xff);
    }
    for (int i = 1; i <= 60; ++i) {
      header.step += 1;
      header.sim_time_s = static_cast<double>(header.step) * scene_.step_s;
      write(headers, header);
      wait(0.01);
    }
  }

  // The next term of our server, with all that a server says in it, and its end.
  void later_term() {
    Writer<SceneInfo> scenes(participant_);
    Writer<StateHeader> headers(participant_);
    Writer<ContactMessage> contacts(participant_);
    Writer<StepInputs> inputs(participant_);
    Writer<SessionEnd> ends(participant_);
    meet(scenes);
    meet(headers);
    SceneInfo scene = scene_;
    scene.epoch += 5;
    write(scenes, scene);
    StateHeader header = header_;
    ContactMessage contact = contact_;
    header.epoch = contact.epoch = scene.epoch;
    contact.model.force_world_n = Vec3(0, 0, 10);
    for (int i = 1; i <= 100; ++i) {
      header.step += 10;
      header.sim_time_s = static_cast<double>(header.step) * scene_.step_s;
      contact.model.sequence += 10;
      for (std::size_t channel = 0; channel < kStateChannels.size(); ++channel) (void)headers.write(header, channel);
      write(contacts, contact);
      write(inputs, StepInputs{scene.epoch, header.step, {false_step(header.step)}});
      if (i == 5) write(ends, SessionEnd{scene.epoch, header.step, "over", versions()});
      wait(0.01);
    }
  }

  // Steps that our server has not made, in its name and in that of the one that comes after it.
  void step_inputs() {
    Writer<StepInputs> out(participant_);
    Writer<SceneInfo> scenes(participant_);
    meet(out);
    for (const std::uint64_t epoch : {scene_.epoch, scene_.epoch + 1}) {
      SceneInfo scene = scene_;
      scene.epoch = epoch;
      write(scenes, scene);
      for (std::uint64_t i = 1; i <= 300; ++i) {
        const std::uint64_t step = header_.step + i;
        write(out, StepInputs{epoch, step + 1'000'000, {false_step(step), false_step(step + 1000)}});
        wait(0.001);
      }
      std::vector<StepRecord> many;
      for (std::uint64_t i = 1; i <= 1000; ++i) many.push_back(false_step(header_.step + i));
      write(out, StepInputs{epoch, header_.step, many});
    }
    write_garbage(qos_of<StepInputs>());
  }

  // All steps of the past, again and again.
  void step_requests() {
    Writer<StepRequest> out(participant_);
    meet(out);
    flood([&](std::uint64_t i) { write(out, StepRequest{scene_.epoch, 1 + i % 64, i}); });
    write_garbage(qos_of<StepRequest>());
  }

  // Keyframes of all bodies in all revisions, as many chunks as can be.
  void keyframe_requests() {
    Writer<KeyframeRequest> out(participant_);
    meet(out);
    flood([&](std::uint64_t i) {
      const std::uint64_t revision = i % 3 == 0 ? kNoRevision : header_.bodies.front().revision + i % 100;
      const auto first = static_cast<std::uint32_t>(i % 7);
      write(out, KeyframeRequest{scene_.epoch, static_cast<std::uint32_t>(i % 2), kNoRevision, i, revision, first,
                                 kMostWindow});
    });
    write_garbage(qos_of<KeyframeRequest>());
  }

  // Reports of programs that there are not.
  void link_reports() {
    Writer<LinkReport> out(participant_);
    meet(out);
    flood([&](std::uint64_t i) {
      LinkReport report;
      report.client = i;
      report.name = std::string(kMaxNameBytes, 'x');
      report.age_p99_s = 1e6;
      write(out, report);
    });
    write_garbage(qos_of<LinkReport>());
  }

  void tool_wishes() {
    Writer<ToolWish> out(participant_);
    meet(out);
    flood([&](std::uint64_t i) {
      write(out, ToolWish{i, 0, kMost / 2 + i, JointPose{Pose{Vec3(1, 1, 1)}}, i % 2 == 0});
    });
    write_garbage(qos_of<ToolWish>());
  }

  // News of our server, and of one that has other bodies.
  void events() {
    Writer<SessionEvent> out(participant_);
    Writer<SceneInfo> scenes(participant_);
    meet(out);
    for (const std::uint64_t epoch : {scene_.epoch, std::uint64_t{4096}}) {
      SceneInfo scene = scene_;
      scene.epoch = epoch;
      if (epoch == 4096) scene.world_bodies = {scene.bodies.front().name = "another"};
      write(scenes, scene);
      wait(0.6);
      for (std::uint32_t i = 0; i < 600; ++i) {
        const auto kind = static_cast<std::uint8_t>(i % 31);
        write(out,
              SessionEvent{epoch, header_.step + i, kind, i % 2, i % 2, "news of a stranger " + std::to_string(i)});
      }
    }
    write_garbage(qos_of<SessionEvent>());
  }

  // Orders as fast as they can be given, most of them to begin anew.
  void session_orders() {
    Writer<SessionOrder> out(participant_);
    meet(out);
    constexpr std::array kKinds{OrderKind::begin_anew, OrderKind::begin_anew, OrderKind::tell_score, OrderKind::seek};
    std::puts("it begins");
    std::fflush(stdout);
    flood([&](std::uint64_t i) {
      SessionOrder order;
      order.source = i;
      order.kind = kKinds[i % kKinds.size()];
      write(out, order);
    });
    write_garbage(qos_of<SessionOrder>());
  }

  // All that comes by, damaged and said once more.
  void damaged_packets() {
    Reader<ToolPacket> packets(participant_);
    Reader<ContactMessage> contacts(participant_);
    SampleWriter tools(participant_, qos_of<ToolPacket>()), models(participant_, qos_of<ContactMessage>());
    Random random(5);
    Bytes bytes;
    for (const Clock::time_point end = Clock::now() + std::chrono::seconds(1); Clock::now() < end; wait(0.001)) {
      while (packets.SampleReader::take(bytes)) repeat(tools, bytes, random);
      while (contacts.SampleReader::take(bytes)) repeat(models, bytes, random);
    }
  }

 private:
  template <class Message>
  Message first() {
    Reader<Message> reader(participant_);
    for (const Clock::time_point end = Clock::now() + std::chrono::seconds(30); Clock::now() < end; wait(0.005))
      if (auto message = reader.take()) return *message;
    throw std::runtime_error(std::string("nothing on ") + qos_of<Message>().name);
  }
  template <class Message>
  void meet(const Writer<Message>& writer) {
    for (const Clock::time_point end = Clock::now() + std::chrono::seconds(10);
         writer.readers() == 0 && Clock::now() < end;)
      wait(0.005);
  }
  template <class Message>
  static void write(Writer<Message>& writer, const Message& message) {
    if (!writer.write(message)) throw std::runtime_error(std::string("refused: ") + qos_of<Message>().name);
  }
  StepRecord false_step(std::uint64_t step) const {
    StepRecord record;
    record.step = step;
    record.hash_before = 7;
    record.turns_gravity = true;
    return record;
  }
  std::vector<BodyVersion> versions() const { return std::vector<BodyVersion>(scene_.bodies.size()); }
  // Three seconds long, with a breath now and then, so that other programs get their share of the processor.
  template <class Say>
  static void flood(const Say& say) {
    std::uint64_t said = 0;
    for (const Clock::time_point end = Clock::now() + std::chrono::seconds(3); Clock::now() < end; wait(0.001))
      for (int i = 0; i < 20; ++i) say(++said);
    std::printf("%llu samples\n", static_cast<unsigned long long>(said));
  }
  // Bytes that are no message, of all sizes, and some that are larger than any message of the topic.
  void write_garbage(TopicQos topic) {
    topic.max_bytes = std::max(topic.max_bytes, 1u << 16);
    SampleWriter out(participant_, topic);
    Random random(11);
    for (int i = 0; i < 100; ++i) {
      Bytes bytes(random() % (i % 10 == 0 ? 60000 : 200));
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
      (void)out.write(bytes);
      wait(0.001);
    }
  }
  static void repeat(SampleWriter& writer, const Bytes& bytes, Random& random) {
    (void)writer.write(bytes);  // message of another speaker, as it came
    for (int i = 0; i < 3; ++i) (void)writer.write(damaged(bytes, random));
  }

  Participant participant_;
  SceneInfo scene_;
  StateHeader header_;
  ContactMessage contact_;
};

int attack(const std::string& name, const NetworkOptions& network) {
  const std::map<std::string, void (Hostile::*)()> attacks{{"tool_packets", &Hostile::tool_packets},
                                                           {"scenes", &Hostile::scenes},
                                                           {"scene_for_latecomers", &Hostile::scene_for_latecomers},
                                                           {"session_end", &Hostile::session_end},
                                                           {"state_headers", &Hostile::state_headers},
                                                           {"contact_models", &Hostile::contact_models},
                                                           {"large_messages", &Hostile::large_messages},
                                                           {"later_term", &Hostile::later_term},
                                                           {"step_inputs", &Hostile::step_inputs},
                                                           {"step_requests", &Hostile::step_requests},
                                                           {"keyframe_requests", &Hostile::keyframe_requests},
                                                           {"link_reports", &Hostile::link_reports},
                                                           {"tool_wishes", &Hostile::tool_wishes},
                                                           {"events", &Hostile::events},
                                                           {"session_orders", &Hostile::session_orders},
                                                           {"damaged_packets", &Hostile::damaged_packets}};
  const auto known = attacks.find(name);
  if (known == attacks.end()) throw std::runtime_error("no such attack: " + name);
  Hostile hostile(network);
  (hostile.*known->second)();
  return 0;
}

}  // namespace
}  // namespace sectio::test

int main(int argc, char** argv) {
  try {
    if (argc != 4) throw std::runtime_error("usage: hostile ATTACK SESSION DOMAIN");
    sectio::NetworkOptions network;
    network.session = argv[2];
    network.domain = static_cast<std::uint32_t>(std::stoul(argv[3]));
    return sectio::test::attack(argv[1], network);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hostile: %s\n", error.what());
    return 1;
  }
}
