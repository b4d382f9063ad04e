// Memory that was freed goes back to the system.
#pragma once

#include <unistd.h>
#include <cstdint>
#include <cstdlib>  // says whether it is glibc's
#include <fstream>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace dimmer::cook {

// Between stages: glibc keeps what each thread freed for that thread alone, so that the stages' peaks would add up
// (lq_e2m3 at draft: 550 of 1,450 MiB). Cost: some milliseconds. Thread-safe.
inline void giveBackFreeMemory() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

// Of this process, from the second field of Linux's /proc/self/statm, in pages; 0 elsewhere.
inline uint64_t residentBytes() {
    std::ifstream statm("/proc/self/statm");
    uint64_t all = 0, resident = 0;
    statm >> all >> resident;
    return statm ? resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
}

// What goes back is cleared when it comes again, which is a twenty-fifth of a small level's second cook: nobody misses
// the memory of that.
inline void giveBackMuchFreeMemory() {
    constexpr uint64_t small_bytes = uint64_t{512} << 20;
    if (residentBytes() > small_bytes) giveBackFreeMemory();
}

}  // namespace dimmer::cook
