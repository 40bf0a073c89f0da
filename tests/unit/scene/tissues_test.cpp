#include "sim_server/scene/tissues.h"

#include <fstream>
#include <sstream>

#include "tests/unit/scene/scene_file.h"

namespace sectio::scene_test {
namespace {

using test::kScene;
using test::SceneFile;

std::string document(const std::string& name) {
  std::ifstream file(std::filesystem::path(SECTIO_SOURCE_DIR) / "docs" / name);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST_F(SceneFile, a_tissue_gives_its_constants_and_keys_beside_it_override_them) {
  const std::string material = "    material: {young_pa: 7000, poisson: 0.4}\n";
  const MaterialSpec liver = load(with(material, "    tissue: liver\n")).bodies[0].material;
  EXPECT_EQ(liver.young_pa, 5490);
  EXPECT_EQ(liver.poisson, MaterialSpec().poisson);
  EXPECT_EQ(liver.density_kg_per_m3, 1060);
  EXPECT_EQ(liver.damping_per_s, 22);
  EXPECT_EQ(liver.toughness_j_per_m2, 164);
  EXPECT_EQ(liver.friction, MaterialSpec().friction);
  EXPECT_EQ(load(with(material, "    tissue: skin\n")).bodies[0].material.friction, 0.46);
  for (const std::string& scene :
       {with(material, material + "    tissue: skin\n"), with(material, "    tissue: skin\n" + material)}) {
    const MaterialSpec skin = load(scene).bodies[0].material;
    EXPECT_EQ(skin.young_pa, 7000);
    EXPECT_EQ(skin.poisson, 0.4);
    EXPECT_EQ(skin.density_kg_per_m3, 1150);
    EXPECT_EQ(skin.toughness_j_per_m2, 1700);
  }
  EXPECT_EQ(load(kScene).bodies[0].material.density_kg_per_m3, MaterialSpec().density_kg_per_m3);
}

TEST_F(SceneFile, an_unknown_tissue_lists_those_that_there_are) {
  EXPECT_EQ(refusal("    model: surface_springs\n", "    model: surface_springs\n    tissue: bone\n"),
            "s.yaml:11: bodies[0].tissue: expected one of brain, fat, gallbladder, heart, kidney, liver, muscle, "
            "pancreas, skin, spleen, uterus, vessel, got bone");
}

TEST(Tissues, the_document_has_the_table_of_the_code) {
  const std::string text = document("tissue.md"), begin = "<!-- tissues -->\n", end = "<!-- /tissues -->";
  const std::size_t from = text.find(begin) + begin.size(), to = text.find(end);
  ASSERT_LE(from, to);
  ASSERT_NE(to, std::string::npos);
  EXPECT_EQ(text.substr(from, to - from), tissue_manual()) << "make it again: sim_server schema --tissues";
}

// "Kaye, Laby 1995" is the work of Kaye and Laby of that year.
TEST(Tissues, every_constant_has_a_work_that_is_among_the_references) {
  std::istringstream lines(document("references.md"));
  std::vector<std::string> works;
  for (std::string line; std::getline(lines, line);) works.push_back(line);
  for (const MeasuredTissue& t : tissues()) {
    for (const std::optional<Measured>& m :
         {std::optional(t.young_pa), t.density_kg_per_m3, t.damping_per_s, t.toughness_j_per_m2, t.friction}) {
      if (!m) continue;
      const std::string work = m->work, year = work.substr(work.rfind(' ') + 1);
      const std::string first = work.substr(0, work.find_first_of(", "));
      EXPECT_TRUE(std::ranges::any_of(works,
                                      [&](const std::string& line) {
                                        return line.starts_with("* " + first) && line.find(year) != std::string::npos;
                                      }))
          << t.name << ": " << work;
      EXPECT_GT(m->value, 0) << t.name;
    }
  }
}

}  // namespace
}  // namespace sectio::scene_test
