/* The version of these headers and of the library and tools made with them, for C and C++. Which packs a runtime reads
 * does not follow from it: files have a version of their own (docs/format.md). */
#ifndef DIMMER_VERSION_H
#define DIMMER_VERSION_H

/* CMakeLists.txt states the same. */
#define DIMMER_VERSION "0.1.0"
#define DIMMER_VERSION_MAJOR 0
#define DIMMER_VERSION_MINOR 1
#define DIMMER_VERSION_PATCH 0

#endif
