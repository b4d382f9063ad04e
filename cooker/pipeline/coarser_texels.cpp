#include <pipeline/coarser_texels.h>

#include <bake/sums.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace dimmer::cook {
namespace {

// Longer texels of one chart.
class Grid {
   public:
    Grid(glm::uvec2 texels, double factor)
        : factor_(static_cast<float>(factor)),
          width_(static_cast<uint32_t>(std::ceil(texels.x / factor))),
          height_(static_cast<uint32_t>(std::ceil(texels.y / factor))),
          cells_(size_t{width_} * height_) {}

    void add(glm::vec2 at, float lux) {
        Cell& cell = cells_[size_t{std::min(static_cast<uint32_t>(at.y / factor_), height_ - 1)} * width_ +
                            std::min(static_cast<uint32_t>(at.x / factor_), width_ - 1)];
        cell.sum += lux;
        ++cell.count;
    }
    void takeMeans() {
        for (Cell& c : cells_) c.lux = c.count > 0 ? c.sum / c.count : 0;
    }
    // By one step: what is shown was added up since the means were taken.
    void sharpen(const Grid& shown) {
        for (size_t i = 0; i < cells_.size(); ++i)
            cells_[i].lux = std::max(0.0f, 2 * cells_[i].lux - shown.cells_[i].lux);
    }
    // Bilinear, over the cells that hold something: padding continues the others.
    float shownAt(glm::vec2 at) const {
        const glm::vec2 place = at / factor_ - 0.5f, low = glm::floor(place), f = place - low;
        float lux = 0, weights = 0;
        for (const int dy : {0, 1})
            for (const int dx : {0, 1}) {
                const float x = low.x + static_cast<float>(dx), y = low.y + static_cast<float>(dy);
                if (x < 0 || y < 0 || x >= static_cast<float>(width_) || y >= static_cast<float>(height_)) continue;
                const Cell& cell = cells_[static_cast<size_t>(y) * width_ + static_cast<size_t>(x)];
                if (cell.count == 0) continue;
                const float weight = (dx ? f.x : 1 - f.x) * (dy ? f.y : 1 - f.y);
                lux += weight * cell.lux;
                weights += weight;
            }
        return weights > 0 ? lux / weights : 0;
    }

   private:
    struct Cell {
        float sum = 0, lux = 0;
        uint32_t count = 0;
    };
    float factor_;
    uint32_t width_, height_;
    std::vector<Cell> cells_;
};

}  // namespace

CoarserTexels::CoarserTexels(const Texels& texels, std::span<const uint32_t> face_chart, const std::vector<bool>& fixed,
                             std::span<const float> lux, float floor_lux)
    : floor_lux_(floor_lux) {
    std::vector<std::vector<uint32_t>> of_chart(fixed.size());
    for (uint32_t i = 0; i < texels.size(); ++i) {
        const uint32_t chart = face_chart[texels.face(i)];
        all_m2_ += static_cast<double>(texels.area_m2[i]);
        if (!fixed[chart]) of_chart[chart].push_back(i);
    }
    first_.push_back(0);
    for (const auto& receivers : of_chart) {
        if (receivers.empty()) continue;
        glm::uvec2 low(UINT32_MAX);
        for (const uint32_t i : receivers)
            low = glm::min(low, glm::uvec2(TexelAddress::x(texels.address[i]), TexelAddress::y(texels.address[i])));
        for (const uint32_t i : receivers) {
            places_.push_back({static_cast<uint16_t>(TexelAddress::x(texels.address[i]) - low.x),
                               static_cast<uint16_t>(TexelAddress::y(texels.address[i]) - low.y)});
            lux_.push_back(lux[i]);
            area_m2_.push_back(texels.area_m2[i]);
        }
        first_.push_back(static_cast<uint32_t>(places_.size()));
    }
}

double CoarserTexels::errorOf(size_t chart, double factor) const {
    const size_t begin = first_[chart], end = first_[chart + 1];
    const auto middle = [&](size_t i) { return glm::vec2(places_[i].x, places_[i].y) + 0.5f; };
    glm::uvec2 size(0);
    for (size_t i = begin; i < end; ++i) size = glm::max(size, glm::uvec2(places_[i].x, places_[i].y) + 1u);
    Grid cells(size, factor), shown(size, factor);
    for (size_t i = begin; i < end; ++i) cells.add(middle(i), lux_[i]);
    cells.takeMeans();
    for (size_t i = begin; i < end; ++i) shown.add(middle(i), cells.shownAt(middle(i)));
    shown.takeMeans();
    cells.sharpen(shown);
    double sum = 0;
    for (size_t i = begin; i < end; ++i) {
        const float above = lux_[i] + floor_lux_;
        const float lost = std::abs(cells.shownAt(middle(i)) - lux_[i]);
        if (above > 0) sum += static_cast<double>(area_m2_[i] * lost / above);
    }
    return sum;
}

double CoarserTexels::error(double factor) const {
    if (!(all_m2_ > 0)) return 0;
    const Sums sum = sumOverRows(first_.size() - 1, Sums(1), [&](size_t begin, size_t end, Sums& part) {
        for (size_t chart = begin; chart < end; ++chart) part.of[0] += errorOf(chart, factor);
    });
    return sum.of[0] / all_m2_;
}

}  // namespace dimmer::cook
