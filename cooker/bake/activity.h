// Where the light of a term is worth storing: what its threshold is, and the receivers that it reaches with as much.
#pragma once

#include <bake/door_surroundings.h>
#include <bake/series.h>

namespace dimmer::cook {

// Of a series whose direct and bounced light is known. All is kept by reference.
class Activity {
   public:
    Activity(const Gatherer& gatherer, const BakeSettings& settings, const Sparse<uint32_t>& doors_seen)
        : gatherer_(gatherer), settings_(settings), paths_(gatherer.paths()), doors_seen_(doors_seen) {}

    // Per term; of TermReport, all that needs no knowledge of where the term is active. `most`: no threshold is taken
    // to be a larger share.
    std::vector<TermReport> thresholds(const Series& light, float most) const;
    // Fills in thresholds and what they are shares of.
    void measure(Series& series) const;
    // Of a series measured: fills in what the reports lack, and leaves of `bounced` what is active.
    void decide(Series& series) const;
    // Per term, what is stored of it if nothing is dropped, lm.
    std::vector<double> flux(const Series& light) const;

   private:
    struct Around;
    void forEachPair(const Series& light, size_t begin, size_t end, auto&& visit) const;
    float doorBase(const Term& term, float group_mean_lux, const DoorSurroundings& around) const;
    bool seesDoorOf(size_t receiver, uint32_t term) const;
    SparseLight activeAround(const Series& series) const;
    bool nearInSpace(size_t a, size_t b) const;
    void forEachAround(size_t texel, auto&& visit) const;

    const Gatherer& gatherer_;
    const BakeSettings& settings_;
    const DoorPaths& paths_;
    const Sparse<uint32_t>& doors_seen_;
};

}  // namespace dimmer::cook
