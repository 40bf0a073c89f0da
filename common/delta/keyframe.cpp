#include "common/delta/keyframe.h"

#include "common/core/error.h"
#include "common/delta/bytes.h"

namespace sectio {

namespace {

constexpr std::uint32_t kKeyframeMagic = 0x32464b53;  // "SKF2"
constexpr std::uint32_t kDeltaMagic = 0x32444c53;     // "SLD2"
constexpr std::size_t kKeyframeHeaderBytes = 40;
constexpr std::size_t kDeltaHeaderBytes = 48;
constexpr std::size_t kVertexBytes = 25;
constexpr std::size_t kTriangleBytes = 13;
constexpr std::size_t kSlotBytes = 4;  // before each edit of a delta

void put_vertex(ByteWriter& out, bool alive, const Vec3& rest_body_m) {
  out.put(static_cast<std::uint8_t>(alive));
  for (int k = 0; k < 3; ++k) out.put(alive ? rest_body_m[k] : 0.0);
}

bool get_vertex(ByteReader& in, bool& alive, Vec3& rest_body_m) {
  const auto flag = in.get<std::uint8_t>();
  alive = flag != 0;
  for (int k = 0; k < 3; ++k) rest_body_m[k] = in.get<double>();
  return flag <= 1 && rest_body_m.allFinite();
}

void put_triangle(ByteWriter& out, const Triangle& triangle) {
  for (const VertexId v : triangle.v) out.put(v);
  out.put(static_cast<std::uint8_t>(triangle.surface));
}

bool get_triangle(ByteReader& in, Triangle& triangle) {
  for (VertexId& v : triangle.v) v = in.get<VertexId>();
  const auto surface = in.get<std::uint8_t>();
  if (surface > static_cast<std::uint8_t>(Surface::wall)) return false;
  triangle.surface = static_cast<Surface>(surface);
  return true;
}

}  // namespace

Keyframe keyframe_of(const TriangleMesh& mesh) {
  Keyframe keyframe{
      mesh.revision(), mesh.hash(), mesh.permanent_hash(), {}, {}, {mesh.triangles().begin(), mesh.triangles().end()}};
  keyframe.rest_body_m.reserve(mesh.vertex_slots());
  keyframe.vertex_alive.reserve(mesh.vertex_slots());
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    keyframe.vertex_alive.push_back(mesh.vertex_alive(v));
    keyframe.rest_body_m.push_back(mesh.vertex_alive(v) ? mesh.rest_body_m(v) : Vec3(Vec3::Zero()));
  }
  return keyframe;
}

std::vector<std::uint8_t> to_bytes(const Keyframe& keyframe) {
  ByteWriter out;
  out.reserve(kKeyframeHeaderBytes + keyframe.rest_body_m.size() * kVertexBytes +
              keyframe.triangles.size() * kTriangleBytes);
  out.put(kKeyframeMagic);
  out.put(std::uint32_t{0});
  out.put(static_cast<std::uint32_t>(keyframe.rest_body_m.size()));
  out.put(static_cast<std::uint32_t>(keyframe.triangles.size()));
  out.put(keyframe.revision);
  out.put(keyframe.hash);
  out.put(keyframe.permanent_hash);
  for (std::size_t v = 0; v < keyframe.rest_body_m.size(); ++v)
    put_vertex(out, keyframe.vertex_alive[v] != 0, keyframe.rest_body_m[v]);
  for (const Triangle& triangle : keyframe.triangles) put_triangle(out, triangle);
  return out.take();
}

std::optional<Keyframe> keyframe_from_bytes(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  if (in.get<std::uint32_t>() != kKeyframeMagic || in.get<std::uint32_t>() != 0) return std::nullopt;
  const std::uint64_t vertices = in.get<std::uint32_t>();
  const std::uint64_t triangles = in.get<std::uint32_t>();
  Keyframe keyframe;
  keyframe.revision = in.get<std::uint64_t>();
  keyframe.hash = in.get<std::uint64_t>();
  keyframe.permanent_hash = in.get<std::uint64_t>();
  if (!in.ok() || in.remaining() != vertices * kVertexBytes + triangles * kTriangleBytes) return std::nullopt;

  keyframe.rest_body_m.resize(vertices);
  keyframe.vertex_alive.resize(vertices);
  keyframe.triangles.resize(triangles);
  for (std::size_t v = 0; v < vertices; ++v) {
    bool alive = false;
    if (!get_vertex(in, alive, keyframe.rest_body_m[v])) return std::nullopt;
    keyframe.vertex_alive[v] = alive;
  }
  for (Triangle& triangle : keyframe.triangles) {
    if (!get_triangle(in, triangle)) return std::nullopt;
    if (triangle.alive())
      for (const VertexId v : triangle.v)
        if (v >= vertices) return std::nullopt;
  }
  return keyframe;
}

std::optional<TriangleMesh> mesh_of(Keyframe keyframe) {
  try {
    TriangleMesh mesh(std::move(keyframe.rest_body_m), std::move(keyframe.vertex_alive), std::move(keyframe.triangles),
                      keyframe.revision, keyframe.permanent_hash);
    if (mesh.hash() == keyframe.hash) return mesh;
  } catch (const InputError&) {
  }
  return std::nullopt;
}

std::vector<std::uint8_t> to_bytes(const TopologyDelta& delta) {
  ByteWriter out;
  out.reserve(kDeltaHeaderBytes + delta.vertices.size() * (kSlotBytes + kVertexBytes) +
              delta.triangles.size() * (kSlotBytes + kTriangleBytes));
  out.put(kDeltaMagic);
  out.put(std::uint32_t{delta.temporary});
  out.put(delta.base_revision);
  out.put(delta.revision);
  out.put(delta.hash_after);
  out.put(delta.vertex_slots_after);
  out.put(delta.triangle_slots_after);
  out.put(static_cast<std::uint32_t>(delta.vertices.size()));
  out.put(static_cast<std::uint32_t>(delta.triangles.size()));
  for (const VertexEdit& edit : delta.vertices) {
    out.put(edit.id);
    put_vertex(out, edit.alive, edit.rest_body_m);
  }
  for (const TriangleEdit& edit : delta.triangles) {
    out.put(edit.id);
    put_triangle(out, edit.triangle);
  }
  return out.take();
}

std::optional<TopologyDelta> delta_from_bytes(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  if (in.get<std::uint32_t>() != kDeltaMagic) return std::nullopt;
  TopologyDelta delta;
  const auto temporary = in.get<std::uint32_t>();
  if (temporary > 1) return std::nullopt;
  delta.temporary = temporary == 1;
  delta.base_revision = in.get<std::uint64_t>();
  delta.revision = in.get<std::uint64_t>();
  delta.hash_after = in.get<std::uint64_t>();
  delta.vertex_slots_after = in.get<std::uint32_t>();
  delta.triangle_slots_after = in.get<std::uint32_t>();
  const std::uint64_t vertices = in.get<std::uint32_t>();
  const std::uint64_t triangles = in.get<std::uint32_t>();
  if (!in.ok() || in.remaining() != vertices * (kSlotBytes + kVertexBytes) + triangles * (kSlotBytes + kTriangleBytes))
    return std::nullopt;

  delta.vertices.resize(vertices);
  delta.triangles.resize(triangles);
  for (VertexEdit& edit : delta.vertices) {
    edit.id = in.get<VertexId>();
    if (!get_vertex(in, edit.alive, edit.rest_body_m)) return std::nullopt;
  }
  for (TriangleEdit& edit : delta.triangles) {
    edit.id = in.get<TriangleId>();
    if (!get_triangle(in, edit.triangle)) return std::nullopt;
  }
  return delta;
}

}  // namespace sectio
