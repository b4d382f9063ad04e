# Writes the words of INPUT as a constexpr array.
file(READ "${INPUT}" hex HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])([0-9a-f][0-9a-f])([0-9a-f][0-9a-f])([0-9a-f][0-9a-f])" "0x\\4\\3\\2\\1,"
       words "${hex}")
file(WRITE "${OUTPUT}"
     "#pragma once\n#include <cstdint>\nnamespace dimmer::spirv {\ninline constexpr uint32_t ${NAME}[] = {${words}};\n}\n")
