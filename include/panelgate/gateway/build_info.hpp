#pragma once

#include <map>
#include <string>

namespace panelgate::gateway {

/// What the program was built from: the short hash of a commit, "unknown" outside a repository.
const char* build_commit();
/// "clang 19.1.7"
const char* build_compiler();
/// Libraries that it was built with, name to version: "boost" -> "1.81.0".
std::map<std::string, std::string> build_libraries();
/// The three lines that `--version` prints.
std::string build_text();

}  // namespace panelgate::gateway
