// How scene tests state what they expect.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <scene/level_file.h>

#include <string>
#include <vector>

namespace dimmer::cook::test {

// The import fails with BadInput and a message that holds every fragment, the file's name among them.
inline void expectBadInput(const Expected<Scene>& scene, const std::vector<std::string>& fragments) {
    ASSERT_FALSE(scene.has_value()) << "accepted, though " << fragments.front() << " is bad";
    EXPECT_EQ(scene.error().code, ErrorCode::BadInput);
    EXPECT_THAT(scene.error().message, testing::HasSubstr("level."));
    for (const std::string& fragment : fragments) EXPECT_THAT(scene.error().message, testing::HasSubstr(fragment));
}

// Exactly one warning holds every fragment.
inline void expectWarning(const Scene& scene, const std::vector<std::string>& fragments) {
    int matching = 0;
    for (const std::string& warning : scene.warnings) {
        bool all = warning.find("level.") != std::string::npos;
        for (const std::string& fragment : fragments) all = all && warning.find(fragment) != std::string::npos;
        matching += all;
    }
    EXPECT_EQ(matching, 1) << "of " << scene.warnings.size()
                           << " warnings: " << (scene.warnings.empty() ? "" : scene.warnings.front());
}

inline void expectNear(glm::vec3 actual, glm::vec3 expected, float tolerance = 1e-5f) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(actual[c], expected[c], tolerance) << "component " << c;
}

}  // namespace dimmer::cook::test

// Ends the test when an import failed, and shows why.
#define ASSERT_IMPORTED(scene) ASSERT_TRUE((scene).has_value()) << (scene).error().message
