// Finds the thin walls that stand on charts.
#pragma once

#include <charts/blocking_rays.h>
#include <charts/box_tree.h>
#include <charts/planar.h>
#include <charts/wall_traces.h>

#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// Axes that are turned in a chart's plane against its own.
struct Turn {
    float cos = 1, sin = 0;

    glm::vec2 on(glm::vec2 p) const { return {cos * p.x + sin * p.y, cos * p.y - sin * p.x}; }
    glm::vec2 axis(int i) const { return i == 0 ? glm::vec2(cos, sin) : glm::vec2(-sin, cos); }
};

struct WallLines {
    std::vector<Turn> turns;      // the first one is none
    std::vector<WallLine> lines;  // in the order of turn, axis and place
};

inline constexpr float wall_margin_m = 5e-3f;  // a wall this close to a rectangle's edge parts nothing

// Immutable after construction; queries are thread-safe.
class StandingWalls {
   public:
    StandingWalls() = default;
    // `faces` must outlive this.
    StandingWalls(std::span<const PlanarFace> faces, Blocking blocking);

    // The middles of solids that are thinner than a filtered texel of the coarsest density reaches, and single skins
    // with open air behind them, over which the chart goes on. Each stands on the chart at wall_probe_low_m (leaves at
    // leaf_probe_low_m), and at wall_probe_high_m or as high as there is room, leaning or not; a solid may have another
    // outline there, as over a skirting. Cost: that of the faces
    // at the two heights over the chart for each pair of directions at right angles that they have, and of some rays
    // behind each single-sided wall.
    WallLines on(const ProjectedChart& chart, float coarsest_texels_per_metre) const;

   private:
    // Of one triangle, along the chart's axes.
    struct Segment {
        glm::vec2 a, b, normal;  // the triangle's own, as it looks from above
        float rise;              // of that normal
        bool double_sided;

        // Metres to the line that both ends may lie beside, of a chart of so many texels per metre.
        float slackM(float texels_per_metre) const;
    };
    enum class Which { Fixed, Leaves, All };

    std::vector<WallLine> alongAxes(const ProjectedChart& chart, float reach_m) const;
    std::vector<Turn> turnsOf(const ProjectedChart& chart) const;
    ProjectedChart turned(const ProjectedChart& chart, Turn turn) const;
    std::vector<Segment> segmentsAt(const ProjectedChart& chart, float height_m, Which which) const;
    std::vector<Trace> findTraces(const ProjectedChart& chart, float height_m, Which which) const;
    std::vector<Trace> lowTraces(const ProjectedChart& chart) const;
    float highProbe(const ProjectedChart& chart) const;
    glm::vec3 onPlane(const ProjectedChart& chart, glm::vec2 at, float height_m) const;
    BoxTree::Box boxOver(const ProjectedChart& chart, float height_m) const;
    bool isSkin(const ProjectedChart& chart, const Trace& trace) const;
    bool covers(const ProjectedChart& chart, glm::vec3 p) const;

    std::span<const PlanarFace> faces_;
    BlockingRays blocking_;
    BoxTree boxes_;  // of all faces
};

}  // namespace dimmer::cook
