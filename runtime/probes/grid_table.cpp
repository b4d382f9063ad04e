#include <probes/grid_table.h>

#include <bit>

namespace dimmer {
namespace {

constexpr uint64_t header_elements = 4, elements_per_tetrahedron = 3, starts_per_element = 4;

uint64_t elementCount(const GlobalGrid& grid) {
    return header_elements + grid.positions.size() + elements_per_tetrahedron * grid.tetrahedra.size() +
           (grid.starts.size() + starts_per_element - 1) / starts_per_element;
}

GridTableElement corner(const std::array<float, 3>& p, uint64_t last) {
    return {std::bit_cast<uint32_t>(p[0]), std::bit_cast<uint32_t>(p[1]), std::bit_cast<uint32_t>(p[2]),
            static_cast<uint32_t>(last)};
}

}  // namespace

uint64_t gridTableBytes(const GlobalGrid& grid) {
    return grid.empty() ? 0 : elementCount(grid) * sizeof(GridTableElement);
}

std::vector<GridTableElement> gridTable(const GlobalGrid& grid) {
    std::vector<GridTableElement> table(header_elements);
    for (const ProbePosition& p : grid.positions) table.push_back(corner({p.x_m, p.y_m, p.z_m}, 0));
    const uint64_t first_tetrahedron = table.size();
    for (size_t t = 0; t < grid.tetrahedra.size(); ++t) {
        table.push_back(grid.tetrahedra[t].probes);
        table.push_back(grid.tetrahedra[t].neighbours);
        table.push_back(grid.visibility.empty() ? GridTableElement{}
                                                : std::bit_cast<GridTableElement>(grid.visibility[t]));
    }
    const uint64_t first_start = table.size();
    table.resize(elementCount(grid));
    for (size_t i = 0; i < grid.starts.size(); ++i)
        table[first_start + i / starts_per_element][i % starts_per_element] = grid.starts[i];
    table[0] = corner(grid.start.min_m, header_elements);
    table[1] = corner(grid.start.max_m, first_tetrahedron);
    table[2] = {grid.start.counts[0], grid.start.counts[1], grid.start.counts[2], static_cast<uint32_t>(first_start)};
    table[3] = {grid.visibility.empty() ? 0u : 1u, static_cast<uint32_t>(grid.tetrahedra.size()), 0, 0};
    return table;
}

}  // namespace dimmer
