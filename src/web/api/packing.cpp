#include "packing.hpp"

#include <cstddef>
#include <string_view>
#include <utility>

#include "long_answer.hpp"
#include "panelgate/web/http/gzip.hpp"

namespace panelgate::web {
namespace {

constexpr std::size_t kPackedOfATurn = 16 * 1024;  ///< bytes: some 0.3 ms

}  // namespace

boost::asio::awaitable<std::string> packed(std::string body) {
    Gzip gzip;
    for (std::string_view left = body; !left.empty();) {
        const std::string_view piece = left.substr(0, kPackedOfATurn);
        gzip.add(piece);
        left.remove_prefix(piece.size());
        boost::asio::awaitable<void> turn = others_turn();
        if (!left.empty()) co_await std::move(turn);
    }
    co_return gzip.finish();
}

}  // namespace panelgate::web
