// What the game controls: the weights of light sets and doors. Both runtimes (Vulkan and CPU) are one.
#pragma once

#include <dimmer/error.h>
#include <dimmer/models.h>
#include <dimmer/pack.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <string_view>
#include <vector>

namespace dimmer {

class ModelSlots;
class Planner;

// Handles: look a name up once, then pass the handle. They are valid for every runtime of the same pack: the index of
// the light set or door in Pack::elements(), as which a mesh or a model names it too. One of another kind, or of no
// element, is refused; one of another pack cannot be told.
struct LightSet {
    uint32_t element = std::numeric_limits<uint32_t>::max();
};
struct Door {
    uint32_t element = std::numeric_limits<uint32_t>::max();
};

// Without a runtime. NotFound names the nearest.
[[nodiscard]] Expected<LightSet> findLightSet(const Pack& pack, std::string_view name);
[[nodiscard]] Expected<Door> findDoor(const Pack& pack, std::string_view name);

// How strongly a light set shines, per linear Rec.709 channel; 1 is as baked. A scalar dims, three numbers recolour.
struct Weight {
    float r = 1, g = 1, b = 1;
    Weight() = default;
    Weight(float scalar) : r(scalar), g(scalar), b(scalar) {}  // NOLINT: a weight is a number to the game
    Weight(float red, float green, float blue) : r(red), g(green), b(blue) {}
    bool operator==(const Weight&) const = default;
};

// What an update may leave for later. In every case the pages end up exactly as the weights say, once changes stop
// (and the tolerance is 0).
struct UpdateLimits {
    // Texels that one update writes at most (probes are always up to date), in whole batches of up to 64; 0: no limit.
    // The most visible changes come first, and what waits counts for more with every update.
    uint32_t receivers_max = 0;
    // A cluster of texels is left as it is while none of their stored irradiances is further from what the weights
    // say than so many steps of the format, counted from what was last written. At 0.5 the stored value is one step off
    // at most. 0: everything is written.
    float tolerance_quanta = 0;
    bool operator==(const UpdateLimits&) const = default;
};

// Not thread-safe: call from one thread at a time. Nothing here touches a GPU; a change costs nanoseconds and takes
// effect with the runtime's next update. At the start every set has weight 1 (its maximum, where that is
// smaller) and every door is closed.
class LightState {
   public:
    [[nodiscard]] Expected<LightSet> lightSet(std::string_view name) const;
    [[nodiscard]] Expected<Door> door(std::string_view name) const;

    // Refused, with nothing changed, when a channel is NaN, infinite, negative or above the set's maximum, and, unless
    // it is 0, for a set whose records are not loaded (Runtime::dropRecords).
    [[nodiscard]] Expected<void> setWeight(LightSet set, Weight weight);
    // `open`: 0 closed .. 1 open.
    [[nodiscard]] Expected<void> setDoor(Door door, float open);
    // All at once, e.g. "hall=0.5,alarm=1/0.2/0.2,door:front=1"; "all=0" sets every light set first, wherever it is
    // written (sets whose records are not loaded stay at 0). What is not named keeps its weight. On an error nothing
    // has changed.
    [[nodiscard]] Expected<void> apply(std::string_view state);
    // Takes effect with the next update; 0 and 0 bring the exact state with it. The first call that sets a limit costs
    // a pass over the pack's records. Refused: a tolerance that is negative or not finite.
    [[nodiscard]] Expected<void> setLimits(const UpdateLimits& limits);

    // A thing that moves gets probes of its own, as many as its grid says, taken from the level's global grid by the
    // next update, and again whenever it moved or the light around it changed. Refused, with nothing changed: a grid or
    // transform that is not finite, a singular transform; Unsupported where the pack has no global grid; OutOfMemory
    // where no free range of moving_probes_max is long enough for its probes, in multiples of 8. Constant time but for
    // the number of models.
    [[nodiscard]] Expected<Model> addModel(const ModelGrid& grid, const Transform& transform);
    [[nodiscard]] Expected<void> moveModel(Model model, const Transform& transform);
    [[nodiscard]] Expected<void> removeModel(Model model);
    // For shading; changes with the transform alone.
    [[nodiscard]] Expected<ModelSlot> modelSlot(Model model) const;

    Weight weight(LightSet set) const;
    float open(Door door) const;
    const Pack& pack() const { return pack_; }

   protected:
    // Moved and destroyed as the runtime that it is, never as a part of it.
    ~LightState();
    LightState(LightState&&) noexcept;
    LightState& operator=(LightState&&) noexcept;
    // One planner per set of pages: each knows what its own pages have yet to catch up on.
    explicit LightState(const Pack& pack, uint32_t page_sets = 1, uint32_t moving_probes_max = 0);
    Planner& planner(uint32_t page_set = 0) { return *planners_[page_set]; }
    const Planner& planner(uint32_t page_set = 0) const { return *planners_[page_set]; }
    // Of the light probes; none where the pack has no dynamic light on any.
    bool hasProbes() const { return !probe_planners_.empty(); }
    Planner& probePlanner(uint32_t page_set = 0) { return *probe_planners_[page_set]; }
    const Planner& probePlanner(uint32_t page_set = 0) const { return *probe_planners_[page_set]; }
    ModelSlots& models() { return *models_; }
    const ModelSlots& models() const { return *models_; }
    // A held set is at 0 and refuses other weights: its records are not there. Released, it is still at 0.
    void hold(LightSet set, bool held);
    [[nodiscard]] Expected<void> checkSet(LightSet set) const;

   private:
    void setElement(uint32_t element, Weight weight);
    [[nodiscard]] Expected<void> checkHeld(uint32_t element, const Weight& weight) const;

    Pack pack_;
    std::vector<std::unique_ptr<Planner>> planners_, probe_planners_;
    std::unique_ptr<ModelSlots> models_;
    std::vector<bool> held_;  // per element
};

// What one update touched. Bytes are those that the kernels read and write, by count of records.
struct UpdateStats {
    uint32_t contributions_changed = 0;
    uint32_t clusters = 0;
    uint32_t batches = 0;
    uint64_t receivers = 0;
    uint32_t dispatches = 0;
    uint32_t clusters_put_off = 0;  // by UpdateLimits::tolerance_quanta
    // Left for later updates by UpdateLimits::receivers_max, at most, of the state that is being written: with two sets
    // of pages a newer one may follow. Pages hold the last weights once an update has no dispatch and none is waiting.
    uint64_t receivers_waiting = 0;
    uint64_t probes_resampled = 0;  // of moving models
    uint64_t bytes_read = 0;
    uint64_t bytes_written = 0;
    double host_us = 0;  // planning and recording
    double gpu_us = 0;   // by timestamps; 0 when the device has none or nothing ran
};

}  // namespace dimmer
