// Charts over surfaces that curve.
#include <bake/test_scenes.h>
#include <charts/curved.h>
#include <charts/raster.h>
#include <charts/unwrap.h>
#include <gtest/gtest.h>
#include <pipeline/cooked_level.h>

#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <span>
#include <vector>

namespace dimmer::cook::test {
namespace {

constexpr float density_per_m = 4;
constexpr uint32_t side_max = 1022;
using Shape = std::function<glm::vec3(float, float)>;

glm::vec3 normalAt(const Shape& shape, float s, float t) {
    constexpr float step = 1e-2f;
    const glm::vec3 along_s = shape(s + step, t) - shape(s - step, t),
                    along_t = shape(s, t + step) - shape(s, t - step);
    return glm::normalize(glm::cross(along_t, along_s));
}

// Over `columns` by `rows` unit squares of the parameters; its front is where along_t x along_s points.
SceneMesh meshOf(const Shape& shape, uint32_t columns, uint32_t rows, uint32_t material) {
    SceneMesh mesh;
    mesh.node = "surface";
    mesh.lighting = Lighting::Lightmap;
    for (uint32_t j = 0; j <= rows; ++j)
        for (uint32_t i = 0; i <= columns; ++i) {
            const auto s = static_cast<float>(i), t = static_cast<float>(j);
            mesh.positions_m.push_back(shape(s, t));
            mesh.normals.push_back(normalAt(shape, s, t));
        }
    for (uint32_t j = 0; j < rows; ++j)
        for (uint32_t i = 0; i < columns; ++i) {
            const uint32_t a = j * (columns + 1) + i, b = a + 1, c = a + columns + 1, d = c + 1;
            for (const glm::uvec3 t : {glm::uvec3(a, c, b), glm::uvec3(b, c, d)}) mesh.triangles.push_back(t);
        }
    mesh.triangle_materials.assign(mesh.triangles.size(), material);
    return mesh;
}

enum class Shading { Smooth, Facets };

std::vector<PlanarFace> facesOf(const SceneMesh& mesh, Shading shading = Shading::Smooth) {
    std::vector<PlanarFace> faces;
    for (const glm::uvec3 t : mesh.triangles) {
        PlanarFace face{{}, {}, density_per_m, 0};
        for (int i = 0; i < 3; ++i) face.corners_m[static_cast<size_t>(i)] = mesh.positions_m[t[i]];
        const auto& c = face.corners_m;
        face.normal = glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]));
        for (int i = 0; i < 3; ++i)
            face.corner_normals[static_cast<size_t>(i)] = shading == Shading::Smooth ? mesh.normals[t[i]] : face.normal;
        faces.push_back(face);
    }
    return faces;
}

std::vector<ProjectedChart> chartsOf(const std::vector<PlanarFace>& faces, const Standing& standing = {}) {
    return joinCurved(faces, planarCharts(faces, side_max, standing), side_max, standing);
}

// Of the page, padding included.
double texelsOf(const std::vector<ProjectedChart>& charts) {
    double sum = 0;
    for (const ProjectedChart& c : charts)
        sum +=
            (std::ceil(double{c.size_m.x} * density_per_m) + 2) * (std::ceil(double{c.size_m.y} * density_per_m) + 2);
    return sum;
}

double areaM2(const std::vector<PlanarFace>& faces) {
    double sum = 0;
    for (const PlanarFace& f : faces)
        sum += 0.5 * double{glm::length(glm::cross(f.corners_m[1] - f.corners_m[0], f.corners_m[2] - f.corners_m[0]))};
    return sum;
}

// Each face is in one chart, inside its rectangle, and seen from its front by at most 35 degrees: 30, and what
// the extreme normals of a patch may hide.
void expectChartsOfAll(const std::vector<PlanarFace>& faces, const std::vector<ProjectedChart>& charts) {
    std::vector<int> found(faces.size());
    for (const ProjectedChart& chart : charts) {
        EXPECT_TRUE(std::ranges::is_sorted(chart.faces));
        EXPECT_NEAR(glm::dot(chart.u_axis, chart.v_axis), 0, 1e-5);
        for (const uint32_t f : chart.faces) {
            ++found[f];
            EXPECT_GT(glm::dot(faces[f].normal, glm::cross(chart.u_axis, chart.v_axis)), std::cos(glm::radians(35.0f)));
            for (const glm::vec3 p : faces[f].corners_m) {
                const glm::vec2 at = glm::vec2(glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis)) - chart.min_m;
                EXPECT_TRUE(glm::all(glm::greaterThan(at, glm::vec2(-1e-4f))));
                EXPECT_TRUE(glm::all(glm::lessThan(at, chart.size_m + 1e-4f)));
            }
        }
    }
    EXPECT_EQ(found, std::vector<int>(faces.size(), 1));
}

// Slopes up to 35 degrees, steps of a metre: facets of 10 degrees to one another.
glm::vec3 hills(float s, float t) {
    return {s, 1.5f * std::sin(0.4f * s) * std::cos(0.35f * t), t};
}

TEST(CurvedCharts, TakeLittleMoreThanTheSurface) {
    const auto faces = facesOf(meshOf(hills, 40, 40, 0));
    const auto facets = planarCharts(faces, side_max, {});
    const auto charts = chartsOf(faces);
    expectChartsOfAll(faces, charts);
    EXPECT_GT(texelsOf(facets), 3 * areaM2(faces) * density_per_m * density_per_m);
    EXPECT_LT(texelsOf(charts), 1.6 * areaM2(faces) * density_per_m * density_per_m);
}

// A column of 24 sides: three to a chart, 45 degrees, of bends by 15.
TEST(CurvedCharts, GoAroundColumns) {
    const Shape column = [](float s, float t) {
        const float angle = s * glm::radians(15.0f);
        return glm::vec3(std::cos(angle), t, -std::sin(angle));
    };
    SceneMesh mesh = meshOf(column, 24, 3, 0);
    const auto faces = facesOf(mesh);
    const auto charts = chartsOf(faces);
    expectChartsOfAll(faces, charts);
    EXPECT_LE(charts.size(), 12u);
    EXPECT_GE(charts.size(), 6u);
    EXPECT_EQ(planarCharts(faces, side_max).size(), 24u);
}

// Creases that are shaded as such part what has light of its own on each side.
TEST(CurvedCharts, CreasesAreNoCurves) {
    const Shape folds = [](float s, float t) {
        return glm::vec3(s, 0.15f * std::abs(std::remainder(s, 2.0f)), t);  // by 17 degrees, twice 8.5
    };
    const auto creased = facesOf(meshOf(folds, 8, 4, 0), Shading::Facets);
    EXPECT_EQ(chartsOf(creased).size(), 8u);
    EXPECT_LT(chartsOf(facesOf(meshOf(folds, 8, 4, 0))).size(), 8u);
}

TEST(CurvedCharts, FacetsOfAGentleCurveAreOne) {
    const Shape bowl = [](float s, float t) { return glm::vec3(s, 0.02f * (s * s + t * t), t); };
    const auto faces = facesOf(meshOf(bowl, 6, 6, 0), Shading::Facets);  // bends of at most 4 degrees
    EXPECT_EQ(chartsOf(faces).size(), 1u);
}

// A ramp that winds up twice: what lies above is of another chart.
TEST(CurvedCharts, NothingLiesOverItself) {
    const Shape ramp = [](float s, float t) {
        const float angle = t * glm::radians(15.0f);
        return glm::vec3((0.5f + 0.5f * s) * std::cos(angle), 0.12f * angle, (0.5f + 0.5f * s) * std::sin(angle));
    };
    std::vector<PlanarFace> faces = facesOf(meshOf(ramp, 2, 48, 0));
    for (PlanarFace& f : faces)
        if (f.normal.y < 0) {
            f.normal = -f.normal;
            std::swap(f.corners_m[1], f.corners_m[2]);
            std::swap(f.corner_normals[1], f.corner_normals[2]);
            for (glm::vec3& n : f.corner_normals) n = -n;
        }
    const auto charts = chartsOf(faces);
    expectChartsOfAll(faces, charts);
    EXPECT_LE(charts.size(), 6u);
    constexpr float cells_per_m = 16;
    for (const ProjectedChart& chart : charts) {
        std::map<std::pair<uint32_t, uint32_t>, float> height_m;
        const glm::vec3 normal = glm::cross(chart.u_axis, chart.v_axis);
        for (const uint32_t f : chart.faces) {
            std::array<glm::vec2, 3> flat;
            for (size_t i = 0; i < 3; ++i) {
                const glm::vec3 p = faces[f].corners_m[i];
                flat[i] = cells_per_m * (glm::vec2(glm::dot(p, chart.u_axis), glm::dot(p, chart.v_axis)) - chart.min_m);
            }
            const float height = glm::dot(normal, faces[f].corners_m[0]);
            forEachCoveredCentre(flat, glm::uvec2(glm::ceil(cells_per_m * chart.size_m)), [&](uint32_t x, uint32_t y) {
                EXPECT_TRUE(height_m.try_emplace({x, y}, height).second) << height - height_m[{x, y}];
            });
        }
    }
}

// Whether one chart has faces on both sides of a wall, within the filter's reach of it.
bool anyGoesOnBeyond(float wall_x, const std::vector<PlanarFace>& faces, const std::vector<ProjectedChart>& charts) {
    for (const ProjectedChart& chart : charts) {
        std::set<bool> sides;
        for (const uint32_t f : chart.faces) {
            const auto [low, high] =
                std::minmax({faces[f].corners_m[0].x, faces[f].corners_m[1].x, faces[f].corners_m[2].x});
            constexpr float reach_m = 2 / density_per_m;
            if (high <= wall_x + 1e-3f && high > wall_x - reach_m) sides.insert(false);
            if (low >= wall_x - 1e-3f && low < wall_x + reach_m) sides.insert(true);
        }
        if (sides.size() > 1) return true;
    }
    return false;
}

Standing wallAt(float wall_x) {
    return {[wall_x](glm::vec3 a, glm::vec3 b) { return (a.x < wall_x) != (b.x < wall_x); }, {}};
}

TEST(CurvedCharts, WallsPartThem) {
    const auto faces = facesOf(meshOf(hills, 40, 10, 0));
    bool any_without = false;
    for (const float wall_x : {17.0f, 18.0f, 20.0f, 22.0f}) {
        any_without |= anyGoesOnBeyond(wall_x, faces, chartsOf(faces));
        const auto charts = chartsOf(faces, wallAt(wall_x));
        expectChartsOfAll(faces, charts);
        EXPECT_FALSE(anyGoesOnBeyond(wall_x, faces, charts)) << wall_x;
        EXPECT_LT(texelsOf(charts), 1.8 * areaM2(faces) * density_per_m * density_per_m);
    }
    EXPECT_TRUE(any_without);
}

// On a slope of 25 degrees a point 0.8 m along its normal is 0.34 m to the side: beyond the wall, as the other one is.
TEST(CurvedCharts, WallsOnSlopesArePlumb) {
    const Shape slope = [](float s, float t) {
        const float x = 0.25f * s;
        return glm::vec3(x, 0.46f * x + 0.01f * x * x, 0.25f * t);
    };
    const auto faces = facesOf(meshOf(slope, 32, 8, 0));
    for (const float wall_x : {4.0f, 4.06f, 4.12f, 4.19f})
        EXPECT_FALSE(anyGoesOnBeyond(wall_x, faces, chartsOf(faces, wallAt(wall_x)))) << wall_x;
}

// Facets whose planes differ by less than some are told apart: those are neither one plane nor all different ones.
TEST(CurvedCharts, NearlyFlatGroundIsOne) {
    const Shape swell = [](float s, float t) {
        return glm::vec3(0.25f * s, 0.08f * std::sin(0.125f * s) * std::cos(0.11f * t), 0.25f * t);
    };
    const auto faces = facesOf(meshOf(swell, 60, 60, 0));
    const auto charts = chartsOf(faces);
    expectChartsOfAll(faces, charts);
    EXPECT_LT(texelsOf(charts), 1.3 * areaM2(faces) * density_per_m * density_per_m);
}

// Of facets of a tenth of a texel 600 are within the filter's reach of each, 12 questions at least for a pair.
TEST(CurvedCharts, FineFacetsAskLittle) {
    const Shape relief = [](float s, float t) {
        return glm::vec3(0.025f * s, 0.05f * std::sin(0.15f * s) * std::cos(0.13f * t), 0.025f * t);
    };
    const auto faces = facesOf(meshOf(relief, 80, 80, 0));
    std::atomic<size_t> asked = 0;  // on all threads
    const auto charts = chartsOf(faces, {[&](glm::vec3, glm::vec3) {
                                             ++asked;
                                             return false;
                                         },
                                         {}});
    expectChartsOfAll(faces, charts);
    EXPECT_LE(charts.size(), 4u);
    EXPECT_LT(asked, 1000 * faces.size());
}

TEST(CurvedCharts, DoNotMixGroupsOrDensities) {
    auto faces = facesOf(meshOf(hills, 4, 4, 0));
    for (size_t i = 0; i < faces.size(); ++i) {
        faces[i].group = i % 8 < 4;
        faces[i].texels_per_metre = i < faces.size() / 2 ? 4 : 5;
    }
    const auto charts = chartsOf(faces);
    expectChartsOfAll(faces, charts);
    EXPECT_LT(charts.size(), faces.size());
    for (const ProjectedChart& chart : charts)
        for (const uint32_t f : chart.faces) {
            EXPECT_EQ(faces[f].group, faces[chart.faces[0]].group);
            EXPECT_EQ(faces[f].texels_per_metre, chart.texels_per_metre);
        }
}

// A column of 20 sides is several charts, of about two texels across. Where they meet both hold the same two texels;
// clamped to its own, each would end with the mean of facets some 40 degrees from the other's: a third of far light.
TEST(CurvedCharts, LightGoesOnAroundAColumn) {
    constexpr float radius_m = 0.3f, far_lux = 1000;
    constexpr uint32_t sides = 20;
    const auto at = [](float side, float height_m, float out) {
        const float angle = side * 2 * std::numbers::pi_v<float> / sides;
        return glm::vec3(out * std::cos(angle), height_m, out * std::sin(angle));
    };
    Scene scene;
    scene.meshes.push_back(meshOf([&](float s, float t) { return at(std::fmod(s, sides), t, radius_m); }, sides, 2,
                                  addMaterial(scene, lambert(0))));
    for (size_t i = 0; i < scene.meshes[0].normals.size(); ++i)
        scene.meshes[0].normals[i] = glm::normalize(scene.meshes[0].positions_m[i] * glm::vec3(1, 0, 1));
    PunctualLight sun;
    sun.node = "sun";
    sun.type = LightType::Directional;
    sun.direction = glm::normalize(glm::vec3(1, 0, 0.2f));
    sun.intensity = glm::vec3(far_lux);
    sun.bake = BakeMode::Full;
    scene.lights.push_back(sun);
    const auto pack = cooked(scene, "draft");
    ASSERT_TRUE(pack);
    std::vector<QueryPoint> points;
    for (uint32_t side = 0; side < sides; ++side)
        for (const float off : {-0.02f, 0.02f}) {  // 2 mm from the edge
            const float k = static_cast<float>(side);
            const glm::vec3 edge = at(k, 0.9f, radius_m), next = at(off < 0 ? k - 1 : k + 1, 0.9f, radius_m);
            points.push_back({glm::mix(edge, next, std::abs(off)), at(k + (off < 0 ? -0.5f : 0.5f), 0, 1)});
        }
    const auto light = sampled(*pack, points, "");
    double brightest = 0;
    for (size_t i = 0; i < light.size(); i += 2) {
        // A texel is 2.7 facets, over which far light changes by at most 0.77 of it: 4 mm of 250 by 0.01.
        EXPECT_NEAR(light[i].x, light[i + 1].x, 0.03 * far_lux) << i / 2;
        brightest = std::max(brightest, light[i].x);
    }
    EXPECT_GT(brightest, 0.8 * far_lux);
}

// Far light on a dome: E0 cos, of which facets that differ by 5 degrees from the curve are off by 0.09 E0 where light
// grazes it, by 0.045 in the mean at most; texels blend them. Mirrored or misplaced texels would be off by E0.
TEST(CurvedCharts, AreLitWhereTheyAre) {
    constexpr float radius = 4;
    const Shape dome = [](float s, float t) {
        const float x = 0.5f * (s - 10), z = 0.5f * (t - 10);  // up to 2.5 m of 4: 62 degrees in the corners
        return glm::vec3(0.5f * x, std::sqrt(radius * radius - 0.25f * (x * x + z * z)), 0.5f * z);
    };
    Scene scene;
    scene.meshes.push_back(meshOf(dome, 20, 20, addMaterial(scene, lambert(0))));
    PunctualLight sun;
    sun.node = "sun";
    sun.type = LightType::Directional;
    sun.direction = glm::normalize(glm::vec3(1, -1, 0.5f));
    sun.intensity = glm::vec3(1000);
    sun.bake = BakeMode::Full;
    scene.lights.push_back(sun);
    const auto pack = cooked(scene, "draft");
    ASSERT_TRUE(pack);
    std::vector<QueryPoint> points;
    std::vector<double> expected;
    std::mt19937 random(5);
    const RayScene rays(scene);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int i = 0; i < 500; ++i) {
        const auto t = static_cast<uint32_t>(random() % rays.triangles().size());
        const float root = std::sqrt(unit(random)), v = unit(random);
        points.push_back({rays.pointOn(t, root * (1 - v), root * v), rays.triangles()[t].normal});
        expected.push_back(1000 *
                           std::max(0.0, -double{glm::dot(sun.direction, glm::normalize(points.back().position_m))}));
    }
    const auto light = sampled(*pack, points, "");
    double off = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        EXPECT_NEAR(light[i].x, expected[i], 90) << points[i].position_m.x << " " << points[i].position_m.z;
        off += std::abs(light[i].x - expected[i]);
    }
    EXPECT_LT(off / static_cast<double>(points.size()), 25);
}

}  // namespace
}  // namespace dimmer::cook::test
