// Where keys stand in a JSON text, for messages.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

namespace dimmer::cook {

// Lines (from 1) of the keys of nested objects, by dotted path; of a key that is written twice, the last. The text must
// have been parsed without error.
std::map<std::string, size_t> linesOfKeys(std::string_view json);

}  // namespace dimmer::cook
