// The text of the configuration: a file, which stays the truth.
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <utility>

#include "answer.hpp"
#include "exchange.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/api/values.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "routes.hpp"

namespace panelgate::web {

namespace json = boost::json;

namespace {

constexpr std::string_view kYaml = "text/yaml; charset=utf-8";

TextSource& source_of(const Api& api) {
    if (api.providers.text == nullptr) refuse(404, "this program serves no configuration as text");
    return *api.providers.text;
}

/// A text that a worker makes.
HttpResponse made_later(std::function<void(HttpResponse&)> make) {
    HttpResponse response;
    response.is_long = true;
    response.finish = std::move(make);
    return response;
}

std::string etag_of(std::string_view sha256) { return '"' + std::string(sha256) + '"'; }

void set_json(HttpResponse& made, const json::object& body) { made.body = json_text(body) + '\n'; }

}  // namespace

Handling get_configuration_text(HttpRequest request, const Api* api) {
    co_return made_later(
        [read = source_of(*api).reader(),
         known = std::string(header(request, "if-none-match"))](HttpResponse& made) {
            const TextSource::File file = read();
            if (!file.text) {
                made = to_response(problem(500, "the text cannot be read: " + file.why));
                return;
            }
            made.content_type = kYaml;
            made.headers.emplace_back("Allow", file.why.empty() ? "GET, HEAD, PUT" : "GET, HEAD");
            if (add_etag(made, known, etag_of(file.sha256))) return;
            made.body = *file.text;
        });
}

Handling post_configuration_check(HttpRequest request, const Api* api) {
    co_return made_later([judge = source_of(*api).judge(), text = std::move(request.body)](
                             HttpResponse& made) { set_json(made, judge(text)); });
}

Handling post_configuration_insert(HttpRequest request, const Api* api) {
    const json::object body = parse_object(request.body, {"into", "item", "text"}).value();
    const json::value* item = body.if_contains("item");
    if (item == nullptr || !item->is_object())
        refuse(400, "send {\"into\": \"lines/LINE/stations\", \"item\": {...}}");
    std::optional<std::string> given;
    if (body.contains("text")) given = string_member(body, "text").value();
    co_return made_later([insert = source_of(*api).inserter(),
                          path = string_member(body, "into").value(), object = item->get_object(),
                          given = std::move(given)](HttpResponse& made) {
        const TextSource::Inserted done = insert(given, path, object);
        if (done.text)
            set_json(made, {{"text", *done.text}, {"line", done.line}});
        else
            made = to_response(problem(422, done.why));
    });
}

Handling get_configuration_schema(HttpRequest, const Api* api) {
    co_return made_later(
        [schema = source_of(*api).schema()](HttpResponse& made) { set_json(made, schema()); });
}

namespace {

/// The answer to a text that was to be written.
HttpResponse answer_of(const TextVerdict& verdict) {
    using State = TextVerdict::State;
    if (verdict.state == State::written) {
        json::object body{{"applied", true}, {"changes", verdict.changes}};
        if (!verdict.reload->later.empty())
            body["restart_needed"] =
                json::array(verdict.reload->later.begin(), verdict.reload->later.end());
        HttpResponse response = json_response(200, body);
        response.headers.emplace_back("ETag", etag_of(verdict.sha256));
        return response;
    }
    Problem made = problem(500, verdict.why + "; nothing has changed");
    if (verdict.state == State::stale) {
        made = problem(412, "the file has changed since you have read it; nothing is written");
        made.headers.emplace_back("ETag", etag_of(verdict.sha256));
    } else if (verdict.state == State::invalid) {
        made = problem(422, "the text has faults; nothing is written", "invalid-configuration");
        made.extensions["problems"] = verdict.problems;
    } else if (verdict.state == State::read_only) {
        made = problem(405, verdict.why);
        made.headers.emplace_back("Allow", "GET, HEAD");
    } else if (verdict.state == State::not_applied) {
        made = problem(409, verdict.why + "; the file is as it was", "reload-failed");
    }
    return to_response(made);
}

Handling write(TextSource& source, std::string text, std::string expected,
               std::shared_ptr<Caller> caller) {
    caller->take_effect();
    std::function<void(std::function<void(TextVerdict)>)> start =
        [&](std::function<void(TextVerdict)> done) {
            source.write(std::move(text), std::move(expected), caller->name(), std::move(done));
        };
    boost::asio::awaitable<TextVerdict> writing = result_of<TextVerdict>(std::move(start));
    const TextVerdict verdict = co_await std::move(writing);
    co_return answer_of(verdict);
}

}  // namespace

Handling put_configuration_text(HttpRequest request, const Api* api) {
    TextSource& source = source_of(*api);
    std::string expected(header(request, "if-match"));
    if (expected.empty())
        refuse(428, "send If-Match with the ETag of the text that you have changed");
    Handling writing = write(source, std::move(request.body), std::move(expected), request.caller);
    co_return co_await std::move(writing);
}

Handling get_configuration_versions(HttpRequest, const Api* api) {
    json::array versions;
    for (const TextVersion& one : source_of(*api).versions())
        versions.push_back(json::object{{"version", one.version},
                                        {"time", rfc3339(one.time)},
                                        {"who", one.who},
                                        {"sha256", one.sha256}});
    co_return json_response(200, json::object{{"versions", std::move(versions)}});
}

namespace {

std::string text_of(const TextSource& source, const std::string& version) {
    const auto number = to_number<std::uint64_t>(version);
    auto text = number ? source.version(*number) : std::nullopt;
    if (!text)
        refuse(404, "no version '" + excerpt(version) + "' is kept; GET .../versions lists them");
    return std::move(*text);
}

}  // namespace

Handling get_configuration_version(HttpRequest request, const Api* api) {
    co_return text_response(200, text_of(source_of(*api), request.arguments[0]), kYaml);
}

Handling post_configuration_rollback(HttpRequest request, const Api* api) {
    TextSource& source = source_of(*api);
    const json::object body = parse_object(request.body, {"version"}).value();
    constexpr std::int64_t kMost = std::int64_t{1} << 53;
    const std::int64_t version = number_member(body, "version", 1, kMost).value();
    std::string text = text_of(source, std::to_string(version));
    Handling writing = write(source, std::move(text), "*", request.caller);
    co_return co_await std::move(writing);
}

}  // namespace panelgate::web
