// The geometry of synthetic packs: the pages cut into regions, and which contributions each holds.
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace dimmer::cook {

using SynthRandom = std::mt19937;

// A Voronoi diagram of jittered seeds over width x height texels. Seeds crowd towards one corner, so that the largest
// cells are some hundred times the smallest.
class Regions {
   public:
    struct Point {
        float x, y;  // texels
    };

    Regions(uint32_t width, uint32_t height, uint32_t count, SynthRandom& random);

    uint32_t count() const { return static_cast<uint32_t>(seeds_.size()); }
    Point seed(uint32_t region) const;
    // The region whose seed is nearest, in the plane in which seeds are spread evenly.
    uint32_t at(uint32_t x, uint32_t y) const;
    uint32_t width() const { return width_; }
    uint32_t height() const { return height_; }

   private:
    struct Cell {
        uint32_t first = 0, end = 0;  // into seeds_
    };
    const Cell& cell(int x, int y) const { return cells_[static_cast<size_t>(y) * columns_ + static_cast<size_t>(x)]; }

    uint32_t width_, height_, columns_, rows_;
    std::vector<Point> seeds_;  // in cells of the even plane, grouped by cell
    std::vector<Cell> cells_;
    std::vector<float> even_x_, even_y_;  // of each column and row of texels, in cells
};

// How many contributions each region holds: `active` of them at least 1, the others 0, at most `largest`; geometric,
// with a mean over the texels of `mean` within 0.1 % (where single regions are small enough for that).
std::vector<uint32_t> fitOverlaps(std::span<const uint32_t> sizes, double mean, uint32_t active, uint32_t largest,
                                  SynthRandom& random);

// For each region as many contributions as asked, picked among those whose centres are nearest; ascending.
std::vector<std::vector<uint32_t>> nearestContributions(const Regions& regions, std::span<const uint32_t> overlaps,
                                                        uint32_t contributions, SynthRandom& random);

}  // namespace dimmer::cook
