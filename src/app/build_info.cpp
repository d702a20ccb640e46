#include "build_info.hpp"

#define PANELGATE_TEXT_OF(x) #x
#define PANELGATE_TEXT(x) PANELGATE_TEXT_OF(x)

namespace panelgate::app {

const char* build_commit() { return PANELGATE_COMMIT; }

const char* build_compiler() {
#ifdef __clang__
    return "clang " PANELGATE_TEXT(__clang_major__) "." PANELGATE_TEXT(
        __clang_minor__) "." PANELGATE_TEXT(__clang_patchlevel__);
#else
    return "gcc " __VERSION__;
#endif
}

}  // namespace panelgate::app
