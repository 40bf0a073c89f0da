// Documents drift unless something reads them: links, paths, the table of rooms, cited works, the length of the README.
#include "tests/architecture/documents.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>

#include "tests/architecture/source_files.h"
#include "tests/architecture/walls.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;
using test::read_source;
using test::source_files;

const fs::path kRoot = SECTIO_SOURCE_DIR;

std::map<std::string, std::string> documents() {
  auto found = source_files({"docs", "tests", "deploy", "sim_server", "render_client", "device_bridge"}, {".md"});
  for (const char* top : {"README.md", "CONTRIBUTING.md", "CHANGELOG.md"}) found[top] = read_source(top);
  return found;
}

TEST(Documents, every_link_leads_somewhere) {
  std::size_t checked = 0;
  for (const auto& [path, text] : documents())
    for (const Found& link : links(text)) {
      const std::size_t hash = link.text.find('#');
      const std::string file = link.text.substr(0, hash);
      const fs::path target = file.empty() ? fs::path(path) : (fs::path(path).parent_path() / file).lexically_normal();
      EXPECT_TRUE(fs::exists(kRoot / target)) << path << ":" << link.line << ": " << link.text;
      if (hash != std::string::npos && fs::exists(kRoot / target)) {
        EXPECT_TRUE(anchors(read_source(target)).contains(link.text.substr(hash + 1)))
            << path << ":" << link.line << ": no heading for " << link.text;
      }
      ++checked;
    }
  EXPECT_GT(checked, 40u);
}

TEST(Documents, every_path_of_a_source_exists) {
  std::size_t checked = 0;
  for (const auto& [path, text] : documents())
    for (const Found& named : paths(text)) {
      EXPECT_TRUE(fs::exists(kRoot / named.text)) << path << ":" << named.line << ": " << named.text;
      ++checked;
    }
  EXPECT_GT(checked, 40u);
}

TEST(Documents, the_readme_is_short) {
  const std::string text = read_source("README.md");
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 150);
}

TEST(Documents, the_table_of_rooms_is_that_of_the_walls) {
  std::string table = "| room | holds |\n|---|---|\n";
  for (const Room& room : rooms())
    if (room.path.ends_with('/')) table += "| `" + std::string(room.path) + "` | " + std::string(room.holds) + " |\n";
  const std::string text = read_source("docs/architecture.md");
  const std::string begin = "<!-- rooms -->\n", end = "<!-- /rooms -->";
  const std::size_t from = text.find(begin) + begin.size(), to = text.find(end);
  ASSERT_LE(from, to);
  EXPECT_EQ(text.substr(from, to - from), table)
      << "docs/architecture.md: put the table of tests/architecture/walls.h between the marks:\n"
      << table;
}

// "B_CD_1 to B_CD_7" stands for seven rows.
TEST(Documents, the_rows_that_are_explained_are_those_that_tests_name) {
  const std::string page = read_source("docs/rows.md");
  std::set<std::string> explained;
  const std::regex range(R"(([ABCDS](?:_[A-Z]+)?_)(\d+)(?: to \1(\d+))?)");
  for (std::sregex_iterator m(page.begin(), page.end(), range), end; m != end; ++m)
    for (int i = std::stoi((*m)[2]), last = (*m)[3].matched ? std::stoi((*m)[3]) : i; i <= last; ++i)
      explained.insert((*m)[1].str() + std::to_string(i));
  const std::regex row(R"(TEST(?:_F|_P)?\(\w+,\s*((?:[ABC]_[A-Z]+|[DS])_\d+)_)");
  std::size_t checked = 0;
  std::string names;
  for (const auto& [path, text] : source_files({"tests"}, {".cpp"})) {
    const std::regex name(R"(TEST(?:_F|_P)?\(\w+,\s*(\w+)\))");
    for (std::sregex_iterator m(text.begin(), text.end(), name), end; m != end; ++m) names += (*m)[1].str() + "_ ";
    for (std::sregex_iterator m(text.begin(), text.end(), row), end; m != end; ++m) {
      const std::string id = (*m)[1];
      EXPECT_TRUE(explained.contains(id) || id.starts_with("A_TPL")) << path << ": docs/rows.md doesn't explain " << id;
      ++checked;
    }
  }
  EXPECT_GT(checked, 100u);
  for (const std::string& id : explained)
    EXPECT_NE(names.find(id + "_"), std::string::npos) << "docs/rows.md explains " << id << ", which no test proves";
}

TEST(Documents, every_cited_work_is_among_the_references) {
  std::string references = read_source("docs/references.md");
  for (const auto& [letter, ascii] : std::map<std::string, std::string>{{"ü", "ue"}, {"æ", "ae"}, {"ß", "ss"}})
    for (std::size_t at = references.find(letter); at != std::string::npos; at = references.find(letter))
      references.replace(at, letter.size(), ascii);
  std::istringstream lines(references);
  std::vector<std::string> works;
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("* ")) works.push_back(line);
  std::size_t checked = 0;
  for (const auto& [path, text] : source_files(test::kSourceFolders, {".h", ".cpp"}))
    for (const Citation& c : citations(text)) {
      EXPECT_TRUE(std::ranges::any_of(works,
                                      [&](const std::string& work) {
                                        return work.find(c.name) != std::string::npos &&
                                               work.find(c.year) != std::string::npos;
                                      }))
          << path << ":" << c.line << ": docs/references.md has no work of " << c.name << ", " << c.year;
      ++checked;
    }
  EXPECT_GT(checked, 30u);
}

TEST(Documents, the_first_words_of_a_scene_say_what_it_shows) {
  for (const auto& [path, text] : source_files({"deploy"}, {".yaml"})) {
    std::istringstream lines(text);
    std::string line;
    while (std::getline(lines, line) && line.find("$schema") != std::string::npos) {
    }
    EXPECT_TRUE(line.starts_with("# ") && line.ends_with('.') && line.size() <= 120) << path << ": " << line;
  }
}

// The stages of a step, as step.h declares them.
TEST(Documents, the_table_of_stages_has_each_stage_in_order) {
  static const std::regex stage("void (\\w+)\\(SimulatedWorld& world, StepContext& context\\);");
  const std::string declared = read_source("sim_server/step/step.h"), table = read_source("docs/architecture.md");
  std::size_t at = table.find("| stage | action |");
  ASSERT_NE(at, std::string::npos);
  for (std::sregex_iterator it(declared.begin(), declared.end(), stage), end; it != end; ++it) {
    const std::size_t row = table.find("\n| `" + (*it)[1].str() + "` |", at);
    ASSERT_NE(row, std::string::npos) << (*it)[1] << " is missing, or stands elsewhere";
    at = row;
  }
}

// clang-format leaves comments alone, tables among them.
TEST(Documents, comments_are_no_wider_than_code) {
  for (const auto& [path, text] : source_files(test::kSourceFolders, {".h", ".cpp"})) {
    std::istringstream lines(text);
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      const bool is_comment = line.find_first_not_of(' ') == line.find("//") && line.find("//") != std::string::npos;
      if (is_comment) {
        EXPECT_LE(line.size(), 120u) << path << ":" << number;
      }
    }
  }
}

// Plain English: the subject comes first, in each sentence and behind code. "Of a session: its scene" becomes "A
// session's scene", `int count;  // of regions` becomes `int count;  // regions`, and `Tools tools;  // the scene's`
// becomes `Tools tools;  // tools of the scene`.
TEST(Documents, no_sentence_of_a_comment_begins_with_a_genitive_or_a_free_relative) {
  for (const auto& [path, text] : source_files(test::kSourceFolders, {".h", ".cpp"}))
    for (const Found& opening : inverted_openings(text))
      ADD_FAILURE() << path << ":" << opening.line << ": " << opening.text;
}

TEST(Documents, broken_links_and_strange_works_are_seen) {
  EXPECT_EQ(links("a [b](c.md#d) ![e](f.png) [web](https://g.org)\n```\n[no](h)\n```\n").size(), 2u);
  EXPECT_TRUE(anchors("## As much as a scene needs\n").contains("as-much-as-a-scene-needs"));
  EXPECT_EQ(paths("see `deploy/scenes/*.yaml`").at(0).text, "deploy/scenes/");
  EXPECT_EQ(paths("in sim_server/nowhere.h.").at(0).text, "sim_server/nowhere.h");
  EXPECT_TRUE(paths("build/release/bin/deploy/x").empty());
  EXPECT_EQ(citations("x;  // (Smith et al. 2018, section 4)").at(0).name, "Smith");
  EXPECT_EQ(citations("// van Oosterom and Strackee 1983).").at(0).name, "Strackee");
  EXPECT_TRUE(citations("int x = 2018;  // 2000 of them").empty());
}

TEST(Documents, inverted_openings_are_seen) {
  const auto lines_of = [](const std::string& source) {
    std::vector<int> lines;
    for (const Found& opening : inverted_openings(source)) lines.push_back(opening.line);
    return lines;
  };
  using Lines = std::vector<int>;
  EXPECT_EQ(lines_of("// Of a body.\n// Its shape\n// of rest.\nint a;\n  // What is left.\n"), (Lines{1, 5}));
  EXPECT_EQ(lines_of("// It is large.\n// As large. Where it ends,\n// Of course it does. That is all.\n"),
            (Lines{2, 2}));
  EXPECT_EQ(lines_of("int a;  // of regions\nint b;  // that are left\nint c;  // regions\n"), (Lines{1, 2}));
  EXPECT_EQ(lines_of("int a = 1'000;  // which is much\nint b;  // largest, that is\n"), Lines{1});
  EXPECT_EQ(lines_of("int a;  // the number\n        // of regions\n// of bodies\n"), Lines{3});
  EXPECT_EQ(lines_of("// Whoever reads.\n// It ends. Whatever comes, it ends.\n// It is for all.\n// For who asks.\n"),
            (Lines{1, 2, 4}));
  EXPECT_EQ(lines_of("int a;  // the server's\nint b;  // A wall's, by its depth\n\n// soups'; not bare\n"),
            (Lines{1, 2, 4}));
  EXPECT_EQ(lines_of("int a;  // the server's clock\nint b;  // 'classes', by name\n  // The threads' order.\n"),
            Lines{});
  EXPECT_TRUE(lines_of("// For whole bodies.\n// Whichever is first.\n// Its place: the server's.\n").empty());
  EXPECT_TRUE(lines_of("run(\"// of no use\", '\"', \"\\\"// as text\");\n// That is all.\n").empty());
  EXPECT_TRUE(lines_of("// phi(x),\n//\n// where x is a place, e.g. those of a line\n").empty());
}

}  // namespace
}  // namespace sectio
