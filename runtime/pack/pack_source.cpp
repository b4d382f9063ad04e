#include <pack/pack_source.h>

#include <fmt/format.h>

#include <cerrno>
#include <system_error>

namespace dimmer {

Expected<FileSource> FileSource::open(const std::filesystem::path& path) {
    FileSource source;
    std::error_code error;
    source.size_ = std::filesystem::file_size(path, error);
    errno = 0;
    if (!error) source.file_.open(path, std::ios::binary);  // a pipe, which has no size, would block
    if (!source.file_.is_open()) {
        if (!error) error.assign(errno, std::generic_category());
        return fail(ErrorCode::Io, fmt::format("the pack cannot be opened: {}", error.message()));
    }
    return source;
}

Expected<std::span<const std::byte>> FileSource::read(uint64_t offset, uint64_t bytes) {
    piece_.resize(bytes);
    file_.seekg(static_cast<std::streamoff>(offset));
    if (bytes > 0 && !file_.read(reinterpret_cast<char*>(piece_.data()), static_cast<std::streamsize>(bytes)))
        return fail(ErrorCode::Io, "reading stopped before its end");
    return std::span<const std::byte>(piece_);
}

}  // namespace dimmer
