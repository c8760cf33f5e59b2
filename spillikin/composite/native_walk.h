// A frame without an order: rays walk through the mesh from face to face. Each costs what it crosses, however many
// cells there are, where projecting costs every cell its set-up: the quicker way where cells are no larger than some
// pixels.
//
// Each picture is certified. On every pixel's line the faces by which it enters the mesh and those by which it leaves
// are the same in number, every walk ends at an exterior face, none goes back by more than rounding, and the next
// begins no sooner than the last ended. A pixel on which that fails (its centre lies on an edge or a corner, to the
// last digit) is tried again some thousandths of a pixel away; where that does not help, cells overlap, and the frame
// needs an order.
#pragma once

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "spillikin/composite/compositor.h"
#include "spillikin/composite/native_cell.h"
#include "spillikin/composite/native_links.h"
#include "spillikin/composite/native_screen.h"
#include "spillikin/composite/native_walk_kernel.h"

namespace spillikin::composite::native {

// Whether walking is the quicker way: by the size of some of the cells on the screen. Constant time.
bool walkPays(const Frame& frame);

class Walk {
 public:
  Walk();
  ~Walk();

  // Whether a frame can be walked: tetrahedra, exact integration. Keeps what it finds out of the mesh's topology and of
  // the field's hidden cells until those are forgotten.
  bool takes(const Frame& frame);
  void forgetMesh() { linked_ = false; }
  void forgetField() { hidden_known_ = false; }

  // Whether this view of it can be: all of the mesh before the eye, not too far beside the image, at depths that
  // float tells apart well enough for so dense a look.
  bool sees(const Screen& screen);

  // False where pixels remain that cannot be certified, or the tiles' lists of faces would not fit the memory promised:
  // the image means nothing then.
  bool draw(const Screen& screen, Image& image, FrameStats& stats);

 private:
  class Painter;
  bool setFineness(const Screen& screen);
  bool drawRegion(const Screen& screen, const Box& region, Image& image, FrameStats& stats);
  void setHidden(const Frame& frame);
  void setPoints(const Screen& screen);
  bool findTiles(const Screen& screen);
  // The tiles that an exterior face's pixels may lie in; none where last < first.
  struct TileRange {
    std::uint16_t x0 = 1, y0 = 1, x1 = 0, y1 = 0;
  };
  TileRange tilesOf(const Entrance& entrance) const;
  template <class Visit>
  void visitTiles(const TileRange& range, const Visit& visit) const;
  bool paint(const Screen& screen, Image& image, FrameStats& stats);

  Links links_;
  bool linked_ = false;               // the links are those of the mesh, or it has none
  std::vector<std::int32_t> hidden_;  // empty where no cell is; see WalkFrame
  bool hidden_known_ = false;
  WalkFrame frame_;
  PieceTable pieces_;
  std::vector<WalkPoint> points_;
  // The part of the image that is being drawn, and the exterior faces that the pixels of each of its tiles may meet:
  // face_[offset_[tile] .. offset_[tile + 1]).
  Box region_;
  int columns_ = 0, rows_ = 0;
  WalkPlace first_;               // the centre of the region's first pixel
  std::vector<TileRange> range_;  // per exterior face
  std::vector<std::uint32_t> offset_, face_;
  tbb::enumerable_thread_specific<std::unique_ptr<Painter>> painters_;
};

}  // namespace spillikin::composite::native
