#include <pipeline/budget.h>

#include <pipeline/human_bytes.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <probes/grid_table.h>
#include <update/device_places.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <map>

namespace dimmer::cook {
namespace {

constexpr uint64_t record_bytes = sizeof(TexelRecord);

std::string describe(const Element& element) {
    return fmt::format("{} '{}'", element.kind == ElementKind::Door ? "door" : "light set", element.name);
}

std::string largestElements(const PackData& pack, const PackCost& cost) {
    std::vector<ElementCost> by_size = cost.elements;
    std::ranges::stable_sort(by_size, [](const auto& a, const auto& b) { return a.bytes > b.bytes; });
    std::vector<std::string> names;
    for (size_t i = 0; i < std::min<size_t>(3, by_size.size()); ++i)
        names.push_back(fmt::format(
            "{}'{}' {} ({:.0f} % of the records)",
            pack.elements[by_size[i].element].kind == ElementKind::Door ? "door " : "",
            pack.elements[by_size[i].element].name, humanBytes(by_size[i].bytes),
            100 * static_cast<double>(by_size[i].bytes) / static_cast<double>(std::max<uint64_t>(cost.dynamic, 1))));
    return fmt::format("{}", fmt::join(names, ", "));
}

// By what their triangles cover of the pages; double-sided ones by both sides.
std::string largestMeshes(const PackData& pack) {
    std::map<std::string, double> covered;
    double all = 0;
    for (const Mesh& mesh : pack.meshes)
        for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
            const auto at = [&](size_t k) {
                const auto& uv = mesh.vertices[mesh.indices[i + k]].lightmap_uv;
                return glm::dvec2(uv[0], uv[1]);
            };
            const glm::dvec2 u = at(1) - at(0), v = at(2) - at(0);
            const double area = std::abs(u.x * v.y - u.y * v.x) / 2;
            covered[mesh.node] += area;
            all += area;
        }
    std::vector<std::pair<double, std::string>> by_size;
    for (const auto& [node, area] : covered) by_size.emplace_back(-area, node);
    std::ranges::sort(by_size);
    std::vector<std::string> names;
    for (size_t i = 0; i < std::min<size_t>(3, by_size.size()); ++i)
        names.push_back(fmt::format("'{}' ({:.0f} % of the charts)", by_size[i].second, -100 * by_size[i].first / all));
    return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

PackCost costOf(const PackData& pack) {
    PackCost cost;
    const uint64_t receivers = pack.addresses.size();
    const DeviceBytes bytes = deviceBytesOf(pack);
    cost.base_lightmap = bytes.base_lightmap;
    cost.dynamic = bytes.dynamic;
    cost.probe_records = (pack.probes.payload.size() + pack.probes.numbers.size()) * sizeof(ProbeRecord);
    const GlobalGrid& grid = pack.probes.global;
    cost.global_grid = grid.positions.size() * sizeof(ProbeRecord) + gridTableBytes(grid);
    cost.local_grids = (pack.probes.base.size() - grid.positions.size()) * sizeof(ProbeRecord);
    cost.ancillary = bytes.ancillary - cost.global_grid - cost.local_grids;
    for (const Mesh& m : pack.meshes)
        cost.meshes += m.vertices.size() * sizeof(MeshVertex) + m.indices.size() * sizeof(uint32_t);
    for (const ModelMesh& m : pack.model_meshes)
        cost.meshes += m.vertices.size() * sizeof(ModelVertex) + m.indices.size() * sizeof(uint32_t);
    const std::vector<uint32_t>& probe_records = pack.probes.record_counts;
    for (uint32_t e = 0; e < pack.elements.size(); ++e) {
        ElementCost element{.element = e};
        for (size_t k = 0; k < pack.contributions.size(); ++k) {
            const Contribution& c = pack.contributions[k];
            const bool holds = c.light_set == e || std::ranges::count(c.doors_open, e) > 0 ||
                               std::ranges::count(c.doors_closed, e) > 0;
            if (!holds) continue;
            element.receivers += c.receivers;
            if (!probe_records.empty()) element.probe_bytes += probe_records[k] * sizeof(ProbeRecord);
        }
        element.bytes = element.receivers * record_bytes + element.probe_bytes;
        cost.elements.push_back(element);
    }
    cost.overlap_histogram.assign(1, pack.base_pages.size() - receivers);
    for (const Cluster& c : pack.clusters) {
        if (c.term_count >= cost.overlap_histogram.size()) cost.overlap_histogram.resize(c.term_count + 1);
        cost.overlap_histogram[c.term_count] += c.receiver_count;
    }
    return cost;
}

Expected<void> checkBudgets(const PackData& pack, const PackCost& cost, const Profile& profile) {
    std::vector<std::string> over;
    auto check = [&](std::string_view what, uint64_t bytes, uint64_t budget) {
        if (isOver(bytes, budget))
            over.push_back(fmt::format("{}: {} of {}, {} too much", what, humanBytes(bytes), humanBytes(budget),
                                       humanBytes(bytes - budget)));
    };
    check("total", cost.device(), profile.budget_total);
    check("base lightmaps", cost.base_lightmap, profile.budget_base_lightmaps);
    check("dynamic records", cost.dynamic, profile.budget_dynamic);
    check("global grid", cost.global_grid, profile.budget_global_grid);
    check("local grids", cost.local_grids, profile.budget_local_grids);
    for (const ElementCost& e : cost.elements)
        check(describe(pack.elements[e.element]), e.bytes, profile.budget_per_element);
    if (over.empty()) return {};
    std::string holders;
    const bool records = isOver(cost.device(), profile.budget_total) || isOver(cost.dynamic, profile.budget_dynamic) ||
                         std::ranges::any_of(cost.elements, [&](const ElementCost& e) {
                             return isOver(e.bytes, profile.budget_per_element);
                         });
    if (records && !cost.elements.empty()) holders += "; the largest elements: " + largestElements(pack, cost);
    if (isOver(cost.base_lightmap, profile.budget_base_lightmaps))
        holders += "; the largest meshes: " + largestMeshes(pack);
    if (isOver(cost.global_grid, profile.budget_global_grid))
        holders += fmt::format("; the grid has {} probes", pack.probes.global.positions.size());
    return fail(ErrorCode::OverBudget,
                fmt::format("over budget, nothing was written: {}{}", fmt::join(over, "; "), holders));
}

namespace {

std::string share(uint64_t bytes, uint64_t budget) {
    return budget == 0
               ? ""
               : fmt::format("{:5.1f} % of {}", 100.0 * static_cast<double>(bytes) / static_cast<double>(budget),
                             humanBytes(budget));
}

// Of a light set; a door's light is that of all groups that need it.
std::string energyDropped(const PackData& pack, uint32_t element) {
    for (const Contribution& c : pack.contributions)
        if (c.light_set == element && c.doors_open.empty() && c.doors_closed.empty())
            return fmt::format("{:.2f} %", 100 * static_cast<double>(c.energy_dropped));
    return "";
}

}  // namespace

std::string budgetTable(const PackData& pack, const PackCost& cost, const Profile& budgets) {
    std::string table = fmt::format("{:<26} {:>12}  {}\n", "category", "bytes", "share of the budget");
    const auto row = [&](std::string_view name, uint64_t bytes, uint64_t budget) {
        table += fmt::format("{:<26} {:>12}  {}\n", name, humanBytes(bytes), share(bytes, budget));
    };
    row("base lightmaps", cost.base_lightmap, budgets.budget_base_lightmaps);
    row("dynamic records", cost.dynamic, budgets.budget_dynamic);
    row("global grid", cost.global_grid, budgets.budget_global_grid);
    row("local grids", cost.local_grids, budgets.budget_local_grids);
    row("ancillary", cost.ancillary, 0);
    row("total on the device", cost.device(), budgets.budget_total);
    table += fmt::format("\n{:<26} {:>12} {:>13} {:>15}  {}\n", "element", "bytes", "texel records", "energy dropped",
                         "share of the budget");
    for (const ElementCost& e : cost.elements)
        table += fmt::format(
            "{:<26} {:>12} {:>13} {:>15}  {}\n",
            (pack.elements[e.element].kind == ElementKind::Door ? "door:" : "") + pack.elements[e.element].name,
            humanBytes(e.bytes), e.receivers, energyDropped(pack, e.element),
            share(e.bytes, budgets.budget_per_element));
    return table;
}

}  // namespace dimmer::cook
