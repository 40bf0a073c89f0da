// The entry of libFuzzer (deploy/fuzz): bytes as they may come from the wire, through the real readers. The first byte
// of an input says of which kind the message is; a two-byte length goes before each further message.
#include <cstdint>
#include <cstdlib>
#include <span>

#include "common/messages/codec.h"
#include "common/messages/contact.h"
#include "common/messages/inputs.h"
#include "common/messages/inputs_fields.h"
#include "common/messages/live.h"
#include "common/messages/live_frame.h"
#include "common/messages/session_fields.h"
#include "common/messages/state_fields.h"
#include "common/messages/tool_fields.h"
#include "common/messages/topology_fields.h"
#include "common/messages/validate.h"
#include "render_client/replica/world.h"

namespace sectio {
namespace {

constexpr std::size_t kKinds = 17;

// A viewer that has been told of one small scene; whatever comes then comes from its server.
struct Viewer {
  Viewer() {
    SceneInfo scene;
    scene.epoch = 7;
    scene.session = "fuzz";
    scene.bodies = {{"liver"}};
    scene.world_bodies = {"liver"};
    scene.tools = {{"scalpel"}};
    world.announce(scene);
  }
  World world;
  Frame frame;
  double now_s = 0;

  void look() {
    now_s += 0.04;
    world.frame(now_s, frame);
    world.take_requests(now_s);
  }
};

// Decoded messages are valid, and come back from their bytes as they were.
template <class Message, class Use>
void read(std::span<const std::uint8_t> bytes, const Use& use) {
  auto message = decode<Message>(bytes);
  if (!message) return;
  if (!first_flaw(*message).empty()) std::abort();
  if (!decode<Message>(encode(*message))) std::abort();
  use(*message);
}

void take(Viewer& viewer, std::uint8_t kind, std::span<const std::uint8_t> bytes) {
  const auto nothing = [](const auto&) {};
  const auto feed = [&](auto& message) {
    message.epoch = 7;  // a fuzzer can't guess a hash
    viewer.world.feed(std::move(message));
  };
  switch (kind % kKinds) {
    case 0:
      return read<ToolPacket>(bytes, nothing);
    case 1:
      return read<ToolWish>(bytes, nothing);
    case 2:
      return read<ContactMessage>(bytes, nothing);
    case 3:
      return read<DeltaMessage>(bytes, feed);
    case 4:
      return read<KeyframeChunk>(bytes, feed);
    case 5:
      return read<KeyframeRequest>(bytes, nothing);
    case 6:
      return read<StateHeader>(bytes, feed);
    case 7:
      return read<StatePiece>(bytes, feed);
    case 8:
      return read<ScalarPiece>(bytes, feed);
    case 9:
      return read<SceneInfo>(bytes, [&](const SceneInfo& scene) { viewer.world.announce(scene); });
    case 10:
      return read<SessionEvent>(bytes, nothing);
    case 11:
      return read<ServerStatus>(bytes, nothing);
    case 12:
      return read<SessionOrder>(bytes, nothing);
    case 13:
      return read<SessionEnd>(bytes, feed);
    case 14:
      return read<LinkReport>(bytes, nothing);
    case 15:
      return read<StepInputs>(bytes, nothing);
    default:
      return read<StepRequest>(bytes, nothing);
  }
}

}  // namespace
}  // namespace sectio

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sectio::Viewer viewer;
  std::span<const std::uint8_t> left(data, size);
  for (int messages = 0; left.size() >= 3 && messages < 8; ++messages) {
    const std::uint8_t kind = left[0];
    const std::size_t length = std::min<std::size_t>(left[1] | left[2] << 8, left.size() - 3);
    sectio::take(viewer, kind, left.subspan(3, length));
    left = left.subspan(3 + length);
    viewer.look();
  }
  return 0;
}
