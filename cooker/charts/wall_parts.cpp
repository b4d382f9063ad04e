#include <charts/wall_parts.h>

#include <charts/groups.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

namespace dimmer::cook {
namespace {

constexpr float length_min_texels = 3;   // of all stretches between doorways; a table's leg is no wall
constexpr float wall_share_min = 0.25f;  // of a wall with its doorways
// From one stretch of a round wall to the next: of eight sides, as thick as the filter reaches.
constexpr float rows_gap_texels = 1.1f, row_cos = 0.7f;

// All stretches of the row that one is of.
struct RowLine : WallLine {
    float row_m = 0;  // of one that stands alone, 0
};

// A round wall is a row of stretches whose lines have no more than an eighth of a turn from one to the next.
std::vector<RowLine> withRows(const WallLines& walls, float gap_m) {
    struct End {
        glm::vec2 at, outwards;
        uint32_t line;
    };
    std::vector<End> ends;
    std::vector<BoxTree::Box> boxes;
    for (uint32_t i = 0; i < walls.lines.size(); ++i) {
        const WallLine& l = walls.lines[i];
        const Turn& turn = walls.turns[l.turn];
        const glm::vec2 along = turn.axis(1 - l.axis), on_line = l.at * turn.axis(l.axis);
        for (const float sign : {-1.0f, 1.0f}) {
            const glm::vec2 at = on_line + (sign < 0 ? l.from : l.to) * along;
            ends.push_back({at, sign * along, i});
            boxes.push_back({{at - gap_m, 0}, {at + gap_m, 0}});
        }
    }
    Groups rows(walls.lines.size());
    const BoxTree tree(std::move(boxes));
    for (const End& end : ends)
        for (const uint32_t other : tree.touching({{end.at, 0}, {end.at, 0}})) {
            const bool one_turn = walls.lines[end.line].turn == walls.lines[ends[other].line].turn;
            if (one_turn || -glm::dot(end.outwards, ends[other].outwards) < row_cos) continue;
            const uint32_t a = rows.find(end.line), b = rows.find(ends[other].line);
            if (a != b) rows.join(a, b);
        }
    std::vector<float> row_m(walls.lines.size());
    for (uint32_t i = 0; i < walls.lines.size(); ++i) row_m[rows.find(i)] += walls.lines[i].to - walls.lines[i].from;
    std::vector<RowLine> lines;
    for (uint32_t i = 0; i < walls.lines.size(); ++i) {
        const float own_m = walls.lines[i].to - walls.lines[i].from, all_m = row_m[rows.find(i)];
        lines.push_back({walls.lines[i], all_m > own_m ? all_m : 0});
    }
    return lines;
}

struct Stretch {
    float from, to;
    float lengthIn(const Stretch& other) const { return std::min(to, other.to) - std::max(from, other.from); }
};

// In the order in which they begin, those that touch as one.
std::vector<Stretch> united(std::vector<Stretch> stretches) {
    std::ranges::sort(stretches, {}, [](const Stretch& s) { return std::pair(s.from, s.to); });
    std::vector<Stretch> whole;
    for (const Stretch& s : stretches) {
        if (whole.empty() || s.from > whole.back().to + same_line_m)
            whole.push_back(s);
        else
            whole.back().to = std::max(whole.back().to, s.to);
    }
    return whole;
}

class WallSplitter {
   public:
    WallSplitter(const WallLines& walls, float texels_per_metre)
        : walls_(walls),
          lines_(withRows(walls, rows_gap_texels / texels_per_metre)),
          needed_m_(length_min_texels / texels_per_metre) {}

    // The longest wall first; the others go on in the halves that they stand in. No recursion: a row of equal walls is
    // as deep as it is long.
    void split(std::vector<Piece> pieces) {
        std::vector<Part> open;
        open.push_back(partOf(std::move(pieces), lines_, {}));
        while (!open.empty()) {
            Part part = std::move(open.back());
            open.pop_back();
            const auto wall = longestWall(part);
            if (!wall) {
                done_.push_back(std::move(part));
                continue;
            }
            cuts_.push_back(*wall);
            part.borders.push_back(static_cast<uint32_t>(cuts_.size() - 1));
            for (const float sign : {1.0f, -1.0f}) {
                std::vector<Piece> side;
                for (const Piece& p : part.pieces) {
                    Piece half{p.face, clipped(p.corners, normalOf(*wall), wall->at, sign)};
                    if (half.corners.size() >= 3 && polygonArea(half.corners) > 1e-8f) side.push_back(std::move(half));
                }
                if (!side.empty()) open.push_back(partOf(std::move(side), part.cuts, part.borders));
            }
        }
    }

    // Parts that meet along slanted cuts, and nowhere with a wall between, are one: as charts of their own their
    // rectangles would take more of a page. Cuts along the axes take none, and texels line up with the walls.
    std::vector<std::vector<Piece>> joined() {
        Groups groups(done_.size());
        std::vector<std::tuple<float, uint32_t, uint32_t>> meetings;  // metres, the longest last
        for (const auto& [pair, border] : bordersOf()) {
            if (border.wall)
                groups.keepApart(pair.first, pair.second);
            else if (border.slanted_m > 0)
                meetings.emplace_back(border.slanted_m, pair.first, pair.second);
        }
        std::ranges::sort(meetings, std::greater());
        for (const auto& [length_m, first, second] : meetings) {
            const uint32_t a = groups.find(first), b = groups.find(second);
            if (a != b && !groups.areApart(a, b)) groups.join(a, b);
        }
        std::vector<std::vector<Piece>> parts;
        std::map<uint32_t, size_t> part_of;
        for (uint32_t i = 0; i < done_.size(); ++i) {
            const auto [it, fresh] = part_of.try_emplace(groups.find(i), parts.size());
            if (fresh) parts.emplace_back();
            std::ranges::move(done_[i].pieces, std::back_inserter(parts[it->second]));
        }
        return parts;
    }

   private:
    // What is left of a chart beside the walls so far, and the walls that may stand on it.
    struct Part {
        std::vector<Piece> pieces;
        std::vector<RowLine> cuts;      // those on lines through its rectangles, all of each line
        std::vector<Rect> rects;        // along the axes of each turn
        std::vector<uint32_t> borders;  // of cuts_, those along which it ends
    };

    Part partOf(std::vector<Piece> pieces, const std::vector<RowLine>& cuts,
                const std::vector<uint32_t>& borders) const {
        Part part{std::move(pieces), {}, std::vector<Rect>(walls_.turns.size()), {}};
        for (size_t t = 0; t < walls_.turns.size(); ++t)
            for (const Piece& piece : part.pieces)
                for (const glm::vec2 corner : piece.corners) part.rects[t].add(walls_.turns[t].on(corner));
        std::ranges::copy_if(cuts, std::back_inserter(part.cuts), [&](const RowLine& c) {
            return c.at >= part.rects[c.turn].min[c.axis] && c.at <= part.rects[c.turn].max[c.axis];
        });
        std::ranges::copy_if(borders, std::back_inserter(part.borders),
                             [&](uint32_t cut) { return !endsAt(part, cuts_[cut]).empty(); });
        return part;
    }

    glm::vec2 normalOf(const WallLine& wall) const { return walls_.turns[wall.turn].axis(wall.axis); }
    glm::vec2 alongOf(const WallLine& wall) const { return walls_.turns[wall.turn].axis(1 - wall.axis); }

    // Those on the line of one; lines ascend as StandingWalls has them.
    static std::span<const RowLine> onLineOf(const WallLine& wall, std::span<const RowLine> lines) {
        const auto place = [](const WallLine& c) { return std::tuple(c.turn, c.axis, c.at); };
        const float reach_m = same_line_m + slackAt(wall.at);
        const auto first =
            std::ranges::lower_bound(lines, std::tuple(wall.turn, wall.axis, wall.at - reach_m), {}, place);
        return {first, std::ranges::upper_bound(first, lines.end(), std::tuple(wall.turn, wall.axis, wall.at + reach_m),
                                                {}, place)};
    }

    static bool sameLine(const WallLine& a, const WallLine& b) { return std::abs(a.at - b.at) < same_line_m; }

    // Between two ends, with what goes on beyond doorways: at a few texels per metre no stretch between them is long. A
    // row of pillars, most of which is gap, is none.
    static float wallLength(const WallLine& cut, std::span<const RowLine> cuts, float low, float high) {
        float whole = 0, first = high, last = low;
        for (const WallLine& other : onLineOf(cut, cuts)) {
            const float from = std::max(other.from, low), to = std::min(other.to, high);
            if (!sameLine(other, cut) || from >= to) continue;
            whole += to - from;
            first = std::min(first, from);
            last = std::max(last, to);
        }
        return wall_share_min * (last - first) < whole ? whole : std::min(cut.to, high) - std::max(cut.from, low);
    }

    std::optional<WallLine> longestWall(const Part& part) const {
        std::optional<WallLine> best;
        float best_length = 0;
        for (const RowLine& c : part.cuts) {
            const auto& [low, high] = part.rects[c.turn];
            const float largest = std::max({-low.x, -low.y, high.x, high.y});
            const float margin = std::max(wall_margin_m, rounding_share * largest);
            const int along = 1 - c.axis;
            if (c.at < low[c.axis] + margin || c.at > high[c.axis] - margin) continue;
            const float length = wallLength(c, part.cuts, low[along], high[along]);
            const bool long_enough =
                length >= std::min(needed_m_, 0.5f * (high[along] - low[along])) || c.row_m >= needed_m_;
            if (!long_enough || length <= best_length) continue;
            if (c.turn != 0 && !standsOn(part, c)) continue;
            best = c;
            best_length = length;
        }
        return best;
    }

    // Its rectangle is more than a part; walls beside it in there are another part's.
    bool standsOn(const Part& part, const WallLine& wall) const {
        const glm::vec2 normal = normalOf(wall), along = alongOf(wall);
        return std::ranges::any_of(part.pieces, [&](const Piece& piece) {
            float from = wall.from, to = wall.to;
            const float side = signedArea(piece.corners) > 0 ? 1.0f : -1.0f;
            for (size_t i = 0; i < piece.corners.size(); ++i) {
                const glm::vec2 a = piece.corners[i], edge = piece.corners[(i + 1) % piece.corners.size()] - a;
                const glm::vec2 inwards = side * glm::vec2(-edge.y, edge.x);
                const float at_0 = glm::dot(wall.at * normal - a, inwards), slope = glm::dot(along, inwards);
                if (slope > 0)
                    from = std::max(from, -at_0 / slope);
                else if (slope < 0)
                    to = std::min(to, -at_0 / slope);
                else if (at_0 < 0)
                    return false;
            }
            return to - from > wall_margin_m;
        });
    }

    // Where edges of a part are on the line of a cut.
    std::vector<Stretch> endsAt(const Part& part, const WallLine& cut) const {
        const glm::vec2 normal = normalOf(cut), along = alongOf(cut);
        std::vector<Stretch> ends;
        for (const Piece& piece : part.pieces)
            for (size_t i = 0; i < piece.corners.size(); ++i) {
                const glm::vec2 a = piece.corners[i], b = piece.corners[(i + 1) % piece.corners.size()];
                if (std::abs(glm::dot(a, normal) - cut.at) > same_line_m ||
                    std::abs(glm::dot(b, normal) - cut.at) > same_line_m)
                    continue;
                const auto [from, to] = std::minmax({glm::dot(a, along), glm::dot(b, along)});
                if (to - from > same_line_m) ends.push_back({from, to});
            }
        return united(std::move(ends));
    }

    bool isBeyond(const Part& part, const WallLine& cut) const {
        const Rect& rect = part.rects[cut.turn];
        return rect.min[cut.axis] + rect.max[cut.axis] > 2 * cut.at;
    }

    struct Border {
        float slanted_m = 0;
        bool wall = false;  // stands on it somewhere
    };

    // Of done_, where two meet.
    std::map<std::pair<uint32_t, uint32_t>, Border> bordersOf() const {
        struct Side {
            uint32_t part;
            std::vector<Stretch> ends;
        };
        std::vector<std::array<std::vector<Side>, 2>> sides(cuts_.size());
        for (uint32_t i = 0; i < done_.size(); ++i)
            for (const uint32_t cut : done_[i].borders)
                sides[cut][isBeyond(done_[i], cuts_[cut])].push_back({i, endsAt(done_[i], cuts_[cut])});
        std::map<std::pair<uint32_t, uint32_t>, Border> borders;
        for (size_t cut = 0; cut < cuts_.size(); ++cut)
            for (const Side& a : sides[cut][0])
                for (const Side& b : sides[cut][1])
                    for (const Stretch& of_a : a.ends)
                        for (const Stretch& of_b : b.ends) {
                            if (of_a.lengthIn(of_b) <= same_line_m) continue;
                            Border& border = borders[std::minmax(a.part, b.part)];
                            if (cuts_[cut].turn != 0) border.slanted_m += of_a.lengthIn(of_b);
                            const Stretch both{std::max(of_a.from, of_b.from), std::min(of_a.to, of_b.to)};
                            border.wall = border.wall || hasWall(both, cuts_[cut]);
                        }
        return borders;
    }

    bool hasWall(const Stretch& stretch, const WallLine& cut) const {
        return std::ranges::any_of(onLineOf(cut, lines_), [&](const WallLine& wall) {
            return sameLine(wall, cut) && stretch.lengthIn({wall.from, wall.to}) > wall_margin_m;
        });
    }

    const WallLines& walls_;
    const std::vector<RowLine> lines_;
    const float needed_m_;
    std::vector<WallLine> cuts_;
    std::vector<Part> done_;
};

}  // namespace

std::vector<std::vector<Piece>> partsBeside(const WallLines& walls, std::vector<Piece> pieces, float texels_per_metre) {
    WallSplitter splitter(walls, texels_per_metre);
    splitter.split(std::move(pieces));
    return splitter.joined();
}

}  // namespace dimmer::cook
