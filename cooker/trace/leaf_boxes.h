// The boxes of a level's door leaves, where they are not too many: most rays miss all of them, and those that look for
// doors alone need not be traced.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <glm/glm.hpp>

namespace dimmer::cook {

class LeafBoxes {
   public:
    // `low` and `high`: of one leaf, metres. Past `most` boxes every ray may hit one.
    void add(glm::vec3 low, glm::vec3 high) {
        if (count_++ >= most) return;
        for (size_t a = 0; a < 3; ++a) {
            const auto axis = static_cast<int>(a);
            low_[a][count_ - 1] = low[axis] - margin_m;
            high_[a][count_ - 1] = high[axis] + margin_m;
        }
    }

    // False only where a ray meets no leaf. The slab test, eight boxes at a time.
    bool mayHit(glm::vec3 origin, glm::vec3 direction, float distance_m) const {
        if (count_ > most) return true;
        using Eight [[gnu::vector_size(32)]] = float;
        using Mask [[gnu::vector_size(32)]] = int;
        constexpr size_t lanes = sizeof(Eight) / sizeof(float);
        // Never zero, so that no product is one of zero and infinity.
        constexpr float least = 1e-20f;
        glm::vec3 inverse;
        for (int a = 0; a < 3; ++a)
            inverse[a] = 1 / (std::abs(direction[a]) < least ? std::copysign(least, direction[a]) : direction[a]);
        for (size_t i = 0; i < count_; i += lanes) {
            Eight near = Eight{}, far = Eight{} + distance_m;
            for (size_t a = 0; a < 3; ++a) {
                const auto axis = static_cast<int>(a);
                Eight low, high;
                std::memcpy(&low, &low_[a][i], sizeof low);
                std::memcpy(&high, &high_[a][i], sizeof high);
                low = (low - origin[axis]) * inverse[axis];
                high = (high - origin[axis]) * inverse[axis];
                const Eight first = low < high ? low : high, last = low < high ? high : low;
                near = first > near ? first : near;
                far = last < far ? last : far;
            }
            const Mask hit = near <= far;
            int any = 0;
            for (size_t k = 0; k < lanes; ++k) any |= hit[k];
            if (any) return true;
        }
        return false;
    }

   private:
    static constexpr size_t most = 128;
    // Above the rounding of coordinates at 1 km (6e-5 m).
    static constexpr float margin_m = 1e-3f;
    static constexpr std::array<float, most> nowhere = [] {
        std::array<float, most> all{};
        for (float& v : all) v = 1e30f;
        return all;
    }();

    size_t count_ = 0;
    // Lanes without a box lie where no ray of a level gets.
    std::array<std::array<float, most>, 3> low_ = {nowhere, nowhere, nowhere}, high_ = {nowhere, nowhere, nowhere};
};

}  // namespace dimmer::cook
