#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "panelgate/imports/import.hpp"

using namespace panelgate;

/// What is made of a file is a YAML text of one document, whatever the file holds.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    yaml::Problems problems("file");
    bool is_known = false;
    const auto made = imports::import_tags(text, problems, is_known);
    if (made && !problems.empty()) std::abort();
    if (made && !is_known) std::abort();
    if (made && made->yaml.find("\nlines:\n") == std::string::npos) std::abort();
    return 0;
}
