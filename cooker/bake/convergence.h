// How light that is followed bounce after bounce nears what it comes to: how to get there in fewer rounds, and when
// what is still to come is little.
#pragma once

#include <bake/gather.h>
#include <bake/links.h>
#include <bake/sparse_light.h>
#include <bake/sums.h>

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// The share of light that a bounce leaves in the long run, 0..0.98 per channel: the largest eigenvalue of the transport
// along the `links` through no door, by power iteration over a population of random walks. Too low where what keeps
// light longest is so small a part of the level that no walk begins there. `rays`: behind each receiver's links, those
// that met nothing among them. Costs as much in any level. Deterministic.
glm::vec3 longRunAlbedo(const Gatherer& gatherer, const Links& links, uint32_t rays);

// Chebyshev's semi-iterative method (G. Golub and R. Varga 1961) for x = direct bounce of x: the light of the round
// after next is x[n+1] = x[n-1] + weight * (bounce of x[n] - x[n-1]), per channel. Light transport has real
// eigenvalues, -albedo..albedo, as places see one another alike. `links` of each place, drawn at random, add complex
// ones as far as albedo / sqrt(links) from 0: the weights are those of the ellipse around both (T. Manteuffel 1977),
// for a single link those of plain bounces. An albedo that is off costs rounds; what the light comes to in the end is
// the same.
class Acceleration {
   public:
    Acceleration(glm::vec3 albedo, uint32_t links);
    // Weights of the next round; 1 in the first.
    glm::vec3 nextWeight();
    glm::vec3 albedo() const { return albedo_; }
    // What a round leaves of what is still to come, in the long run.
    glm::vec3 ratio() const;
    // The eigenvalue, beyond the foci, of light of which a round leaves `ratio` of a channel in the long run.
    double eigenvalueOf(double ratio, int channel) const;

   private:
    glm::vec3 albedo_;  // below 1
    float links_;
    glm::vec3 foci2_;  // the square of the ellipse's foci
    glm::vec3 weight_{1}, weight_after_;
};

// How far each light group is from its end, from what a bounce would change. Light counts as a share of what is there:
// what lies in a dim room as well as what the sun lights. Each channel by itself: what red walls do to a light dies
// down later than what they do to the blue in it. What rounding does (TermLight) is told apart by adding up: over the
// whole group, and over each block of rows, which are neighbours, where the whole may not see too much light here
// and too little there.
class Convergence {
   public:
    // Of light at places of these areas. `pace`: at which rounds go.
    Convergence(const DoorPaths& paths, std::span<const float> areas_m2, const Acceleration& pace);

    struct Change {
        uint32_t term;
        glm::vec3 has_lux, gets_lux;  // before a bounce of all light, and after
    };
    // One worker's part of a round, block by block.
    class Part {
       public:
        Part(const Convergence& of, Sums& sums);
        void addRow(size_t place, std::span<const Change> row);
        void closeBlock();

       private:
        // Of a term, as shares of what is there: what a bounce adds, and the variance that rounding gives it.
        struct Added {
            glm::dvec3 m2{0}, variance_m4{0};
        };
        const Convergence& of_;
        Sums& sums_;
        std::vector<glm::vec3> there_lux_;  // per group, 0 between rows
        TermAccumulator<Added> in_block_;
    };

    // For groups that run (per group, not 0): a round that begins with `light`; the sums of no part of it; and all of
    // them, with which it ends.
    void begin(const SparseLight& light);
    Sums none() const { return Sums(count * groups_.size()); }
    void end(const Sums& all, std::span<const uint8_t> running);

    // Whether less than a share of the light of the group, in its strongest channel, is still to come in any.
    bool ends(uint32_t group, float tail_max) const;

   private:
    struct Flux;
    void foresee(Flux& group, int channel, double there_m2, double lacking_m2) const;

    // What is added up of each group, in each channel: what is there; what a bounce adds to it, with its variance; and
    // the same, either way, of all blocks.
    enum Number : size_t { There, Lacking, Variance, LackingInBlocks, numbers };
    static constexpr size_t channels = 3, count = numbers * channels;
    static size_t index(size_t group, Number number, size_t channel) {
        return count * group + channels * number + channel;
    }
    struct Flux {
        glm::dvec3 there_m2{0}, lacking_m2{0}, to_come_m2{0};  // as shares of what is there
        // The largest that is to come by the level's albedo, and what rounds left of what is lacking.
        glm::dvec3 foreseen_m2{0}, last_ratio{0};
        glm::vec3 floor_lux{0};
    };

    const DoorPaths& paths_;
    std::span<const float> areas_m2_;
    Acceleration pace_;
    std::vector<Flux> groups_;
};

}  // namespace dimmer::cook
