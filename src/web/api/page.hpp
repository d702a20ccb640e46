#pragma once

#include <boost/json/object.hpp>
#include <span>
#include <string>
#include <string_view>

namespace panelgate::web {

/// A file of the dashboard, compiled into the program.
struct PageFile {
    std::string_view name;                  ///< "index.html", "scope.js"
    std::string_view type;                  ///< for Content-Type
    std::string_view hash;                  ///< another one when the file differs
    std::span<const unsigned char> packed;  ///< in the content coding gzip
};

/// All of them; "index.html" is the page.
std::span<const PageFile> shipped_page();

/// openapi.json, made of the parts that were compiled into the program.
const std::string& openapi_text();
/// An OpenAPI document as a page for people: no script, and nothing from elsewhere. Pure.
std::string docs_page(const boost::json::object& document);
/// What a browser may do with that page: show it, with its own style.
extern const std::string_view kDocsPolicy;

}  // namespace panelgate::web
