# Writes OUTPUT with a hash of the files listed in LIST, one per line, and of the text TOOLS.
file(STRINGS "${LIST}" files)
set(all "${TOOLS}")
foreach(file ${files})
    file(SHA1 "${file}" hash)
    string(APPEND all "${hash}")
endforeach()
string(SHA1 stamp "${all}")
file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT
"#pragma once
#include <string_view>
namespace dimmer::cook {
inline constexpr std::string_view code_stamp = \"${stamp}\";
}
")
