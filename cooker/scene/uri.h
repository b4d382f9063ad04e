// References to files beside the level.
#pragma once

#include <string>

namespace dimmer::cook {

// RFC 3986, 2.1. What is no escape stays as it is.
std::string percentDecoded(const std::string& uri);

}  // namespace dimmer::cook
