// A kernel's tables: read only, an element at a time, by its number. Each kernel is built twice, to read all of them as
// texel buffers or, with DIMMER_STORAGE_TABLES, as storage buffers; Kernel::create (runtime/gpu/kernel.h) takes the first
// where the device's texel buffers are as long as the tables. An element is a uint, uvec2 or uvec4; or half a word, in a
// TABLE of uint that is read in halves.
#ifdef DIMMER_STORAGE_TABLES

#define TABLE(number, type, name) layout(set = 0, binding = number, std430) restrict readonly buffer Table_##name { type elements[]; } name;
#define FETCH(name, index) name.elements[index]
#define FETCH_HALF(name, index) (name.elements[(index) >> 1] >> ((index) & 1u) * 16u & 0xffffu)
#define FETCH_BYTES(name, index) (uvec2(FETCH_HALF(name, index)) >> uvec2(0, 8) & 0xffu)

#else

#define TABLE(number, type, name) layout(set = 0, binding = number) uniform utextureBuffer name;
#define FETCH(name, index) texelFetch(name, int(index))
#define FETCH_HALF(name, index) texelFetch(name, int(index)).x
#define FETCH_BYTES(name, index) texelFetch(name, int(index)).xy

#endif
