// grid.glsl on the device, held against its CPU twin.
#include <dimmer/cpu_runtime.h>
#include <dimmer/probe_grid.h>
#include <dimmer/runtime.h>
#include <gpu/kernel.h>
#include <gpu/transfer.h>
#include <gpu/vk_struct.h>
#include <probes/tetrahedron_walk.h>
#include <spirv/sample_grid_comp.h>

#include "gpu_fixture.h"
#include "model_pack.h"
#include "pages.h"

#include <cstring>

namespace dimmer {
namespace {

using test::valueOf;
using Vec4 = std::array<float, 4>;

struct GridQuery {
    Vec4 position;  // w: exposure
    Vec4 normal;    // w: colour format
    std::array<Vec4, 3> transfer;
    std::array<Vec4, 3> world_from_model;  // rows
};
struct Result {
    Vec4 model_lux, grid_lux, shadowed_lux;
};

std::vector<Result> onDevice(const VulkanContext& vulkan, const Runtime& runtime, const ModelSlot& slot,
                             const std::vector<GridQuery>& queries) {
    const auto filled = [&](const void* data, size_t bytes) {
        GpuBuffer buffer = valueOf(createBuffer(vulkan, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Upload));
        std::memcpy(buffer.mapped, data, bytes);
        return buffer;
    };
    static_assert(sizeof(ModelSlot) == 64);  // DimmerModelSlot
    const GpuBuffer model = filled(&slot, sizeof(slot)),
                    input = filled(queries.data(), queries.size() * sizeof(GridQuery));
    std::vector<Result> results(queries.size());
    const GpuBuffer output = valueOf(
        createBuffer(vulkan, results.size() * sizeof(Result), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Readback));
    const KernelBinding bindings[] = {
        KernelBinding::ofBuffer(runtime.probes(0)), KernelBinding::ofBuffer(runtime.gridTable()),
        KernelBinding::ofBuffer(model.buffer.get()), KernelBinding::ofBuffer(input.buffer.get()),
        KernelBinding::ofBuffer(output.buffer.get())};
    const Specialisation no_constants[] = {{}};
    const Kernel kernel = valueOf(Kernel::create(vulkan, {spirv::sample_grid_comp}, bindings, 4, no_constants));
    auto transfer = valueOf(Transfer::create(vulkan, MemoryUse::Readback));
    const auto done = transfer.run([&](VkCommandBuffer commands) {
        kernel.bind(commands, 0);
        vkCmdDispatch(commands, static_cast<uint32_t>((queries.size() + 63) / 64), 1, 1);
        auto barrier = vkStruct<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
        barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
        barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
        vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier,
                             0, nullptr, 0, nullptr);
    });
    if (!done) throw std::runtime_error(done.error().message);
    std::memcpy(results.data(), output.mapped, output.size_bytes);
    return results;
}

// A tetrahedron, and the flat one that every walk begins in: four probes of the floor, one of them within the triangle
// of the others, so that for a place above the volumes cancel to nothing.
GlobalGrid gridWithAFlatTetrahedron() {
    GlobalGrid grid;
    grid.positions = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 4}, {1, 1, 0}};
    grid.levels.assign(5, 0);
    grid.tetrahedra = {{{0, 1, 2, 4}, {1, 1, 1, 1}}, {{0, 1, 2, 3}}};
    grid.start = {{0, 0, 0}, {4, 4, 4}, {1, 1, 1}};
    grid.starts = {0};
    return grid;
}

TEST(TetrahedronWalk, GoesThroughWhatIsFlat) {
    const GridPlace place = locate(gridWithAFlatTetrahedron(), {1, 0.5f, 1});
    EXPECT_EQ(place.tetrahedron, 1u);
    EXPECT_EQ(place.barycentric, (Vec4{0.375f, 0.25f, 0.125f, 0.25f}));
}

class GridGlslTest : public test::GpuTest {};

TEST_F(GridGlslTest, AgreesWithTheCpu) {
    for (const auto format : {ColorFormat::E5B9G9R9, ColorFormat::R11G11B10F}) {
        test::Random random(21);
        PackData data = test::modelPack(2, 500, [](glm::vec3) { return glm::vec3(1); });
        data.color_format = format;
        for (auto* records : {&data.base_pages, &data.payload})
            for (TexelRecord& record : *records) record = test::randomRecord(random, data.exposure, format);
        for (ProbeRecord& probe : data.probes.base) probe = test::randomProbe(random, format);
        data.probes.global.visibility.resize(data.probes.global.tetrahedra.size());
        for (TetrahedronVisibility& v : data.probes.global.visibility)
            for (auto& probe : v.seen)
                for (int8_t& value : probe) value = static_cast<int8_t>(test::pick(random, 0, 255));
        const Pack pack = test::packOf(std::move(data));
        Runtime gpu = valueOf(Runtime::create(device().context(), pack, {.moving_probes_max = 64}));
        CpuRuntime cpu(pack, 1, 64);
        const ModelGrid grid{{-1, -0.5f, -2}, {1, 0.5f, 2}, {4, 1, 5}};
        const Transform place = {{{{0.6f, 0, 0.8f, 5}, {0, 1, 0, 2}, {-0.8f, 0, 0.6f, 6}}}};
        const ModelSlot slot = *gpu.modelSlot(*gpu.addModel(grid, place));
        ASSERT_TRUE(cpu.addModel(grid, place) && gpu.submit() && gpu.wait());
        cpu.update();

        std::vector<GridQuery> queries(2000);
        std::vector<ModelVertex> vertices;
        for (GridQuery& q : queries) {
            const float z = test::uniform(random, -1, 1), angle = test::uniform(random, 0, 6.2831853f);
            const float r = std::sqrt(1 - z * z);
            q = {{test::uniform(random, 2, 8), test::uniform(random, -1, 4), test::uniform(random, 3, 9),
                  pack.exposure()},
                 {r * std::cos(angle), r * std::sin(angle), z, static_cast<float>(format)},
                 {},
                 place.rows};
            vertices.push_back(test::randomModelVertex(random));
            for (size_t k = 0; k < 9; ++k)
                q.transfer[k / 4][k % 4] = std::max(static_cast<float>(vertices.back().transfer[k]) / 127, -1.0f);
        }
        const auto results = onDevice(device().context(), gpu, slot, queries);
        const GridSampler sampler(pack, cpu.probes());
        for (size_t i = 0; i < queries.size(); ++i) {
            const std::array<float, 3> p = {queries[i].position[0], queries[i].position[1], queries[i].position[2]};
            const std::array<float, 3> n = {queries[i].normal[0], queries[i].normal[1], queries[i].normal[2]};
            const auto model_lux = sampler.sample(slot, p, n), grid_lux = sampler.sample(p, n);
            const auto shadowed_lux = sampler.sampleTransfer(slot, p, modelTransfer(vertices[i], place));
            const auto model_light = sampler.radiance(slot, p), grid_light = sampler.radiance(p);
            for (size_t c = 0; c < 3; ++c) {
                // Nine terms as large as L_00 times sqrt 5 each, rounded at 6e-8 some twenty times.
                const float model_tolerance = 1e-4f * model_light.coefficients[0][c] + 1e-12f;
                const float grid_tolerance = 1e-4f * grid_light.coefficients[0][c] + 1e-12f;
                ASSERT_NEAR(results[i].model_lux[c], model_lux[c], model_tolerance) << i;
                ASSERT_NEAR(results[i].grid_lux[c], grid_lux[c], grid_tolerance) << i;
                ASSERT_NEAR(results[i].shadowed_lux[c], shadowed_lux[c], model_tolerance) << i;
            }
        }
        // A slot of no model is black.
        for (const Result& r : onDevice(device().context(), gpu, ModelSlot{}, queries))
            for (size_t c = 0; c < 3; ++c) ASSERT_TRUE(r.model_lux[c] == 0 && r.shadowed_lux[c] == 0);
        EXPECT_EQ(sampler.sample(ModelSlot{}, {5, 2, 6}, {0, 1, 0}), (std::array<float, 3>{}));
    }
}

TEST_F(GridGlslTest, WalksThroughWhatIsFlatAsTheCpuDoes) {
    test::Random random(22);
    PackData data = test::modelPack(2, 5, [](glm::vec3) { return glm::vec3(1); });
    data.probes.global = gridWithAFlatTetrahedron();
    data.probes.base.resize(5);
    for (ProbeRecord& probe : data.probes.base) probe = test::randomProbe(random, data.color_format);
    const Pack pack = test::packOf(std::move(data));
    Runtime gpu = runtimeOf(pack, {.moving_probes_max = 64});
    CpuRuntime cpu(pack, 1, 64);
    for (LightState* state : {static_cast<LightState*>(&gpu), static_cast<LightState*>(&cpu)})
        ASSERT_TRUE(state->addModel({{0.25f, 0.25f, 0.25f}, {1.25f, 1.25f, 1.25f}, {3, 3, 3}}, {}));
    ASSERT_TRUE(gpu.submit());
    cpu.update();
    const auto pages = gpu.readPages();
    ASSERT_TRUE(pages) << pages.error().message;
    EXPECT_TRUE(std::ranges::equal(pages->probes, cpu.probes()));
}

}  // namespace
}  // namespace dimmer
