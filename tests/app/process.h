// Runs a tool as a user's shell would.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace dimmer::test {

struct ProcessResult {
    int exit_code = -1;  // 128 + the signal's number when it was killed, as shells say it
    std::string out, err;
};

// Waits for the end. `input` is what it reads on stdin.
ProcessResult runProcess(const std::string& program, const std::vector<std::string>& arguments,
                         const std::string& input = "");

// All bytes of a file; none of one that cannot be read.
std::string readText(const std::filesystem::path& path);

// Sends `signal` as soon as `when`, asked again and again with what stderr holds so far, says so.
ProcessResult runInterrupted(const std::string& program, const std::vector<std::string>& arguments, int signal,
                             const std::function<bool(const std::string& err)>& when);

inline ProcessResult runDimmer(const std::vector<std::string>& arguments, const std::string& input = "") {
    return runProcess(DIMMER_TOOL, arguments, input);
}

}  // namespace dimmer::test
