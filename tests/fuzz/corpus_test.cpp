#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include "common/dds/qos.h"
#include "common/delta/bytes.h"
#include "common/delta/journal.h"
#include "common/math/archive.h"
#include "common/mcap/mcap_format.h"
#include "common/messages/chunks.h"
#include "common/messages/codec.h"
#include "sim_server/session/checkpoint.h"
#include "tests/support/damage.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"
#include "tests/unit/dds/messages.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int fuzz_file(const std::uint8_t* data, std::size_t size);

namespace sectio {
namespace {

using Input = std::vector<std::uint8_t>;

// In the order of the kinds of fuzz_messages.cpp.
std::vector<Input> seeds() {
  std::vector<Input> all;
  const auto add = [&](const auto& message) {
    const std::vector<std::uint8_t> bytes = encode(message);
    Input input{static_cast<std::uint8_t>(all.size()), static_cast<std::uint8_t>(bytes.size() & 0xff),
                static_cast<std::uint8_t>(bytes.size() >> 8)};
    input.insert(input.end(), bytes.begin(), bytes.end());
    all.push_back(input);
  };
  add(test::some_packet());
  add(test::some_wish());
  add(test::some_contact());
  add(test::some_delta());
  add(test::some_chunk());
  add(test::some_request());
  add(test::some_header());
  add(test::some_piece());
  add(test::some_scalars());
  add(test::some_scene());
  add(test::some_event());
  add(test::some_status());
  add(test::some_order());
  add(test::some_end());
  add(test::some_report());
  add(test::some_inputs());
  add(test::some_step_request());
  return all;
}

void run(const Input& input) {
  LLVMFuzzerTestOneInput(input.data(), input.size());
}

// A record without compression and checksums, which a fuzzer can't guess.
class PlainRecord {
 public:
  PlainRecord() { out_.put_bytes(kMcapMagic); }

  template <class Message>
  void add(const Message& message, double sim_time_s) {
    const std::string topic = qos_of<Message>().name;
    const auto [channel, is_new] = channels_.emplace(topic, channels_.size());
    if (is_new) {
      ByteWriter record;
      record.put(static_cast<std::uint16_t>(channel->second));
      record.put(std::uint16_t{0});
      for (const std::string& text : {topic, std::string("cdr"), std::string()}) put(record, text);
      put(McapOp::channel, record);
    }
    ByteWriter record;
    record.put(static_cast<std::uint16_t>(channel->second));
    record.put(std::uint32_t{0});
    for (int i = 0; i < 2; ++i) record.put(static_cast<std::uint64_t>(1e9 * sim_time_s));
    record.put_bytes(encode(message));
    put(McapOp::message, record);
  }
  void add_header(const std::string& text) {
    ByteWriter record;
    for (const std::string& each : {std::string("sectio"), text}) put(record, each);
    put(McapOp::metadata, record);
  }
  Input finish(char kind) {
    put(McapOp::data_end, ByteWriter());
    Input input = out_.take();
    input.insert(input.begin(), static_cast<std::uint8_t>(kind));
    return input;
  }

 private:
  static void put(ByteWriter& record, const std::string& text) {
    record.put(static_cast<std::uint32_t>(text.size()));
    record.put_bytes(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }
  void put(McapOp op, ByteWriter record) {
    const std::vector<std::uint8_t> content = record.take();
    out_.put(static_cast<std::uint8_t>(op));
    out_.put(static_cast<std::uint64_t>(content.size()));
    out_.put_bytes(content);
  }

  ByteWriter out_;
  std::map<std::string, std::size_t> channels_;
};

// A record of a box, one of inputs, a journal: deploy/fuzz makes those of scenes and traces of the ones that there are.
std::vector<Input> file_seeds() {
  const TriangleMesh mesh(test::box(1, 1, 1, Vec3::Constant(0.1)));
  SceneInfo scene = test::some_scene();
  scene.bodies.resize(1);
  scene.world_bodies = {scene.bodies[0].name};
  PlainRecord record;
  record.add(scene, 0);
  for (const KeyframeChunk& chunk : split_keyframe(scene.epoch, 0, 0, to_bytes(keyframe_of(mesh)), kChunkBytes))
    record.add(chunk, 0);
  for (int i = 1; i < 3; ++i) {
    StateHeader header = test::some_header();
    header.epoch = scene.epoch;
    header.bodies.resize(1);
    header.bodies[0].revision = 0;
    header.bodies[0].vertex_slots = mesh.vertex_slots();
    header.bodies[0].pieces_sent = {1};
    StatePiece piece = test::some_piece();
    piece.epoch = scene.epoch;
    piece.body_id = piece.piece = 0;
    ScalarPiece scalars = test::some_scalars();
    scalars.epoch = scene.epoch;
    scalars.body_id = scalars.piece = 0;
    DeltaMessage delta = test::some_delta();
    delta.epoch = scene.epoch;
    delta.body_id = 0;
    record.add(header, i);
    record.add(piece, i);
    record.add(scalars, i);
    record.add(delta, i);
  }
  record.add(test::some_event(), 2);
  record.add(test::some_status(), 2);
  record.add(test::some_end(), 3);

  PlainRecord inputs;
  inputs.add_header(R"({"scene":"a.yaml","bodies":["liver"],"state_hash":7})");
  inputs.add(test::some_inputs(), 1);

  const std::string path = testing::TempDir() + "sectio_fuzz_journal_" + std::to_string(getpid());
  const std::vector<JournalBody> bodies{{"box", mesh}};
  { JournalWriter(path, bodies).append(JournalGravity{1, Vec3(0, 0, -9)}); }
  std::ifstream file(path, std::ios::binary);
  Input journal{'j'};
  journal.insert(journal.end(), std::istreambuf_iterator<char>(file), {});
  std::filesystem::remove(path);

  Checkpoint some{.session = 7, .step = 8, .epoch = 9, .simulation = {1, 2, 3, 4}, .recorder = {5, 6}};
  std::vector<std::uint8_t> state;
  Archive archive(state);
  archive(some);
  Input checkpoint{'c'};
  checkpoint.insert(checkpoint.end(), state.begin(), state.end());
  return {record.finish('r'), inputs.finish('i'), journal, checkpoint};
}

void write_seeds(const std::string& directory, const std::vector<Input>& all) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::ofstream file(directory + "/seed_" + std::to_string(i), std::ios::binary);
    file.write(reinterpret_cast<const char*>(all[i].data()), static_cast<std::streamsize>(all[i].size()));
  }
}

TEST(FuzzCorpus, every_input_goes_through_the_readers) {
  int inputs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SECTIO_SOURCE_DIR "/tests/fuzz/corpus")) {
    std::ifstream file(entry.path(), std::ios::binary);
    run({std::istreambuf_iterator<char>(file), {}});
    ++inputs;
  }
  EXPECT_GT(inputs, 16);
}

// Valid messages of every kind, some after one another, damaged in all the ways of damage.h.
TEST(FuzzCorpus, a_hundred_thousand_damaged_messages_harm_no_reader) {
  const std::vector<Input> whole = seeds();
  test::Random random(11);
  for (int i = 0; i < 100'000; ++i) {
    Input input;
    for (auto messages = 1 + random() % 3; messages > 0; --messages) {
      const Input& seed = whole[random() % whole.size()];
      const Input one = random() % 4 == 0 ? seed : test::damaged(seed, random);
      input.insert(input.end(), one.begin(), one.end());
    }
    run(input);
  }
}

TEST(FuzzCorpus, every_file_goes_through_its_reader) {
  int inputs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SECTIO_SOURCE_DIR "/tests/fuzz/files")) {
    std::ifstream file(entry.path(), std::ios::binary);
    const Input input{std::istreambuf_iterator<char>(file), {}};
    fuzz_file(input.data(), input.size());
    ++inputs;
  }
  EXPECT_GE(inputs, 3);
}

TEST(FuzzCorpus, damaged_files_harm_no_reader) {
  const std::vector<Input> whole = file_seeds();
  test::Random random(12);
  for (int i = 0; i < 10'000; ++i) {
    Input input = whole[random() % whole.size()];
    const auto kind = input[0];
    input = test::damaged(input, random);
    if (!input.empty()) input[0] = kind;
    fuzz_file(input.data(), input.size());
  }
}

// The corpora begin with these: SECTIO_FUZZ_SEEDS names the directory of both.
TEST(FuzzCorpus, seeds_can_be_written) {
  const char* directory = std::getenv("SECTIO_FUZZ_SEEDS");
  if (directory == nullptr) GTEST_SKIP() << "SECTIO_FUZZ_SEEDS names no directory";
  write_seeds(std::string(directory) + "/corpus", seeds());
  write_seeds(std::string(directory) + "/files", file_seeds());
}

}  // namespace
}  // namespace sectio
