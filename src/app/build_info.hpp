#pragma once

namespace panelgate::app {

/// What the program was built from: the short hash of a commit, "unknown" outside a repository.
const char* build_commit();
/// "clang 19.1.7"
const char* build_compiler();

}  // namespace panelgate::app
