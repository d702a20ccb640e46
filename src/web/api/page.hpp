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
    std::string_view hash;                  ///< changes with the file's content
    std::span<const unsigned char> packed;  ///< in the content coding gzip
};

/// All files; "index.html" is the page.
std::span<const PageFile> shipped_page();

/// The text of openapi.json, assembled from the embedded parts.
const std::string& openapi_text();
/// Renders an OpenAPI document as an HTML page without scripts or external resources. Pure.
std::string docs_page(const boost::json::object& document);
/// The Content-Security-Policy of that page: its own style only.
extern const std::string_view kDocsPolicy;

}  // namespace panelgate::web
