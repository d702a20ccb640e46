#include "page.hpp"

#include <algorithm>
#include <cstdlib>

#include "answer.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "routes.hpp"

namespace panelgate::web {

using Embedded = std::vector<std::pair<std::string_view, std::string_view>>;
const Embedded& shipped_openapi();

namespace {

/// The members of one part of the document: the text between its outer braces.
std::string members_in(std::string_view part) {
    for (const auto& [name, text] : shipped_openapi()) {
        if (name == part) {
            const auto first = text.find('{') + 1;
            return std::string(text.substr(first, text.rfind('}') - first));
        }
    }
    std::abort();
}

}  // namespace

const std::string& openapi_text() {
    static const std::string text = "{" + members_in("head") + ",\n\"paths\": {" +
                                    members_in("paths") + "},\n\"components\": {" +
                                    members_in("components") + "}}\n";
    return text;
}

namespace {

/// Only content from this server, and no inline scripts or styles.
constexpr const char* kPolicy =
    "default-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'; "
    "object-src 'none'";

HttpResponse answer(const HttpRequest& request, const PageFile& file) {
    HttpResponse response;
    response.content_type = file.type;
    const auto asked = request.headers.find("if-none-match");
    const bool known = add_etag(response, asked == request.headers.end() ? "" : asked->second,
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

HttpResponse file_of(std::span<const PageFile> files, const HttpRequest& request,
                     std::string_view name) {
    const auto found = std::ranges::find(files, name, &PageFile::name);
    if (found == files.end()) return to_response(problem(404, "there is nothing at this path"));
    return answer(request, *found);
}

}  // namespace

Handling get_index(HttpRequest request, const Api*) {
    co_return file_of(shipped_page(), request, "index.html");
}

Handling get_page(HttpRequest request, const Api*) {
    co_return file_of(shipped_page(), request, request.arguments[0]);
}

/// Links of a page are relative: /docs and /docs/ cannot be the same one.
Handling get_docs(HttpRequest request, const Api*) {
    co_return file_of(shipped_docs(), request, request.folder ? "index.html" : "rest.html");
}

Handling get_manual(HttpRequest request, const Api*) {
    std::string name;
    for (const std::string& segment : request.arguments) name += '/' + segment;
    if (request.folder) name += "/index.html";
    co_return file_of(shipped_docs(), request, std::string_view(name).substr(1));
}

}  // namespace panelgate::web
