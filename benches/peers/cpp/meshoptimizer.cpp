// meshoptimizer: adjacency as a geometry shader wants it, the vertex across each edge. It looks for the
// same edge in the other direction, so it too matches triangles only where they agree in orientation.
// Where there is none, the place holds the vertex of the edge's start: a corner without an opposite.
#include "npy.hpp"

#include <meshoptimizer.h>

int main(int argc, char** argv) {
  if (argc < 3) peer::fail("usage: meshoptimizer V.npy G.npy");
  peer::Phases phases;
  const auto v = peer::load_triangles(argv[1]);
  const auto g = peer::load<float>(argv[2], "<f4");
  phases.done("load");
  std::vector<unsigned int> patches(2 * v.size());
  meshopt_generateAdjacencyIndexBuffer(patches.data(), v.data(), v.size(), g.data(), g.size() / 3, 12);
  phases.done("opposites");
  std::uint64_t open = 0;
  for (std::size_t i = 0; i < patches.size(); i += 2) open += patches[i + 1] == patches[i];
  phases.done("border");
  phases.answer("opposites", v.size() - open);
  phases.answer("corners_without_opposite", open);
  phases.end();
}
