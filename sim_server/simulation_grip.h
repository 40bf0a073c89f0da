// What the jaws of one instrument hold: from closing about a loose piece to opening, or until it slips out. Part of
// simulation.*.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim_server/instruments/instrument.h"
#include "sim_server/simulation_rigid.h"
#include "sim_server/step_io.h"

namespace sectio {

class SimulationGrip {
 public:
  static constexpr std::size_t kPoints = 3;  // so that a piece also turns with the jaws

  explicit SimulationGrip(const ToolSpec& tool);

  // The instrument is at `pose`; appends kPoints grips while it holds something.
  void follow(const JointPose& pose, std::span<const std::unique_ptr<SimulationBody>> bodies, std::vector<Grip>& grips);
  bool holds(std::uint32_t body_id) const { return held_ == body_id; }
  const std::optional<std::uint32_t>& held() const { return held_; }

  // Of the last step that held something; for the caller to keep.
  Vec3 force_on_tool_n = Vec3::Zero();

 private:
  void close_about(const JointPose& pose, std::span<const std::unique_ptr<SimulationBody>> bodies);

  const InstrumentKind& instrument_;
  ToolGeometry geometry_;
  bool open_ = false;  // since when there is a pose
  std::optional<std::uint32_t> held_;
  std::array<Vec3, kPoints> at_piece_m_{};  // the points that are held, in the frame of the piece
};

}  // namespace sectio
