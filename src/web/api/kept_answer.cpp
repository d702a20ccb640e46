#include "kept_answer.hpp"

#include <utility>

#include "conduct.hpp"
#include "packing.hpp"
#include "panelgate/web/http/gzip.hpp"

namespace panelgate::web {

KeptAnswer::KeptAnswer(std::string text, std::string_view content_type)
    : text_(std::make_shared<const std::string>(std::move(text))),
      tag_(tag_of(*text_)),
      content_type_(content_type) {}

boost::asio::awaitable<HttpResponse> KeptAnswer::give(std::shared_ptr<KeptAnswer> self,
                                                      HttpRequest request) {
    HttpResponse response;
    response.content_type = self->content_type_;
    const bool known = tell_tag(response, request.headers["if-none-match"], self->tag_);
    response.headers.emplace_back("Vary", "Accept-Encoding");
    if (known) co_return response;
    response.shared_body = self->text_;
    if (!accepts_gzip(request.headers["accept-encoding"])) co_return response;
    if (!self->packed_) {
        boost::asio::awaitable<std::string> packing = packed(*self->text_);
        self->packed_ = std::make_shared<const std::string>(co_await std::move(packing));
    }
    response.shared_body = self->packed_;
    response.headers.emplace_back("Content-Encoding", "gzip");
    co_return response;
}

}  // namespace panelgate::web
