// Blends one batch on the CPU, all of it at each step, so that compilers vectorise it. The same operations in the same
// order as TexelBlend in runtime/format/texel.h, receiver by receiver: the same bits.
#pragma once

#include <format/texel.h>

namespace dimmer {

template <ColorFormat format>
class BatchBlend {
   public:
    // Up to batch_receivers_max.
    explicit BatchBlend(uint32_t receivers) : count_(receivers) {}

    // `records`: one per receiver, canonical or not; the weight carries weightScale(format).
    void add(const TexelRecord* records, float wr, float wg, float wb);
    // One record per receiver.
    void encode(TexelRecord* records) const;

   private:
    using Row = std::array<float, batch_receivers_max>;
    uint32_t count_;
    alignas(64) Row r_{}, g_{}, b_{}, l_{}, d0_{}, d1_{}, d2_{};
};

extern template class BatchBlend<ColorFormat::R11G11B10F>;
extern template class BatchBlend<ColorFormat::E5B9G9R9>;

}  // namespace dimmer
