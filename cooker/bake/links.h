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

// The links of every receiver, at final some 180 of each: by path, in order of the receivers that they lead to, as
// differences. Of receivers below 2^31. Receivers that lie near each other have numbers near each other (texels.h): at
// final some 10 bits a link, where the number of one of a million receivers takes 20 and that of a path as many
// again. Thread-safe to read.
class Links {
   public:
    Links() = default;

    // Sorted by path, then by receiver, whatever the order in which they were put. Replaces `links`.
    void get(size_t receiver, std::vector<Link>& links) const;

    // Rows of one block (sparse_light.h) must come in order; blocks may be filled in parallel.
    class Builder {
       public:
        explicit Builder(size_t receivers) : bytes_(receivers) {}
        // Sorts `links`.
        void put(size_t receiver, std::vector<Link>& links);
        // No more comes of a receiver's block.
        void close(size_t receiver) { bytes_.close(receiver); }
        Links finish() { return Links(bytes_.finish()); }

       private:
        Sparse<uint8_t>::Builder bytes_;
    };

   private:
    explicit Links(Sparse<uint8_t> bytes) : bytes_(std::move(bytes)) {}

    Sparse<uint8_t> bytes_;
};

}  // namespace dimmer::cook
