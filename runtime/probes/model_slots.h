// The probes of moving models: who has which, and which are to be taken from the global grid anew. No Vulkan in it.
#pragma once

#include <dimmer/light_state.h>
#include <dimmer/models.h>
#include <pack/pack_data.h>
#include <probes/lit_cells.h>
#include <update/record_pool.h>

#include <dimmer/work_list.glsl>
#include <span>
#include <vector>

namespace dimmer {

// Where a grid's probes are. An axis along which it has one probe, or no length, is flat: all of it is that probe.
ModelSlot slotOf(const LocalGrid& grid);

// What taking a probe anew moves at least: its tetrahedron, the places and light of the four corners, hint and result.
inline constexpr uint64_t resample_bytes_read = 48 + 4 * (16 + sizeof(ProbeRecord)) + sizeof(uint32_t);
inline constexpr uint64_t resample_bytes_written = sizeof(ProbeRecord) + sizeof(uint32_t);
void countResampled(std::span<const ResampleItem> items, UpdateStats& stats);

class ModelSlots {
   public:
    // Numbers of moving probes begin behind the pack's own. Reserves for the worst case; nothing where the pack has no
    // global grid, as no model can be added.
    ModelSlots(const PackData& data, uint32_t probes_max, uint32_t page_sets);

    Expected<Model> add(const ModelGrid& grid, const Transform& transform);
    Expected<void> move(Model model, const Transform& transform);
    Expected<void> remove(Model model);
    Expected<ModelSlot> slot(Model model) const;
    uint32_t probesMax() const { return probes_max_; }
    uint32_t itemsMax() const { return probes_max_ / probes_granule; }

    // The light of these batches of probes has changed. Cost: the cells of their clusters and of the models.
    void touch(uint32_t page_set, std::span<const WorkItem> items);
    bool dirty(uint32_t page_set) const { return dirty_counts_[page_set] > 0; }
    // Lists the probes to be taken anew and counts them as done. Valid until the next call.
    std::span<const ResampleItem> take(uint32_t page_set);
    // What take() listed was not carried out.
    void rollback(uint32_t page_set);
    // Nor, perhaps, anything that it ever listed.
    void rollbackAll();

   private:
    // Models take whole granules, so that work lists have a size that fits all.
    static constexpr uint32_t probes_granule = 8;

    struct Slot {
        ModelGrid grid;
        Transform transform;
        Box box;
        uint32_t first_probe = 0, generation = 1;
        uint32_t dirty = 0;  // a bit per set of pages
        uint32_t taken = 0;  // likewise, by the last take()
        bool used = false;
    };
    Expected<uint32_t> find(Model model) const;
    void place(Slot& slot, const Transform& transform);
    void mark(Slot& slot, uint32_t sets);
    uint32_t allSets() const { return (1u << page_sets_) - 1; }
    static uint32_t inGranules(uint32_t probes) { return (probes + probes_granule - 1) / probes_granule; }
    static uint32_t granules(const ModelGrid& grid) { return inGranules(grid.probeCount()); }

    uint32_t first_probe_ = 0, page_sets_ = 1;
    bool has_grid_ = false;
    uint32_t probes_max_ = 0, model_count_ = 0;
    Box grid_box_;     // places outside have the light of its nearest point
    RecordPool pool_;  // of granules
    std::vector<Slot> slots_;
    std::vector<uint32_t> free_slots_;
    std::vector<uint32_t> dirty_counts_;  // per set of pages
    LitCells cells_;
    std::vector<ResampleItem> items_;
};

}  // namespace dimmer
