#include <probes/face_order.h>

#include <algorithm>
#include <array>
#include <utility>

namespace dimmer::cook {
namespace {

constexpr uint32_t not_yet = UINT32_MAX;

// A walk from tetrahedron to tetrahedron, depth first.
class Walk {
   public:
    explicit Walk(const GlobalGrid& grid) : grid_(grid), number_(grid.tetrahedra.size(), not_yet) {
        for (uint32_t i = 0; i < grid.tetrahedra.size(); ++i) {
            if (number_[i] != not_yet) continue;
            visit(i, {0, 1, 2, 3});
            while (!steps_.empty()) {
                const Step step = steps_.back();
                steps_.pop_back();
                if (number_[step.to] == not_yet) visit(step.to, step.corners);
            }
        }
    }

    GlobalGrid result() {
        const std::vector<uint32_t> probes = probesAsTheyComeUp();
        std::vector<uint32_t> new_probe(probes.size());
        for (uint32_t i = 0; i < probes.size(); ++i) new_probe[probes[i]] = i;
        GlobalGrid out;
        out.start = grid_.start;
        for (const uint32_t p : probes) {
            out.positions.push_back(grid_.positions[p]);
            out.levels.push_back(grid_.levels[p]);
        }
        for (const Visited& v : visited_) {
            const Tetrahedron& old = grid_.tetrahedra[v.tetrahedron];
            Tetrahedron t;
            for (size_t k = 0; k < 4; ++k) {
                t.probes[k] = new_probe[old.probes[v.corners[k]]];
                const uint32_t neighbour = old.neighbours[v.corners[k]];
                t.neighbours[k] = neighbour == no_tetrahedron ? no_tetrahedron : number_[neighbour];
            }
            out.tetrahedra.push_back(t);
            if (!grid_.visibility.empty()) out.visibility.push_back(turned(grid_.visibility[v.tetrahedron], v.corners));
        }
        for (const uint32_t start : grid_.starts) out.starts.push_back(number_[start]);
        return out;
    }

    std::vector<uint32_t> probesAsTheyComeUp() const {
        const size_t count = grid_.positions.size(), plain = count - std::min(count, grid_box_corners);
        std::vector<uint32_t> probes;
        std::vector<bool> known(count, false);
        const auto add = [&](uint32_t p) {
            if (!known[p]) probes.push_back(p);
            known[p] = true;
        };
        for (const Visited& v : visited_)
            for (const uint8_t corner : v.corners)
                if (const uint32_t p = grid_.tetrahedra[v.tetrahedron].probes[corner]; p < plain) add(p);
        for (uint32_t p = 0; p < count; ++p) add(p);  // of no tetrahedron, and the box's
        return probes;
    }

   private:
    using Corners = std::array<uint8_t, 4>;  // the tetrahedron's own, in their new order
    struct Step {
        uint32_t to;
        Corners corners;
    };
    struct Visited {
        uint32_t tetrahedron;
        Corners corners;
    };

    void visit(uint32_t i, const Corners& corners) {
        number_[i] = static_cast<uint32_t>(visited_.size());
        visited_.push_back({i, corners});
        for (const uint8_t corner : corners) {
            const uint32_t n = grid_.tetrahedra[i].neighbours[corner];
            if (n != no_tetrahedron && number_[n] == not_yet) steps_.push_back({n, cornersOf(n, i, corners)});
        }
    }

    // Of `t`, in the order of its neighbour's: those that they share, and the other one in the free place.
    Corners cornersOf(uint32_t t, uint32_t neighbour, const Corners& order) const {
        const auto &here = grid_.tetrahedra[t].probes, &there = grid_.tetrahedra[neighbour].probes;
        Corners corners{};
        size_t free = 0;
        uint8_t other = 0 + 1 + 2 + 3;  // less the three that are shared
        for (size_t k = 0; k < 4; ++k) {
            const auto at = static_cast<size_t>(std::ranges::find(here, there[order[k]]) - here.begin());
            if (at == 4) {
                free = k;
            } else {
                corners[k] = static_cast<uint8_t>(at);
                other = static_cast<uint8_t>(other - at);
            }
        }
        corners[free] = other;
        return corners;
    }

    static TetrahedronVisibility turned(const TetrahedronVisibility& old, const Corners& corners) {
        TetrahedronVisibility out;
        for (size_t v = 0; v < 4; ++v)
            for (size_t i = 0; i < 4; ++i) out.seen[v][i] = old.seen[corners[v]][corners[i]];
        return out;
    }

    const GlobalGrid& grid_;
    std::vector<uint32_t> number_;  // per tetrahedron: the new one
    std::vector<Visited> visited_;  // by new number
    std::vector<Step> steps_;
};

}  // namespace

std::vector<uint32_t> orderByFaces(GlobalGrid& grid) {
    Walk walk(grid);
    std::vector<uint32_t> probes = walk.probesAsTheyComeUp();
    grid = walk.result();
    return probes;
}

}  // namespace dimmer::cook
