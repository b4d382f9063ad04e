// The work list of an update: shared by C++ (planner, executors) and GLSL (blend_texels.comp, which reads each
// structure as a uvec4). The same layout in std430 and in C++.
#ifndef DIMMER_WORK_LIST_GLSL
#define DIMMER_WORK_LIST_GLSL

#ifdef __cplusplus
#include <cstdint>
namespace dimmer {
#define DIMMER_UINT std::uint32_t
#else
#define DIMMER_UINT uint
#endif

// A batch to blend.
struct WorkItem {
    DIMMER_UINT batch;       // of the pack; the device knows it by its BatchPlace
    DIMMER_UINT first_term;  // the cluster's contributions that are on, ascending, in the list of terms
    DIMMER_UINT term_count;
    DIMMER_UINT cluster;
};

// A contribution of a cluster that is on.
struct WorkTerm {
    DIMMER_UINT term;                    // of the pack; on the device: the cluster's first record of it
    float weight_r, weight_g, weight_b;  // times weightScale() of texel.h
};

// Where the device keeps a batch.
struct BatchPlace {
    DIMMER_UINT first_receiver;
    DIMMER_UINT receiver_count;
    DIMMER_UINT offset;  // of the batch within its cluster, in receivers
    DIMMER_UINT unused;
};

#undef DIMMER_UINT
#ifdef __cplusplus
static_assert(sizeof(WorkItem) == 16 && sizeof(WorkTerm) == 16 && sizeof(BatchPlace) == 16);
}  // namespace dimmer
#endif

#endif
