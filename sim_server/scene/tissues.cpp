#include "sim_server/scene/tissues.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/core/formatted.h"

namespace sectio {
namespace {

constexpr const char* kKayeLaby = "Kaye, Laby 1995";
constexpr const char* kArda = "Arda 2011";

// The damping of a mode of frequency f in proportion to mass is 2 pi f times the tissue's loss factor. The loss factor
// of liver at 10 Hz, about the frequency at which an organ wobbles, is 0.35: a spring of 1.16 kPa beside one of 1.97
// kPa in series with a dashpot of 7.3 Pa s (Asbach 2008).
constexpr double kLiverDamping_per_s = 22;

const MeasuredTissue kTissues[] = {
    {.name = "brain",
     .measured_on = "grey matter, cattle, pressed",
     .young_pa = {1400, "Budday 2015"},
     .density_kg_per_m3 = {{1036, kKayeLaby}}},
    {.name = "fat",
     .measured_on = "of the breast, human, pressed",
     .young_pa = {3250, "Samani 2007"},
     .density_kg_per_m3 = {{923, kKayeLaby}}},
    {.name = "gallbladder", .measured_on = "its wall, human, stretched across", .young_pa = {255000, "Karimi 2017"}},
    {.name = "heart",
     .measured_on = "muscle at rest, rat, pressed",
     .young_pa = {18000, "Berry 2006"},
     .density_kg_per_m3 = {{1044, kKayeLaby}}},
    {.name = "kidney",
     .measured_on = "cortex, human, shear waves",
     .young_pa = {5000, kArda},
     .density_kg_per_m3 = {{1050, kKayeLaby}}},
    {.name = "liver",
     .measured_on = "human, shear waves; toughness: cattle",
     .young_pa = {5490, "Roulot 2008"},
     .density_kg_per_m3 = {{1060, kKayeLaby}},
     .damping_per_s = {{kLiverDamping_per_s, "Asbach 2008"}},
     .toughness_j_per_m2 = {{164, "Gokgol 2012"}}},
    {.name = "muscle",
     .measured_on = "of the calf at rest, human, shear waves",
     .young_pa = {11100, kArda},
     .density_kg_per_m3 = {{1047, kKayeLaby}}},
    {.name = "pancreas",
     .measured_on = "human, shear waves",
     .young_pa = {4800, kArda},
     .density_kg_per_m3 = {{1045, kKayeLaby}}},
    {.name = "skin",
     .measured_on = "human, pressed; toughness: cut by scissors",
     .young_pa = {35000, "Pailler-Mattei 2008"},
     .density_kg_per_m3 = {{1150, kKayeLaby}},
     .toughness_j_per_m2 = {{1700, "Pereira 1997"}},
     .friction = {{0.46, "Zhang, Mak 1999"}}},
    {.name = "spleen",
     .measured_on = "human, shear waves",
     .young_pa = {2900, kArda},
     .density_kg_per_m3 = {{1054, kKayeLaby}}},
    {.name = "uterus",
     .measured_on = "muscle, human, shear waves",
     .young_pa = {6380, "Stader 2024"},
     .density_kg_per_m3 = {{1052, kKayeLaby}}},
    {.name = "vessel",
     .measured_on = "aorta, dog, at 13 kPa; toughness: pig, cut by a blade",
     .young_pa = {430000, "Bergel 1961"},
     .toughness_j_per_m2 = {{290, "Hu 2013"}}},
};

std::string cell(const std::optional<Measured>& constant) {
  if (!constant) return " |";
  return formatted(" %g (%s) |", constant->value, constant->work);
}

}  // namespace

std::span<const MeasuredTissue> tissues() {
  return kTissues;
}

std::vector<std::string> tissue_names() {
  std::vector<std::string> names;
  for (const MeasuredTissue& tissue : kTissues) names.emplace_back(tissue.name);
  return names;
}

MaterialSpec material_of(const std::string& tissue) {
  const auto found = std::ranges::find(kTissues, tissue, &MeasuredTissue::name);
  SECTIO_ASSERT(found != std::end(kTissues), "the tissue is one of tissue_names()");
  MaterialSpec material;
  const auto take = [](double& target, const std::optional<Measured>& constant) {
    if (constant) target = constant->value;
  };
  take(material.young_pa, found->young_pa);
  take(material.density_kg_per_m3, found->density_kg_per_m3);
  take(material.damping_per_s, found->damping_per_s);
  take(material.toughness_j_per_m2, found->toughness_j_per_m2);
  take(material.friction, found->friction);
  return material;
}

std::string tissue_manual() {
  std::string table =
      "| `tissue` | `young_pa` | `density_kg_per_m3` | `damping_per_s` | `toughness_j_per_m2` | `friction` | measured "
      "on "
      "|\n|---|---|---|---|---|---|---|\n";
  for (const MeasuredTissue& t : kTissues) {
    table += "| `" + std::string(t.name) + "` |" + cell(t.young_pa) + cell(t.density_kg_per_m3);
    table += cell(t.damping_per_s) + cell(t.toughness_j_per_m2) + cell(t.friction) + " " + t.measured_on + " |\n";
  }
  return table;
}

}  // namespace sectio
