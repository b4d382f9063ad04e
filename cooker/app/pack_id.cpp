#include <app/pack_id.h>
#include <format/layout.h>

#include <fmt/format.h>

#include <fstream>

namespace dimmer::cook {

std::string packId(const std::filesystem::path& pack) {
    format::Header header{};
    std::ifstream in(pack, std::ios::binary);
    if (!in.read(reinterpret_cast<char*>(&header), sizeof(header))) return "";
    return fmt::format("{:016x}", header.xxh64);
}

}  // namespace dimmer::cook
