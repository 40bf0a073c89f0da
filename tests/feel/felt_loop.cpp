#include "tests/feel/felt_loop.h"

#include <cmath>
#include <deque>

#include "common/math/hash.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

// The simulation's end: a step for each tick, or several.
class Server {
 public:
  explicit Server(const Scene& scene, std::uint32_t tool = 0, bool is_late = false)
      : scene_(prepared(scene)),
        simulation_(scene_),
        tool_(tool),
        is_late_(is_late),
        steps_(std::max(1, static_cast<int>(std::lround(kTick_s / scene_.step_s)))) {
    scene_.tools[tool].trace.clear();
  }

  // `samples` of the hand; the other tools follow their traces. Null before the first sample.
  const ContactModel* tick(std::vector<ToolSample> samples) {
    for (int i = 0; i < steps_; ++i) {
      StepInput input;
      input.samples = samples_of_traces(scene_, ++step_);
      input.spare_idle_bodies = is_late_;
      input.samples.insert(input.samples.end(), samples.begin(), samples.end());
      samples.clear();
      for (const ContactModel& contact : simulation_.step(input).contacts)
        if (contact.tool_id == tool_) newest_ = contact, any_ = true;
    }
    return any_ ? &newest_ : nullptr;
  }

 private:
  Scene scene_;
  Simulation simulation_;
  std::uint32_t tool_;
  bool is_late_;
  int steps_;
  std::uint64_t step_ = 0;
  ContactModel newest_;
  bool any_ = false;
};

// Half of a wire: what is sent comes later, or never.
template <class Message>
class Way {
 public:
  Way(double delay_s, double loss, double jitter_s, std::uint64_t seed)
      : delay_s_(delay_s), loss_(loss), jitter_s_(jitter_s), seed_(seed) {}

  void send(double now_s, const Message& message) {
    if (uniform() < loss_) return;
    on_way_.push_back({now_s + delay_s_ + jitter_s_ * (2 * uniform() - 1), message});
  }
  // In the order of sending.
  std::vector<Message> take(double now_s) {
    std::vector<Message> came;
    for (; !on_way_.empty() && on_way_.front().first <= now_s + 1e-9; on_way_.pop_front())
      came.push_back(on_way_.front().second);
    return came;
  }

 private:
  double uniform() { return static_cast<double>(mix64(seed_ + ++draws_) >> 11) * 0x1p-53; }

  double delay_s_, loss_, jitter_s_;
  std::uint64_t seed_, draws_ = 0;
  std::deque<std::pair<double, Message>> on_way_;
};

ToolSample sample_of(const PoseSample& sample, std::uint32_t tool) {
  return {tool, sample.sequence, sample.tool_time_s, sample.pose_world, sample.opening_rad};
}

// The bridge's end.
struct Hand {
  Hand(const WireSpec& wire, const DeviceLimits& device, double way_back_s)
      : back(way_back_s, wire.loss, wire.jitter_s, wire.seed), servo(device) {}

  FeltTick tick(double now_s, const Pose& pose) {
    const std::vector<ContactModel> models = back.take(now_s);
    record = servo.tick(now_s, pose, models.empty() ? nullptr : &models.back());
    FeltTick tick{now_s, Vec3::Zero(), record.force_world_n, 0};
    if (!ticks.empty())
      tick.work_j = ticks.back().work_j + 0.5 * (ticks.back().felt_n + tick.felt_n).dot(pose.position_m - last_m);
    last_m = pose.position_m;
    ticks.push_back(tick);
    return tick;
  }

  Way<ContactModel> back;
  ServoState servo;
  ServoRecord record;
  Vec3 last_m = Vec3::Zero();
  std::vector<FeltTick> ticks;
};

}  // namespace

Scene felt_block(const std::string& model, double young_pa, const std::string& tool) {
  Scene scene;
  scene.file = "felt_block";
  scene.gravity_m_per_s2 = Vec3::Zero();
  BodySpec& body = scene.bodies.emplace_back();
  body.name = "block";
  body.model = model;
  body.mesh = box(12, 8, 6, Vec3(0.06, 0.04, kBlockTop_m));
  body.pose.position_m = Vec3(-0.03, -0.02, 0);
  body.volume.tetrahedra = 2000;
  if (model == "neo_hookean_lattice") body.options.values["cell_m"] = 0.005;
  body.material.young_pa = young_pa;
  body.material.poisson = 0.45;
  if (model == "surface_springs" && young_pa > 1e4) scene.step_s = 2e-4;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.001)};
  ToolSpec& spec = scene.tools.emplace_back();
  spec.name = spec.kind = tool;
  if (tool == "probe") {
    spec.geometry = instrument_of(tool).geometry;
    spec.geometry.sphere_radius_m = kBall_m;
  }
  return scene;
}

std::vector<std::vector<FeltTick>> felt_on_path(const Scene& scene, const Path& path, double duration_s,
                                                const std::vector<WireSpec>& wires, const DeviceLimits& device) {
  Server server(scene);
  std::vector<Hand> hands;
  for (const WireSpec& wire : wires) hands.emplace_back(wire, device, std::max(kTick_s, wire.delay_s));
  const auto ticks = static_cast<int>(std::lround(duration_s / kTick_s));
  for (int i = 0; i < ticks; ++i) {
    const double now_s = i * kTick_s;
    const Pose pose = path(now_s);
    for (Hand& hand : hands) hand.tick(now_s, pose);
    const ContactModel* model = server.tick({{0, static_cast<std::uint64_t>(i + 1), now_s, pose}});
    for (Hand& hand : hands) {
      hand.ticks.back().truth_n = model->force_world_n;
      hand.back.send(now_s, *model);
    }
  }
  std::vector<std::vector<FeltTick>> felt;
  for (Hand& hand : hands) felt.push_back(std::move(hand.ticks));
  return felt;
}

std::vector<FeltTick> felt_in_loop(const Scene& scene, const Path& wish, double duration_s, const WireSpec& wire,
                                   const HandSpec& hand_spec) {
  Scene led = scene;
  const auto ticks = static_cast<int>(std::lround(duration_s / kTick_s));
  for (int i = 0; i <= ticks; ++i) led.tools[0].trace.push_back({i * kTick_s, wish(i * kTick_s)});
  return felt_in_scene(led, 0, duration_s, wire, hand_spec);
}

std::vector<FeltTick> felt_in_scene(const Scene& scene, std::uint32_t tool, double duration_s, const WireSpec& wire,
                                    const HandSpec& hand_spec, bool is_late) {
  VirtualHand device(scene.tools[tool].trace, hand_spec);
  Server server(scene, tool, is_late);
  const auto ticks = static_cast<int>(std::lround(duration_s / kTick_s));
  Way<ToolSample> there(wire.delay_s / 2, 0, 0, wire.seed);
  Hand hand(wire, device.limits(), std::max(kTick_s, wire.delay_s / 2));
  for (int i = 0; i < ticks; ++i) {
    const double now_s = i * kTick_s;
    const FeltTick tick = hand.tick(now_s, device.pose_world(now_s));
    hand.record.sample.opening_rad = device.opening_rad(now_s);
    device.apply(tick.felt_n);
    there.send(now_s, sample_of(hand.record.sample, tool));
    if (const ContactModel* model = server.tick(there.take(now_s))) {
      hand.ticks.back().truth_n = model->force_world_n;
      hand.back.send(now_s, *model);
    }
  }
  return hand.ticks;
}

FeltError error_of(const std::vector<FeltTick>& ticks, double from_s) {
  double mean_n = 0, n = 0, error = 0, varies = 0, whole = 0, side = 0, all = 0;
  for (const FeltTick& t : ticks)
    if (t.time_s >= from_s) mean_n += t.truth_n.z(), ++n;
  mean_n /= n;
  for (const FeltTick& t : ticks) {
    if (t.time_s < from_s) continue;
    const Vec3 off_n = t.felt_n - t.truth_n;
    error += off_n.z() * off_n.z();
    varies += (t.truth_n.z() - mean_n) * (t.truth_n.z() - mean_n);
    whole += t.truth_n.z() * t.truth_n.z();
    side += off_n.head<2>().squaredNorm();
    all += t.truth_n.squaredNorm();
  }
  return {std::sqrt(error / varies), std::sqrt(error / whole), std::sqrt(side / all)};
}

FeltHold hold_of(const std::vector<FeltTick>& ticks, double from_s) {
  Vec3 mean = Vec3::Zero();
  double n = 0, ripple = 0, before_j = 0;
  for (const FeltTick& t : ticks) {
    if (t.time_s < from_s)
      before_j = t.work_j;
    else
      mean += t.felt_n, ++n;
  }
  mean /= n;
  for (const FeltTick& t : ticks)
    if (t.time_s >= from_s) ripple += (t.felt_n - mean).squaredNorm();
  return {std::sqrt(ripple / n), (ticks.back().work_j - before_j) / (n * kTick_s)};
}

double late_s(const std::vector<FeltTick>& ticks, double level_n) {
  double felt_s = 1e9, true_s = 1e9;
  for (const FeltTick& t : ticks) {
    if (felt_s == 1e9 && t.felt_n.z() > level_n) felt_s = t.time_s;
    if (true_s == 1e9 && t.truth_n.z() > level_n) true_s = t.time_s;
  }
  return felt_s - true_s;
}

}  // namespace sectio::test
