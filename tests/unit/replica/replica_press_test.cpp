// Temporary elements of a contact (paper A, 2.2) as a viewer gets them: from the real simulation, over the wire's
// messages, from the beginning, late, and with losses.
#include <gtest/gtest.h>

#include "common/delta/keyframe.h"
#include "render_client/replica/replica.h"
#include "sim_server/net/state_encoder.h"
#include "sim_server/net/world_view.h"
#include "tests/support/operation.h"
#include "tests/support/random.h"

namespace sectio::test {
namespace {

constexpr std::uint64_t kEpoch = 3;
constexpr std::uint64_t kStepsAFrame = 16;

Scene probed_scene() {
  Scene scene = organ_scene();
  scene.bodies[0].contact.style = "templates";
  scene.tools[0].kind = "probe";
  scene.tools[0].geometry = instrument_of("probe").geometry;
  return scene;
}

class Viewers {
 public:
  explicit Viewers(Operation& op)
      : op_(op), encoder_(kEpoch, op.scene.step_s, 1), before_(op.mesh()), always(viewer()), losing(viewer()) {
    op.after_each = [this](const StepOutput& out) { follow(out); };
  }

  Replica viewer() {
    SceneInfo info = scene_info(op_.scene);
    info.epoch = kEpoch;
    Replica replica;
    replica.reset(info);
    replica.feed_keyframe(kEpoch, 0, to_bytes(keyframe_of(op_.mesh())));
    encoder_.refresh(0);
    return replica;
  }
  void join_late() { late = viewer(); }

  void expect_original(Replica& replica) {
    const BodyVersion version = replica.catch_up().at(0);
    EXPECT_EQ(version.topology_hash, before_.hash());
    EXPECT_TRUE(replica.bodies()[0].mesh().same_database(before_));
    EXPECT_FALSE(replica.bodies()[0].mesh().has_temporary_elements());
    EXPECT_EQ(replica.counts().hash_mismatches, 0u);
  }

 private:
  void follow(const StepOutput& out) {
    for (const BodyDelta& d : out.deltas) {
      encoder_.changed(0, d.delta);
      always.feed(DeltaMessage{kEpoch, 0, d.delta});
      if (random_() % 4 != 0) losing.feed(DeltaMessage{kEpoch, 0, d.delta});
      if (late) late->feed(DeltaMessage{kEpoch, 0, d.delta});
    }
    if (out.step % kStepsAFrame != 0) return;
    const auto positions = op_.simulation.positions_world_m(0);
    StateSnapshot snapshot;
    snapshot.step = out.step;
    snapshot.bodies = {{op_.mesh().revision(), {positions.begin(), positions.end()}}};
    snapshot.tools = {{true, *op_.simulation.tool_pose_world(0)}};
    encoder_.encode(snapshot);
    for (Replica* replica : {&always, &losing, late ? &*late : nullptr}) {
      if (!replica) continue;
      replica->feed(encoder_.header());
      for (const StatePiece& piece : encoder_.pieces()) replica->feed(piece);
      Frame frame;
      const bool drawn = replica->frame(out.sim_time_s, frame);
      if (replica == &always && out.step > 2 * kStepsAFrame) {
        EXPECT_TRUE(drawn) << out.step;
      }
      if (!replica->take_requests(out.sim_time_s).empty()) {
        replica->feed_keyframe(kEpoch, 0, to_bytes(keyframe_of(op_.mesh())));
        encoder_.refresh(0);
      }
    }
  }

  Operation& op_;
  StateEncoder encoder_;
  const TriangleMesh before_;
  test::Random random_{11};

 public:
  Replica always, losing;
  std::optional<Replica> late;
};

TEST(A_DEF, A_DEF_8_viewers_get_the_original_back_whenever_they_join_and_whatever_is_lost) {
  Operation op(probed_scene());
  Viewers viewers(op);
  op.place({0.003, 0.002, kOrganTop_m + 0.003});
  op.tip_to(0.003, 0.002, 0.004);
  ASSERT_TRUE(op.mesh().has_temporary_elements());
  viewers.join_late();
  op.tip_to(-0.012, 0.009, 0.004);
  EXPECT_EQ(viewers.always.catch_up().at(0).topology_hash, op.mesh().hash());
  EXPECT_EQ(viewers.late->catch_up().at(0).topology_hash, op.mesh().hash());
  EXPECT_TRUE(viewers.late->bodies()[0].mesh().has_temporary_elements());
  op.move(op.hand().position_m + Vec3(0, 0, 0.03), 0.1);
  for (int i = 0; i < 3000 && op.mesh().has_temporary_elements(); ++i) op.rest(1);
  op.rest(1000);  // until whoever lost something has asked
  for (Replica* replica : {&viewers.always, &viewers.losing, &*viewers.late}) viewers.expect_original(*replica);
  EXPECT_EQ(viewers.always.counts().resyncs, 0u);
  EXPECT_GT(viewers.losing.counts().resyncs, 0u);
}

}  // namespace
}  // namespace sectio::test
