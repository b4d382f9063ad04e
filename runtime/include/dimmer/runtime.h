// The Vulkan runtime: blends a pack's records into lightmap images by compute whenever a weight changed.
#pragma once

#include <dimmer/light_state.h>

#include <vulkan/vulkan.h>

#include <memory>
#include <vector>

namespace dimmer {

// How a queue is shared with other threads: both functions are called around each single use of it (a submission, or a
// wait for it to be idle), which is short; never one within the other. They must not throw, nor call the runtime.
struct QueueLock {
    void (*lock)(void* user, VkQueue queue) = nullptr;
    void (*unlock)(void* user, VkQueue queue) = nullptr;
    void* user = nullptr;
};

// The caller's device; it must outlive the runtime. Needs Vulkan 1.2, of the instance too, and a queue family with
// compute; no optional feature beyond timelineSemaphore (core in 1.2): every runtime has such a semaphore.
struct VulkanContext {
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical_device = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    uint32_t queue_family = 0;  // the queue's, and that of the command buffers given to record()
    // Optional: a queue with compute on which submit() runs beside the other, of the same family or another one (then
    // images and buffers are shared concurrently between the two families, and no third may use them).
    VkQueue compute_queue = VK_NULL_HANDLE;
    uint32_t compute_queue_family = 0;
    // What the runtime asks for Vulkan's functions, once, in create(). Null: the system's loader (libvulkan.so.1,
    // vulkan-1.dll), which create() opens then, and nothing before. An engine whose instance is another loader's gives
    // that one's. The functions are the process's: all runtimes that live at one time need the same ones.
    PFN_vkGetInstanceProcAddr get_instance_proc_addr = nullptr;
    // Optional: create() makes its pipelines, up to 25 small ones, with it. Synchronised as it was made to be.
    VkPipelineCache pipeline_cache = VK_NULL_HANDLE;
    // Optional: for games with threads that submit to the same queues meanwhile, as frames go on while a level is
    // created. Empty: the caller keeps them out for as long as a call takes that uses a queue.
    QueueLock queue_lock{};
};

// How pages are updated. All give the same bits; every one but the first is there to be compared and to check with.
enum class UpdateMode {
    WorkList,        // one dispatch per number of contributions that are on; 9 to 12 are one, 13 to 16, and all above
    PerCombination,  // one dispatch per changed cluster
    Gather,          // a list of records per texel; all texels whenever anything changed
    Scatter,         // one pass per contribution over 32-bit sums; all texels whenever anything changed
};

enum class Buffering {
    InPlace,  // updates write the pages and probes that frames read, between barriers of their own
    // Updates write a second set of pages, which takes the first one's place when it is complete, and one of probes, so
    // that frames in flight go on reading the old light. Twice the memory for pages and probes.
    Double,
};

struct RuntimeOptions {
    UpdateMode mode = UpdateMode::WorkList;
    Buffering buffering = Buffering::InPlace;
    // Updates that may be on their way at a time, 1 to 8: work lists for so many, which are a few per cent of the
    // pack's bytes. A game with two frames in flight that record()s asks for 2.
    uint32_t frames_in_flight = 1;
    // Device memory for texels' records, in bytes; 0: room for all. Less needs load_records = false: then light sets
    // are loaded and dropped as the game moves on.
    uint64_t records_bytes_max = 0;
    // Load every light set's records in create(). False: none (each set is held at 0 until loadRecords() brings them);
    // always-on light that doors let through is loaded in any case. Light probes' records, a fraction of all, are
    // always there: what moves through a level asks for any of them at any time.
    bool load_records = true;
    // Room for the probes of moving models (LightState::addModel), in probes, up to moving_probes_limit; each model
    // takes a multiple of 8 of them in a row. 0, or a pack without a global light grid: no models, and nothing is kept
    // for them.
    uint32_t moving_probes_max = 0;
    // Write GPU timestamps around each update, read by wait(). Off costs nothing.
    bool timestamps = true;
};

// The lightmap as a shader samples it: 2D arrays, one layer per page, in SHADER_READ_ONLY_OPTIMAL between updates: who
// brings them to another layout brings them back before the next.
struct LightmapImages {
    VkImage irradiance = VK_NULL_HANDLE;           // in the pack's ColorFormat; lux * exposure
    VkImageView irradiance_view = VK_NULL_HANDLE;  // VK_IMAGE_VIEW_TYPE_2D_ARRAY
    VkImage direction = VK_NULL_HANDLE;            // A2B10G10R10_UNORM_PACK32; see sample.glsl
    VkImageView direction_view = VK_NULL_HANDLE;
    VkSampler sampler = VK_NULL_HANDLE;  // bilinear, clamp to edge
    uint32_t width = 0, height = 0, layers = 0;
};

enum class RecordsState { Loaded, Loading, Dropped };

// Of everything that was asked for since nothing was loading.
struct LoadProgress {
    uint64_t done_bytes = 0, total_bytes = 0;
    bool finished() const { return done_bytes == total_bytes; }
};

// What an update of submit() waits for: a semaphore that says that the frames which read what it writes are done.
// Timeline semaphores only: where nothing changed nothing waits, and a binary semaphore would stay signalled. A value
// that nobody ever signals blocks for ever, as nothing here has a time limit: wait(), readPages(), a record() or
// submit() that finds work and takes the same work list (with one frame in flight the next), and the destructor.
struct SubmitWait {
    VkSemaphore semaphore = VK_NULL_HANDLE;  // null: nothing
    uint64_t value = 0;
};

// What a runtime keeps on the device between updates.
struct DeviceFootprint {
    uint64_t bytes = 0;      // memory of buffers and images; what drivers add to align it is not counted
    uint32_t pipelines = 0;  // compute pipelines
};

// Not thread-safe; external synchronisation of the queue is the caller's, as in Vulkan itself: QueueLock.
class Runtime : public LightState {
   public:
    // Uploads the pack's records and the base pages (blocking). Device memory: footprint().
    // InvalidArgument: a null handle (only compute_queue and pipeline_cache may be), a queue family that is not there,
    // or one without compute; options out of their range. OutOfMemory: of the device's or the host's, or
    // records_bytes_max is too little. Unsupported: a device below Vulkan 1.2, or without a format or limit that the
    // pack needs; a loader without a function of Vulkan 1.2, or another one than a runtime has that lives. Whether
    // timelineSemaphore is enabled, and the queues are of these families, it cannot see.
    [[nodiscard]] static Expected<Runtime> create(const VulkanContext& vulkan, const Pack& pack,
                                                  const RuntimeOptions& options = {});
    // Waits for what submit() and continueLoading() sent, and for nothing else. Of the caller's submissions those must
    // have completed before that have a record()ed update in them, read pages, probes or gridTable(), or wait for
    // semaphore(). What was recorded and not submitted must not be any more.
    ~Runtime();
    // Every handle stays valid, whatever is in flight. A runtime that was moved from may only be destroyed or assigned
    // to; assigning destroys the one that was there, as the destructor does.
    Runtime(Runtime&&) noexcept;
    Runtime& operator=(Runtime&&) noexcept;

    // What an update writes, by record() or submit(): InPlace, images() and probes(0). Double, images(pageSet() ^ 1)
    // and probes(probeSet() ^ 1), by the numbers from before the call; afterwards pageSet() and probeSet() say what to
    // read once it is done. While it is under way shaders may read the sets pageSet() and probeSet() from before the
    // call (Double alone), and gridTable(), which nothing writes. Before it begins, shaders that read what it writes
    // must be done. Its barriers see to that for earlier fragment and compute shaders on VulkanContext::queue, and for
    // compute shaders alone on compute_queue; other stages need a barrier of the caller's before and after, other
    // queues semaphores: SubmitWait, or a wait of the submission that has the recording.

    // Records the update into the caller's command buffer, outside a render pass: a few dispatches (UpdateMode), with
    // the barriers that let fragment and compute shaders sample afterwards. The command buffer must be of
    // VulkanContext::queue_family, and be submitted to VulkanContext::queue, once, recordings in the order of their
    // calls and before any later submit(): each writes only what changed since the one before. Its compute pipeline,
    // compute descriptor sets and push constants are others afterwards. Nothing changed: records nothing (0
    // dispatches). A call that records overwrites the work list of the update frames_in_flight updates ago: where
    // record() made that, its submission must have completed on the GPU (idle calls do not count, so that the fence of
    // frames_in_flight frames ago says so); where submit() did, the call blocks until it has, and where submit() has
    // another queue, until all that it sent has.
    [[nodiscard]] Expected<UpdateStats> record(VkCommandBuffer commands);
    // The commands of the last record() that found work will never run (a frame was given up): the next update does
    // their work. Calls of record() and submit() that found nothing to do may have come since. Where submit() found
    // work since, or it was taken back already, nothing happens, and it says false. Of several recordings only the last
    // can be taken back; invalidate() makes up for others.
    bool discardRecorded();
    // Nobody knows which updates ran: the next ones write all that any could have written. As expensive as a change of
    // every light set, of both sets with Buffering::Double.
    void invalidate();

    // The same on the context's compute queue, or its queue where it has none, with a command buffer of the runtime's
    // own. Returns at once, but for a call with work while as many earlier ones as frames_in_flight are under way: it
    // blocks until the first of them is done. It does not wait for what was record()ed, of which the same must have
    // completed as before a record(), and all where it has another queue. Nothing changed: no submission, no wait, and
    // `wait` is not waited for. Where the pages or probes to write were read on another queue, `wait` must say when
    // that is done: Double, the last frame that read images(pageSet() ^ 1) or probes(probeSet() ^ 1).
    [[nodiscard]] Expected<UpdateStats> submit(const SubmitWait& wait = {});
    // The timeline semaphore of submit() and the value that its last submission signals; 0 before the first.
    VkSemaphore semaphore() const;
    uint64_t semaphoreValue() const;
    // Blocks until what submit() sent is done. Statistics of the last update that did anything, GPU time included;
    // after record(), call it once the commands have completed.
    [[nodiscard]] Expected<UpdateStats> wait();

    // Frees the device memory of a light set's records for other sets. Its weight is 0 from now on and refuses others;
    // the next update takes its light off the pages. What was record()ed before must have been submitted, and have
    // completed where submit() has another queue; or it never runs (discardRecorded()). Unsupported in modes gather and
    // scatter.
    [[nodiscard]] Expected<void> dropRecords(LightSet set);
    // Begins to bring them (back); continueLoading() does it. OutOfMemory, with nothing changed, when there is no room:
    // it takes a free range of records_bytes_max for each of the set's contributions, so that what is free may be in
    // too many pieces.
    // Loaded, the set is at 0 and takes any weight.
    [[nodiscard]] Expected<void> loadRecords(LightSet set);
    RecordsState recordsState(LightSet set) const;
    // Of the memory for texels' records: what a light set's take, and what no set's do. 0 in modes gather and scatter.
    uint64_t recordBytes(LightSet set) const;
    uint64_t freeRecordBytes() const;
    // Copies the next piece, of at most so many bytes (and 4 MiB, as for 0), and returns at once; while the last piece
    // is under way it does nothing. Call it once a frame. Uses the queue of submit(), and 4 MiB of staging memory while
    // it loads.
    [[nodiscard]] Expected<LoadProgress> continueLoading(uint64_t bytes_max = 4 << 20);

    // The pages to sample after the last update. Buffering::Double: call it after each, as two sets take turns, even
    // after one of 0 dispatches: where the other set held the state already, it is shown without a recording. The
    // other set is pageSet() ^ 1, for descriptors that are written once.
    LightmapImages images() const { return images(pageSet()); }
    LightmapImages images(uint32_t page_set) const;
    uint32_t pageSet() const;
    uint32_t setCount() const;  // 1 or 2; of what never changes both are one
    // The light probes, by their number, 7 words each (see runtime/format/probe.h): a storage buffer, with those of
    // models behind the pack's. Null where there are none. Shaders read it by grid.glsl. Buffering::Double: of two
    // sets, probeSet() is the one to read after the last update; limits are of pages alone, so the two part ways.
    VkBuffer probes(uint32_t probe_set) const;
    uint32_t probeSet() const;
    // The global light grid's tables for grid.glsl, a storage buffer; null where the pack has no such grid.
    VkBuffer gridTable() const;
    // In mode WorkList, with pages in place, one frame in flight, all records and no moving probes: the device memory
    // that `dimmer inspect` states. A level without a light set or door that
    // changes anything has its pages, and its light grid's probes and tables, and nothing else.
    DeviceFootprint footprint() const;

    // Copies the pages to host memory (blocking; for tools and tests), layout as in CpuRuntime. Runs on
    // VulkanContext::queue: no other queue may read them meanwhile.
    struct Pages {
        std::vector<uint32_t> irradiance, direction;
        std::vector<uint32_t> probes;  // empty where probes() is null
    };
    [[nodiscard]] Expected<Pages> readPages();

   private:
    struct Impl;
    Runtime(const Pack& pack, std::unique_ptr<Impl> impl, uint32_t moving_probes_max);
    void planTexels(UpdateStats& stats);
    void planProbes(UpdateStats& stats);
    bool planNext(UpdateStats& stats);
    void rollback();
    const Planner* plannedProbes() const;
    [[nodiscard]] Expected<void> checkLoadable(LightSet set) const;
    void finishLoading();
    void finish();
    std::unique_ptr<Impl> impl_;
};

}  // namespace dimmer
