#include <report/page_pictures.h>

#include <dimmer/cpu_runtime.h>
#include <format/texel.h>
#include <write/png_writer.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// Pixels of all pages; every `step`-th texel is one.
class Canvas {
   public:
    Canvas(const Pack& pack, uint32_t side_max, uint32_t channels) : channels_(channels) {
        step_ = (std::max(pack.pageWidth(), pack.pageHeight()) + side_max - 1) / side_max;
        width_ = (pack.pageWidth() + step_ - 1) / step_;
        height_ = (pack.pageHeight() + step_ - 1) / step_;
        pages_.assign(pack.pageCount(), std::vector<uint8_t>(size_t{width_} * height_ * channels_));
        used_.assign(pack.pageCount(), false);
    }

    // The pixel of a texel; null where the texel has none.
    uint8_t* pixel(uint32_t page, uint32_t x, uint32_t y) {
        if (x % step_ != 0 || y % step_ != 0) return nullptr;
        return &pages_[page][(size_t{y / step_} * width_ + x / step_) * channels_];
    }
    void use(uint32_t page) { used_[page] = true; }

    Expected<std::vector<std::string>> encode(bool all) const {
        std::vector<std::string> pictures(pages_.size());
        for (size_t page = 0; page < pages_.size(); ++page) {
            if (!all && !used_[page]) continue;
            const auto png = pngBytes(width_, height_, channels_, pages_[page]);
            if (!png) return std::unexpected(png.error());
            pictures[page] = "data:image/png;base64," + base64(*png);
        }
        return pictures;
    }

   private:
    uint32_t channels_, step_ = 1, width_ = 0, height_ = 0;
    std::vector<std::vector<uint8_t>> pages_;
    std::vector<bool> used_;
};

// x / (1 + x), then IEC 61966-2-1's curve, near enough for a picture.
uint8_t display(float value) {
    return static_cast<uint8_t>(255 * std::pow(value / (1 + value), 1 / 2.2f) + 0.5f);
}

float medianLuminance(const Pack& pack, std::span<const uint32_t> pages) {
    std::vector<float> lit;
    for (const uint32_t texel : pages) {
        const auto [r, g, b] = decodeColor(pack.colorFormat(), texel);
        if (const float l = dimmer::luminance(r, g, b); l > 0) lit.push_back(l);
    }
    if (lit.empty()) return 1;
    const auto middle = lit.begin() + static_cast<std::ptrdiff_t>(lit.size() / 2);
    std::ranges::nth_element(lit, middle);
    return *middle;
}

bool holds(const Contribution& c, uint32_t element) {
    return c.light_set == element || std::ranges::count(c.doors_open, element) > 0 ||
           std::ranges::count(c.doors_closed, element) > 0;
}

// Luminance that an element's contributions add at each receiver, at weight 1; below 0 where none is stored.
std::vector<float> regionOf(const PackData& d, uint32_t element) {
    std::vector<float> light(d.addresses.size(), -1);
    for (const Cluster& cluster : d.clusters)
        for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t) {
            if (!holds(d.contributions[d.terms[t].contribution], element)) continue;
            for (uint32_t i = 0; i < cluster.receiver_count; ++i) {
                const TexelRecord& record = d.payload[d.terms[t].first_record + i];
                if (record.irradiance == 0) continue;  // its cluster's neighbours have that contribution
                const auto [r, g, b] = decodeColor(d.color_format, canonical(d.color_format, record).irradiance);
                float& sum = light[cluster.first_receiver + i];
                sum = std::max(sum, 0.0f) + dimmer::luminance(r, g, b);
            }
        }
    return light;
}

}  // namespace

std::string base64(std::span<const std::byte> bytes) {
    constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t group = 0;
        for (size_t k = 0; k < 3; ++k)
            group = group << 8 | (i + k < bytes.size() ? static_cast<uint32_t>(bytes[i + k]) : 0);
        for (size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[group >> (18 - 6 * k) & 63];
    }
    return text;
}

Expected<std::vector<std::string>> PagePictures::light(const Pack& pack) const {
    CpuRuntime runtime(pack);
    runtime.update();
    const auto texels = runtime.irradiancePages();
    const float scale = 0.25f / medianLuminance(pack, texels);
    Canvas canvas(pack, side_max, 3);
    size_t i = 0;
    for (uint32_t page = 0; page < pack.pageCount(); ++page)
        for (uint32_t y = 0; y < pack.pageHeight(); ++y)
            for (uint32_t x = 0; x < pack.pageWidth(); ++x, ++i)
                if (uint8_t* pixel = canvas.pixel(page, x, y)) {
                    const auto light = decodeColor(pack.colorFormat(), texels[i]);
                    for (size_t c = 0; c < 3; ++c) pixel[c] = display(light[c] * scale);
                }
    return canvas.encode(true);
}

Expected<std::vector<std::string>> PagePictures::overlap(const Pack& pack) const {
    const PackData& d = pack.data();
    Canvas canvas(pack, side_max, 3);
    for (uint32_t page = 0; page < d.page_count; ++page)
        for (uint32_t y = 0; y < d.page_height; ++y)
            for (uint32_t x = 0; x < d.page_width; ++x)
                if (uint8_t* pixel = canvas.pixel(page, x, y)) std::ranges::copy(overlap_colours[0], pixel);
    for (const Cluster& cluster : d.clusters)
        for (uint32_t i = 0; i < cluster.receiver_count; ++i) {
            const uint32_t a = d.addresses[cluster.first_receiver + i];
            uint8_t* pixel = canvas.pixel(TexelAddress::page(a), TexelAddress::x(a), TexelAddress::y(a));
            if (pixel)
                std::ranges::copy(overlap_colours[std::min<size_t>(cluster.term_count, overlap_colours.size() - 1)],
                                  pixel);
        }
    return canvas.encode(true);
}

Expected<std::vector<std::string>> PagePictures::region(const Pack& pack, uint32_t element) const {
    const PackData& d = pack.data();
    const std::vector<float> light = regionOf(d, element);
    const float most = light.empty() ? 0 : std::ranges::max(light);
    Canvas canvas(pack, side_max, 1);
    for (size_t r = 0; r < light.size(); ++r) {
        if (light[r] < 0) continue;
        const uint32_t a = d.addresses[r];
        canvas.use(TexelAddress::page(a));
        uint8_t* pixel = canvas.pixel(TexelAddress::page(a), TexelAddress::x(a), TexelAddress::y(a));
        if (!pixel) continue;
        const float decades = light[r] > 0 ? std::log10(most / light[r]) : 4.0f;
        *pixel = static_cast<uint8_t>(255 - 191 * std::clamp(decades / 4, 0.0f, 1.0f));
    }
    return canvas.encode(false);
}

}  // namespace dimmer::cook
