#include "sim_server/net/state_encoder.h"

#include <algorithm>
#include <cstdlib>

#include "common/core/log.h"
#include "common/messages/state_fields.h"
#include "common/messages/validate.h"

namespace sectio {

void StateEncoder::changed(std::uint32_t body_id, const TopologyDelta& delta) {
  Body::Change change{delta.revision, {}};
  for (const VertexEdit& edit : delta.vertices) {
    const std::uint32_t piece = edit.id / kVerticesPerPiece;
    if (edit.alive && (change.pieces.empty() || change.pieces.back() != piece)) change.pieces.push_back(piece);
  }
  if (!change.pieces.empty()) bodies_[body_id].changes.push_back(std::move(change));
}

void StateEncoder::refresh(std::uint32_t body_id) {
  for (std::uint8_t& repeat : bodies_[body_id].repeat) repeat = std::max<std::uint8_t>(repeat, 1);
}

void StateEncoder::encode(const StateSnapshot& snapshot, bool whole) {
  ++frame_;
  refreshed_ = refreshing_ = 0;
  used_ = 0;
  scalar_pieces_.clear();
  header_.epoch = epoch_;
  header_.step = snapshot.step;
  header_.sim_time_s = static_cast<double>(snapshot.step) * step_s_;
  header_.step_wall_time_s = snapshot.step_wall_time_s;
  header_.in_contact = snapshot.in_contact;
  header_.gravity_m_per_s2 = snapshot.gravity_m_per_s2;
  header_.tools = snapshot.tools;
  header_.bodies.resize(bodies_.size());
  for (std::uint32_t b = 0; b < bodies_.size(); ++b) encode_body(b, snapshot, whole);
}

void StateEncoder::encode_body(std::uint32_t body_id, const StateSnapshot& snapshot, bool whole) {
  Body& body = bodies_[body_id];
  const StateSnapshot::Body& state = snapshot.bodies[body_id];
  const auto slots = static_cast<std::uint32_t>(state.positions_world_m.size());
  const std::uint32_t pieces = piece_count(slots);
  BodyState& named = header_.bodies[body_id];
  named.revision = state.revision;
  named.vertex_slots = slots;
  named.pieces_sent.assign((pieces + 7) / 8, 0);

  body.repeat.resize(pieces, 1);
  body.sent.reserve(slots);
  for (std::size_t v = body.sent.size(); v < slots; ++v) {  // not sent yet: its piece is in the refresh, or has changed
    body.sent.push_back(GridPoint{});
    static_cast<void>(to_grid(state.positions_world_m[v], body.sent.back()));
  }
  for (; !body.changes.empty() && body.changes.front().revision <= state.revision; body.changes.pop_front())
    for (const std::uint32_t piece : body.changes.front().pieces)
      if (piece < pieces) body.repeat[piece] = kRepeats;

  in_turn_.assign(pieces, 0);
  for (std::uint32_t p = 0; p < pieces; ++p) {
    const std::uint32_t first = p * kVerticesPerPiece;
    const std::uint32_t count = std::min(kVerticesPerPiece, slots - first);
    now_.assign(body.sent.begin() + first, body.sent.begin() + first + count);
    for (std::uint32_t i = 0; i < count; ++i)
      if (!to_grid(state.positions_world_m[first + i], now_[i])) continue;  // stays where it was last sent
    const bool refreshes = body.repeat[p] == 1 && !whole;
    const bool is_forced = body.repeat[p] > 0 && (!refreshes || refreshed_ < fineness_.most_refreshed);
    in_turn_[p] = whole || is_forced || (frame_ + p) % fineness_.frames_per_refresh == 0;
    if (!in_turn_[p] && !moved(body, first)) {
      refreshing_ += refreshes;
      continue;
    }
    refreshed_ += refreshes;

    if (body.repeat[p] > 0) --body.repeat[p];
    std::copy(now_.begin(), now_.end(), body.sent.begin() + first);
    named.mark_sent(p);
    StatePiece& piece = next_piece();
    piece.epoch = epoch_;
    piece.step = snapshot.step;
    piece.revision = state.revision;
    piece.body_id = body_id;
    piece.piece = p;
    encode_positions(now_, piece);
  }
  encode_scalars(body_id, snapshot, in_turn_);
}

void StateEncoder::encode_scalars(std::uint32_t body_id, const StateSnapshot& snapshot,
                                  std::span<const std::uint8_t> in_turn) {
  const StateSnapshot::Body& state = snapshot.bodies[body_id];
  std::vector<std::string>& named = header_.bodies[body_id].scalars;
  std::vector<SentScalar>& sent = bodies_[body_id].scalars;
  named.clear();
  for (const ScalarField& field : state.scalars) {
    const bool twice = std::ranges::find(named, field.name) != named.end();
    if (const std::string flaw = first_flaw(field); !flaw.empty() || twice || named.size() == kMaxScalars) {
      log_limited(LogLevel::warning, "scalar",
                  "a scalar field can't be sent to viewers: " + (!flaw.empty() ? flaw
                                                                 : twice       ? "two have one name"
                                                                               : "a body has too many"));
      continue;
    }
    named.push_back(field.name);
    auto known = std::ranges::find(sent, field.name, &SentScalar::name);
    if (known == sent.end()) known = sent.insert(sent.end(), {field.name, 0, 0, {}, {}});
    encode_scalar(field, *known, {header_.epoch, header_.step, state.revision, body_id, 0, {}, 0, 0, {}}, in_turn);
  }
  std::erase_if(sent, [&](const SentScalar& each) { return std::ranges::find(named, each.name) == named.end(); });
}

void StateEncoder::encode_scalar(const ScalarField& field, SentScalar& sent, ScalarPiece head,
                                 std::span<const std::uint8_t> in_turn) {
  if (sent.least != field.least || sent.most != field.most) sent = {field.name, field.least, field.most, {}, {}};
  sent.sent.resize(in_turn.size(), false);
  sent.levels.resize(field.values.size(), 0);
  head.name = field.name;
  head.least = field.least;
  head.most = field.most;
  for (std::uint32_t p = 0; p < in_turn.size(); ++p) {
    const std::size_t first = std::size_t{p} * kVerticesPerPiece;
    const std::size_t end = std::min(first + kVerticesPerPiece, field.values.size());
    head.levels.clear();
    bool changed = !sent.sent[p];
    for (std::size_t v = first; v < end; ++v) {
      head.levels.push_back(to_level(field.values[v], field.least, field.most));
      changed = changed || std::abs(int{head.levels.back()} - int{sent.levels[v]}) > kScalarStep;
    }
    if (head.levels.empty() || !(changed || in_turn[p] != 0)) continue;
    std::ranges::copy(head.levels, sent.levels.begin() + static_cast<std::ptrdiff_t>(first));
    sent.sent[p] = true;
    head.piece = p;
    scalar_pieces_.push_back(head);
  }
}

bool StateEncoder::moved(const Body& body, std::uint32_t first) const {
  for (std::uint32_t i = 0; i < now_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      if (std::abs(now_[i][k] - body.sent[first + i][k]) > fineness_.least_motion_quanta) return true;
  return false;
}

StatePiece& StateEncoder::next_piece() {
  if (used_ == pieces_.size()) pieces_.emplace_back();
  return pieces_[used_++];
}

}  // namespace sectio
