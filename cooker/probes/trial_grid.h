// A grid of given probes, and how wrong it is: what placement tries out.
#pragma once

#include <probes/placement.h>
#include <probes/tetrahedron_walk.h>
#include <trace/triangle_cells.h>

#include <unordered_map>

namespace dimmer::cook {

// Places of SiteChoice without its corners, and the round in which each was taken.
struct ChosenProbes {
    std::vector<uint32_t> places;
    std::vector<uint8_t> levels;
};

// Deterministic for any number of threads. `rays`, `states` and `settings` must outlive it.
class TrialGrid {
   public:
    TrialGrid(const RayScene& rays, const SiteChoice& choice, std::span<const FitValue> states,
              const GridSettings& settings);

    // All that follows is of the last grid built, and of the first `places`: fewer than placeCount() cost less.
    Expected<void> build(const ChosenProbes& probes, size_t places);

    struct Result {
        Placement placement;  // sites: the places looked at
        std::vector<GridPlace> at;
        std::vector<float> errors;  // 0 for probes
    };
    const Result& result() const { return result_; }
    // Takes an earlier result of build() for the last one.
    void restore(ChosenProbes probes, Result result);
    bool looksAtAll() const { return result_.errors.size() == placeCount(); }
    // With tables as close as packs have them: those of build() are quick ones. Of all places.
    Placement take();

    double meanError() const;
    // How wrong a probe's place would be without it, by what its neighbours in sight have, times what it stands for.
    std::vector<float> usefulness() const;

    const std::vector<glm::vec3>& places() const { return places_; }
    size_t placeCount() const { return first_corner_; }  // without corners

   private:
    using Key = std::array<uint32_t, 4>;
    void decideImportance(std::span<const SiteRow> order);  // of the places
    uint32_t placeOf(uint32_t position) const;
    bool isFree(uint32_t position) const;
    void findPlaces();
    void locatePlaces(size_t places);
    Key keyOf(const Tetrahedron& t) const;
    // Of tetrahedra in which somebody asks for light: a game may anywhere.
    enum class Asked : uint8_t { AtPlaces, Anywhere };
    void findVisibility(Asked asked, uint32_t points);
    void findShares();
    void findErrors();
    float errorOf(const FitValue& light, const FitValue& traced) const;
    std::vector<std::pair<uint32_t, uint32_t>> edges() const;

    const RayScene& rays_;
    const TriangleCells cells_;
    const Box air_;
    std::span<const FitValue> states_;  // per place
    const GridSettings& settings_;
    std::vector<glm::vec3> places_;  // and behind them the free corners of the box
    float error_max_;
    size_t first_corner_;
    std::vector<uint32_t> corners_;  // per corner: its place, or no_index
    uint32_t search_points_;
    float floor_lux_ = 0;
    std::vector<float> importance_;  // per place
    struct HashOfKey {
        size_t operator()(const Key& key) const;
    };
    std::unordered_map<Key, TetrahedronVisibility, HashOfKey> seen_;
    ChosenProbes probes_;
    std::vector<bool> is_probe_;  // per place but corners
    Result result_;
};

}  // namespace dimmer::cook
