// The work list of an update: shared by C++ (planner, CPU executor) and GLSL (blend_texels.comp). Both structures are
// 16 bytes with the same layout in std430 and in C++.
#ifndef DIMMER_WORK_LIST_GLSL
#define DIMMER_WORK_LIST_GLSL

#ifdef __cplusplus
#include <cstdint>
namespace dimmer {
#define DIMMER_UINT std::uint32_t
#else
#define DIMMER_UINT uint
#endif

// A batch to blend: one workgroup, one lane per receiver.
struct WorkItem {
    DIMMER_UINT first_receiver;
    DIMMER_UINT receiver_count;  // 1..64
    DIMMER_UINT first_term;      // the batch's contributions that are on, ascending, in the list of terms
    DIMMER_UINT term_count;
};

// A contribution of a cluster that is on.
struct WorkTerm {
    DIMMER_UINT payload_bias;  // index of a receiver's record = payload_bias + receiver, modulo 2^32
    float weight_r, weight_g, weight_b;
};

#undef DIMMER_UINT
#ifdef __cplusplus
static_assert(sizeof(WorkItem) == 16 && sizeof(WorkTerm) == 16);
}  // namespace dimmer
#endif

#endif
