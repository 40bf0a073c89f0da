#include "render_client/page/live_view.h"

#include <cmath>
#include <set>
#include <utility>

#include "common/core/hand_silence.h"
#include "common/core/json_text.h"
#include "common/core/report_figures.h"
#include "common/messages/link.h"
#include "render_client/draw/tool_mesh.h"

namespace sectio {
namespace {

// Programs that move an instrument now; two of them are one too many.
std::uint64_t hands_on(const std::string& tool, std::span<const ServerStatus* const> statuses) {
  std::set<std::uint64_t> hands;
  for (const ServerStatus* status : statuses)
    for (const LinkReport& report : status->link_reports)
      if (report.kind == ProgramKind::hand && report.rate_hz > 0 && report.name == tool) hands.insert(report.client);
  return hands.size();
}

void describe_place(JsonText& json, const char* name, const Vec3& place) {
  json.key(name).open('[').value(place.x()).value(place.y()).close(']');
}

constexpr double kBack_s = 0.5;                   // servers of one session are less far apart
constexpr double kBusy_s = 0.8 * kWishSilence_s;  // soon after, the instrument is drawn out

}  // namespace

bool LiveView::snips(std::uint32_t tool_id) const {
  const SceneInfo* scene = session.world().scene();
  return scene && tool_id < scene->tools.size() && scene->tools[tool_id].kind.ends_with("scissors");
}

bool LiveView::tick(double now_s) {
  const double before_s = frame_.sim_time_s;
  const bool fresh = session.frame(now_s, frame_);
  if (fresh && frame_.sim_time_s < before_s - kBack_s) hand_.lift();               // other tissue is under it now
  if (now_s - std::exchange(ticked_s_, now_s) > kBusy_s) hand_.lift(), pad_ = {};  // its instrument is out by now
  if (fresh && first_view_ != session.world().scene()->camera) {
    first_view_ = session.world().scene()->camera;
    camera_ = OrbitCamera(*first_view_);
  }
  if (camera_) frame_.camera = camera_->camera();
  const std::optional<std::uint32_t> held = session.held_tool();
  if (held != held_) {
    hand_ = MouseHand(held && snips(*held) ? MouseHand::kSnip_rad : MouseHand::kWidest_rad);
    pad_ = {};
    pad_leads_ = false;
  }
  held_ = held;
  const bool is_halted = held_ && is_frozen(frozen_tools(), *held_);
  if (std::exchange(was_halted_, is_halted) && !is_halted) hand_.lift();  // it came into the scene anew
  hand_.tick(now_s);
  if (held_ && pad_leads_) pad_.tick(now_s, instrument(), camera_->camera());
  if (held_) hold(now_s);
  const bool draw = camera_ && (fresh || moved_);
  moved_ = false;
  pictures_ += draw ? 1 : 0;
  return draw;
}

// Until the pointer has been over tissue there is nothing to wish, but the hand isn't silent.
void LiveView::hold(double now_s) {
  if (const auto pose = wish()) return session.wish(*held_, *pose);
  if (now_s - claimed_s_ < kStillThere_s) return;
  claimed_s_ = now_s;
  session.claim({*held_, ClaimAction::claim});
}

std::optional<JointPose> LiveView::instrument() const {
  if (!held_ || *held_ >= frame_.tools.size() || !frame_.tools[*held_].present) return std::nullopt;
  return frame_.tools[*held_].pose_world;
}

std::optional<JointPose> LiveView::wish() const {
  if (headset_) return headset_->wish();
  return pad_leads_ ? pad_.wish() : hand_.wish();
}

void LiveView::wear_headset(bool on) {
  headset_.reset();
  if (on && camera_) headset_.emplace(camera_->camera());
  redraw();
}

void LiveView::push_pad(const PadState& state) {
  if (!camera_ || !held_) return;
  if (state.moves() && !pad_leads_) pad_ = {};
  pad_leads_ = pad_leads_ || state.moves();
  pad_.push(state);
}

void LiveView::point(double x, double y, bool pressed, bool closes) {
  if (!camera_ || !held_) return;
  const Ray ray = camera_->ray(x, y, aspect_);
  const Vec3 right = (camera_->ray(1, y, aspect_).along_world - camera_->ray(-1, y, aspect_).along_world).normalized();
  pad_leads_ = false;
  hand_.point({ray, pressed, closes}, frame_, right);
}

void LiveView::orbit(double right_rad, double up_rad) {
  if (!camera_) return;
  camera_->orbit(right_rad, up_rad);
  move_camera();
}

void LiveView::pan(double right, double up) {
  if (!camera_) return;
  camera_->pan(right, up);
  move_camera();
}

void LiveView::set_section(bool on, double nearer_m) {
  if (!camera_) return;
  if (!on) {
    section_.reset();
  } else if (!section_) {
    section_ = section_at_target(camera_->camera());
    section_nearer_m_ = 0;
  }
  if (section_) section_->point_world_m += (nearer_m - section_nearer_m_) * section_->normal_world;
  section_nearer_m_ = nearer_m;
  move_camera();
}

void LiveView::zoom(double factor) {
  if (!camera_) return;
  camera_->zoom(factor);
  move_camera();
}

void LiveView::reset_camera() {
  if (!camera_ || !session.world().scene()) return;
  camera_ = OrbitCamera(session.world().scene()->camera);
  move_camera();
}

void LiveView::describe_score(JsonText& json) const {
  json.key("score_lines_heard").value(session.score_lines_heard()).key("score").open('[');
  for (const std::string& line : session.score()) json.value(line);
  json.close(']').key("task").open('[');
  for (const std::string& line : session.task()) json.value(line);
  json.close(']').key("fields").open('[');
  std::set<std::string> names;
  for (const BodyFrame& body : frame_.bodies)
    for (const ScalarField& scalar : body.scalars) names.insert(scalar.name);
  for (const std::string& name : names) json.value(name);
  json.close(']');
}

// Cuts are those of all servers; speed and tilt are the same everywhere, and programs report to each.
void LiveView::describe_statuses(JsonText& json, std::span<const ServerStatus* const> statuses) const {
  std::uint64_t cuts = 0, refused = 0;
  std::set<std::string> links;
  for (const ServerStatus* status : statuses) {
    cuts += status->cuts_made;
    refused += status->cuts_refused;
    for (const LinkReport& report : status->link_reports) links.insert(line_of(report));
  }
  if (!statuses.empty()) {
    const Vec3& down = statuses.front()->gravity_target_m_per_s2;
    json.key("cuts").value(cuts).key("refused").value(refused).key("speed").value(statuses.front()->speed);
    if (statuses.front()->ends_s > 0) json.key("ends_s").value(statuses.front()->ends_s);
    json.key("tilt_deg").value(down.norm() > 0 ? std::atan2(down.x(), -down.z()) * 180 / M_PI : 0);
  }
  json.key("links").open('[');
  for (const std::string& line : links) json.value(line);
  json.close(']');
}

void LiveView::describe_people(JsonText& json) const {
  json.key("you").value(session.roster().you).key("people").open('[');
  for (const Person& p : session.roster().people) {
    json.open('{').key("id").value(p.id).key("name").value(p.name);
    json.key("may_write").value(p.may_write).key("may_lead").value(p.may_lead).close('}');
  }
  json.close(']');
}

std::uint32_t LiveView::frozen_tools() const {
  std::uint32_t frozen = 0;
  for (const ServerStatus* status : session.statuses()) frozen |= status->frozen_tools;
  return frozen;
}

void LiveView::describe_tools(JsonText& json, std::span<const ServerStatus* const> statuses, double now_s) const {
  const std::uint32_t frozen = frozen_tools();
  const Roster& roster = session.roster();
  const SceneInfo* scene = session.world().scene();
  json.key("tools").open('[');
  for (std::uint32_t t = 0; scene && t < scene->tools.size(); ++t) {
    const JointPose* pose = t < frame_.tools.size() && frame_.tools[t].present ? &frame_.tools[t].pose_world : nullptr;
    json.open('{').key("name").value(scene->tools[t].name).key("present").value(pose != nullptr);
    json.key("has_jaws").value(has_jaws(scene->tools[t].kind));
    json.key("holder").value(t < roster.holders.size() ? roster.holders[t] : kNobody);
    json.key("frozen").value(is_frozen(frozen, t));
    json.key("hands").value(hands_on(scene->tools[t].name, statuses));
    json.key("force_n").value(pose ? session.force_n(t, now_s) : 0.0);
    if (pose) {
      const Vec3& at = pose->position_m;
      json.key("at_m").open('[').value(at.x()).value(at.y()).value(at.z()).close(']');
      describe_place(json, "tip", camera_->project(at, aspect_));
    }
    json.close('}');
  }
  json.close(']');
}

void LiveView::describe_bodies(JsonText& json) const {
  const std::vector<const ReplicaBody*> bodies = session.world().bodies();
  const std::vector<std::string> names = session.world().body_names();
  const std::vector<Equality::OfBody> equality = session.equality();
  json.key("bodies").open('[');
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const TriangleMesh& mesh = bodies[b]->mesh();
    json.open('{').key("name").value(names[b]).key("revision").value(mesh.revision());
    json.key("hash").value(hash_text(mesh.hash())).key("equal");
    if (equality[b].equal)
      json.value(*equality[b].equal);
    else
      json.null();
    json.close('}');
  }
  json.close(']');
}

void LiveView::describe_lines(JsonText& json) const {
  json.key("lines").open('[');
  for (const LiveSession::Line& line : session.lines()) {
    json.open('{').key("number").value(line.number).key("text").value(line.text);
    json.key("count").value(line.count);
    if (line.time_s) json.key("time_s").value(*line.time_s);
    json.close('}');
  }
  json.close(']');
}

void LiveView::describe_hand(JsonText& json) const {
  const std::optional<JointPose> wanted = wish();
  json.key("held");
  if (held_)
    json.value(*held_);
  else
    json.null();
  json.key("depth_m").value(hand_.depth_m());
  json.key("presses_beside").value(hand_.presses_beside());
  json.key("lifted").value(hand_.waits_for_button());
  json.key("pad").value(pad_leads_).key("headset").value(headset_.has_value());
  if (held_ && wanted && camera_) describe_place(json, "wish", camera_->project(wanted->position_m, aspect_));
}

std::string LiveView::describe(double now_s) const {
  JsonText json;
  json.open('{');
  json.key("session").value(frame_.session).key("time_s").value(frame_.sim_time_s);
  json.key("step").value(frame_.step).key("pictures").value(pictures_);
  json.key("silent_s");
  const auto silence = session.silence(now_s);
  if (silence)
    json.value(silence->for_s);
  else
    json.null();
  json.key("silent").value(silence ? silence->of : "");
  json.key("ended").value(session.world().session_end().has_value());
  const std::vector<const ServerStatus*> statuses = session.statuses();
  describe_people(json);
  describe_tools(json, statuses, now_s);
  describe_bodies(json);
  describe_lines(json);
  describe_statuses(json, statuses);
  describe_score(json);
  describe_hand(json);
  json.key("damaged").value(session.damaged());
  return json.close('}').text();
}

}  // namespace sectio
