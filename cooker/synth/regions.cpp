#include <synth/regions.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace dimmer::cook {
namespace {

// From the even plane, 0..1, to the page, 0..1. The slope runs from 0.1 to 1.9: areas vary up to 19^2 = 361 times.
float warp(float t) {
    return t * (0.1f + 0.9f * t);
}
float unwarp(float s) {
    return (-0.1f + std::sqrt(0.01f + 3.6f * s)) / 1.8f;
}

float uniform01(SynthRandom& random) {
    return static_cast<float>(random() >> 8) * 0x1p-24f;
}

// Fisher-Yates with our own numbers: std::shuffle differs between libraries.
template <class T>
void shuffle(std::vector<T>& values, SynthRandom& random) {
    for (size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random() % i]);
}

std::vector<float> evenCoordinates(uint32_t texels, uint32_t cells) {
    std::vector<float> result(texels);
    for (uint32_t i = 0; i < texels; ++i)
        result[i] = unwarp((static_cast<float>(i) + 0.5f) / static_cast<float>(texels)) * static_cast<float>(cells);
    return result;
}

}  // namespace

Regions::Regions(uint32_t width, uint32_t height, uint32_t count, SynthRandom& random)
    : width_(width), height_(height) {
    const float aspect = static_cast<float>(width) / static_cast<float>(height);
    columns_ = std::max(1u, static_cast<uint32_t>(std::ceil(std::sqrt(static_cast<float>(count) * aspect))));
    rows_ = (count + columns_ - 1) / columns_;
    // As many cells as seeds, or a few more: those left over are random.
    std::vector<uint32_t> seeded(size_t{columns_} * rows_);
    std::iota(seeded.begin(), seeded.end(), 0u);
    shuffle(seeded, random);
    std::vector<bool> has_seed(seeded.size());
    for (uint32_t i = 0; i < count; ++i) has_seed[seeded[i]] = true;
    for (uint32_t i = 0; i < has_seed.size(); ++i) {
        cells_.push_back({count ? static_cast<uint32_t>(seeds_.size()) : 0, 0});
        if (has_seed[i])
            seeds_.push_back({static_cast<float>(i % columns_) + uniform01(random),
                              static_cast<float>(i / columns_) + uniform01(random)});
        cells_.back().end = static_cast<uint32_t>(seeds_.size());
    }
    even_x_ = evenCoordinates(width, columns_);
    even_y_ = evenCoordinates(height, rows_);
}

Regions::Point Regions::seed(uint32_t region) const {
    const Point& p = seeds_[region];
    return {warp(p.x / static_cast<float>(columns_)) * static_cast<float>(width_),
            warp(p.y / static_cast<float>(rows_)) * static_cast<float>(height_)};
}

uint32_t Regions::at(uint32_t x, uint32_t y) const {
    const float ex = even_x_[x], ey = even_y_[y];
    const int cx = static_cast<int>(ex), cy = static_cast<int>(ey);
    uint32_t nearest = 0;
    float least = INFINITY;
    // Two cells around hold the nearest seed but for rare gaps, where the nearest found will do as well.
    for (int gy = std::max(cy - 2, 0); gy <= std::min(cy + 2, static_cast<int>(rows_) - 1); ++gy)
        for (int gx = std::max(cx - 2, 0); gx <= std::min(cx + 2, static_cast<int>(columns_) - 1); ++gx)
            for (uint32_t i = cell(gx, gy).first; i < cell(gx, gy).end; ++i) {
                const float dx = seeds_[i].x - ex, dy = seeds_[i].y - ey;
                const float distance2 = dx * dx + dy * dy;
                if (distance2 < least) {
                    least = distance2;
                    nearest = i;
                }
            }
    return nearest;
}

std::vector<uint32_t> fitOverlaps(std::span<const uint32_t> sizes, double mean, uint32_t active, uint32_t largest,
                                  SynthRandom& random) {
    std::vector<uint32_t> order(sizes.size());
    std::iota(order.begin(), order.end(), 0u);
    shuffle(order, random);
    const double p = mean / (1 + mean);  // P(n) = (1 - p) p^n has this mean
    std::vector<uint32_t> overlaps(sizes.size(), 0);
    const auto holding = std::min<size_t>(active, order.size());
    for (size_t i = 0; i < holding; ++i) {
        const double u = (static_cast<double>(i) + 0.5) / static_cast<double>(holding);
        overlaps[order[i]] = std::min(largest, 1 + static_cast<uint32_t>(std::log(1 - u) / std::log(p)));
    }
    // Then region by region one more or one less, until the mean over texels is met.
    double records = 0, texels = 0;
    for (size_t i = 0; i < sizes.size(); ++i) {
        records += static_cast<double>(overlaps[i]) * sizes[i];
        texels += sizes[i];
    }
    const double target = mean * texels;
    for (int round = 0; round < 64 && std::abs(records - target) > 0.001 * target; ++round)
        for (size_t i = 0; i < holding; ++i) {
            const uint32_t region = order[i];
            const double size = sizes[region];
            if (records + size / 2 < target && overlaps[region] < largest) {
                ++overlaps[region];
                records += size;
            } else if (records - size / 2 > target && overlaps[region] > 1) {
                --overlaps[region];
                records -= size;
            }
        }
    return overlaps;
}

std::vector<std::vector<uint32_t>> nearestContributions(const Regions& regions, std::span<const uint32_t> overlaps,
                                                        uint32_t contributions, SynthRandom& random) {
    std::vector<Regions::Point> centres(contributions);
    for (auto& c : centres)
        c = {uniform01(random) * static_cast<float>(regions.width()),
             uniform01(random) * static_cast<float>(regions.height())};
    std::vector<std::vector<uint32_t>> members(regions.count());
    std::vector<uint32_t> order(contributions);
    for (uint32_t r = 0; r < regions.count(); ++r) {
        if (overlaps[r] == 0) continue;
        const auto at = regions.seed(r);
        const auto distance2 = [&](uint32_t k) {
            const float dx = centres[k].x - at.x, dy = centres[k].y - at.y;
            return dx * dx + dy * dy;
        };
        std::iota(order.begin(), order.end(), 0u);
        // Some slack, so that neighbours with as many contributions need not hold the same.
        const uint32_t candidates = std::min(contributions, overlaps[r] + 3);
        std::ranges::partial_sort(order, order.begin() + candidates, {}, distance2);
        std::vector<uint32_t> near(order.begin(), order.begin() + candidates);
        shuffle(near, random);
        near.resize(overlaps[r]);
        std::ranges::sort(near);
        members[r] = std::move(near);
    }
    return members;
}

}  // namespace dimmer::cook
