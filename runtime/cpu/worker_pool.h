// Threads that wait for work: an update is too short to start any.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace dimmer {

class WorkerPool {
   public:
    // The caller works too, so one thread fewer is started; fewer still where the system refuses, threads() says.
    explicit WorkerPool(uint32_t threads);
    ~WorkerPool();
    WorkerPool(const WorkerPool&) = delete;
    WorkerPool& operator=(const WorkerPool&) = delete;

    uint32_t threads() const { return static_cast<uint32_t>(workers_.size()) + 1; }
    // Calls work(i) once for every i below threads(), on as many threads; returns when all have returned.
    void run(const std::function<void(uint32_t)>& work);

   private:
    void loop(uint32_t index);

    std::mutex mutex_;
    std::condition_variable begin_, end_;
    const std::function<void(uint32_t)>* work_ = nullptr;
    uint64_t round_ = 0;
    uint32_t running_ = 0;
    bool stop_ = false;
    std::vector<std::thread> workers_;
};

}  // namespace dimmer
