// The work list of an update: shared by C++ (planner, executors) and GLSL (the blend_*.comp kernels, which read each
// structure as a uvec2 or uvec4). The same layout in std430 and in C++.
#ifndef DIMMER_WORK_LIST_GLSL
#define DIMMER_WORK_LIST_GLSL

#ifdef __cplusplus
#include <cstdint>
namespace dimmer {
#define DIMMER_UINT std::uint32_t
#else
#define DIMMER_UINT uint
#endif

// A batch to blend, as planned and as kernels for probes read it.
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

// The same in 8 bytes, for texels: batch and first_term in 26 bits each, term_count in the 12 that are left.
struct TexelItem {
    DIMMER_UINT batch;       // low 6 bits of term_count << 26 | batch
    DIMMER_UINT first_term;  // high 6 bits of term_count << 26 | first_term
};

// A batch of texels on the device: at most four 8x8 tiles of a page; a tile is row << tileColumnBits() | column. Steps
// are from tile 1 to 2, and 2 to 3. Receivers and their places (BatchTiles::add) are counted in pairs.
struct TexelBatch {
    DIMMER_UINT first_receivers;  // low 5 bits of step 3 << 27 | first pair of receivers
    DIMMER_UINT first_places;     // next 5 bits of step 3 << 27 | first pair of places
    DIMMER_UINT page_count_tile;  // page << 24 | (receivers - 1) << 18 | tile 0
    DIMMER_UINT step_tile;        // high 2 bits of step 3 << 30 | step 2 << 18 | tile 1
};

// Where the device keeps a batch of probes.
struct BatchPlace {
    DIMMER_UINT first_receiver;
    DIMMER_UINT receiver_count;
    DIMMER_UINT offset;  // of the batch within its cluster, in receivers
    DIMMER_UINT unused;
};

// Up to 64 probes of a moving model to be taken from the global grid: a lattice of counts x..z in the world.
struct ResampleItem {
    float origin_x, origin_y, origin_z;
    DIMMER_UINT first_probe;  // the lattice's
    float step_x_x, step_x_y, step_x_z;
    DIMMER_UINT counts;  // x | y << 8 | z << 16
    float step_y_x, step_y_y, step_y_z;
    DIMMER_UINT first;  // of the lattice's probes, those of this item
    float step_z_x, step_z_y, step_z_z;
    DIMMER_UINT count;
};

#undef DIMMER_UINT
#ifdef __cplusplus
static_assert(sizeof(WorkItem) == 16 && sizeof(WorkTerm) == 16 && sizeof(BatchPlace) == 16);
static_assert(sizeof(TexelItem) == 8 && sizeof(TexelBatch) == 16 && sizeof(ResampleItem) == 64);
}  // namespace dimmer
#endif

#endif
