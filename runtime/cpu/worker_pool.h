// Threads that wait for work: an update is too short to start any.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace dimmer {

class WorkerPool {
   public:
    // More help nobody; hardware_concurrency() - 1 may be 4 billion, where that says 0.
    static constexpr uint32_t threads_max = 1024;

    // The caller works too, so one thread fewer is started; fewer still where the system refuses, threads() says.
    explicit WorkerPool(uint32_t threads);
    ~WorkerPool();
    WorkerPool(const WorkerPool&) = delete;
    WorkerPool& operator=(const WorkerPool&) = delete;

    uint32_t threads() const { return static_cast<uint32_t>(workers_.size()) + 1; }
    // Calls work(i) once for every i below threads(), on as many threads; returns when all have returned. Allocates
    // nothing.
    template <class Work>
    void run(const Work& work) {
        runCall({[](const void* callee, uint32_t index) { (*static_cast<const Work*>(callee))(index); }, &work});
    }

   private:
    // A call of something that outlives it: std::function would take memory for more than two captures.
    struct Call {
        void (*function)(const void* callee, uint32_t index) = nullptr;
        const void* callee = nullptr;
        void operator()(uint32_t index) const { function(callee, index); }
    };
    void runCall(Call work);
    void loop(uint32_t index);

    std::mutex mutex_;
    std::condition_variable begin_, end_;
    Call work_;
    uint64_t round_ = 0;
    uint32_t running_ = 0;
    bool stop_ = false;
    std::vector<std::thread> workers_;
};

}  // namespace dimmer
