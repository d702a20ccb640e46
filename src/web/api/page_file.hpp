#pragma once

#include <span>
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

}  // namespace panelgate::web
