// Blends work items of lightmap texels (see dimmer/work_list.glsl), each texel written once. A lane takes two
// neighbouring receivers at a time, so that a record of both is one load of 16 bytes, and eight lanes walk through a
// batch of up to 64. Batches of different clusters share a workgroup: a cluster of a handful of texels leaves seven
// lanes idle, not sixty-three.
// The CPU twin is blendBatch in runtime/cpu/cpu_runtime.cpp.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "dimmer/texel.glsl"
#include "table.glsl"

layout(local_size_x_id = 1) in;

// The most contributions that are on in an item of this dispatch, and up to 8 the number in each; -1: no limit.
layout(constant_id = 0) const int terms_on = -1;

layout(constant_id = 2) const uint color_format = 0u;  // ColorFormat
layout(constant_id = 3) const uint column_bits = 9u;   // of a tile's number

layout(push_constant) uniform Dispatch {
    uint first_item;
    uint item_count;
}
dispatch;

// lavapipe loads 16 bytes from a texel buffer several times faster than from a storage buffer.
TABLE(0, uint, places)    // two receivers an element, a byte each: BatchTiles::add;
                          // batches that lie alike share theirs
TABLE(1, uvec4, base)     // two records an element
TABLE(2, uvec4, payload)  // two records an element
TABLE(3, uvec2, work)     // TexelItem
TABLE(4, uvec4, terms)    // WorkTerm
TABLE(5, uvec4, batches)  // TexelBatch
layout(set = 0, binding = 6, r32ui) writeonly uniform uimage2DArray irradiance_pages;
layout(set = 0, binding = 7, r32ui) writeonly uniform uimage2DArray direction_pages;

const uint lanes_per_item = 8u;
const uint receivers_per_lane = 2u;
const int specialised_max = 16;
const int exact_max = 8;
const int block = 4;  // terms at a time where there are more
// Outside every page: a store there has no effect.
const ivec3 nowhere = ivec3(-1);

// Eight lanes share these.
struct Item {
    uint first_term, term_count;
    uint first_receiver, first_places;  // the latter in pairs
    uint page, receiver_count;
    uvec4 tiles;
};

Item load_item(uint index) {
    uvec2 work_item = FETCH(work, index).xy;
    const uint low_26 = 0x3ffffffu, low_27 = 0x7ffffffu, low_18 = 0x3ffffu;
    uvec4 batch = FETCH(batches, work_item.x & low_26);
    uint tile_1 = batch.w & low_18, tile_2 = tile_1 + (batch.w >> 18 & 0xfffu);
    uint tile_3 = tile_2 + (batch.x >> 27 | batch.y >> 27 << 5 | batch.w >> 30 << 10);
    return Item(work_item.y & low_26, work_item.x >> 26 | work_item.y >> 26 << 6, (batch.x & low_27) << 1,
                batch.y & low_27, batch.z >> 24, (batch.z >> 18 & 63u) + 1u,
                uvec4(batch.z & low_18, tile_1, tile_2, tile_3));
}

// The pair of records `offset` receivers into the item.
uvec4 load_pair(uint first_record, uint offset) {
    return FETCH(payload, (first_record + offset) >> 1);
}

// The item's first record of a term, and its weight.
uvec4 locate(Item item, uint index) {
    uvec4 term = FETCH(terms, item.first_term + index);
    return uvec4(term.x + item.first_receiver, term.yzw);
}

// Past an item's last term its record stands in, weighted with 0: that changes no bit of a sum.
uvec4 load_term(Item item, uint t) {
    if (terms_on >= 0 && terms_on <= exact_max) return locate(item, t);
    uint count = item.term_count;
    uvec4 term = locate(item, min(t, count - 1u));
    return t < count ? term : uvec4(term.x, 0, 0, 0);
}

// Both texels of a pair with `terms_on` terms; all is loaded before it is used, one texel's sums live at a time.
uvec4 blend_pair(Item item, uint offset, uvec4 term[specialised_max]) {
    uvec4 base_pair = FETCH(base, (item.first_receiver + offset) >> 1);
    if (terms_on == 0) return base_pair;
    uvec4 pair[specialised_max];
    for (int t = 0; t < terms_on; ++t) pair[t] = load_pair(term[t].x, offset);

    DimmerTexelBlend sum = DimmerTexelBlend(vec3(0), 0.0, vec3(0));
    dimmer_blend_add(sum, base_pair.x, base_pair.y, vec3(dimmer_weight_scale(color_format)), color_format);
    for (int t = 0; t < terms_on; ++t) dimmer_blend_add(sum, pair[t].x, pair[t].y, uintBitsToFloat(term[t].yzw), color_format);
    uvec2 first = dimmer_blend_encode(sum, color_format);

    sum = DimmerTexelBlend(vec3(0), 0.0, vec3(0));
    dimmer_blend_add(sum, base_pair.z, base_pair.w, vec3(dimmer_weight_scale(color_format)), color_format);
    for (int t = 0; t < terms_on; ++t) dimmer_blend_add(sum, pair[t].z, pair[t].w, uintBitsToFloat(term[t].yzw), color_format);
    return uvec4(first, dimmer_blend_encode(sum, color_format));
}

// The same for any number of terms, in blocks within which the sums stay in registers; padded like load_term.
uvec4 blend_pair_loop(Item item, uint offset) {
    uvec4 base_pair = FETCH(base, (item.first_receiver + offset) >> 1);
    DimmerTexelBlend first = DimmerTexelBlend(vec3(0), 0.0, vec3(0));
    DimmerTexelBlend second = first;
    dimmer_blend_add(first, base_pair.x, base_pair.y, vec3(dimmer_weight_scale(color_format)), color_format);
    dimmer_blend_add(second, base_pair.z, base_pair.w, vec3(dimmer_weight_scale(color_format)), color_format);
    for (uint begin = 0u; begin < item.term_count; begin += uint(block)) {
        uvec4 pair[block];
        vec3 weight[block];
        for (int t = 0; t < block; ++t) {
            uvec4 term = load_term(item, begin + uint(t));
            pair[t] = load_pair(term.x, offset);
            weight[t] = uintBitsToFloat(term.yzw);
        }
        for (int t = 0; t < block; ++t) dimmer_blend_add(first, pair[t].x, pair[t].y, weight[t], color_format);
        for (int t = 0; t < block; ++t) dimmer_blend_add(second, pair[t].z, pair[t].w, weight[t], color_format);
    }
    return uvec4(dimmer_blend_encode(first, color_format), dimmer_blend_encode(second, color_format));
}

// A receiver's texel, by its byte.
ivec3 texel_of(Item item, uint place) {
    uvec2 pair = (place & 128u) == 0u ? item.tiles.xy : item.tiles.zw;
    uint tile = (place & 64u) == 0u ? pair.x : pair.y;
    uint column = tile & ((1u << column_bits) - 1u), row = tile >> column_bits;
    return ivec3(column << 3 | (place & 7u), row << 3 | (place >> 3 & 7u), item.page);
}

void store(ivec3 texel, uvec2 record) {
    imageStore(irradiance_pages, texel, uvec4(record.x));
    imageStore(direction_pages, texel, uvec4(record.y));
}

void store_pair(Item item, uint offset, uvec4 records) {
    uvec2 place = FETCH_BYTES(places, item.first_places + (offset >> 1));
    store(texel_of(item, place.x), records.xy);
    store(offset + 1u < item.receiver_count ? texel_of(item, place.y) : nowhere, records.zw);
}

void main() {
    // The grid is 2D only because one side of it is limited.
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint index = group * (gl_WorkGroupSize.x / lanes_per_item) + gl_LocalInvocationIndex / lanes_per_item;
    if (index >= dispatch.item_count) return;
    Item item = load_item(dispatch.first_item + index);

    uvec4 term[specialised_max];
    for (int t = 0; t < terms_on; ++t) term[t] = load_term(item, uint(t));
    uint lane = gl_LocalInvocationIndex % lanes_per_item;
    for (uint offset = lane * receivers_per_lane; offset < item.receiver_count;
         offset += lanes_per_item * receivers_per_lane) {
        store_pair(item, offset, terms_on < 0 ? blend_pair_loop(item, offset) : blend_pair(item, offset, term));
    }
}
