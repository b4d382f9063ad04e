// The C++ of README.md and docs/integrate.md: it compiles, it runs, and the documents quote it as it stands here.
// (Their C stands in tests/c/c_api.c.)
#include <app/tool_fixture.h>
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <pack/sample_pack.h>
#include <runtime/gpu_fixture.h>
#include <tools/headless_device.h>
#include <write/pack_writer.h>

#include <map>

namespace dimmer::test {
namespace {

// snippet: load
dimmer::Expected<dimmer::Runtime> loadLights(const dimmer::VulkanContext& vulkan, const std::filesystem::path& file) {
    const auto pack = dimmer::Pack::open(file);  // reads, checks hashes, validates
    if (!pack) return std::unexpected(pack.error());
    return dimmer::Runtime::create(vulkan, *pack);  // keeps the pack alive
}
// end snippet

dimmer::Expected<void> limitUpdates(dimmer::Runtime& lights) {
    // snippet: limits
    // At most 200,000 texels per update, the most visible first; and leave what is less than half a step of the format.
    if (auto ok = lights.setLimits({.receivers_max = 200000, .tolerance_quanta = 0.5f}); !ok) return ok;
    // end snippet
    return {};
}

dimmer::Expected<void> moveOn(dimmer::Runtime& lights, dimmer::LightSet cellar, dimmer::LightSet attic) {
    // snippet: records
    if (auto ok = lights.dropRecords(cellar); !ok) return ok;  // off from now on; its memory is free
    if (auto ok = lights.loadRecords(attic); !ok) return ok;   // OutOfMemory: there is no room
    const auto progress = lights.continueLoading();            // once a frame: sends a piece, never waits
    if (!progress) return std::unexpected(progress.error());
    if (progress->finished()) return lights.setWeight(attic, 1);
    // end snippet
    return {};
}

void draw(const ModelSlot&, VkBuffer, VkBuffer) {}

dimmer::Expected<void> addCrate(dimmer::Runtime& lights, const std::array<float, 3>& crate_min_m,
                                const std::array<float, 3>& crate_max_m, const dimmer::Transform& transform,
                                const dimmer::Transform& moved) {
    // snippet: models
    const dimmer::ModelGrid grid = dimmer::modelGrid(crate_min_m, crate_max_m);  // 2 probes an axis, or every 1.5 m
    const auto crate = lights.addModel(grid, transform);                         // OutOfMemory: no room is left
    if (!crate) return std::unexpected(crate.error());
    if (auto ok = lights.moveModel(*crate, moved); !ok) return ok;  // any frame, before its update
    const auto slot = lights.modelSlot(*crate);                     // for the shader; changes with the transform
    if (!slot) return std::unexpected(slot.error());
    draw(*slot, lights.probes(lights.probeSet()), lights.gridTable());
    // end snippet
    return {};
}

size_t uploaded = 0;
void upload(const std::string&, const std::vector<MeshVertex>& vertices, const std::vector<uint32_t>&, uint32_t) {
    uploaded += vertices.size();
}

void uploadMeshes(const Pack& pack) {
    // snippet: meshes
    for (const dimmer::Mesh& mesh : pack.meshes()) {
        if (mesh.door) continue;  // part of a door's leaf: drawn by whoever moves it
        upload(mesh.node, mesh.vertices, mesh.indices, mesh.page);
    }
    // end snippet
}

Expected<void> change(LightState& lights) {
    // snippet: change
    const auto hall = lights.lightSet("hall");
    if (!hall) return std::unexpected(hall.error());  // NotFound, with the nearest name
    if (auto ok = lights.setWeight(*hall, 0.5f); !ok) return ok;
    if (auto ok = lights.setWeight(*hall, {1, 0.2f, 0.2f}); !ok) return ok;  // a weight per channel recolours
    return lights.apply("all=0,hall=0.5");                                   // text, for scripts and tools
    // end snippet
}

Expected<UpdateStats> record(Runtime& lights, VkCommandBuffer commands) {
    // snippet: record
    const auto stats = lights.record(commands);  // outside a render pass, before whatever samples the pages
    if (!stats) return std::unexpected(stats.error());
    // end snippet
    return *stats;
}

Expected<std::pair<VkSemaphore, uint64_t>> submit(Runtime& lights) {
    // snippet: submit
    if (const auto sent = lights.submit(); !sent) return std::unexpected(sent.error());
    const VkSemaphore done = lights.semaphore();     // a timeline semaphore:
    const uint64_t value = lights.semaphoreValue();  // let the frame's submission wait for this value
    // end snippet
    return std::pair(done, value);
}

// snippet: frame
// Once: auto pack = dimmer::Pack::open("house.dimmer").value();    // throws where there is no such pack;
//       auto lights = dimmer::Runtime::create(vulkan, pack).value();  // docs/integrate.md looks at each error
//       auto hall = lights.lightSet("hall").value();
dimmer::Expected<void> updateLights(dimmer::Runtime& lights, dimmer::LightSet hall, VkCommandBuffer commands) {
    if (auto ok = lights.setWeight(hall, {1, 0.2f, 0.2f}); !ok) return ok;
    const auto stats = lights.record(commands);
    if (!stats) return std::unexpected(stats.error());
    return {};  // stats->batches, stats->bytes_written ... : what it costs
}
// end snippet

Expected<std::array<float, 3>> onTheCpu(const Pack& pack, uint32_t page, std::array<float, 2> uv) {
    // snippet: cpu
    dimmer::CpuRuntime lights(pack);
    if (auto ok = lights.apply("all=0,hall=1"); !ok) return std::unexpected(ok.error());
    lights.update();
    const auto lux =
        dimmer::sampleLightmap(pack, lights.irradiancePages(), lights.directionPages(), page, uv, {0, 0, 1});
    // end snippet
    return lux;
}

PackData hallPack() {
    PackData data = samplePack();
    data.elements[0].name = "hall";
    return data;
}

// A command buffer, recorded by `fill`, submitted and waited for.
template <class Fill>
void runCommands(const VulkanContext& vulkan, Fill&& fill) {
    VkCommandPoolCreateInfo pool_info{};
    pool_info.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool_info.queueFamilyIndex = vulkan.queue_family;
    VkCommandPool pool = VK_NULL_HANDLE;
    ASSERT_EQ(vkCreateCommandPool(vulkan.device, &pool_info, nullptr, &pool), VK_SUCCESS);
    VkCommandBufferAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    allocate.commandPool = pool;
    allocate.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    ASSERT_EQ(vkAllocateCommandBuffers(vulkan.device, &allocate, &commands), VK_SUCCESS);
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    ASSERT_EQ(vkBeginCommandBuffer(commands, &begin), VK_SUCCESS);
    fill(commands);
    ASSERT_EQ(vkEndCommandBuffer(commands), VK_SUCCESS);
    VkSubmitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    info.commandBufferCount = 1;
    info.pCommandBuffers = &commands;
    ASSERT_EQ(vkQueueSubmit(vulkan.queue, 1, &info, VK_NULL_HANDLE), VK_SUCCESS);
    ASSERT_EQ(vkQueueWaitIdle(vulkan.queue), VK_SUCCESS);
    vkDestroyCommandPool(vulkan.device, pool, nullptr);
}

using SnippetsGpu = GpuTest;

TEST_F(SnippetsGpu, LoadChangeAndUpdate) {
    const cook::test::TemporaryFolder folder;
    const auto file = folder.path / "house.dimmer";
    ASSERT_TRUE(cook::writeFileAtomically(file, cook::packBytes(hallPack())));
    auto lights = loadLights(device().context(), file);
    ASSERT_TRUE(lights.has_value()) << lights.error().message;
    ASSERT_TRUE(change(*lights).has_value());
    EXPECT_EQ(lights->weight(*lights->lightSet("hall")), Weight(0.5f));
    runCommands(device().context(), [&](VkCommandBuffer commands) {
        const auto stats = record(*lights, commands);
        ASSERT_TRUE(stats.has_value()) << stats.error().message;
        EXPECT_GT(stats->dispatches, 0u);
    });
    // The README's frame, twice: the second time nothing has changed, and the figures of the first stand.
    double gpu_us = 0;
    for (const bool first : {true, false}) {
        runCommands(device().context(), [&](VkCommandBuffer commands) {
            EXPECT_TRUE(updateLights(*lights, *lights->lightSet("hall"), commands).has_value());
        });
        const auto stats = lights->wait();
        ASSERT_TRUE(stats.has_value());
        EXPECT_GT(stats->dispatches, 0u);
        EXPECT_GT(stats->gpu_us, 0);
        if (!first) {
            EXPECT_EQ(stats->gpu_us, gpu_us);
        }
        gpu_us = stats->gpu_us;
    }
    ASSERT_TRUE(limitUpdates(*lights).has_value());
    ASSERT_TRUE(lights->apply("all=1"));
    const auto sent = submit(*lights);
    ASSERT_TRUE(sent.has_value());
    EXPECT_NE(sent->first, VkSemaphore{VK_NULL_HANDLE});
    EXPECT_EQ(sent->second, 1u);
    ASSERT_TRUE(lights->wait().has_value());
    const auto hall = *lights->lightSet("hall");
    ASSERT_TRUE(moveOn(*lights, hall, hall).has_value());
    // No grid in this pack: the first call says so.
    EXPECT_EQ(addCrate(*lights, {0, 0, 0}, {1, 1, 1}, {}, {}).error().code, ErrorCode::Unsupported);
}

TEST(Snippets, CpuAndMeshes) {
    const auto pack = Pack::fromData(hallPack());
    ASSERT_TRUE(pack.has_value());
    uploadMeshes(*pack);
    EXPECT_EQ(uploaded, 4u);  // the floor; the other mesh is a door's leaf
    CpuRuntime lights(*pack);
    EXPECT_TRUE(change(lights).has_value());
    const auto lux = onTheCpu(*pack, 0, {0.5f, 0.5f});
    ASSERT_TRUE(lux.has_value());
    EXPECT_GE((*lux)[0], 0);
}

std::vector<std::string> linesOf(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

// Name -> code, its common indentation taken away.
std::map<std::string, std::string> snippetsOf(const std::string& source) {
    std::map<std::string, std::string> snippets;
    std::string name;
    size_t indent = 0;
    for (const std::string& line : linesOf(source)) {
        const size_t mark = line.find("// snippet: ");
        if (mark != std::string::npos && line.find_first_not_of(' ') == mark) {
            name = line.substr(mark + 12);
            indent = mark;
        } else if (line.find_first_not_of(' ') != std::string::npos &&
                   line.substr(line.find_first_not_of(' ')) == "// end snippet") {
            name.clear();
        } else if (!name.empty()) {
            snippets[name] += (line.size() >= indent ? line.substr(indent) : "") + "\n";
        }
    }
    return snippets;
}

// The blocks of C++ and C in a document, by the name in the comment before each.
std::map<std::string, std::string> quotesOf(const std::string& document) {
    std::map<std::string, std::string> quotes;
    std::string name;
    bool inside = false;
    for (const std::string& line : linesOf(document)) {
        if (line.starts_with("<!-- snippet: ")) name = line.substr(14, line.size() - 14 - 4);
        if (line.starts_with("```")) {
            const bool code = line == "```cpp" || line == "```c";
            EXPECT_TRUE(!code || !name.empty()) << "a block that nobody compiles";
            inside = code;
            if (!inside) name.clear();
        } else if (inside) {
            quotes[name] += line + "\n";
        }
    }
    return quotes;
}

TEST(Snippets, DocumentsQuoteThem) {
    const std::filesystem::path root = DIMMER_SOURCE_DIR;
    auto snippets = snippetsOf(readText(root / "tests/app/snippets_test.cpp"));
    snippets.merge(snippetsOf(readText(root / "tests/c/c_api.c")));
    ASSERT_EQ(snippets.size(), 11u);
    for (const char* document : {"README.md", "docs/integrate.md"}) {
        const auto quotes = quotesOf(readText(root / document));
        EXPECT_FALSE(quotes.empty()) << document;
        for (const auto& [name, code] : quotes) {
            EXPECT_EQ(code, snippets[name]) << document << ": " << name;
            snippets.erase(name);
        }
    }
    EXPECT_TRUE(snippets.empty()) << snippets.begin()->first << " is quoted nowhere";
}

}  // namespace
}  // namespace dimmer::test
