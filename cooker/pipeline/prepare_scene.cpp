#include <pipeline/prepare_scene.h>

#include <models/scene_models.h>
#include <scene/open_pose.h>

namespace dimmer::cook {

void prepareScene(Scene& scene, const Profile& profile) {
    addOpenLeaves(scene);
    chooseLighting(scene);
    listModels(scene, {.spacing_m = profile.local_spacing_m, .probes_max = profile.local_probes_max});
}

}  // namespace dimmer::cook
