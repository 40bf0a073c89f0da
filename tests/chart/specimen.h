// A body of a chart scene in the hands of one method: it is loaded, stepped, and asked for the scene's answer.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sim_server/deformation/tetra/volume_model.h"
#include "tests/chart/scene.h"

namespace sectio::chart {

class Specimen {
 public:
  virtual ~Specimen() = default;
  virtual void step(double to_s) = 0;  // by step_s(), up to this time of the scene
  virtual double step_s() const = 0;
  virtual std::vector<double> answer() = 0;  // now
  virtual std::size_t elements() const = 0;
};

// The meshes of the chart: those that a scene gives a body, and a lattice that fits the box by hand.
constexpr char kOfScene[] = "scene", kByHand[] = "by hand";

// One way to simulate a scene: model, driver, step, mesh; the chart goes through resolutions n. Nothing when this
// method makes no claim on the scene or the resolution.
struct Method {
  std::string model, driver, mesh;
  std::function<std::unique_ptr<Specimen>(const ChartScene& scene, int across)> make;
  bool is_ours = true;
};

std::vector<Method> methods(bool quick);

// The ball pushes the vertices that are no further than `reach_m` from its surface out to it.
void add_contacts(const ChartScene& scene, double share, double reach_m, std::span<const VertexId> vertices,
                  std::span<const Vec4f> position_m, std::vector<PointConstraint>& constraints);

}  // namespace sectio::chart
