#include "sim_server/scene/mesh_import.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "common/core/error.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace sectio::scene_test {
namespace {

namespace fs = std::filesystem;

// A cube of side 1, eight vertices, twelve triangles, outward.
TriangleSoup cube(double side = 1) {
  TriangleSoup soup;
  for (int i = 0; i < 8; ++i) soup.vertices_body_m.push_back(side * Vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1));
  soup.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return soup;
}

std::string obj(const TriangleSoup& soup) {
  std::ostringstream text;
  for (const Vec3& p : soup.vertices_body_m) text << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& t : soup.triangles) text << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return text.str();
}

std::string ply(const TriangleSoup& soup) {
  std::ostringstream text;
  text << "ply\nformat ascii 1.0\nelement vertex " << soup.vertices_body_m.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << soup.triangles.size()
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3& p : soup.vertices_body_m) text << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& t : soup.triangles) text << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  return text.str();
}

std::string stl(const TriangleSoup& soup) {
  std::ostringstream text;
  text << "solid cube\n";
  for (const auto& t : soup.triangles) {
    text << "facet normal 0 0 0\nouter loop\n";
    for (const VertexId v : t) text << "vertex " << soup.vertices_body_m[v].transpose() << '\n';
    text << "endloop\nendfacet\n";
  }
  text << "endsolid cube\n";
  return text.str();
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string binary_stl(const TriangleSoup& soup, std::uint32_t claimed) {
  std::string bytes(80, ' ');
  append(bytes, claimed);
  for (const auto& t : soup.triangles) {
    for (int i = 0; i < 3; ++i) append(bytes, 0.0f);
    for (const VertexId v : t) {
      for (int i = 0; i < 3; ++i) append(bytes, static_cast<float>(soup.vertices_body_m[v][i]));
    }
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

// glTF with the mesh under one node for each matrix; or GLB.
std::string gltf(const TriangleSoup& soup, const std::vector<std::string>& matrices, bool binary) {
  std::string data;
  for (const auto& t : soup.triangles) {
    for (const VertexId v : t) append(data, static_cast<std::uint32_t>(v));
  }
  const std::size_t index_bytes = data.size();
  for (const Vec3& p : soup.vertices_body_m) {
    for (int i = 0; i < 3; ++i) append(data, static_cast<float>(p[i]));
  }
  std::ostringstream json;
  json << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)";
  for (std::size_t i = 0; i < matrices.size(); ++i) json << (i ? "," : "") << i;
  json << R"(]}],"nodes":[)";
  for (std::size_t i = 0; i < matrices.size(); ++i) {
    json << (i ? "," : "") << R"({"mesh":0,"matrix":[)" << matrices[i] << "]}";
  }
  json << R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":0}]}],"accessors":[)"
       << R"({"bufferView":0,"componentType":5125,"count":)" << 3 * soup.triangles.size() << R"(,"type":"SCALAR"},)"
       << R"({"bufferView":1,"componentType":5126,"count":)" << soup.vertices_body_m.size()
       << R"(,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}],"bufferViews":[{"buffer":0,"byteLength":)" << index_bytes
       << R"(},{"buffer":0,"byteOffset":)" << index_bytes << R"(,"byteLength":)" << data.size() - index_bytes
       << R"(}],"buffers":[{"byteLength":)" << data.size();
  if (!binary) {
    json << R"(,"uri":"data.bin"}]})";
    return json.str();
  }
  json << "}]}";
  std::string text = json.str();
  while (text.size() % 4 != 0) text += ' ';
  std::string glb = "glTF";
  append(glb, std::uint32_t{2});
  append(glb, static_cast<std::uint32_t>(28 + text.size() + data.size()));
  append(glb, static_cast<std::uint32_t>(text.size()));
  glb += "JSON" + text;
  append(glb, static_cast<std::uint32_t>(data.size()));
  glb += std::string("BIN\0", 4) + data;
  return glb;
}

const std::string kIdentity = "1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1";

class MeshImport : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "sectio_mesh_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& bytes) const {
    const fs::path path = folder_ / name;
    std::ofstream(path, std::ios::binary) << bytes;
    return path.string();
  }

  // Why the file is refused; "" when it is accepted.
  static std::string refusal(const std::string& path, double unit_m = 1, const ImportLimits& limits = {}) {
    try {
      import_mesh(path, unit_m, limits);
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind(path + ": ", 0), 0u) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      return std::string(error.what()).substr(path.size() + 2);
    }
    return "";
  }
  std::string refusal_of_obj(const TriangleSoup& soup) const { return refusal(write("m.obj", obj(soup))); }

  static void expect_in(const std::string& part, const std::string& text) {
    EXPECT_NE(text.find(part), std::string::npos) << "\"" << part << "\" not in \"" << text << "\"";
  }

  fs::path folder_;
};

TEST_F(MeshImport, reads_every_format_with_its_unit) {
  const TriangleSoup soup = cube();
  for (const std::string& path :
       {write("a.obj", obj(soup)), write("b.ply", ply(soup)), write("c.stl", stl(soup)),
        write("d.STL", binary_stl(soup, 12)), write("e.glb", gltf(soup, {kIdentity}, true))}) {
    const bool metres = path.ends_with("glb");
    const ImportedMesh mesh = import_mesh(path, metres ? 1 : 0.01);
    EXPECT_TRUE(mesh.report.valid()) << path;
    EXPECT_EQ(mesh.report.vertices, 8u) << path;
    EXPECT_EQ(mesh.report.triangles, 12u) << path;
    EXPECT_NEAR(mesh.report.volume_m3, metres ? 1 : 1e-6, metres ? 1e-12 : 1e-18) << path;
    EXPECT_TRUE(mesh.mended.empty()) << path << ": " << mesh.mended[0];
  }
}

TEST_F(MeshImport, gltf_is_in_metres) {
  expect_in("the unit must be m", refusal(write("a.glb", gltf(cube(), {kIdentity}, true)), 0.001));
}

TEST_F(MeshImport, gltf_nodes_are_placed_and_mirrors_turn_the_winding) {
  const std::string moved = "2,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1", mirrored = "-1,0,0,0, 0,1,0,0, 0,0,1,0, -5,0,0,1";
  const ImportedMesh mesh = import_mesh(write("a.glb", gltf(cube(), {kIdentity, moved, mirrored}, true)), 1);
  EXPECT_EQ(mesh.report.components, 3u);
  EXPECT_NEAR(mesh.report.volume_m3, 4, 1e-12);
  EXPECT_TRUE(mesh.mended.empty()) << mesh.mended[0];
}

TEST_F(MeshImport, files_that_are_no_meshes_are_refused) {
  expect_in("no such file", refusal((folder_ / "absent.obj").string()));
  expect_in("not a file", refusal(folder_.string()));
  for (const char* kind : {"obj", "stl", "ply", "gltf", "glb"}) {
    expect_in("the file is empty", refusal(write(std::string("empty.") + kind, "")));
    EXPECT_NE(refusal(write(std::string("garbage.") + kind, "\x01\x02garbage\xff\xfe and more of it\n\n")), "") << kind;
  }
  expect_in("unknown kind of file", refusal(write("a.dae", obj(cube()))));
  EXPECT_NE(refusal(write("a.gltf", gltf(cube(), {kIdentity}, false))), "") << "its buffer is missing";
}

TEST_F(MeshImport, truncated_files_are_refused) {
  const TriangleSoup soup = cube();
  const std::vector<std::pair<std::string, std::string>> files{{"a.obj", obj(soup)},
                                                               {"b.ply", ply(soup)},
                                                               {"c.stl", stl(soup)},
                                                               {"d.stl", binary_stl(soup, 12)},
                                                               {"e.glb", gltf(soup, {kIdentity}, true)}};
  ImportLimits limits;
  limits.time_s = 3;
  for (const auto& [name, bytes] : files) {
    for (const double part : {0.3, 0.6, 0.85, 0.93}) {
      const std::string path = write(name, bytes.substr(0, static_cast<std::size_t>(part * double(bytes.size()))));
      EXPECT_NE(refusal(path, 1, limits), "") << name << " cut at " << part;
    }
  }
}

TEST_F(MeshImport, huge_counts_in_headers_are_refused) {
  EXPECT_NE(refusal(write("a.stl", binary_stl(cube(), 0xfffffff0u))), "");
  std::string text = ply(cube());
  text.replace(text.find("vertex 8"), 8, "vertex 4000000000");
  ImportLimits limits;
  limits.time_s = 3;
  limits.memory_bytes = 500'000'000;
  EXPECT_NE(refusal(write("a.ply", text), 1, limits), "");
  limits.triangles = 11;
  expect_in("more than 11 triangles", refusal(write("a.obj", obj(cube())), 1, limits));
}

TEST_F(MeshImport, numbers_need_no_leading_zero) {
  std::string text = obj(cube());
  text.replace(text.find("v 1 0 0"), 7, "v 1.5 -.25\t.5");
  const std::string path = write("a.obj", text);
  EXPECT_EQ(refusal(path), "");
  text.replace(text.find("-.25\t.5"), 7, "-0.25 0.5");
  const TriangleSoup with_zeros = import_mesh(write("b.obj", text), 1).soup, without = import_mesh(path, 1).soup;
  EXPECT_EQ(without.vertices_body_m, with_zeros.vertices_body_m);
  EXPECT_EQ(without.triangles, with_zeros.triangles);
}

TEST_F(MeshImport, numbers_of_an_obj_may_have_many_digits_and_lines_any_end_or_beginning) {
  std::string text = obj(cube());
  const TriangleSoup plain = import_mesh(write("plain.obj", text), 1).soup;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    for (std::size_t at = 0; (at = changed.find(from, at)) != std::string::npos; at += to.size())
      changed.replace(at, from.size(), to);
    EXPECT_NE(changed, text) << from;
    return changed;
  };
  const std::vector<std::string> texts{with("v 1 0 0", "v 1000000000000000000000000000000e-30 0 0"),
                                       with("v 1 0 0", "v 0.0000000000000000000000000000001e31 0 0"),
                                       with("v 1 0 0", "v +1.000000000000000000000000000000000 -0 0e9"),
                                       with("v 1 0 0", "v 1 \\\n0 0"),
                                       with("\n", "\r\n"),
                                       with("\n", "\r"),
                                       with("v ", "  v "),
                                       with("f ", "\tf\t"),
                                       "\xef\xbb\xbf" + text};
  for (const std::string& odd : texts) {
    const std::string path = write("odd.obj", odd);
    ASSERT_EQ(refusal(path), "") << odd;
    const TriangleSoup soup = import_mesh(path, 1).soup;
    EXPECT_EQ(soup.vertices_body_m, plain.vertices_body_m) << odd;
    EXPECT_EQ(soup.triangles, plain.triangles) << odd;
  }
}

TEST_F(MeshImport, words_of_an_obj_that_are_no_numbers_are_named_with_their_line) {
  const std::vector<std::array<std::string, 3>> cases{
      {"v 1 0 0", "v 1m 0 0", "line 2: expected a finite number, got \"1m\""},
      {"v 1 0 0", "v 1d0 0 0", "line 2: expected a finite number, got \"1d0\""},
      {"v 1 0 0", "v l O O", "line 2: expected a finite number, got \"l\""},
      {"v 1 0 0", "v 1 \\\n0 nan", "line 2: expected a finite number, got \"nan\""},
      {"v 1 0 0", "v 1 0", "line 2: expected three numbers behind v"},
      {"f 1 2 5", "f 1 2 50", "line 13: there is no vertex 50 among 8"},
      {"f 1 2 5", "f 1 2 -9", "line 13: there is no vertex -9 among 8"},
      {"f 1 2 5", "f 0 1 4", "line 13: vertices are counted from 1, got 0"},
      {"f 1 2 5", "f 1 2 5.5", "line 13: expected the number of a vertex, got \"5.5\""},
      {"f 1 2 5", "f 1 2", "line 13: a face needs three vertices"}};
  for (const auto& [from, to, flaw] : cases) {
    std::string text = obj(cube());
    text.replace(text.find(from), from.size(), to);
    expect_in(flaw, refusal(write("a.obj", text)));
  }
  expect_in("no vertex in the file", refusal(write("a.obj", "# nothing\n")));
}

TEST_F(MeshImport, decimal_commas_are_named) {
  std::string text = obj(cube());
  text.replace(text.find("v 1 0 0"), 7, "v 1,0 0,0 0,0");
  expect_in("line 2: decimal comma", refusal(write("a.obj", text)));
}

TEST_F(MeshImport, numbers_that_are_not_finite_are_refused) {
  for (const char* bad : {"nan", "inf", "-inf", "1e400"}) {
    std::string text = obj(cube());
    text.replace(text.find("v 1 0 0"), 7, std::string("v ") + bad + " 0 0");
    EXPECT_NE(refusal(write("a.obj", text)), "") << bad;
  }
}

TEST_F(MeshImport, hole_is_refused_with_its_place) {
  TriangleSoup soup = cube();
  soup.triangles.pop_back();
  const std::string why = refusal_of_obj(soup);
  expect_in("not closed: edge ", why);
  expect_in(" m has a triangle on one side only", why);
  expect_in("and 2 more such places", why);
}

TEST_F(MeshImport, edge_of_four_triangles_is_refused_with_its_place) {
  TriangleSoup soup = cube();
  soup.vertices_body_m.emplace_back(0.5, -1, -1);
  soup.vertices_body_m.emplace_back(0.5, -2, -1);
  const std::vector<std::array<VertexId, 3>> fin{{0, 1, 8}, {0, 9, 1}, {0, 8, 9}, {1, 9, 8}};
  soup.triangles.insert(soup.triangles.end(), fin.begin(), fin.end());
  expect_in("at (0.5, 0, 0) m joins 4 triangles", refusal_of_obj(soup));
}

TEST_F(MeshImport, flipped_and_inside_out_triangles_are_mended) {
  TriangleSoup flipped = cube(), inside_out = cube();
  for (const std::size_t t : {std::size_t{1}, std::size_t{6}, std::size_t{7}}) {
    std::swap(flipped.triangles[t][0], flipped.triangles[t][1]);
  }
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  const ImportedMesh a = import_mesh(write("a.obj", obj(flipped)), 1);
  EXPECT_NEAR(a.report.volume_m3, 1, 1e-12);
  ASSERT_EQ(a.mended.size(), 1u);
  EXPECT_EQ(a.mended[0], "3 triangles turned outward");
  EXPECT_NEAR(import_mesh(write("b.obj", obj(inside_out)), 1).report.volume_m3, 1, 1e-12);
}

TEST_F(MeshImport, cavity_stays_a_cavity) {
  const TriangleSoup soup = test::joined(cube(3), test::moved(cube(1), Vec3(1, 1, 1)));
  EXPECT_NEAR(import_mesh(write("a.obj", obj(soup)), 1).report.volume_m3, 26, 1e-10);
}

// The second one's first corner is in the first one, which makes it no cavity.
TEST_F(MeshImport, parts_that_cross_are_wrapped_together) {
  const TriangleSoup one = test::ellipsoid(3, Vec3::Constant(0.03));
  TriangleSoup other = test::moved(one, Vec3(0.03, 0, 0));
  const auto inside = std::ranges::find_if(other.triangles, [&](const auto& t) {
    return std::ranges::all_of(t, [&](VertexId v) { return other.vertices_body_m[v].norm() < 0.02; });
  });
  ASSERT_NE(inside, other.triangles.end());
  std::swap(*inside, other.triangles.front());
  const double ball_m3 = import_mesh(write("ball.obj", obj(one)), 1).report.volume_m3, lens_m3 = ball_m3 * 5 / 16;
  const ImportedMesh both =
      import_wrapped(write("both.obj", obj(test::joined(one, other))), 1, {.part = "", .size_m = 0.003});
  EXPECT_NEAR(both.report.volume_m3 / (2 * ball_m3 - lens_m3), 1, 0.02);
}

TEST_F(MeshImport, duplicate_vertices_and_triangles_are_mended) {
  TriangleSoup soup = cube();
  soup.vertices_body_m.push_back(soup.vertices_body_m[3] + Vec3(4e-7, -4e-7, 4e-7));
  soup.triangles[1][2] = 8;
  soup.triangles.push_back({1, 2, 3});
  soup.triangles.push_back({5, 5, 6});
  const ImportedMesh mesh = import_mesh(write("a.obj", obj(soup)), 1);
  EXPECT_EQ(mesh.report.vertices, 8u);
  EXPECT_EQ(mesh.report.triangles, 12u);
}

TEST_F(MeshImport, surface_through_itself_is_refused_with_its_place) {
  TriangleSoup soup = cube();
  soup.vertices_body_m[7] = Vec3(-0.5, -0.5, -0.5);
  const std::string why = refusal_of_obj(soup);
  expect_in("goes through itself: ", why);
  expect_in(" m", why);
}

TEST_F(MeshImport, two_parts_may_not_touch_or_cross) {
  for (const double shift : {0.5, 1.0, 1.5}) {
    const std::string why = refusal_of_obj(test::joined(cube(), test::moved(cube(), Vec3(shift, 0.25, 0.25))));
    EXPECT_EQ(why.empty(), shift > 1) << shift << why;
  }
}

// Damaged PLY files drive the reader into crashes and endless loops; the caller only ever sees an InputError.
TEST_F(MeshImport, hostile_ply_files_neither_hang_nor_crash) {
  test::Random random(20240711);
  ImportLimits limits;
  limits.time_s = 0.3;
  limits.memory_bytes = 500'000'000;
  const std::string good = ply(cube());
  int refused = 0;
  for (int i = 0; i < 80; ++i) {
    std::string bytes = good;
    for (unsigned k = 1 + random() % 8; k > 0; --k) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 4) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:
          bytes.erase(at, 1 + random() % 20);
          break;
        case 2:
          bytes.insert(at, std::to_string(random()));
          break;
        default:
          bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 40));
      }
    }
    const std::string path = write("m.ply", bytes);
    refused += !refusal(path, 1, limits).empty();
  }
  EXPECT_GT(refused, 40);
}

TEST_F(MeshImport, file_name_with_spaces_and_dashes_is_just_a_name) {
  EXPECT_EQ(refusal(write("--max 1; $(x) ü.obj", obj(cube()))), "");
}

// Organs that lie beside the checkout on some machines; not part of the project.
TEST(MeshImportReal, organs_are_read_and_the_thin_wall_through_itself_is_refused) {
  const fs::path folder = fs::path(SECTIO_SOURCE_DIR).parent_path() / "shared" / "meshes";
  if (!fs::exists(folder)) GTEST_SKIP() << "no " << folder;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".obj") continue;
    if (entry.path().filename() == "gallbladder_hra_2k4.obj") {
      try {
        import_mesh(entry.path().string(), 1);
        ADD_FAILURE() << "accepted " << entry.path();
      } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("goes through itself: 11 pairs"), std::string::npos) << error.what();
      }
      continue;
    }
    const ImportedMesh mesh = import_mesh(entry.path().string(), 1);
    EXPECT_EQ(mesh.report.components, 1u) << entry.path();
    EXPECT_EQ(mesh.report.euler_characteristic, 2) << entry.path();
    EXPECT_GT(mesh.report.volume_m3, 1e-4) << entry.path();
  }
}

TEST(MeshImportOwn, committed_meshes_are_what_the_generator_makes) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "make_meshes";
  const fs::path meshes = fs::path(SECTIO_SOURCE_DIR) / "deploy" / "meshes";
  EXPECT_EQ(
      std::system((program.string() + " --check '" + meshes.string() + "' liver_2k kidney_2k paper_box tray").c_str()),
      0);
}

TEST(MeshImportOwn, organs_of_the_project_are_valid_and_even) {
  int count = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(SECTIO_SOURCE_DIR) / "deploy" / "meshes")) {
    if (entry.path().extension() != ".obj") continue;
    ++count;
    const ImportedMesh mesh = import_mesh(entry.path().string(), 1);
    EXPECT_TRUE(mesh.mended.empty()) << entry.path() << ": " << mesh.mended[0];
    EXPECT_EQ(mesh.report.euler_characteristic, 2) << entry.path();
    EXPECT_EQ(mesh.report.components, 1u) << entry.path();
    double greatest_cosine = -1;
    for (const auto& t : mesh.soup.triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3& a = mesh.soup.vertices_body_m[t[i]];
        const Vec3 u = mesh.soup.vertices_body_m[t[(i + 1) % 3]] - a, v = mesh.soup.vertices_body_m[t[(i + 2) % 3]] - a;
        greatest_cosine = std::max(greatest_cosine, u.normalized().dot(v.normalized()));
      }
    }
    EXPECT_LT(greatest_cosine, std::cos(25 * M_PI / 180)) << entry.path();
  }
  EXPECT_GE(count, 5);
}

}  // namespace
}  // namespace sectio::scene_test
