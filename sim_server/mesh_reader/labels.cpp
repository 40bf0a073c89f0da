#include "sim_server/mesh_reader/labels.h"

#include <nifti1_io.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <vector>

namespace sectio {
namespace {

constexpr std::size_t kLabelsTold = 12;

using Image = std::unique_ptr<nifti_image, decltype(&nifti_image_free)>;

// An image that was torn off would be read as far as it goes, and the rest as zeros.
void check_whole(const nifti_image& header) {
  const gzFile file = gzopen(header.iname, "rb");  // reads what is not compressed as well
  if (file == nullptr) throw std::runtime_error("can't be read");
  std::vector<char> some(1 << 20);
  std::uint64_t bytes = 0;
  int got = 0;
  do {
    got = gzread(file, some.data(), static_cast<unsigned>(some.size()));
    bytes += static_cast<std::uint64_t>(std::max(0, got));
  } while (got > 0);
  const bool closed_well = gzclose_r(file) == Z_OK;  // not when the stream ended in its middle
  if (got < 0 || !closed_well) throw std::runtime_error("damaged file: its compressed data are not whole");
  const double needed =
      std::max(0.0, static_cast<double>(header.iname_offset)) + static_cast<double>(header.nvox) * header.nbyper;
  if (static_cast<double>(bytes) < needed)
    throw std::runtime_error("damaged file: it ends after " + std::to_string(bytes) + " of " +
                             std::to_string(static_cast<std::uint64_t>(needed)) + " bytes");
}

Image read_image(const std::string& path) {
  nifti_set_debug_level(0);
  Image image(nifti_image_read(path.c_str(), 0), &nifti_image_free);  // the header
  const std::string flaw = "damaged file, or not a NIfTI image";
  if (!image || image->iname == nullptr) throw std::runtime_error(flaw);
  check_whole(*image);
  if (nifti_image_load(image.get()) != 0 || image->data == nullptr) throw std::runtime_error(flaw);
  const auto voxels = static_cast<double>(image->nx) * image->ny * image->nz;
  if (image->nx < 1 || image->ny < 1 || image->nz < 1 || voxels != static_cast<double>(image->nvox))
    throw std::runtime_error("expected an image of three dimensions");
  return image;
}

template <class T>
std::vector<std::int32_t> rounded(const nifti_image& image) {
  const bool scaled = image.scl_slope != 0;
  const auto* from = static_cast<const T*>(image.data);
  std::vector<std::int32_t> labels(image.nvox);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const double value = static_cast<double>(from[i]) * (scaled ? image.scl_slope : 1) + (scaled ? image.scl_inter : 0);
    if (!(std::abs(value) < std::numeric_limits<std::int32_t>::max()) || value != std::round(value))
      throw std::runtime_error("its voxels are no labels: one has the value " + std::to_string(value));
    labels[i] = static_cast<std::int32_t>(value);
  }
  return labels;
}

std::vector<std::int32_t> labels_of(const nifti_image& image) {
  switch (image.datatype) {
    case DT_UINT8:
      return rounded<std::uint8_t>(image);
    case DT_INT8:
      return rounded<std::int8_t>(image);
    case DT_UINT16:
      return rounded<std::uint16_t>(image);
    case DT_INT16:
      return rounded<std::int16_t>(image);
    case DT_UINT32:
      return rounded<std::uint32_t>(image);
    case DT_INT32:
      return rounded<std::int32_t>(image);
    case DT_FLOAT32:
      return rounded<float>(image);
    case DT_FLOAT64:
      return rounded<double>(image);
    default:
      throw std::runtime_error("its voxels are no labels: expected whole numbers");
  }
}

Eigen::Affine3d voxels_to_m(const nifti_image& image) {
  const double unit_m = image.xyz_units == NIFTI_UNITS_METER ? 1 : image.xyz_units == NIFTI_UNITS_MICRON ? 1e-6 : 1e-3;
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  if (image.sform_code > 0 || image.qform_code > 0) {
    const mat44& m = image.sform_code > 0 ? image.sto_xyz : image.qto_xyz;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column) map(row, column) = m.m[row][column];
  } else {
    map.linear() = Vec3(image.dx, image.dy, image.dz).asDiagonal();
  }
  map.matrix().topRows<3>() *= unit_m;
  const double volume_m3 = std::abs(map.linear().determinant());
  if (!(volume_m3 > 0 && std::isfinite(volume_m3) && map.matrix().allFinite()))
    throw std::runtime_error("its voxels have no size");
  return map;
}

std::set<std::int32_t> chosen_labels(const std::string& text, const std::vector<std::int32_t>& labels) {
  std::set<std::int32_t> present(labels.begin(), labels.end());
  present.erase(0);
  if (text.empty()) return present;
  std::set<std::int32_t> chosen;
  for (const char* at = text.data(); at != text.data() + text.size();) {
    std::int32_t label = 0;
    const auto [end, error] = std::from_chars(at, text.data() + text.size(), label);
    const bool ends = end == text.data() + text.size();
    if (error != std::errc() || !(ends || *end == ','))
      throw std::runtime_error("part: expected numbers of labels, apart by commas, got " + text);
    if (!present.contains(label)) {
      std::string there;
      std::size_t told = 0;
      for (const std::int32_t l : present)
        if (told++ < kLabelsTold) there += (there.empty() ? "" : ", ") + std::to_string(l);
      throw std::runtime_error("no label " + std::to_string(label) + "; there are " +
                               (present.size() > kLabelsTold ? there + ", ..." : there));
    }
    chosen.insert(label);
    at = ends ? end : end + 1;
  }
  return chosen;
}

class Faces {
 public:
  Faces(const nifti_image& image, std::uint64_t max_triangles)
      : count_{image.nx, image.ny, image.nz}, max_triangles_(max_triangles) {}

  TriangleSoup run(const std::vector<bool>& in, const Eigen::Affine3d& to_m) {
    mirrored_ = to_m.linear().determinant() < 0;
    std::array<std::int64_t, 3> at{};
    for (at[2] = 0; at[2] < count_[2]; ++at[2])
      for (at[1] = 0; at[1] < count_[1]; ++at[1])
        for (at[0] = 0; at[0] < count_[0]; ++at[0])
          if (in[voxel(at)]) voxel_faces(in, at);
    for (Vec3& p : soup_.vertices_body_m) p = to_m * (p - Vec3::Constant(0.5));
    return std::move(soup_);
  }

 private:
  std::size_t voxel(const std::array<std::int64_t, 3>& at) const {
    return static_cast<std::size_t>((at[2] * count_[1] + at[1]) * count_[0] + at[0]);
  }

  void voxel_faces(const std::vector<bool>& in, const std::array<std::int64_t, 3>& at) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        std::array<std::int64_t, 3> beside = at;
        beside[axis] += 2 * side - 1;
        const bool inner = beside[axis] >= 0 && beside[axis] < count_[axis] && in[voxel(beside)];
        if (!inner) add(at, axis, side);
      }
  }

  void add(const std::array<std::int64_t, 3>& at, std::size_t axis, int side) {
    if (soup_.triangles.size() + 2 > max_triangles_)
      throw std::runtime_error("more than " + std::to_string(max_triangles_) + " triangles");
    std::array<VertexId, 4> v{};
    for (std::size_t i = 0; i < 4; ++i) {  // around the face, counterclockwise from the side to which the axis points
      std::array<std::int64_t, 3> corner = at;
      corner[axis] += side;
      corner[(axis + 1) % 3] += i == 1 || i == 2;
      corner[(axis + 2) % 3] += i >= 2;
      v[i] = vertex(corner);
    }
    if ((side == 0) != mirrored_) std::swap(v[1], v[3]);
    soup_.triangles.push_back({v[0], v[1], v[2]});
    soup_.triangles.push_back({v[0], v[2], v[3]});
  }

  VertexId vertex(const std::array<std::int64_t, 3>& corner) {
    const auto key =
        static_cast<std::uint64_t>((corner[2] * (count_[1] + 1) + corner[1]) * (count_[0] + 1) + corner[0]);
    const auto [found, is_new] = number_.try_emplace(key, static_cast<VertexId>(soup_.vertices_body_m.size()));
    if (is_new)
      soup_.vertices_body_m.emplace_back(static_cast<double>(corner[0]), static_cast<double>(corner[1]),
                                         static_cast<double>(corner[2]));
    return found->second;
  }

  std::array<std::int64_t, 3> count_;
  std::uint64_t max_triangles_;
  bool mirrored_ = false;
  TriangleSoup soup_;
  std::unordered_map<std::uint64_t, VertexId> number_;  // by corner; only looked up, never iterated
};

}  // namespace

TriangleSoup label_surface(const std::string& path, const std::string& labels, std::uint64_t max_triangles) {
  const Image image = read_image(path);
  const std::vector<std::int32_t> label = labels_of(*image);
  const std::set<std::int32_t> chosen = chosen_labels(labels, label);
  std::vector<bool> in(label.size());
  for (std::size_t i = 0; i < in.size(); ++i) in[i] = chosen.contains(label[i]);
  TriangleSoup soup = Faces(*image, max_triangles).run(in, voxels_to_m(*image));
  if (soup.triangles.empty()) throw std::runtime_error("no voxel in the image has a label");
  return soup;
}

}  // namespace sectio
