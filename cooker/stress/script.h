// A game that does anything at any time: what the stress run's frames change, from a seed alone.
#pragma once

#include <dimmer/light_state.h>
#include <dimmer/models.h>

#include <random>
#include <variant>
#include <vector>

namespace dimmer::cook {

struct SetWeightEvent {
    LightSet set;
    Weight weight;
};
struct SetDoorEvent {
    Door door;
    float open = 0;
};
// The set goes to 0 and stays there until it is loaded again.
struct DropEvent {
    LightSet set;
};
struct BeginLoadEvent {
    LightSet set;
};
// Whatever is still loading is waited for; it takes weights from here on.
struct FinishLoadEvent {};
struct LimitsEvent {
    UpdateLimits limits;
};
// Movers are numbered by the script; a number is used again once its mover is gone.
struct AddMoverEvent {
    uint32_t mover = 0;
    ModelGrid grid;
    Transform transform;
};
struct MoveMoverEvent {
    uint32_t mover = 0;
    Transform transform;
};
struct RemoveMoverEvent {
    uint32_t mover = 0;
};

using StressEvent = std::variant<SetWeightEvent, SetDoorEvent, DropEvent, BeginLoadEvent, FinishLoadEvent, LimitsEvent,
                                 AddMoverEvent, MoveMoverEvent, RemoveMoverEvent>;

// What the events of all frames so far add up to.
struct StressState {
    std::vector<Weight> weights;  // per element; a door's opening in all channels
    struct Mover {
        bool there = false;
        ModelGrid grid;
        Transform transform;
    };
    std::vector<Mover> movers;
};

class StressScript {
   public:
    static constexpr uint32_t movers_max = 24, mover_probes_max = 64;

    StressScript(const Pack& pack, uint32_t seed);
    // The next frame's changes, in order; often none. Valid until the next call.
    const std::vector<StressEvent>& next();
    // Ends limits and loading, so that all that was asked for must show.
    const std::vector<StressEvent>& settle();
    const StressState& state() const { return state_; }

   private:
    enum class Records : uint8_t { Loaded, Loading, Dropped };

    float uniform(float low, float high);
    uint32_t below(uint32_t end);
    void changeElement();
    void changeAllSets();
    void changeRecords();
    void changeLimits();
    void changeMover();
    Transform randomTransform();
    void setWeight(uint32_t element, Weight weight);

    std::vector<Element> elements_;
    std::array<float, 3> min_m_{}, max_m_{};
    bool grid_ = false;
    std::mt19937 random_;
    uint32_t frame_ = 0, load_ends_ = 0;  // the frame at which loading is waited for
    std::vector<uint32_t> sets_;          // elements that are light sets
    std::vector<Records> records_;        // per element
    StressState state_;
    std::vector<StressEvent> events_;
};

}  // namespace dimmer::cook
