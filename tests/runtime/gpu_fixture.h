// A Vulkan device with validation for tests. Any message of the layers fails the test during which it came.
#pragma once

#include <gtest/gtest.h>
#include <tools/headless_device.h>

#include <optional>

namespace dimmer::test {

// Of a record() that must find nothing to do: whoever used them would crash.
inline VkCommandBuffer untouchedCommands() {
    return reinterpret_cast<VkCommandBuffer>(uintptr_t{1});
}

class GpuTest : public testing::Test {
   protected:
    static void SetUpTestSuite() { createDevice(nullptr); }
    static void createDevice(PFN_vkGetInstanceProcAddr loader) {
        if (auto made = HeadlessDevice::create({.validation = true, .get_instance_proc_addr = loader}))
            device_ = std::move(*made);
        else
            problem_ = made.error().message;
    }
    static void TearDownTestSuite() { device_.reset(); }

    void SetUp() override {
        if (device_) {
            messages_before_ = device_->validationMessages().size();
            return;
        }
        // No device at all is this machine's business; a device without the validation layer is not enough.
        if (!HeadlessDevice::create()) GTEST_SKIP() << "no Vulkan device: " << problem_;
        FAIL() << problem_;
    }

    void TearDown() override {
        if (!device_) return;
        const auto messages = device_->validationMessages();
        for (size_t i = messages_before_; i < messages.size(); ++i) ADD_FAILURE() << messages[i];
    }

    static const HeadlessDevice& device() { return *device_; }
    static Runtime runtimeOf(const Pack& pack, const RuntimeOptions& options = {}) {
        auto runtime = Runtime::create(device().context(), pack, options);
        if (!runtime) throw std::runtime_error(runtime.error().message);
        return std::move(*runtime);
    }

   private:
    static inline std::optional<HeadlessDevice> device_;
    static inline std::string problem_;
    size_t messages_before_ = 0;
};

}  // namespace dimmer::test
