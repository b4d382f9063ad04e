// References to files beside the level.
#pragma once

#include <string>
#include <vector>

namespace dimmer::cook {

// RFC 3986, 2.1. What is no escape stays as it is.
std::string percentDecoded(const std::string& uri);

// The other way round, of a path: what a URI's path must not hold as it is.
std::string percentEncoded(const std::string& path);

// What a base64 data URI of whatever media type holds; false for others, and for none. The parser decodes those types
// alone that it knows.
bool decodeDataUri(const std::string& uri, std::vector<unsigned char>& bytes);

// As the parser joins them: one '/' between, also below the root, whose name ends with it.
std::string pathIn(const std::string& folder, const std::string& name);

}  // namespace dimmer::cook
