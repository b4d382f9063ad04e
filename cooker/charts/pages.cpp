#include <charts/pages.h>

#include <stb_rect_pack.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace dimmer::cook {
namespace {

bool tryPack(std::vector<stbrp_rect>& rects, int width, int height) {
    std::vector<stbrp_node> nodes(static_cast<size_t>(width));
    stbrp_context context;
    stbrp_init_target(&context, width, height, nodes.data(), width);
    return stbrp_pack_rects(&context, rects.data(), static_cast<int>(rects.size())) != 0;
}

std::vector<stbrp_rect> rectsOf(std::span<const glm::uvec2> charts, const std::vector<uint32_t>& ids) {
    std::vector<stbrp_rect> rects;
    for (uint32_t id : ids) {
        stbrp_rect r{};
        r.id = static_cast<int>(id);
        r.w = static_cast<stbrp_coord>(charts[id].x);
        r.h = static_cast<stbrp_coord>(charts[id].y);
        rects.push_back(r);
    }
    return rects;
}

// On square pages of `side`, as many as it takes; false where those are more than `count_max`. Pages end with the
// lowest chart of all.
bool fillPages(std::span<const glm::uvec2> charts, uint32_t side, uint32_t count_max, Unwrap& out) {
    std::vector<uint32_t> rest(charts.size());
    std::iota(rest.begin(), rest.end(), 0u);
    out.charts.resize(charts.size());
    uint32_t height = 0;
    for (out.page_count = 0; !rest.empty(); ++out.page_count) {
        if (out.page_count == count_max) return false;
        auto rects = rectsOf(charts, rest);
        tryPack(rects, static_cast<int>(side), static_cast<int>(side));
        rest.clear();
        for (const stbrp_rect& r : rects) {
            const auto id = static_cast<uint32_t>(r.id);
            if (!r.was_packed) {
                rest.push_back(id);
                continue;
            }
            const auto x = static_cast<uint32_t>(r.x), y = static_cast<uint32_t>(r.y);
            out.charts[id] = {out.page_count, x, y, charts[id].x, charts[id].y};
            height = std::max(height, y + charts[id].y);
        }
        std::ranges::sort(rest);
    }
    out.page_count = std::max(out.page_count, 1u);
    out.page_width = side;
    out.page_height = std::min(side, (height + 7) / 8 * 8);
    return true;
}

}  // namespace

bool packPages(std::span<const glm::uvec2> charts, uint32_t page_size, Unwrap& out) {
    constexpr uint32_t side_step = 64, pages_max = 256;
    uint64_t area = 0;
    uint32_t largest = side_step;
    for (const glm::uvec2 c : charts) {
        area += uint64_t{c.x} * c.y;
        largest = std::max({largest, c.x, c.y});
    }
    const auto sideFor = [&](uint32_t pages) {
        const auto side = static_cast<uint32_t>(std::sqrt(static_cast<double>(area) / pages));
        return std::max((side + side_step - 1) / side_step, (largest + side_step - 1) / side_step) * side_step;
    };
    for (uint32_t side = sideFor(1); side <= page_size; side += side_step)
        if (fillPages(charts, side, 1, out)) return true;
    if (!fillPages(charts, page_size, pages_max, out)) return false;
    const uint32_t pages = out.page_count;
    for (uint32_t side = sideFor(pages); side < page_size; side += side_step)
        if (fillPages(charts, side, pages, out)) return true;
    return fillPages(charts, page_size, pages, out);
}

uint64_t pageTexels(std::span<const glm::uvec2> charts, uint32_t page_size) {
    Unwrap out;
    if (!packPages(charts, page_size, out)) return UINT64_MAX;
    return uint64_t{out.page_width} * out.page_height * out.page_count;
}

glm::uvec2 chartSize(glm::uvec2 size, double factor) {
    const auto side = [&](uint32_t texels) {
        // Sides were rounded up, but where they are whole metres: rather too large than too small.
        const double inner = static_cast<double>(texels - 2 * padding_texels) / factor;
        return static_cast<uint32_t>(std::max(1.0, std::ceil(inner - 0.01))) + 2 * padding_texels;
    };
    return factor == 1 ? size : glm::uvec2(side(size.x), side(size.y));
}

}  // namespace dimmer::cook
