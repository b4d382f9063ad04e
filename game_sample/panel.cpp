#include "panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

namespace dimmer::sample {
namespace {

constexpr float margin = 8, lights_width = 280, costs_width = 270, label_width = 90;

// The rest of the line is for what follows.
void label(const char* name) {
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(name);
    ImGui::SameLine(label_width);
}

void drawSet(Controls& controls, const Element& element, uint32_t set) {
    ImGui::PushID(static_cast<int>(set));
    Tint tint = controls.tint(set);
    std::array<float, 3> color = {tint.color.r, tint.color.g, tint.color.b};
    label(element.name.c_str());
    bool on = tint.brightness > 0, changed = false;
    if (ImGui::Checkbox("##on", &on)) {
        tint.brightness = on ? std::min(1.0f, element.max_weight) : 0;
        changed = true;
    }
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-60);
    changed = ImGui::SliderFloat("##brightness", &tint.brightness, 0, element.max_weight, "%.2f",
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

Expected<void> drawDoor(Controls& controls, Runtime& lights, const Element& element, uint32_t door) {
    ImGui::PushID(static_cast<int>(door));
    float open = lights.open(Door{door});
    label(element.name.c_str());
    ImGui::SetNextItemWidth(-60);
    Expected<void> done{};
    if (ImGui::SliderFloat("##open", &open, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp))
        done = lights.setDoor(Door{door}, open);
    ImGui::SameLine();
    if (ImGui::Button(open > 0.5f ? "close" : "open", {-1, 0})) controls.send(door, open > 0.5f ? 0.0f : 1.0f);
    ImGui::PopID();
    return done;
}

Expected<void> drawElements(Controls& controls, Runtime& lights) {
    const auto elements = lights.pack().elements();
    const auto all = [&](ElementKind kind) {
        return std::ranges::any_of(elements, [&](const Element& e) { return e.kind == kind; });
    };
    if (all(ElementKind::LightSet) && ImGui::CollapsingHeader("Light sets", ImGuiTreeNodeFlags_DefaultOpen)) {
        for (uint32_t i = 0; i < elements.size(); ++i)
            if (elements[i].kind == ElementKind::LightSet) drawSet(controls, elements[i], i);
        for (const auto& [text, state] : {std::pair{"all on", "all=1"}, std::pair{"all off", "all=0"}}) {
            if (ImGui::Button(text)) (void)lights.apply(state);  // refused where a set's maximum is below 1
            ImGui::SameLine();
        }
        if (ImGui::Button("copy as text")) ImGui::SetClipboardText(controls.text().c_str());
        if (ImGui::IsItemHovered()) ImGui::SetTooltip("for a script's \"at FRAME set\", --state, LightState::apply()");
    }
    if (all(ElementKind::Door) && ImGui::CollapsingHeader("Doors", ImGuiTreeNodeFlags_DefaultOpen))
        for (uint32_t i = 0; i < elements.size(); ++i)
            if (elements[i].kind == ElementKind::Door)
                if (auto done = drawDoor(controls, lights, elements[i], i); !done) return done;
    return {};
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

Expected<void> drawLimits(Panels& panel, Runtime& lights) {
    if (!ImGui::CollapsingHeader("Limits")) return {};
    int receivers = static_cast<int>(std::min(panel.limits.receivers_max, 1'000'000u));
    label("texels");
    ImGui::SetNextItemWidth(-1);
    bool changed = ImGui::SliderInt("##texels", &receivers, 0, 1'000'000, receivers == 0 ? "all" : "%d",
                                    ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
    label("tolerance");
    ImGui::SetNextItemWidth(-1);
    changed = ImGui::SliderFloat("##tolerance", &panel.limits.tolerance_quanta, 0, 8, "%.1f steps",
                                 ImGuiSliderFlags_AlwaysClamp) ||
              changed;
    panel.limits.receivers_max = static_cast<uint32_t>(receivers);
    return changed ? lights.setLimits(panel.limits) : Expected<void>{};
}

void drawView(Panels& panel, const Pack& pack) {
    if (!ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen)) return;
    label("speed");
    ImGui::SetNextItemWidth(-1);
    ImGui::SliderFloat("##speed", &panel.faster, 0.1f, 10, "%.1f", ImGuiSliderFlags_Logarithmic);
    for (const Viewpoint& viewpoint : pack.viewpoints()) {
        if (ImGui::Button(viewpoint.name.c_str()))
            if (const auto pose = findCamera(pack, viewpoint.name)) panel.look_from = *pose;
        const float next = ImGui::GetItemRectMax().x + 100;
        if (next < ImGui::GetWindowPos().x + ImGui::GetWindowWidth()) ImGui::SameLine();
    }
    ImGui::NewLine();
}

}  // namespace

void CostHistory::add(const UpdateStats& stats) {
    for (auto* values : {&host_us, &gpu_us}) std::ranges::rotate(*values, values->begin() + 1);
    host_us.back() = static_cast<float>(stats.host_us);
    gpu_us.back() = static_cast<float>(stats.gpu_us);
    moving_probes = stats.probes_resampled;
    if (stats.clusters > 0) last_change = stats;
}

Expected<void> drawPanels(Panels& panels, Controls& controls, Runtime& lights) {
    panels.look_from.reset();
    panels.restart = false;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    constexpr ImGuiWindowFlags flags = ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove;
    ImGui::SetNextWindowPos({margin, margin});
    ImGui::SetNextWindowSizeConstraints({lights_width, 0}, {lights_width, size.y - 2 * margin});
    ImGui::Begin(panels.level.c_str(), nullptr, flags);
    if (panels.has_script) {
        ImGui::Checkbox("script", &panels.script_runs);
        ImGui::SameLine();
        panels.restart = ImGui::Button("from the start");
    }
    auto done = drawElements(controls, lights);
    ImGui::End();

    ImGui::SetNextWindowPos({size.x - margin, margin}, ImGuiCond_Always, {1, 0});
    ImGui::SetNextWindowSizeConstraints({costs_width, 0}, {costs_width, size.y - 2 * margin});
    ImGui::Begin(fmt::format("{:.0f} frames/s###costs", ImGui::GetIO().Framerate).c_str(), nullptr, flags);
    ImGui::TextWrapped("%s", panels.device.c_str());
    drawCosts(panels.costs);
    if (done) done = drawLimits(panels, lights);
    drawView(panels, lights.pack());
    ImGui::TextDisabled("W A S D Q E, right mouse button: fly\nF1 panels, F12 picture, Esc quits");
    ImGui::End();
    return done;
}

}  // namespace dimmer::sample
