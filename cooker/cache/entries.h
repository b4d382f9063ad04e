// Results of stages as bytes, and back. What comes back is what went in: entries are hashed.
#pragma once

#include <bake/bake.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <scene/scene.h>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace dimmer::cook {

struct ChartsEntry {
    std::vector<SceneMesh> meshes;  // after walls cut their faces: vertices and triangles alone
    Unwrap charts;
    Texels texels;
};
// Moves the vertices and triangles of `from`.
void takeGeometry(SceneMesh& mesh, SceneMesh&& from);
std::vector<std::byte> toBytes(const ChartsEntry& entry);
std::optional<ChartsEntry> chartsFromBytes(std::span<const std::byte> bytes);

std::vector<std::byte> toBytes(const GroupLight& light);
std::optional<GroupLight> groupFromBytes(std::span<const std::byte> bytes);

std::vector<std::byte> toBytes(const BakedGrid& grid);
std::optional<BakedGrid> gridFromBytes(std::span<const std::byte> bytes);

// Of several blocks of places.
std::vector<std::byte> toBytes(std::span<const Sparse<ProbeTermLight>> light);
std::optional<std::vector<Sparse<ProbeTermLight>>> siteLightFromBytes(std::span<const std::byte> bytes, size_t blocks);

std::vector<std::byte> toBytes(const SparseLight& radiance);
std::optional<SparseLight> radianceFromBytes(std::span<const std::byte> bytes);

}  // namespace dimmer::cook
