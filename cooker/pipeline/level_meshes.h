// The level's meshes as a pack holds them: with lightmap UVs, split by material and page.
#pragma once

#include <charts/unwrap.h>
#include <pack/pack_data.h>

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace dimmer::cook {

// The one colour that meshes of a material are drawn with: the material's, times the mean of its texture, which is
// taken once however many ask.
class MeanReflectances {
   public:
    explicit MeanReflectances(const Scene& scene) : scene_(scene) {}
    glm::vec3 of(uint32_t material);

   private:
    const Scene& scene_;
    std::map<uint32_t, glm::vec3> known_;
};

// `emission_cd_m2`: per material, in the place of the scene's own; empty: those.
std::vector<Mesh> levelMeshes(const RayScene& rays, const Unwrap& unwrap,
                              std::span<const glm::vec3> emission_cd_m2 = {});

// The first node of a pack's meshes that the level lacks, or has with another box: the pack is of another level, or of
// an earlier state. Empty: none.
std::string nodeThatDiffers(const Scene& scene, std::span<const Mesh> of_pack);

}  // namespace dimmer::cook
