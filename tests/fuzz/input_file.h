// A file that a target overwrites for each input, for readers that take a path.
#pragma once

#include <fuzz/target.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace dimmer::fuzz {

// In a folder of this process's own; removed at the end.
class InputFile {
   public:
    explicit InputFile(const std::string& name)
        : folder_(memoryFolder() / ("dimmer_fuzz_" + std::to_string(getpid()) + "_" + name)), path_(folder_ / name) {
        std::filesystem::create_directories(folder_);
    }
    ~InputFile() {
        std::error_code ignored;
        std::filesystem::remove_all(folder_, ignored);
    }
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;

    const std::filesystem::path& path() const { return path_; }
    void write(Input input) const {
        std::ofstream(path_, std::ios::binary | std::ios::trunc)
            .write(reinterpret_cast<const char*>(input.data()), static_cast<std::streamsize>(input.size()));
    }

   private:
    // A folder in memory, where there is one: a disk takes a millisecond for each input.
    static std::filesystem::path memoryFolder() {
        const std::filesystem::path shared = "/dev/shm";
        return access(shared.c_str(), W_OK) == 0 ? shared : std::filesystem::temp_directory_path();
    }
    std::filesystem::path folder_, path_;
};

}  // namespace dimmer::fuzz
