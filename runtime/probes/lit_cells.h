// Where in a level the light probes of a cluster have a say: what has to be lit anew when the cluster's light changes.
#pragma once

#include <pack/pack_data.h>

#include <array>
#include <vector>

namespace dimmer {

struct Box {
    std::array<float, 3> min_m, max_m;
};

// The global grid's box in equal cells, near cubes, and per cluster of probes those that meet a tetrahedron of one of
// its probes. A cluster is what is lit by the same sets, which may lie all over a level: a box around each would take
// in most of it. Not thread-safe.
class LitCells {
   public:
    LitCells() = default;
    // Cost: tetrahedra times the cells near each: 20 ms for 100,000 in all. Those that fill a level one after another
    // meet few cells each; of a file whose tetrahedra all reach across the level, the later ones are everywhere.
    explicit LitCells(const PackData& data);

    // The light of a cluster has changed. Cost: its cells. Allocates nothing.
    void change(uint32_t cluster);
    // Whether light may have changed in the box since the last clear(). Cost: the box's cells, at most.
    bool changedIn(const Box& box) const;
    void clear();

   private:
    using Cell = std::array<uint32_t, 3>;
    uint32_t along(size_t axis, double place_m) const;
    uint32_t numberOf(const Cell& cell) const { return cell[0] + counts_[0] * (cell[1] + counts_[1] * cell[2]); }
    struct Run {  // of cells along the first axis
        uint32_t first, count;
    };
    // Returns what it took: rows of cells looked at, and cells.
    size_t addCellsOf(const GlobalGrid& grid, const Tetrahedron& tetrahedron, std::vector<Run>& runs) const;

    std::array<double, 3> min_m_ = {}, cell_m_ = {};
    Cell counts_ = {};
    std::vector<uint32_t> cells_, ends_;  // of all clusters, one after another; where each one's end
    std::vector<uint8_t> everywhere_;     // per cluster: all cells, none of which is listed
    std::vector<uint32_t> changed_in_;    // per cell: the last round in which it was
    uint32_t all_changed_in_ = 0;         // the last round in which all were
    uint32_t round_ = 1;
};

}  // namespace dimmer
