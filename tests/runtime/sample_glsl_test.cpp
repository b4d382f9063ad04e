// sample.glsl through the device's own sampler, held against its CPU twin.
#include <charts/unwrap.h>
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <gpu/transfer.h>
#include <gpu/vk_struct.h>
#include <spirv/sample_lightmap_comp.h>

#include "gpu_fixture.h"
#include "pages.h"

#include <cstring>

namespace dimmer {
namespace {

using test::valueOf;

struct LightmapQuery {
    std::array<float, 4> uv_page;  // w: exposure
    std::array<float, 4> normal;   // world space; w: directional model
    // Of the surface, and by the pixel, where the world is the tangent frame.
    std::array<float, 4> mesh_normal = {0, 0, 1};
    std::array<float, 4> position_dx = {1}, position_dy = {0, 1};
    std::array<float, 4> uv_dx_dy = {1, 0, 0, 1};
};

void check(VkResult result) {
    if (result != VK_SUCCESS) throw std::runtime_error("a Vulkan call of the test failed");
}

// The kernel sample_lightmap.comp over a lightmap.
class Sampler {
   public:
    Sampler(const VulkanContext& vulkan, const LightmapImages& images) : vulkan_(vulkan), images_(images) {
        createPipeline();
    }

    std::vector<std::array<float, 4>> sample(const std::vector<LightmapQuery>& queries) {
        const GpuBuffer input = valueOf(createBuffer(vulkan_, queries.size() * sizeof(LightmapQuery),
                                                     VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Upload));
        std::vector<std::array<float, 4>> results(queries.size());
        const GpuBuffer output = valueOf(createBuffer(vulkan_, results.size() * sizeof(results[0]),
                                                      VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Readback));
        std::memcpy(input.mapped, queries.data(), input.size_bytes);
        writeDescriptors(input.buffer.get(), output.buffer.get());
        auto transfer = valueOf(Transfer::create(vulkan_, MemoryUse::Readback));
        const auto done = transfer.run([&](VkCommandBuffer commands) {
            vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_.get());
            vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_.get(), 0, 1, &set_, 0, nullptr);
            vkCmdDispatch(commands, static_cast<uint32_t>((queries.size() + 63) / 64), 1, 1);
            auto barrier = vkStruct<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
            barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
            barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
            vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1,
                                 &barrier, 0, nullptr, 0, nullptr);
        });
        if (!done) throw std::runtime_error(done.error().message);
        std::memcpy(results.data(), output.mapped, output.size_bytes);
        return results;
    }

   private:
    void createPipeline() {
        std::array<VkDescriptorSetLayoutBinding, 4> bindings{};
        for (uint32_t i = 0; i < 4; ++i)
            bindings[i] = {i, i < 2 ? VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1,
                           VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
        auto set_info = vkStruct<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
        set_info.bindingCount = 4;
        set_info.pBindings = bindings.data();
        VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
        check(vkCreateDescriptorSetLayout(vulkan_.device, &set_info, nullptr, &set_layout));
        set_layout_ = SetLayoutHandle(vulkan_.device, set_layout);

        auto layout_info = vkStruct<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
        layout_info.setLayoutCount = 1;
        layout_info.pSetLayouts = &set_layout;
        VkPipelineLayout layout = VK_NULL_HANDLE;
        check(vkCreatePipelineLayout(vulkan_.device, &layout_info, nullptr, &layout));
        layout_ = PipelineLayoutHandle(vulkan_.device, layout);

        auto module_info = vkStruct<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
        module_info.codeSize = sizeof(spirv::sample_lightmap_comp);
        module_info.pCode = spirv::sample_lightmap_comp;
        VkShaderModule raw_module = VK_NULL_HANDLE;
        check(vkCreateShaderModule(vulkan_.device, &module_info, nullptr, &raw_module));
        const ShaderModuleHandle module(vulkan_.device, raw_module);

        auto info = vkStruct<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
        info.stage = vkStruct<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
        info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
        info.stage.module = raw_module;
        info.stage.pName = "main";
        info.layout = layout;
        VkPipeline pipeline = VK_NULL_HANDLE;
        check(vkCreateComputePipelines(vulkan_.device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline));
        pipeline_ = PipelineHandle(vulkan_.device, pipeline);

        const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 2},
                                              {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2}};
        auto pool_info = vkStruct<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
        pool_info.maxSets = 1;
        pool_info.poolSizeCount = 2;
        pool_info.pPoolSizes = sizes;
        VkDescriptorPool pool = VK_NULL_HANDLE;
        check(vkCreateDescriptorPool(vulkan_.device, &pool_info, nullptr, &pool));
        pool_ = DescriptorPoolHandle(vulkan_.device, pool);
        auto allocate = vkStruct<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
        allocate.descriptorPool = pool;
        allocate.descriptorSetCount = 1;
        allocate.pSetLayouts = &set_layout;
        check(vkAllocateDescriptorSets(vulkan_.device, &allocate, &set_));
    }

    void writeDescriptors(VkBuffer input, VkBuffer output) {
        const VkDescriptorImageInfo images[] = {
            {images_.sampler, images_.irradiance_view, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL},
            {images_.sampler, images_.direction_view, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL}};
        const VkDescriptorBufferInfo buffers[] = {{input, 0, VK_WHOLE_SIZE}, {output, 0, VK_WHOLE_SIZE}};
        std::array<VkWriteDescriptorSet, 4> writes;
        for (uint32_t i = 0; i < 4; ++i) {
            writes[i] = vkStruct<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
            writes[i].dstSet = set_;
            writes[i].dstBinding = i;
            writes[i].descriptorCount = 1;
            writes[i].descriptorType =
                i < 2 ? VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
            if (i < 2)
                writes[i].pImageInfo = &images[i];
            else
                writes[i].pBufferInfo = &buffers[i - 2];
        }
        vkUpdateDescriptorSets(vulkan_.device, 4, writes.data(), 0, nullptr);
    }

    VulkanContext vulkan_;
    LightmapImages images_;
    SetLayoutHandle set_layout_;
    PipelineLayoutHandle layout_;
    PipelineHandle pipeline_;
    DescriptorPoolHandle pool_;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
};

// Two pages of smooth light with highlights well off the surface; no dynamic light is needed here.
Pack smoothPack(ColorFormat format, DirectionModel model) {
    PackData data;
    data.color_format = format;
    data.direction_model = model;
    data.exposure = 0.25f;
    data.page_count = 2;
    data.page_width = 16;
    data.page_height = 8;
    for (uint32_t page = 0; page < 2; ++page)
        for (uint32_t y = 0; y < 8; ++y)
            for (uint32_t x = 0; x < 16; ++x) {
                // r = 0.25, |b_x| and |b_y| at most 0.7 of a share of 0.75.
                const uint32_t r = 10 + x + 50 * page, g = 20 + y, b = 30 - x;
                const uint32_t irradiance = format == ColorFormat::E5B9G9R9
                                                ? 4 * r | 4 * g << 9 | 4 * b << 18 | 22u << 27  // steps of a quarter
                                                : test::floorUfloatCode(r, 6) | test::floorUfloatCode(g, 6) << 11 |
                                                      test::floorUfloatCode(b, 5) << 22;
                data.base_pages.push_back({irradiance, 256u | (512 - 27 + 3 * x) << 10 | (512 - 27 + 6 * y) << 20});
            }
    return valueOf(Pack::fromData(std::move(data)));
}

// Shares of the irradiance on the surface's own normal.
struct Tolerance {
    float own_normal, other_normals;
};

class SampleGlslTest : public test::GpuTest {
   protected:
    // Samples at `uvs` of both pages for several normals on both executors.
    void expectAgreement(const std::vector<std::array<float, 2>>& uvs, const Tolerance& tolerance) {
        for (const auto format : {ColorFormat::R11G11B10F, ColorFormat::E5B9G9R9})
            for (const auto model : {DirectionModel::Ahd, DirectionModel::Linear})
                expectAgreement(smoothPack(format, model), uvs, tolerance);
    }
    void expectAgreement(const Pack& pack, const std::vector<std::array<float, 2>>& uvs, const Tolerance& tolerance) {
        const auto model = static_cast<float>(pack.directionModel());
        const CpuRuntime cpu(pack);
        const Runtime gpu = valueOf(Runtime::create(device().context(), pack));
        constexpr std::array<std::array<float, 3>, 5> normals{
            {{0, 0, 1}, {0.6f, 0, 0.8f}, {0, -0.8f, 0.6f}, {-0.48f, 0.6f, 0.64f}, {0.6f, 0.64f, -0.48f}}};
        std::vector<LightmapQuery> queries;
        for (float page : {0.0f, 1.0f})
            for (const auto& uv : uvs)
                for (const auto& n : normals)
                    queries.push_back({{uv[0], uv[1], page, pack.exposure()}, {n[0], n[1], n[2], model}});
        const auto results = Sampler(device().context(), gpu.images()).sample(queries);
        auto onCpu = [&](const std::array<float, 4>& uv, const std::array<float, 4>& n) {
            return sampleLightmap(pack, cpu.irradiancePages(), cpu.directionPages(), static_cast<uint32_t>(uv[2]),
                                  {uv[0], uv[1]}, {n[0], n[1], n[2]});
        };
        for (size_t i = 0; i < queries.size(); ++i) {
            const auto &uv = queries[i].uv_page, &n = queries[i].normal;
            const auto expected = onCpu(uv, n), e_z = onCpu(uv, {0, 0, 1, 0});
            const float share = n[2] == 1 ? tolerance.own_normal : tolerance.other_normals;
            for (size_t c = 0; c < 3; ++c)
                EXPECT_NEAR(results[i][c], expected[c], share * e_z[c])
                    << "at " << uv[0] << " " << uv[1] << " page " << uv[2] << " normal " << n[0] << " " << n[1];
        }
    }
};

TEST_F(SampleGlslTest, AgreesWithTheCpuAtTexelCentres) {
    std::vector<std::array<float, 2>> centres;
    for (float y = 0.5f; y < 8; ++y)
        for (float x = 0.5f; x < 16; ++x) centres.push_back({x / 16, y / 8});
    expectAgreement(centres, {.own_normal = 1e-5f, .other_normals = 1e-5f});
}

// Samplers mix with weights of 8 bits, off by 1/256 at most along each axis. Colour differs between neighbours by a
// tenth at most, along one axis: 4e-4 of it. Of the direction, r is the same everywhere, and b differs by 3 steps of
// 5/256 along x and 6 along y: off by 2.3e-4 and 4.6e-4, so for any normal by 5.2e-4. With |b| below 0.75 light on
// another normal is up to 1.75 of that on the own one: 1.75 4e-4 + 5.2e-4 = 1.2e-3. Both rounded up by a quarter.
TEST_F(SampleGlslTest, AgreesWithTheCpuBetweenTexelsAndPastEdges) {
    test::Random random(1);
    std::vector<std::array<float, 2>> places = {{0, 0}, {1, 1}, {-0.5f, 0.3f}, {0.4f, 1.5f}};
    for (int i = 0; i < 200; ++i) places.push_back({test::uniform(random, 0, 1), test::uniform(random, 0, 1)});
    expectAgreement(places, {.own_normal = 5e-4f, .other_normals = 1.5e-3f});
}

// A normal map's normal in the world, on triangles that stand and are unwrapped anyhow, seen from anywhere.
TEST_F(SampleGlslTest, TangentFramesAreThoseOfTheBake) {
    const Pack pack = smoothPack(ColorFormat::E5B9G9R9, DirectionModel::Ahd);
    const CpuRuntime cpu(pack);
    const Runtime gpu = valueOf(Runtime::create(device().context(), pack));
    const std::array<float, 2> centre = {5.5f / 16, 2.5f / 8};
    test::Random random(7);
    const auto uniform = [&](float min, float max) { return test::uniform(random, min, max); };
    const auto direction = [&] {
        glm::vec3 d;
        do d = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
        while (glm::length(d) < 0.1f || glm::length(d) > 1);
        return glm::normalize(d);
    };
    const auto vec4 = [](glm::vec3 v, float w = 0) { return std::array{v.x, v.y, v.z, w}; };
    std::vector<LightmapQuery> queries;
    std::vector<std::array<float, 3>> expected;
    uint32_t mirrored = 0;
    while (queries.size() < 500) {
        const glm::vec3 by_u = 3.0f * direction(), by_v = 0.2f * direction(), face = glm::cross(by_u, by_v);
        const glm::vec2 uv_dx = {uniform(-1, 1), uniform(-1, 1)}, uv_dy = {uniform(-1, 1), uniform(-1, 1)};
        if (glm::length(face) < 0.1f || std::abs(uv_dx.x * uv_dy.y - uv_dx.y * uv_dy.x) < 0.1f) continue;
        const bool mirror = queries.size() % 2 == 1;
        mirrored += mirror;
        // The interpolated normal is not the face's.
        const glm::vec3 normal = glm::normalize((mirror ? -1.0f : 1.0f) * glm::normalize(face) + 0.4f * direction());
        float texel_area_m2 = 0;
        const cook::TangentFrame frame = cook::tangentFrame(
            {glm::vec3(0), by_u, by_v}, {glm::vec2(0), glm::vec2(1, 0), glm::vec2(0, 1)}, normal, texel_area_m2);
        const glm::vec3 shading = glm::normalize(normal + 0.9f * direction());
        const glm::vec3 position_dx = by_u * uv_dx.x + by_v * uv_dx.y, position_dy = by_u * uv_dy.x + by_v * uv_dy.y;
        queries.push_back({.uv_page = {centre[0], centre[1], 0, pack.exposure()},
                           .normal = vec4(shading, 0),
                           .mesh_normal = vec4(normal),
                           .position_dx = vec4(position_dx),
                           .position_dy = vec4(position_dy),
                           .uv_dx_dy = {uv_dx.x, uv_dx.y, uv_dy.x, uv_dy.y}});
        expected.push_back(sampleLightmap(
            pack, cpu.irradiancePages(), cpu.directionPages(), 0, centre,
            {glm::dot(shading, frame.tangent), glm::dot(shading, frame.bitangent), glm::dot(shading, frame.normal)}));
    }
    ASSERT_EQ(mirrored, queries.size() / 2);
    const auto results = Sampler(device().context(), gpu.images()).sample(queries);
    // Derivatives by u lose two digits where the pixel's are nearly parallel (a determinant of 0.1): 2^-24 * 100 of
    // the tangent, times the rounding of a texture's filter as at the other centres.
    const auto own = sampleLightmap(pack, cpu.irradiancePages(), cpu.directionPages(), 0, centre, {0, 0, 1});
    for (size_t i = 0; i < queries.size(); ++i)
        for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(results[i][c], expected[i][c], 2e-5f * own[c]) << i;
}

}  // namespace
}  // namespace dimmer
