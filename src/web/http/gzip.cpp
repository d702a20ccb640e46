#include "panelgate/web/http/gzip.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>
#include <new>

#include "panelgate/base/text.hpp"

namespace panelgate::web {
namespace {

/// zlib.h, deflateInit2: a window of 2^15; plus 16 for a gzip header and trailer.
constexpr int kGzipWindow = 15 + 16;
/// For text as repetitive as /metrics: 9 would take four times as long to save a third.
constexpr int kLevel = 1;
constexpr int kMemory = 8;  // zlib's default

}  // namespace

bool accepts_gzip(std::string_view accept_encoding) {
    std::string codings = to_lower(accept_encoding);
    std::erase(codings, ' ');
    const auto at = codings.find("gzip");
    if (at == codings.npos) return false;
    const std::string weight = codings.substr(at + 4, codings.find(',', at) - at - 4);
    return !weight.starts_with(";q=0") || weight.find_first_of("123456789") != weight.npos;
}

std::string unpacked(std::string_view body) {
    z_stream z{};
    if (inflateInit2(&z, kGzipWindow) != Z_OK) throw std::bad_alloc();
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(body.data()));
    z.avail_in = static_cast<uInt>(body.size());
    std::array<char, 64 * 1024> space;
    std::string text;
    int state = Z_OK;
    while (state == Z_OK) {
        z.next_out = reinterpret_cast<Bytef*>(space.data());
        z.avail_out = static_cast<uInt>(space.size());
        state = inflate(&z, Z_NO_FLUSH);
        text.append(space.data(), space.size() - z.avail_out);
    }
    inflateEnd(&z);
    return state == Z_STREAM_END ? text : std::string();
}

std::string packed(std::string_view body) {
    z_stream z{};
    if (deflateInit2(&z, kLevel, Z_DEFLATED, kGzipWindow, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::bad_alloc();
    const std::unique_ptr<z_stream, decltype(&deflateEnd)> owned(&z, deflateEnd);
    // zlib only reads, but takes no const.
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(body.data()));
    z.avail_in = static_cast<uInt>(body.size());
    std::array<char, 64 * 1024> space;
    std::string text;
    do {
        z.next_out = reinterpret_cast<Bytef*>(space.data());
        z.avail_out = static_cast<uInt>(space.size());
        deflate(&z, Z_FINISH);
        text.append(space.data(), space.size() - z.avail_out);
    } while (z.avail_out == 0);
    return text;
}

}  // namespace panelgate::web
