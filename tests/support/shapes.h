// Small closed surfaces for tests.
#pragma once

#include "common/mesh/triangle_mesh.h"

namespace sectio::test {

// An icosahedron subdivided `levels` times (20 * 4^levels triangles), stretched to the given half axes.
TriangleSoup ellipsoid(int levels, const Vec3& half_axes_m);

// A closed box of nx x ny x nz cells, each square of two triangles, with one corner at the origin.
TriangleSoup box(int nx, int ny, int nz, const Vec3& size_m);

// A torus around z: a surface of genus 1.
TriangleSoup torus(int around, int across, double radius_m, double tube_m);

TriangleSoup moved(TriangleSoup soup, const Vec3& by_m);

// Both in one mesh; the vertices of the first come first.
TriangleSoup joined(TriangleSoup one, const TriangleSoup& other);

}  // namespace sectio::test
