# Embeds profiles/*.json as <shipped_profiles.h>: constexpr pairs of name and text, so that a tool needs no data files.
function(dimmer_embed_profiles target)
    set(out "${CMAKE_CURRENT_BINARY_DIR}/${target}_profiles")
    file(GLOB files CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/profiles/*.json")
    list(FILTER files EXCLUDE REGEX "/schema\\.json$")
    set(body "")
    foreach(file ${files})
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
        get_filename_component(name "${file}" NAME_WE)
        file(READ "${file}" text)
        string(APPEND body "    {\"${name}\", R\"json(${text})json\"},\n")
    endforeach()
    file(CONFIGURE OUTPUT "${out}/shipped_profiles.h" CONTENT
"#pragma once
#include <string_view>
#include <utility>
namespace dimmer::cook {
inline constexpr std::pair<std::string_view, std::string_view> shipped_profiles[] = {
@body@};
}
" @ONLY)
    target_include_directories(${target} PRIVATE "${out}")
endfunction()
