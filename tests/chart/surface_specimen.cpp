#include "tests/chart/surface_specimen.h"

#include "sim_server/deformation/surface_springs.h"
#include "tests/support/shapes.h"
#include "tests/support/tet_shapes.h"

namespace sectio::chart {
namespace {

class SurfaceSpecimen final : public Specimen {
 public:
  SurfaceSpecimen(const ChartScene& scene, int across, double step_s)
      : scene_(scene), mesh_(surface_of_box(scene, across)), step_s_(step_s), springs_(make()) {
    for (VertexId v = 0; v < mesh_.vertex_slots(); ++v) {
      x_.push_back(Vec4f::Zero());
      x_.back().head<3>() = mesh_.rest_body_m(v).cast<float>();
      if (mesh_.rest_body_m(v).z() > scene.size_m.z() - 1e-9) top_.push_back(v);
    }
    v_.assign(x_.size(), Vec4f::Zero());
  }

  void step(double to_s) override {
    constraints_.clear();
    add_contacts(scene_, scene_.share(to_s), 2e-4, top_, x_, constraints_);
    reactions_.resize(constraints_.size());
    springs_.step(x_, v_, constraints_, reactions_);
    force_n_ = 0;
    for (const Reaction& r : reactions_) force_n_ += r.force_on_tool_n.z();
  }
  double step_s() const override { return step_s_; }
  std::vector<double> answer() override { return {force_n_}; }
  std::size_t elements() const override { return mesh_.vertex_slots(); }

 private:
  static TriangleMesh surface_of_box(const ChartScene& s, int n) {
    const auto& c = s.cells_per_across;
    return TriangleMesh(surface_of(test::tet_box(n * c[0], n * c[1], n * c[2], s.size_m)).soup);
  }
  SurfaceSprings make() const {
    SurfaceSpringMaterial material;
    material.young_pa = scene_.young_pa;
    material.poisson = scene_.poisson;
    material.density_kg_per_m3 = scene_.density_kg_per_m3;
    material.damping_per_s = scene_.damping_per_s;
    material.foundation_radius_m = std::sqrt(scene_.ball->radius_m * scene_.ball->depth_m);  // the contact's radius
    SurfaceSpringSettings settings;
    settings.step_s = step_s_;
    settings.gravity_m_per_s2.setZero();
    settings.fixed = scene_.held;
    return {mesh_, Pose{}, material, settings};
  }

  const ChartScene& scene_;
  TriangleMesh mesh_;
  double step_s_;
  SurfaceSprings springs_;
  std::vector<Vec4f> x_, v_;
  std::vector<VertexId> top_;
  std::vector<PointConstraint> constraints_;
  std::vector<Reaction> reactions_;
  double force_n_ = 0;
};

}  // namespace

std::unique_ptr<Specimen> surface_specimen(const ChartScene& scene, int across, double step_s) {
  return std::make_unique<SurfaceSpecimen>(scene, across, step_s);
}

}  // namespace sectio::chart
