// A scene as plain values: what the YAML file says, with units in every name. See load_scene() for the file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/material/elastic_material.h"
#include "common/material/looks.h"
#include "common/material/regions.h"
#include "common/math/camera.h"
#include "common/math/trace.h"
#include "common/math/types.h"
#include "common/mesh/tet_mesh.h"
#include "common/mesh/triangle_mesh.h"
#include "sim_server/instruments/instrument.h"
#include "sim_server/scene/engine_traits.h"
#include "sim_server/scene/scene_outcome.h"

namespace sectio {

// Elastic constants; springs are calibrated from them and never set by hand.
struct MaterialSpec : ElasticMaterial {
  double skin_thickness_m = 0.002;     // the membrane that the mesh springs stand for
  double foundation_radius_m = 0.008;  // indenter radius a_ref of the home springs, K_w = 2 E*/(pi a_ref)
  double pretension = 0.06;            // mesh springs' rest length is (1 - pretension) times the edge
  double damping_per_s = 25;           // mass-proportional
  double toughness_j_per_m2 = 200;     // cutting work per area, J_c
  double friction = 0.2;               // Coulomb's coefficient of instruments on the tissue, as the hand feels it
};

struct CuttingSpec {
  // Surfaces: "progressive" (paper B), or "templates" (paper A). Volumes: "progressive", up to the blade inside
  // tetrahedra, or "semi_progressive" (paper C), tetrahedra that it has gone through whole.
  std::string style = "progressive";
  double open_top_m = 0.0004;                     // templates: width of the opening at the surface
  double open_bottom_m = 0.0002;                  // templates: width of the opening at the bottom
  std::optional<double> threshold_force_n = 0.5;  // one of the two (paper B, 3)
  std::optional<double> threshold_displacement_m;
  double hysteresis = 0.7;          // a cut goes on while the measure is above hysteresis x threshold
  double join_tolerance_m = 0.002;  // an instrument this close to the end of a cut joins it (paper B, 5.2)
  double groove_min_depth_m = 0.0003;
  bool loops_free_islands = true;  // closing a loop parts the island from the body
  double snap_ratio = 0.08;        // volumes: a cut this close to the end of an edge goes through it; 0.02 to 0.15
};

// A pressing instrument moves the vertices under it or, with "templates" (paper A), temporary particles. Particles
// follow its form more closely, but the force goes over from one particle to the next, while it is interpolated between
// vertices, and each particle sends topology: hence the default.
struct ContactSpec {
  std::string style = "vertices";
};

// The fate of a part that a cut has separated.
enum class FreeParts : std::uint8_t {
  keep,        // it stays a component of its body, unless it is smaller than least_volume_m3
  rigid,       // a body of its own, which moves rigidly; one that is anchored goes on deforming
  deformable,  // a body of its own, which goes on deforming
};

struct SplittingSpec {
  FreeParts free_parts = FreeParts::keep;
  double least_volume_m3 = 1e-10;  // a free part below this is removed
  double friction = 0.4;           // between rigid parts, floor and bodies
};

// The inside of a body whose model is one of a volume.
struct VolumeSpec {
  std::string mesher = "lattice";    // tetgen, best: whichever of the two gives the larger stable step
  double tetrahedra = 4000;          // about so many
  double cell_m = 0;                 // neo_hookean_lattice: edge of a hexahedron; 0: about 2000 in the body
  std::string file;                  // instead of a surface: tetrahedra; resolved path
  double file_unit_m = 1;            // length of the file's unit
  std::string driver = "automatic";  // neo_hookean and its lattice; implicit: never the explicit one
  double second_share = 0.5;         // tetra_springs: stiffness that second neighbours have
  double damper_s = 0;               // tetra_springs: constant of a spring's damper over its stiffness
  double floor_kept_velocity = 0;    // along the floor, at a touch
  double least_part_s = 0;           // vertices too light for parts of a step this long get mass; 0: none
  double collapse_ratio = 0.15;      // after cuts: shorter edges, of the mean around them, go; 0: none
};

// Model auto: the error and the cost that a body may have, and those that the planner expects of its choice.
struct PlanSpec {
  double error_budget = 0.1;  // relative: of how the body bends, twists, is dented and opens
  double cpu_budget = 0.5;    // processor's time for a second
  std::optional<double> error_estimate, cpu_estimate;
  std::optional<double> cut_cpu_estimate, cut_step_estimate_s;  // while a blade cuts; in a step that changes topology
};

struct Box {
  Vec3 min_world_m = Vec3::Zero();
  Vec3 max_world_m = Vec3::Zero();

  bool contains(const Vec3& x_world_m) const {
    return (x_world_m.array() >= min_world_m.array()).all() && (x_world_m.array() <= max_world_m.array()).all();
  }
};

struct BodySpec {
  std::string name;
  std::string place;                    // its line as "FILE:LINE", for messages; empty: it is from no file
  std::string server = "main";          // the server, among those that share the session, that simulates it
  std::string mesh_file;                // resolved path
  double mesh_unit_m = 1;               // length of the file's unit
  bool wrapped = false;                 // the mesh is a body around what the file holds
  std::string mesh_part;                // wrapped: only parts in whose name this is found; empty: all
  double mesh_size_m = 0;               // wrapped: about the length of an edge; 0: for about 8000 triangles
  TriangleSoup mesh;                    // in metres, body frame, checked
  std::vector<std::string> mesh_notes;  // mends, and notes that a person should know; often empty
  Pose pose;
  std::string model = "surface_springs";  // see EngineTraits; auto, until planned() has chosen one
  Options options;                        // the model's own keys
  PlanSpec plan;
  VolumeSpec volume;
  TetMesh tets;  // a volume's once it is filled, in metres, body frame: vertices of the surface first
  MaterialSpec material;
  ContactSpec contact;
  CuttingSpec cutting;
  SplittingSpec splitting;
  std::optional<Box> fixed;  // vertices inside stay where they are
  Vec3 skin_colour{0.62, 0.20, 0.16};
  Vec3 wall_colour{0.78, 0.33, 0.27};
  Regions regions;  // regions inside the body, in the frame of the mesh
  BodySurface surface = BodySurface::tissue;
  std::vector<TissueLayer> layers;  // in walls, from the skin down

  // Whether `fixed` holds a vertex that is there at rest.
  bool holds(const Vec3& rest_body_m) const { return fixed && fixed->contains(pose.to_world(rest_body_m)); }
};

struct ToolSpec {
  std::string name;
  std::string kind = "scalpel";  // instrument_of()
  ToolGeometry geometry;
  double intensity = 1;                               // cautery: |CD| = intensity x geometry's |CD|
  std::optional<double> grip_force_n, grip_radius_m;  // for forceps; absent: those of their kind
  double largest_force_n = 20;                        // largest force that its hand may feel
  double max_speed_m_per_s = kUsualMaxSpeed_m_per_s;  // a faster hand is followed at this speed
  std::string trace_file;
  std::vector<TracePoint> trace;  // ascending in time; may be empty
};

// Something that goes on in bodies, or between them: a ProcessEngine for each body, or one for all of them.
struct ProcessSpec {
  std::string name;
  std::string kind;                 // see EngineTraits
  std::vector<std::string> bodies;  // names, each once
  Options options;                  // the kind's own keys
};

// A line on a body to cut along: the axes of the tubes of a region, end to end.
struct LineSpec {
  std::vector<Vec3> points_body_m;  // two a tube
  double depth_m = 0.005;           // the cut should be so deep
  double within_m = 0.002;          // a cut this close to the line follows it
};

// Marked tissue is to be removed from a body and put into a bin, or a line to be cut, and other bodies are to be left
// alone: see session/exercise_score.h.
struct ExerciseSpec {
  static constexpr std::size_t kMostTaskBytes = 256;  // an event's text has as many at most

  std::string body;
  std::optional<Box> bin;  // a part that lies in it as a whole is in the bin
  std::optional<LineSpec> line;
  std::vector<std::string> spare = {};  // names of bodies that no instrument should touch
  std::string task = {};                // for the person who does it; may be empty
};

// From at_s on, gravity turns there.
struct GravityChange {
  double at_s = 0;
  Vec3 gravity_m_per_s2 = Vec3::Zero();
};

// A body that has come to rest sleeps: it is not stepped until something touches it. It rests when nothing of its
// surface has moved further than still_m for after_s, or, where that is more, further than anybody can see from the
// scene's camera: unseen_px pixels of a picture 720 lines high.
struct SleepSpec {
  double after_s = 1;  // 0: nothing sleeps
  double still_m = 2e-5;
  double unseen_px = 0.1;
};

struct Scene {
  std::string session = "session";
  std::string file;        // origin, for messages
  std::string step_place;  // line of step_s as "FILE:LINE"; empty: it is from no file
  double step_s = 0.001;
  bool step_is_free = false;  // step_s: auto: the planner may take a shorter one
  double duration_s = 5;
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  std::vector<GravityChange> gravity_changes;  // ascending in time: the patient is tilted
  double gravity_turns_deg_per_s = 20;         // at most
  std::optional<double> floor_z_m;             // parts that fall come to rest on this plane
  SleepSpec sleep;
  Camera camera;
  std::vector<BodySpec> bodies;           // bodies that this process simulates
  std::vector<std::string> world_bodies;  // names of all bodies of the scene; empty: those above
  std::vector<ToolSpec> tools;
  std::vector<ProcessSpec> processes;
  std::optional<ExerciseSpec> exercise;
  std::vector<Expectation> expect;  // expectations of a run for duration_s on the scene's own traces
};

// Reads a scene, its meshes (mesh_import.h) and traces (common/math/trace.h). Files are named relative to the file of
// the scene. docs/scene.md has every key. Throws InputError "FILE:LINE: KEY: what is wrong"; unknown, duplicate and
// missing keys, empty lists, wrong types and numbers that are not finite or out of range are errors. Any thread.
Scene load_scene(const std::string& path, const EngineTraits& traits);

// The keys of a scene, from the reader itself.
std::vector<Key> describe_scene(const EngineTraits& traits);

// Beginnings of messages, "FILE:LINE: body 'liver'" and "FILE:LINE: step_s".
inline std::string place_of(const BodySpec& body, const Scene& scene) {
  return (body.place.empty() ? scene.file : body.place) + ": body '" + body.name + "'";
}
inline std::string place_of_step(const Scene& scene) {
  return (scene.step_place.empty() ? scene.file : scene.step_place) + ": step_s";
}

// Leaves the bodies named, in the order of the scene; other programs have the others. Throws InputError "WHO: ..." for
// a name that the scene doesn't have, or none at all, and for a process over bodies here and elsewhere.
void keep_bodies(Scene& scene, const std::vector<std::string>& names, const std::string& who);

}  // namespace sectio
