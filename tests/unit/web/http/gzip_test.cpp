#include "panelgate/web/http/gzip.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <string>

namespace panelgate::web::gzip_test {
namespace {

std::string gunzip(std::string body) {
    z_stream z{};
    EXPECT_EQ(inflateInit2(&z, 15 + 16), Z_OK);
    std::string text(4'000'000, '\0');
    z.next_in = reinterpret_cast<Bytef*>(body.data());
    z.avail_in = static_cast<uInt>(body.size());
    z.next_out = reinterpret_cast<Bytef*>(text.data());
    z.avail_out = static_cast<uInt>(text.size());
    EXPECT_EQ(inflate(&z, Z_FINISH), Z_STREAM_END) << "whole, with the right CRC";
    EXPECT_EQ(z.avail_in, 0u);
    text.resize(z.total_out);
    inflateEnd(&z);
    return text;
}

TEST(Gzip, GivesBackWhatWentIn) {
    Gzip gzip;
    std::string text;
    for (int i = 0; i < 20'000; ++i) {
        const std::string piece = "panelgate_point_value{point=\"p" + std::to_string(i) + "\"} 7\n";
        text += piece;
        gzip.add(piece);
    }
    const std::string body = gzip.finish();
    EXPECT_LT(body.size(), text.size() / 5);
    EXPECT_EQ(gunzip(body), text);
}

TEST(Gzip, OfNothingIsABody) { EXPECT_EQ(gunzip(Gzip().finish()), ""); }

TEST(Unpacked, GivesBackWhatWasPackedAndNothingOfWhatWasNot) {
    Gzip gzip;
    const std::string text(300'000, 'x');
    gzip.add(text);
    const std::string body = gzip.finish();
    EXPECT_EQ(unpacked(body), text);
    EXPECT_EQ(unpacked(body.substr(0, body.size() / 2)), "");
    EXPECT_EQ(unpacked("not packed"), "");
    EXPECT_EQ(unpacked(""), "");
}

TEST(AcceptsGzip, WhereItIsNamedAndNotRefused) {
    for (const char* header : {"gzip", "GZIP", "deflate, gzip;q=1.0, *;q=0.5", "br,gzip ; q=0.1"})
        EXPECT_TRUE(accepts_gzip(header)) << header;
    for (const char* header : {"", "identity", "deflate", "gzip;q=0", "gzip; q=0.000", "gzipped",
                               "*", ",", ";", "br;gzip"})
        EXPECT_FALSE(accepts_gzip(header)) << header;
}

}  // namespace
}  // namespace panelgate::web::gzip_test
