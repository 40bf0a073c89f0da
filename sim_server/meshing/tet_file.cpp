#include "sim_server/meshing/tet_file.h"

#include <algorithm>
#include <map>

#include "common/core/formatted.h"
#include "common/core/write_file.h"
#include "sim_server/meshing/tokenizer.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

// The content of a file before the numbers of its vertices are looked up.
struct RawTets {
  std::vector<Vec3> vertices;
  std::map<std::int64_t, VertexId> number;  // a vertex's number in the file -> its index
  std::vector<std::array<std::int64_t, 4>> tetrahedra;
  std::size_t others = 0;  // elements that are not tetrahedra

  void add_vertex(Tokenizer& tokens, std::int64_t name) {
    Vec3 at;
    for (double& x : at) x = tokens.real();
    if (!number.try_emplace(name, static_cast<VertexId>(vertices.size())).second)
      tokens.fail("vertex " + std::to_string(name) + " is given twice");
    vertices.push_back(at);
  }
  void add_tetrahedron(Tokenizer& tokens) {
    tetrahedra.emplace_back();
    for (std::int64_t& v : tetrahedra.back()) {
      v = tokens.integer();
      if (!number.contains(v)) tokens.fail("no vertex has the number " + std::to_string(v));
    }
  }
};

constexpr int kGmshTetrahedron = 4;

void read_msh_2(Tokenizer& tokens, RawTets& raw) {
  while (!tokens.at_end()) {
    const std::string_view section = tokens.next();
    if (section == "$Nodes") {
      const std::size_t n = tokens.count(4);
      for (std::size_t i = 0; i < n; ++i) raw.add_vertex(tokens, tokens.integer());
    } else if (section == "$Elements") {
      const std::size_t n = tokens.count(3);
      for (std::size_t i = 0; i < n; ++i) {
        tokens.integer();  // its number
        const std::int64_t type = tokens.integer(), tags = tokens.integer();
        if (type != kGmshTetrahedron) {
          ++raw.others;
          tokens.rest_of_line();
          continue;
        }
        for (std::int64_t tag = 0; tag < tags; ++tag) tokens.integer();
        raw.add_tetrahedron(tokens);
      }
    }
  }
}

void read_msh_4(Tokenizer& tokens, RawTets& raw) {
  while (!tokens.at_end()) {
    const std::string_view section = tokens.next();
    if (section == "$Nodes") {
      const std::size_t blocks = tokens.count(4);
      tokens.rest_of_line();
      for (std::size_t b = 0; b < blocks; ++b) {
        tokens.integer(), tokens.integer();  // dimension and number of the entity
        if (tokens.integer() != 0) tokens.fail("nodes with parameters are not read");
        std::vector<std::int64_t> names(tokens.count(4));
        for (std::int64_t& name : names) name = tokens.integer();
        for (const std::int64_t name : names) raw.add_vertex(tokens, name);
      }
    } else if (section == "$Elements") {
      const std::size_t blocks = tokens.count(4);
      tokens.rest_of_line();
      for (std::size_t b = 0; b < blocks; ++b) {
        tokens.integer(), tokens.integer();
        const std::int64_t type = tokens.integer();
        const std::size_t n = tokens.count(2);
        for (std::size_t i = 0; i < n; ++i) {
          tokens.integer();
          if (type == kGmshTetrahedron) {
            raw.add_tetrahedron(tokens);
          } else {
            ++raw.others;
            tokens.rest_of_line();
          }
        }
      }
    }
  }
}

RawTets read_msh(const std::string& path) {
  Tokenizer tokens(path);
  RawTets raw;
  tokens.expect("$MeshFormat");
  const double version = tokens.real();
  if (tokens.integer() != 0) tokens.fail("binary files are not read; save as ASCII");
  if (version >= 4.1 && version < 5)
    read_msh_4(tokens, raw);
  else if (version >= 2 && version < 3)
    read_msh_2(tokens, raw);
  else
    tokens.fail("version " + std::to_string(version) + " is not read; save as 4.1 or 2.2");
  return raw;
}

RawTets read_vtk(const std::string& path) {
  constexpr std::int64_t kTetrahedron = 10;
  Tokenizer tokens(path);
  RawTets raw;
  tokens.expect("#");
  tokens.rest_of_line();
  tokens.at_end();
  tokens.next(), tokens.rest_of_line();  // the title
  if (tokens.next() != "ASCII") tokens.fail("binary files are not read; save as ASCII");
  tokens.expect("DATASET");
  tokens.expect("UNSTRUCTURED_GRID");
  std::vector<std::vector<std::int64_t>> cells;
  while (!tokens.at_end()) {
    const std::string_view section = tokens.next();
    if (section == "POINTS") {
      const std::size_t n = tokens.count(3);
      tokens.next();  // the type of its numbers
      for (std::size_t i = 0; i < n; ++i) raw.add_vertex(tokens, static_cast<std::int64_t>(i));
    } else if (section == "CELLS") {
      cells.resize(tokens.count(2));
      tokens.integer();
      for (auto& cell : cells) {
        cell.resize(tokens.count(1));
        for (std::int64_t& v : cell) v = tokens.integer();
      }
    } else if (section == "CELL_TYPES") {
      if (tokens.count(1) != cells.size()) tokens.fail("one type a cell is needed");
      for (const auto& cell : cells) {
        if (tokens.integer() != kTetrahedron) {
          ++raw.others;
          continue;
        }
        if (cell.size() != 4) tokens.fail("a tetrahedron has four corners");
        for (const std::int64_t v : cell)
          if (!raw.number.contains(v)) tokens.fail("no vertex has the number " + std::to_string(v));
        raw.tetrahedra.push_back({cell[0], cell[1], cell[2], cell[3]});
      }
    } else if (section == "POINT_DATA" || section == "CELL_DATA") {
      break;
    }
  }
  return raw;
}

RawTets read_tetgen(const std::string& path) {
  RawTets raw;
  Tokenizer nodes(fs::path(path).replace_extension(".node").string());
  nodes.skip_comments();
  const std::size_t n = nodes.count(4);
  if (nodes.integer() != 3) nodes.fail("expected 3 dimensions");
  const std::int64_t more = nodes.integer() + nodes.integer();  // attributes and boundary marker
  for (std::size_t i = 0; i < n; ++i) {
    raw.add_vertex(nodes, nodes.integer());
    for (std::int64_t k = 0; k < more; ++k) nodes.real();
  }
  Tokenizer elements(fs::path(path).replace_extension(".ele").string());
  elements.skip_comments();
  const std::size_t count = elements.count(5);
  const std::int64_t corners = elements.integer(), attributes = elements.integer();
  if (corners != 4) elements.fail("expected 4 corners a tetrahedron, got " + std::to_string(corners));
  for (std::size_t i = 0; i < count; ++i) {
    elements.integer();
    raw.add_tetrahedron(elements);
    for (std::int64_t k = 0; k < attributes; ++k) elements.real();
  }
  return raw;
}

std::string extension_of(const std::string& path) {
  return fs::path(path).extension().string();
}

// Keeps the vertices that a tetrahedron uses, in the file's order.
TetFile compact(const RawTets& raw, double unit_m) {
  TetFile file;
  std::vector<VertexId> new_id(raw.vertices.size(), kNone);
  for (const auto& t : raw.tetrahedra)
    for (const std::int64_t v : t) new_id[raw.number.at(v)] = 0;
  for (std::size_t v = 0; v < new_id.size(); ++v) {
    if (new_id[v] == kNone) continue;
    new_id[v] = static_cast<VertexId>(file.mesh.vertices_body_m.size());
    file.mesh.vertices_body_m.push_back(unit_m * raw.vertices[v]);
  }
  const std::size_t unused = raw.vertices.size() - file.mesh.vertices_body_m.size();
  const auto note = [&](std::size_t count, const char* what) {
    if (count == 0) return;
    file.notes.push_back(std::to_string(count));
    file.notes.back() += what;
  };
  note(unused, " vertices of no tetrahedron left out");
  note(raw.others, " elements that are no tetrahedra left out");
  bool all_inverted = !raw.tetrahedra.empty();
  for (const auto& t : raw.tetrahedra) {
    Tetrahedron corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = new_id[raw.number.at(t[i])];
    file.mesh.tetrahedra.push_back(corners);
    all_inverted = all_inverted && tet_volume_m3(file.mesh, corners) < 0;
  }
  if (all_inverted) {
    for (Tetrahedron& t : file.mesh.tetrahedra) std::swap(t[2], t[3]);
    file.notes.emplace_back("corners were counted the other way round");
  }
  return file;
}

std::string to_text(const Vec3& x) {
  return formatted("%.17g %.17g %.17g\n", x.x(), x.y(), x.z());
}

void write_msh(const std::string& path, const TetMesh& mesh) {
  std::string text = formatted("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%zu\n", mesh.vertices_body_m.size());
  for (std::size_t v = 0; v < mesh.vertices_body_m.size(); ++v)
    text += std::to_string(v + 1) + ' ' + to_text(mesh.vertices_body_m[v]);
  text += formatted("$EndNodes\n$Elements\n%zu\n", mesh.tetrahedra.size());
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    const Tetrahedron& t = mesh.tetrahedra[n];
    text += formatted("%zu 4 2 0 0 %u %u %u %u\n", n + 1, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
  }
  write_file(path, text + "$EndElements\n");
}

void write_vtk(const std::string& path, const TetMesh& mesh) {
  std::string text = formatted(
      "# vtk DataFile Version 3.0\ntetrahedra, in metres\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS %zu double\n",
      mesh.vertices_body_m.size());
  for (const Vec3& x : mesh.vertices_body_m) text += to_text(x);
  text += formatted("CELLS %zu %zu\n", mesh.tetrahedra.size(), 5 * mesh.tetrahedra.size());
  for (const Tetrahedron& t : mesh.tetrahedra) text += formatted("4 %u %u %u %u\n", t[0], t[1], t[2], t[3]);
  text += formatted("CELL_TYPES %zu\n", mesh.tetrahedra.size());
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) text += "10\n";
  write_file(path, text);
}

void write_tetgen(const std::string& path, const TetMesh& mesh) {
  std::string nodes = formatted("%zu 3 0 0\n", mesh.vertices_body_m.size());
  for (std::size_t v = 0; v < mesh.vertices_body_m.size(); ++v)
    nodes += std::to_string(v) + ' ' + to_text(mesh.vertices_body_m[v]);
  std::string elements = formatted("%zu 4 0\n", mesh.tetrahedra.size());
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    const Tetrahedron& t = mesh.tetrahedra[n];
    elements += formatted("%zu %u %u %u %u\n", n, t[0], t[1], t[2], t[3]);
  }
  write_file(fs::path(path).replace_extension(".node").string(), nodes);
  write_file(fs::path(path).replace_extension(".ele").string(), elements);
}

constexpr const char* kExpectedName = ": expected a name that ends in .msh, .vtk, .node or .ele";

}  // namespace

bool is_tet_file(const std::string& path) {
  const std::string extension = extension_of(path);
  return extension == ".msh" || extension == ".vtk" || extension == ".node" || extension == ".ele";
}

TetFile read_tet_file(const std::string& path, double unit_m) {
  const std::string extension = extension_of(path);
  if (!is_tet_file(path)) throw InputError(path + kExpectedName);
  const RawTets raw = extension == ".msh" ? read_msh(path) : extension == ".vtk" ? read_vtk(path) : read_tetgen(path);
  if (raw.tetrahedra.empty()) throw InputError(path + ": no tetrahedra in it");
  TetFile file = compact(raw, unit_m);
  if (const TetReport report = check(file.mesh); !report.valid) throw InputError(path + ": " + report.first_defect);
  return file;
}

void check_can_write_tets(const std::string& path) {
  if (!is_tet_file(path)) throw InputError(path + kExpectedName);
  check_can_write(path);
}

void write_tet_file(const std::string& path, const TetMesh& mesh) {
  const std::string extension = extension_of(path);
  if (extension == ".msh") return write_msh(path, mesh);
  if (extension == ".vtk") return write_vtk(path, mesh);
  if (extension == ".node" || extension == ".ele") return write_tetgen(path, mesh);
  throw InputError(path + kExpectedName);
}

}  // namespace sectio
