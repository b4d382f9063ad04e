# GLSL to SPIR-V at build time: glslang compiles, spirv-val checks, and the words are embedded as a C++ array
# `dimmer::spirv::<name>` in <spirv/<name>.h>, where <name> is the file's name with dots as underscores. A third argument
# is added to each name, and those after it are options of glslang, so that a folder can be built in several ways.
find_program(GLSLANG glslangValidator REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)

function(dimmer_embed_shaders target folder)
    set(out "${CMAKE_CURRENT_BINARY_DIR}/${target}_shaders")
    file(MAKE_DIRECTORY "${out}/spirv")
    file(GLOB sources CONFIGURE_DEPENDS "${folder}/*.comp" "${folder}/*.vert" "${folder}/*.frag")
    file(GLOB_RECURSE includes CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/shaders/include/*.glsl" "${folder}/*.glsl")
    list(POP_FRONT ARGN suffix)
    set(headers)
    foreach(source ${sources})
        get_filename_component(file "${source}" NAME)
        string(REPLACE "." "_" name "${file}${suffix}")
        set(spv "${out}/${name}.spv")
        set(header "${out}/spirv/${name}.h")
        add_custom_command(
            OUTPUT "${header}"
            COMMAND "${GLSLANG}" --target-env vulkan1.2 --quiet ${ARGN} "-I${CMAKE_CURRENT_SOURCE_DIR}/shaders/include"
                    "${source}" -o "${spv}"
            COMMAND "${SPIRV_VAL}" --target-env vulkan1.2 "${spv}"
            COMMAND "${CMAKE_COMMAND}" "-DINPUT=${spv}" "-DOUTPUT=${header}" "-DNAME=${name}" -P
                    "${CMAKE_CURRENT_SOURCE_DIR}/cmake/embed.cmake"
            DEPENDS "${source}" ${includes} "${CMAKE_CURRENT_SOURCE_DIR}/cmake/embed.cmake"
            COMMENT "SPIR-V ${file}${suffix}"
            VERBATIM)
        list(APPEND headers "${header}")
    endforeach()
    target_sources(${target} PRIVATE ${headers})
    target_include_directories(${target} PRIVATE "${out}")
endfunction()
