// What `cook --json` writes.
#pragma once

#include <pipeline/cook.h>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace dimmer::cook {

enum class Verdict { Cooked, OverBudget };

// Of a pack that is over its budgets all but what only a file has: its id and its bytes.
nlohmann::ordered_json cookJson(Verdict verdict, const CookOptions& options,
                                const std::vector<std::filesystem::path>& inputs, const CookResult& result);
nlohmann::ordered_json suggestionsJson(const CookStats& stats);

// Removes what an earlier cook wrote there, so that nobody takes it for this one's; anything else stays.
Expected<void> removeCookJson(const std::string& file);

}  // namespace dimmer::cook
