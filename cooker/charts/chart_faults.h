// What parts of a curved surface must not be in one chart.
#pragma once

#include <charts/axes.h>
#include <charts/face_walls.h>
#include <charts/planar.h>

#include <set>
#include <span>
#include <utility>
#include <vector>

namespace dimmer::cook {

// The lesser one first.
using ChartPairs = std::set<std::pair<uint32_t, uint32_t>>;

// Charts that are to be one, ascending, and how they are seen.
struct JoinedCharts {
    std::vector<uint32_t> charts;
    Axes axes;
};

class ChartFaults {
   public:
    ChartFaults(std::span<const PlanarFace> faces, const std::vector<ProjectedChart>& charts, const Standing& standing);

    // Charts, of those that are to be one, with something over the other's within the filter's reach of it, or with a
    // wall between. Walls are looked for where they were not in an earlier call, in which other charts were one.
    ChartPairs in(std::span<const JoinedCharts> joined);

   private:
    // A face and its chart, as it is seen.
    struct Part {
        uint32_t chart, face;
        Rect rect;
        float low_m, high_m;
    };
    using Found = std::vector<std::pair<uint32_t, uint32_t>>;

    std::vector<uint32_t> facesOf(const ProjectedChart& chart) const;
    std::vector<Part> partsOf(const JoinedCharts& joined) const;
    Found in(const JoinedCharts& joined) const;
    FaceWalls wallsOf(const PlanarFace& face, std::span<const Part> others, float near_m) const;
    bool wasLookedAt(uint32_t a, uint32_t b) const;
    bool besideWall(const PlanarFace& a, const PlanarFace& b) const;
    bool stacked(const Part& a, const Part& b, const Axes& axes, float reach_m) const;

    std::span<const PlanarFace> faces_;
    const std::vector<ProjectedChart>& charts_;
    const Standing& standing_;
    std::vector<uint32_t> looked_at_;  // per chart: of which joined ones it was in the last call
};

}  // namespace dimmer::cook
