// The CPU executor: the twin of the Vulkan runtime, bit for bit on every device whose 32-bit +, - and * round to
// nearest, as IEEE's do: blends use nothing else (Vulkan demands correct rounding of these, and leaves the direction
// open). For tests, tools and servers without a GPU.
#pragma once

#include <dimmer/light_state.h>

#include <array>
#include <memory>
#include <span>
#include <vector>

namespace dimmer {

class WorkerPool;
struct WorkList;
struct TexelRecord;

class CpuRuntime : public LightState {
   public:
    // `threads`: how many blend large updates, the caller's included, at most 1,024; the pages are the same whatever
    // their number. `moving_probes_max`: as in RuntimeOptions,
    // and no more than the limit whatever is asked.
    explicit CpuRuntime(const Pack& pack, uint32_t threads = 1, uint32_t moving_probes_max = 0);
    ~CpuRuntime();
    CpuRuntime(CpuRuntime&&) noexcept;
    CpuRuntime& operator=(CpuRuntime&&) noexcept;

    // Blends what changed since the last call into the pages. Nothing changed: returns at once. Allocates nothing, so
    // nothing fails. Not thread-safe.
    UpdateStats update();

    // The lightmap pages, one after another, rows from the top; in the sampled formats: Pack::colorFormat() and
    // A2B10G10R10_UNORM_PACK32.
    std::span<const uint32_t> irradiancePages() const { return irradiance_; }
    std::span<const uint32_t> directionPages() const { return direction_; }

    // The light probes by their number, 7 words each (see runtime/format/probe.h); behind the pack's those of models.
    std::span<const uint32_t> probes() const { return probes_; }

   private:
    template <ColorFormat format>
    void updateTexels();
    template <ColorFormat format>
    void updateProbes();
    void updateModels(UpdateStats& stats);
    template <class Blend>
    void forItems(const WorkList& work, const Blend& blend);

    std::unique_ptr<WorkerPool> pool_;  // none for one thread
    std::vector<uint32_t> irradiance_;
    std::vector<uint32_t> direction_;
    std::vector<uint32_t> probes_;
    std::vector<uint32_t> hints_;    // per probe of a model: the tetrahedron that it was in
    std::vector<TexelRecord> base_;  // per receiver, in the order in which updates read it
};

// Irradiance in lux, bilinear, of pages as above (from either runtime). `uv` is 0..1 over the page; `normal_tangent`
// the unit normal in the texel's tangent frame, (0,0,1) for the surface's own. Black where the pack has no such page or
// the pages hold fewer texels than its own. Thread-safe. The CPU twin of dimmer_lightmap_irradiance in sample.glsl.
std::array<float, 3> sampleLightmap(const Pack& pack, std::span<const uint32_t> irradiance_pages,
                                    std::span<const uint32_t> direction_pages, uint32_t page, std::array<float, 2> uv,
                                    std::array<float, 3> normal_tangent);

}  // namespace dimmer
