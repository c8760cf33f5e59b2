// A mesh in memory to an image in memory.
#include <spillikin/base/error.h>
#include <spillikin/render/session.h>
#include <cstdio>

int main() try {
  spillikin::mesh::Source source;  // one tetrahedron with a value at each corner
  source.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  source.types = {spillikin::mesh::vtk_cell::tetra};
  source.offsets = {0, 4};
  source.connectivity = {0, 1, 2, 3};
  source.arrays = {{"height", spillikin::mesh::Association::points, 1, {0.0, 0.2, 0.6, 1.0}}};
  spillikin::render::Session session(source);
  session.setView(session.defaultView(320, 240));
  const spillikin::Image image = session.draw();
  std::printf("%d x %d pixels, opacity %.3f\n", image.width, image.height, image.pixel(130, 150)[3]);
} catch (const spillikin::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
