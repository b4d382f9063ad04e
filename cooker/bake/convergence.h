// How light that is followed bounce after bounce nears what it comes to: how to get there in fewer rounds, and when
// what is still to come is little.
#pragma once

#include <bake/gather.h>
#include <bake/links.h>
#include <bake/sparse_light.h>

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// The share of light that a bounce leaves in the long run, 0..1 per channel: the largest eigenvalue of the transport
// along `links`, by power iteration over some thousand random walks. Doors are shut. `rays`: behind each receiver's
// links, those that met nothing among them. Within a few percent; its cost does not grow with the level. Deterministic.
glm::vec3 longRunAlbedo(const Gatherer& gatherer, const Links& links, uint32_t rays);

// Chebyshev's semi-iterative method (G. Golub and R. Varga 1961) for x = direct bounce of x: the light of the round
// after next is x[n+1] = x[n-1] + weight * (bounce of x[n] - x[n-1]), per channel. Light transport has real
// eigenvalues, as places see one another alike; those within -albedo..albedo then shrink by albedo / (1 + sqrt(1 -
// albedo^2)) a round in place of `albedo`. An albedo that is off costs rounds; what the light comes to is the same.
class Acceleration {
   public:
    explicit Acceleration(glm::vec3 albedo);
    // Weights of the next round; 1 in the first.
    glm::vec3 nextWeight();
    // What is left of a step after a round, in the long run.
    glm::vec3 ratio() const;

   private:
    glm::vec3 albedo_;  // below 1
    glm::vec3 weight_{1}, weight_after_;
};

// How far each light group is from its end. Light counts as a share of what is there: what lies in a dim room as well
// as what the sun lights. Each channel by itself: what red walls do to a light dies down later than what they do to
// the blue in it.
class Convergence {
   public:
    // `ratio`: steps shrink by no more a round.
    Convergence(const Gatherer& gatherer, glm::vec3 ratio);

    // After a round, for groups that run (per group, not 0).
    void measure(const SparseLight& before, const SparseLight& after, std::span<const uint8_t> running);
    // Whether less than a share of the light of the group, in its strongest channel, is still to come in any.
    bool ends(uint32_t group, float tail_max) const;

   private:
    struct Flux {
        // Shares of what is there, m2: bounced so far; what the last round changed, either way; what is still to come.
        glm::dvec3 sum{0}, step{0}, to_come{0};
        glm::dvec3 last_ratio{1};  // of a step and the one before
        glm::dvec3 ratio{1};       // in the mean over two rounds, while steps are light
        glm::vec3 floor_lux{0};
    };

    void foresee(Flux& group, glm::dvec3 step, glm::dvec3 ratio) const;
    void addUp(std::span<const TermLight> row, std::vector<glm::vec3>& there) const;
    void clear(std::span<const TermLight> row, std::vector<glm::vec3>& there) const;
    void measureFloors(const SparseLight& light);

    const Gatherer& gatherer_;
    const DoorPaths& paths_;
    glm::dvec3 ratio_;
    std::vector<Flux> groups_;
};

}  // namespace dimmer::cook
