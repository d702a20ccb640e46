#pragma once

#include <map>
#include <string>

namespace panelgate::app {

/// What the program was built from: the short hash of a commit, "unknown" outside a repository.
const char* build_commit();
/// "clang 19.1.7"
const char* build_compiler();
/// That it was built with, by name: "boost" -> "1.81.0".
std::map<std::string, std::string> build_libraries();
/// For people: what `--version` prints, three lines.
std::string build_text();

}  // namespace panelgate::app
