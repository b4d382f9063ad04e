// Everything of a runtime that is on the device. Members are destroyed in reverse, after waiting for what submit()
// sent.
#pragma once

#include <dimmer/runtime.h>
#include <gpu/lightmap_pages.h>
#include <gpu/probe_blender.h>
#include <gpu/probe_resampler.h>
#include <gpu/record_loader.h>
#include <gpu/texel_executor.h>
#include <gpu/update_timer.h>
#include <gpu/vulkan_functions.h>
#include <probes/model_slots.h>

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace dimmer {

struct Runtime::Impl {
    VulkanFunctions functions;  // first: every other member calls them to its end
    VulkanContext vulkan;
    std::vector<LightmapPages> pages;  // one set, or two that take turns
    uint32_t probe_sets = 1;           // likewise
    uint32_t page_sets = 1;            // of both, as asked for
    // The sets of pages and of probes to sample, and those that the last plan writes. Probes are not limited, so they
    // change places with every update, pages when a state is complete.
    uint32_t front = 0, target = 0;
    uint32_t probe_front = 0, probe_target = 0;
    std::unique_ptr<TexelExecutor> executor;    // none when the pack has no receivers
    std::optional<ProbeBlender> probes;         // none when the pack has no probes that change
    std::optional<ProbeAtlas> atlas;            // none when there are no probes
    std::optional<GpuBuffer> grid_table;        // none when the pack has no global grid
    std::optional<ProbeResampler> resampler;    // none without room for moving models
    std::span<const ResampleItem> model_items;  // of the last plan
    bool texels_planned = false, probes_planned = false, models_planned = false;
    // Of the last update that record() found work for, unless submit() found some since: what discardRecorded() takes
    // back, and the sets that were to be sampled before.
    struct Recording {
        bool texels, probes, models;
        uint32_t target, probe_target, front, probe_front;
        uint32_t list;  // likewise, that the next update takes then
    };
    std::optional<Recording> recorded;
    // What an update that may be on its way has for itself, beside the work list of the same number.
    struct List {
        CommandBuffer own;       // for submit()
        uint64_t submitted = 0;  // the timeline's value when submit()'s update with it is done; 0: record() had it last
    };
    std::vector<List> lists;
    uint32_t list = 0;                                 // of the last update
    std::optional<RecordLoader> loader;                // none in modes that load nothing later
    std::vector<LightSet> loading;                     // sets whose records are on their way
    std::vector<RecordsState> records;                 // per element
    std::vector<std::vector<uint32_t>> contributions;  // likewise
    std::optional<UpdateTimer> timer;
    SemaphoreHandle timeline;
    uint64_t submitted = 0;  // the timeline's value when the last submission is done
    UpdateStats stats;       // of the last update
    bool timed = false;      // the last update wrote timestamps that were not read yet

    ~Impl() { (void)waitFor(submitted); }

    Expected<void> create(const PackData& data, const Planner& planner, const Planner* probe_planner,
                          const ModelSlots& models, const RuntimeOptions& options);
    Expected<void> createExecutors(const PackData& data, const Planner& planner, const RuntimeOptions& options,
                                   Transfer& transfer);
    Expected<void> createProbes(const PackData& data, const Planner* probe_planner, const ModelSlots& models,
                                uint32_t list_count, Transfer& transfer);
    Expected<void> createLists(uint32_t count);
    uint32_t dispatchProbes(VkCommandBuffer commands, const Planner* probe_planner, VkPipelineStageFlags readers);
    Expected<void> createPages(const PackData& data, uint32_t count, Transfer& transfer);
    VkQueue ownQueue() const { return vulkan.compute_queue ? vulkan.compute_queue : vulkan.queue; }
    uint32_t ownFamily() const { return vulkan.compute_queue ? vulkan.compute_queue_family : vulkan.queue_family; }
    Expected<void> waitFor(uint64_t value) const;
    Expected<void> takeList(bool for_recording);
    void recordUpdate(VkCommandBuffer commands, const Planner& planner, const Planner* probe_planner, bool drawing);
    Expected<void> submitUpdate(const Planner& planner, const Planner* probe_planner, const SubmitWait& wait);
};

}  // namespace dimmer
