#include "panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

namespace dimmer::sample {
namespace {

constexpr float margin = 8, lights_width = 280, costs_width = 270, label_width = 90;

// Brighter than this nobody drags a slider; scripts may.
constexpr float slider_max = 1000;

// The rest of the line is for what follows; of a long name, what fits, and all of it under the mouse.
void label(const char* name) {
    ImGui::AlignTextToFramePadding();
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::PushClipRect(at, {at.x + label_width - 2 * margin, at.y + ImGui::GetFrameHeight()}, true);
    ImGui::TextUnformatted(name);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", name);
    ImGui::PopClipRect();
    ImGui::SameLine(label_width);
}

void drawSet(Controls& controls, const Element& element, uint32_t set) {
    ImGui::PushID(static_cast<int>(set));
    Tint tint = controls.tint(set);
    std::array<float, 3> color = {tint.color.r, tint.color.g, tint.color.b};
    label(element.name.c_str());
    bool on = tint.brightness > 0, changed = false;
    if (ImGui::Checkbox("##on", &on)) {
        tint.brightness = on ? weightAtFirst(element) : 0;
        changed = true;
    }
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-60);
    changed = ImGui::SliderFloat("##brightness", &tint.brightness, 0, std::min(element.max_weight, slider_max), "%.3g",
                                 ImGuiSliderFlags_AlwaysClamp) ||
              changed;
    ImGui::SameLine();
    if (ImGui::ColorEdit3("##color", color.data(), ImGuiColorEditFlags_NoInputs | ImGuiColorEditFlags_Float)) {
        tint.color = {color[0], color[1], color[2]};
        changed = true;
    }
    if (changed) controls.setTint(set, tint);
    ImGui::PopID();
}

void drawDoor(Controls& controls, const LightState& lights, const Element& element, uint32_t door) {
    ImGui::PushID(static_cast<int>(door));
    float open = lights.open(Door{door});
    label(element.name.c_str());
    ImGui::SetNextItemWidth(-60);
    if (ImGui::SliderFloat("##open", &open, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp)) controls.setOpen(door, open);
    ImGui::SameLine();
    const bool opens = controls.target(door) > 0.5f;
    if (ImGui::Button(opens ? "close###send" : "open###send", {-1, 0})) controls.send(door, opens ? 0.0f : 1.0f);
    ImGui::PopID();
}

void drawElements(Controls& controls, const LightState& lights) {
    const auto elements = lights.pack().elements();
    const auto has = [&](ElementKind kind) {
        return std::ranges::any_of(elements, [&](const Element& e) { return e.kind == kind; });
    };
    if (has(ElementKind::LightSet) && ImGui::CollapsingHeader("Light sets", ImGuiTreeNodeFlags_DefaultOpen)) {
        for (uint32_t i = 0; i < elements.size(); ++i)
            if (elements[i].kind == ElementKind::LightSet) drawSet(controls, elements[i], i);
        if (ImGui::Button("all on")) controls.setAll(true);
        ImGui::SameLine();
        if (ImGui::Button("all off")) controls.setAll(false);
        ImGui::SameLine();
        if (ImGui::Button("copy as text")) ImGui::SetClipboardText(controls.text().c_str());
        if (ImGui::IsItemHovered()) ImGui::SetTooltip("for --state and LightState::apply()");
    }
    if (has(ElementKind::Door) && ImGui::CollapsingHeader("Doors", ImGuiTreeNodeFlags_DefaultOpen))
        for (uint32_t i = 0; i < elements.size(); ++i)
            if (elements[i].kind == ElementKind::Door) drawDoor(controls, lights, elements[i], i);
}

void drawCosts(const CostHistory& costs) {
    if (!ImGui::CollapsingHeader("What the last change cost", ImGuiTreeNodeFlags_DefaultOpen)) return;
    if (const auto& s = costs.last_change) {
        ImGui::Text("%u contributions in %u clusters", s->contributions_changed, s->clusters);
        ImGui::Text("%llu texels and probes", static_cast<unsigned long long>(s->receivers));
        ImGui::Text("%.2f MB read, %.2f MB written", static_cast<double>(s->bytes_read) / 1e6,
                    static_cast<double>(s->bytes_written) / 1e6);
        ImGui::Text("%u dispatches: host %.0f, GPU %.0f us", s->dispatches, s->host_us, s->gpu_us);
        if (s->receivers_waiting > 0)
            ImGui::Text("%llu texels wait", static_cast<unsigned long long>(s->receivers_waiting));
    } else {
        ImGui::TextUnformatted("nothing has changed");
    }
    if (costs.moving_probes > 0)
        ImGui::Text("things move: %llu probes a frame", static_cast<unsigned long long>(costs.moving_probes));
    const auto plot = [](const char* name, const auto& values) {
        const float most = std::max(1.0f, std::ranges::max(values));
        ImGui::SetNextItemWidth(-1);
        ImGui::PlotLines(fmt::format("##{}", name).c_str(), values.data(), static_cast<int>(values.size()), 0,
                         fmt::format("{}: us a frame, of {:.0f}", name, most).c_str(), 0, most, {0, 36});
    };
    plot("host", costs.host_us);
    plot("GPU", costs.gpu_us);
}

void drawLimits(Panels& panels, Runtime& lights) {
    if (!ImGui::CollapsingHeader("Limits")) return;
    UpdateLimits wanted = panels.limits;
    int receivers = static_cast<int>(wanted.receivers_max);
    constexpr int receivers_most = 1'000'000;
    label("texels");
    ImGui::SetNextItemWidth(-1);
    ImGui::SliderInt("##texels", &receivers, 0, receivers_most, receivers == 0 ? "all" : "%d",
                     ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
    label("tolerance");
    ImGui::SetNextItemWidth(-1);
    ImGui::SliderFloat("##tolerance", &wanted.tolerance_quanta, 0, 8, "%.1f steps", ImGuiSliderFlags_AlwaysClamp);
    wanted.receivers_max = static_cast<uint32_t>(std::clamp(receivers, 0, receivers_most));
    if (wanted == panels.limits) return;
    if (const auto done = lights.setLimits(wanted))
        panels.limits = wanted;
    else
        panels.message = done.error().message;
}

std::optional<CameraPose> drawView(Panels& panels, const Pack& pack) {
    std::optional<CameraPose> chosen;
    if (!ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen)) return chosen;
    label("speed");
    ImGui::SetNextItemWidth(-1);
    ImGui::SliderFloat("##speed", &panels.faster, 0.1f, 10, "%.1f",
                       ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
    const auto viewpoints = pack.viewpoints();
    const float end = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
    const ImGuiStyle& style = ImGui::GetStyle();
    for (size_t i = 0; i < viewpoints.size(); ++i) {
        const std::string& name = viewpoints[i].name;
        const float width = ImGui::CalcTextSize(name.c_str()).x + 2 * style.FramePadding.x;
        if (i > 0 && ImGui::GetItemRectMax().x + style.ItemSpacing.x + width < end) ImGui::SameLine();
        ImGui::PushID(static_cast<int>(i));
        if (ImGui::Button((name + "###view").c_str())) chosen = poseOf(viewpoints[i]);
        ImGui::PopID();
    }
    return chosen;
}

}  // namespace

void CostHistory::add(const UpdateStats& stats) {
    for (auto* values : {&host_us, &gpu_us}) std::ranges::rotate(*values, values->begin() + 1);
    host_us.back() = static_cast<float>(stats.host_us);
    gpu_us.back() = static_cast<float>(stats.gpu_us);
    moving_probes = stats.probes_resampled;
    if (stats.clusters > 0) last_change = stats;
}

PanelRequests drawPanels(Panels& panels, Controls& controls, Runtime& lights) {
    PanelRequests requests;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    constexpr ImGuiWindowFlags flags = ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove;
    ImGui::SetNextWindowPos({margin, margin});
    ImGui::SetNextWindowSizeConstraints({lights_width, 0}, {lights_width, size.y - 2 * margin});
    ImGui::Begin((panels.level + "###lights").c_str(), nullptr, flags);
    if (panels.has_script) {
        ImGui::Checkbox("script", &panels.script_runs);
        ImGui::SameLine();
        requests.restart = ImGui::Button("from the start");
    }
    drawElements(controls, lights);
    ImGui::End();

    ImGui::SetNextWindowPos({size.x - margin, margin}, ImGuiCond_Always, {1, 0});
    ImGui::SetNextWindowSizeConstraints({costs_width, 0}, {costs_width, size.y - 2 * margin});
    ImGui::Begin(fmt::format("{:.0f} frames/s###costs", ImGui::GetIO().Framerate).c_str(), nullptr, flags);
    ImGui::TextWrapped("%s", panels.device.c_str());
    drawCosts(panels.costs);
    drawLimits(panels, lights);
    requests.look_from = drawView(panels, lights.pack());
    ImGui::TextDisabled("W A S D Q E, right mouse button: fly\nF1 panels, F12 picture, Esc quits");
    if (!panels.message.empty()) ImGui::TextWrapped("%s", panels.message.c_str());
    ImGui::End();
    return requests;
}

}  // namespace dimmer::sample
