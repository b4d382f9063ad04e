// The runtimes of a stress run, driven alike.
#pragma once

#include <stress/script.h>
#include <tools/headless_device.h>

#include <memory>
#include <string>
#include <vector>

namespace dimmer::cook {

// Everything that a shader could sample, as codes.
struct StressPages {
    std::vector<uint32_t> irradiance, direction, probes;
};

class StressExecutor {
   public:
    StressExecutor(std::string name) : name_(std::move(name)), movers_(StressScript::movers_max) {}
    virtual ~StressExecutor() = default;

    const std::string& name() const { return name_; }
    Expected<void> apply(const StressEvent& event);
    // One frame's update.
    virtual Expected<UpdateStats> update() = 0;
    virtual Expected<StressPages> pages() = 0;
    virtual uint64_t deviceBytes() const { return 0; }
    // Null where the script has no such mover.
    Expected<ModelSlot> slotOf(uint32_t mover) { return state().modelSlot(movers_[mover]); }

   protected:
    virtual LightState& state() = 0;
    // Where records are always there, a dropped set is just off.
    virtual Expected<void> drop(LightSet set) { return state().setWeight(set, 0); }
    virtual Expected<void> beginLoad(LightSet) { return {}; }
    virtual Expected<void> finishLoad() { return {}; }

   private:
    std::string name_;
    std::vector<Model> movers_;
};

// The CPU runtime on one thread and on all; where there is a device, the Vulkan runtime in every update mode and both
// bufferings. `device` may be null, and must outlive them.
Expected<std::vector<std::unique_ptr<StressExecutor>>> stressExecutors(const Pack& pack, const HeadlessDevice* device);

// All light of `state` at once, blended by a runtime that has seen nothing else, and where it has each mover.
struct FreshBlend {
    StressPages pages;
    std::vector<ModelSlot> slots;  // by mover; counts of 0 where there is none
};
Expected<FreshBlend> freshBlend(const Pack& pack, const StressState& state);

}  // namespace dimmer::cook
