#include "common/delta/journal.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "tests/support/moving_world.h"
#include "tests/support/random.h"

namespace sectio::delta_test {
namespace {

using test::MovingWorld;

std::string path_of(const std::string& name) {
  return (std::filesystem::path(testing::TempDir()) / (name + std::to_string(getpid()))).string();
}

std::vector<char> read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_file(const std::string& path, const std::vector<char>& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Writes a journal of 50 changes; the world is in its final state afterwards.
void record(MovingWorld& world, const std::string& path) {
  JournalWriter writer(path, std::vector<JournalBody>{{"liver", world.mesh()}});
  for (int i = 0; i < 50; ++i)
    for (const BodyDelta& delta : world.step(true).deltas) writer.append(delta.body_id, delta.delta);
}

TEST(Keyframe, comes_back_bit_for_bit) {
  MovingWorld world;
  for (int i = 0; i < 20; ++i) world.step(true);
  const Keyframe keyframe = keyframe_of(world.mesh());
  const std::optional<Keyframe> back = keyframe_from_bytes(to_bytes(keyframe));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, keyframe);
  const std::optional<TriangleMesh> mesh = mesh_of(*back);
  ASSERT_TRUE(mesh);
  EXPECT_TRUE(mesh->same_database(world.mesh()));
  EXPECT_EQ(mesh->revision(), world.mesh().revision());
}

// A viewer that joins while a deformation has temporary elements gets them, and knows that they are temporary.
TEST(Keyframe, A_DEF_13_permanent_changes_wait_until_temporary_elements_are_gone) {
  TriangleMesh mesh = MovingWorld(0).mesh();
  const std::uint64_t hash = mesh.hash();
  TopologyDelta press = test::split_triangle(mesh, 0);
  press.temporary = true;
  const TopologyDelta lift = inverse(press, mesh);
  EXPECT_TRUE(lift.temporary);
  ASSERT_EQ(delta_from_bytes(to_bytes(press)), press);
  ASSERT_EQ(apply(press, mesh), ApplyStatus::applied);
  EXPECT_TRUE(mesh.has_temporary_elements());
  EXPECT_EQ(mesh.permanent_hash(), hash);

  std::optional<TriangleMesh> late = mesh_of(*keyframe_from_bytes(to_bytes(keyframe_of(mesh))));
  ASSERT_TRUE(late);
  for (TriangleMesh* m : {&mesh, &*late}) {
    EXPECT_EQ(apply(test::split_triangle(*m, 5), *m), ApplyStatus::malformed);
    ASSERT_EQ(apply(lift, *m), ApplyStatus::applied);
    EXPECT_FALSE(m->has_temporary_elements());
    EXPECT_EQ(m->hash(), hash);
    EXPECT_EQ(apply(test::split_triangle(*m, 5), *m), ApplyStatus::applied);
    EXPECT_FALSE(m->has_temporary_elements());
  }
}

TEST(Keyframe, damaged_ones_are_refused) {
  MovingWorld world(0);
  const std::vector<std::uint8_t> whole = to_bytes(keyframe_of(world.mesh()));
  test::Random random(5);
  for (int i = 0; i < 5000; ++i) {
    std::vector<std::uint8_t> bytes = whole;
    std::uint8_t& byte = bytes[random() % bytes.size()];
    byte = static_cast<std::uint8_t>(byte ^ (1 + random() % 255));
    if (random() % 5 == 0) bytes.resize(random() % bytes.size());
    std::optional<Keyframe> keyframe = keyframe_from_bytes(bytes);
    if (!keyframe) continue;
    const bool uncovered =
        keyframe->revision != world.mesh().revision() || keyframe->permanent_hash != world.mesh().permanent_hash();
    const std::optional<TriangleMesh> mesh = mesh_of(std::move(*keyframe));
    // Only revision and permanent hash aren't covered by the hash.
    EXPECT_TRUE(!mesh || (mesh->hash() == world.mesh().hash() && uncovered));
  }
}

TEST(Keyframe, sizes_that_lie_allocate_nothing) {
  std::vector<std::uint8_t> bytes = to_bytes(keyframe_of(MovingWorld(0).mesh()));
  for (std::size_t i = 8; i < 16; ++i) bytes[i] = 0xff;
  EXPECT_FALSE(keyframe_from_bytes(bytes));
}

TEST(Delta, comes_back_bit_for_bit) {
  MovingWorld world;
  for (int i = 0; i < 20; ++i)
    for (const BodyDelta& delta : world.step(true).deltas)
      EXPECT_EQ(delta_from_bytes(to_bytes(delta.delta)), delta.delta);
}

TEST(Journal, replays_to_the_same_hash) {
  MovingWorld world;
  const std::string path = path_of("journal");
  record(world, path);
  const std::vector<JournalBody> bodies = read_journal(path);
  ASSERT_EQ(bodies.size(), 1u);
  EXPECT_EQ(bodies[0].name, "liver");
  EXPECT_EQ(bodies[0].mesh.hash(), world.mesh().hash());
  EXPECT_EQ(bodies[0].mesh.revision(), world.mesh().revision());
  EXPECT_TRUE(bodies[0].mesh.same_database(world.mesh()));
  std::remove(path.c_str());
}

TEST(Journal, bodies_that_come_later_are_replayed_too) {
  MovingWorld world, part(1, 5);
  const std::string path = path_of("later");
  {
    JournalWriter writer(path, std::vector<JournalBody>{{"liver", world.mesh()}});
    for (const BodyDelta& delta : world.step(true).deltas) writer.append(0, delta.delta);
    writer.append({"liver.1", part.mesh()});
    for (const BodyDelta& delta : part.step(true).deltas) writer.append(1, delta.delta);
    writer.append({"liver.2", part.mesh()});
  }
  const std::vector<JournalBody> bodies = read_journal(path);
  ASSERT_EQ(bodies.size(), 3u);
  EXPECT_EQ(bodies[0].mesh.hash(), world.mesh().hash());
  EXPECT_EQ(bodies[1].name, "liver.1");
  EXPECT_EQ(bodies[1].mesh.hash(), part.mesh().hash());
  EXPECT_EQ(bodies[2].mesh.revision(), part.mesh().revision());
  std::remove(path.c_str());
}

TEST(Journal, of_each_scalar_field_the_last_values_come_back_beside_the_deltas) {
  MovingWorld world;
  const std::string path = path_of("scalars");
  ScalarField wet{"wetness", 0, 1, std::vector<float>(world.mesh().vertex_slots(), 0.25f)};
  {
    JournalWriter writer(path, std::vector<JournalBody>{{"liver", world.mesh()}});
    writer.append(JournalScalars{1, 0, wet});
    for (const BodyDelta& delta : world.step(true).deltas) writer.append(0, delta.delta);
    writer.append(JournalScalars{2, 0, {"temperature", 20, 90, {36.5f}}});
    wet.values.resize(world.mesh().vertex_slots(), 0.75f);
    writer.append(JournalScalars{3, 0, wet});
  }
  EXPECT_EQ(read_journal(path).at(0).mesh.hash(), world.mesh().hash());
  const std::vector<JournalScalars> scalars = read_scalars(path);
  ASSERT_EQ(scalars.size(), 2u);
  EXPECT_EQ(scalars[0].step, 3u);
  EXPECT_EQ(scalars[0].field, wet);
  EXPECT_EQ(scalars[1].field, (ScalarField{"temperature", 20, 90, {36.5f}}));

  JournalWriter(path, std::vector<JournalBody>{{"liver", world.mesh()}}).append(JournalScalars{1, 1, wet});
  EXPECT_THROW(read_scalars(path), InputError) << "of a body that there isn't";
  std::remove(path.c_str());
}

TEST(Journal, truncated_anywhere_is_an_input_error_that_names_the_byte_or_a_shorter_journal) {
  MovingWorld world(0);
  const std::string path = path_of("truncated");
  record(world, path);
  const std::vector<char> whole = read_file(path);
  int shorter = 0;
  for (std::size_t size = 0; size < whole.size(); size += 41) {
    write_file(path, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    try {
      read_journal(path);
      ++shorter;  // cut between two records
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("byte "), std::string::npos) << error.what();
    }
  }
  EXPECT_LT(shorter, 51);
  std::remove(path.c_str());
}

TEST(Journal, damaged_anywhere_is_an_input_error_that_names_the_place) {
  MovingWorld world(0);
  const std::string path = path_of("damaged");
  record(world, path);
  const std::vector<char> whole = read_file(path);
  const std::uint64_t hash = world.mesh().hash();
  test::Random random(11);
  for (int i = 0; i < 200; ++i) {
    std::vector<char> bytes = whole;
    char& byte = bytes[random() % bytes.size()];
    byte = static_cast<char>(byte ^ static_cast<char>(1 + random() % 255));
    write_file(path, bytes);
    try {
      const std::vector<JournalBody> bodies = read_journal(path);
      EXPECT_EQ(bodies.at(0).mesh.hash(), hash);  // the name was damaged
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind(path + ": ", 0), 0u) << error.what();
    }
  }
  std::remove(path.c_str());
}

TEST(Journal, without_a_file_is_an_input_error) {
  EXPECT_THROW(read_journal("/nonexistent/journal"), InputError);
  EXPECT_THROW(JournalWriter("/nonexistent/journal", {}), InputError);
}

}  // namespace
}  // namespace sectio::delta_test
