// Finds the thin walls that stand on charts.
#pragma once

#include <charts/box_tree.h>
#include <charts/planar.h>

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

// Where a wall stands on a chart: a stretch of the line x = at (axis 0) or y = at (axis 1), in metres along axes that
// may be turned.
struct WallLine {
    int axis = 0;
    float at = 0, from = 0, to = 0;
    uint32_t turn = 0;  // whose axes
};

struct WallLines {
    std::vector<Turn> turns;      // the first one is none
    std::vector<WallLine> lines;  // in the order of turn, axis and place
};

inline constexpr float same_line_m = 2e-3f;     // what lies closer is one line
inline constexpr float wall_margin_m = 5e-3f;   // a wall this close to a rectangle's edge parts nothing
inline constexpr float rounding_share = 1e-5f;  // of the largest coordinate: far above what a few dot products lose

// What sums with a coordinate lose to rounding, and more.
float slackAt(float at);

// What light does not pass, indices of faces, and whether they block with both sides.
struct Blocking {
    std::vector<uint32_t> faces;  // ascending
    std::vector<bool> double_sided;
};

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
    // The trace of blocking triangles in one plane at a height over a chart.
    struct Trace : WallLine {
        bool forward = false;       // its front looks towards larger coordinates
        bool double_sided = false;  // of triangles that leave a trace of either direction
        float lean = 0;             // metres that it moves along its axis with each metre of height
        float skew = 0;             // and along the other axis, from its own middle on
        float middle = 0;
        float height_m = 0;

        float atAlong(float place) const { return at + skew * (place - middle); }
    };
    // Of one triangle, along the chart's axes.
    struct Segment {
        glm::vec2 a, b, normal;  // the triangle's own, as it looks from above
        float rise;              // of that normal
        bool double_sided;

        // Metres to the line that both ends may lie beside, of a chart of so many texels per metre.
        float slackM(float texels_per_metre) const;
    };
    // Between a face that looks back and the next that looks forward, at a height over a chart.
    struct Solid {
        int axis = 0;
        float low = 0, high = 0, from = 0, to = 0;  // across the axis' line, and along it
    };
    enum class Which { Fixed, Leaves, All };

    static auto placeOf(const Trace& trace);
    static std::span<const Trace> near(std::span<const Trace> sorted, int axis, bool forward, float low, float high);
    static std::vector<Trace> standing(const std::vector<Trace>& low, const std::vector<Trace>& high);
    static std::vector<Solid> solidsOf(std::span<const Trace> sorted, float reach_m);
    static std::vector<Solid> solidsBelow(std::span<const Solid> high, std::span<const Solid> low, float reach_m);
    static std::vector<Solid> longOnes(std::vector<Solid> solids);
    static std::vector<Trace> joinedTraces(std::vector<Trace> traces);
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
    struct Met {
        float at_m;  // the largest number: nothing
        bool is_back;
    };
    Met meets(glm::vec3 from, glm::vec3 direction) const;

    std::span<const PlanarFace> faces_;
    Blocking blocking_;
    BoxTree boxes_;        // of blocking_.faces
    BoxTree all_boxes_;    // of all faces
    BoxTree::Box level_;   // that holds what blocks
    float largest_m_ = 0;  // coordinate among theirs
};

}  // namespace dimmer::cook
