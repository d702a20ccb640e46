#include "beast_message.hpp"

#include <boost/beast/http/error.hpp>
#include <utility>

namespace panelgate::web {
namespace http = boost::beast::http;

HttpRequest to_request(BeastRequest&& message, Target target) {
    HttpRequest request;
    request.method = message.method_string();
    request.path = std::move(target.path);
    request.query = std::move(target.query);
    for (const char* name : kHeadersRead) {
        const auto field = message.find(name);
        if (field != message.end()) request.headers[name] = field->value();
    }
    request.body = std::move(message.body());
    return request;
}

bool is_parse_error(boost::system::error_code why) {
    return why.category() == http::make_error_code(http::error::bad_method).category() &&
           why != http::error::end_of_stream && why != http::error::partial_message;
}

Problem problem_of_parse(boost::system::error_code why, std::size_t max_body) {
    if (why == http::error::body_limit) {
        return problem(413, "a body has at most " + std::to_string(max_body) + " bytes");
    }
    if (why == http::error::header_limit || why == http::error::buffer_overflow) {
        return problem(431, "a header has at most " + std::to_string(kHeaderLimit) + " bytes");
    }
    return problem(400, "this is not an HTTP/1.1 request: " + why.message());
}

}  // namespace panelgate::web
