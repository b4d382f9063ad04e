// Errors are values: every call that can fail returns Expected<T>; nothing throws across the API,
// but for std::bad_alloc where the host has no memory left.
#pragma once

#include <expected>
#include <string>
#include <utility>

#ifndef __cpp_lib_expected
#error "Dimmer's headers need C++23: std::expected. Compile with -std=c++23 (CMake: target_link_libraries sets it)."
#endif

namespace dimmer {

enum class ErrorCode {
    InvalidArgument,  // the caller's value is out of its range; nothing was changed
    NotFound,         // no light set, door or shipped profile of that name
    BadInput,         // a file's content cannot be used; the message says where and how to mend it
    Unsupported,      // the device or this build lacks something that is needed
    OutOfMemory,      // host or device memory
    DeviceLost,       // the Vulkan device is gone; destroy the runtime and create it anew
    OverBudget,       // the result does not fit the profile's budget
    Io,               // a file is not there, or could not be read or written
    Internal,         // a broken promise of ours; please report it
};

struct Error {
    ErrorCode code = ErrorCode::Internal;
    std::string message;  // one or two full sentences, with the name of the thing concerned
};

template <class T>
using Expected = std::expected<T, Error>;

inline std::unexpected<Error> fail(ErrorCode code, std::string message) {
    return std::unexpected(Error{code, std::move(message)});
}

}  // namespace dimmer
