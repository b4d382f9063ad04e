#include <stress/executors.h>

#include <dimmer/cpu_runtime.h>

#include <algorithm>
#include <thread>

namespace dimmer::cook {
namespace {

constexpr uint32_t moving_probes_max = StressScript::movers_max * StressScript::mover_probes_max;

class CpuExecutor final : public StressExecutor {
   public:
    CpuExecutor(std::string name, const Pack& pack, uint32_t threads)
        : StressExecutor(std::move(name)), runtime_(pack, threads, moving_probes_max) {}
    Expected<UpdateStats> update() override { return runtime_.update(); }
    Expected<StressPages> pages() override {
        const auto copy = [](std::span<const uint32_t> s) { return std::vector<uint32_t>(s.begin(), s.end()); };
        return StressPages{copy(runtime_.irradiancePages()), copy(runtime_.directionPages()), copy(runtime_.probes())};
    }

   private:
    LightState& state() override { return runtime_; }
    CpuRuntime runtime_;
};

class VulkanExecutor final : public StressExecutor {
   public:
    VulkanExecutor(std::string name, Runtime runtime, bool drops)
        : StressExecutor(std::move(name)), runtime_(std::move(runtime)), drops_(drops) {}
    Expected<UpdateStats> update() override {
        if (loading_) {
            // Little at a time, so that frames go by in between.
            const auto progress = runtime_.continueLoading(1 << 16);
            if (!progress) return std::unexpected(progress.error());
        }
        return runtime_.submit();
    }
    Expected<StressPages> pages() override {
        if (auto stats = runtime_.wait(); !stats) return std::unexpected(std::move(stats.error()));
        auto pages = runtime_.readPages();
        if (!pages) return std::unexpected(std::move(pages.error()));
        return StressPages{std::move(pages->irradiance), std::move(pages->direction), std::move(pages->probes)};
    }
    uint64_t deviceBytes() const override { return runtime_.footprint().bytes; }

   private:
    LightState& state() override { return runtime_; }
    Expected<void> drop(LightSet set) override {
        return drops_ ? runtime_.dropRecords(set) : StressExecutor::drop(set);
    }
    Expected<void> beginLoad(LightSet set) override {
        if (!drops_) return {};
        loading_ = true;
        return runtime_.loadRecords(set);
    }
    Expected<void> finishLoad() override {
        while (loading_) {
            const auto progress = runtime_.continueLoading();
            if (!progress) return std::unexpected(progress.error());
            loading_ = !progress->finished();
        }
        return {};
    }

    Runtime runtime_;
    bool drops_, loading_ = false;
};

struct VulkanKind {
    const char* name;
    UpdateMode mode;
    Buffering buffering;
};
constexpr VulkanKind vulkan_kinds[] = {
    {"worklist", UpdateMode::WorkList, Buffering::InPlace},
    {"worklist, double-buffered", UpdateMode::WorkList, Buffering::Double},
    {"per-combination", UpdateMode::PerCombination, Buffering::InPlace},
    {"gather", UpdateMode::Gather, Buffering::InPlace},
    {"scatter", UpdateMode::Scatter, Buffering::InPlace},
};

Expected<void> setElements(LightState& to, const StressState& state) {
    const auto elements = to.pack().elements();
    for (uint32_t i = 0; i < elements.size(); ++i) {
        const auto ok = elements[i].kind == ElementKind::Door ? to.setDoor(Door{i}, state.weights[i].r)
                                                              : to.setWeight(LightSet{i}, state.weights[i]);
        if (!ok) return ok;
    }
    return {};
}

template <class... Cases>
struct Match : Cases... {
    using Cases::operator()...;
};

}  // namespace

Expected<void> StressExecutor::apply(const StressEvent& event) {
    return std::visit(Match{[&](const SetWeightEvent& e) { return state().setWeight(e.set, e.weight); },
                            [&](const SetDoorEvent& e) { return state().setDoor(e.door, e.open); },
                            [&](const DropEvent& e) { return drop(e.set); },
                            [&](const BeginLoadEvent& e) { return beginLoad(e.set); },
                            [&](const FinishLoadEvent&) { return finishLoad(); },
                            [&](const LimitsEvent& e) { return state().setLimits(e.limits); },
                            [&](const AddMoverEvent& e) -> Expected<void> {
                                auto model = state().addModel(e.grid, e.transform);
                                if (!model) return std::unexpected(std::move(model.error()));
                                movers_[e.mover] = *model;
                                return {};
                            },
                            [&](const MoveMoverEvent& e) { return state().moveModel(movers_[e.mover], e.transform); },
                            [&](const RemoveMoverEvent& e) { return state().removeModel(movers_[e.mover]); }},
                      event);
}

Expected<std::vector<std::unique_ptr<StressExecutor>>> stressExecutors(const Pack& pack, const HeadlessDevice* device) {
    std::vector<std::unique_ptr<StressExecutor>> executors;
    executors.push_back(std::make_unique<CpuExecutor>("cpu, one thread", pack, 1));
    executors.push_back(
        std::make_unique<CpuExecutor>("cpu, all threads", pack, std::max(2u, std::thread::hardware_concurrency())));
    if (!device) return executors;
    for (const VulkanKind& kind : vulkan_kinds) {
        auto runtime = Runtime::create(device->context(), pack,
                                       {.mode = kind.mode,
                                        .buffering = kind.buffering,
                                        .moving_probes_max = moving_probes_max,
                                        .timestamps = false});
        if (!runtime) return std::unexpected(std::move(runtime.error()));
        const bool drops = kind.mode != UpdateMode::Gather && kind.mode != UpdateMode::Scatter;
        executors.push_back(std::make_unique<VulkanExecutor>(kind.name, std::move(*runtime), drops));
    }
    return executors;
}

Expected<FreshBlend> freshBlend(const Pack& pack, const StressState& state) {
    CpuRuntime fresh(pack, 1, moving_probes_max);
    if (auto ok = setElements(fresh, state); !ok) return std::unexpected(std::move(ok.error()));
    FreshBlend blend;
    for (const auto& mover : state.movers) {
        blend.slots.emplace_back();
        if (!mover.there) continue;
        const auto model = fresh.addModel(mover.grid, mover.transform);
        if (!model) return std::unexpected(model.error());
        blend.slots.back() = *fresh.modelSlot(*model);
    }
    fresh.update();
    const auto copy = [](std::span<const uint32_t> s) { return std::vector<uint32_t>(s.begin(), s.end()); };
    blend.pages = {copy(fresh.irradiancePages()), copy(fresh.directionPages()), copy(fresh.probes())};
    return blend;
}

}  // namespace dimmer::cook
