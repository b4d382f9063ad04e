// A Vulkan device without a window, for tools, tests and the sample. A game brings its own.
#pragma once

#include <dimmer/runtime.h>

#include <memory>
#include <string>
#include <vector>

namespace dimmer {

struct HeadlessOptions {
    // Load the Khronos validation layer with synchronisation validation; its messages are collected, not printed.
    // Refused as Unsupported where the layer is not installed.
    bool validation = false;
    // The queue must draw as well as compute.
    bool graphics = false;
    // Also ask for VulkanContext::compute_queue, where the device has a second queue to give. Whoever samples pages on
    // the first queue then has to wait for the runtime's semaphore.
    bool compute_queue = false;
    // What gives Vulkan's functions, as in VulkanContext. Null: the installed loader.
    PFN_vkGetInstanceProcAddr get_instance_proc_addr = nullptr;
};

// An instance, a device, and one queue; a discrete GPU is preferred, then an integrated, a virtual and a software one.
// Must outlive everything created from its context. Thread-safe where Vulkan is.
class HeadlessDevice {
   public:
    // Unsupported when there is no Vulkan 1.2 device with timeline semaphores and such a queue.
    static Expected<HeadlessDevice> create(const HeadlessOptions& options = {});
    ~HeadlessDevice();
    HeadlessDevice(HeadlessDevice&&) noexcept;
    HeadlessDevice& operator=(HeadlessDevice&&) noexcept;

    VulkanContext context() const;
    const std::string& name() const;    // the device's name
    const std::string& driver() const;  // the driver's name and version
    // Warnings and errors of the validation layer so far; empty without HeadlessOptions::validation.
    std::vector<std::string> validationMessages() const;

   private:
    struct Impl;
    explicit HeadlessDevice(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace dimmer
