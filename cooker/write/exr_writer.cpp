#include <write/exr_writer.h>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <fmt/format.h>

#include <cstring>
#include <exception>
#include <new>

namespace dimmer::cook {
namespace {

// OpenEXR writes to streams of its own kind.
class MemoryOutput : public Imf::OStream {
   public:
    MemoryOutput() : Imf::OStream("memory") {}
    void write(const char from[], int count) override {
        const auto size = static_cast<size_t>(count);
        if (at_ + size > bytes_.size()) bytes_.resize(at_ + size);
        std::memcpy(bytes_.data() + at_, from, size);
        at_ += size;
    }
    uint64_t tellp() override { return at_; }
    void seekp(uint64_t position) override { at_ = position; }
    std::vector<std::byte> take() { return std::move(bytes_); }

   private:
    std::vector<std::byte> bytes_;
    size_t at_ = 0;
};

void write(const ExrPicture& picture, MemoryOutput& stream) {
    const Imath::V2i first(static_cast<int>(picture.x), static_cast<int>(picture.y));
    const Imath::V2i size(static_cast<int>(picture.window_width), static_cast<int>(picture.window_height));
    const Imath::V2i whole(static_cast<int>(picture.width), static_cast<int>(picture.height));
    const Imath::V2i one(1, 1);
    Imf::Header header(Imath::Box2i({0, 0}, whole - one), Imath::Box2i(first, first + size - one));
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::FrameBuffer frame;
    const size_t row_bytes = picture.window_width * sizeof(float);
    for (const ExrChannel& channel : picture.channels) {
        header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
        // A slice's base is where pixel (0, 0) would lie, outside of the window perhaps: unsigned arithmetic wraps.
        const uintptr_t base =
            reinterpret_cast<uintptr_t>(channel.values.data()) - picture.x * sizeof(float) - picture.y * row_bytes;
        frame.insert(channel.name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(base), sizeof(float), row_bytes));
    }
    Imf::OutputFile file(stream, header, 0);
    file.setFrameBuffer(frame);
    file.writePixels(size.y);
}

}  // namespace

Expected<std::vector<std::byte>> exrBytes(const ExrPicture& picture) {
    try {
        MemoryOutput stream;
        write(picture, stream);
        return stream.take();
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& problem) {
        return fail(ErrorCode::Internal, fmt::format("an OpenEXR picture could not be made: {}", problem.what()));
    }
}

}  // namespace dimmer::cook
