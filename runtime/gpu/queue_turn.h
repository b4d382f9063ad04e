// Whose turn it is on a queue that the game's other threads use as well.
#pragma once

#include <dimmer/runtime.h>

namespace dimmer {

// As long as it lives, the queue is this thread's alone, where the game gave the means to say so.
class QueueTurn {
   public:
    QueueTurn(const QueueLock& lock, VkQueue queue) : lock_(lock), queue_(queue) {
        if (lock_.lock) lock_.lock(lock_.user, queue_);
    }
    ~QueueTurn() {
        if (lock_.unlock) lock_.unlock(lock_.user, queue_);
    }
    QueueTurn(const QueueTurn&) = delete;
    QueueTurn& operator=(const QueueTurn&) = delete;

   private:
    const QueueLock& lock_;
    VkQueue queue_;
};

}  // namespace dimmer
