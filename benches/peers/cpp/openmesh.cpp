// OpenMesh: faces are added one by one; a face that would make an edge or a vertex complex is refused,
// and counted. It has no function for components: a search over the faces around each, as its users write.
#include "npy.hpp"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>

using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;

int main(int argc, char** argv) {
  if (argc < 3) peer::fail("usage: openmesh V.npy G.npy");
  omerr().disable();  // It prints a line for each face that it refuses.
  peer::Phases phases;
  Mesh mesh;
  const auto v = peer::load_triangles(argv[1]);
  std::vector<Mesh::VertexHandle> vertices;
  {
    const auto g = peer::load<float>(argv[2], "<f4");
    mesh.reserve(g.size() / 3, v.size() / 2, v.size() / 3);
    vertices.reserve(g.size() / 3);
    for (std::size_t i = 0; i < g.size(); i += 3) vertices.push_back(mesh.add_vertex(Mesh::Point(g[i], g[i + 1], g[i + 2])));
  }
  phases.done("load");
  std::uint64_t refused = 0;
  for (std::size_t i = 0; i < v.size(); i += 3)
    refused += !mesh.add_face(vertices[v[i]], vertices[v[i + 1]], vertices[v[i + 2]]).is_valid();
  phases.done("opposites");
  phases.answer("refused_triangles", refused);
  std::uint64_t components = 0;
  std::vector<char> seen(mesh.n_faces(), 0);
  std::vector<Mesh::FaceHandle> stack;
  for (auto first : mesh.faces()) {
    if (seen[first.idx()]) continue;
    ++components;
    seen[first.idx()] = 1;
    stack.push_back(first);
    while (!stack.empty()) {
      const auto face = stack.back();
      stack.pop_back();
      for (auto it = mesh.cff_iter(face); it.is_valid(); ++it)
        if (!seen[it->idx()]) {
          seen[it->idx()] = 1;
          stack.push_back(*it);
        }
    }
  }
  phases.done("components");
  phases.answer("components", components);
  std::uint64_t border = 0;
  for (auto e : mesh.edges()) border += mesh.is_boundary(e);
  phases.done("border");
  phases.answer("border_edges", border);
  phases.answer("opposites", 2 * (mesh.n_edges() - border));
  phases.end();
}
