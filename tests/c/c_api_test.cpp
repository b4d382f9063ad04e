// The C interface: C code (c_api.c, compiled as C11) drives it, and what it blends is compared with the C++ runtime.
#include <c/c_api.h>
#include <dimmer/cpu_runtime.h>
#include <gmock/gmock.h>
#include <pack/sample_pack.h>
#include <runtime/gpu_fixture.h>
#include <runtime/model_pack.h>
#include <scene/level_file.h>
#include <write/pack_writer.h>

#include <cmath>
#include <numbers>

namespace dimmer::test {
namespace {

// The sample pack as a file, its first set renamed where a test wants that.
struct PackOnDisk {
    explicit PackOnDisk(const std::string& first_set = "set0") {
        PackData data = samplePack();
        data.elements[0].name = first_set;
        path = (folder.path / "level.dimmer").string();
        EXPECT_TRUE(cook::writeFileAtomically(path, cook::packBytes(data)));
    }
    cook::test::TemporaryFolder folder;
    std::string path;
};

struct BlendedPages {
    std::vector<uint32_t> irradiance = std::vector<uint32_t>(2048), direction = irradiance;
};

// The same state by the C++ interface.
BlendedPages expectedPages() {
    CpuRuntime runtime(*Pack::fromData(samplePack()));
    EXPECT_TRUE(runtime.apply("set0=0.5,set1=2/0.25/0,door:door0=0.5"));
    runtime.update();
    return {{runtime.irradiancePages().begin(), runtime.irradiancePages().end()},
            {runtime.directionPages().begin(), runtime.directionPages().end()}};
}

TEST(CInterface, LooksIntoAPack) {
    EXPECT_EQ(look_into_pack(PackOnDisk().path.c_str()), 0) << problem;
}

TEST(CInterface, MisuseIsRefusedWithAMessage) {
    EXPECT_EQ(misuse(PackOnDisk().path.c_str()), 0) << problem;
}

TEST(CInterface, BlendsOnTheCpu) {
    BlendedPages pages;
    ASSERT_EQ(blend_on_cpu(PackOnDisk().path.c_str(), pages.irradiance.data(), pages.direction.data(), 2048), 0)
        << problem;
    const BlendedPages expected = expectedPages();
    EXPECT_EQ(pages.irradiance, expected.irradiance);
    EXPECT_EQ(pages.direction, expected.direction);
}

// Light that grows with x: L = (1 + x) from everywhere is pi (1 + x) lux.
TEST(CInterface, LightsAModelThatMoves) {
    const cook::test::TemporaryFolder folder;
    const auto path = folder.path / "grid.dimmer";
    const PackData data = modelPack(1, 800, [](glm::vec3 p) {
        return glm::vec3(std::sqrt(4 * std::numbers::pi_v<float>) * (1 + std::clamp(p.x, 0.0f, 12.0f)) / 64);
    });
    ASSERT_TRUE(cook::writeFileAtomically(path, cook::packBytes(data)));
    std::array<float, 3> before{}, after{}, air{};
    ASSERT_EQ(light_a_model(path.c_str(), before.data(), after.data(), air.data()), 0) << problem;
    // Two roundings to 9 bits of numbers up to 13, at a tenth of the light at least: half a per cent.
    EXPECT_NEAR(before[0], 5 * std::numbers::pi_v<float>, 0.005f * before[0]);
    EXPECT_NEAR(after[1], 9 * std::numbers::pi_v<float>, 0.005f * after[1]);
    EXPECT_NEAR(air[2], 9 * std::numbers::pi_v<float>, 0.005f * air[2]);
}

TEST(CInterface, TheExampleOfTheDocumentation) {
    const PackOnDisk file("hall");
    std::array<float, 3> lux{};
    ASSERT_EQ(shade_player(file.path.c_str(), lux.data()), 0);
    const auto pack = Pack::open(file.path);
    CpuRuntime runtime(*pack);
    ASSERT_TRUE(runtime.apply("hall=1/0.2/0.2"));
    runtime.update();
    EXPECT_EQ(lux,
              sampleLightmap(*pack, runtime.irradiancePages(), runtime.directionPages(), 0, {0.25f, 0.5f}, {0, 0, 1}));
}

using CInterfaceGpu = GpuTest;

uint32_t functions_asked_for = 0;
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL countingLoader(VkInstance instance, const char* name) {
    ++functions_asked_for;
    return vkGetInstanceProcAddr(instance, name);
}

// Submissions under way, and all that were.
struct QueueUses {
    int now = 0, all = 0;
} queue_uses;

dimmer_vulkan vulkanOf(const VulkanContext& context) {
    return {.instance = context.instance,
            .physical_device = context.physical_device,
            .device = context.device,
            .queue = context.queue,
            .queue_family = context.queue_family,
            .compute_queue = VK_NULL_HANDLE,
            .compute_queue_family = 0,
            .get_instance_proc_addr = countingLoader,
            .pipeline_cache = VK_NULL_HANDLE,
            .lock_queue =
                [](void* user, VkQueue) {
                    auto& uses = *static_cast<QueueUses*>(user);
                    ++uses.now, ++uses.all;
                },
            .unlock_queue = [](void* user, VkQueue) { --static_cast<QueueUses*>(user)->now; },
            .lock_user = &queue_uses};
}

TEST_F(CInterfaceGpu, BlendsByVulkan) {
    const dimmer_vulkan vulkan = vulkanOf(device().context());
    BlendedPages pages;
    ASSERT_EQ(
        blend_on_vulkan(PackOnDisk().path.c_str(), &vulkan, pages.irradiance.data(), pages.direction.data(), 2048), 0)
        << problem;
    EXPECT_GT(functions_asked_for, 0u);
    EXPECT_GT(queue_uses.all, 0);
    EXPECT_EQ(queue_uses.now, 0);
    const BlendedPages expected = expectedPages();
    EXPECT_EQ(pages.irradiance, expected.irradiance);
    EXPECT_EQ(pages.direction, expected.direction);
}

TEST_F(CInterfaceGpu, RecordsComeAndGo) {
    const dimmer_vulkan vulkan = vulkanOf(device().context());
    BlendedPages pages;
    ASSERT_EQ(
        records_come_and_go(PackOnDisk().path.c_str(), &vulkan, pages.irradiance.data(), pages.direction.data(), 2048),
        0)
        << problem;
    CpuRuntime expected(*Pack::fromData(samplePack()));
    EXPECT_TRUE(expected.apply("all=0,set0=0.5"));
    expected.update();
    EXPECT_TRUE(std::ranges::equal(pages.irradiance, expected.irradiancePages()));
    EXPECT_TRUE(std::ranges::equal(pages.direction, expected.directionPages()));
}

TEST_F(CInterfaceGpu, NamesTheBuffersOfProbes) {
    const cook::test::TemporaryFolder folder;
    PackData data = modelPack(1, 20, [](glm::vec3) { return glm::vec3(1); });
    addLightOnProbes(data, 0, encodeE5B9G9R9(1, 1, 1), [](glm::vec3) { return true; });
    const auto path = folder.path / "grid.dimmer";
    ASSERT_TRUE(cook::writeFileAtomically(path, cook::packBytes(data)));
    const dimmer_vulkan vulkan = vulkanOf(device().context());
    EXPECT_EQ(probe_buffers_take_turns(path.c_str(), &vulkan), 0) << problem;
}

}  // namespace
}  // namespace dimmer::test
