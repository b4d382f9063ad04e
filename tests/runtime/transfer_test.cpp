// Reading pages while the driver refuses now and then: an error, and the next read is right.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <gpu/vulkan_functions.h>

#include "gpu_fixture.h"
#include "pages.h"

namespace dimmer {
namespace {

using test::packOf;

// Calls of one function, of which those from `first_refused` on fail, so many of them.
template <class Function>
class Refusing {
   public:
    Refusing(Function& function, Function stand_in, int first_refused, int count)
        : function_(function), real_(std::exchange(function, stand_in)) {
        calls = 0;
        first = first_refused;
        end = first_refused + count;
        real = real_;
    }
    ~Refusing() { function_ = real_; }
    Refusing(const Refusing&) = delete;
    Refusing& operator=(const Refusing&) = delete;

    static inline Function real = nullptr;
    static inline int calls = 0, first = 0, end = 0;
    static bool refuses() { return calls++ >= first && calls <= end; }

   private:
    Function& function_;
    Function real_;
};
using RefusingResets = Refusing<PFN_vkResetFences>;
using RefusingWaits = Refusing<PFN_vkWaitForFences>;

VKAPI_ATTR VkResult VKAPI_CALL resetOrRefuse(VkDevice device, uint32_t count, const VkFence* fences) {
    return RefusingResets::refuses() ? VK_ERROR_OUT_OF_DEVICE_MEMORY : RefusingResets::real(device, count, fences);
}
VKAPI_ATTR VkResult VKAPI_CALL waitOrRefuse(VkDevice device, uint32_t count, const VkFence* fences, VkBool32 all,
                                            uint64_t timeout_ns) {
    return RefusingWaits::refuses() ? VK_ERROR_OUT_OF_HOST_MEMORY
                                    : RefusingWaits::real(device, count, fences, all, timeout_ns);
}

class TransferGpu : public test::GpuTest {
   protected:
    // A read while something is refused, and one when nothing is any more.
    static void readTwice(auto&& refusing) {
        const Pack pack = packOf(test::randomPack(91));
        Runtime gpu = runtimeOf(pack);
        ASSERT_TRUE(gpu.submit());
        CpuRuntime cpu(pack);
        cpu.update();
        const auto expectRight = [&](const Runtime::Pages& pages) {
            EXPECT_TRUE(std::ranges::equal(pages.irradiance, cpu.irradiancePages()));
            EXPECT_TRUE(std::ranges::equal(pages.direction, cpu.directionPages()));
        };
        for (int first = 0; first < 5; ++first)
            for (const int count : {1, 2}) {
                {
                    const auto while_it_lasts = refusing(first, count);
                    if (const auto pages = gpu.readPages()) expectRight(*pages);
                }
                const auto pages = gpu.readPages();
                ASSERT_TRUE(pages) << pages.error().message;
                expectRight(*pages);
                ASSERT_TRUE(gpu.apply("all=0.5") && cpu.apply("all=0.5"));
                ASSERT_TRUE(gpu.submit());
                cpu.update();
            }
    }
};

TEST_F(TransferGpu, RefusedResetsLeaveNothingUnderWay) {
    readTwice([](int first, int count) { return RefusingResets(vkResetFences, resetOrRefuse, first, count); });
}

TEST_F(TransferGpu, RefusedWaitsLeaveNothingUnderWay) {
    readTwice([](int first, int count) { return RefusingWaits(vkWaitForFences, waitOrRefuse, first, count); });
}

}  // namespace
}  // namespace dimmer
