#include <app/budget_json.h>

namespace dimmer::cook {

nlohmann::ordered_json bytesJson(const PackCost& cost, std::optional<uint64_t> file_bytes) {
    nlohmann::ordered_json json;
    if (file_bytes) json["file"] = *file_bytes;
    json["device"] = cost.device();
    json["base_lightmap"] = cost.base_lightmap;
    json["dynamic"] = cost.dynamic;
    json["local_grids"] = cost.local_grids;
    json["global_grid"] = cost.global_grid;
    json["ancillary"] = cost.ancillary;
    json["meshes"] = cost.meshes;
    return json;
}

nlohmann::ordered_json elementsJson(const PackData& pack, const PackCost& cost) {
    auto list = nlohmann::ordered_json::array();
    for (const ElementCost& e : cost.elements)
        list.push_back({{"name", pack.elements[e.element].name},
                        {"kind", pack.elements[e.element].kind == ElementKind::Door ? "door" : "set"},
                        {"receivers", e.receivers},
                        {"bytes", e.bytes},
                        {"probe_bytes", e.probe_bytes}});
    return list;
}

nlohmann::ordered_json budgetsJson(const Profile& profile) {
    return {{"total", profile.budget_total},
            {"base_lightmaps", profile.budget_base_lightmaps},
            {"dynamic", profile.budget_dynamic},
            {"global_grid", profile.budget_global_grid},
            {"local_grids", profile.budget_local_grids},
            {"per_element", profile.budget_per_element}};
}

}  // namespace dimmer::cook
