// Receivers taken together, up to 2 x 2 texels of a chart: light that has bounced before is as smooth as that, and
// there are a quarter as many to follow it between.
#pragma once

#include <bake/gather.h>
#include <bake/links.h>
#include <bake/sparse_light.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// Immutable; numbered by their first receivers, so that neighbours in space have numbers near each other. Models'
// receivers, texels of a mesh's own unwrap and those of more than a quarter of a square metre are blocks by themselves.
class ReceiverBlocks {
   public:
    explicit ReceiverBlocks(const Gatherer& gatherer);

    size_t size() const { return first_.size() - 1; }
    uint32_t of(size_t receiver) const { return of_receiver_[receiver]; }
    std::span<const uint32_t> receivers(size_t block) const {
        return std::span(receivers_).subspan(first_[block], first_[block + 1] - first_[block]);
    }
    std::span<const float> areasM2() const { return area_m2_; }
    glm::vec3 reflectance(size_t block) const { return reflectance_[block]; }  // the mean
    uint32_t condition(size_t block) const { return condition_[block]; }       // as Gatherer::conditionOf()

    // As many of the links of a block's receivers as one of them has on average, from block to block: of n receivers
    // every n-th link.
    Links links(const Links& of_receivers) const;
    // Of light that arrives at receivers, what gives each block's reflectance the same flux to send on.
    SparseLight arriving(const SparseLight& at_receivers, uint32_t terms) const;

   private:
    const Gatherer& gatherer_;
    std::vector<uint32_t> of_receiver_, receivers_, first_, condition_;
    std::vector<float> area_m2_;
    std::vector<glm::vec3> reflectance_;
};

}  // namespace dimmer::cook
