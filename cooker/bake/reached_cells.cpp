#include <bake/reached_cells.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// Smallest cells go as far as there: as wide as the way between rays is long, and all over levels of 96 m.
constexpr float small_cells_m = 192;
// Rays are followed in steps of this share of a cell: short enough not to cut more than corners.
constexpr float step_share = 0.5f;

void forEachCell(glm::uvec3 low, glm::uvec3 high, auto&& visit) {
    for (uint32_t z = low.z; z <= high.z; ++z)
        for (uint32_t y = low.y; y <= high.y; ++y)
            for (uint32_t x = low.x; x <= high.x; ++x) visit(glm::uvec3(x, y, z));
}

}  // namespace

ReachedCells::ReachedCells(const CellLevels& levels, glm::vec3 from, float far_m, float spread)
    : levels_(levels), spread_(spread), windows_(levels.count()) {
    for (uint32_t l = 0; l < levels.count(); ++l) {
        const float ends_m = std::min(far_m, std::ldexp(small_cells_m, static_cast<int>(l)));
        const float reach_m = ends_m * (1 + spread) + 2 * levels.cellSize(l);
        Window& w = windows_[l];
        w.low = levels.coordinates(from - reach_m, l);
        w.high = levels.coordinates(from + reach_m, l);
        w.marks.resize(w.index(w.high) + 1);
    }
}

uint32_t ReachedCells::levelAt(float distance_m) const {
    uint32_t level = 0;
    while (level + 1 < levels_.count() && distance_m >= std::ldexp(small_cells_m, static_cast<int>(level))) ++level;
    return level;
}

void ReachedCells::mark(glm::vec3 from, glm::vec3 direction, float distance_m) {
    uint32_t level = 0;
    bool entered = false;
    for (float m = 0; m < distance_m; m += step_share * levels_.cellSize(level)) {
        level = levelAt(m);
        const glm::vec3 point = from + direction * m;
        const bool outside = levels_.isOutside(point, spread_ * m);
        if (outside && entered) return;  // for good: cone and box are convex
        entered = !outside;
        if (!outside) markAround(point, spread_ * m, level);
    }
    level = levelAt(distance_m);
    if (levels_.isOutside(from + direction * distance_m, spread_ * distance_m)) return;
    markAround(from + direction * distance_m, std::max(0.5f * levels_.cellSize(level), spread_ * distance_m), level);
}

void ReachedCells::markAround(glm::vec3 point, float reach_m, uint32_t level) {
    Window& w = windows_[level];
    const glm::uvec3 low = glm::max(levels_.coordinates(point - reach_m, level), w.low);
    const glm::uvec3 high = glm::min(levels_.coordinates(point + reach_m, level), w.high);
    forEachCell(low, high, [&](glm::uvec3 c) { w.marks[w.index(c)] = 1; });
}

bool ReachedCells::holds(glm::vec3 point, uint32_t level) const {
    const uint32_t first = level > 0 ? level - 1 : 0, end = std::min(level + 2, levels_.count());
    for (uint32_t l = first; l < end; ++l) {
        const glm::uvec3 c = levels_.coordinates(point, l);
        const Window& w = windows_[l];
        if (w.contains(c) && w.marks[w.index(c)]) return true;
    }
    return false;
}

// Marks a larger cell instead of those of `level` in it, where all are marked or, if not `full_only`, any is.
void ReachedCells::join(uint32_t level, bool full_only) {
    Window &small = windows_[level], &large = windows_[level + 1];
    forEachCell(small.low >> 1u, small.high >> 1u, [&](glm::uvec3 c) {
        const glm::uvec3 first = 2u * c, last = glm::min(first + 1u, levels_.size(level) - 1u);
        bool all = small.contains(first) && small.contains(last), any = false;
        const glm::uvec3 low = glm::max(first, small.low), high = glm::min(last, small.high);
        forEachCell(low, high, [&](glm::uvec3 of) {
            const bool marked = small.marks[small.index(of)] != 0;
            all = all && marked;
            any = any || marked;
        });
        uint8_t& larger = large.marks[large.index(c)];
        if (!any || (full_only && !all && !larger)) return;
        larger = 1;
        forEachCell(low, high, [&](glm::uvec3 of) { small.marks[small.index(of)] = 0; });
    });
}

size_t ReachedCells::count() const {
    size_t sum = 0;
    for (const Window& w : windows_) sum += static_cast<size_t>(std::ranges::count(w.marks, 1));
    return sum;
}

std::vector<uint64_t> ReachedCells::numbers() {
    const auto last = static_cast<uint32_t>(windows_.size()) - 1;
    for (uint32_t l = 0; l < last; ++l) join(l, true);
    for (uint32_t l = 0; l < last && count() > cells_of_light_max; ++l) join(l, false);
    std::vector<uint64_t> numbers;
    for (uint32_t l = 0; l < windows_.size(); ++l) {
        const Window& w = windows_[l];
        forEachCell(w.low, w.high, [&](glm::uvec3 c) {
            if (w.marks[w.index(c)]) numbers.push_back(levels_.number(c, l));
        });
    }
    return numbers;
}

}  // namespace dimmer::cook
