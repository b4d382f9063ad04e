// Places of a model's surface, and what a shader reads there.
#pragma once

#include <models/model_receivers.h>

#include <dimmer/model_mesh.h>

#include <vector>

namespace dimmer::cook {

struct ModelPlace {
    SamplePoint point;  // its face is the triangle's own (triangle_faces)
    NearProbes near;
    LightTransfer transfer;  // interpolated between the vertices, world axes
};

// Up to `count` by area, on both sides of what is double-sided, without what lies inside of other geometry or of other
// parts of the model: fewer where most of it does. None of a model that has no transfers.
std::vector<ModelPlace> modelPlaces(const RayScene& rays, uint32_t model, uint32_t count);

}  // namespace dimmer::cook
