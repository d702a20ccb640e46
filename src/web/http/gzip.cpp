#include "panelgate/web/http/gzip.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <limits>
#include <new>
#include <utility>

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

struct Gzip::Stream {
    Stream() {
        if (deflateInit2(&z, kLevel, Z_DEFLATED, kGzipWindow, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
            throw std::bad_alloc();
    }
    ~Stream() { deflateEnd(&z); }

    /// Compresses all input of z, flushing as `flush` requests.
    void run(int flush) {
        std::array<char, 64 * 1024> space;
        do {
            z.next_out = reinterpret_cast<Bytef*>(space.data());
            z.avail_out = static_cast<uInt>(space.size());
            deflate(&z, flush);  // Z_BUF_ERROR: nothing to do
            body.append(space.data(), space.size() - z.avail_out);
        } while (z.avail_out == 0);
    }

    z_stream z{};
    std::string body;
};

Gzip::Gzip() : stream_(std::make_unique<Stream>()) {}

Gzip::~Gzip() = default;

void Gzip::add(std::string_view piece) {
    while (!piece.empty()) {
        const auto size = std::min<std::size_t>(piece.size(), std::numeric_limits<uInt>::max());
        // zlib only reads, but takes no const.
        stream_->z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(piece.data()));
        stream_->z.avail_in = static_cast<uInt>(size);
        stream_->run(Z_NO_FLUSH);
        piece.remove_prefix(size);
    }
}

std::string Gzip::finish() {
    stream_->run(Z_FINISH);
    return std::move(stream_->body);
}

}  // namespace panelgate::web
