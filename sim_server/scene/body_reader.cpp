#include "sim_server/scene/body_reader.h"

#include <algorithm>

#include "common/core/joined.h"
#include "sim_server/scene/region_reader.h"
#include "sim_server/scene/tissues.h"

namespace sectio {
namespace {

// Above, crumbs come off; below, elements become so small that no step is stable.
constexpr double kLeastSnapRatio = 0.02, kMostSnapRatio = 0.15;

// The models of a table that have a trait, for an error.
std::string models_with(const EngineTraits& traits, bool ModelTraits::*trait) {
  std::vector<std::string> names;
  for (const ModelTraits& model : traits.models)
    if (model.*trait) names.push_back(model.name);
  return joined(names);
}

// The models that name a key of `volume:` theirs.
std::string models_of_key(const EngineTraits& traits, const std::string& key) {
  std::vector<std::string> names;
  for (const ModelTraits& model : traits.models)
    if (std::ranges::find(model.volume_keys, key) != model.volume_keys.end()) names.push_back(model.name);
  return joined(names);
}

// The features that a body's model allows. Model auto allows all that any model does: the planner chooses accordingly.
struct Allowed {
  bool is_auto = false, volume = true, cutting = true, templates = true;
  std::vector<std::string> refused_volume_keys = {};
};

Allowed allowed_for(const std::string& model, const EngineTraits& traits) {
  const auto found = std::ranges::find(traits.models, model, &ModelTraits::name);
  if (found == traits.models.end()) return {model == "auto"};
  Allowed allowed{false, found->needs_volume, found->can_cut, found->accepts_templates};
  for (const ModelTraits& other : traits.models)
    for (const std::string& key : other.volume_keys)
      if (std::ranges::find(found->volume_keys, key) == found->volume_keys.end())
        allowed.refused_volume_keys.push_back(key);
  return allowed;
}

double unit_m(const std::string& name) {
  return name == "m" ? 1 : name == "cm" ? 0.01 : 0.001;
}

void read_file(KeyReader& map, std::string& file, double& file_unit_m, const std::string& formats) {
  std::string unit;
  map.required().text("file", file, formats + " The path is relative to the scene's own folder.");
  map.required().choice("unit", unit, {"m", "cm", "mm"}, "Length of the file's unit.");
  file_unit_m = unit_m(unit);
}

void read_pose(KeyReader& map, Pose& pose) {
  map.vector("position_world_m", pose.position_m, {}, "Place of the mesh's origin.");
  map.rotation(pose.orientation, "world");
}

void read_material(KeyReader& map, MaterialSpec& m) {
  map.number("young_pa", m.young_pa, above(0), "Young's modulus.");
  map.number("poisson", m.poisson, from_to_below(0, 0.5), "Poisson's ratio.");
  map.number("density_kg_per_m3", m.density_kg_per_m3, above(0), "Density.");
  map.number("skin_thickness_m", m.skin_thickness_m, above(0),
             "Thickness of the membrane that surface springs stand for.");
  map.number("foundation_radius_m", m.foundation_radius_m, above(0),
             "Radius of the indenter for which the springs that hold a surface in its shape have the stiffness of a "
             "half-space.");
  map.number("pretension", m.pretension, between(0, 0.5),
             "Fraction by which surface springs are shorter at rest than the edges of the mesh.");
  map.number("damping_per_s", m.damping_per_s, at_least(0), "Damping in proportion to mass.");
  map.number("toughness_j_per_m2", m.toughness_j_per_m2, at_least(0), "Work that a cut takes, per area.");
  map.number("friction", m.friction, at_least(0),
             "Coefficient of friction of instruments on the tissue, as the hand feels it.");
}

void read_cutting(KeyReader& map, CuttingSpec& c, const Allowed& allowed, const EngineTraits& traits) {
  map.number("threshold_force_n", c.threshold_force_n, at_least(0), "Pushing force at which the surface breaks.");
  map.number("threshold_displacement_m", c.threshold_displacement_m, at_least(0),
             "Displacement at which the surface breaks, instead of a force.");
  map.check("threshold_displacement_m", !map.given("threshold_force_n"),
            "give threshold_force_n or threshold_displacement_m, not both");
  if (c.threshold_displacement_m) c.threshold_force_n.reset();
  map.choice("style", c.style, {"progressive", "templates", "semi_progressive"},
             "How a cut grows: progressive, up to the blade; templates, by whole triangles of a surface; "
             "semi_progressive, by whole tetrahedra of a volume.");
  map.number("open_top_m", c.open_top_m, above(0), "For style templates only: width of the opening at the surface.");
  map.number("open_bottom_m", c.open_bottom_m, above(0),
             "For style templates only: width of the opening at its bottom.");
  map.number("hysteresis", c.hysteresis, above_to(0, 1),
             "Fraction of the threshold above which a cut that has begun goes on.");
  map.number("join_tolerance_m", c.join_tolerance_m, at_least(0),
             "An instrument this close to the end of an earlier cut goes on with that cut.");
  map.number("groove_min_depth_m", c.groove_min_depth_m, above(0), "Shallower cuts of a surface are not made.");
  map.boolean("loops_free_islands", c.loops_free_islands,
              "A closed cut frees the piece of surface inside, unless that is much thicker than the cut is deep.");
  map.number("snap_ratio", c.snap_ratio, between(kLeastSnapRatio, kMostSnapRatio),
             "For models with a volume only: a cut this close to the end of an edge, in edges, goes through that end.");
  map.check(c.style != "semi_progressive" || allowed.volume,
            "semi_progressive cuts tetrahedra: it needs a model with a volume");
  map.check(c.style != "templates" || allowed.templates,
            "templates cut a surface: they need the model " + models_with(traits, &ModelTraits::accepts_templates));
  map.check(!map.given("snap_ratio") || allowed.volume, "snap_ratio is of tetrahedra: it needs a model with a volume");
}

void read_splitting(KeyReader& map, SplittingSpec& splitting) {
  std::string free_parts = "keep";
  map.choice("free_parts", free_parts, {"keep", "rigid", "deformable"},
             "A part that a cut has separated stays with its body (keep), or becomes a body of its own.");
  splitting.free_parts = free_parts == "keep"    ? FreeParts::keep
                         : free_parts == "rigid" ? FreeParts::rigid
                                                 : FreeParts::deformable;
  map.number(
      "least_volume_m3", splitting.least_volume_m3, at_least(0),
      "Smaller free parts are removed, also from a body that keeps its parts, and so are those below two tetrahedra "
      "of a volume, or half a tetrahedron with the mean edge of a surface.");
  map.number("friction", splitting.friction, at_least(0),
             "Coefficient of friction of rigid parts with the floor and with bodies.");
}

void read_volume(KeyReader& map, VolumeSpec& v, const Allowed& allowed, const EngineTraits& traits) {
  const auto only_for = [&](const char* key) { return "For model " + models_of_key(traits, key) + " only: "; };
  map.choice("mesher", v.mesher, {"lattice", "tetgen", "best"},
             "Program that fills the surface with tetrahedra; best: the one whose stable step is larger.");
  map.number("tetrahedra", v.tetrahedra, between(12, 5e6), "About how many.");
  map.default_of("about 2000 cells in the body")
      .number("cell_m", v.cell_m, between(1e-5, 1),
              only_for("cell_m") + "edge of a hexahedron. Presses ask for six tetrahedra a cell.");
  map.choice("driver", v.driver, {"automatic", "implicit"},
             "A step is taken explicitly where that is stable (automatic), or always implicitly.");
  map.number("second_share", v.second_share, between(0, 0.95),
             only_for("second_share") + "share of the stiffness that springs to second neighbours have.");
  map.number("damper_s", v.damper_s, at_least(0),
             only_for("damper_s") + "constant of a spring's damper over the spring's stiffness.");
  map.number("floor_kept_velocity", v.floor_kept_velocity, between(0, 1),
             "Fraction of its velocity along the floor that a vertex keeps when it touches the floor.");
  map.number("least_part_s", v.least_part_s, between(0, 0.1),
             "Vertices that are too light for parts of a step as long as this are made heavier; 0: none.");
  map.number("collapse_ratio", v.collapse_ratio, between(0, 0.8),
             "After a cut, edges shorter than this fraction of the mean around them collapse; 0: none.");
  map.part(
      "tets",
      [&](KeyReader& part) { read_file(part, v.file, v.file_unit_m, "Tetrahedra: .msh, .vtk or .node (with .ele)."); },
      "A volume from a file, instead of a surface that is filled; then the body has no mesh.");
  for (const std::string& key : allowed.refused_volume_keys)
    map.check(key, false, "it is for model " + models_of_key(traits, key) + " only");
  for (const char* chosen : {"tetrahedra", "cell_m", "driver"})
    map.check(chosen, !allowed.is_auto, "model auto chooses it");
}

void read_model(KeyReader& map, BodySpec& body, const EngineTraits& traits) {
  std::vector<std::string> names;
  for (const ModelTraits& model : traits.models) names.push_back(model.name);
  names.emplace_back("auto");
  map.choice("model", body.model, names,
             "How the body deforms and is cut; auto: the cheapest model that keeps both budgets, and its resolution.");
  for (const char* budget : {"error_budget", "cpu_budget"})
    map.check(budget, body.model == "auto", "it is of model auto");
  map.number("error_budget", body.plan.error_budget, above_to(0, 10),
             "For model auto only: how wrong the body may bend, twist, be dented and open, relative.");
  map.number("cpu_budget", body.plan.cpu_budget, above_to(0, 1000),
             "For model auto only: seconds of processor time for a second.");
  std::vector<KeyReader::Owner> owners;
  for (const ModelTraits& model : traits.models)
    owners.push_back({"model " + model.name, model.name == body.model, model.keys});
  map.options(std::move(owners), body.options);
}

void read_looks(KeyReader& map, BodySpec& body) {
  map.vector("skin", body.skin_colour, between(0, 1), "Red, green and blue of the outer surface.");
  map.vector("wall", body.wall_colour, between(0, 1), "Red, green and blue of walls that cuts have opened.");
}

void read_surface(KeyReader& map, BodySpec& body) {
  const std::vector<std::string> names{"tissue", "plastic", "steel", "cloth"};
  std::string name = names.front();
  map.choice("surface", name, names, "What it is made of, for the eye alone.");
  body.surface = static_cast<BodySurface>(std::ranges::find(names, name) - names.begin());
}

void read_layers(KeyReader& map, BodySpec& body) {
  map.each(
      "layers",
      [&](KeyReader& part) {
        TissueLayer layer;
        part.number("to_depth_m", layer.to_depth_m, between(0, 1),
                    "How far below the skin it reaches, along the wall; the last one reaches all the way.");
        part.required().vector("colour", layer.colour, between(0, 1), "Red, green and blue.");
        part.check(body.layers.empty() || body.layers.back().to_depth_m > 0, "the layer above it needs to_depth_m");
        part.check(layer.to_depth_m == 0 || body.layers.empty() || layer.to_depth_m > body.layers.back().to_depth_m,
                   "it must reach deeper than the layer above it");
        body.layers.push_back(layer);
      },
      "Layers that walls of cuts show by their depth, from the skin down: skin, fat, muscle; at most four.");
  map.check("layers", body.layers.size() <= kMaxLayers, "a body has at most " + std::to_string(kMaxLayers));
}

}  // namespace

Box read_box(KeyReader& map) {
  Box box;
  map.required().vector("min_world_m", box.min_world_m, {}, "Corner with the smallest coordinates.");
  map.required().vector("max_world_m", box.max_world_m, {}, "Corner with the largest coordinates.");
  map.check((box.min_world_m.array() < box.max_world_m.array()).all(),
            "each number of min_world_m must be below that of max_world_m");
  return box;
}

BodySpec read_body(KeyReader& map, const EngineTraits& traits) {
  BodySpec body;
  body.place = map.place();
  map.required().name("name", body.name, "Its name, which no other body has.");
  map.name("server", body.server,
           "Name of the server that simulates the body, when several servers share the session.");
  read_model(map, body, traits);
  const Allowed allowed = allowed_for(body.model, traits);
  map.part(
      "pose", [&](KeyReader& part) { read_pose(part, body.pose); }, "Where the mesh is placed.");
  std::string tissue;
  map.default_of("none").choice("tissue", tissue, tissue_names(),
                                "Tissue whose measured constants, which docs/tissue.md lists, `material` begins with.");
  if (!tissue.empty()) body.material = material_of(tissue);
  map.part(
      "material", [&](KeyReader& part) { read_material(part, body.material); }, "Constants of the tissue.");
  map.part(
      "contact",
      [&](KeyReader& part) {
        part.choice("style", body.contact.style, {"vertices", "templates"},
                    "An instrument that presses moves vertices of the mesh, or temporary particles on its lines, which "
                    "follow these more closely, and know nothing of its ball.");
        part.check(
            body.contact.style != "templates" || allowed.templates,
            "templates divide a surface: they need the model " + models_with(traits, &ModelTraits::accepts_templates));
      },
      "How instruments press it.");
  map.check("cutting", allowed.cutting, "the model " + body.model + " can't be cut");
  map.part(
      "cutting", [&](KeyReader& part) { read_cutting(part, body.cutting, allowed, traits); },
      "How instruments cut it.");
  map.part(
      "splitting", [&](KeyReader& part) { read_splitting(part, body.splitting); }, "What happens to separated parts.");
  map.part(
      "fixed", [&](KeyReader& part) { body.fixed = read_box(part); }, "A box: vertices inside stay where they are.");
  map.part(
      "colours", [&](KeyReader& part) { read_looks(part, body); }, "Colours where the body has no region.");
  read_surface(map, body);
  read_layers(map, body);
  body.regions = read_regions(map);
  map.check("volume", allowed.volume, "the model " + body.model + " has no volume");
  map.part(
      "volume", [&](KeyReader& part) { read_volume(part, body.volume, allowed, traits); },
      "The inside of a body whose model has a volume.");
  map.check("mesh", body.volume.file.empty(), "volume.tets brings the surface, too");
  // Required of most bodies, but not by the description, which holds for all.
  map.required(!map.describes() && body.volume.file.empty());
  map.part(
      "mesh",
      [&](KeyReader& part) {
        read_file(part, body.mesh_file, body.mesh_unit_m, "A closed surface: OBJ, STL, PLY, glTF or GLB.");
        std::string repair = "mend";
        part.choice("repair", repair, {"mend", "wrap"},
                    "mend: vertices are welded and triangles turned, a surface that is not closed is refused; wrap: a "
                    "closed body is made around whatever triangles there are, of a file in any format.");
        body.wrapped = repair == "wrap";
        for (const char* key : {"part", "size_m"}) part.check(key, body.wrapped, "it is of repair: wrap");
        part.text("part", body.mesh_part,
                  "For wrap only: no parts but those in whose name one of these words, apart by commas, is found; of a "
                  "NIfTI image, "
                  "voxels with one of these labels.");
        part.default_of("for about 8000 triangles")
            .number("size_m", body.mesh_size_m, above(0), "For wrap only: about the length of an edge.");
      },
      "Its surface; every body has one but those with volume.tets.");
  return body;
}

}  // namespace sectio
