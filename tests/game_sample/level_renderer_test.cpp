// Radiance of a wall that fills the view, against its closed form: reflectance * irradiance / pi + emission * weight.
#include <format/texel.h>
#include <game_sample/balls.h>
#include <game_sample/level_renderer.h>
#include <game_sample/model_renderer.h>
#include <game_sample/player.h>
#include <gtest/gtest.h>
#include <probes/tetrahedra.h>
#include <tools/headless_device.h>

#include <fstream>
#include <glm/gtc/packing.hpp>
#include <numbers>
#include <stdexcept>

namespace dimmer::sample {
namespace {

// Draws: a machine without any device has nothing to draw with.
class DrawingTest : public testing::Test {
   protected:
    void SetUp() override {
        const auto any = HeadlessDevice::create({.graphics = true});
        if (!any) GTEST_SKIP() << "no Vulkan device: " << any.error().message;
    }
};
using SampleLevelRenderer = DrawingTest;
using SamplePlayer = DrawingTest;

// What is there, or the end of the test.
template <class T>
T need(Expected<T> made) {
    if (!made) throw std::runtime_error(made.error().message);
    return std::move(*made);
}

constexpr float irradiance_lux = 48, exposure = 0.25f;  // 12 as stored: exact in 11 and 10 bits

// A wall at z = -2 that faces +Z (or, mirrored, away), lit with 48 lux by "lamp" alone.
PackData wall(bool faces_viewer) {
    PackData data;
    data.exposure = exposure;
    data.page_width = data.page_height = 8;
    data.page_count = 1;
    data.base_pages.resize(64, {0, encodeDirection(0, 0, 0, 0)});
    data.elements = {{"lamp", ElementKind::LightSet, 1}};
    Contribution lamp;
    lamp.light_set = 0;
    lamp.receivers = 64;
    data.contributions = {lamp};
    data.clusters = {{0, 64, 0, 1, 0, 1}};
    data.terms = {{0, 0}};
    data.batches = {{0, 64}};
    constexpr float stored = irradiance_lux * exposure;
    for (uint32_t i = 0; i < 64; ++i) {
        data.addresses.push_back(TexelAddress::pack(0, i % 8, i / 8));
        data.payload.push_back({encodeR11G11B10(stored, stored, stored), encodeDirection(1, 1, 0, 0)});
    }
    Mesh mesh;
    mesh.node = "wall";
    mesh.reflectance = {0.5f, 0.25f, 0.75f};
    mesh.emission_cd_m2 = {0, 8, 0};
    mesh.emission_set = 0;
    const float z = faces_viewer ? 1.0f : -1.0f;
    mesh.vertices = {{{-9, -9, -2}, {0, 0, z}, {0, 0}},
                     {{9, -9, -2}, {0, 0, z}, {1, 0}},
                     {{9, 9, -2}, {0, 0, z}, {1, 1}},
                     {{-9, 9, -2}, {0, 0, z}, {0, 1}}};
    if (faces_viewer)
        mesh.indices = {0, 1, 2, 0, 2, 3};
    else
        mesh.indices = {0, 2, 1, 0, 3, 2};
    data.meshes = {mesh};
    return data;
}

// One frame seen from the origin along -Z, with `weight` on the lamp, once the script's balls have reached
// `frame_number`.
glm::vec3 middlePixel(const PackData& data, Weight weight, const Script& script = {}, uint32_t frame_number = 0,
                      bool self_visibility = true) {
    const Pack pack = need(Pack::fromData(data));
    const HeadlessDevice device = need(HeadlessDevice::create({.validation = true, .graphics = true}));
    const VulkanContext vulkan = device.context();
    glm::vec3 middle{-1};
    {
        Runtime lights =
            need(Runtime::create(vulkan, pack, {.moving_probes_max = movingProbes(script) + movingProbes(pack)}));
        EXPECT_TRUE(lights.setWeight(need(lights.lightSet("lamp")), weight));
        LevelRenderer renderer = need(LevelRenderer::create(vulkan, pack, lights.images(), {16, 8}));
        ModelRenderer models =
            need(ModelRenderer::create(vulkan, lights, renderer.renderPass(), {16, 8}, self_visibility));
        EXPECT_TRUE(models.move(0, lights));
        Balls balls = need(Balls::create(script, lights));
        EXPECT_TRUE(balls.move(frame_number, lights));
        std::optional<SphereRenderer> spheres;
        if (!script.balls.empty())
            spheres.emplace(need(SphereRenderer::create(vulkan, lights, renderer.renderPass(), {16, 8}, 8)));

        VkCommandPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr, 0, vulkan.queue_family};
        VkCommandPool pool = VK_NULL_HANDLE;
        vkCreateCommandPool(vulkan.device, &pool_info, nullptr, &pool);
        VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr, pool,
                                             VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
        VkCommandBuffer commands = VK_NULL_HANDLE;
        vkAllocateCommandBuffers(vulkan.device, &allocate, &commands);
        VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr, 0, nullptr};
        vkBeginCommandBuffer(commands, &begin);
        EXPECT_TRUE(lights.record(commands));
        renderer.record(commands, {{0, 0, 0}, {0, 0, -1}, 1.0f}, {3, 2, 1}, lights,
                        [&](VkCommandBuffer pass, const glm::mat4& clip_from_world) {
                            EXPECT_TRUE(models.draw(pass, clip_from_world, lights));
                            if (spheres) spheres->draw(pass, clip_from_world, need(balls.spheres(lights)));
                        });
        vkEndCommandBuffer(commands);
        VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO, nullptr, 0, nullptr, nullptr, 1, &commands, 0, nullptr};
        vkQueueSubmit(vulkan.queue, 1, &submit, VK_NULL_HANDLE);
        vkQueueWaitIdle(vulkan.queue);

        const RadianceFrame frame = renderer.read();
        const uint16_t* pixel = &frame.rgba[(4 * 16 + 8) * 4];
        middle = {glm::unpackHalf1x16(pixel[0]), glm::unpackHalf1x16(pixel[1]), glm::unpackHalf1x16(pixel[2])};
        vkDestroyCommandPool(vulkan.device, pool, nullptr);
    }
    for (const std::string& message : device.validationMessages()) ADD_FAILURE() << message;
    return middle;
}

// Half floats hold 11 bits: a relative error of 2^-11.
void expectRadiance(const glm::vec3& pixel, const glm::vec3& expected) {
    for (int channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(pixel[channel], expected[channel], expected[channel] * 0x1p-10f) << channel;
}

TEST_F(SampleLevelRenderer, RadianceIsReflectedAndEmittedLight) {
    constexpr float e_pi = irradiance_lux / std::numbers::pi_v<float>;
    expectRadiance(middlePixel(wall(true), 1), {0.5f * e_pi, 0.25f * e_pi + 8, 0.75f * e_pi});
}

// Light of 40 lux from all sides (radiance 40 / pi, L_00 = sqrt(4 pi) times that): a ball of 0.75 in it has 0.75 * 40 /
// pi all over; once it has flown away the wall shows.
TEST_F(SampleLevelRenderer, ABallIsLitByTheLightGridWhereItIs) {
    constexpr float ball_lux = 40, pi = std::numbers::pi_v<float>;
    PackData data = wall(true);
    std::vector<glm::vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -2}};
    data.probes.global = cook::tetrahedralise(points, {glm::vec3(-5), glm::vec3(5)}).value();
    const float stored = std::sqrt(4 * pi) * ball_lux / pi * exposure;
    data.probes.base.assign(data.probes.global.positions.size(), {encodeR11G11B10(stored, stored, stored), {}});
    data.probes.record_counts = {0};
    Script script;
    script.balls = {{0.4f, {0, 0, -1}, {8, 0, -1}, 10}};
    const float lit = 0.75f * ball_lux / pi;
    // Two roundings to the 5 bits of blue and 6 of the others: 1/64 each at worst.
    const glm::vec3 ball = middlePixel(data, 1, script, 0);
    for (int channel = 0; channel < 3; ++channel) EXPECT_NEAR(ball[channel], lit, lit / 32);
    constexpr float e_pi = irradiance_lux / pi;
    expectRadiance(middlePixel(data, 1, script, 10), {0.5f * e_pi, 0.25f * e_pi + 8, 0.75f * e_pi});
    EXPECT_EQ(placeOf(script.balls[0], 20), script.balls[0].from_m);
    EXPECT_EQ(placeOf(script.balls[0], 30), script.balls[0].to_m);
}

// A node at (1, 2, 3), turned a quarter around Y: its X axis points to -Z. Models that stand or have a mesh are not for
// balls, and without a grid there is no light for them.
TEST(SampleBalls, OneFliesAtEachOfTheLevelsPlaces) {
    PackData data = wall(true);
    PlacedModel guest;
    guest.node = "guest";
    guest.world_from_model = {{{{0, 0, 1, 1}, {0, 1, 0, 2}, {-1, 0, 0, 3}}}};
    data.models.push_back(guest);
    EXPECT_TRUE(ballsAtPlaces(*Pack::fromData(data)).empty());
    const std::vector<glm::vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -2}};
    data.probes.global = cook::tetrahedralise(points, {glm::vec3(-5), glm::vec3(5)}).value();
    data.probes.base.assign(data.probes.global.positions.size(), {});
    data.probes.record_counts = {0};
    const auto balls = ballsAtPlaces(*Pack::fromData(data));
    ASSERT_EQ(balls.size(), 1u);
    EXPECT_EQ(balls[0].from_m, glm::vec3(1, 2, 3));
    EXPECT_EQ(glm::normalize(balls[0].to_m - balls[0].from_m), glm::vec3(0, 0, -1));
}

// A plate 1 m in front of the viewer in 40 lux from all sides, of which its vertices see half. It stands, or it moves
// and takes the same light from the global grid; drawn by one path.
TEST_F(SampleLevelRenderer, AModelIsLitByItsGridAndShadowsItself) {
    constexpr float plate_lux = 40, pi = std::numbers::pi_v<float>;
    const float stored = std::sqrt(4 * pi) * plate_lux / pi * exposure;
    for (const bool moves : {false, true}) {
        PackData data = wall(true);
        ModelMesh mesh;
        mesh.name = "plate";
        mesh.min_m = {-0.5f, -0.5f, 0};
        mesh.max_m = {0.5f, 0.5f, 0};
        mesh.reflectance = {0.5f, 0.25f, 0.75f};
        mesh.emission_cd_m2 = {0, 0, 8};
        mesh.emission_set = 0;
        for (const auto& [x, y] : {std::pair<uint16_t, uint16_t>{0, 0}, {65535, 0}, {65535, 65535}, {0, 65535}}) {
            ModelVertex vertex;
            vertex.position = {x, y, 0};  // its octahedral normal, 0 and 0, is +Z
            vertex.transfer[0] = 64;      // half of 127, to 1 %
            mesh.vertices.push_back(vertex);
        }
        mesh.indices = {0, 1, 2, 0, 2, 3};
        data.model_meshes = {mesh};
        data.models.resize(1);
        data.models[0].mesh_count = 1;
        data.models[0].world_from_model.rows[2][3] = -1;
        data.models[0].min_m = {-0.5f, -0.5f, -0.1f};
        data.models[0].max_m = {0.5f, 0.5f, 0.1f};
        if (moves) {
            std::vector<glm::vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -2}};
            data.probes.global = cook::tetrahedralise(points, {glm::vec3(-5), glm::vec3(5)}).value();
        } else {
            data.models[0].local_grid = 0;
            data.probes.local = {
                {"plate", 0, {2, 2, 2}, {-0.5f, -0.5f, -1.1f}, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 0.2f}}}}};
        }
        data.probes.base.assign(moves ? data.probes.global.positions.size() : 8,
                                {encodeR11G11B10(stored, stored, stored), {}});
        data.probes.record_counts = {0};
        const float whole = plate_lux / pi;
        const glm::vec3 shadowed = middlePixel(data, 0.5f), plain = middlePixel(data, 0.5f, {}, 0, false);
        const glm::vec3 reflectance(0.5f, 0.25f, 0.75f), emission(0, 0, 4);
        for (int c = 0; c < 3; ++c) {
            // Roundings of the probes to 5 or 6 bits, as above, and of the transfer.
            EXPECT_NEAR(shadowed[c], reflectance[c] * 0.5f * whole + emission[c], whole / 32) << moves;
            EXPECT_NEAR(plain[c], reflectance[c] * whole + emission[c], whole / 32) << moves;
        }
    }
}

TEST_F(SampleLevelRenderer, EmissionFollowsItsSet) {
    constexpr float e_pi = irradiance_lux / std::numbers::pi_v<float>;
    expectRadiance(middlePixel(wall(true), Weight(1, 0.5f, 0)), {0.5f * e_pi, 0.5f * (0.25f * e_pi + 8), 0});
}

TEST_F(SampleLevelRenderer, BackFacesShowWhatIsBehind) {
    expectRadiance(middlePixel(wall(false), 1), {3, 2, 1});
}

TEST_F(SamplePlayer, WritesPicturesAndCosts) {
    const auto pack = Pack::fromData(wall(true));
    ASSERT_TRUE(pack);
    const auto script = parseScript("size 16 8\nframes 4\ncamera 0 0 0 look 0 0 -1\nat 2 set lamp=0.5", "test", *pack);
    ASSERT_TRUE(script) << script.error().message;
    const auto out = std::filesystem::path(testing::TempDir()) / "dimmer_sample_player";
    std::filesystem::remove_all(out);
    const auto played =
        playHeadless(*pack, *script, {.pack = "wall.dimmer", .script = {}, .out = out, .validate = true});
    ASSERT_TRUE(played) << played.error().message;
    EXPECT_TRUE(played->validation_messages.empty()) << played->validation_messages.front();

    for (const char* name : {"frame_0000.png", "frame_0003.png", "cost.json"})
        EXPECT_GT(std::filesystem::file_size(out / name), 0u) << name;
    const auto events = played->cost.events();
    ASSERT_FALSE(events.empty());
    EXPECT_EQ(events.back().first_frame, 2u);
    EXPECT_EQ(events.back().what, "set lamp=0.5");
    EXPECT_EQ(events.back().median.receivers, 64u);
    EXPECT_EQ(events.back().median.batches, 1u);
    EXPECT_EQ(played->cost.unchangedFrames().median.dispatches, 0u);
    EXPECT_GE(played->cost.unchangedFrames().frames, 2u);
    std::filesystem::remove_all(out);
}

}  // namespace
}  // namespace dimmer::sample
