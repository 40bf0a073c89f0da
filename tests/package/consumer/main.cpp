// Reads the record of a session, follows its bodies, and prints their names and hashes at the end.
#include <cstdio>

#include "common/core/error.h"
#include "common/mcap/mcap_reader.h"
#include "common/messages/chunks.h"
#include "common/messages/codec.h"
#include "render_client/replica/replica.h"

int main(int argc, char** argv) {
  using namespace sectio;
  if (argc != 2) {
    std::fprintf(stderr, "usage: consumer RECORD.mcap\n");
    return 2;
  }
  try {
    McapReader record(argv[1]);
    Replica replica;
    KeyframeAssembler keyframes;
    while (const auto message = record.next()) {
      if (message->topic == "scene") {
        if (const auto scene = decode<SceneInfo>(message->bytes)) {
          if (replica.scene())
            replica.extend(*scene);
          else
            replica.reset(*scene);
        }
      } else if (message->topic == "keyframes") {
        const auto chunk = decode<KeyframeChunk>(message->bytes);
        if (!chunk) continue;
        if (const auto whole = keyframes.add(*chunk)) replica.feed_keyframe(chunk->epoch, chunk->body_id, *whole);
      } else if (message->topic == "topology_deltas") {
        if (auto delta = decode<DeltaMessage>(message->bytes)) replica.feed(std::move(*delta));
        replica.catch_up();
      }
    }
    const std::vector<BodyVersion> versions = replica.catch_up();
    for (std::size_t b = 0; b < versions.size(); ++b)
      std::printf("%s %016llx\n", replica.scene()->bodies[b].name.c_str(),
                  static_cast<unsigned long long>(versions[b].topology_hash));
  } catch (const InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
