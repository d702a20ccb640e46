#pragma once

#include <span>
#include <string>
#include <string_view>

namespace panelgate::web {

/// A file of the dashboard or the manual, compiled into the program.
struct PageFile {
    std::string_view name;                  ///< "index.html", "scope.js"
    std::string_view type;                  ///< for Content-Type
    std::string_view hash;                  ///< changes with the file's content
    std::span<const unsigned char> packed;  ///< in the content coding gzip
};

/// All files; "index.html" is the page.
std::span<const PageFile> shipped_page();
/// The manual (deploy/manual/site.py): "index.html", "tasks/tokens.html"; "rest.html" is REST's
/// page.
std::span<const PageFile> shipped_docs();

/// The text of openapi.json, assembled from the embedded parts.
const std::string& openapi_text();

}  // namespace panelgate::web
