// Which receivers a level's rays lead from one to another: what a series follows, bounce after bounce.
#pragma once

#include <bake/sparse_light.h>

#include <cstdint>
#include <vector>

namespace dimmer::cook {

// The receiver that a ray reads, over a path (DoorPaths).
struct Link {
    uint32_t receiver, path;
    auto operator<=>(const Link&) const = default;
};

// The links of every receiver, at final some 180 of each: by path, in order of the receivers that they lead
// to, as differences in Rice codes (Golomb 1966; Rice and Plaunt 1971). Some 15 bits a link, where the number of one of
// a million receivers takes 20 and that of a path as many again. Thread-safe to read.
class Links {
   public:
    Links() = default;

    // Sorted by path, then by receiver, whatever the order in which they were put. Replaces `links`.
    void get(size_t receiver, std::vector<Link>& links) const;

    // Rows of one block (sparse_light.h) must come in order; blocks may be filled in parallel.
    class Builder {
       public:
        explicit Builder(size_t receivers) : bytes_(receivers), receivers_(static_cast<uint32_t>(receivers)) {}
        // Sorts `links`.
        void put(size_t receiver, std::vector<Link>& links);
        // No more comes of a receiver's block.
        void close(size_t receiver) { bytes_.close(receiver); }
        Links finish() { return {bytes_.finish(), receivers_}; }

       private:
        Sparse<uint8_t>::Builder bytes_;
        uint32_t receivers_;
    };

   private:
    Links(Sparse<uint8_t> bytes, uint32_t receivers) : bytes_(std::move(bytes)), receivers_(receivers) {}

    Sparse<uint8_t> bytes_;
    uint32_t receivers_ = 0;
};

}  // namespace dimmer::cook
