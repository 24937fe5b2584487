// Draco's own CornerTable. It matches triangles only where they agree in orientation.
#include "npy.hpp"

#include <draco/mesh/corner_table.h>
#include <draco/mesh/mesh_connected_components.h>

int main(int argc, char** argv) {
  if (argc < 2) peer::fail("usage: draco V.npy");
  peer::Phases phases;
  draco::IndexTypeVector<draco::FaceIndex, draco::CornerTable::FaceType> faces;
  {
    const auto v = peer::load_triangles(argv[1]);
    faces.resize(v.size() / 3);
    for (std::uint32_t t = 0; t < v.size() / 3; ++t)
      for (int k = 0; k < 3; ++k) faces[draco::FaceIndex(t)][k] = draco::VertexIndex(v[3 * std::size_t(t) + k]);
  }
  phases.done("load");
  const auto table = draco::CornerTable::Create(faces);
  if (!table) peer::fail("CornerTable::Create returned null");
  phases.done("opposites");
  draco::MeshConnectedComponents components;
  components.FindConnectedComponents(table.get());
  phases.done("components");
  phases.answer("components", components.NumConnectedComponents());
  std::uint64_t matched = 0, open = 0;
  for (int c = 0; c < table->num_corners(); ++c) {
    const draco::CornerIndex corner(c);
    if (table->IsDegenerated(table->Face(corner))) continue;
    const bool has = table->Opposite(corner) != draco::kInvalidCornerIndex;
    matched += has;
    open += !has;
  }
  phases.done("border");
  phases.answer("opposites", matched);
  phases.answer("corners_without_opposite", open);
  phases.end();
}
