// CGAL: a polygon soup is oriented (which cuts it at non-manifold edges and counts them), made a
// Surface_mesh, and where it is closed turned outward.
#include "npy.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

// What the orientation tells of: it is copied on its way, so it holds references. An edge is told of once
// for each of its triangles. A vertex that it duplicates is led back to the one of the input.
struct Watch : PMP::Default_orientation_visitor {
  std::set<std::pair<std::size_t, std::size_t>>& edges;
  std::vector<std::size_t>& origin;
  Watch(std::set<std::pair<std::size_t, std::size_t>>& e, std::vector<std::size_t>& o) : edges(e), origin(o) {}
  void non_manifold_edge(std::size_t a, std::size_t b, std::size_t) { edges.emplace(std::min(a, b), std::max(a, b)); }
  void duplicated_vertex(std::size_t from, std::size_t to) {
    if (origin.size() <= to) origin.resize(to + 1, 0);
    origin[to] = from;
  }
};

int main(int argc, char** argv) {
  if (argc < 3) peer::fail("usage: cgal V.npy G.npy [OUT.npy]");
  peer::Phases phases;
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> triangles;
  {
    const auto v = peer::load_triangles(argv[1]);
    const auto g = peer::load<float>(argv[2], "<f4");
    points.reserve(g.size() / 3);
    for (std::size_t i = 0; i < g.size(); i += 3) points.emplace_back(g[i], g[i + 1], g[i + 2]);
    triangles.reserve(v.size() / 3);
    for (std::size_t i = 0; i < v.size(); i += 3) triangles.push_back({v[i], v[i + 1], v[i + 2]});
  }
  phases.done("load");
  std::set<std::pair<std::size_t, std::size_t>> nonmanifold;
  std::vector<std::size_t> origin;
  const std::size_t vertices = points.size();
  Watch watch(nonmanifold, origin);
  PMP::orient_polygon_soup(points, triangles, CGAL::parameters::visitor(watch));
  phases.done("orientation");
  phases.answer("nonmanifold_edges", nonmanifold.size());
  if (!PMP::is_polygon_soup_a_polygon_mesh(triangles)) peer::fail("is_polygon_soup_a_polygon_mesh says no after orient_polygon_soup");
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  phases.done("opposites");
  const std::size_t faces = mesh.number_of_faces();
  std::vector<std::array<std::size_t, 3>>().swap(triangles);
  std::vector<Kernel::Point_3>().swap(points);
  auto label = mesh.add_property_map<Mesh::Face_index, std::size_t>("f:label", 0).first;
  const std::size_t components = PMP::connected_components(mesh, label);
  phases.done("components");
  phases.answer("components", components);
  std::uint64_t border = 0;
  for (auto h : mesh.halfedges()) border += mesh.is_border(h);
  phases.done("border");
  phases.answer("opposites", mesh.number_of_halfedges() - 2 * border);
  phases.answer("corners_without_opposite", border);
  if (CGAL::is_closed(mesh)) {
    PMP::orient(mesh);
    phases.done("outward");
  } else {
    phases.note("not closed, so not turned outward: PMP::orient wants a closed mesh");
  }
  phases.end();
  if (argc > 3) {
    std::vector<std::uint32_t> out;
    out.reserve(3 * faces);
    for (auto f : mesh.faces())
      for (auto u : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) {
        std::size_t id = u.idx();
        while (id >= vertices) id = origin[id];
        out.push_back(static_cast<std::uint32_t>(id));
      }
    peer::save(argv[3], out);
  }
}
