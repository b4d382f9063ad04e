#include <app/pack_id.h>
#include <format/layout.h>

#include <fmt/format.h>

#include <fstream>

namespace dimmer::cook {

std::string packId(const std::filesystem::path& pack) {
    format::Header header{};
    std::ifstream in(pack, std::ios::binary);
    if (!in.read(reinterpret_cast<char*>(&header), sizeof(header))) return "";
    return packId(header.xxh64);
}

std::string packId(uint64_t header_hash) {
    return fmt::format("{:016x}", header_hash);
}

}  // namespace dimmer::cook
