// Vectors and poses. SI units everywhere; frames are named in suffixes: _world, _body, _rest.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace sectio {

using Vec3 = Eigen::Vector3d;
using Vec3f = Eigen::Vector3f;
using Vec4f = Eigen::Vector4f;
using Mat3 = Eigen::Matrix3d;

// A rigid transform from a local frame to the world.
struct Pose {
  Vec3 position_m = Vec3::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();

  Vec3 to_world(const Vec3& local_m) const { return position_m + orientation * local_m; }
  Vec3 to_local(const Vec3& world_m) const { return orientation.conjugate() * (world_m - position_m); }
};

// Linear in position, shortest arc in orientation; s in [0, 1].
inline Pose interpolate(const Pose& a, const Pose& b, double s) {
  return {a.position_m + s * (b.position_m - a.position_m), a.orientation.slerp(s, b.orientation)};
}

// The pose of an instrument that may have a joint.
struct JointPose : Pose {
  JointPose(const Pose& pose = {}, double opening = 0) : Pose(pose), opening_rad(opening) {}

  double opening_rad = 0;  // between the blades of scissors
};
constexpr double kWidestOpening_rad = 3.1415926535897932;

constexpr double kStandardGravity_m_per_s2 = 9.81;

}  // namespace sectio
