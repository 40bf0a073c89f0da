#include "sim_server/prepare/kept_plans.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/math/hash.h"
#include "sim_server/prepare/cache_folder.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

constexpr char kFirstLineOfPlan[] = "sectio plan 1", kEndOfPlan[] = "end";
constexpr std::size_t kMostFiles = 200, kMostBodies = 1000, kMostTable_bytes = 1'000'000;

// Everything in the order in which it comes.
class Hash {
 public:
  void add(std::uint64_t value) { hash_ = hash_combine(hash_, value); }
  void add(double value) { hash_ = hash_combine(hash_, value); }
  void add(const std::string& text) {
    add(std::uint64_t{text.size()});
    for (const char c : text) add(std::uint64_t{static_cast<unsigned char>(c)});
  }
  void add(const Vec3& v) { add(v.x()), add(v.y()), add(v.z()); }
  void add(const Pose& pose) {
    add(pose.position_m);
    for (const double c : pose.orientation.coeffs()) add(c);
  }
  void add(const std::optional<double>& value) {
    add(std::uint64_t{value.has_value()});
    if (value) add(*value);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0;
};

// A file by its place, size and time of change.
void add_file(Hash& hash, const std::string& path) {
  std::error_code error;
  const fs::path file = fs::canonical(path, error);
  hash.add(file.string());
  if (error) return;
  hash.add(std::uint64_t{fs::file_size(file, error)});
  hash.add(static_cast<std::uint64_t>(fs::last_write_time(file, error).time_since_epoch().count()));
}

void add_mesh(Hash& hash, const TriangleSoup& mesh) {
  hash.add(std::uint64_t{mesh.vertices_body_m.size()});
  for (const Vec3& p : mesh.vertices_body_m) hash.add(p);
  hash.add(std::uint64_t{mesh.triangles.size()});
  for (const auto& triangle : mesh.triangles)
    for (const VertexId v : triangle) hash.add(std::uint64_t{v});
}

void add_material(Hash& hash, const MaterialSpec& m) {
  for (const double x : {m.young_pa, m.poisson, m.density_kg_per_m3, m.skin_thickness_m, m.foundation_radius_m,
                         m.pretension, m.damping_per_s, m.toughness_j_per_m2, m.friction})
    hash.add(x);
}

void add_regions(Hash& hash, const Regions& regions) {
  for (const Region& region : regions) {
    hash.add(region.name);
    for (const double x : {region.rim_m, region.ripple_m, region.stiffness_factor}) hash.add(x);
    for (const RegionPart& part : region.parts) {
      hash.add(static_cast<std::uint64_t>(part.form));
      hash.add(part.a_m), hash.add(part.b_m), hash.add(part.radius_a_m), hash.add(part.radius_b_m);
      hash.add(Pose{Vec3::Zero(), part.orientation});
    }
  }
}

void add_options(Hash& hash, const Options& options) {
  for (const auto& [key, value] : options.values) {
    hash.add(key);
    std::visit(
        [&](const auto& v) {
          using T = std::decay_t<decltype(v)>;
          if constexpr (std::is_same_v<T, bool>)
            hash.add(std::uint64_t{v});
          else if constexpr (!std::is_same_v<T, std::monostate>)
            hash.add(v);
        },
        value);
  }
}

void add_body(Hash& hash, const BodySpec& body) {
  hash.add(body.name), hash.add(body.model), hash.add(body.pose);
  add_options(hash, body.options);
  add_mesh(hash, body.mesh);
  add_material(hash, body.material);
  add_regions(hash, body.regions);
  const VolumeSpec& v = body.volume;
  hash.add(v.mesher), hash.add(v.driver);
  for (const double x : {v.tetrahedra, v.cell_m, v.file_unit_m, v.second_share, v.damper_s, v.floor_kept_velocity,
                         v.least_part_s, v.collapse_ratio})
    hash.add(x);
  if (!v.file.empty()) add_file(hash, v.file);
  const CuttingSpec& c = body.cutting;
  hash.add(c.style), hash.add(c.threshold_force_n), hash.add(c.threshold_displacement_m);
  for (const double x : {c.open_top_m, c.open_bottom_m, c.hysteresis, c.join_tolerance_m, c.groove_min_depth_m,
                         c.snap_ratio, c.loops_free_islands ? 1.0 : 0.0})
    hash.add(x);
  hash.add(body.contact.style);
  hash.add(static_cast<std::uint64_t>(body.splitting.free_parts));
  hash.add(body.splitting.least_volume_m3), hash.add(body.splitting.friction);
  hash.add(std::uint64_t{body.fixed.has_value()});
  if (body.fixed) hash.add(body.fixed->min_world_m), hash.add(body.fixed->max_world_m);
  hash.add(body.plan.error_budget), hash.add(body.plan.cpu_budget);
}

void add_tool(Hash& hash, const ToolSpec& tool) {
  hash.add(tool.name), hash.add(tool.kind), hash.add(tool.intensity);
  hash.add(tool.grip_force_n), hash.add(tool.grip_radius_m);
  const ToolGeometry& g = tool.geometry;
  for (const Vec3& corner_m : {g.a_tool_m, g.b_tool_m, g.c_tool_m, g.d_tool_m}) hash.add(corner_m);
  for (const double x : {g.sharp_length_m, g.gauge_m, g.sphere_radius_m}) hash.add(x);
  hash.add(std::uint64_t{tool.trace.size()});
  for (const TracePoint& at : tool.trace) hash.add(at.time_s), hash.add(at.pose_world), hash.add(at.opening_rad);
}

void add_laws(Hash& hash, const std::vector<planning::LoadLaw>& laws) {
  for (const planning::LoadLaw& law : laws) {
    hash.add(static_cast<std::uint64_t>(law.load));
    for (const double x : {law.law.c, law.law.p, law.law.floor}) hash.add(x);
  }
}

void add_method(Hash& hash, const planning::Method& method) {
  hash.add(method.name), hash.add(method.model);
  for (const std::uint64_t x : {static_cast<std::uint64_t>(method.elements), std::uint64_t{method.is_implicit},
                                std::uint64_t{method.is_of_springs}, static_cast<std::uint64_t>(method.most_parts)})
    hash.add(x);
  add_laws(hash, method.laws);
  add_laws(hash, method.laws_of_partly_empty);
}

fs::path plans_folder() {
  const fs::path cache = cache_folder();
  return cache.empty() ? cache : cache / "plans";
}

std::string hex(std::uint64_t key) {
  return formatted("%016llx", static_cast<unsigned long long>(key));
}

fs::path file_of(std::uint64_t key) {
  return plans_folder() / (hex(key) + ".txt");
}

// The oldest go.
void tidy_up() {
  std::error_code error;
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(plans_folder(), error))
    if (entry.path().extension() == ".txt") files.emplace_back(entry.last_write_time(error), entry.path());
  if (files.size() <= kMostFiles) return;
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i + kMostFiles < files.size(); ++i) fs::remove(files[i].second, error);
}

}  // namespace

std::uint64_t plan_key(const Scene& scene, std::span<const planning::Method> methods, const std::string& calibration) {
  Hash hash;
  hash.add(std::string(kFirstLineOfPlan));
  add_file(hash, "/proc/self/exe");
  hash.add(calibration);
  for (const planning::Method& method : methods) add_method(hash, method);
  hash.add(scene.step_s), hash.add(std::uint64_t{scene.step_is_free});
  hash.add(scene.gravity_m_per_s2), hash.add(scene.floor_z_m);
  for (const GravityChange& change : scene.gravity_changes) hash.add(change.at_s), hash.add(change.gravity_m_per_s2);
  for (const BodySpec& body : scene.bodies) add_body(hash, body);
  for (const ToolSpec& tool : scene.tools) add_tool(hash, tool);
  return hash.value();
}

std::string to_text(const KeptPlan& plan, std::uint64_t key) {
  std::ostringstream out;
  out.precision(17);
  out << kFirstLineOfPlan << "\n" << hex(key) << "\n" << plan.choices.size() << " " << plan.table.size() << "\n";
  for (const KeptChoice& c : plan.choices)
    out << c.method << " " << c.step_s << " " << c.cell_m << " " << c.tetrahedra << " " << c.error << " " << c.cpu
        << " " << c.cut_cpu << " " << c.cut_step_s << "\n";
  out << plan.table << kEndOfPlan << "\n";
  return out.str();
}

std::optional<KeptPlan> plan_from(const std::string& text, std::uint64_t key) {
  std::istringstream in(text);
  std::string first, of;
  std::size_t bodies = 0, table_bytes = 0;
  if (!std::getline(in, first) || first != kFirstLineOfPlan || !std::getline(in, of) || of != hex(key))
    return std::nullopt;
  if (!(in >> bodies >> table_bytes) || bodies > kMostBodies || table_bytes > kMostTable_bytes) return std::nullopt;
  KeptPlan plan;
  plan.choices.resize(bodies);
  for (KeptChoice& c : plan.choices) {
    if (!(in >> c.method)) return std::nullopt;
    for (double* x : {&c.step_s, &c.cell_m, &c.tetrahedra, &c.error, &c.cpu, &c.cut_cpu, &c.cut_step_s})
      if (!(in >> *x) || !std::isfinite(*x) || *x < 0) return std::nullopt;
  }
  in.ignore(1);  // the line's end
  plan.table.resize(table_bytes);
  std::string end;
  if (!in.read(plan.table.data(), static_cast<std::streamsize>(table_bytes)) || !(in >> end) || end != kEndOfPlan)
    return std::nullopt;
  return plan;
}

std::optional<KeptPlan> kept_plan(std::uint64_t key) {
  if (plans_folder().empty()) return std::nullopt;
  std::ifstream in(file_of(key));
  if (!in) return std::nullopt;
  auto plan = plan_from({std::istreambuf_iterator<char>(in), {}}, key);
  if (!plan) log_info(file_of(key).string() + ": no plan of this scene, or damaged; planned anew");
  return plan;
}

void keep_plan(std::uint64_t key, const KeptPlan& plan) {
  if (plans_folder().empty()) return;
  write_to_cache(file_of(key), to_text(plan, key));
  tidy_up();
}

}  // namespace sectio
