#include <cpu/worker_pool.h>

#include <new>
#include <system_error>

namespace dimmer {

WorkerPool::WorkerPool(uint32_t threads) {
    try {
        for (uint32_t i = 1; i < threads; ++i) workers_.emplace_back([this, i] { loop(i); });
    } catch (const std::system_error&) {  // no more threads to be had
    } catch (const std::bad_alloc&) {     // nor memory for one
    }
}

WorkerPool::~WorkerPool() {
    {
        const std::scoped_lock lock(mutex_);
        stop_ = true;
    }
    begin_.notify_all();
    for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::runCall(Call work) {
    {
        const std::scoped_lock lock(mutex_);
        work_ = work;
        running_ = static_cast<uint32_t>(workers_.size());
        ++round_;
    }
    begin_.notify_all();
    work(0);
    std::unique_lock lock(mutex_);
    end_.wait(lock, [this] { return running_ == 0; });
}

void WorkerPool::loop(uint32_t index) {
    uint64_t done = 0;
    for (;;) {
        Call work;
        {
            std::unique_lock lock(mutex_);
            begin_.wait(lock, [&] { return stop_ || round_ != done; });
            if (stop_) return;
            done = round_;
            work = work_;
        }
        work(index);
        const std::scoped_lock lock(mutex_);
        if (--running_ == 0) end_.notify_one();
    }
}

}  // namespace dimmer
