#include "page.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/value.hpp>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "conduct.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/problem.hpp"
#include "routes.hpp"

namespace panelgate::web {

using Embedded = std::vector<std::pair<std::string_view, std::string_view>>;
const Embedded& shipped_openapi();

namespace json = boost::json;

/// The hash of kStyle; if kStyle changes, the failing test prints the new one.
const std::string_view kDocsPolicy =
    "default-src 'none'; style-src 'sha256-fWbekVYlHSwYu87tjV+rN7ks9fNyUO16S/JCn5FNdY8='; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

namespace {

constexpr std::string_view kStyle = R"(
:root{color-scheme:light dark;font:16px/1.5 system-ui,sans-serif}
body{max-width:60rem;margin:0 auto;padding:1rem}
h3{border-top:1px solid #8886;padding-top:1rem;overflow-wrap:anywhere}
code,pre{font:.9em ui-monospace,monospace}
pre{background:#8882;padding:.5rem;overflow-x:auto}
table{border-collapse:collapse;display:block;overflow-x:auto}
td,th{text-align:left;vertical-align:top;padding:.15rem .8rem .15rem 0}
.role{font-weight:normal;opacity:.75}
)";

std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == '&') {
            out += "&amp;";
        } else if (c == '<') {
            out += "&lt;";
        } else if (c == '>') {
            out += "&gt;";
        } else {
            out += c;
        }
    }
    return out;
}

std::string text_in(const json::object& object, std::string_view name) {
    const json::value* member = object.if_contains(name);
    return member != nullptr && member->is_string() ? escaped(member->get_string()) : "";
}

const json::object& object_in(const json::object& object, std::string_view name) {
    static const json::object kNone;
    const json::value* member = object.if_contains(name);
    return member != nullptr && member->is_object() ? member->get_object() : kNone;
}

const json::array& array_in(const json::object& object, std::string_view name) {
    static const json::array kNone;
    const json::value* member = object.if_contains(name);
    return member != nullptr && member->is_array() ? member->get_array() : kNone;
}

std::string code(const std::string& text) { return "<code>" + text + "</code>"; }

/// "Reading" for {"$ref": "#/components/schemas/Reading"}, "" for anything else.
std::string name_of_reference(const json::object& object) {
    const std::string path = text_in(object, "$ref");
    return path.substr(path.rfind('/') + 1);
}

/// The object that a reference points to, or the object itself.
const json::object& resolved(const json::object& document, const json::object& object,
                             std::string_view kind) {
    const std::string name = name_of_reference(object);
    if (name.empty()) return object;
    return object_in(object_in(object_in(document, "components"), kind), name);
}

/// A short text for a type: "array of Register", "integer or null", "one of a, b".
std::string type_text(const json::object& schema) {
    const std::string name = name_of_reference(schema);
    if (!name.empty()) return "<a href=\"#" + name + "\">" + name + "</a>";
    std::string text;
    const auto add = [&text](const std::string& word, const char* between) {
        text += (text.empty() ? "" : between) + word;
    };
    for (const json::value& one : array_in(schema, "oneOf"))
        add(type_text(one.as_object()), " or ");
    for (const json::value& word : array_in(schema, "enum")) {  // null may be one of them
        const json::string* words = word.if_string();
        add(code(words ? escaped(std::string_view(*words)) : json_text(word)), ", ");
    }
    if (!text.empty()) return text;
    if (const json::value* fixed = schema.if_contains("const")) return code(json_text(*fixed));
    for (const json::value& type : array_in(schema, "type"))
        add(escaped(std::string_view(type.as_string())), " or ");
    if (text.empty()) text = text_in(schema, "type");
    const json::object& items = object_in(schema, "items");
    if (!items.empty()) text += " of " + type_text(items);
    return text;
}

std::string row(std::initializer_list<std::string> cells) {
    std::string text = "<tr>";
    for (const std::string& cell : cells) text += "<td>" + cell + "</td>";
    return text + "</tr>\n";
}

std::string members_of(const json::object& schema) {
    std::string rows;
    for (const auto& [name, value] : object_in(schema, "properties")) {
        const json::object& member = value.as_object();
        rows += row({code(escaped(std::string_view(name))), type_text(member),
                     text_in(member, "description")});
    }
    return rows.empty() ? "" : "<table>\n" + rows + "</table>\n";
}

std::string schema_section(std::string_view name, const json::object& schema) {
    std::string text = "<h3 id=\"" + std::string(name) + "\">" + std::string(name) + "</h3>\n";
    text += "<p>" + text_in(schema, "description") + "</p>\n";
    if (object_in(schema, "properties").empty()) return text + "<p>" + type_text(schema) + "</p>\n";
    text += members_of(schema);
    return text;
}

std::string content_of(const json::object& with_content) {
    std::string text;
    for (const auto& [media, value] : object_in(with_content, "content")) {
        const json::object& content = value.as_object();
        text +=
            code(escaped(std::string_view(media))) + ' ' + type_text(object_in(content, "schema"));
        if (const json::value* example = content.if_contains("example"))
            text += "<pre>" + escaped(json_text(*example)) + "</pre>";
    }
    return text;
}

std::string parameters_of(const json::object& document, const json::object& operation) {
    std::string rows;
    for (const json::value& value : array_in(operation, "parameters")) {
        const json::object& parameter = resolved(document, value.as_object(), "parameters");
        const json::value* example = parameter.if_contains("example");
        rows += row({code(text_in(parameter, "name")), text_in(parameter, "in"),
                     type_text(object_in(parameter, "schema")), text_in(parameter, "description"),
                     example == nullptr ? "" : code(escaped(json_text(*example)))});
    }
    return rows.empty() ? "" : "<table>\n" + rows + "</table>\n";
}

std::string answers_of(const json::object& document, const json::object& operation) {
    std::string rows;
    for (const auto& [status, value] : object_in(operation, "responses")) {
        const json::object& answer = resolved(document, value.as_object(), "responses");
        rows += row({code(escaped(std::string_view(status))), text_in(answer, "description"),
                     content_of(answer)});
    }
    return "<table>\n" + rows + "</table>\n";
}

std::string operation_section(const json::object& document, const std::string& title,
                              const json::object& operation) {
    std::string text = "<h3 id=\"" + text_in(operation, "operationId") + "\"><code>" + title +
                       "</code> <span class=\"role\">" + text_in(operation, "x-role") +
                       "</span></h3>\n";
    text += "<p>" + text_in(operation, "summary") + "</p>\n";
    text += "<p>" + text_in(operation, "description") + "</p>\n";
    text += parameters_of(document, operation);
    const std::string body = content_of(object_in(operation, "requestBody"));
    if (!body.empty()) text += "<p>Body: " + body + "</p>\n";
    return text + answers_of(document, operation);
}

std::string upper(std::string_view verb) {
    std::string text(verb);
    for (char& c : text) c = static_cast<char>(c - 'a' + 'A');
    return text;
}

std::string operations_of(const json::object& document, const std::string& tag) {
    std::string text;
    for (const auto& [path, verbs] : object_in(document, "paths")) {
        for (const auto& [verb, value] : verbs.as_object()) {
            const json::object& operation = value.as_object();
            const json::array& tags = array_in(operation, "tags");
            if (tags.empty() || escaped(std::string_view(tags[0].as_string())) != tag) continue;
            const std::string title = upper(verb) + ' ' + escaped(std::string_view(path));
            text += operation_section(document, title, operation);
        }
    }
    return text;
}

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

std::string docs_page(const json::object& document) {
    const json::object& info = object_in(document, "info");
    std::string page =
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
        "<meta name=\"viewport\" content=\"width=device-width\">"
        "<title>panelgate: REST</title><style>" +
        std::string(kStyle) + "</style></head><body>\n<h1>" + text_in(info, "title") + ' ' +
        text_in(info, "version") + "</h1>\n<p>" + text_in(info, "description") +
        "</p>\n<p>For programs: <a href=\"/openapi.json\">openapi.json</a></p>\n";
    for (const json::value& value : array_in(document, "tags")) {
        const std::string tag = text_in(value.as_object(), "name");
        page += "<h2>" + tag + "</h2>\n<p>" + text_in(value.as_object(), "description") + "</p>\n";
        page += operations_of(document, tag);
    }
    page += "<h2>What bodies have</h2>\n";
    for (const auto& [name, schema] : object_in(object_in(document, "components"), "schemas"))
        page += schema_section(name, schema.as_object());
    return page + "</body></html>\n";
}

namespace {

/// Only content from this server, and no inline scripts or styles.
constexpr const char* kPolicy =
    "default-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'; "
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
