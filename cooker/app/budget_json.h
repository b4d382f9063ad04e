// What a pack costs against its budgets, as `cook --json` and `inspect --json` write it.
#pragma once

#include <pipeline/budget.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>

namespace dimmer::cook {

// Without `file_bytes` there is no file.
nlohmann::ordered_json bytesJson(const PackCost& cost, std::optional<uint64_t> file_bytes);
nlohmann::ordered_json elementsJson(const PackData& pack, const PackCost& cost);
// In bytes; 0: no limit.
nlohmann::ordered_json budgetsJson(const Profile& profile);

}  // namespace dimmer::cook
