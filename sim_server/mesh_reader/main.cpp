// mesh_reader FILE MAX_TRIANGLES MAX_MEMORY_BYTES MAX_CPU_S known|any PART
// PART: only nodes and meshes in whose name one of these words, apart by commas, is found; of an image, voxels with
// one of these labels; empty: all.
// The only program that links assimp and the reader of NIfTI. Run by read_mesh_file(), which takes the result from
// descriptor kMeshPipe; may crash or be killed on damaged files, and nothing else is harmed.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/joined.h"
#include "common/core/words.h"
#include "sim_server/mesh_reader/labels.h"
#include "sim_server/mesh_reader/plain_obj.h"
#include "sim_server/scene/mesh_process.h"

namespace sectio {
namespace {

constexpr int kMaxNodeDepth = 200;
constexpr std::size_t kMostOfError = 120;  // some of the importer's messages quote the rest of the file

// A limit that is lower already, of whoever started the program, stays.
void limit_resource(decltype(RLIMIT_CPU) resource, std::uint64_t value) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0) throw std::runtime_error("getrlimit failed");
  limit.rlim_max = std::min(limit.rlim_max, static_cast<rlim_t>(value));
  limit.rlim_cur = std::min(limit.rlim_cur, limit.rlim_max);
  if (setrlimit(resource, &limit) != 0) throw std::runtime_error("setrlimit failed");
}

void limit_process(std::uint64_t memory_bytes, std::uint64_t cpu_s) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  limit_resource(RLIMIT_CORE, 0);
  limit_resource(RLIMIT_FSIZE, 0);
  limit_resource(RLIMIT_CPU, cpu_s);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // their shadow memory is address space too
  limit_resource(RLIMIT_AS, memory_bytes);
#else
  static_cast<void>(memory_bytes);
#endif
}

void write_all(const void* data, std::size_t bytes) {
  const auto* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = ::write(kMeshPipe, from, bytes);
    if (written <= 0) std::_Exit(1);
    from += written;
    bytes -= static_cast<std::size_t>(written);
  }
}

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// "0,25" is read as 0 by assimp: the file would come out as another surface.
void refuse_decimal_commas(const std::string& path, const std::string& extension) {
  if (extension == ".gltf" || extension == ".glb") return;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  const auto digit = [&](std::size_t i) {
    return i < line.size() && std::isdigit(static_cast<unsigned char>(line[i]));
  };
  for (int number = 1; number < 1000 && std::getline(file, line); ++number) {
    const std::size_t start = std::min(line.find_first_not_of(" \t"), line.size());
    const bool coordinates = extension == ".obj"   ? line.compare(start, 2, "v ") == 0
                             : extension == ".stl" ? line.compare(start, 7, "vertex ") == 0
                                                   : digit(start) || line.compare(start, 1, "-") == 0;
    if (!coordinates) continue;
    for (std::size_t i = start + 1; i + 1 < line.size(); ++i) {
      if (line[i] == ',' && digit(i - 1) && digit(i + 1)) {
        throw std::runtime_error("line " + std::to_string(number) + ": decimal comma; write 0.25, not 0,25");
      }
    }
  }
}

class SoupWriter {
 public:
  SoupWriter(std::uint64_t max_triangles, const std::string& part) : max_triangles_(max_triangles) {
    std::istringstream words(lower_case(part));
    for (std::string word; std::getline(words, word, ',');)
      if (!word.empty()) parts_.push_back(word);
  }

  void add_node(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, int depth, bool chosen = false) {
    if (depth > kMaxNodeDepth) throw std::runtime_error("nodes are nested too deeply");
    const aiMatrix4x4 to_scene = parent * node.mTransformation;
    chosen = chosen || is_chosen(node.mName.C_Str());
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *scene.mMeshes[node.mMeshes[i]];
      if (chosen || is_chosen(mesh.mName.C_Str()))
        add_mesh(mesh, to_scene);
      else
        others_.emplace_back(mesh.mName.length > 0 ? mesh.mName.C_Str() : node.mName.C_Str());
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(scene, *node.mChildren[i], to_scene, depth + 1, chosen);
  }

  // Names of the parts that were not taken, for a person.
  std::string others() const {
    const std::string text = joined(std::span(others_).first(std::min<std::size_t>(others_.size(), 12)));
    return others_.size() > 12 ? text + ", ..." : text;
  }

  const TriangleSoup& soup() const { return soup_; }

 private:
  static std::string lower_case(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
  }
  bool is_chosen(const std::string& name) const {
    const auto has = [&](const std::string& part) { return lower_case(name).find(part) != std::string::npos; };
    return parts_.empty() || std::ranges::any_of(parts_, has);
  }

  void add_mesh(const aiMesh& mesh, const aiMatrix4x4& to_scene) {
    const auto offset = static_cast<VertexId>(soup_.vertices_body_m.size());
    const bool mirrored = to_scene.Determinant() < 0;
    if (soup_.triangles.size() + mesh.mNumFaces > max_triangles_ ||
        soup_.vertices_body_m.size() + mesh.mNumVertices > 3 * max_triangles_) {
      throw std::runtime_error("more than " + std::to_string(max_triangles_) + " triangles");
    }
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D p = to_scene * mesh.mVertices[v];
      soup_.vertices_body_m.emplace_back(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      std::array<VertexId, 3> triangle;
      for (std::size_t i = 0; i < 3; ++i) {
        if (face.mIndices[i] >= mesh.mNumVertices) throw std::runtime_error("a face names a vertex that is not there");
        triangle[i] = face.mIndices[i] + offset;
      }
      if (mirrored) std::swap(triangle[1], triangle[2]);
      soup_.triangles.push_back(triangle);
    }
  }

  std::uint64_t max_triangles_;
  std::vector<std::string> parts_;  // empty: all
  std::vector<std::string> others_;
  TriangleSoup soup_;
};

TriangleSoup read(const std::string& path, std::uint64_t max_triangles, bool any_format, const std::string& part) {
  const std::string extension = extension_of(path);
  if (any_format && (extension == ".nii" || path.ends_with(".nii.gz"))) return label_surface(path, part, max_triangles);
  const std::array<std::string, 5> known{".obj", ".stl", ".ply", ".gltf", ".glb"};
  const bool is_known = std::find(known.begin(), known.end(), extension) != known.end();
  if (!is_known && !any_format) {
    throw std::runtime_error("unknown kind of file: expected .obj, .stl, .ply, .gltf or .glb");
  }
  if (is_known) refuse_decimal_commas(path, extension);
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                                          aiComponent_COLORS | aiComponent_TEXCOORDS |
                                                          aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                                          aiComponent_TEXTURES | aiComponent_LIGHTS |
                                                          aiComponent_CAMERAS | aiComponent_MATERIALS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  constexpr unsigned kSteps =
      aiProcess_ValidateDataStructure | aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_SortByPType;
  const std::string mended = extension == ".obj" ? plain_obj(path) : "";
  const aiScene* scene = mended.empty() ? importer.ReadFile(path, kSteps)
                                        : importer.ReadFileFromMemory(mended.data(), mended.size(), kSteps, "obj");
  if (scene == nullptr || scene->mRootNode == nullptr) {
    if (std::string_view(importer.GetErrorString()).find("bad_alloc") != std::string_view::npos) throw std::bad_alloc();
    throw std::runtime_error("damaged file: " + shortened(importer.GetErrorString(), kMostOfError));
  }
  SoupWriter writer(max_triangles, part);
  writer.add_node(*scene, *scene->mRootNode, aiMatrix4x4(), 0);
  if (writer.soup().triangles.empty() && !writer.others().empty())
    throw std::runtime_error("no part with " + part + " in its name; there are " + writer.others());
  if (writer.soup().triangles.empty()) throw std::runtime_error("no triangle in the file");
  return writer.soup();
}

void write_soup(const TriangleSoup& soup) {
  MeshPipeHeader header;
  header.vertices = soup.vertices_body_m.size();
  header.triangles = soup.triangles.size();
  write_all(&header, sizeof header);
  write_all(soup.vertices_body_m.data(), soup.vertices_body_m.size() * sizeof(Vec3));
  write_all(soup.triangles.data(), soup.triangles.size() * sizeof(soup.triangles[0]));
}

void write_failure(std::string why) {
  for (char& c : why) c = std::iscntrl(static_cast<unsigned char>(c)) ? ' ' : c;
  why.resize(std::min<std::size_t>(why.size(), 500));
  MeshPipeHeader header;
  header.status = 1;
  header.vertices = why.size();
  write_all(&header, sizeof header);
  write_all(why.data(), why.size());
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  if (argc != 7) return 2;
  try {
    sectio::limit_process(std::strtoull(argv[3], nullptr, 10), std::strtoull(argv[4], nullptr, 10));
    sectio::write_soup(
        sectio::read(argv[1], std::strtoull(argv[2], nullptr, 10), std::string(argv[5]) == "any", argv[6]));
  } catch (const std::bad_alloc&) {
    sectio::write_failure("damaged file, or one that needs more than the memory allowed");
  } catch (const std::exception& error) {
    sectio::write_failure(error.what());
  }
  std::_Exit(0);  // the importer's own clean-up could still crash
}
