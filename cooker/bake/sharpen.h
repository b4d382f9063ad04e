// From means over texels to texels that bilinear filtering shows those means of.
#pragma once

#include <bake/bake.h>
#include <charts/bilinear.h>

namespace dimmer::cook {

// A texel's light is gathered as the mean over its points; stored as it is, filtering would blur it a second time, and
// a texel that a wall cuts off would show beside the wall what is a quarter of a metre away from it. Each texel moves
// by what its filtered neighbourhood misses of its own mean: one step of van Cittert's deconvolution (1931), exact
// where light is of the second degree across whole texels. Of a step, the share that its noise explains is left out
// (as James and Stein shrink an estimate), and no texel loses more than half. Terms are sharpened apart; a neighbour
// without the term asks for no step. Linear in time and in entries; deterministic. Works in place: of what was before
// it keeps `near_blocks` blocks of rows, and what is read further behind; how many changes no result.
Sparse<ReceiverLight> sharpen(const BilinearTaps& taps, Sparse<ReceiverLight> light, Progress& progress,
                              uint32_t near_blocks = 256);

}  // namespace dimmer::cook
