#include <algorithm>
#include <string>
#include <string_view>

#include "conduct.hpp"
#include "handlers.hpp"
#include "page_file.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {
namespace {

/// Nothing but what this server sends, and no script or style within the page.
constexpr const char* kPolicy =
    "default-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'; "
    "object-src 'none'";

HttpResponse answer(const HttpRequest& request, const PageFile& file) {
    HttpResponse response;
    response.content_type = file.type;
    const auto asked = request.headers.find("if-none-match");
    const bool known = tell_tag(response, asked == request.headers.end() ? "" : asked->second,
                                "W/\"" + std::string(file.hash) + '"');
    response.headers.emplace_back("Cache-Control", "no-cache");
    response.headers.emplace_back("Vary", "Accept-Encoding");
    response.headers.emplace_back("Content-Security-Policy", kPolicy);
    response.headers.emplace_back("Referrer-Policy", "no-referrer");
    if (known) return response;
    const auto coding = request.headers.find("accept-encoding");
    const std::string_view packed(reinterpret_cast<const char*>(file.packed.data()),
                                  file.packed.size());
    if (coding != request.headers.end() && accepts_gzip(coding->second)) {
        response.headers.emplace_back("Content-Encoding", "gzip");
        response.body = packed;
    } else {
        response.body = unpacked(packed);
    }
    return response;
}

HttpResponse page_file(const HttpRequest& request, std::string_view name) {
    const auto files = shipped_page();
    const auto found = std::ranges::find(files, name, &PageFile::name);
    if (found == files.end()) return to_response(problem(404, "there is nothing at this path"));
    return answer(request, *found);
}

}  // namespace

Handling get_index(HttpRequest request, const Api*) { co_return page_file(request, "index.html"); }

Handling get_page(HttpRequest request, const Api*) {
    co_return page_file(request, request.arguments[0]);
}

}  // namespace panelgate::web
