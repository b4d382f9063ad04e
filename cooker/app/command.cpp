#include <app/command.h>

#include <app/say.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace dimmer::cook {

int exitCodeOf(ErrorCode code) {
    switch (code) {
        case ErrorCode::InvalidArgument:
        case ErrorCode::NotFound:
        case ErrorCode::BadInput:
        case ErrorCode::Io:
            return exit_bad_input;
        case ErrorCode::OverBudget:
            return exit_over_budget;
        case ErrorCode::Unsupported:
        case ErrorCode::OutOfMemory:
        case ErrorCode::DeviceLost:
        case ErrorCode::Internal:
            return exit_our_fault;
    }
    return exit_our_fault;
}

int reportError(const Error& error) {
    sayMessage("error: " + error.message);
    return exitCodeOf(error.code);
}

Expected<void> writeJson(const nlohmann::ordered_json& json, const std::string& file) {
    const std::string text = json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    if (file == "-") {
        std::fwrite(text.data(), 1, text.size(), stdout);  // main() looks whether it could be written
        return {};
    }
    return writeFileAtomically(file, std::as_bytes(std::span(text)));
}

std::string refuseNotFinite(const std::string& text) {
    return std::isfinite(std::strtod(text.c_str(), nullptr)) ? "" : text + " is no finite number";
}

std::string refuseNoShare(const std::string& text) {
    if (std::strtod(text.c_str(), nullptr) < 0) return "a share of 0 or more is due, not " + text;
    return refuseNotFinite(text);
}

}  // namespace dimmer::cook
